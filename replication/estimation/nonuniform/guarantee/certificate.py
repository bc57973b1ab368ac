"""Proof that storage matrices guarantee a level for every period of every cell, whatever solver they came from.

The inequality of `path_lyapunov` is concave in [Phi(h), Gamma(h)] and h, so it holds on a piece of a cell if it holds
at the vertices of a hull of that piece. Pieces that ask for more than the target are halved: the hull then hugs the
curve. Remainder of the hull and rounding are allowed for by a bound that is subtracted from the inequality.

On a piece [a, a + d] the exponential is a Taylor polynomial in h, which lies in the hull of its Bernstein coefficients,
plus a remainder of norm at most ||N||^{p+1} d^{p+1} e^{||N|| d} / (p + 1)! ||e^{Na}||.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import comb, factorial

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.nonuniform.guarantee.context_tree import ContextTree
from replication.estimation.nonuniform.guarantee.path_lyapunov import Cells, ErrorSystem
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array

DEGREE = 5
"""Of the Taylor polynomial of a hull."""
UNPROVED = 1e9
"""Squared levels from here on, in units of the common one, count as no level."""
PIECES = 4
"""Pieces of a cell at the start, or more: on none of them does the norm of [[A, B], [0, 0]] times its length exceed
one."""
MAX_PIECES = 4096
HALVINGS = 14
MAX_HALVED = 64
"""If more pieces than this, and than four times those at the start, ask for more than the target, the storage matrices
are at fault, not the hulls."""


@dataclass(frozen=True)
class Certificate:
    """level: proved for every sequence, inf if P proves none.

    needs, periods: for each transition of the tree the squared level that it asks for, in units of the common one, and
    where.
    """

    level: float
    needs: Array
    periods: Array


def certify(system: ErrorSystem, cells: Cells, tree: ContextTree, P: Array, target: float) -> Certificate:
    """The level that P (leaves, N, N) proves; pieces are halved until it is at most `target`, or HALVINGS times."""
    steps = np.array(tree.transitions())
    needs, periods = np.zeros(len(steps)), np.zeros(len(steps))
    for letter, ends in enumerate(pairwise(cells.edges)):
        chosen = steps[:, 1] == letter
        pairs = P[steps[chosen, 0]], P[steps[chosen, 2]]
        needs[chosen], periods[chosen] = cell_needs(system, *pairs, ends, (target / system.level) ** 2)
    worst = float(np.max(needs))
    # Above UNPROVED the need is only a measure of how far P is from proving anything.
    proved = np.linalg.eigvalsh(P).min() > 0 and worst < UNPROVED
    return Certificate(system.level * float(np.sqrt(worst * (1 + 1e-9))) if proved else float("inf"), needs, periods)


def cell_needs(
    system: ErrorSystem, P: Array, P_next: Array, ends: tuple[float, float], target: float
) -> tuple[Array, Array]:
    """For each transition the largest squared level that a piece of the cell asks for, and the period where."""
    edges = np.linspace(*ends, _pieces(system, ends) + 1)
    most = max(MAX_HALVED, 4 * (len(edges) - 1))
    start, stop = edges[:-1], edges[1:]
    done, where = np.full(len(P), -np.inf), np.full(len(P), ends[0])
    for halving in range(HALVINGS + 1):
        hull = enclose(system.plant, start, stop)
        needs = _needed(system, P, P_next, hull)
        halve = (needs.max(axis=(0, 2)) > target) & (halving < HALVINGS)
        if np.sum(halve) > most:
            halve[:] = False
        if not np.all(halve):
            kept = needs[:, ~halve].reshape(len(P), -1)
            place = np.argmax(kept, axis=1)
            top = kept[np.arange(len(P)), place]
            where = np.where(top > done, hull.periods[~halve].ravel()[place], where)
            done = np.maximum(done, top)
        if not np.any(halve):
            return done, where
        middle = (start[halve] + stop[halve]) / 2
        start, stop = np.concatenate([start[halve], middle]), np.concatenate([middle, stop[halve]])
    return done, where


def _pieces(system: ErrorSystem, ends: tuple[float, float]) -> int:
    """Pieces of the cell at the start; raises InvalidInputError if they would be too many."""
    wanted = float(np.linalg.norm(system.plant.generator(), 2)) * (ends[1] - ends[0])
    if wanted > MAX_PIECES:
        raise InvalidInputError(
            f"periods from {ends[0]:.6g} to {ends[1]:.6g} s are {wanted:.3g} times the fastest time constant apart, "
            f"more than {MAX_PIECES}: narrow the range, or cut it"
        )
    return max(PIECES, int(np.ceil(wanted)))


def _needed(system: ErrorSystem, P: Array, P_next: Array, hull: Enclosure) -> Array:
    """The squared level that each vertex of each piece asks for in each transition, (transitions, K, DEGREE + 1)."""
    shape = (len(P), *hull.periods.shape)
    steps = system.steps(hull.vertices.reshape(-1, *hull.vertices.shape[2:]))
    weights = system.weights(hull.periods.ravel())
    output = system.output
    size = output.shape[1]
    missed = np.repeat(_missed(system, hull), shape[2])
    needs = []
    for current, following in zip(P, P_next, strict=True):
        allowance = _allowance(system, steps, following, missed)
        if not np.all(np.isfinite(allowance)):
            return np.full(shape, np.inf)
        gram = np.swapaxes(steps, 1, 2) @ following @ steps
        left = current - gram[:, :size, :size] - weights[:, None, None] * (output.T @ output)
        left -= allowance[:, None, None] * np.eye(size)
        smallest = np.linalg.eigvalsh(left)[:, 0]
        good = smallest > 0
        need = UNPROVED * (1 - smallest)
        cross = gram[good, :size, size:]
        inner = gram[good, size:, size:] + np.swapaxes(cross, 1, 2) @ np.linalg.solve(left[good], cross)
        need[good] = (np.linalg.eigvalsh(inner)[:, -1] + allowance[good]) / weights[good]
        needs.append(need)
    return np.array(needs).reshape(shape)


def _missed(system: ErrorSystem, hull: Enclosure) -> Array:
    """Bound (K,) of what the hulls miss of the steps: in the plant's coordinates or in those of T, whichever is less.

    With T = [T_1, T_2] and T_1 = Q S, what is missed of x is measured in the coordinates S x, and Q changes no norm.
    """
    n, entry = system.plant.order, system.entry
    plain = hull.remainder() * np.linalg.norm(system.T, 2) * np.linalg.norm(entry, 2)
    frame = np.eye(len(hull.generator))
    frame[:n, :n] = np.linalg.qr(system.T[:, :n], mode="r")
    return np.asarray(np.minimum(plain, hull.remainder(frame) * np.linalg.norm(frame @ entry, 2)))


def _allowance(system: ErrorSystem, steps: Array, P: Array, missed: Array) -> Array:
    """Bound of the norm of what the remainder of the hull and rounding can add to M'PM, of shape (V,)."""
    step, storage = np.linalg.norm(steps, axis=(1, 2)), float(np.linalg.norm(P, 2))
    return np.asarray(storage * (2 * step * missed + missed**2) + system.rounding(step, storage))


