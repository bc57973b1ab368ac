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
    """The symmetric part of a square matrix: removes the rounding that products leave."""
    return np.asarray((matrix + matrix.T) / 2)


def apply(stage: RiccatiMap, X: Array) -> Array:
    """One step of the recursion from X (n, n)."""
    identity = np.eye(len(X))
    return symmetric(stage.A @ np.linalg.solve(identity + X @ stage.G, X) @ stage.A.T + stage.H)


def compose(first: RiccatiMap, second: RiccatiMap) -> RiccatiMap:
    """The map that applies `first` and then `second`."""
    size = len(first.A)
    inner = np.eye(size) + first.H @ second.G
    solved = np.linalg.solve(inner, np.hstack([first.A, first.H @ second.A.T]))
    dual = np.linalg.solve(inner.T, second.G @ first.A)
    return RiccatiMap(
        second.A @ solved[:, :size],
        symmetric(first.G + first.A.T @ dual),
        symmetric(second.H + second.A @ solved[:, size:]),
    )


def period_map(stages: Sequence[RiccatiMap]) -> RiccatiMap:
    """The map over all stages in order."""
    total = stages[0]
    for stage in stages[1:]:
        total = compose(total, stage)
    return total


def fixed_point(stages: Sequence[RiccatiMap]) -> Array | None:
    """The limit of the periodic recursion from X = 0 at phase 0, or None if it does not settle.

    Structured doubling of the period map; the limit is the stabilising solution where one exists. None is an answer,
    not a failure: below the achievable level the recursion has no limit.
    """
    total = period_map(stages)
    previous = np.inf
    for _ in range(MAX_DOUBLINGS):
        try:
            doubled = compose(total, total)
        except np.linalg.LinAlgError:
            return None
        size = float(np.linalg.norm(doubled.H))
        if not np.isfinite(size):
            return None
        step = float(np.linalg.norm(doubled.H - total.H)) / max(size, np.finfo(float).tiny)
        total = doubled
        # Quadratic convergence ends in rounding: accept the first step that is tiny, or small and no longer shrinking.
        if step <= STAGNATION or (step <= 1e3 * STAGNATION and step >= previous):
            return total.H
        previous = step
    return None


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
