"""Upper bound of the gain over every sampling sequence: a Lyapunov function that knows the coming periods.

A leaf is a word of letters (cells of the range of periods), the next period first. Whatever the sequence, exactly one
leaf is a prefix of what is to come, and the leaf before a period follows from its letter and the leaf after it.

V_k = x' P_c x with c the leaf of a context tree that begins h_k, h_{k+1}, ... If for every leaf d, every cell, every h
of the cell, and the leaf c of that cell followed by d,  w(h)|e|^2 + x+' P_d x+ <= x' P_c x + w(h) g^2 |w|^2,  then
||e|| <= g ||w|| for every sequence in [h_l, h_u] (w(h) = 1, or h for the duration-weighted gain). The periods to come
need not be known to the filter: V enters the proof only. The worst that can still come, as a function of the state, is
the largest x' P x over all futures, so that the bound tends to the gain. Sources: Lee and Dullerud, Automatica 42
(2006); Ahmadi, Jungers, Parrilo and Roozbehani, SIAM J. Control Optim. 52 (2014).
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy

from replication.estimation.conic.program import (
    ALMOST,
    Inequalities,
    Solution,
    SolverReport,
    program_under,
    solve_clarabel,
    symmetric_basis,
)
from replication.estimation.nonuniform.filters import Estimator
from replication.estimation.nonuniform.plant import SampledPlant, weights_of
from replication.estimation.validation import Array

Word = tuple[int, ...]


@dataclass(frozen=True)
class ContextTree:
    """leaves: sorted words over the letters 0 ... letters - 1, complete (one is a prefix of every long word) and
    closed.

    Closed means that a letter and the leaf after it determine the leaf before it.
    """

    letters: int
    leaves: tuple[Word, ...]

    @classmethod
    def one_step(cls, letters: int) -> ContextTree:
        """The tree that knows the next period's cell only."""
        return cls(letters, tuple((a,) for a in range(letters)))

    def transitions(self) -> list[tuple[int, int, int]]:
        """(position of the leaf before, letter, position of the leaf after) for every letter and leaf after it."""
        position = {leaf: i for i, leaf in enumerate(self.leaves)}
        steps = []
        for leaf, after in position.items():
            for letter in range(self.letters):
                before = _prefix(position, (letter, *leaf))
                assert before is not None
                steps.append((position[before], letter, after))
        return steps

    def before(self) -> list[list[int]]:
        """For each leaf and letter after it the position of the leaf before."""
        positions = [[0] * self.letters for _ in self.leaves]
        for leaf, letter, after in self.transitions():
            positions[after][letter] = leaf
        return positions

    def split(self, chosen: list[Word]) -> ContextTree:
        """The tree in which the chosen leaves know one period more, and others as far as closedness asks for it."""
        leaves = set(self.leaves)
        for leaf in chosen:
            _lengthen(leaves, leaf, self.letters)
        while open_ := [w for w in leaves if any(_prefix(leaves, (a, *w)) is None for a in range(self.letters))]:
            for leaf in open_:
                _lengthen(leaves, leaf, self.letters)
        return ContextTree(self.letters, tuple(sorted(leaves)))


def _lengthen(leaves: set[Word], leaf: Word, letters: int) -> None:
    leaves.remove(leaf)
    leaves.update((*leaf, b) for b in range(letters))


def _prefix(leaves: Container[Word], word: Word) -> Word | None:
    """The leaf that begins `word`, or None if all its beginnings are inner nodes."""
    return next((word[:k] for k in range(1, len(word) + 1) if word[:k] in leaves), None)


SLACK = 1e-6
"""Least excess in the state block of the inequalities that the solver is asked for, in balanced coordinates (P near
I)."""
ROUNDING = 64 * np.finfo(float).eps
"""Relative size of what rounding can do to a product of a few small matrices."""
ROUGH = (*ALMOST, "NumericalError", "InsufficientProgress", "MaxIterations")
"""For a solution that gives coordinates to the next one, or is certified whatever the solver says."""


@dataclass(frozen=True)
class ErrorSystem:
    """The error system (5) with state T [x; x^] and e / level, as a function of stacks of transition matrices.

    units (n + nf,): x and x^ here are those of the plant and filter that were asked about, divided by these.
    roundings: the solver is asked for an excess of so many times what rounding can do where P is I, SLACK at least.
    """

    plant: SampledPlant
    filter: Estimator
    T: Array
    level: float
    units: Array
    roundings: float = 0.0

    @property
    def output(self) -> Array:
        """C-bar (s, n + nf) in these coordinates."""
        return np.asarray(self.filter.error_output(self.plant) @ np.linalg.inv(self.T) / self.level)

    def steps(self, transitions: Array) -> Array:
        """[A-bar, B-bar] for a stack (V, n + m, n + m), of shape (V, n + nf, n + nf + m)."""
        n = self.plant.order
        state, drive = self.filter.error_step(self.plant, transitions[:, :n, :n], transitions[:, :n, n:])
        return np.asarray(self.T @ np.concatenate([state @ np.linalg.inv(self.T), drive], axis=-1))

    @property
    def entry(self) -> Array:
        """What transition matrices are multiplied by from the right in `steps`, (n + m, N + m)."""
        inputs = self.plant.B.shape[1]
        inverse = scipy.linalg.block_diag(np.linalg.inv(self.T), np.eye(inputs))
        return np.asarray(self.filter.entry(self.plant) @ inverse)

    def storage(self, P: Array) -> Array:
        """The storage matrices P (leaves, N, N) for the error e and the states that were asked about."""
        whole = self.T / self.units
        return np.asarray(self.level**2 * whole.T @ P @ whole)

    def rounding(self, step: Array, storage: Array | float) -> Array:
        """What rounding can do to M'PM for steps M of norm `step` and P of norm `storage`."""
        # The change of coordinates T magnifies rounding by its condition.
        size = ROUNDING * max(float(np.linalg.cond(self.T)), 1.0) * len(self.T)
        return np.asarray(size * (storage * (1 + step**2) + 1))


