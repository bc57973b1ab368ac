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
    Curve,
    GainBracket,
    in_groups,
    l2_gain,
    one_by_one,
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
    lifted,
    monodromy,
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
    stationary,
)
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import (
    MultirateProblem,
    SensingSchedule,
    distinct_offsets,
)
from replication.estimation.validation import Array, ComplexArray, positive_scalar

ROUNDING = 1e-13
"""A gain below this share of the error system's own is rounding: it counts as zero."""


def noncausal_bound(problem: MultirateProblem) -> GainBracket:
    """sup over frequency of the best gain of any estimator that knows all measurements, past and future.

    With T_x from d to W x and T_y from d to the whitened measurements it is sqrt(lambda_max(T_x*T_x, I + T_y*T_y)).
    Evaluated on the error system of the Kalman filter instead, so that unstable plants and poles on the circle do no
    harm: with E from (d, w) to W e and V to the innovations, it is the norm of E on the kernel of V. Where the period
    is long no matrix is formed. Raises as `kalman_design`.
    """
    return _bound(kalman_centre(problem))


def _bound(centre: KalmanCentre) -> GainBracket:
    """`noncausal_bound` from the Kalman filter."""
    scaled, reference = centre.scaled, centre.states
    corrected = scaled.corrected(reference, scaled.maps())
    closed, gains = scaled.closed_loop(corrected), scaled.whitened_gains(corrected)
    # From (d, whitened w) to W e, and to the innovations C_k e + w.
    errors, innovations = list[Stage](), list[Stage]()
    for A, B, L, W, C, rows in zip(closed, scaled.B, gains, scaled.W, scaled.C, scaled.rows, strict=True):
        due = list(rows)
        drive = np.hstack([B, -L[:, due]])
        errors.append(Stage(A, drive, W, np.zeros((len(W), drive.shape[1]))))
        innovations.append(Stage(A, drive, C[due], np.eye(len(due), drive.shape[1], k=B.shape[1])))
    short = sum(stage.B.shape[1] for stage in errors) <= DENSE_INPUTS
    curve = _dense(errors, innovations) if short else _by_operators(errors, _whitened(innovations, reference))

    def maps(level: float) -> RiccatiMap:
        return recentre(scaled.maps(level), reference)

    return peak_on_circle(curve, maps, slowest_angle(monodromy(closed)))


def _dense(errors: Sequence[Stage], innovations: Sequence[Stage]) -> Curve:
    """The norm of E on the kernel of V, both formed in full, as a function of the angles."""
    whole, seen = compressed(lifted(errors)), lifted(innovations)

    def curve(angles: Array) -> Array:
        E, V = frequency_response(whole, angles), frequency_response(seen, angles)
        hidden = np.linalg.qr(V.conj().mT, mode="complete").Q[..., V.shape[-2] :]
        gains = spectral_norm(E @ hidden)
        return np.where(gains > ROUNDING * np.linalg.norm(E, axis=(-2, -1)), gains, 0.0)

    return in_groups(curve, whole.D.size + seen.D.size)


def _whitened(innovations: Sequence[Stage], covariance: Array) -> list[Stage]:
    """The innovations of the Kalman filter in units of their covariance I + C_k X_k C_k': white, so V V* = I."""
    stages = []
    for stage, X in zip(innovations, covariance, strict=True):
        root = np.linalg.cholesky(np.eye(len(stage.C)) + stage.C @ X @ stage.C.T)
        C, D = (np.asarray(np.linalg.solve(root, M), dtype=float) for M in (stage.C, stage.D))
        stages.append(stage._replace(C=C, D=D))
    return stages


def _by_operators(errors: Sequence[Stage], white: Sequence[Stage]) -> Curve:
    """The norm of E (I - V*V), which is that on the kernel of V if V V* = I, as a function of the angles."""
    error_response, white_response = (LiftedResponse(PeriodicSystem(tuple(part))) for part in (errors, white))
    size = error_response.inputs

    def value(angle: float) -> float:
        (E, E_adjoint), (V, V_adjoint) = error_response.at(angle), white_response.at(angle)

        def unseen(v: ComplexArray) -> ComplexArray:
            return v - V_adjoint(V(v))

        own = largest_singular_value(lambda v: E_adjoint(E(v)), size)
        return largest_singular_value(lambda v: unseen(E_adjoint(E(unseen(v)))), size, floor=ROUNDING * own)

    return one_by_one(value)


LEVEL_TOLERANCE = 1e-13
"""Relative width at which the search over the level ends."""
DESIGN_MARGIN = 1e-8
"""Relative distance above the optimum at which gains are computed: at the optimum the recursion degenerates."""
TOUCHING = (1e-12, 1e-10, DESIGN_MARGIN)
"""Relative distances above the non-causal bound within which the optimum counts as sitting on it."""
LARGEST_TOLD, MISSED = 1e14, 1e-3
"""Variance of the error of a prediction, over that of the noise of the measurement that corrects it, from which on the
optimum is compared with what its gains reach; relative distance that is too much then.
"""


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
    positive_scalar("margin", margin)
    return riccati_design(problem, optimum(problem).upper * (1 + margin))


