"""The smallest achievable l2 gain of a multi-rate observer, exactly: non-causal bound and periodic Riccati recursion.

A level is achievable iff the Riccati recursion of `ScaledProblem.maps(level)` has a stabilising periodic solution
X_k >= 0 with I - W X_k W'/level^2 > 0 at every phase (necessary and sufficient, unlike a numerical SDP). No estimator,
not even a smoother, does better than the non-causal bound, so an optimum that meets it is bounded from both sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.norms import (
    DENSE_INPUTS,
    GainBracket,
    l2_gain,
    peak_on_circle,
    slowest_angle,
    spectral_norm,
)
from replication.estimation.linear.periodic import (
    LiftedResponse,
    PeriodicSystem,
    Stage,
    compressed,
    frequency_response,
    largest_singular_value,
)
from replication.estimation.linear.riccati import RiccatiMap, recentre
from replication.estimation.multirate.kalman import (
    KalmanCentre,
    RiccatiDesign,
    kalman_centre,
    kalman_design,
    largest_weighted,
    semidefinite,
    stabilises,
    state_scales,
    state_units,
    stationary,
)
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import (
    MultirateProblem,
    ScaledProblem,
    SensingSchedule,
    distinct_offsets,
    require_problem,
    scaled_problem,
)
from replication.estimation.validation import Array, ComplexArray, positive_scalar

NOISE = 1.0
"""Process noise, in state units, of the filter whose innovations stand for the measurements: any stable one does."""
ROUNDING = 1e-13
"""A gain below this share of the error system's own is rounding: it counts as zero."""


def noncausal_bound(problem: MultirateProblem) -> GainBracket:
    """sup over frequency of the best gain of any estimator that knows all measurements, past and future.

    With T_x from d to W x and T_y from d to the whitened measurements it is sqrt(lambda_max(T_x*T_x, I + T_y*T_y)).
    Evaluated on a stabilised error system instead, so that unstable plants and poles on the circle do no harm: with
    E from (d, w) to W e and V to the innovations, it is the norm of E on the kernel of V. Where the period is long the
    system is that of the Kalman filter, whose V has orthonormal rows, and no matrix is formed; raises as
    `kalman_design` then.
    """
    require_problem(problem)
    return bound_in(problem, state_units(problem))


def bound_in(problem: MultirateProblem, units: Array) -> GainBracket:
    """`noncausal_bound`, where the `state_units` of the problem are known."""
    inputs = sum(problem.plant.B_d.shape[1] + len(rows) for rows in problem.measured_rows())
    if inputs <= DENSE_INPUTS:
        scaled = scaled_problem(problem, state_scales(problem, units, NOISE))
        # In these coordinates the covariance of the filter is the identity at every phase.
        reference = np.stack([np.eye(problem.plant.order)] * problem.schedule.period)
        errors, innovations = _filter(scaled, scaled.corrected(reference, scaled.maps()))
        value = _dense(errors, innovations)
    else:
        centre = kalman_centre(problem)
        scaled, reference = centre.scaled, centre.states
        errors, innovations = _filter(scaled, scaled.corrected(reference, scaled.maps()))
        value = _by_operators(errors, _whitened(innovations, reference))

    def maps(level: float) -> RiccatiMap:
        return recentre(scaled.maps(level), reference)

    return peak_on_circle(value, maps, slowest_angle(errors.monodromy()))


def _filter(scaled: ScaledProblem, corrected: Array) -> tuple[PeriodicSystem, PeriodicSystem]:
    """The systems from (d, whitened w) to W e and to the innovations C_k e + w."""
    closed, gains = scaled.closed_loop(corrected), scaled.whitened_gains(corrected)
    errors, innovations = [], []
    for A, B, W, C, L in zip(closed, scaled.B, scaled.W, scaled.C, gains, strict=True):
        drive = np.hstack([B, -L])
        noise = np.hstack([np.zeros((len(C), B.shape[1])), np.eye(len(C))])
        errors.append(Stage(A, drive, W, np.zeros((len(W), drive.shape[1]))))
        innovations.append(Stage(A, drive, C, noise))
    return PeriodicSystem(tuple(errors)), PeriodicSystem(tuple(innovations))


def _dense(errors: PeriodicSystem, innovations: PeriodicSystem) -> Callable[[float], float]:
    """The norm of E on the kernel of V, both formed in full, as a function of the angle."""
    lifted_errors, lifted_innovations = compressed(errors.lift()), innovations.lift()

    def value(angle: float) -> float:
        E, V = frequency_response(lifted_errors, angle), frequency_response(lifted_innovations, angle)
        seen = np.linalg.qr(V.conj().T).Q
        found = spectral_norm(E - (E @ seen) @ seen.conj().T)
        return found if found > ROUNDING * float(np.linalg.norm(E)) else 0.0

    return value


