"""Exact l2-induced norms of discrete-time periodic systems, with a bracket; the H-infinity norm is the case N = 1.

A level g is a singular value of the lifted transfer matrix at the angle t iff e^{jt} is an eigenvalue of a symplectic
pencil (Boyd and Balakrishnan, Syst. Control Lett. 15, 1990; Bruinsma and Steinbuch, ibid. 14, 1990; here for periodic
systems, with the pencil composed stage by stage so that its size stays 2n for every period). In continuous time the
pencil is a Hamiltonian matrix, and the search the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.periodic import (
    LiftedResponse,
    PeriodicSystem,
    Stage,
    compressed,
    frequency_response,
    largest_singular_value,
    simulate,
)
from replication.estimation.linear.riccati import RiccatiMap, circle_angles, gramians, stacked
from replication.estimation.validation import Array, ComplexArray, as_matrix, positive_integer

UPPER_MARGIN = 1e-9
"""Relative distance from the attained lower bound to the level at which the pencil is tested for the upper bound."""
CIRCLE_TOLERANCE = 1e-7
"""Eigenvalues nearer than this to the unit circle count as on it: the square root of rounding, for double ones."""
AXIS = 1e-8
"""The same of the imaginary axis, relative to the eigenvalue and the rate of the system."""
ON_CIRCLE = 1e-12
"""Multipliers nearer than this to the unit circle are on it, for all that their digits tell: of an undamped mode."""
NONE = 1e-150
"""A gain whose square has no inverse is none."""
MAX_ROUNDS = 60
ANGLES = 200
"""Points of a gain over the frequency."""
DENSE_INPUTS = 300
"""Up to so many inputs over a period the lifted response is a matrix, above it an operator (`LiftedResponse`)."""
GROUP = 100_000
"""Entries of responses that are formed at once."""
SAMPLES = tuple(np.linspace(0.0, np.pi, 8)[1:-1].tolist())
"""Angles at which the response is looked at before a bracket is believed."""


@dataclass(frozen=True)
class GainBracket:
    """Bracket of an induced norm. lower: attained at the lifted angle `angle` (radians per period); upper: no crossing.

    Of a system in continuous time `angle` is the frequency (rad/s).
    `value` is the lower end: a singular value that was evaluated.
    """

    lower: float
    upper: float
    angle: float

    @property
    def value(self) -> float:
        """The norm, to the relative width of the bracket."""
        return self.lower


def hinf_norm(A: npt.ArrayLike, B: npt.ArrayLike, C: npt.ArrayLike, D: npt.ArrayLike) -> GainBracket:
    """H-infinity norm of the discrete-time system (A, B, C, D); raises InfeasibleError if A is not Schur stable."""
    return l2_gain(
        PeriodicSystem((Stage(*(as_matrix(name, M) for name, M in zip("ABCD", (A, B, C, D), strict=True))),))
    )


def continuous_norm(A: Array, B: Array, C: Array, D: Array) -> GainBracket:
    """H-infinity norm of the continuous-time system (A, B, C, D); raises InfeasibleError if it is not stable.

    The level-set iteration on angles 2 arctan(omega / rate); crossings are eigenvalues of a Hamiltonian matrix.
    """
    A, (units, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    B, C = B / units[:, None], C * units
    sizes = np.linalg.norm(B), np.linalg.norm(C)
    alike = 2.0 ** np.round(np.log2(sizes[0] / sizes[1]) / 2.0) if all(sizes) else 1.0
    B, C = B / alike, C * alike
    triangle, basis = scipy.linalg.schur(A, output="complex")
    poles, left, right = np.diag(triangle), C @ basis, basis.conj().T @ B
    if poles.real.max() >= 0.0:
        raise InfeasibleError(f"the system is unstable (abscissa {poles.real.max():.3g}): its norm is infinite")
    rate = float(np.exp(np.mean(np.log(np.abs(poles)))))

    def value(angle: float) -> float:
        shifted = 1j * rate * np.tan(angle / 2.0) * np.eye(len(A)) - triangle
        return float(np.linalg.norm(left @ scipy.linalg.solve_triangular(shifted, right) + D, 2))

    def crossings(level: float) -> Array:
        inputs, outputs = (level**2 * np.eye(len(M)) - M @ M.T for M in (D.T, D))
        drift = A + B @ np.linalg.solve(inputs, D.T @ C)
        reach, sight = level * B @ np.linalg.solve(inputs, B.T), -level * C.T @ np.linalg.solve(outputs, C)
        values = np.linalg.eigvals(np.block([[drift, reach], [sight, -drift.T]]))
        on_axis = np.abs(values.real) <= AXIS * (rate + np.abs(values))
        return np.asarray(2.0 * np.arctan(np.abs(values.imag[on_axis]) / rate))

    slow = poles[np.argmax(poles.real / np.abs(poles))]
    bracket = peak(one_by_one(value), crossings, float(2.0 * np.arctan(np.abs(slow.imag) / rate)))
    return replace(bracket, angle=float(rate * np.tan(bracket.angle / 2.0)))


def l2_gain(system: PeriodicSystem) -> GainBracket:
    """The l2-induced norm sup ||z|| / ||v|| of a stable periodic system, with bracket.

    Raises InvalidInputError for another type, InfeasibleError if the system is not stable (its norm is infinite).
    """
    if not isinstance(system, PeriodicSystem):
        raise InvalidInputError(f"system must be a PeriodicSystem, got {type(system).__name__}; see hinf_norm for one")
    radius = system.spectral_radius()
    if radius >= 1.0:
        raise InfeasibleError(
            f"the system is not stable (largest characteristic multiplier has modulus {radius:.6g}), so its gain is "
            "infinite; stabilise it first"
        )
    if not any(stage.B.size for stage in system.stages) and not any(stage.D.size for stage in system.stages):
        return GainBracket(0.0, 0.0, 0.0)
    system = balanced(system)

    def maps(level: float) -> RiccatiMap:
        return stacked(bounded_real_map(stage, level) for stage in system.stages)

    return peak_on_circle(response_norm(system), maps, slowest_angle(system.monodromy()))


def settles(system: PeriodicSystem) -> bool:
    """Whether the system is stable by more than rounding leaves of a multiplier on the circle."""
    return system.spectral_radius() < 1.0 - ON_CIRCLE


def gain_if_finite(system: PeriodicSystem) -> float | None:
    """The upper end of the l2-induced norm; None if it is infinite, or if no bracket shows that it is not."""
    if not settles(system):
        return None
    try:
        return l2_gain(system).upper
    except (SolverError, np.linalg.LinAlgError):
        if system.spectral_radius() < 1.0 - CIRCLE_TOLERANCE:
            raise
        return None


Curve = Callable[[Array], Array]
"""A gain as a function of angles, all at once."""


def response_norm(system: PeriodicSystem) -> Curve:
    """The largest singular value of the lifted response as a function of the angle; formed in full only if small."""
    if sum(stage.B.shape[1] for stage in system.stages) <= DENSE_INPUTS:
        whole = compressed(system.lift())
        return in_groups(lambda angles: spectral_norm(frequency_response(whole, angles)), whole.D.size)
    response = LiftedResponse(system)

    def value(angle: float) -> float:
        forward, adjoint = response.at(angle)
        return largest_singular_value(lambda v: adjoint(forward(v)), response.inputs)

    return one_by_one(value)


def one_by_one(value: Callable[[float], float]) -> Curve:
    """The curve of a function of one angle."""
    return lambda angles: np.array([value(angle) for angle in angles.tolist()])


def in_groups(curve: Curve, entries: int) -> Curve:
    """The same curve, for so many angles at once that their matrices of so many `entries` fit."""
    size = max(1, GROUP // max(1, entries))
    return lambda angles: np.concatenate([curve(angles[i : i + size]) for i in range(0, len(angles), size)])


def gain_curve(system: PeriodicSystem, duration: float) -> tuple[Array, Array]:
    """Frequencies (rad/s) up to half a turn over the period of `duration` seconds, and the largest gain at each."""
    angles = np.linspace(0.0, np.pi, ANGLES)
    return angles / duration, response_norm(system)(angles)


def spectral_norm(matrices: ComplexArray) -> Array:
    """Largest singular values of a stack (..., p, m), from the smaller Gram matrices: as accurate as by an SVD for the
    largest one, and faster."""
    rows, columns = matrices.shape[-2:]
    conjugate = matrices.conj().mT
    gram = matrices @ conjugate if rows <= columns else conjugate @ matrices
    if not gram.shape[-1]:
        return np.zeros(gram.shape[:-2])
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(gram)[..., -1], 0.0)))


def slowest_angle(A: Array) -> float:
    """The angle in [0, pi] of the eigenvalue of A with the largest modulus."""
    poles = np.linalg.eigvals(A)
    return float(np.abs(np.angle(poles[np.argmax(np.abs(poles))])))


def bounded_real_map(stage: Stage, level: float) -> RiccatiMap:
    """The Riccati map of the bounded real lemma at `level` for one stage; its period map has a stabilising fixed point
    iff the gain is below the level."""
    A, B, C, D = stage
    inputs = np.eye(B.shape[1]) - D.T @ D / level**2
    outputs = np.eye(C.shape[0]) - D @ D.T / level**2
    return RiccatiMap(
        A + B @ np.linalg.solve(inputs, D.T @ C) / level**2,
        -C.T @ np.linalg.solve(outputs, C) / level**2,
        B @ np.linalg.solve(inputs, B.T),
    )


def peak_on_circle(curve: Curve, maps: Callable[[float], RiccatiMap], hint: float) -> GainBracket:
    """`peak` of a curve whose crossings of a level are the circle angles of `maps(level)`."""

    def crossings(level: float) -> Array:
        """Of the level, or of one next to it where the pencil does not compose."""
        for attempt in (level, level * (1 + UPPER_MARGIN / 10)):
            try:
                return circle_angles(maps(attempt), CIRCLE_TOLERANCE)
            except np.linalg.LinAlgError:
                continue
        raise SolverError(
            f"the pencil of the level {level:.6g} is lost in rounding: modes grow or decay by too many orders of "
            "magnitude over the period; shorten it, or rescale the states"
        )

    return peak(curve, crossings, hint)


def peak(curve: Curve, crossings_of: Callable[[float], Array], hint: float) -> GainBracket:
    """Supremum over [0, pi] of `curve`, from the angles in [0, pi] at which it crosses a level.

    hint: an angle at which to start beside 0 and pi, for example that of a lightly damped pole. Raises SolverError if
    the rounds run out (they end after a handful: the middles of the crossings close in on the peak quadratically).
    """
    values: dict[float, float] = {}

    def highest(angles: Sequence[float]) -> float:
        """The first angle with the largest value."""
        if new := [angle for angle in dict.fromkeys(angles) if angle not in values]:
            values.update(zip(new, curve(np.array(new)).tolist(), strict=True))
        return max(angles, key=values.__getitem__)

    highest((0.0, np.pi, hint, *SAMPLES))
    angle = highest((0.0, np.pi, hint))
    if not max(values.values()) > NONE:
        return GainBracket(0.0, 0.0, 0.0)
    if not values[angle] > NONE:
        angle = highest([*values])  # a level of nothing has no pencil
    margin = UPPER_MARGIN
    for _ in range(MAX_ROUNDS):
        level = max(values[angle], np.finfo(float).tiny) * (1 + margin)
        crossings = crossings_of(level)
        edges = np.unique([0.0, *crossings, np.pi])
        middles = (edges[:-1] + edges[1:]) / 2
        # An all-pass response has no peak to cross, and its pencil is ill-conditioned: samples see it best.
        best = highest([*edges.tolist(), *middles.tolist()] if crossings.size else SAMPLES)
        if values[best] > values[angle] * (1 + 1e-14):
            angle = best
        elif not crossings.size:
            return GainBracket(values[angle], level, angle)
        else:
            # Eigenvalues feign a crossing because the peak is flat or the pencil ill-conditioned: test a wider margin.
            margin *= 4
    raise SolverError(
        f"the peak of the gain was not bracketed in {MAX_ROUNDS} rounds: a mode hardly settles, or numbers lie too far "
        "apart; let it settle faster, or choose other units"
    )


def balanced(system: PeriodicSystem) -> PeriodicSystem:
    """A stable system in state units that make reachability and observability alike, whatever the given units were."""
    reach = _gramian_diagonal([(s.A, s.B) for s in system.stages])
    sight = _gramian_diagonal([(s.A.T, s.C.T) for s in system.stages[::-1]])
    with np.errstate(divide="ignore", invalid="ignore"):
        # A state without one of the two has no effect; the other alone then sets its unit.
        units = np.where(sight > 0, np.where(reach > 0, (reach / sight) ** 0.25, sight**-0.5), reach**0.5)
    units = np.where((units > 0) & np.isfinite(units), units, 1.0)
    return PeriodicSystem(
        tuple(Stage(A / units[:, None] * units, B / units[:, None], C * units, D) for A, B, C, D in system.stages)
    )


def _gramian_diagonal(stages: Sequence[tuple[Array, Array]]) -> Array:
    reached = gramians(stages)
    return np.ones(len(stages[0][0])) if reached is None else np.diag(reached[0])


def white_noise_variance(system: PeriodicSystem) -> float:
    """Mean over one period of the stationary output variance, summed over channels, for white inputs of unit intensity.

    Raises InfeasibleError if the system is not stable.
    """
    stable = system.spectral_radius() < 1
    covariances = gramians((s.A, s.B) for s in system.stages) if stable else None
    if covariances is None:
        raise InfeasibleError(
            "the system is not stable, so its outputs have no stationary variance; stabilise it first"
        )
    total = 0.0
    for stage, covariance in zip(system.stages, covariances, strict=True):
        total += float(np.trace(stage.C @ covariance @ stage.C.T + stage.D @ stage.D.T))
    return total / system.period


def rms_if_finite(system: PeriodicSystem) -> float | None:
    """The root of `white_noise_variance`; None if it is infinite."""
    return float(np.sqrt(white_noise_variance(system))) if settles(system) else None


@dataclass(frozen=True, eq=False)
class Response:
    """inputs (T, m), outputs (T, p), and `ratio`, the l2 norm of the outputs over that of the inputs."""

    inputs: Array
    outputs: Array
    ratio: float


def worst_case_response(system: PeriodicSystem, horizon: int) -> Response:
    """The input of unit norm over `horizon` instants, from rest, whose output over them is largest, and that output.

    Its ratio is a lower bound of the l2-induced norm and tends to it as the horizon grows. Leading singular vector of
    the horizon's input-output matrix, formed in full: cost grows with the cube of the horizon. Raises InvalidInputError
    for a horizon below one, or stages of unequal input width.
    """
    horizon = positive_integer("horizon", horizon)
    m = system.stages[0].B.shape[1]
    if any(stage.B.shape[1] != m for stage in system.stages):
        raise InvalidInputError("all stages must have the same number of inputs")
    repeated = PeriodicSystem(tuple(system.stages[k % system.period] for k in range(horizon)))
    operator = repeated.lift().D
    last = horizon * m - 1
    _, vectors = scipy.linalg.eigh(operator.T @ operator, subset_by_index=[last, last])
    v = vectors[:, 0] * np.sign(vectors[np.argmax(np.abs(vectors[:, 0])), 0])
    inputs = v.reshape(horizon, m)
    outputs = simulate(system, inputs)
    return Response(inputs, outputs, float(np.linalg.norm(outputs) / np.linalg.norm(inputs)))
