"""The guaranteed level of a given filter: common Lyapunov function, then one that knows more and more coming
periods.

The inequality of `path_lyapunov` is concave in [Phi(h), Gamma(h)] and h, so it holds on a piece of a cell if it holds
at the vertices of a hull of that piece. Pieces that ask for more than the target are halved: the hull then hugs the
curve. Remainder of the hull and rounding are allowed for by a bound that is subtracted from the inequality.

On a piece [a, a + d] the exponential is a Taylor polynomial in h, which lies in the hull of its Bernstein coefficients,
plus a remainder of norm at most ||N||^{p+1} d^{p+1} e^{||N|| d} / (p + 1)! ||e^{Na}||.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import comb, factorial

import numpy as np

from replication.errors import InvalidInputError, SolverError
from replication.estimation.conic.program import ALMOST, SolverReport
from replication.estimation.nonuniform.filters import Estimator, error_system, gramian, periodic_gain
from replication.estimation.nonuniform.path_lyapunov import (
    ROUGH,
    ContextTree,
    ErrorSystem,
    Samples,
    Storage,
    solve,
)
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, balancing, weights_of
from replication.estimation.validation import Array, positive_integer, positive_scalar

DEGREE = 5
"""Of the Taylor polynomial of a hull."""
UNPROVED = 1e9
"""Squared levels from here on, in units of the common one, count as no level."""
PIECES = 4
"""Pieces of a cell at the start, or more: on none of them does the norm of [[A, B], [0, 0]] times its length exceed
one."""
MAX_PIECES = 4096
TOGETHER = 4096
"""Vertices of transitions that are looked at together, whose matrices then stay in the cache of the processor."""
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


def certify(system: ErrorSystem, edges: tuple[float, ...], tree: ContextTree, P: Array, target: float) -> Certificate:
    """The level that P (leaves, N, N) proves; pieces are halved until it is at most `target`, or HALVINGS times."""
    steps = np.array(tree.transitions())
    needs, periods = np.zeros(len(steps)), np.zeros(len(steps))
    for letter, ends in enumerate(pairwise(edges)):
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
    largest, where = np.full(len(P), -np.inf), np.full(len(P), ends[0])
    for halving in range(HALVINGS + 1):
        hull = enclose(system.plant, start, stop)
        needs = _needed(system, P, P_next, hull)
        halve = (needs.max(axis=(0, 2)) > target) & (halving < HALVINGS)
        if np.sum(halve) > most:
            halve[:] = False
        if not np.all(halve):
            leaves = needs[:, ~halve].reshape(len(P), -1)
            place = np.argmax(leaves, axis=1)
            top = leaves[np.arange(len(P)), place]
            where = np.where(top > largest, hull.periods[~halve].ravel()[place], where)
            largest = np.maximum(largest, top)
        if not np.any(halve):
            return largest, where
        middle = (start[halve] + stop[halve]) / 2
        start, stop = np.concatenate([start[halve], middle]), np.concatenate([middle, stop[halve]])
    return largest, where


def _pieces(system: ErrorSystem, ends: tuple[float, float]) -> int:
    """Pieces of the cell at the start; raises InvalidInputError if they would be too many."""
    ratio = float(np.linalg.norm(system.plant.generator(), 2)) * (ends[1] - ends[0])
    if ratio > MAX_PIECES:
        raise InvalidInputError(
            f"periods from {ends[0]:.6g} to {ends[1]:.6g} s are {ratio:.3g} times the fastest time constant apart, "
            f"more than {MAX_PIECES}: narrow the range, or cut it"
        )
    return max(PIECES, int(np.ceil(ratio)))


def _needed(system: ErrorSystem, P: Array, P_next: Array, hull: Enclosure) -> Array:
    """The squared level that each vertex of each piece asks for in each transition, (transitions, K, DEGREE + 1)."""
    steps = system.steps(hull.vertices.reshape(-1, *hull.vertices.shape[2:]))
    missed = np.repeat(_missed(system, hull), hull.periods.shape[1])
    step, storage = np.linalg.norm(steps, axis=(1, 2)), np.linalg.norm(P_next, 2, axis=(1, 2))[:, None]
    # Bound of the norm of what the remainder of the hull and rounding can add to M'PM.
    allowances = storage * (2 * step * missed + missed**2) + system.rounding(step, storage)
    if not np.all(np.isfinite(allowances)):
        return np.full((len(P), *hull.periods.shape), np.inf)
    weights, output = weights_of(system.plant, hull.periods.ravel()), system.output
    size = output.shape[1]
    needs, together = [], max(1, TOGETHER // len(steps))
    for first in range(0, len(P), together):
        some = slice(first, first + together)
        allowance = allowances[some]
        gram = np.swapaxes(steps, 1, 2) @ P_next[some, None] @ steps
        left = P[some, None] - gram[..., :size, :size] - weights[:, None, None] * (output.T @ output)
        left -= allowance[..., None, None] * np.eye(size)
        smallest = np.linalg.eigvalsh(left)[..., 0]
        good = smallest > 0
        need = UNPROVED * (1 - smallest)
        cross, inner = gram[good, :size, size:], gram[good, size:, size:]
        inner = inner + np.swapaxes(cross, 1, 2) @ np.linalg.solve(left[good], cross)
        weight = np.broadcast_to(weights, good.shape)[good]
        need[good] = (np.linalg.eigvalsh(inner)[:, -1] + allowance[good]) / weight
        needs.append(need)
    return np.concatenate(needs).reshape(len(P), *hull.periods.shape)


def _missed(system: ErrorSystem, hull: Enclosure) -> Array:
    """Bound (K,) of what the hulls miss of the steps: in the plant's coordinates or in those of T, whichever is less.

    With T = [T_1, T_2] and T_1 = Q S, what is missed of x is measured in the coordinates S x, and Q changes no norm.
    """
    n, entry = system.plant.order, system.entry
    plain = hull.remainder() * np.linalg.norm(system.T, 2) * np.linalg.norm(entry, 2)
    frame = np.eye(len(hull.generator))
    frame[:n, :n] = np.linalg.qr(system.T[:, :n], mode="r")
    return np.asarray(np.minimum(plain, hull.remainder(frame) * np.linalg.norm(frame @ entry, 2)))


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


GROWTH = 0.1
"""Share of the leaves, those with the largest energy flux, that know one period more in the next round."""
LOOSE = 1e-3
"""Relative distance of the certified level from that of the samples above which samples are added."""
REGULAR = 1e-6
"""Added to the Gramian of the error in the units of each state, for states that w hardly reaches."""
ROUNDS = 3
"""Times that the common Lyapunov function is solved for, each time in the coordinates of the last."""
ROUNDINGS = (0.0, 8.0)
"""Excess over rounding that the solver is asked for: none, and where that proves nothing, some, which costs level."""
EXCHANGES = 3
"""Times that the last tree is solved again with more samples."""


@dataclass(frozen=True, eq=False)
class Guarantee:
    """A level that no sampling sequence in [h_l, h_u] exceeds, with what proves it.

    storage (leaves, N, N): s'P s of the states s of the error by the leaf that begins the coming periods; of a filter
    that takes time stamps for each of its gains. edges: of the cells, s; before: for each leaf and cell the leaf before
    it; report: what the solver said.
    """

    level: float
    storage: Array
    edges: tuple[float, ...]
    before: Sequence[Sequence[int]]
    report: SolverReport

    @property
    def leaves(self) -> int:
        """How many Lyapunov matrices prove it."""
        return len(self.storage)


def guaranteed_level(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    max_leaves: int = 128,
    cuts: Sequence[float] | None = None,
) -> Guarantee:
    """Upper bound of the gain ||e|| / ||w|| over every sequence of periods in the range, continuum included.

    cuts: inner edges of the cells (seconds), by default the middle of the range; max_leaves: 1 gives the common
    Lyapunov function. Raises InvalidInputError if the cuts do not increase inside the range or the filter does not fit,
    InfeasibleError if A_f is not Schur stable (the gain is then infinite), SolverError if no certificate is found.
    """
    limit = positive_integer("max_leaves", max_leaves)
    edges = _edges(periods, cuts)
    filter_.require_settling(plant)
    natural = _natural(plant, filter_, periods.middle)
    best, system = _common(natural, periods)
    # With one cell there is nothing to tell apart.
    if len(edges) == 2 or limit < len(edges) - 1:
        return best
    samples, tree = Samples(edges), ContextTree.one_step(len(edges) - 1)
    exchanges = 0
    while True:
        previous = samples
        try:
            solution, samples, proof = _solve_until_proved(system, samples, tree, exchanges)
        except SolverError:
            break  # what was proved so far stands: a certificate does not depend on the next one
        if proof.level < best.level:
            best = proof
        count = max(1, int(GROWTH * len(tree.leaves)))
        longer = tree.split([tree.leaves[i] for i in np.argsort(-solution.flux, kind="stable")[:count]])
        if len(longer.leaves) <= limit:
            tree = longer
        elif exchanges == 0 and samples is not previous:
            # Samples that were found missing are kept, so that only the last tree is solved more than once.
            exchanges = EXCHANGES
        else:
            break
    return best


def _edges(periods: PeriodRange, cuts: Sequence[float] | None) -> tuple[float, ...]:
    """The ends of the range with the inner edges of its cells between them."""
    if cuts is None:
        cuts = (periods.middle,) if periods.h_l < periods.h_u else ()
    edges = (periods.h_l, *(positive_scalar("an entry of `cuts`", cut, unit="s") for cut in cuts), periods.h_u)
    if len(edges) > 2 and not all(a < b for a, b in pairwise(edges)):
        raise InvalidInputError(
            f"`cuts` must increase strictly inside ({periods.h_l:.6g}, {periods.h_u:.6g}) s, got {tuple(cuts)}"
        )
    return edges


def _common(natural: ErrorSystem, periods: PeriodRange) -> tuple[Guarantee, ErrorSystem]:
    """The common Lyapunov function, and the error system in coordinates and units in which it is about the identity."""
    tree = ContextTree.one_step(1)
    for roundings in ROUNDINGS:
        system, samples, best = replace(natural, roundings=roundings), Samples((periods.h_l, periods.h_u)), None
        # Each solution gives the coordinates of the next, which is more accurate where the plant's are badly scaled.
        # A solver that ends early has then done enough, and what is proved does not depend on its word.
        for _ in range(ROUNDS):
            solution, samples, proof = _solve_until_proved(system, samples, tree, accept=ROUGH)
            level = system.level * float(np.sqrt(solution.delta))
            if np.isfinite(proof.level):
                best = proof, system
            if solution.delta <= 0 or np.linalg.eigvalsh(solution.P[0])[0] <= 0:
                break
            root = np.linalg.cholesky(solution.P[0]).T
            system = replace(system, T=root @ system.T / np.sqrt(solution.delta), level=level)
        if best is not None:
            return best
    raise SolverError(
        f"no common Lyapunov function was certified: the one found keeps the level {level:.6g} at "
        f"{len(samples.of(0, (0,)))} periods, not for certain at all others; narrow the range of sampling periods"
    )


def _natural(plant: SampledPlant, filter_: Estimator, h: float) -> ErrorSystem:
    """The error system with its Gramian at period h about the identity, e in units of its own gain there."""
    balanced = balancing(plant)
    plant, filter_ = plant.in_coordinates(balanced), filter_.in_coordinates(balanced)
    (stage,) = error_system(plant, filter_, [h]).stages
    reached = gramian(stage.A, stage.B)
    # Each state in its own unit first, so that the small number added means the same to all of them.
    size = np.sqrt(np.diag(reached))
    units = np.where(size > 0, size, np.max(size))
    scaled = reached / np.outer(units, units) + REGULAR * np.eye(len(units))
    # The filter's states are measured so too, since the certificate pays for the condition of T.
    filter_units = np.exp2(np.round(np.log2(units[plant.order :])))
    filter_ = filter_.in_units(filter_units)
    T = np.linalg.inv(np.linalg.cholesky(scaled)) / units
    T[:, plant.order :] *= filter_units
    level = periodic_gain(plant, filter_, [h]).upper
    original = np.concatenate([1 / np.diag(balanced), filter_units])
    return ErrorSystem(plant, filter_, T, level if level > 0 else 1.0, original)


def _solve_until_proved(
    system: ErrorSystem,
    samples: Samples,
    tree: ContextTree,
    exchanges: int = EXCHANGES,
    accept: tuple[str, ...] = ALMOST,
) -> tuple[Storage, Samples, Guarantee]:
    """Solve, certify, and add to each transition that asks for too much the period where, until the certificate is as
    good as the samples, or `exchanges` times; the guarantee is infinite if nothing is proved."""
    for attempt in range(exchanges + 1):
        solution = solve(system, samples, tree, accept=accept)
        target = system.level * float(np.sqrt(solution.delta)) * (1 + LOOSE)
        proof = certify(system, samples.edges, tree, solution.P, target)
        missed = {}
        for (_, letter, following), need, h in zip(tree.transitions(), proof.needs, proof.periods, strict=True):
            word = tree.leaves[following]
            if system.level * np.sqrt(need) > target and h not in samples.of(letter, word):
                missed[letter, word] = float(h)
        samples = samples.with_added(missed) if missed else samples
        if proof.level <= target or not missed or attempt == exchanges:
            break
    return (
        solution,
        samples,
        Guarantee(proof.level, system.storage(solution.P), samples.edges, tree.before(), solution.report),
    )