def _whitened(innovations: PeriodicSystem, covariance: Array) -> PeriodicSystem:
    """The innovations of the Kalman filter in units of their covariance I + C_k X_k C_k': white, so V V* = I."""
    stages = []
    for stage, X in zip(innovations.stages, covariance, strict=True):
        root = np.linalg.cholesky(np.eye(len(stage.C)) + stage.C @ X @ stage.C.T)
        C, D = (np.asarray(np.linalg.solve(root, M), dtype=float) for M in (stage.C, stage.D))
        stages.append(Stage(stage.A, stage.B, C, D))
    return PeriodicSystem(tuple(stages))


def _by_operators(errors: PeriodicSystem, white: PeriodicSystem) -> Callable[[float], float]:
    """The norm of E (I - V*V), which is that on the kernel of V if V V* = I, as a function of the angle."""
    error_response, white_response = LiftedResponse(errors), LiftedResponse(white)
    size = error_response.inputs

    def value(angle: float) -> float:
        (E, E_adjoint), (V, V_adjoint) = error_response.at(angle), white_response.at(angle)

        def unseen(v: ComplexArray) -> ComplexArray:
            return v - V_adjoint(V(v))

        own = largest_singular_value(lambda v: E_adjoint(E(v)), size)
        return largest_singular_value(lambda v: unseen(E_adjoint(E(unseen(v)))), size, floor=ROUNDING * own)

    return value


LEVEL_TOLERANCE = 1e-12
"""Relative width at which the search over the level ends."""
DESIGN_MARGIN = 1e-8
"""Relative distance above the optimum at which gains are computed: at the optimum the recursion degenerates."""
TOUCHING = (1e-12, 1e-10, DESIGN_MARGIN)
"""Relative distances above the non-causal bound within which the optimum counts as sitting on it."""
NEAR = 1e-13
"""Relative distance of two guesses at which the search goes on to the ends of its bracket."""
LARGEST_TOLD, MISSED = 1e14, 1e-3
"""Variance of the error of a prediction, over that of the noise of the measurement that corrects it, from which on the
optimum is compared with what its gains reach; relative distance that is too much then.
"""
LAST = 4
"""How many points the next guess is drawn through."""
MAX_DOUBLINGS = 100
"""From the lower bound the level is doubled until it is achievable; this often only if rounding spoils the problem."""


@dataclass(frozen=True)
class Optimum:
    """Bracket of the smallest achievable gain, to rounding.

    lower: the largest level known to be out of reach, by the non-causal bound or by the Riccati condition.
    upper: the smallest level that passed the Riccati condition. It is an infimum in the making, not the gain of given
    gains: every level above it is reached by those of `riccati_design`, and those of `optimal_design` are computed
    DESIGN_MARGIN above it, for at the optimum itself the recursion degenerates. `l2_gain` of their error system is the
    gain achieved; it is at most (1 + DESIGN_MARGIN) upper, and may exceed upper by that much.
    noncausal: the bound for smoothers. limited_by: "noncausal" if the optimum sits on it, else "causal".
    """

    lower: float
    upper: float
    noncausal: GainBracket
    limited_by: str

    @property
    def value(self) -> float:
        """The optimum, to the relative width of the bracket."""
        return self.lower if self.limited_by == "noncausal" else self.upper


def riccati_design(problem: MultirateProblem, level: float) -> RiccatiDesign:
    """The central observer whose gain is below `level`.

    Raises InfeasibleError if no observer reaches it; otherwise as `kalman_design`.
    """
    return central(kalman_centre(problem), positive_scalar("level", level))


def central(centre: KalmanCentre, level: float) -> RiccatiDesign:
    """`riccati_design` from the Kalman filter of the problem, for many levels."""
    states, slack = _solution(centre, level)
    if states is None or slack <= 0:
        raise InfeasibleError(f"no observer has a gain below {level!r}; ask for a larger level (see `optimum`)")
    scaled = centre.scaled
    return RiccatiDesign(scaled.gains(scaled.corrected(states, scaled.maps(level))), scaled.unscaled(states), level)


def optimal_design(problem: MultirateProblem, *, margin: float = DESIGN_MARGIN) -> RiccatiDesign:
    """The central observer for the level (1 + margin) upper, with the upper end of `optimum`; raises as `optimum`.

    Its gain is below that level (`RiccatiDesign.level`), to rounding, and may exceed upper itself.
    """
    above, centre = 1 + positive_scalar("margin", margin), kalman_centre(problem)
    return central(centre, _optimum(problem, centre).upper * above)


