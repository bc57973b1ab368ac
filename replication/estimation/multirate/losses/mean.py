"""Mean square errors under random losses: linear equations between the covariances of each node (Costa, Fragoso and
Marques, Discrete-Time Markov Jump Linear Systems, 2005), and the gains that make them least.

X_s is the mean of e e' where the walk is at node s, zero elsewhere. An edge s -> t of probability p adds
p (A X_s A' + pi_s B B') to X_t: the error is stable in mean square iff that map, over a period, shrinks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.riccati import symmetric
from replication.estimation.multirate.losses.automaton import Automaton, Edge, closed_loop
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array, undetectable_mode

MOST_UNKNOWNS = 1500
"""Entries of the covariances of one phase."""
RARE = 1e-13
"""A node of a smaller probability is never visited."""
ROUNDS, SETTLED, LOST = 20_000, 1e-13, 1e14
"""Periods of the recursion for the gains; change at which it has settled, and growth beyond which it never will."""
MARGIN = 1e-9


@dataclass(frozen=True, eq=False)
class MeanSquare:
    """visited: probability of each node at its phase; X (nodes, n, n): mean of e e' there; rms: of W e over a period;
    radius: growth of the mean square over a period, without noise."""

    visited: Array
    X: Array
    rms: float
    radius: float


def visits(given: Automaton) -> Array:
    """The stationary probability of each node at its phase, (nodes,).

    From the start and one period on: the least-squares solution of pi T = pi, sum 1, of the chain at phase 0.
    """
    first = [i for i, phase in enumerate(given.phases) if phase == 0]
    moves = _over_period(given, [np.array([[edge.probability]]) for edge in given.edges], 1)
    count = len(first)
    system = np.vstack([np.eye(count) - moves, np.ones(count)])
    pi = np.zeros(len(given.phases))
    pi[first] = np.linalg.lstsq(system, np.append(np.zeros(count), 1.0), rcond=None)[0]
    for phase in range(max(given.phases)):
        for edge in given.edges:
            if edge.phase == phase:
                pi[edge.target] += edge.probability * pi[edge.source]
    return np.where(pi > RARE, pi, 0.0)


def require_seen(problem: MultirateProblem, given: Automaton) -> None:
    """Raise InvalidInputError if an unstable mode is hidden from all samples that ever come."""
    pi = visits(given)
    came = np.zeros((problem.schedule.period, problem.plant.sensors), dtype=bool)
    for edge in given.edges:
        if pi[edge.source] > 0:
            came[edge.phase] |= np.array(edge.arrived)
    transition, outputs = np.eye(problem.plant.order), []
    for rows in came:
        outputs.append(problem.plant.C[rows] @ transition)
        transition = problem.plant.A @ transition
    if (mode := undetectable_mode(transition, np.vstack(outputs), discrete=True)) is not None:
        raise InvalidInputError(
            f"the plant is not detectable under losses: the mode with multiplier {mode:.6g} over one period is seen by "
            "no sample that ever comes; lower the probability of a loss, or add a sensor"
        )


def mean_square(problem: MultirateProblem, given: Automaton, gains: Array) -> MeanSquare:
    """The stationary mean square error of gains (edges, n, q); raises InfeasibleError if there is none."""
    n, pi = problem.plant.order, visits(given)
    _require_size(given, n)
    loops = [closed_loop(problem, gain) for gain in gains]
    short, long = _halves(n)
    maps = [edge.probability * short @ np.kron(A, A) @ long for edge, (A, _) in zip(given.edges, loops, strict=True)]
    period = _over_period(given, maps, len(short))
    radius = float(np.max(np.abs(np.linalg.eigvals(period))))
    if radius >= 1 - MARGIN:
        raise InfeasibleError(
            f"the mean square error grows by {radius:.6g} over each period of the schedule, so it has no stationary "
            "value under these losses; design the gains for them, measure more often, or lose less"
        )
    added = [
        edge.probability * pi[edge.source] * (short @ (B @ B.T).ravel())
        for edge, (_, B) in zip(given.edges, loops, strict=True)
    ]
    first = [i for i, phase in enumerate(given.phases) if phase == 0]
    states = _along(given, maps, added, np.zeros((len(given.phases), len(short))))
    start = np.linalg.solve(np.eye(len(period)) - period, states[first].ravel())
    before = np.zeros_like(states)
    before[first] = start.reshape(len(first), len(short))
    states = _along(given, maps, added, before)
    X = (states @ long.T).reshape(-1, n, n)
    total = np.einsum("za,kab,zb->", problem.plant.W, X, problem.plant.W)
    return MeanSquare(pi, X, float(np.sqrt(total / problem.schedule.period)), radius)


def mean_square_gains(problem: MultirateProblem, given: Automaton) -> Array:
    """The gains (edges, n, q) with the least mean square error of all that know phase, memory and what came.

    The coupled Riccati recursion from X = 0. Raises InfeasibleError if it grows without end: no gains keep the mean
    square finite then; SolverError if it does not settle.
    """
    pi, n = visits(given), problem.plant.order
    X = np.zeros((len(given.phases), n, n))
    scale = float(np.trace(problem.plant.drive @ problem.plant.drive.T)) or 1.0
    for _ in range(ROUNDS):
        previous = X[0].copy(), X
        for phase in range(problem.schedule.period):
            X = _corrected_step(problem, given, pi, X, phase)
        size = float(np.abs(X).max())
        if not np.isfinite(size) or size > LOST * scale:
            raise InfeasibleError(
                "too many samples are lost: no gains keep the mean square error finite; lose less, or measure more "
                "often"
            )
        if np.abs(X - previous[1]).max() <= SETTLED * size:
            return np.stack([_gain(problem, edge, X[edge.source], pi[edge.source]) for edge in given.edges])
    raise SolverError(
        f"the gains under losses did not settle in {ROUNDS} periods: the losses are next to those at which the mean "
        "square error becomes infinite; lose less, or measure more often"
    )


def _corrected_step(problem: MultirateProblem, given: Automaton, pi: Array, X: Array, phase: int) -> Array:
    following = X.copy()
    following[[edge.target for edge in given.edges if edge.phase == phase]] = 0.0
    for edge in given.edges:
        if edge.phase == phase and pi[edge.source] > 0:
            A, B = closed_loop(problem, _gain(problem, edge, X[edge.source], pi[edge.source]))
            following[edge.target] += edge.probability * (A @ X[edge.source] @ A.T + pi[edge.source] * B @ B.T)
    return symmetric(following)


def _gain(problem: MultirateProblem, edge: Edge, X: Array, pi: float) -> Array:
    """The Kalman gain (n, q) at the mean error X / pi of a node."""
    plant, rows = problem.plant, list(edge.arrived)
    gain = np.zeros((plant.order, plant.sensors))
    if pi > 0 and any(rows):
        C, D, P = plant.C[rows], plant.D[rows], X / pi
        cross = plant.A @ P @ C.T + (plant.B_w @ D.T if plant.correlated else 0.0)
        gain[:, rows] = np.linalg.solve(C @ P @ C.T + D @ D.T, cross.T).T
    return gain


def _require_size(given: Automaton, n: int) -> None:
    unknowns = max(given.phases.count(phase) for phase in set(given.phases)) * n * (n + 1) // 2
    if unknowns > MOST_UNKNOWNS:
        raise InvalidInputError(
            f"the covariances of one instant have {unknowns} entries, more than {MOST_UNKNOWNS}; send the samples "
            "together, or use a smaller plant"
        )


def _halves(n: int) -> tuple[Array, Array]:
    """Matrices that take the upper triangle of a symmetric (n, n) matrix, and give it back whole."""
    rows, columns = np.triu_indices(n)
    count = np.arange(len(rows))
    short, long = np.zeros((len(rows), n * n)), np.zeros((n * n, len(rows)))
    short[count, rows * n + columns] = 1.0
    long[rows * n + columns, count] = long[columns * n + rows, count] = 1.0
    return short, long


def _over_period(given: Automaton, maps: list[Array], size: int) -> Array:
    """The map of the stacked states of the nodes at phase 0 over one period."""
    place = [given.phases[:i].count(phase) for i, phase in enumerate(given.phases)]
    period = max(given.phases) + 1
    total = np.eye(given.phases.count(0) * size)
    for phase in range(period):
        step = np.zeros((given.phases.count((phase + 1) % period) * size, given.phases.count(phase) * size))
        for edge, part in zip(given.edges, maps, strict=True):
            if edge.phase == phase:
                to, at = place[edge.target] * size, place[edge.source] * size
                step[to : to + size, at : at + size] += part
        total = step @ total
    return total


def _along(given: Automaton, maps: list[Array], added: list[Array], states: Array) -> Array:
    """The states of all nodes over one period, from those of phase 0; these are those after the period."""
    states, after = states.copy(), np.zeros_like(states)
    period = max(given.phases) + 1
    for phase in range(period):
        to = after if phase == period - 1 else states
        for edge, part, more in zip(given.edges, maps, added, strict=True):
            if edge.phase == phase:
                to[edge.target] += part @ states[edge.source] + more
    first = [i for i, phase in enumerate(given.phases) if phase == 0]
    states[first] = after[first]
    return states
