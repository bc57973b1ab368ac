"""Periodic Riccati maps X -> A (I + X G)^-1 X A' + H: composition over a period, doubling, eigenvalues on the circle.

One stage of a periodic estimation problem is one such map. Stages compose to a map of the same form (star product of
the symplectic pencils), so a period of N stages costs N small products, and squaring the map doubles the horizon.
Sources: B. D. O. Anderson, Int. J. Control 28 (1978), doubling; Bittanti and Colaneri, Periodic Systems (2009), ch. 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg

from replication.estimation.validation import Array

MAX_DOUBLINGS = 60
STAGNATION = 1e-13


class RiccatiMap(NamedTuple):
    """The map X -> A (I + X G)^-1 X A' + H; A, G, H of shape (n, n), G and H symmetric and possibly indefinite."""

    A: Array
    G: Array
    H: Array


def symmetric(matrix: Array) -> Array:
    """The symmetric part of a square matrix, or of each in a stack: removes the rounding that products leave."""
    return np.asarray((matrix + matrix.mT) / 2)


def apply(stage: RiccatiMap, X: Array) -> Array:
    """One step of the recursion from X (n, n)."""
    identity = np.eye(len(X))
    return symmetric(stage.A @ np.linalg.solve(identity + X @ stage.G, X) @ stage.A.T + stage.H)


def compose(first: RiccatiMap, second: RiccatiMap) -> RiccatiMap:
    """The map that applies `first` and then `second`; for stacks (..., n, n), one by one."""
    size = first.A.shape[-1]
    inner = np.eye(size) + first.H @ second.G
    solved = np.linalg.solve(inner, np.concatenate([first.A, first.H @ second.A.mT], axis=-1))
    dual = np.linalg.solve(inner.mT, second.G @ first.A)
    return RiccatiMap(
        second.A @ solved[..., :size],
        symmetric(first.G + first.A.mT @ dual),
        symmetric(second.H + second.A @ solved[..., size:]),
    )


def period_map(stages: Sequence[RiccatiMap]) -> RiccatiMap:
    """The map over all stages in order, by composing neighbours: log2(N) rounds of stacked products.

    Raises numpy.linalg.LinAlgError where a composition does not exist (a recursion that escapes to infinity).
    """
    A, G, H = (np.stack(parts) for parts in zip(*stages, strict=True))
    while (count := len(A)) > 1:
        even = count - count % 2
        pairs = compose(
            RiccatiMap(A[0:even:2], G[0:even:2], H[0:even:2]), RiccatiMap(A[1:even:2], G[1:even:2], H[1:even:2])
        )
        A, G, H = (np.concatenate([pair, rest[even:]]) for pair, rest in zip(pairs, (A, G, H), strict=True))
    return RiccatiMap(A[0], G[0], H[0])


def recentre(stages: Sequence[RiccatiMap], states: Sequence[Array]) -> list[RiccatiMap]:
    """The maps of the deviation X_k - states[k] from a reference of one symmetric matrix per phase.

    Same pencil up to a shear, so the same eigenvalues and solutions; a stabilising reference makes the new A stable.
    Raises numpy.linalg.LinAlgError where I + states[k] G_k is singular.
    """
    A, G, H = (np.stack(parts) for parts in zip(*stages, strict=True))
    reference = np.stack(list(states))
    # (I + X G)^-1 from the left, so that A_c = A (I + X G)^-1 and the step from the reference is A_c X A'.
    closed = np.linalg.solve((np.eye(A.shape[-1]) + reference @ G).mT, A.mT).mT
    following = np.roll(reference, -1, axis=0)
    deviation = symmetric(closed @ reference @ A.mT + H - following)
    weight = symmetric(np.linalg.solve((np.eye(A.shape[-1]) + reference @ G).mT, G))
    return [RiccatiMap(*parts) for parts in zip(closed, weight, deviation, strict=True)]


def fixed_point(stages: Sequence[RiccatiMap]) -> Array | None:
    """The limit of the periodic recursion from X = 0 at phase 0, or None if it does not settle.

    Structured doubling of the period map; the limit is the stabilising solution where one exists and the recursion
    starts in its reach (see `recentre`). None is an answer, not a failure: below the achievable level the recursion
    has no limit.
    """
    previous = np.inf
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            total = period_map(stages)
            for _ in range(MAX_DOUBLINGS):
                doubled = compose(total, total)
                size = float(np.linalg.norm(doubled.H))
                if not np.isfinite(size):
                    return None
                step = float(np.linalg.norm(doubled.H - total.H)) / max(size, np.finfo(float).tiny)
                total = doubled
                # Quadratic convergence ends in rounding: accept the first step that is tiny, or small and no shorter.
                if step <= STAGNATION or (step <= 1e3 * STAGNATION and step >= previous):
                    return total.H
                previous = step
        except np.linalg.LinAlgError:
            return None
    return None


def along_period(stages: Sequence[RiccatiMap], X: Array) -> list[Array]:
    """The states X_0 = X, X_1, ... X_{N-1} of the recursion over one period."""
    states = [X]
    for stage in stages[:-1]:
        states.append(apply(stage, states[-1]))
    return states


def circle_angles(stages: Sequence[RiccatiMap], tolerance: float) -> Array:
    """Angles in [0, pi] of the eigenvalues of the period's symplectic pencil within `tolerance` of the unit circle.

    For the maps of a gain at level g they are the (lifted) frequencies at which a singular value equals g.
    """
    A, G, H = period_map(stages)
    identity, zero = np.eye(len(A)), np.zeros_like(A)
    pencil = np.block([[A.T, zero], [-H, identity]]), np.block([[identity, G], [zero, A]])
    alpha, beta = scipy.linalg.eig(*pencil, right=False, homogeneous_eigvals=True)
    # |alpha| = |beta| is the circle; comparing them so needs no division by a beta that may vanish.
    close = np.abs(np.abs(alpha) - np.abs(beta)) <= tolerance * np.maximum(np.abs(alpha), np.abs(beta))
    return np.sort(np.abs(np.angle(alpha[close] * np.conj(beta[close]))))