@dataclass(frozen=True)
class Samples:
    """The periods at which the solver sees a letter before a leaf: the ends of the cell, and `added` ones.

    Between the ends the inequality seldom binds; where it does, the certificate finds it missing.

    edges (increasing, s): letter a is the cell from edges[a] to edges[a + 1]. added: periods by (letter, word), for
    every leaf that begins with the word; a longer leaf keeps them.
    """

    edges: tuple[float, ...]
    added: Mapping[tuple[int, Word], tuple[float, ...]] = field(default_factory=dict)

    def of(self, letter: int, leaf: Word) -> list[float]:
        """The sorted periods of a transition."""
        a, b = self.edges[letter : letter + 2]
        words = (leaf[:k] for k in range(1, len(leaf) + 1))
        return sorted({a, b}.union(*(self.added.get((letter, word), ()) for word in words)))

    def with_added(self, new: Mapping[tuple[int, Word], float]) -> Samples:
        """The same with one more period in each of the given transitions."""
        more = {key: (*self.added.get(key, ()), h) for key, h in new.items()}
        return replace(self, added={**self.added, **more})


@dataclass(frozen=True, eq=False)
class Storage:
    """delta: squared level; P: stack (leaves or cells, N, N); report: what the solver said; flux (leaves,): the stored
    energy through each leaf at the optimum, if it was asked for."""

    delta: float
    P: Array
    report: SolverReport
    flux: Array = field(default_factory=lambda: np.zeros(0))


def storage_inequalities(
    basis: Array,
    frame: Array,
    steps: Array,
    supplied: Array,
    demanded: Array,
    edges: Sequence[tuple[int, int, int]],
    weights: Array | None = None,
) -> Inequalities:
    """w_i (delta supplied - demanded) + frame' X_c frame - M_i' X_d M_i >= 0 for all edges (c, d, i) and steps M_i, in
    the unknowns delta and the coordinates of X_0, X_1, ... in `basis`."""
    terms, weights = len(basis), np.ones(len(steps)) if weights is None else weights
    stored = np.einsum("ax,lab,by->lxy", frame, basis, frame)
    moved = np.einsum("vax,lab,vby->vlxy", steps, basis, steps, optimize=True)
    before, after, which = np.array(edges).T
    ids = 1 + np.arange(terms)
    variables = np.column_stack([np.zeros_like(before), before[:, None] * terms + ids, after[:, None] * terms + ids])
    coefficients = [np.concatenate([weights[i] * supplied[None], stored, -moved[i]]) for i in which]
    return Inequalities(-weights[which, None, None] * demanded, np.array(coefficients), variables)


def least_storage(basis: Array, count: int, *groups: Inequalities, **options: Any) -> tuple[Storage, Solution]:
    """The least delta, and `count` matrices P, that meet inequalities in delta and the coordinates of P in `basis`."""
    cost = np.zeros(1 + count * len(basis))
    cost[0] = 1.0
    solution = solve_clarabel(program_under(cost, *groups), **options)
    x = solution.multipliers
    P = np.einsum("cl,lab->cab", x[1:].reshape(count, -1), basis)
    return Storage(float(x[0]), P, solution.report), solution


def solve(system: ErrorSystem, samples: Samples, tree: ContextTree, *, accept: tuple[str, ...] = ALMOST) -> Storage:
    """Minimise the squared level over P at the samples, with SLACK; not yet a bound (see `guarantee.certify`).

    Raises SolverError unless the solver's status is in `accept`.
    """
    output, inputs = system.output, system.plant.B.shape[1]
    size = output.shape[1]
    basis = symmetric_basis(size)
    frame = np.eye(size, size + inputs)
    supplied = np.diag(np.concatenate([np.zeros(size), np.ones(inputs)]))
    triples = [
        (h, leaf, following)
        for leaf, letter, following in tree.transitions()
        for h in samples.of(letter, tree.leaves[following])
    ]
    distinct, which = np.unique([h for h, _, _ in triples], return_inverse=True)
    edges = [(leaf, following, int(i)) for i, (_, leaf, following) in zip(which, triples, strict=True)]
    steps, weights = system.steps(system.plant.transitions(distinct)), weights_of(system.plant, distinct)
    rounding = system.rounding(np.linalg.norm(steps, axis=(1, 2)), 1.0)
    slack = max(SLACK, system.roundings * float(np.max(rounding)))
    demanded = frame.T @ output.T @ output @ frame + slack * (frame.T @ frame)
    group = storage_inequalities(basis, frame, steps, supplied, demanded, edges, weights)
    # What the solution proves is computed anew: steps that are not refined cost a sixth less and prove the same.
    storage, solution = least_storage(basis, len(tree.leaves), group, accept=accept, iterative_refinement_enable=False)
    flux, duals = np.zeros(len(tree.leaves)), np.array(solution.blocks)
    sources = [leaf for leaf, *_ in edges]
    np.add.at(flux, sources, np.einsum("eab,eab->e", storage.P[sources], duals[:, :size, :size]))
    return replace(storage, flux=flux)
