"""The worst gain over all walks of an automaton, from above: a storage function e'P e for each node.

If for every edge s -> t, with e+ = A e + B v and z = W e, the matrix diag(P_s - W'W, level^2 I) - [A B]' P_t [A B] is
positive semidefinite, no pattern has a gain above the level. With more and more of the past told apart by the nodes the
least such level tends to the gain (Essick, Lee and Dullerud, IEEE Trans. Autom. Control 59, 2014). A design needs the
inequality only where the samples that came say nothing, and has its gain in closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from replication.errors import SolverError
from replication.estimation.conic.clarabel import ALMOST, solve_clarabel
from replication.estimation.conic.program import Inequalities, program_under, symmetric_basis
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.losses.automaton import Automaton, closed_loop
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

SLACK = 1e-7
"""Of each inequality beyond zero, in units in which state and level are about one."""
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class Storage:
    """squared: of the level, in its unit; P (nodes, n, n); flux: how much each edge's inequality counts."""

    squared: float
    P: Array
    flux: Array


@dataclass(frozen=True, eq=False)
class Walks:
    """An automaton with the error system in units of its own: e(k) = T_k s(k), and levels in multiples of `unit`."""

    problem: MultirateProblem
    automaton: Automaton
    T: Array
    unit: float

    @classmethod
    def of(cls, problem: MultirateProblem, automaton: Automaton, unit: float) -> Walks:
        """In coordinates in which the error of a Kalman filter without losses has covariance one."""
        return cls(problem, automaton, state_scales(problem), unit)

    def weight(self, phase: int) -> Array:
        """W in these units."""
        return np.asarray(self.problem.plant.W @ self.T[phase] / self.unit)

    def moved(self, edge: int, gain: Array) -> Array:
        """[A B] of an edge with a gain (n, q), in these units; B turned so that it has no more columns than rows."""
        A, B = closed_loop(self.problem, gain)
        if B.shape[1] > len(B):
            B = np.asarray(np.linalg.qr(B.T, mode="r")).T
        return self._scaled(edge, A, B)

    def open_loop(self, edge: int) -> tuple[Array, Array]:
        """[A B] without a correction, and [C D] of the samples that come."""
        plant, phase = self.problem.plant, self.automaton.edges[edge].phase
        B_w = plant.B_w if plant.correlated else np.zeros((plant.order, plant.D.shape[1]))
        rows = list(self.automaton.edges[edge].arrived)
        seen = np.hstack([plant.C[rows] @ self.T[phase], np.zeros((sum(rows), plant.B_d.shape[1])), plant.D[rows]])
        return self._scaled(edge, plant.A, np.hstack([plant.B_d, B_w])), seen

    def storage(self, P: Array) -> Array:
        """Storage functions (nodes, n, n) of these units in those of the plant."""
        back = self.unit * np.linalg.inv(self.T)[list(self.automaton.phases)]
        return symmetric(back.mT @ P @ back)

    def unscaled(self, edge: int, gain: Array) -> Array:
        """A gain on y in the units of the plant."""
        return np.asarray(self._following(edge) @ gain)

    def _scaled(self, edge: int, A: Array, B: Array) -> Array:
        now = self.T[self.automaton.edges[edge].phase]
        return np.asarray(np.linalg.solve(self._following(edge), np.hstack([A @ now, B])))

    def _following(self, edge: int) -> Array:
        return np.asarray(self.T[(self.automaton.edges[edge].phase + 1) % len(self.T)])