@dataclass(frozen=True)
class Enclosure:
    """K hulls. vertices (K, DEGREE + 1, n + m, n + m): transition matrices; periods (K, DEGREE + 1): the h of each
    vertex; bases (K, n + m, n + m): the transition matrices at the starts; width (K,), in seconds; generator: N."""

    vertices: Array
    periods: Array
    bases: Array
    width: Array
    generator: Array

    def remainder(self, frame: Array | None = None) -> Array:
        """Bound (K,) of the 2-norm of what each hull misses, infinite if it overflows.

        frame S (n + m, n + m): the bound is that of S R S^-1 for what is missed, R; it is small in coordinates in which
        S N S^-1 is.
        """
        N, bases = self.generator, self.bases
        if frame is not None:
            inverse = np.linalg.inv(frame)
            N, bases = frame @ N @ inverse, frame @ bases @ inverse
        size = np.linalg.norm(N, 2) * np.abs(self.width)
        with np.errstate(over="ignore"):
            tail = size ** (DEGREE + 1) / factorial(DEGREE + 1) * np.exp(size)
        return np.asarray(tail * np.linalg.norm(bases, 2, axis=(1, 2)))


def enclose(plant: SampledPlant, start: Array, stop: Array) -> Enclosure:
    """Hulls of exp(h [[A, B], [0, 0]]) over start[i] <= h <= stop[i] (seconds), i = 1 ... K, of degree DEGREE."""
    N = plant.generator()
    width = stop - start
    powers = [np.linalg.matrix_power(N, k) / factorial(k) for k in range(DEGREE + 1)]
    # Bernstein coefficient i of sum_k c_k t^k on [0, 1] is sum_{k <= i} C(i, k) / C(p, k) c_k.
    shares = np.array([[comb(i, k) / comb(DEGREE, k) for k in range(DEGREE + 1)] for i in range(DEGREE + 1)])
    scaled = width[:, None] ** np.arange(DEGREE + 1)
    bases = plant.transitions(start)
    vertices = np.einsum("ik,ck,kab,cbd->ciad", shares, scaled, np.array(powers), bases, optimize=True)
    periods = start[:, None] + width[:, None] * np.arange(DEGREE + 1) / DEGREE
    return Enclosure(vertices, periods, bases, width, N)
