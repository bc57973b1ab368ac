"""Periodic Riccati maps X -> A (I + X G)^-1 X A' + H: composition over a period, doubling, eigenvalues on the circle.

One stage of a periodic estimation problem is one such map. Stages compose to a map of the same form (star product of
the symplectic pencils), so a period of N stages costs N small products, and squaring the map doubles the horizon.
Sources: B. D. O. Anderson, Int. J. Control 28 (1978), doubling; Bittanti and Colaneri, Periodic Systems (2009), ch. 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from math import isnan, sqrt
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from replication.estimation.validation import Array

MAX_DOUBLINGS = 60
STAGNATION = 1e-13
TINY = float(np.finfo(float).tiny)
DYING_DOUBLINGS, DEAD = 30, 1e-6
"""A motion that has not died out to this share after so many doublings, a thousand million periods, counts as never."""


class RiccatiMap(NamedTuple):
    """The map X -> A (I + X G)^-1 X A' + H; A, G, H of shape (n, n), G and H symmetric and possibly indefinite.

    The stages of a period are one map with stacks (N, n, n) in its three fields.
    """

    A: Array
    G: Array
    H: Array

    def at(self, index: Any) -> RiccatiMap:
        """Those of the stages, or of the cases, that an index or a slice of the stacks picks."""
        return RiccatiMap(*(part[index] for part in self))


def stacked(stages: Iterable[RiccatiMap]) -> RiccatiMap:
    """Single maps as the stages of a period."""
    return RiccatiMap(*(np.stack(parts) for parts in zip(*stages, strict=True)))


def symmetric(matrix: Array) -> Array:
    """The symmetric part of a square matrix, or of each in a stack: removes the rounding that products leave."""
    return np.asarray((matrix + matrix.mT) / 2)


def following(states: Array) -> Array:
    """Of each phase what is given of the next one; of the last phase that of the first."""
    return np.concatenate([states[1:], states[:1]])


def apply(stage: RiccatiMap, X: Array) -> Array:
    """One step of the recursion from X (n, n); for stacks (..., n, n), one by one."""
    return symmetric(_applied(stage, X))


def _applied(stage: RiccatiMap, X: Array) -> Array:
    return np.asarray(stage.A @ np.linalg.solve(X @ stage.G + identity(X.shape[-1]), X) @ stage.A.mT + stage.H)


def compose(first: RiccatiMap, second: RiccatiMap) -> RiccatiMap:
    """The map that applies `first` and then `second`; for stacks (..., n, n), one by one.

    (I + G H)^-1 G = G (I + H G)^-1 saves a second system of equations.
    """
    n, times = first.A.shape[-1], product(first.A)
    both = np.concatenate([first.A, times(first.H, second.A.mT)], axis=-1)
    solved = solve(times(first.H, second.G) + identity(n), both)
    ahead = times(second.A, solved)
    information = times(first.A.mT, times(second.G, solved[..., :n]))
    return RiccatiMap(ahead[..., :n], first.G + information, second.H + ahead[..., n:])


@cache
def identity(size: int) -> Array:
    """The identity matrix, read-only: made once, since a small one takes as long as a product."""
    matrix = np.eye(size)
    matrix.flags.writeable = False
    return matrix


def product(matrix: Array) -> Callable[[Array, Array], Array]:
    """How to multiply what has the dimensions of `matrix`: of two small matrices numpy.dot takes half the time."""
    return np.dot if matrix.ndim == 2 else np.matmul


def solve(matrix: Array, right: Array) -> Array:
    """matrix^-1 right, each one matrix or a stack; raises numpy.linalg.LinAlgError if a matrix is singular."""
    if matrix.ndim > 2:
        return np.asarray(np.linalg.solve(matrix, right))
    # A small system takes longer to hand to numpy than to solve.
    _, _, solution, failed = scipy.linalg.lapack.dgesv(matrix, right)
    if failed:
        raise np.linalg.LinAlgError("singular")
    return solution  # type: ignore[no-any-return]


def tree(stages: RiccatiMap) -> list[RiccatiMap]:
    """The stages, then neighbours composed, and so on up to the one map of the period: log2(N) rounds of stacks.

    Where the number is odd the last map of a round stays alone. Raises numpy.linalg.LinAlgError where a composition
    does not exist (a recursion that escapes to infinity).
    """
    levels = [stages]
    while (count := len(levels[-1].A)) > 1:
        below, even = levels[-1], count - count % 2
        pairs = compose(below.at(slice(0, even, 2)), below.at(slice(1, even, 2)))
        if even < count:
            pairs = RiccatiMap(*(np.concatenate([pair, part[even:]]) for pair, part in zip(pairs, below, strict=True)))
        levels.append(pairs)
    return levels


def down(levels: Sequence[RiccatiMap], X: Array) -> Array:
    """The states (N, n, n) at all phases from X at phase 0, on the way back down a `tree`."""
    states = X[None]
    for level in levels[-2::-1]:
        first = level.at(slice(0, len(level.A) - 1, 2))
        both = np.empty_like(level.A)
        both[0::2], both[1::2] = states, _applied(first, states[: len(first.A)])
        states = both
    return symmetric(states)


def recentre(stages: RiccatiMap, reference: Array) -> RiccatiMap:
    """The maps of the deviation X_k - reference[k], for a reference of one symmetric matrix per phase (N, n, n).

    Same pencil up to a shear, so the same eigenvalues and solutions; a stabilising reference makes the new A stable.
    Raises numpy.linalg.LinAlgError where I + reference[k] G_k is singular.
    """
    A, G, H = stages
    # (I + X G)^-1 from the left, so that A_c = A (I + X G)^-1 and the step from the reference is A_c X A'.
    inner = (identity(A.shape[-1]) + reference @ G).mT
    solved = np.linalg.solve(inner, np.concatenate([A.mT, G], axis=-1))
    closed, weight = solved[..., : A.shape[-1]].mT, solved[..., A.shape[-1] :]
    return RiccatiMap(closed, symmetric(weight), symmetric(closed @ reference @ A.mT + H - following(reference)))


def settled(stages: RiccatiMap) -> Array | None:
    """The states (N, n, n) of the recursion that began with X = 0 at phase 0 long ago, or None if it does not settle.

    Structured doubling of the period map; the limit is the stabilising solution where one exists and the recursion
    starts in its reach (see `recentre`). None is an answer, not a failure: below the achievable level the recursion
    has no limit.
    """
    states = settled_each(stages.at(np.s_[:, None]))[:, 0]
    return states if np.isfinite(states).all() else None


def settled_each(stages: RiccatiMap) -> Array:
    """`settled` for several cases at once, fields and states (N, cases, n, n): small ones take about the time of one.

    Not numbers where a case does not settle.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            levels = tree(stages)
            starts, ended = _doubled(levels[-1].at(0))
            if ended.all():
                return down(levels, starts)
            states = np.full_like(stages.A, np.nan)
            states[:, ended] = down([level.at(np.s_[:, ended]) for level in levels], starts[ended])
            return states
        except np.linalg.LinAlgError:
            return case_by_case(settled_each, stages)