def least_level(walks: Walks, moved: Sequence[Array], kernels: Sequence[Array] | None = None) -> Storage:
    """The storage functions with the least level; kernels: bases of the directions in which an edge must hold.

    Raises SolverError unless the solver ends well; what it gives is not believed before `proved_level`.
    """
    n, edges = walks.problem.plant.order, walks.automaton.edges
    basis = symmetric_basis(n)
    terms = len(basis)
    parts: dict[tuple[int, int], list[int]] = {}
    for i, M in enumerate(moved):
        width = M.shape[1] if kernels is None else kernels[i].shape[1]
        parts.setdefault((M.shape[1], width), []).append(i)
    groups, order = [], []
    for (whole, _), members in parts.items():
        frame = np.eye(n, whole)
        N = np.stack([np.eye(whole) if kernels is None else kernels[i] for i in members])
        M = np.stack([moved[i] for i in members]) @ N
        F = frame @ N
        W = np.stack([walks.weight(edges[i].phase) for i in members])
        bound = np.diag([0.0] * n + [1.0] * (whole - n))
        constant = -(F.mT @ W.mT @ W @ F) - SLACK * np.eye(N.shape[2])
        stored = np.einsum("kax,lab,kby->klxy", F, basis, F)
        after = np.einsum("kax,lab,kby->klxy", M, basis, M)
        supplied = (N.mT @ bound @ N)[:, None]
        columns = [_columns(edges[i].source, edges[i].target, terms) for i in members]
        # Of an edge from a node to itself the unknowns stand twice, which counts as their sum.
        entries = np.concatenate([supplied, stored, -after], axis=1)
        groups.append(Inequalities(symmetric(constant), entries, np.array(columns)))
        order += members
    if kernels is not None:
        # Where samples tell of everything the inequality is empty, and the storage must exceed W'W all the same.
        nodes = range(len(walks.automaton.phases))
        W = np.stack([walks.weight(walks.automaton.phases[i]) for i in nodes])
        each = np.broadcast_to(basis, (len(W), *basis.shape))
        variables = np.array([range(1 + i * terms, 1 + (i + 1) * terms) for i in nodes])
        groups.append(Inequalities(-(W.mT @ W) - SLACK * np.eye(n), np.array(each), variables))
    cost = np.zeros(1 + terms * len(walks.automaton.phases))
    cost[0] = 1.0
    solution = solve_clarabel(program_under(cost, *groups), accept=ALMOST)
    x = solution.multipliers
    flux = np.zeros(len(edges))
    flux[order] = [float(np.trace(block)) for block in solution.blocks[: len(order)]]
    return Storage(float(x[0]), np.einsum("cl,lab->cab", x[1:].reshape(-1, terms), basis), flux)


def _columns(source: int, target: int, terms: int) -> list[int]:
    return [
        0,
        *range(1 + source * terms, 1 + (source + 1) * terms),
        *range(1 + target * terms, 1 + (target + 1) * terms),
    ]


def proved_level(walks: Walks, moved: Sequence[Array], P: Array) -> float:
    """The least level that the storage functions prove, by their eigenvalues alone; infinite if they prove none."""
    n, worst = walks.problem.plant.order, 0.0
    if np.linalg.eigvalsh(P)[:, 0].min() <= 0:
        return np.inf
    for edge, M in zip(walks.automaton.edges, moved, strict=True):
        before, after, W = P[edge.source], P[edge.target], walks.weight(edge.phase)
        A, B = M[:, :n], M[:, n:]
        left = symmetric(before - W.T @ W - A.T @ after @ A)
        rounding = ROUNDING * n * (np.linalg.norm(before) + np.linalg.norm(after) * np.linalg.norm(A) ** 2 + 1)
        values, vectors = np.linalg.eigh(left)
        if values[0] <= rounding:
            return np.inf
        # What rounding may have added to `left` is taken off it again.
        coupling = (vectors.T @ A.T @ after @ B) / np.sqrt(values - rounding)[:, None]
        need = B.T @ after @ B + coupling.T @ coupling
        worst = max(worst, float(np.linalg.eigvalsh(symmetric(need))[-1]) * (1 + ROUNDING * n))
    return float(walks.unit * np.sqrt(worst))


def central_gains(walks: Walks, storage: Storage, squared: float) -> Array:
    """The gains (edges, n, q) that keep the inequality at a `squared` level with the given storage functions.

    With Q = diag(P_s - W'W, level^2 I) the error after the correction is [A B] on the directions that the samples do
    not tell of, and zero on those Q-orthogonal to them: L = [A B] Q^-1 F'(F Q^-1 F')^-1, F = [C D].
    """
    n, q = walks.problem.plant.order, walks.problem.plant.sensors
    gains = np.zeros((len(walks.automaton.edges), n, q))
    for i, edge in enumerate(walks.automaton.edges):
        M, F = walks.open_loop(i)
        if not len(F):
            continue
        W = walks.weight(edge.phase)
        inverse = np.diag([0.0] * n + [1 / squared] * (M.shape[1] - n))
        inverse[:n, :n] = np.linalg.inv(storage.P[edge.source] - W.T @ W)
        gain = np.asarray(np.linalg.solve(F @ inverse @ F.T, F @ inverse @ M.T)).T
        gains[i][:, list(edge.arrived)] = walks.unscaled(i, gain)
    if not np.all(np.isfinite(gains)):
        raise SolverError("the gains under losses were lost in rounding; change the units of the states or the noise")
    return gains


def kernel(seen: Array, width: int) -> Array:
    """An orthonormal basis (width, r) of the directions that [C D] does not see."""
    if not len(seen):
        return np.eye(width)
    return np.asarray(np.linalg.qr(seen.T, mode="complete")[0][:, len(seen) :])
