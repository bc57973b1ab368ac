"""The worst gain over all patterns of losses, from both sides, and gains that make it small.

If for every edge s -> t, with e+ = A e + B v and z = W e, the matrix diag(P_s - W'W, level^2 I) - [A B]' P_t [A B] is
positive semidefinite, no pattern has a gain above the level. With more and more of the past told apart by the nodes the
least such level tends to the gain (Essick, Lee and Dullerud, IEEE Trans. Autom. Control 59, 2014). A design needs the
inequality only where the samples that came say nothing, and has its gain in closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import ALMOST, Inequalities, symmetric_basis
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.kalman import filtering, state_scales
from replication.estimation.multirate.losses.models import Automaton, Word, along, patterns
from replication.estimation.multirate.problem import MultirateProblem, closed_loop
from replication.estimation.nonuniform.path_lyapunov import Storage, least_storage, storage_inequalities
from replication.estimation.validation import Array

SLACK = 1e-7
"""Of each inequality beyond zero, in units in which state and level are about one."""
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class Walks:
    """An automaton with the error system in units of its own: e = T_s s at its node s, and levels in multiples of
    `unit`."""

    problem: MultirateProblem
    automaton: Automaton
    unit: float

    @cached_property
    def T(self) -> Array:
        """Coordinates (nodes, n, n) in which the error of a Kalman filter without losses has covariance one."""
        return state_scales(self.problem)[list(self.automaton.phases)]

    @cached_property
    def W(self) -> Array:
        """W in these units, (nodes, n_z, n)."""
        return np.asarray(self.problem.plant.W @ self.T / self.unit)

    def moved(self, edge: int, gain: Array) -> Array:
        """[A B] of an edge with a gain (n, q), in these units; B turned so that it has no more columns than rows."""
        A, B = closed_loop(self.problem.plant, gain)
        if B.shape[1] > len(B):
            B = np.asarray(np.linalg.qr(B.T, mode="r")).T
        return self._scaled(edge, A, B)

    def open_loop(self, edge: int) -> tuple[Array, Array]:
        """[A B] without a correction, and [C D] of the samples that come."""
        plant, ends = self.problem.plant, self.automaton.edges[edge]
        rows = list(ends.arrived)
        F = np.hstack([plant.C[rows] @ self.T[ends.source], np.zeros((sum(rows), plant.B_d.shape[1])), plant.D[rows]])
        return self._scaled(edge, plant.A, np.hstack([plant.B_d, plant.B_w])), F

    def storage(self, P: Array) -> Array:
        """Storage functions (nodes, n, n) of these units in those of the plant."""
        back = self.unit * np.linalg.inv(self.T)
        return symmetric(back.mT @ P @ back)

    def _scaled(self, edge: int, A: Array, B: Array) -> Array:
        ends = self.automaton.edges[edge]
        return np.asarray(np.linalg.solve(self.T[ends.target], np.hstack([A @ self.T[ends.source], B])))


def least_level(walks: Walks, moved: Sequence[Array], kernels: Sequence[Array] | None = None) -> Storage:
    """The storage functions with the least level, and how much the inequality of each edge counts (`flux`).

    kernels: bases of the directions in which an edge must hold. Raises SolverError unless the solver ends well; what it
    gives is not believed before `proved_level`.
    """
    n, edges, nodes = walks.problem.plant.order, walks.automaton.edges, len(walks.automaton.phases)
    basis = symmetric_basis(n)
    groups = []
    for i, (edge, M) in enumerate(zip(edges, moved, strict=True)):
        N = np.eye(M.shape[1]) if kernels is None else kernels[i]
        weighted = walks.W[edge.source] @ N[:n]
        demanded = symmetric(weighted.T @ weighted) + SLACK * np.eye(N.shape[1])
        ends = [(edge.source, edge.target, 0)]
        groups.append(storage_inequalities(basis, N[:n], (M @ N)[None], N[n:].T @ N[n:], demanded, ends))
    if kernels is not None:
        # Where samples tell of everything the inequality is empty, and the storage must exceed W'W all the same.
        each, unknowns = np.broadcast_to(basis, (nodes, *basis.shape)), 1 + np.arange(nodes * len(basis))
        demanded = walks.W.mT @ walks.W + SLACK * np.eye(n)
        groups.append(Inequalities(-demanded, each, unknowns.reshape(nodes, -1)))
    storage, solution = least_storage(basis, nodes, *groups, accept=ALMOST)
    return replace(storage, flux=np.array([np.trace(block) for block in solution.blocks[: len(edges)]]))


def proved_level(walks: Walks, moved: Sequence[Array], P: Array) -> float:
    """The least level that the storage functions prove, by their eigenvalues alone; infinite if they prove none."""
    n, worst = walks.problem.plant.order, 0.0
    if np.linalg.eigvalsh(P)[:, 0].min() <= 0:
        return np.inf
    for edge, M in zip(walks.automaton.edges, moved, strict=True):
        before, after, W = P[edge.source], P[edge.target], walks.W[edge.source]
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
    not tell of, and zero on those Q-orthogonal to them: the gain of the Kalman filter at level^2 (P_s - W'W)^-1.
    """
    edges, covariance = walks.automaton.edges, squared * np.linalg.inv(storage.P - walks.W.mT @ walks.W)
    arrived, sources = np.array([edge.arrived for edge in edges]), [edge.source for edge in edges]
    gains = filtering(walks.problem, arrived, (walks.T @ covariance @ walks.T.mT)[sources]).L
    if not np.all(np.isfinite(gains)):
        raise SolverError("the gains under losses were lost in rounding; change the units of the states or the noise")
    return gains


