"""The gain over every sampling sequence: from below by one bad sequence, and with the proved level from both sides.

The bound is ||e|| / ||w|| of the worst disturbance of one sequence, so it is attained. Sequences are searched by their
run lengths: how many samples at h_u, at h_l, at h_u, and so on make the worst repeated pattern. Two lengths are
searched from several starts; then runs are interrupted by one sample of the other kind and all lengths are searched
again, as long as that pays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods
from replication.estimation.nonuniform.sequences import sequence_gain, sequence_gains
from replication.estimation.validation import Array, as_array, positive_integer

Runs = tuple[int, ...]

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

    def gains(sequences: Sequence[Array]) -> list[float]:
        return sequence_gains(plant, filter_, sequences, per_duration=per_duration)

    last = positive_integer("final_horizon", horizon if final_horizon is None else final_horizon)
    best = best_runs(Search(gains, periods, horizon))
    if last != horizon:
        best = adjusted(best, Search(gains, periods, last))
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


class Search:
    """The gains of runs that are repeated over `horizon` samples, found once, and together where several are tried."""

    def __init__(self, gains: Callable[[Sequence[Array]], list[float]], periods: PeriodRange, horizon: int) -> None:
        """gains: what those of sequences are."""
        self._gains, self._periods, self.horizon = gains, periods, horizon
        self._known: dict[bytes, float] = {}

    def best(self, tried: Iterable[Runs]) -> tuple[float, Runs]:
        """The largest gain, and the first runs that have it."""
        sequences = {runs: repeated(self._periods, runs, self.horizon) for runs in tried}
        new = {one.tobytes(): one for one in sequences.values() if one.tobytes() not in self._known}
        if new:
            self._known |= dict(zip(new, self._gains(list(new.values())), strict=True))
        values = {runs: self._known[one.tobytes()] for runs, one in sequences.items()}
        best = max(values, key=values.__getitem__)
        return values[best], best


def best_runs(search: Search) -> Runs:
    """The runs of the largest gain that the search finds; its horizon is as long as a run may usefully be.

    Constant sequences, short, medium and endless runs of h_l are among the starts.
    """
    horizon = search.horizon
    families: list[list[Runs]] = [[(0, 1)], [(1, 0)]]
    families += [[(burst, rest) for burst in (1, 4, 16)] for rest in (1, horizon // 16, horizon)]
    search.best(runs for family in families for runs in family)
    value, best = search.best([adjusted(search.best(family)[1], search) for family in families])
    while len(best) < MAX_RUNS:
        finer = adjusted(search.best(_interrupted(best))[1], search)
        more, _ = search.best([finer])
        if more <= value * (1 + WORTH):
            return best
        value, best = more, finer
    return best


def adjusted(runs: Runs, search: Search) -> Runs:
    """Steepest ascent over the run lengths with steps of one and of a quarter of the length."""
    value, _ = search.best([runs])
    while True:
        steps = [(i, sign * size) for i, n in enumerate(runs) for sign in (-1, 1) for size in {1, max(1, n // 4)}]
        moves = {(*runs[:i], max(0, runs[i] + step), *runs[i + 1 :]) for i, step in steps}
        more, best = search.best(sorted(move for move in moves if any(move)))
        if more <= value * (1 + IMPROVEMENT):
            return runs
        value, runs = more, best


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
