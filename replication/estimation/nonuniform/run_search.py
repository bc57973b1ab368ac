"""Search of run lengths: how many samples at h_u, at h_l, at h_u, and so on make the worst repeated pattern.

Two lengths are searched from several starts; then runs are interrupted by one sample of the other kind and all lengths
are searched again, as long as that pays.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

Runs = tuple[int, ...]
Value = Callable[[Runs], float]

IMPROVEMENT = 1e-6
"""Relative gain below which a change of one length does not count."""
WORTH = 1e-4
"""Relative gain below which two more runs are not worth having."""
MAX_RUNS = 8


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
