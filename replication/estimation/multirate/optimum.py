"""The smallest achievable l2 gain of a multi-rate observer, exactly: non-causal bound and periodic Riccati recursion.

A level is achievable iff the Riccati recursion of `ScaledProblem.maps(level)` has a stabilising periodic solution
X_k >= 0 with I - W X_k W'/level^2 > 0 at every phase (necessary and sufficient, unlike a numerical SDP). No estimator,
not even a smoother, does better than the non-causal bound, so an optimum that meets it is bounded from both sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

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
    semidefinite,
    stabilises,
    state_scales,
    stationary_each,
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
    if _is_short(problem):
        return _bound(problem, state_scales(problem, NOISE))
    return _bound_of_filter(kalman_centre(problem))


def _is_short(problem: MultirateProblem) -> bool:
    """Whether the noise of a period is so little that responses to it are formed."""
    inputs = problem.schedule.period * problem.plant.B_d.shape[1] + int(np.count_nonzero(problem.schedule.mask))
    return bool(inputs <= DENSE_INPUTS)


def _bound(problem: MultirateProblem, T: Array) -> GainBracket:
    """`noncausal_bound` from T (N, n, n), the `scales_each` of the intensity NOISE."""
    scaled = scaled_problem(problem, T)
    # In these coordinates the covariance of the filter is the identity at every phase.
    reference = np.broadcast_to(np.eye(problem.plant.order), T.shape)
    stages = _filter(scaled, reference)
    return _peak(scaled, reference, _dense(stages, scaled.W.shape[1]), stages)


def _bound_of_filter(centre: KalmanCentre) -> GainBracket:
    """`noncausal_bound` by operators, from the Kalman filter."""
    scaled, reference = centre.scaled, centre.states
    stages, outputs = _filter(scaled, reference), len(scaled.W[0])
    halves = slice(outputs), slice(outputs, None)
    errors, innovations = (PeriodicSystem(tuple(_part(stage, half) for stage in stages)) for half in halves)
    return _peak(scaled, reference, one_by_one(_by_operators(errors, _whitened(innovations, reference))), stages)


def _part(stage: Stage, rows: Any) -> Stage:
    return stage._replace(C=stage.C[rows], D=stage.D[rows])


def _peak(scaled: ScaledProblem, reference: Array, curve: Curve, stages: Sequence[Stage]) -> GainBracket:
    def maps(level: float) -> RiccatiMap:
        return recentre(scaled.maps(level), reference)

    return peak_on_circle(curve, maps, slowest_angle(monodromy(np.stack([stage.A for stage in stages]))))


def _filter(scaled: ScaledProblem, states: Array) -> list[Stage]:
    """From (d, whitened w) to W e and to the innovations C_k e + w, of the filter with given covariances."""
    corrected = scaled.corrected(states, scaled.maps())
    closed, gains = scaled.closed_loop(corrected), scaled.whitened_gains(corrected)
    n_z, m = scaled.W.shape[1], scaled.B.shape[-1]
    drives, outputs = np.concatenate([scaled.B, -gains], axis=-1), np.concatenate([scaled.W, scaled.C], axis=1)
    direct = np.zeros((outputs.shape[1], drives.shape[2]))
    direct[n_z:, m:] = np.eye(gains.shape[2])
    stages = []
    for A, B, C, rows in zip(closed, drives, outputs, scaled.whitened.rows, strict=True):
        indices, columns = ([*range(first), *(first + i for i in rows)] for first in (n_z, m))
        stages.append(Stage(A, B[:, columns], C[indices], direct[np.ix_(indices, columns)]))
    return stages


def _dense(stages: Sequence[Stage], outputs: int) -> Curve:
    """The norm of E on the kernel of V, both formed in full, as a function of the angles."""
    whole = lifted(stages)
    of_error = np.concatenate([np.arange(len(stage.C)) < outputs for stage in stages])
    errors = compressed(_part(whole, of_error))
    innovations = _part(whole, ~of_error)

    def curve(angles: Array) -> Array:
        E, V = frequency_response(errors, angles), frequency_response(innovations, angles)
        hidden = np.linalg.qr(V.conj().mT, mode="complete").Q[..., V.shape[-2] :]
        gains = spectral_norm(E @ hidden)
        return np.where(gains > ROUNDING * np.linalg.norm(E, axis=(-2, -1)), gains, 0.0)

    return in_groups(curve, whole.D.size)


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

        scale = largest_singular_value(lambda v: E_adjoint(E(v)), size)
        return largest_singular_value(lambda v: unseen(E_adjoint(E(unseen(v)))), size, floor=ROUNDING * scale)

    return value


LEVEL_TOLERANCE = 1e-12
"""Relative width at which the search over the level ends."""
DESIGN_MARGIN = 1e-8
"""Relative distance above the optimum at which gains are computed: at the optimum the recursion degenerates."""
TOUCHING = (1e-12, 1e-10, DESIGN_MARGIN)
"""Relative distances above the non-causal bound within which the optimum counts as sitting on it."""
NEAR = 0.6
"""Share of the non-causal bound from which on, were it that of the floor, the optimum is likely to lie above it."""
LARGEST_TOLD, MISSED = 1e14, 1e-3
"""Variance of the error of a prediction, over that of the noise of the measurement that corrects it, from which on the
optimum is compared with what its gains reach; relative distance that is too much then.
"""
NEAREST = 5
"""How many points the next guess is drawn through."""
APART = 1e-10
"""Relative distance of two points, in 1/level^2, below which rounding makes nothing of the line through them."""
CLOSE = 1e-11
"""How wrong a guess may be, relatively, that is taken for the root."""
FACTORS = (1.1, 1.2, 1.5, 2.0)
"""Times the largest unachievable level, what is tried next until a level is achievable."""
SMALL = 1000
"""Entries of the states of a period up to which levels are tried side by side, which takes little longer than one."""
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


Trial = tuple[Array | None, float]
"""The stabilising solution (N, n, n) at a level, scaled, and the slack 1 - max_k lambda_max(W X_k W')/level^2.

The level is achievable iff the slack is positive; without a stabilising solution it is (None, -1).
"""
NO_SOLUTION: Trial = (None, -1.0)


def riccati_design(problem: MultirateProblem, level: float) -> RiccatiDesign:
    """The central observer whose gain is below `level`.

    Raises InfeasibleError if no observer reaches it; otherwise as `kalman_design`.
    """
    return central(kalman_centre(problem), positive_scalar("level", level))


def central(centre: KalmanCentre, level: float, trial: Trial | None = None) -> RiccatiDesign:
    """`riccati_design` from the Kalman filter of the problem, for many levels; trial: that of the level, if known."""
    states, slack = trial or _solutions(centre, (level,))[0]
    if states is None or slack <= 0:
        raise InfeasibleError(f"no observer has a gain below {level!r}; ask for a larger level (see `optimum`)")
    return centre.design(states, level)


def optimal_design(problem: MultirateProblem) -> RiccatiDesign:
    """The central observer DESIGN_MARGIN above the upper end of `optimum`; raises as `optimum`.

    Its gain is below that level (`RiccatiDesign.level`), to rounding, and may exceed upper itself.
    """
    search = _Search(problem)
    level = search.optimum().upper * (1 + DESIGN_MARGIN)
    return central(search.centre, level, search.latest.get(level))


def optimum(problem: MultirateProblem) -> Optimum:
    """The smallest achievable gain: the non-causal bound where it is reached, else the root of the Riccati condition.

    Raises InvalidInputError if nothing disturbs z = W e (the optimum is zero then), an undisturbed mode is on the unit
    circle (`kalman_design`), or rounding hides the noise of a measurement beside what it tells of; SolverError if
    rounding spoils the recursion.
    """
    return _Search(problem).optimum()


class _Search:
    """The largest unachievable and the smallest achievable level tried so far, and the `latest` trials by level.

    points: (1/level^2, 1/lambda - 1/level^2), lambda = max_k lambda_max(W X_k W'), where there is a solution. The value
    is positive iff the level is achievable, and nearly a straight line; the Kalman filter gives that at infinity.
    """

    def __init__(self, problem: MultirateProblem) -> None:
        require_problem(problem)
        self.problem = problem
        self.centre = kalman_centre(problem, quick_noise=NOISE if _is_short(problem) else None)
        self.low, self.high = 0.0, np.inf
        self.latest: dict[float, Trial] = {}
        floor = self.centre.floor
        self.points = [(0.0, floor**-2)] if floor > 0 else []
        self.aside = problem.schedule.period * problem.plant.order**2 <= SMALL

    def optimum(self) -> Optimum:
        """Raises as the function `optimum`."""
        best = self._least()
        if self._told <= LARGEST_TOLD:
            return best
        try:
            gains = central(self.centre, best.upper * (1 + DESIGN_MARGIN)).gains
            exact = l2_gain(self.problem.error_system(gains)).value
        except (InfeasibleError, SolverError):
            exact = np.inf
        if best.value * (1 - MISSED) <= exact <= best.value * (1 + MISSED):
            return best
        raise self._hidden()

    @property
    def _told(self) -> float:
        """The largest variance of the error that a measurement tells of, over that of its noise."""
        C = self.centre.scaled.C
        return float(np.linalg.eigvalsh(C @ self.centre.states @ C.mT).max())

    def _hidden(self) -> InvalidInputError:
        """Rounding hides the noise of a measurement: the optimum is wrong, or none is found."""
        return InvalidInputError(
            f"the noise of a measurement is {self._told**-0.5:.1e} of the error that it tells of, too little for "
            f"floating point; give the sensor more noise by D, {LARGEST_TOLD**-0.5:.0e} of that error or above"
        )

    def _least(self) -> Optimum:
        centre = self.centre
        noncausal = _bound_of_filter(centre) if centre.quick is None else _bound(self.problem, centre.quick)
        # The square root of rounding in X_k; where disturbances reach z, the non-causal bound is not zero.
        if noncausal.lower == 0.0 and centre.floor <= 1e-7 * float(np.linalg.norm(centre.scaled.W)):
            raise InvalidInputError(
                "the disturbances do not reach z = W e: there is nothing to minimise; check B_d and W"
            )
        self.low = max(noncausal.lower, centre.floor)
        if noncausal.upper >= centre.floor:
            touching = [noncausal.upper * (1 + distance) for distance in TOUCHING]
            touching[-1] = touching[0] * (1 + DESIGN_MARGIN)  # where the gains are computed, if the first is reached
            likely = self.aside and centre.floor > NEAR * noncausal.upper
            ahead = [self.low * factor for factor in FACTORS] if likely else []
            self.tried(touching[-1], *(ahead or touching[: self.aside]))
            if self.latest[touching[-1]][1] > 0:
                level = next((level for level in touching[:-1] if self._achieved(level)), touching[-1])
                return Optimum(noncausal.lower, level, noncausal, "noncausal")
            self.low = max(self.low, touching[-1])
        self._root()
        return Optimum(self.low, self.high, noncausal, "causal")

    def _achieved(self, level: float) -> bool:
        if level not in self.latest:
            self.tried(level)
        return self.latest[level][1] > 0

    def tried(self, *levels: float) -> None:
        """Try levels, side by side."""
        self.latest = dict(zip(levels, _solutions(self.centre, levels), strict=True))
        self.points += [
            (level**-2, slack / (1 - slack) / level**2) for level, (_, slack) in self.latest.items() if slack > -1
        ]
        reached = [level for level in levels if self.latest[level][1] > 0]
        missed = [level for level in levels if self.latest[level][1] <= 0]
        # Where rounding puts a level that is reached below one that is not, the bracket stays around both.
        least, most = min(reached, default=np.inf), max(missed, default=0.0)
        self.high = min([self.high, *(level for level in reached if level > most)])
        self.low = max([self.low, *(level for level in missed if level < least)])

    def _root(self) -> None:
        """Close the bracket in on the root of the slack above `low`."""
        for _ in range(MAX_DOUBLINGS):
            if np.isfinite(self.high):
                break
            self.tried(*(self.low * factor for factor in (FACTORS if self.aside else FACTORS[-1:])))
        else:
            if self._told > LARGEST_TOLD:
                raise self._hidden()
            raise SolverError(
                f"no level up to {self.low:.3g} proved achievable: rounding spoils the recursion; rescale"
            )
        width = LEVEL_TOLERANCE / 40
        while self.high > self.low * (1 + LEVEL_TOLERANCE / 8):
            level, spread = _zero(self.points)
            if not self.low < level < self.high:
                level, spread = (self.low + self.high) / 2, (self.high / self.low - 1) / 4
            close = spread <= CLOSE
            if close:
                levels = [level * (1 + sides * width) for sides in (-4, -1, 1, 4)]
                width *= 2
            else:
                levels = [level * (1 - spread), level, level * (1 + spread)] if self.aside else [level]
            inside = [near for near in levels if self.low < near < self.high] or [level]
            low, high = self.low, self.high
            # Where gains are computed if the level is the least: tried with it, since that costs little.
            designs = [level * (1 + DESIGN_MARGIN) for level in inside[-2:-1]] if close and self.aside else []
            self.tried(*inside, *designs)
            if (low, high) == (self.low, self.high):  # rounding left the side of each level open
                self.tried((low + high) / 2)


def _zero(points: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """The level at which the value of the points (1/level^2, value) is zero, and by how much of it that may be wrong.

    By the polynomial through (value, place) of the nearest points, and by that through one fewer; not a number without
    two points of different values.
    """
    values: list[float] = []
    places: list[float] = []
    for place, value in sorted(points, key=lambda point: abs(point[1])):
        if len(places) < NEAREST and all(abs(place - neighbour) > APART * neighbour for neighbour in places):
            values.append(value)
            places.append(place)
    if len(places) < 2 or len(set(values)) < len(values):
        return np.nan, np.nan
    before = places[0]
    for width in range(1, len(values)):  # Neville
        before = places[0]
        for i in range(len(values) - width):
            a, b = values[i], values[i + width]
            places[i] = (a * places[i + 1] - b * places[i]) / (a - b)
    place = places[0]
    return (place**-0.5, abs(place - before) / place / 2) if place > 0 else (np.nan, np.nan)


def _solutions(centre: KalmanCentre, levels: Sequence[float]) -> list[Trial]:
    """The trials of levels, side by side."""
    trials = [NO_SOLUTION] * len(levels)
    tried = np.array([i for i, level in enumerate(levels) if level > centre.floor], dtype=int)
    if not len(tried):
        return trials
    above, scaled = np.array(levels)[tried], centre.scaled
    maps = scaled.maps(above)
    states = stationary_each(maps, centre.states)
    cases = np.flatnonzero(np.isfinite(states).all(axis=(0, 2, 3)))
    if not len(cases):
        return trials
    states = states[:, cases]
    slack = 1 - scaled.largest_weighted(states) / above[cases] ** 2
    sound = semidefinite(states[:1])  # then all phases are, as long as the slack is positive
    checked = np.flatnonzero(sound & (slack > 0))
    if len(checked):
        G = maps.G[:, cases[checked]]
        sound[checked] = stabilises(scaled, states[:, checked], maps._replace(G=G))
    for i in np.flatnonzero(sound):
        # Below -1 its size has no meaning for the root, and it may be huge where the recursion nearly escapes.
        trials[tried[cases[i]]] = states[:, i], max(float(slack[i]), -1.0)
    return trials


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