def achievable(problem: MultirateProblem, level: float) -> bool:
    """Whether some observer has a gain below `level` (Riccati condition, necessary and sufficient)."""
    return _solution(kalman_centre(problem), positive_scalar("level", level))[1] > 0


def optimum(problem: MultirateProblem) -> Optimum:
    """The smallest achievable gain: the non-causal bound where it is reached, else the root of the Riccati condition.

    Raises InvalidInputError if nothing disturbs z = W e (the optimum is zero then), an undisturbed mode is on the unit
    circle (`kalman_design`), or rounding hides the noise of a measurement beside what it tells of; SolverError if
    rounding spoils the recursion.
    """
    return _optimum(problem, kalman_centre(problem))


def _optimum(problem: MultirateProblem, centre: KalmanCentre) -> Optimum:
    best = _least(problem, centre)
    told = float(np.max(np.abs(np.linalg.eigvals(centre.scaled.maps().G @ centre.states))))
    if told > LARGEST_TOLD and not _reached(problem, centre, best):
        raise InvalidInputError(
            f"the noise of a measurement is {told**-0.5:.1e} of the error that it tells of, too little for floating "
            f"point; give the sensor more noise by D, {LARGEST_TOLD**-0.5:.0e} of that error or above"
        )
    return best


def _reached(problem: MultirateProblem, centre: KalmanCentre, best: Optimum) -> bool:
    """Whether the gains that should reach the optimum do; not so where it is wrong, or rounding hides the noise."""
    try:
        gains = central(centre, best.upper * (1 + DESIGN_MARGIN)).gains
        exact = l2_gain(problem.error_system(gains)).value
    except (InfeasibleError, SolverError):
        return False
    return best.value * (1 - MISSED) <= exact <= best.value * (1 + MISSED)


def _least(problem: MultirateProblem, centre: KalmanCentre) -> Optimum:
    noncausal = bound_in(problem, centre.units)
    # The square root of rounding in X_k; where disturbances reach z, the non-causal bound is not zero.
    if noncausal.lower == 0.0 and centre.floor <= 1e-7 * float(np.linalg.norm(centre.scaled.W)):
        raise InvalidInputError("the disturbances do not reach z = W e: there is nothing to minimise; check B_d and W")
    low = max(noncausal.lower, centre.floor)
    if noncausal.upper >= centre.floor:
        touching = [noncausal.upper * (1 + distance) for distance in TOUCHING]
        if _solution(centre, touching[-1])[1] > 0:
            level = next((level for level in touching[:-1] if _solution(centre, level)[1] > 0), touching[-1])
            return Optimum(noncausal.lower, level, noncausal, "noncausal")
        low = touching[-1]
    low, high = _root(centre, low)
    return Optimum(low, high, noncausal, "causal")


class _Search:
    """The largest unachievable and the smallest achievable level tried so far."""

    def __init__(self, centre: KalmanCentre, low: float) -> None:
        self.centre, self.low, self.high = centre, low, np.inf

    def tried(self, level: float) -> float | None:
        """1/lambda - 1/level^2 with lambda = max_k lambda_max(W X_k W'), or None without a solution.

        It is positive iff the level is achievable, and nearly a straight line as a function of 1/level^2.
        """
        slack = _solution(self.centre, level)[1]
        if slack > 0:
            self.high = min(self.high, level)
        else:
            self.low = max(self.low, level)
        return slack / (1 - slack) / level**2 if slack > -1 else None


def _root(centre: KalmanCentre, low: float) -> tuple[float, float]:
    """Largest unachievable and smallest achievable level met on the way to the root of the slack above `low`."""
    search = _Search(centre, low)
    # Points (1/level^2, value); at an infinite level the Kalman filter gives the value.
    points = [(0.0, centre.floor**-2)] if centre.floor > 0 else []
    for _ in range(MAX_DOUBLINGS):
        level = 2 * search.low
        if (value := search.tried(level)) is not None:
            points.append((level**-2, value))
        if level == search.high:
            break
    else:
        raise SolverError(f"no level up to {search.low:.3g} proved achievable: rounding spoils the recursion; rescale")
    level, value = search.high, points[-1][1]
    while search.high > search.low * (1 + LEVEL_TOLERANCE):
        # Where there is no solution there is no value: halve then, and go on from where there is one.
        guess = np.nan if value is None else _zero(points[-LAST:])
        if not search.high**-2 < guess < search.low**-2:
            guess = (search.high**-2 + search.low**-2) / 2
        before, level = level, guess**-0.5
        if abs(level - before) <= NEAR * level:
            break
        if (value := search.tried(level)) is not None:
            points.append((guess, value))
    # From here outwards, until both sides are known.
    distance = LEVEL_TOLERANCE / 16
    while search.high > level * (1 + distance):
        search.tried(level * (1 + distance))
        distance *= 4
    distance = LEVEL_TOLERANCE / 16
    while search.low < level * (1 - distance):
        search.tried(level * (1 - distance))
        distance *= 4
    while search.high > search.low * (1 + LEVEL_TOLERANCE / 8):
        search.tried((search.low + search.high) / 2)
    return float(search.low), float(search.high)


