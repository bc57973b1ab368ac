"""The states of a periodic Riccati recursion at all phases at once, from zero: fast, and checked by its user.

Neighbouring maps are composed in stacks, up a tree to the map of the period, which is then doubled; the states come
down the same tree. Here (I + G H)^-1 G = G (I + H G)^-1 saves every other solution of `riccati.compose`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dgesv

from replication.estimation.linear.riccati import STAGNATION, RiccatiMap, symmetric
from replication.estimation.validation import Array

DOUBLINGS, SETTLED = 30, 1e-6
"""A motion that has not died out to this share after so many doublings, a thousand million periods, counts as never."""


def from_zero(stages: RiccatiMap) -> Array | None:
    """The states (N, n, n) of the recursion with `stages` (N, n, n) that began with X = 0 long ago, or None.

    None if it does not settle, or if its own motion does not die out: its limit need not be the stabilising solution
    then.
    """
    levels = [stages]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            while len(levels[-1].A) > 1:
                levels.append(_halved(levels[-1]))
            X = _doubled(RiccatiMap(*(part[0] for part in levels[-1])))
            if X is None:
                return None
            states = X[None]
            for level in levels[-2::-1]:
                states = _between(level, states)
        except np.linalg.LinAlgError:
            return None
    return states if np.all(np.isfinite(states)) else None


def _joined(first: RiccatiMap, second: RiccatiMap) -> RiccatiMap:
    """First, then second; each one map, or a stack of them."""
    n = first.A.shape[-1]
    times = product(first.A)
    inner = times(first.H, second.G) + np.eye(n)
    solved = solve(inner, np.concatenate([first.A, times(first.H, second.A.mT)], axis=-1))
    turned, driven = solved[..., :n], solved[..., n:]
    return RiccatiMap(
        times(second.A, turned),
        first.G + times(first.A.mT, times(second.G, turned)),
        second.H + times(second.A, driven),
    )


def product(matrix: Array) -> Callable[[Array, Array], Array]:
    """How to multiply what has the dimensions of `matrix`: of two small matrices numpy.dot takes half the time."""
    return np.dot if matrix.ndim == 2 else np.matmul


def solve(matrix: Array, right: Array) -> Array:
    """matrix^-1 right, each one matrix or a stack; raises numpy.linalg.LinAlgError if a matrix is singular."""
    if matrix.ndim > 2:
        return np.asarray(np.linalg.solve(matrix, right))
    # A small system takes longer to hand to numpy than to solve.
    _, _, solution, failed = dgesv(matrix, right)
    if failed:
        raise np.linalg.LinAlgError("singular")
    return solution  # type: ignore[no-any-return]


def _halved(stages: RiccatiMap) -> RiccatiMap:
    """Neighbours composed; the last map stays alone where their number is odd."""
    count = len(stages.A)
    even = count - count % 2
    pairs = _joined(RiccatiMap(*(part[0:even:2] for part in stages)), RiccatiMap(*(part[1:even:2] for part in stages)))
    if even == count:
        return pairs
    return RiccatiMap(*(np.concatenate([pair, part[even:]]) for pair, part in zip(pairs, stages, strict=True)))


def _doubled(period: RiccatiMap) -> Array | None:
    for _ in range(DOUBLINGS):
        before, period = period.H, _joined(period, period)
        size = np.abs(period.H).max()
        if not np.isfinite(size):
            return None
        if np.abs(period.H - before).max() <= STAGNATION * size and np.abs(period.A).max() <= SETTLED:
            return symmetric(period.H)
    return None


def _between(stages: RiccatiMap, states: Array) -> Array:
    """The states at all phases, from those at every other one."""
    first = RiccatiMap(*(part[0 : len(part) - 1 : 2] for part in stages))
    X = states[: len(first.A)]
    after = first.A @ np.linalg.solve(X @ first.G + np.eye(X.shape[-1]), X) @ first.A.mT + first.H
    both = np.empty_like(stages.A)
    both[0::2], both[1::2] = states, symmetric(after)
    return both
