"""Periodic Riccati maps X -> A (I + X G)^-1 X A' + H: composition over a period, doubling, eigenvalues on the circle.

One stage of a periodic estimation problem is one such map. Stages compose to a map of the same form (star product of
the symplectic pencils), so a period of N stages costs N small products, and squaring the map doubles the horizon.
Sources: B. D. O. Anderson, Int. J. Control 28 (1978), doubling; Bittanti and Colaneri, Periodic Systems (2009), ch. 5.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from replication.estimation.validation import Array

MAX_DOUBLINGS = 60
STAGNATION = 1e-10


class RiccatiMap(NamedTuple):
    """The map X -> A (I + X G)^-1 X A' + H; A, G, H of shape (n, n), G and H symmetric and possibly indefinite.

    The stages of a period are one map with stacks (N, n, n) in its three fields.
    """

    A: Array
    G: Array
    H: Array


def stacked(stages: Iterable[RiccatiMap]) -> RiccatiMap:
    """Single maps as the stages of a period."""
    return RiccatiMap(*(np.stack(parts) for parts in zip(*stages, strict=True)))


def reversed_in_time(stages: RiccatiMap) -> RiccatiMap:
    """The same stages, the last one first."""
    return RiccatiMap(*(part[::-1] for part in stages))


def symmetric(matrix: Array) -> Array:
    """The symmetric part of a square matrix, or of each in a stack: removes the rounding that products leave."""
    return np.asarray((matrix + matrix.mT) / 2)


def following(states: Array) -> Array:
    """Of each phase what is given of the next one; of the last phase that of the first."""
    return np.concatenate([states[1:], states[:1]])


def apply(stage: RiccatiMap, X: Array) -> Array:
    """One step of the recursion from X (n, n); for stacks (..., n, n), one by one."""
    return symmetric(stage.A @ np.linalg.solve(X @ stage.G + np.eye(X.shape[-1]), X) @ stage.A.mT + stage.H)


def compose(first: RiccatiMap, second: RiccatiMap) -> RiccatiMap:
    """The map that applies `first` and then `second`; for stacks (..., n, n), one by one.

    (I + G H)^-1 G = G (I + H G)^-1 saves a second system of equations.
    """
    n = first.A.shape[-1]
    both = np.concatenate([first.A, first.H @ second.A.mT], axis=-1)
    solved = np.linalg.solve(first.H @ second.G + np.eye(n), both)
    ahead = second.A @ solved
    told = first.A.mT @ (second.G @ solved[..., :n])
    return RiccatiMap(ahead[..., :n], first.G + told, second.H + ahead[..., n:])


def tree(stages: RiccatiMap) -> list[RiccatiMap]:
    """The stages, then neighbours composed, and so on up to the one map of the period: log2(N) rounds of stacks.

    Where the number is odd the last map of a round stays alone. Raises numpy.linalg.LinAlgError where a composition
    does not exist (a recursion that escapes to infinity).
    """
    levels = [stages]
    while (count := len(levels[-1].A)) > 1:
        below, even = levels[-1], count - count % 2
        pairs = compose(
            RiccatiMap(*(part[0:even:2] for part in below)), RiccatiMap(*(part[1:even:2] for part in below))
        )
        if even < count:
            pairs = RiccatiMap(*(np.concatenate([pair, part[even:]]) for pair, part in zip(pairs, below, strict=True)))
        levels.append(pairs)
    return levels


def period_map(stages: RiccatiMap) -> RiccatiMap:
    """The map over all stages in order; raises as `tree`."""
    return _only(tree(stages)[-1])


def down(levels: Sequence[RiccatiMap], X: Array) -> Array:
    """The states (N, n, n) at all phases from X at phase 0, on the way back down a `tree`."""
    states = X[None]
    for level in levels[-2::-1]:
        first = RiccatiMap(*(part[0 : len(part) - 1 : 2] for part in level))
        both = np.empty_like(level.A)
        both[0::2], both[1::2] = states, apply(first, states[: len(first.A)])
        states = both
    return states


def recentre(stages: RiccatiMap, reference: Array) -> RiccatiMap:
    """The maps of the deviation X_k - reference[k], for a reference of one symmetric matrix per phase (N, n, n).

    Same pencil up to a shear, so the same eigenvalues and solutions; a stabilising reference makes the new A stable.
    Raises numpy.linalg.LinAlgError where I + reference[k] G_k is singular.
    """
    A, G, H = stages
    # (I + X G)^-1 from the left, so that A_c = A (I + X G)^-1 and the step from the reference is A_c X A'.
    inner = (np.eye(A.shape[-1]) + reference @ G).mT
    solved = np.linalg.solve(inner, np.concatenate([A.mT, G], axis=-1))
    closed, weight = solved[..., : A.shape[-1]].mT, solved[..., A.shape[-1] :]
    return RiccatiMap(closed, symmetric(weight), symmetric(closed @ reference @ A.mT + H - following(reference)))


def settled(stages: RiccatiMap) -> Array | None:
    """The states (N, n, n) of the recursion that began with X = 0 at phase 0 long ago, or None if it does not settle.

    Structured doubling of the period map; the limit is the stabilising solution where one exists and the recursion
    starts in its reach (see `recentre`). None is an answer, not a failure: below the achievable level the recursion
    has no limit.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            levels = tree(stages)
            start = _doubled(_only(levels[-1]))
            states = None if start is None else down(levels, start)
        except np.linalg.LinAlgError:
            return None
    return states if states is not None and np.isfinite(states).all() else None


def _only(stages: RiccatiMap) -> RiccatiMap:
    return RiccatiMap(*(part[0] for part in stages))


def _doubled(total: RiccatiMap) -> Array | None:
    """The limit of repeating a map from zero, or None; raises numpy.linalg.LinAlgError where the recursion escapes."""
    for _ in range(MAX_DOUBLINGS):
        before, (A, G, H) = total.H, compose(total, total)
        total = RiccatiMap(A, symmetric(G), symmetric(H))
        size = np.linalg.norm(total.H)
        if not np.isfinite(size):
            return None
        if np.linalg.norm(total.H - before) <= STAGNATION * size:  # quadratic convergence: the next step is rounding
            return total.H
    return None


def circle_angles(stages: RiccatiMap, tolerance: float) -> Array:
    """Angles in [0, pi] of the eigenvalues of the period's symplectic pencil within `tolerance` of the unit circle.

    For the maps of a gain at level g they are the (lifted) frequencies at which a singular value equals g. Raises
    LinAlgError if the pencil overflows, as at the level of a gain that is zero up to rounding.
    """
    A, G, H = period_map(stages)
    n = len(A)
    left, right = np.eye(2 * n), np.eye(2 * n)
    left[:n, :n], left[n:, :n], right[:n, n:], right[n:, n:] = A.T, -H, G, A
    if not (np.isfinite(left).all() and np.isfinite(right).all()):
        raise np.linalg.LinAlgError("the pencil overflows")
    real, imaginary, beta, _, _, _, failed = scipy.linalg.lapack.dggev(left, right, 0, 0)
    if failed:
        raise np.linalg.LinAlgError("the pencil has no eigenvalues")
    alpha = real + 1j * imaginary
    # |alpha| = |beta| is the circle; comparing them so needs no division by a beta that may vanish.
    close = np.abs(np.abs(alpha) - np.abs(beta)) <= tolerance * np.maximum(np.abs(alpha), np.abs(beta))
    return np.sort(np.abs(np.angle(alpha[close] * np.conj(beta[close]))))