def kernel(F: Array) -> Array:
    """An orthonormal basis (columns, r) of the directions that [C D] does not see."""
    return np.asarray(np.linalg.qr(F.T, mode="complete")[0][:, len(F) :])


CLOSE = 1e-4
"""Relative width at which a bracket is good enough."""
LARGEST = 2400
"""Edges times entries of a storage function up to which more of the past is told apart."""
SHARE = 0.3
"""Of the nodes that are told apart by their past in each round, those where most is at stake."""
MEASURED = 10
"""Patterns whose exact gain is computed: the shortest, and those that forget the slowest."""
LONGEST, FOLLOWED = 12, 4
"""Periods of the schedule up to which growing patterns are followed, and how many of the largest at each node."""
MARGINS = (1e-3, 1e-2, 0.1)
"""Relative distances above the least level at which gains are made, each where the one before proves nothing."""


@dataclass(frozen=True, eq=False)
class Worst:
    """lower: the exact gain of the periodic pattern `word`; upper: proved for all patterns by storage functions P
    (nodes, n, n) on the nodes of `tree`, in the units of the plant."""

    lower: float
    upper: float
    word: Word
    tree: Automaton
    P: Array


def worst_pattern(problem: MultirateProblem, cases: Automaton, gains: Array, words: list[Word]) -> tuple[float, Word]:
    """The largest exact gain of the periodic patterns; raises InfeasibleError if one makes the error grow."""
    systems = {word: along(problem, gains, word) for word in words}
    radii = {word: system.spectral_radius() ** (1 / system.period) for word, system in systems.items()}
    for word, radius in radii.items():
        if radius >= 1:
            raise InfeasibleError(
                f"the error grows by {radius:.6g} an instant where samples come as {patterns(cases.edges, word)} "
                "(1: comes), again and again, so no level is guaranteed; allow fewer losses in a row, or "
                "design the gains for them"
            )
    slowest = sorted(words, key=lambda word: -radii[word])[:MEASURED]
    levels = {word: l2_gain(systems[word]).lower for word in dict.fromkeys((*slowest, *words[:MEASURED]))}
    worst = max(levels, key=lambda word: levels[word])
    return levels[worst], worst