def _zero(points: list[tuple[float, float]]) -> float:
    """Where the polynomial through (value, place) of the points is at the value zero; not a number if there is none."""
    places = [place for place, _ in points]
    values = [value for _, value in points]
    if len(points) < 2 or len(set(values)) < len(values):
        return np.nan
    for width in range(1, len(points)):  # Neville
        for i in range(len(points) - width):
            a, b = values[i], values[i + width]
            places[i] = (a * places[i + 1] - b * places[i]) / (a - b)
    return places[0]


def _solution(centre: KalmanCentre, level: float) -> tuple[Array | None, float]:
    """The stabilising solution at `level` (N, n, n), scaled, and the slack 1 - max_k lambda_max(W X_k W')/level^2.

    The level is achievable iff the slack is positive; without a stabilising solution it is (None, -1).
    """
    if level <= centre.floor:
        return None, -1.0
    maps = centre.scaled.maps(level)
    states = stationary(maps, centre.states)
    if states is None or not semidefinite(states):
        return None, -1.0
    slack = 1 - (np.sqrt(largest_weighted(centre.scaled, states)) / level) ** 2
    if slack > 0 and not stabilises(centre.scaled, states, maps):
        return None, -1.0
    # Below -1 its size has no meaning for the root, and it may be huge where the recursion nearly escapes.
    return states, max(slack, -1.0)


Offsets = tuple[int, ...]
Apply = Callable[[Callable[[Offsets], Optimum], Sequence[Offsets]], Iterable[Optimum]]
"""`map`, or what does its work elsewhere: the values of a function for a sequence, in its order."""


@dataclass(frozen=True)
class TimingSearch:
    """Optimum of every distinct set of offsets for given periods.

    Attributes
    ----------
    periods : tuple of int
        Sensing periods N_i, in base periods.
    optima : dict
        `Optimum` by offsets; `best` is the first of the smallest.
    """

    periods: tuple[int, ...]
    optima: dict[Offsets, Optimum]

    @property
    def best(self) -> Offsets:
        """The offsets with the smallest optimum."""
        return min(self.optima, key=lambda offsets: self.optima[offsets].value)

    @property
    def synchronous(self) -> Optimum:
        """The optimum when all sensors measure at instant 0."""
        return self.optima[(0,) * len(self.periods)]


def search_timing(plant: MultiratePlant, periods: Sequence[int], *, apply: Apply = map) -> TimingSearch:
    """Compare the optima of all offsets that are more than a shift of the origin; two sensors have gcd(N_1, N_2).

    Parameters
    ----------
    plant : MultiratePlant
        The plant.
    periods : sequence of int, one per sensor
        Sensing periods N_i, in base periods.
    apply : callable
        Computes the optima; the `map` of a `concurrent.futures.ProcessPoolExecutor` uses every core, and gives the
        same.

    Returns
    -------
    TimingSearch
        The optimum of each set of offsets, and the best of them.

    Raises
    ------
    InvalidInputError
        A period is not whole, there are too many sets of offsets, or the problem is not well posed.
    SolverError
        Rounding spoils the recursion of `optimum`.
    """
    tried = tuple(distinct_offsets(periods))
    optima = apply(partial(_optimum_at, plant, tuple(periods)), tried)
    return TimingSearch(tuple(periods), dict(zip(tried, optima, strict=True)))


def _optimum_at(plant: MultiratePlant, periods: tuple[int, ...], offsets: Offsets) -> Optimum:
    return optimum(MultirateProblem(plant, SensingSchedule(periods, offsets)))


def least_error_offsets(plant: MultiratePlant, periods: Sequence[int]) -> Offsets:
    """The offsets for which the Kalman filter has the least mean square of W e."""

    def variance(offsets: Offsets) -> float:
        problem = MultirateProblem(plant, SensingSchedule(tuple(periods), offsets))
        return float(np.mean(np.trace(plant.W @ kalman_design(problem).X @ plant.W.T, axis1=1, axis2=2)))

    return min(distinct_offsets(periods), key=variance)
