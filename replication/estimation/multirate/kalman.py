"""The steady-state multi-rate Kalman filter, and state scales taken from its error covariance.

The filter is the limit of every recursion here at an infinite level, and a lower bound of it at a finite one: the
stabilising solution at any level is no smaller. So the other recursions start from it, which is right also for unstable
modes that nothing disturbs; from zero they would never learn of them. Where nothing needs that care, the states of all
phases come at once (`steady_state`), judged by one step by covariances, which shares no formula with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from replication.errors import InvalidInputError, SolverError
from replication.estimation.linear.periodic import Stage, lifted, monodromy
from replication.estimation.linear.riccati import (
    RiccatiMap,
    apply,
    case_by_case,
    from_zero,
    identity,
    product,
    recentre,
    settled,
    settled_each,
    solve,
    symmetric,
)
from replication.estimation.multirate.problem import MultirateProblem, ScaledProblem, require_problem, scaled_problem
from replication.estimation.validation import Array, hidden_modes

SCALING_NOISE = 1e-6
"""Process noise on every state, in its unit, that keeps the covariances used for scaling positive definite."""
STABILITY_MARGIN = 1e-9
"""A multiplier closer than this to the unit circle, or outside, counts as not stable; as in the detectability test."""
HIDDEN_TOLERANCE = 1e-6
"""Share of a disturbance, in state units, below which it does not reach a mode."""
NEGATIVE = 1e-9
"""Size of an eigenvalue of a covariance that may be negative by rounding."""
CLUSTER = 1e-3
"""Modes nearer than this to each other count as one of higher multiplicity."""

NOISE_APART = 1e6
"""Condition number of D beyond which rounding may hide that a mode is disturbed."""


@dataclass(frozen=True, eq=False)
class RiccatiDesign:
    """Gains (N, n, q) for one guaranteed `level`; X: the stabilising solution at each phase (N, n, n)."""

    gains: Array
    X: Array
    level: float


@dataclass(frozen=True, eq=False)
class KalmanCentre:
    """The scaled problem and the stabilising solution X_k at an infinite level, in scaled coordinates (N, n, n).

    quick: `state_scales` of a filter with much process noise on every state, if asked for.
    """

    scaled: ScaledProblem
    states: Array
    quick: Array | None = None

    @cached_property
    def floor(self) -> float:
        """sqrt(max_k lambda_max(W X_k W')): no observer, at no level, has a smaller gain."""
        return float(np.sqrt(self.scaled.largest_weighted(self.states)))

    def design(self, states: Array, level: float) -> RiccatiDesign:
        """The gains at the stabilising solution of a level, in the coordinates of the plant."""
        scaled = self.scaled
        gains = scaled.gains(scaled.corrected(states, scaled.maps(level)))
        return RiccatiDesign(gains, np.asarray(scaled.T @ states @ scaled.T.mT), level)


def kalman_design(problem: MultirateProblem) -> RiccatiDesign:
    """The steady-state periodic Kalman filter (white d, w of unit intensity): the infinite level.

    Raises InvalidInputError if a mode on the unit circle is not disturbed: its gains tend to zero and never settle on
    stabilising ones; disturb it then. Raises SolverError if rounding hides the limit of the recursion.
    """
    require_problem(problem)
    if (design := steady_state(problem)) is not None:
        return design
    centre = kalman_centre(problem)
    return centre.design(centre.states, np.inf)


def kalman_centre(problem: MultirateProblem, *, quick_noise: float | None = None) -> KalmanCentre:
    """The stabilising solution at an infinite level; errors as in `kalman_design`.

    quick_noise: intensity of the process noise, in state units, of the filter for the scales `quick`.
    """
    require_problem(problem)
    units = state_units(problem)
    if (mode := _undisturbed_on_circle(problem, units)) is not None:
        require_noise_near(problem)
        raise InvalidInputError(
            f"the mode {mode:.6g} on the unit circle is not disturbed, so its estimator never settles, and the Riccati "
            "route has no answer; disturb it a little by a column of B_d: the gains of that plant achieve no more in "
            "this one"
        )
    noises = (SCALING_NOISE, 0.0) if quick_noise is None else (SCALING_NOISE, 0.0, quick_noise)
    little, none, *much = covariances_each(problem, units, noises)
    scaled = scaled_problem(problem, root(units, little))
    maps = scaled.maps()
    states = _in_scales(scaled, maps, units[:, None] * none * units)
    if states is None:
        states = stationary(maps, np.broadcast_to(np.eye(problem.plant.order), scaled.A.shape))
        if states is not None and not stabilises(scaled, states, maps):
            states = None
    if states is None or not semidefinite(states):
        require_noise_near(problem)
        growth = float(np.max(np.abs(np.linalg.eigvals(problem.plant.A)))) ** problem.schedule.period
        raise SolverError(
            "the stabilising limit of the Kalman recursion was lost in rounding: the fastest mode changes by a factor "
            f"of {growth:.3g} over the period of {problem.schedule.period} instants; measure more often, or disturb "
            "the slowest mode more"
        )
    return KalmanCentre(scaled, states, *(root(units, covariance) for covariance in much))


def _in_scales(scaled: ScaledProblem, maps: RiccatiMap, covariance: Array) -> Array | None:
    """States of covariances in the units of the plant, one step on; None unless what they may still change is rounding.

    From zero a mode that is hardly disturbed rises so slowly that the recursion may seem to have settled.
    """
    states = np.linalg.solve(scaled.T, np.linalg.solve(scaled.T, covariance).mT)
    if not np.isfinite(states).all():
        return None
    again = np.roll(apply(maps, states), 1, axis=0)
    left = 1 - multiplier(scaled, again, maps)
    return again if left > STABILITY_MARGIN and np.abs(again - states).max() <= REPEATS * left else None


def require_noise_near(problem: MultirateProblem) -> None:
    """Raise InvalidInputError if the noise of the sensors differs by more than rounding allows."""
    if (apart := np.linalg.cond(problem.plant.D)) > NOISE_APART:
        raise InvalidInputError(
            f"the noise of the sensors differs by a factor of {apart:.1e}, too much for floating point; give the "
            f"best sensor more, 1 / {NOISE_APART:.0e} of the worst or above"
        )


def _undisturbed_on_circle(problem: MultirateProblem, units: Array) -> complex | None:
    """A mode on the unit circle that no noise reaches, or None; with correlated noise a multiplier over the period.

    Rounding blurs a mode of multiplicity k by the k-th root of machine precision; a wider one counts as off the circle.
    """
    plant = problem.plant
    A, B = plant.A / units[:, None] * units, plant.B_d / units[:, None]
    if plant.correlated:
        # What the measurements tell of the noise is known, and disturbs nothing.
        rest = scaled_problem(problem, np.stack([np.diag(units)] * problem.schedule.period))
        none = np.zeros((0, plant.order)), np.zeros((0, rest.B.shape[-1]))
        A, B, *_ = lifted([Stage(A_k, B_k, *none) for A_k, B_k in zip(rest.A, rest.B, strict=True)])
    widest = max(STABILITY_MARGIN, 10 * np.finfo(float).eps ** (1 / plant.order))
    if np.min(np.abs(np.abs(np.linalg.eigvals(A)) - 1)) > 2 * widest:
        return None
    hidden = np.array(hidden_modes(A.T, B.T, tolerance=HIDDEN_TOLERANCE))
    for mode in hidden:
        multiplicity = int(np.sum(np.abs(hidden - mode) <= CLUSTER))
        blur = 10 * np.finfo(float).eps ** (1 / multiplicity)
        if abs(abs(mode) - 1) <= max(STABILITY_MARGIN, blur):
            return complex(mode)
    return None


def state_scales(problem: MultirateProblem, noise: float = SCALING_NOISE) -> Array:
    """T_k (N, n, n), roots of the error covariances of a Kalman filter with a little process noise on every state.

    noise: its intensity, in squares of the `state_units`. Cholesky factors, unless rounding makes a covariance
    singular. Raises SolverError if rounding spoils the recursion.
    """
    units = state_units(problem)
    return root(units, covariances_each(problem, units, (noise,))[0])


def covariances_each(problem: MultirateProblem, units: Array, noises: Sequence[float]) -> Array:
    """Error covariances (noises, N, n, n) of Kalman filters with more process noise, in squares of the units."""
    whitened = problem.whitened
    A, B, C = whitened.A * units / units[:, None], whitened.B / units[:, None], whitened.C * units
    driven = (B @ B.mT)[:, None] + np.array(noises)[:, None, None] * identity(len(units))
    A, G = (np.broadcast_to(part[:, None], driven.shape) for part in (A, C.mT @ C))
    return settled_each(RiccatiMap(A, G, driven)).swapaxes(0, 1)


def root(units: Array, covariance: Array) -> Array:
    """Roots (N, n, n) of covariances in `units`."""
    if np.isfinite(covariance).all():
        try:
            return np.asarray(units[:, None] * np.linalg.cholesky(covariance))
        except np.linalg.LinAlgError:
            # States that nearly cancel leave a covariance whose least eigenvalues are rounding; any units of their
            # size serve, for these are scales and no result.
            variances, axes = np.linalg.eigh(covariance)
            least = np.finfo(float).eps * np.max(variances, axis=-1, keepdims=True)
            return np.asarray(units[:, None] * axes * np.sqrt(np.maximum(variances, least))[:, None, :])
    raise SolverError(
        "the error covariances used to scale the states were lost in rounding: sensors are almost free of noise, or "
        "modes hardly seen, or growing by many orders of magnitude between measurements; change D, C or the periods"
    )


def state_units(problem: MultirateProblem) -> Array:
    """A natural unit per state (n,): the deviation that the disturbance or that the sensors' noise brings, if smaller.

    A change of units of the plant changes it in proportion. States that have neither take 1.
    """
    plant, C = problem.plant, problem.whitened.C
    n, count = plant.order, len(C) + plant.order
    # Growing modes are discounted: the unit is one of the near past, not of the far one.
    step = plant.A / max(1.0, float(np.max(np.abs(np.linalg.eigvals(plant.A)))))
    powers = np.stack([np.eye(n), step])
    while len(powers) < count:
        powers = np.concatenate([powers, powers @ (powers[-1] @ step)])
    powers = powers[:count]
    outputs = np.take(C, np.arange(count), axis=0, mode="wrap") @ powers
    information, driven = np.sum(outputs**2, axis=(0, 1)), np.sum((powers @ plant.drive) ** 2, axis=(0, 2))
    driven[driven == 0] = np.inf
    noise = np.divide(1.0, information, out=np.full(n, np.inf), where=information > 0)
    squared = np.minimum(driven, noise)
    return np.sqrt(np.where(np.isfinite(squared), squared, 1.0))


def stationary(maps: RiccatiMap, reference: Array) -> Array | None:
    """The solution (N, n, n) that the recursion reaches from the states of `reference`, or None."""
    states = stationary_each(maps.at(np.s_[:, None]), reference)[:, 0]
    return states if np.isfinite(states).all() else None


def stationary_each(maps: RiccatiMap, reference: Array) -> Array:
    """`stationary` for the maps (N, cases, n, n) of several cases; not numbers where there is no solution."""
    try:
        return np.asarray(reference[:, None] + settled_each(recentre(maps, reference[:, None])))
    except np.linalg.LinAlgError:
        return case_by_case(lambda case: stationary_each(case, reference), maps)


def semidefinite(states: Array) -> Any:
    """Whether all X_k >= 0, to rounding: scaled states are of size one, or vanish where nothing is uncertain.

    Here and in the next: of states (N, cases, n, n), one answer for each case.
    """
    try:
        np.linalg.cholesky(states + NEGATIVE * identity(states.shape[-1]))
        return np.ones(states.shape[1:-2], dtype=bool)
    except np.linalg.LinAlgError:  # the eigenvalues decide
        eigenvalues = np.linalg.eigvalsh(states)
        largest = np.maximum(1.0, eigenvalues[..., -1].max(axis=0))
        return eigenvalues[..., 0].min(axis=0) >= -NEGATIVE * largest


def stabilises(scaled: ScaledProblem, states: Array, maps: RiccatiMap) -> Any:
    """Whether the gains at the states stabilise the error system. Every I + X_k G_k must be regular."""
    return multiplier(scaled, states, maps) < 1 - STABILITY_MARGIN


def multiplier(scaled: ScaledProblem, states: Array, maps: RiccatiMap) -> Any:
    """The largest modulus of the multipliers of the error system with these gains, and what rounding may add to it."""
    total = monodromy(scaled.closed_loop(scaled.corrected(states, maps)))
    # What a measurement takes off a mode that has grown since the one before is known to rounding of that growth.
    blur = np.finfo(float).eps * np.abs(scaled.A).max()
    return np.abs(np.linalg.eigvals(total)).max(axis=-1) + blur


REPEATS = 1e-11
"""Change over one step, in units of the standard deviations, up to which a solution is believed."""

DEPENDENT = 1e-6
"""Least eigenvalue of the correlations of the sensor noise, below which R is not worked with."""


class Sensing(NamedTuple):
    """Sensors of which some measure: C (..., q, n), covariance R (..., q, q) of their noise, S (..., n, q) with d.

    Of a sensor that does not measure the rows are zero and its noise is one, so that its gains come out as zero. S is
    None where plant and sensors have no common noise.
    """

    C: Array
    R: Array
    S: Array | None

    def at(self, index: Any) -> Self:
        """Those of some instants."""
        return type(self)(self.C[index], self.R[index], None if self.S is None else self.S[index])


class Correction(NamedTuple):
    """Gains and covariances (..., n, n) of one instant: x^(k|k) = x^ + K v, x^(k+1) = A x^ + L v, v = y - C x^."""

    K: Array
    L: Array
    innovation: Array
    filtered: Array
    following: Array


def sensing(problem: MultirateProblem, due: NDArray[np.bool_]) -> Sensing:
    """The sensors of the plant, of which those measure that are due (..., q); S = B_w D'."""
    plant = problem.plant
    used = due.astype(float)
    R = plant.D @ plant.D.T * used[..., :, None] * used[..., None, :] + (1.0 - used)[..., None] * np.eye(used.shape[-1])
    S = plant.B_w @ plant.D.T * used[..., None, :] if plant.correlated else None
    return Sensing(plant.C * used[..., None], R, S)


def corrected(A: Array, Q: Array, sensors: Sensing, P: Array) -> Correction:
    """Measurement and time update of the covariance P (..., n, n); A (n, n), Q (n, n) of the whole process noise."""
    C, R, S = sensors
    times = product(P)
    CP = times(C, P)
    innovation = times(CP, C.mT) + R
    K = solve(innovation, CP).mT
    # Joseph's form: a sum of squares, so that rounding leaves it semidefinite.
    remainder = identity(len(A)) - times(K, C)
    filtered = times(times(remainder, P), remainder.mT) + times(times(K, R), K.mT)
    if S is None:
        return Correction(K, times(A, K), innovation, filtered, times(times(A, filtered), A.T) + Q)
    L = solve(innovation, CP @ A.T + S.mT).mT
    closed, cross = A - L @ C, L @ S.mT
    return Correction(K, L, innovation, filtered, closed @ P @ closed.mT + L @ R @ L.mT + Q - cross - cross.mT)


def filtering(problem: MultirateProblem, due: NDArray[np.bool_], P: Array) -> Correction:
    """One instant of the filter with the sensors that are due (..., q), from covariances P (..., n, n) on."""
    plant = problem.plant
    return corrected(plant.A, plant.drive @ plant.drive.T, sensing(problem, due), P)


def steady_state(problem: MultirateProblem) -> RiccatiDesign | None:
    """The filter for white noise of unit intensity, or None where the recursion from zero does not do.

    From one instant that measures to the next is one step of the recursion; what lies between is predicted.
    """
    plant, mask = problem.plant, problem.schedule.mask
    Q = plant.drive @ plant.drive.T
    instants, (first, kinds) = np.flatnonzero(mask.any(axis=1)), problem.schedule.kinds
    which, different = np.array(kinds)[instants], sensing(problem, mask[list(first)])
    if _nearly_dependent(different.R):
        return None
    ahead = np.diff(instants, append=instants[0] + len(mask))
    powers, sums = _predictions(plant.A, Q, int(ahead.max()))
    maps = RiccatiMap(*(part[which] for part in _maps(plant.A, Q, different)))
    move = powers[ahead - 1]
    maps = RiccatiMap(move @ maps.A, maps.G, move @ maps.H @ move.mT + sums[ahead - 1])
    P = from_zero(maps)
    if P is None:
        return None
    step = corrected(plant.A, Q, different.at(which), P)
    # Of each instant the last one before it that measures, and how long ago that one's prediction was made.
    last = np.searchsorted(instants, np.arange(len(mask))) - 1
    ago = (np.arange(len(mask)) - instants[last]) % len(mask) - 1
    following = powers[ago] @ step.following[last] @ powers[ago].mT + sums[ago]
    L = np.zeros((len(mask), *step.L.shape[1:]))
    L[instants] = step.L
    following = symmetric(following)
    again = following[instants]
    deviation = np.sqrt(np.maximum(np.diagonal(again, axis1=1, axis2=2), 0.0))
    if np.any(np.abs(again - P) > REPEATS * deviation[:, :, None] * deviation[:, None, :]):
        return None
    return RiccatiDesign(L, following, np.inf)


def _predictions(A: Array, Q: Array, count: int) -> tuple[Array, Array]:
    """A^j, and the covariance that j steps without a measurement add, for j = 0 ... count - 1, in stacks."""
    powers, sums = [np.eye(len(A))], [np.zeros_like(Q)]
    for _ in range(count - 1):
        powers.append(np.dot(A, powers[-1]))
        sums.append(np.dot(np.dot(A, sums[-1]), A.T) + Q)
    return np.array(powers), np.array(sums)


def _nearly_dependent(R: Array) -> bool:
    """Whether noises of several sensors nearly determine each other, so that R has lost digits that D still has."""
    units = np.sqrt(np.diagonal(R, axis1=-2, axis2=-1))
    correlation = R / units[..., :, None] / units[..., None, :]
    if np.count_nonzero(correlation) == correlation.shape[0] * correlation.shape[1]:
        return False
    return bool(np.linalg.eigvalsh(correlation).min() < DEPENDENT)


def _maps(A: Array, Q: Array, sensors: Sensing) -> RiccatiMap:
    """P -> following P, in stacks; what the measurements tell of correlated noise is taken out of the plant."""
    C, R, S = sensors
    weight = np.linalg.solve(R, C)
    if S is None:
        shape = (len(C), *A.shape)
        return RiccatiMap(np.broadcast_to(A, shape), C.mT @ weight, np.broadcast_to(Q, shape))
    cross = np.linalg.solve(R, S.mT)
    return RiccatiMap(A - S @ weight, C.mT @ weight, Q - S @ cross)


@dataclass(frozen=True, eq=False)
class FilterGains:
    """The filter for white noise of unit intensity, with one entry for each of N phases.

    L (N, n, q): x^(k+1|k) = A x^(k|k-1) + B_u u(k) + L v(k), with the innovation v = y - C x^(k|k-1). K (N, lag + 1, n,
    q): x^(k-i|k) = x^(k-i|k-1) + K_i v(k). predicted, filtered, smoothed (N, n, n): covariances of the error of
    x^(k|k-1), of x^(k|k) and of x^(k-lag|k). innovation (N, q, q): that of v(k); zero for sensors that do not measure.
    """

    L: Array
    K: Array
    predicted: Array
    filtered: Array
    smoothed: Array
    innovation: Array


def filter_gains(problem: MultirateProblem, predicted: Array, lag: int = 0) -> FilterGains:
    """The filter at the stationary covariances `predicted` (N, n, n) of `kalman_design`, and its smoother."""
    mask = problem.schedule.mask
    sensors, step = _step(problem, predicted)
    closed = problem.plant.A - step.L @ sensors.C
    gains: list[Array] = [step.K]
    smoothed, cross = step.filtered, predicted
    for _ in range(lag):
        # Covariance of the error of x^(k-i|k-1) with that of x^(k|k-1); the innovation v(k) tells of both.
        cross = np.roll(cross @ closed.mT, 1, axis=0)
        K = solve(step.innovation, sensors.C @ cross.mT).mT
        smoothed = np.roll(smoothed, 1, axis=0) - K @ step.innovation @ K.mT
        gains.append(K)
    due = mask[:, :, None] & mask[:, None, :]
    parts = step.L, np.stack(gains, axis=1), predicted, step.filtered, smoothed, step.innovation * due
    return FilterGains(*(read_only(part) for part in parts))


def read_only(array: Array) -> Array:
    """The same numbers, which nobody who is handed them can change."""
    array = array.view()
    array.flags.writeable = False
    return array


def smoothing_limit(problem: MultirateProblem, predicted: Array) -> Array:
    """Covariances (N, n, n) of the error of x^ given all measurements, past and future; no lag does better."""
    sensors, step = _step(problem, predicted)
    closed = problem.plant.A - step.L @ sensors.C
    information = sensors.C.mT @ np.linalg.solve(step.innovation, sensors.C)
    # What later innovations tell, backwards in time: Z(k) = information(k) + closed(k)' Z(k+1) closed(k).
    after = settled(RiccatiMap(closed[::-1].mT, np.zeros_like(closed), information[::-1]))  # Z(N), Z(N-1), ... Z(1)
    if after is None:
        return predicted
    later = np.roll(after[::-1], 1, axis=0)  # Z(0) = Z(N), Z(1), ...
    return np.asarray(predicted - predicted @ later @ predicted)


def _step(problem: MultirateProblem, predicted: Array) -> tuple[Sensing, Correction]:
    sensors, plant = sensing(problem, problem.schedule.mask), problem.plant
    return sensors, corrected(plant.A, plant.drive @ plant.drive.T, sensors, predicted)
