"""The steady-state multi-rate Kalman filter, and state scales taken from its error covariance.

The filter is the limit of every recursion here at an infinite level, and a lower bound of it at a finite one: the
stabilising solution at any level is no smaller. So the other recursions start from it, which is right also for unstable
modes that nothing disturbs; from zero they would never learn of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replication.errors import InvalidInputError, SolverError
from replication.estimation.linear.periodic import PeriodicSystem, Stage, monodromy
from replication.estimation.linear.riccati import RiccatiMap, apply, recentre, settled
from replication.estimation.multirate.problem import MultirateProblem, ScaledProblem, require_problem
from replication.estimation.validation import Array, hidden_modes

SCALING_NOISE = 1e-6
"""Process noise on every state, in its unit, that keeps the covariances used for scaling positive definite."""
STABILITY_MARGIN = 1e-9
"""A multiplier closer than this to the unit circle, or outside, counts as not stable; as in the detectability test."""
HIDDEN_TOLERANCE = 1e-6
"""Share of a disturbance, in state units, below which it does not reach a mode."""
NEGATIVE = 1e-9
"""Size of an eigenvalue of a covariance that may be negative by rounding."""
REPEATS = 1e-11
"""Change over one step, in units of the standard deviations, up to which a solution is believed."""
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
    """The scaled problem and the stabilising solution X_k at an infinite level, in scaled coordinates (N, n, n)."""

    scaled: ScaledProblem
    states: Array

    @cached_property
    def floor(self) -> float:
        """sqrt(max_k lambda_max(W X_k W')): no observer, at no level, has a smaller gain."""
        return float(np.sqrt(largest_weighted(self.scaled, self.states)))


def kalman_design(problem: MultirateProblem) -> RiccatiDesign:
    """The steady-state periodic Kalman filter (white d, w of unit intensity): the infinite level.

    Raises InvalidInputError if a mode on the unit circle is not disturbed: its gains tend to zero and never settle on
    stabilising ones; disturb it then. Raises SolverError if rounding hides the limit of the recursion.
    """
    require_problem(problem)
    centre = kalman_centre(problem)
    scaled, states = centre.scaled, centre.states
    corrected = scaled.corrected(states, scaled.maps())
    return RiccatiDesign(scaled.gains(corrected), scaled.unscaled(states), np.inf)


def kalman_centre(problem: MultirateProblem) -> KalmanCentre:
    """The stabilising solution at an infinite level; errors as in `kalman_design`."""
    require_problem(problem)
    if (mode := _undisturbed_on_circle(problem)) is not None:
        require_noise_near(problem)
        raise InvalidInputError(
            f"the mode {mode:.6g} on the unit circle is not disturbed, so its estimator never settles, and the Riccati "
            "route has no answer; disturb it a little by a column of B_d: the gains of that plant achieve no more in "
            "this one"
        )
    scaled = problem.whitened.scaled(state_scales(problem))
    maps = scaled.maps()
    states = _from_zero(problem, scaled, maps)
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
    return KalmanCentre(scaled, states)


def _from_zero(problem: MultirateProblem, scaled: ScaledProblem, maps: RiccatiMap) -> Array | None:
    """The scaled states of the recursion from zero, one step on; None unless what they may still change is rounding.

    From zero a mode that is hardly disturbed rises so slowly that the recursion may seem to have settled.
    """
    covariance = _covariance(problem, 0.0)
    if covariance is None:
        return None
    states = np.linalg.solve(scaled.T, np.linalg.solve(scaled.T, covariance).mT)
    again = np.roll(apply(maps, states), 1, axis=0)
    left = 1 - _multiplier(scaled, again, maps)
    return again if left > STABILITY_MARGIN and np.abs(again - states).max() <= REPEATS * left else None


def require_noise_near(problem: MultirateProblem) -> None:
    """Raise InvalidInputError if the noise of the sensors differs by more than rounding allows."""
    if (apart := np.linalg.cond(problem.plant.D)) > NOISE_APART:
        raise InvalidInputError(
            f"the noise of the sensors differs by a factor of {apart:.1e}, too much for floating point; give the "
            f"best sensor more, 1 / {NOISE_APART:.0e} of the worst or above"
        )


def _undisturbed_on_circle(problem: MultirateProblem) -> complex | None:
    """A mode on the unit circle that no noise reaches, or None; with correlated noise a multiplier over the period.

    Rounding blurs a mode of multiplicity k by the k-th root of machine precision; a wider one counts as off the circle.
    """
    plant, units = problem.plant, state_units(problem)
    A, B = plant.A / units[:, None] * units, plant.B_d / units[:, None]
    if plant.correlated:
        # What the measurements tell of the noise is known, and disturbs nothing.
        rest = problem.whitened.scaled(np.stack([np.diag(units)] * problem.schedule.period))
        none = np.zeros((0, plant.order)), np.zeros((0, rest.B.shape[-1]))
        lifted = PeriodicSystem(tuple(Stage(A_k, B_k, *none) for A_k, B_k in zip(rest.A, rest.B, strict=True))).lift()
        A, B = lifted.A, lifted.B
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


def state_scales(problem: MultirateProblem) -> Array:
    """T_k (N, n, n), roots of the error covariances of a Kalman filter with a little process noise on every state.

    Cholesky factors, unless rounding makes a covariance singular. Raises SolverError if rounding spoils the recursion.
    """
    covariance = _covariance(problem, SCALING_NOISE)
    if covariance is None:
        raise SolverError(
            "the error covariances used to scale the states were lost in rounding: sensors are almost free of noise, "
            "or modes hardly seen, or growing by many orders of magnitude between measurements; change D, C or the "
            "periods"
        )
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=float)
    except np.linalg.LinAlgError:
        # States that nearly cancel leave a covariance whose least eigenvalues are rounding; any units of their size
        # serve, for these are scales and no result.
        units = state_units(problem)
        variances, axes = np.linalg.eigh(covariance / np.outer(units, units))
        least = np.finfo(float).eps * np.max(variances, axis=-1, keepdims=True)
        return np.asarray(units[:, None] * axes * np.sqrt(np.maximum(variances, least))[:, None, :])


def _covariance(problem: MultirateProblem, noise: float) -> Array | None:
    """Error covariances (N, n, n) of the Kalman filter with more process noise, by squares of the units; from zero."""
    scaled = problem.whitened.scaled(np.stack([np.diag(state_units(problem))] * problem.schedule.period))
    A, G, H = scaled.maps()
    states = settled(RiccatiMap(A, G, H + noise * np.eye(problem.plant.order)))
    return None if states is None else scaled.unscaled(states)


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
    seen = np.take(C, np.arange(count), axis=0, mode="wrap") @ powers
    information, driven = np.sum(seen**2, axis=(0, 1)), np.sum((powers @ plant.drive) ** 2, axis=(0, 2))
    driven[driven == 0] = np.inf
    seen = np.divide(1.0, information, out=np.full(n, np.inf), where=information > 0)
    squared = np.minimum(driven, seen)
    return np.sqrt(np.where(np.isfinite(squared), squared, 1.0))


def stationary(maps: RiccatiMap, reference: Array) -> Array | None:
    """The solution (N, n, n) that the recursion reaches from the states of `reference`, or None."""
    try:
        deviation = settled(recentre(maps, reference))
    except np.linalg.LinAlgError:
        return None
    return None if deviation is None else np.asarray(reference + deviation)


def semidefinite(states: Array) -> bool:
    """Whether all X_k >= 0, to rounding: scaled states are of size one, or vanish where nothing is uncertain."""
    eigenvalues = np.linalg.eigvalsh(states)
    return bool(eigenvalues.min() >= -NEGATIVE * max(1.0, eigenvalues.max()))


def stabilises(scaled: ScaledProblem, states: Array, maps: RiccatiMap) -> bool:
    """Whether the gains at the states stabilise the error system. Every I + X_k G_k must be regular."""
    return _multiplier(scaled, states, maps) < 1 - STABILITY_MARGIN


def _multiplier(scaled: ScaledProblem, states: Array, maps: RiccatiMap) -> float:
    """The largest modulus of the multipliers of the error system with these gains, and what rounding may add to it."""
    total = monodromy(scaled.closed_loop(scaled.corrected(states, maps)))
    # What a measurement takes off a mode that has grown since the one before is known to rounding of that growth.
    blur = np.finfo(float).eps * np.abs(scaled.A).max()
    return float(np.abs(np.linalg.eigvals(total)).max() + blur)


def largest_weighted(scaled: ScaledProblem, states: Array) -> float:
    """max_k lambda_max(W X_k W')."""
    return max(0.0, float(np.linalg.eigvalsh(scaled.W @ states @ scaled.W.mT).max()))


class Sensing(NamedTuple):
    """Sensors of which some measure: C (..., q, n), covariance R (..., q, q) of their noise, S (..., n, q) with d.

    Of a sensor that does not measure the rows are zero and its noise is one, so that its gains come out as zero. S is
    None where plant and sensors have no common noise.
    """

    C: Array
    R: Array
    S: Array | None

    def at(self, index: Any) -> Sensing:
        """Those of some instants."""
        return Sensing(self.C[index], self.R[index], None if self.S is None else self.S[index])


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
    CP = C @ P
    innovation = CP @ C.mT + R
    K = np.asarray(np.linalg.solve(innovation, CP), dtype=float).mT
    # Joseph's form: a sum of squares, so that rounding leaves it semidefinite.
    kept = np.eye(len(A)) - K @ C
    filtered = kept @ P @ kept.mT + K @ R @ K.mT
    if S is None:
        return Correction(K, A @ K, innovation, filtered, A @ filtered @ A.T + Q)
    L = np.asarray(np.linalg.solve(innovation, CP @ A.T + S.mT), dtype=float).mT
    closed, cross = A - L @ C, L @ S.mT
    return Correction(K, L, innovation, filtered, closed @ P @ closed.mT + L @ R @ L.mT + Q - cross - cross.mT)


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

    @property
    def lag(self) -> int:
        """How many instants it looks back."""
        return int(self.K.shape[1]) - 1


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
        K = np.asarray(np.linalg.solve(step.innovation, sensors.C @ cross.mT), dtype=float).mT
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
    told = sensors.C.mT @ np.linalg.solve(step.innovation, sensors.C)
    # What later innovations tell, backwards in time: Z(k) = told(k) + closed(k)' Z(k+1) closed(k).
    after = settled(RiccatiMap(closed[::-1].mT, np.zeros_like(closed), told[::-1]))  # Z(N), Z(N-1), ... Z(1)
    if after is None:
        return predicted
    later = np.roll(after[::-1], 1, axis=0)  # Z(0) = Z(N), Z(1), ...
    return np.asarray(predicted - predicted @ later @ predicted)


def _step(problem: MultirateProblem, predicted: Array) -> tuple[Sensing, Correction]:
    sensors, plant = sensing(problem, problem.schedule.mask), problem.plant
    return sensors, corrected(plant.A, plant.drive @ plant.drive.T, sensors, predicted)
