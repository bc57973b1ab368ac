"""Proof that the filter with time stamps has its level for every sequence, by the hulls of the robust filter."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from replication.errors import SolverError
from replication.estimation.nonuniform.guarantee.certificate import UNPROVED, cell_needs
from replication.estimation.nonuniform.guarantee.path_lyapunov import ErrorSystem
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.stamped.design import CELLS, SLACKS, StampedDesign, stamped_design
from replication.estimation.validation import Array

LOOSE = 1e-3
"""Relative distance of the proved level from that of the design above which pieces of a cell are halved."""


@dataclass(frozen=True, eq=False)
class StampedProof:
    """level: no sequence exceeds it; storage (gains x states, n, n): e'X e for each gain of the filter and state of an
    automaton that reads the periods from the last one on; edges of its cells, s; before: for each state and cell the
    state before it."""

    level: float
    storage: Array
    edges: tuple[float, ...]
    before: tuple[tuple[int, ...], ...]


def prove(plant: SampledPlant, design: StampedDesign) -> StampedProof:
    """The level that the storage of a design proves, whatever solver it came from.

    For all cells c and d: |e|^2 + e+' X_d e+ <= e' X_c e + level^2 |w|^2 over d, in coordinates in which X_c is the
    identity. Raises SolverError if it proves none.
    """
    X, worst = design.storage.X / design.storage.delta, 0.0
    for before, G in zip(X, design.filter.G, strict=True):
        T = np.linalg.cholesky(before).T
        inverse = np.linalg.inv(T)
        system = ErrorSystem(plant, type(design.filter)(G[None]), T, design.level, False, np.ones(plant.order))
        for after, ends in zip(X, pairwise(design.edges), strict=True):
            following = inverse.T @ after @ inverse
            needs, _ = cell_needs(system, np.eye(plant.order)[None], following[None], ends, (1 + LOOSE) ** 2)
            worst = max(worst, float(needs[0]))
    if not worst < UNPROVED:
        raise SolverError(
            f"the level {design.level:.6g} of the design holds at finitely many periods, not for certain at all others;"
            " narrow the range of sampling periods"
        )
    level = design.level * float(np.sqrt(worst * (1 + 1e-9)))
    return StampedProof(level, design.storage.X, design.edges, ((0,) * len(X),))


def proved_design(
    plant: SampledPlant, periods: PeriodRange, *, cells: int = CELLS
) -> tuple[StampedDesign, StampedProof]:
    """The design with the least slack that proves a level; errors as `stamped_design` and `prove`."""
    found = stamped_design(plant, periods, cells=cells)
    try:
        return found, prove(plant, found)
    except SolverError:
        found = stamped_design(plant, periods, cells=cells, slack=SLACKS[-1])
        return found, prove(plant, found)
