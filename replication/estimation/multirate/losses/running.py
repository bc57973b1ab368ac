"""An observer that counts what was lost, and takes its gains accordingly."""

from __future__ import annotations

import numpy as np

from replication.estimation.api.running import RunningObserver
from replication.estimation.multirate.losses.automaton import Automaton, Edge
from replication.estimation.multirate.losses.c_form import c_form
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array


class LossObserver(RunningObserver):
    """x^(k+1) = A x^ + B_u u + L (y - C x^ - D_u u) with the gain L of what came now and of what is known of before.

    A loss that the model does not foresee is left out like the others; `unforeseen` counts such instants, after which
    nothing is guaranteed.

    Parameters
    ----------
    problem : MultirateProblem
        Plant and schedule.
    given : Automaton
        What may happen.
    gains : array (edges, n, q)
        A gain for each edge.
    """

    def __init__(self, problem: MultirateProblem, given: Automaton, gains: Array) -> None:
        self._problem, self._given, self._gains = problem, given, gains
        self._nodes = {pair: i for i, pair in enumerate(zip(given.phases, given.memories, strict=True))}
        plant = problem.plant
        super().__init__(plant.order - plant.under_way, plant.B_u.shape[1], plant.sensors)

    @property
    def estimate(self) -> Array:
        """x^(k), (n,)."""
        return np.array(self._state[: self.states])

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """As in `RunningObserver`; `missed` and `unforeseen` are counted there, too."""
        return c_form(name, comment, self._problem, self._given, self._gains)

    def _begin(self, start: Array) -> None:
        self._state = np.zeros(self._problem.plant.order)
        self._state[: self.states] = start
        self._node, self.unforeseen = 0, 0

    def _advance(self, u: Array, y: Array) -> None:
        plant, phase = self._problem.plant, self._given.phases[self._node]
        due = self._problem.schedule.mask[phase]
        self._arrived(~np.isnan(y), due)
        came = due & ~np.isnan(y)
        number = min(self._given.out[self._node], key=lambda i: int(np.sum(came != self._given.edges[i].arrived)))
        edge = self._given.edges[number]
        innovation = np.where(came, y, 0.0) - came * (plant.C @ self._state + plant.D_u @ u)
        self._state = plant.A @ self._state + plant.B_u @ u + self._gains[number] @ innovation
        self._node = edge.target
        if not np.array_equal(came, edge.arrived):
            self.unforeseen += 1
            self._node = self._after(edge, came)

    def _after(self, edge: Edge, came: Array) -> int:
        """The node that knows of as many losses as the model allows where there were more."""
        before, after = self._given.memories[edge.source], self._given.memories[edge.target]
        lost = np.array(edge.arrived) & ~came.astype(bool)
        channels = [bool(lost.any())] if len(before) == 1 else lost.tolist()
        memory = tuple(b if gone else a for gone, b, a in zip(channels, before, after, strict=True))
        return self._nodes.get((self._given.phases[edge.target], memory), edge.target)