def achievable(problem: MultirateProblem, level: float) -> bool:
    """Whether some observer has a gain below `level` (Riccati condition, necessary and sufficient)."""
    return _solution(kalman_centre(problem), positive_scalar("level", level))[1] > 0


def optimum(problem: MultirateProblem) -> Optimum:
    """The smallest achievable gain: the non-causal bound where it is reached, else the root of the Riccati condition.

    Raises InvalidInputError if nothing disturbs z = W e (the optimum is zero then), an undisturbed mode is on the unit
    circle (`kalman_design`), or rounding hides the noise of a measurement beside what it tells of; SolverError if
    rounding spoils the recursion.
    """
    centre = kalman_centre(problem)
    C = centre.scaled.C
    told = float(np.linalg.eigvalsh(C @ centre.states @ C.mT).max())
    sound, noncausal = told <= LARGEST_TOLD, _bound(centre)
    try:
        best = _least(centre, noncausal)
        if sound:
            return best
        gains = central(centre, best.upper * (1 + DESIGN_MARGIN)).gains
        exact = l2_gain(problem.error_system(gains)).value
        if best.value * (1 - MISSED) <= exact <= best.value * (1 + MISSED):
            return best
    except (InfeasibleError, SolverError):
        if sound:
            raise
    raise InvalidInputError(
        f"the noise of a measurement is {told**-0.5:.1e} of the error that it tells of, too little for floating point; "
        f"give the sensor more noise by D, {LARGEST_TOLD**-0.5:.0e} of that error or above"
    )


def _least(centre: KalmanCentre, noncausal: GainBracket) -> Optimum:
    """`optimum`, whether or not its gains reach it."""
    floor = centre.floor
    # The square root of rounding in X_k; where disturbances reach z, the non-causal bound is not zero.
    if noncausal.lower == 0.0 and floor <= 1e-7 * float(np.linalg.norm(centre.scaled.W)):
        raise InvalidInputError("the disturbances do not reach z = W e: there is nothing to minimise; check B_d and W")
    low = max(noncausal.lower, floor)
    if noncausal.upper >= floor:
        *nearer, last = (noncausal.upper * (1 + distance) for distance in TOUCHING)
        if _solution(centre, last)[1] > 0:
            level = next((level for level in nearer if _solution(centre, level)[1] > 0), last)
            return Optimum(noncausal.lower, level, noncausal, "noncausal")
        low = max(low, last)
    return Optimum(*_root(centre, low), noncausal, "causal")


def _root(centre: KalmanCentre, low: float) -> tuple[float, float]:
    """The largest level that is known to be out of reach, from `low` on, and the smallest that is reached.

    With lambda = max_k lambda_max(W X_k W') at a level, 1/lambda - 1/level^2 is positive iff the level is reached, and
    nearly a straight line in 1/level^2; the Kalman filter gives it at infinity. Raises SolverError if rounding spoils
    the recursion.
    """
    from scipy.optimize import brentq  # slow to load

    missed, reached = [low], [np.inf]

    def excess(place: float) -> float:
        if place == 0.0:
            return centre.floor**-2
        level = place**-0.5
        slack = _solution(centre, level)[1]
        (reached if slack > 0 else missed).append(level)
        # Never zero, where the search would end with one side open.
        return place * (slack or -LEVEL_TOLERANCE) / (1 - slack) if slack > -1 else -place

    brentq(excess, 0.0, low**-2, xtol=np.finfo(float).tiny, rtol=LEVEL_TOLERANCE, disp=False)
    # Where rounding puts a level that is reached below one that is not, the bracket stays around both.
    low = max(missed)
    high = min(level for level in reached if level > low)
    if not np.isfinite(high):
        raise SolverError(f"no level up to {low:.3g} proved achievable: rounding spoils the recursion; rescale")
    return low, high


def _solution(centre: KalmanCentre, level: float) -> tuple[Array | None, float]:
    """The stabilising solution (N, n, n) at a level, scaled, and the slack 1 - max_k lambda_max(W X_k W')/level^2.

    The level is achievable iff the slack is positive; without a stabilising solution it is (None, -1).
    """
    if level <= centre.floor:
        return None, -1.0
    scaled, maps = centre.scaled, centre.scaled.maps(level)
    states = stationary(maps, centre.states)
    if states is None or not semidefinite(states[:1]):  # then all phases are, as long as the slack is positive
        return None, -1.0
    slack = 1 - largest_weighted(scaled, states) / level / level
    if slack > 0 and not stabilises(scaled, states, maps):
        return None, -1.0
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
