"""The gain over every sampling sequence: from below by one bad sequence, and with the proved level from both sides.

The gain of a given sequence h_0 ... h_{K-1} is the largest singular value of the map from w_0 ... w_{K-1} to
e_1 ... e_K, found by Lanczos on a banded triangular system; the bound is ||e|| / ||w|| of the disturbance found, so it
is attained. Sequences are searched by their run lengths: how many samples at h_u, at h_l, at h_u, and so on make the
worst repeated pattern. Two lengths are searched from several starts; then runs are interrupted by one sample of the
other kind and all lengths are searched again, as long as that pays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.validation import Array, as_array, positive_integer

SEARCH_TOLERANCE = 1e-4
FINAL_TOLERANCE = 1e-10
"""Of Lanczos; the error of the singular value is about its square."""
DENSE, RESTARTS = 2000, 200
"""Disturbances of at most so many numbers come from a singular value decomposition if Lanczos restarts more often."""
Runs = tuple[int, ...]
Value = Callable[[Runs], float]

IMPROVEMENT = 1e-6
"""Relative gain below which a change of one length does not count."""
WORTH = 1e-4
"""Relative gain below which two more runs are not worth having."""
MAX_RUNS = 8


@dataclass(frozen=True)
class BadSequence:
    """A sampling sequence and its worst disturbance. level: ||e|| / ||w||; periods (K,) in seconds; w (K, m); e (K +
    1, s).

    runs: the pattern that was repeated to make the sequence: samples at h_u, at h_l, at h_u, and so on.
    """

    level: float
    periods: Array
    w: Array
    e: Array
    runs: tuple[int, ...]


def simulate_error(plant: SampledPlant, filter_: Estimator, periods: Array, w: Array) -> Array:
    """e_0 ... e_K of eq. (5) from rest for the periods (K,) and disturbances w (K, m), of shape (K + 1, s).

    Raises InvalidInputError for periods that are not positive, another length of w, or a filter that does not fit.
    """
    periods = as_periods("periods", periods)
    w = as_array("w", w, (len(periods), plant.B.shape[1]), axes="(K, m)")
    return filter_.errors(plant, periods, w)


def sequence_gain(
    plant: SampledPlant,
    filter_: Estimator,
    periods: Array,
    *,
    per_duration: bool = False,
    tolerance: float = FINAL_TOLERANCE,
) -> tuple[float, Array]:
    """The gain of one finite sequence and its worst disturbance w (K, m) of unit norm, by Lanczos to `tolerance`.

    per_duration weighs |w_k|^2 by h_k and |e_k|^2 by h_k (the last error by the last period). Raises InvalidInputError
    for fewer than two periods, periods that are not positive, or a filter that does not fit.
    """
    periods = as_periods("periods", periods)
    if len(periods) < 2:
        raise InvalidInputError(f"periods must have at least two entries, got {len(periods)}; repeat the period")
    filter_.error_output(plant)
    steps, drives = filter_.steps_along(plant, periods, plant.transitions(periods)[:, : plant.order])
    output = filter_.error_output(plant)
    count, size, inputs = drives.shape
    root = np.sqrt(periods)[:, None] if per_duration else np.ones((count, 1))
    e_root = np.vstack([root[1:], root[-1:]])
    drives = drives / root[:, :, None]
    band, squares, weights = _banded(steps), output.T @ output, e_root**2

    def solved(right: Array, trans: str = "N") -> Array:
        x, _ = scipy.linalg.lapack.dtbtrs(band, right.reshape(-1, 1), uplo="L", trans=trans, diag="U")
        return np.asarray(x).reshape(count, size)

    def states(w: Array) -> Array:
        return solved(np.einsum("kij,kj->ki", drives, w.reshape(count, inputs)))

    def forward(w: Array) -> Array:
        return np.asarray(states(w) @ output.T * e_root)

    def normal(w: Array) -> Array:
        costate = solved(states(w) @ squares * weights, "T")
        return np.asarray(np.einsum("kij,ki->kj", drives, costate).ravel())

    operator = scipy.sparse.linalg.LinearOperator((count * inputs, count * inputs), matvec=normal, dtype=float)
    # A fixed first guess, and fixed ones after a restart, make the result reproducible.
    rng = np.random.default_rng(0)
    guess = rng.standard_normal(count * inputs)
    small = count * inputs <= DENSE
    try:
        most = RESTARTS if small else None
        found = scipy.sparse.linalg.eigsh(operator, k=1, which="LM", v0=guess, tol=tolerance, rng=rng, maxiter=most)[1]
    except scipy.sparse.linalg.ArpackNoConvergence:
        # The largest values lie too close together for Lanczos.
        if not small:
            raise
        found = np.linalg.svd(np.array([forward(unit).ravel() for unit in np.eye(count * inputs)])).U
    w = found[:, 0] / np.linalg.norm(found[:, 0])
    return float(np.linalg.norm(forward(w))), np.asarray(w.reshape(count, inputs) / root)


def _banded(steps: Array) -> Array:
    """The matrix that takes x_1 ... x_K to x_{k+1} - A_k x_k, whose diagonal is one: its lower band, for LAPACK."""
    count, size, _ = steps.shape
    band = np.zeros((2 * size, count, size))
    row, column = np.indices((size, size))
    band[size + row - column, :-1, column] = -np.moveaxis(steps[1:], 0, -1)
    return band.reshape(2 * size, count * size)


def repeated(periods: PeriodRange, runs: Sequence[int], horizon: int) -> Array:
    """`horizon` periods that repeat: runs[0] samples at h_u, runs[1] at h_l, runs[2] at h_u, and so on."""
    if positive_integer("horizon", horizon) < 2 or not runs or min(runs) < 0 or sum(runs) < 1:
        raise InvalidInputError(f"need a horizon of at least 2 and non-negative runs, got {horizon} and {tuple(runs)}")
    pattern = np.concatenate([np.full(n, periods.h_u if i % 2 == 0 else periods.h_l) for i, n in enumerate(runs)])
    return np.tile(pattern, horizon // len(pattern) + 1)[:horizon]


def worst_sequence(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    horizon: int,
    final_horizon: int | None = None,
    per_duration: bool = False,
) -> BadSequence:
    """Search bursts of h_u between runs of h_l, see `best_runs`.

    The level is that of the best pattern over `final_horizon` samples (by default `horizon`), for which the run lengths
    are adjusted, a lower bound of the gain over all sequences. Raises InvalidInputError if the filter does not fit,
    InfeasibleError if A_f is not Schur stable (the gain is infinite).
    """
    filter_.require_settling(plant)

    def gain_over(samples: int) -> Callable[[Runs], float]:
        def gain(runs: Runs) -> float:
            sequence = repeated(periods, runs, samples)
            return sequence_gain(plant, filter_, sequence, per_duration=per_duration, tolerance=SEARCH_TOLERANCE)[0]

        return gain

    last = positive_integer("final_horizon", horizon if final_horizon is None else final_horizon)
    best = best_runs(gain_over(horizon), horizon)
    if last != horizon:
        best = adjusted(best, gain_over(last))
    sequence = repeated(periods, best, last)
    _, w = sequence_gain(plant, filter_, sequence, per_duration=per_duration)
    e = simulate_error(plant, filter_, sequence, w)
    return BadSequence(error_ratio(sequence, w, e, per_duration=per_duration), sequence, w, e, best)


def error_ratio(periods: Array, w: Array, e: Array, *, per_duration: bool = False) -> float:
    """||e|| / ||w|| of a simulation: e (K + 1, s), w (K, m); both norms weighted by interval length if
    `per_duration`."""
    weights = periods if per_duration else np.ones_like(periods)
    last = np.append(weights[1:], weights[-1])
    return float(np.sqrt(np.sum(last[:, None] * e[1:] ** 2) / np.sum(weights[:, None] * w**2)))


def best_runs(value: Value, horizon: int) -> Runs:
    """The runs of largest `value` that the search finds; `horizon` samples is as long as a run may usefully be.

    Constant sequences, short, medium and endless runs of h_l are among the starts.
    """
    value = cache(value)
    families: list[list[Runs]] = [[(0, 1)], [(1, 0)]]
    families += [[(burst, rest) for burst in (1, 4, 16)] for rest in (1, horizon // 16, horizon)]
    best = max((adjusted(max(family, key=value), value) for family in families), key=value)
    while len(best) < MAX_RUNS:
        finer = adjusted(max(_interrupted(best), key=value), value)
        if value(finer) <= value(best) * (1 + WORTH):
            return best
        best = finer
    return best


def adjusted(runs: Runs, value: Value) -> Runs:
    """Steepest ascent over the run lengths with steps of one and of a quarter of the length."""
    value = cache(value)
    while True:
        steps = [(i, sign * size) for i, n in enumerate(runs) for sign in (-1, 1) for size in {1, max(1, n // 4)}]
        moves = {(*runs[:i], max(0, runs[i] + step), *runs[i + 1 :]) for i, step in steps}
        best = max(sorted(move for move in moves if any(move)), key=value)
        if value(best) <= value(runs) * (1 + IMPROVEMENT):
            return runs
        runs = best


def _interrupted(runs: Runs) -> list[Runs]:
    """The runs with a few samples of the other kind put into one of them: near its ends, at its quarters or middle."""
    found = []
    for i, n in enumerate(runs):
        for before in sorted({1, n // 16, n // 4, n // 2, 3 * n // 4, n - n // 16, n - 1} & set(range(n + 1))):
            found += [(*runs[:i], before, size, n - before, *runs[i + 1 :]) for size in (1, 4, 16)]
    return found


@dataclass(frozen=True)
class WorstCaseGain:
    """lower: attained by `attack`; upper: proved by `guarantee` for the continuum of periods."""

    attack: BadSequence
    guarantee: Guarantee

    @property
    def lower(self) -> float:
        """||e|| / ||w|| of a sequence and disturbance that are at hand."""
        return self.attack.level

    @property
    def upper(self) -> float:
        """A level that no sequence in the range exceeds."""
        return self.guarantee.level


def worst_case_gain(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    horizon: int,
    final_horizon: int,
    max_leaves: int,
    cuts: Sequence[float] | None = None,
    per_duration: bool = False,
) -> WorstCaseGain:
    """Both ends; see `guaranteed_level` and `worst_sequence` for the effort each argument buys and the errors
    raised."""
    guarantee = guaranteed_level(plant, filter_, periods, max_leaves=max_leaves, cuts=cuts, per_duration=per_duration)
    attack = worst_sequence(
        plant, filter_, periods, horizon=horizon, final_horizon=final_horizon, per_duration=per_duration
    )
    return WorstCaseGain(attack, guarantee)