def bracket(problem: MultirateProblem, cases: Automaton, gains: Array, words: list[Word]) -> Worst:
    """The worst gain of `gains` (edges, n, q); raises SolverError if no level is proved."""
    lower, word = worst_pattern(problem, cases, gains, words)
    best, tree, unit = Worst(lower, np.inf, word, cases, np.zeros((0, 0, 0))), cases, lower if lower > 0 else 1.0
    while True:
        walks = Walks(problem, tree, unit)
        moved = [walks.moved(i, gains[edge.origin]) for i, edge in enumerate(tree.edges)]
        try:
            storage = least_level(walks, moved)
        except InfeasibleError:
            # Most often no storage exists since some longer pattern grows; if it is found, that is the answer.
            worst_pattern(problem, cases, gains, [*growing(problem, cases, gains), *words])
            break
        except SolverError:
            break
        upper = proved_level(walks, moved, storage.P)
        if upper < best.upper:
            best = replace(best, upper=upper, tree=tree, P=walks.storage(storage.P))
        lower, word = worst_pattern(problem, cases, gains, tree.followed(storage.flux))
        if lower > best.lower:
            best = replace(best, lower=lower, word=word)
        finer = _told_apart(tree, storage.flux)
        narrow = best.upper <= best.lower * (1 + CLOSE)
        if narrow or finer is None or len(finer.edges) * problem.plant.order**2 > LARGEST:
            break
        tree = finer
    if not np.isfinite(best.upper):
        raise SolverError(
            f"no level was proved for all patterns of losses; the worst one found has the gain {best.lower:.6g}; allow "
            "fewer losses in a row, or change the units of the states"
        )
    return best


def growing(problem: MultirateProblem, cases: Automaton, gains: Array) -> list[Word]:
    """A periodic pattern along which the error of `gains` (edges, n, q) grows, if large products lead to one."""
    steps = [closed_loop(problem.plant, gain)[0] for gain in gains]
    for start in cases.nodes[0]:
        front: list[tuple[int, Word, Array]] = [(start, (), np.eye(problem.plant.order))]
        for _ in range(LONGEST * cases.period):
            ahead: dict[int, list[tuple[int, Word, Array]]] = {}
            for node, word, moved in front:
                for i in cases.out[node]:
                    target = cases.edges[i].target
                    ahead.setdefault(target, []).append((target, (*word, i), steps[i] @ moved))
            for _, word, moved in ahead.get(start, []):
                if np.max(np.abs(np.linalg.eigvals(moved))) >= 1:
                    return [word]
            front = [
                way
                for ways in ahead.values()
                for way in sorted(ways, key=lambda way: -np.linalg.norm(way[2]))[:FOLLOWED]
            ]
    return []


def found_level(problem: MultirateProblem, cases: Automaton, gains: Array, words: list[Word]) -> float:
    """The largest exact gain of patterns that are soon found; raises InfeasibleError if one makes the error grow."""
    level, _ = worst_pattern(problem, cases, gains, words)
    walks = Walks(problem, cases, level if level > 0 else 1.0)
    try:
        flux = least_level(walks, [walks.moved(i, gain) for i, gain in enumerate(gains)]).flux
    except SolverError:
        return level
    return max(level, worst_pattern(problem, cases, gains, cases.followed(flux))[0])


def _told_apart(tree: Automaton, flux: Array) -> Automaton | None:
    """Nodes with the largest flux told apart by their past; None where there is only one past."""
    targets = [edge.target for edge in tree.edges]
    several = np.flatnonzero(np.bincount(targets) > 1)
    if not len(several):
        return None
    through = np.bincount(targets, weights=flux)
    ranked = several[np.argsort(-through[several], kind="stable")]
    return tree.split({int(i) for i in ranked[: max(1, int(SHARE * len(several)))]})


def least_gains(problem: MultirateProblem, cases: Automaton, unit: float) -> Array:
    """Gains (edges, n, q) that know which samples came, with the least level that storage functions prove.

    unit: a level of about the right size. Raises InfeasibleError or SolverError if there are none.
    """
    walks = Walks(problem, cases, unit)
    opened = [walks.open_loop(i) for i in range(len(cases.edges))]
    storage = least_level(walks, [moved for moved, _ in opened], [kernel(F) for _, F in opened])
    proved = []
    for margin in MARGINS:
        squared = storage.delta * (1 + margin) ** 2
        gains = central_gains(walks, storage, squared)
        closed = [walks.moved(i, gain) for i, gain in enumerate(gains)]
        try:
            proved.append((proved_level(walks, closed, least_level(walks, closed).P), gains))
        except SolverError:
            continue
        if proved[-1][0] <= walks.unit * np.sqrt(squared) * (1 + margin):
            break
    if not proved or not np.isfinite(min(level for level, _ in proved)):
        raise SolverError("no gains under losses were proved; allow fewer losses in a row, or change the units")
    return min(proved, key=lambda pair: pair[0])[1]
