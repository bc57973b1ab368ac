"""Upper bound of the gain over every sampling sequence: a Lyapunov function that remembers recent periods.

V_k = x' P_c x with c the leaf of a context tree that ends h_0 ... h_{k-1}. If for every leaf c, every cell, every h
of the
cell, and the leaf d that follows,  w(h)|e|^2 + x+' P_d x+ <= x' P_c x + w(h) g^2 |w|^2,  then ||e|| <= g ||w|| for
every
sequence in [h_l, h_u] (w(h) = 1, or h for the duration-weighted gain). Sources: Lee and Dullerud, Automatica 42 (2006);
Ahmadi, Jungers, Parrilo and Roozbehani, SIAM J. Control Optim. 52 (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from replication.estimation.nonuniform.context_tree import ContextTree
from replication.estimation.nonuniform.filters import Filter, error_output
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.nonuniform.sdp import ALMOST, Inequalities, minimise, symmetric_basis
from replication.estimation.solvers import SolverReport
from replication.estimation.validation import Array

SLACK = 1e-6
"""Excess in the state block of the inequalities that the solver is asked for, in balanced coordinates (P near I)."""


@dataclass(frozen=True)
class ErrorSystem:
    """The error system (5) with state T [x; x^] and e / level, as a function of stacks of transition matrices.

    units (n + nf,): x and x^ here are those of the plant and filter that were asked about, divided by these.
    """

    plant: SampledPlant
    filter: Filter
    T: Array
    level: float
    per_duration: bool
    units: Array

    @property
    def output(self) -> Array:
        """C-bar (s, n + nf) in these coordinates."""
        return np.asarray(error_output(self.plant, self.filter) @ np.linalg.inv(self.T) / self.level)

    def steps(self, transitions: Array) -> Array:
        """[A-bar, B-bar] for a stack (V, n + m, n + m), of shape (V, n + nf, n + nf + m)."""
        n, nf, m = self.plant.order, len(self.filter.A), self.plant.B.shape[1]
        steps = np.zeros((len(transitions), n + nf, n + nf + m))
        steps[:, :n, :n] = transitions[:, :n, :n]
        steps[:, :n, n + nf :] = transitions[:, :n, n:]
        steps[:, n:, :n] = self.filter.B @ self.plant.C
        steps[:, n:, n : n + nf] = self.filter.A
        steps[:, n:, n + nf :] = self.filter.B @ self.plant.D
        steps[:, :, : n + nf] = steps[:, :, : n + nf] @ np.linalg.inv(self.T)
        return self.T @ steps

    def storage(self, P: Array) -> Array:
        """The storage matrices P (leaves, N, N) for the error e and the states that were asked about."""
        whole = self.T / self.units
        return np.asarray(self.level**2 * whole.T @ P @ whole)

    def weights(self, periods: Array) -> Array:
        """w(h) of the squared norms."""
        return periods if self.per_duration else np.ones_like(periods)


@dataclass(frozen=True)
class Cells:
    """The range of periods cut at `edges` (increasing, seconds): letter a is the cell from edges[a] to edges[a + 1].

    samples: the periods of each cell that the solver sees.
    """

    edges: tuple[float, ...]
    samples: tuple[tuple[float, ...], ...]

    @classmethod
    def cut(cls, edges: Sequence[float]) -> Cells:
        """Cells with three samples each: the ends and the middle."""
        pairs = pairwise(edges)
        return cls(tuple(edges), tuple(tuple(sorted({a, (a + b) / 2, b})) for a, b in pairs))

    def __len__(self) -> int:
        return len(self.samples)

    def with_samples(self, new: Sequence[float]) -> Cells:
        """The same cells with one more sample in each, where it is not there yet."""
        pairs = zip(self.samples, new, strict=True)
        return replace(self, samples=tuple(tuple(sorted({*old, h})) for old, h in pairs))


@dataclass(frozen=True)
class PathSolution:
    """delta: squared level of the samples; P: stack (leaves, N, N); flux: stored energy through each leaf at the
    optimum."""

    delta: float
    P: Array
    flux: Array
    report: SolverReport


def solve(system: ErrorSystem, cells: Cells, tree: ContextTree) -> PathSolution:
    """Minimise the squared level over P at the samples of the cells, with SLACK; not yet a bound (see
    `certificate.certify`)."""
    output, inputs = system.output, system.plant.B.shape[1]
    size = output.shape[1]
    basis = symmetric_basis(size)
    terms = len(basis)
    frame = np.eye(size, size + inputs)
    stored = np.einsum("ax,lab,by->lxy", frame, basis, frame)
    supplied = np.diag(np.concatenate([np.zeros(size), np.ones(inputs)]))
    demanded = frame.T @ output.T @ output @ frame, SLACK * (frame.T @ frame)
    constants, coefficients, variables = [], [], []
    moved = [_moved(system, np.array(cells.samples[a]), basis) for a in range(len(cells))]
    for leaf, letter, following in tree.transitions():
        columns = [0, *range(1 + leaf * terms, 1 + (leaf + 1) * terms)]
        columns += range(1 + following * terms, 1 + (following + 1) * terms)
        for weight, image in zip(system.weights(np.array(cells.samples[letter])), moved[letter], strict=True):
            constants.append(-weight * (demanded[0] + demanded[1]))
            coefficients.append(np.concatenate([weight * supplied[None], stored, -image]))
            variables.append(columns)
    group = Inequalities(np.array(constants), np.array(coefficients), np.array(variables))
    cost = np.zeros(1 + terms * len(tree.leaves))
    cost[0] = 1.0
    solution = minimise(cost, (group,), accept=ALMOST)
    P = np.einsum("cl,lab->cab", solution.x[1:].reshape(-1, terms), basis)
    flux = np.zeros(len(tree.leaves))
    sources = [leaf for leaf, letter, _ in tree.transitions() for _ in cells.samples[letter]]
    np.add.at(flux, sources, np.einsum("eab,eab->e", P[sources], solution.duals[0][:, :size, :size]))
    return PathSolution(float(solution.x[0]), P, flux, solution.report)


def _moved(system: ErrorSystem, periods: Array, basis: Array) -> Array:
    """M(h)' E_l M(h) for each period and basis matrix."""
    steps = system.steps(system.plant.transitions(periods))
    return np.asarray(np.einsum("vax,lab,vby->vlxy", steps, basis, steps, optimize=True))