def case_by_case(work: Callable[[RiccatiMap], Array], stages: RiccatiMap) -> Array:
    """What `work` finds of each case alone where, of all together, one raises LinAlgError: of which is not told."""
    if (count := stages.A.shape[1]) == 1:
        return np.full_like(stages.A, np.nan)
    return np.concatenate([work(stages.at(np.s_[:, i : i + 1])) for i in range(count)], axis=1)


def from_zero(stages: RiccatiMap) -> Array | None:
    """As `settled`, but None too where the recursion's own motion does not die out.

    What dies out has the stabilising solution for its limit, so that nothing else is to be checked.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            levels = tree(stages)
            period = levels[-1].at(0)
            for _ in range(DYING_DOUBLINGS):
                before, period = period.H, compose(period, period)
                size = np.abs(period.H).max()
                if not np.isfinite(size):
                    return None
                if np.abs(period.H - before).max() <= STAGNATION * size and np.abs(period.A).max() <= DEAD:
                    states = down(levels, symmetric(period.H))
                    return states if np.all(np.isfinite(states)) else None
        except np.linalg.LinAlgError:
            return None
    return None


def gramians(stages: Iterable[tuple[Array, Array]]) -> Array | None:
    """The P (N, n, n) that repeat under P_{k+1} = A_k P_k A_k' + B_k B_k' of stages (A_k, B_k), None if none do.

    The horizon is doubled until no entry grows beside its own variances, so that units of the states do not matter.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        levels = tree(stacked(RiccatiMap(A, np.zeros_like(A), B @ B.T) for A, B in stages))
        step, _, total = levels[-1].at(0)
        for _ in range(MAX_DOUBLINGS):
            grown = symmetric(step @ total @ step.T)
            total, step = total + grown, step @ step
            size = np.sqrt(np.diag(total))
            if np.all(np.abs(grown) <= np.finfo(float).eps * np.outer(size, size)):
                return down(levels, total)
    return None


def _twice(A: Array, G: Array, H: Array) -> tuple[Array, Array, Array, Array]:
    """`compose` of each map with itself, G and H symmetric, and by how much H has grown."""
    n = A.shape[-1]
    solved = np.linalg.solve(H @ G + identity(n), np.concatenate([A, H @ A.mT], axis=-1))
    ahead = A @ solved
    grown = symmetric(ahead[..., n:])
    return ahead[..., :n], G + symmetric(A.mT @ (G @ solved[..., :n])), H + grown, grown


def _doubled(total: RiccatiMap) -> tuple[Array, NDArray[np.bool_]]:
    """The limits of repeating maps (cases, n, n) from zero, and which have one; each leaves when it is done.

    Raises numpy.linalg.LinAlgError where a recursion escapes.
    """
    A, G, H = total.A, symmetric(total.G), symmetric(total.H)
    limits, ended = np.zeros_like(H), np.zeros(len(H), dtype=bool)
    cases, previous = np.arange(len(H)), [np.inf] * len(H)
    for _ in range(MAX_DOUBLINGS):
        A, G, H, grown = _twice(A, G, H)
        rows, more = H.reshape(len(H), -1), grown.reshape(len(H), -1)
        sizes, changes = np.vecdot(rows, rows), np.vecdot(more, more)
        if (changes > (1e3 * STAGNATION) ** 2 * sizes).all():
            previous = [np.inf] * len(cases)
            continue  # none is near its limit, and none is lost
        steps = [
            sqrt(change / max(size, TINY)) if size < np.inf else np.nan
            for size, change in zip(sizes.tolist(), changes.tolist(), strict=True)
        ]
        # Quadratic convergence ends in rounding: accept the first step that is tiny, or small and no shorter.
        ready = [
            step <= STAGNATION or before >= step <= 1e3 * STAGNATION
            for step, before in zip(steps, previous, strict=True)
        ]
        going = [not (flag or isnan(step)) for flag, step in zip(ready, steps, strict=True)]
        if not all(going):
            limits[cases[ready]], ended[cases[ready]] = H[ready], True
            cases, A, G, H = cases[going], A[going], G[going], H[going]
            steps = [step for step, goes in zip(steps, going, strict=True) if goes]
            if not steps:
                break
        previous = steps
    return limits, ended


def circle_angles(stages: RiccatiMap, tolerance: float) -> Array:
    """Angles in [0, pi] of the eigenvalues of the period's symplectic pencil within `tolerance` of the unit circle.

    For the maps of a gain at level g they are the (lifted) frequencies at which a singular value equals g. Raises
    LinAlgError if the pencil overflows, as at the level of a gain that is zero up to rounding.
    """
    A, G, H = tree(stages)[-1].at(0)
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
