"""What the levels are set beside: a floor for every filter, a design over a dense grid, the size of the inequality."""

from __future__ import annotations

from replication.estimation.nonuniform.nominal import riccati_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import FilterDesign, Solver, design_for_periods, normalise
from replication.estimation.validation import positive_integer


def floor_for_any_filter(plant: SampledPlant, periods: PeriodRange, nodes: int) -> tuple[float, float]:
    """A level that no filter of form (4) attains, and at which constant period: the largest of `nodes` of them.

    It is the infeasible end of the search for gamma*(h), so a lower bound. Raises the errors of `riccati_level`.
    """
    count = positive_integer("nodes", nodes)
    levels = [(riccati_level(plant, float(h), tolerance=1e-8).infeasible, float(h)) for h in periods.nodes(count)]
    return max(levels)


def dense_design(plant: SampledPlant, periods: PeriodRange, nodes: int) -> FilterDesign:
    """One Lyapunov function on `nodes` equally spaced periods, all at once; nothing is known between them."""
    normalised = normalise(plant, periods.middle)
    return design_for_periods(plant, periods.nodes(nodes).tolist(), at=normalised, solver=Solver.SDPA)


def lmi_size(plant: SampledPlant) -> tuple[int, int]:
    """Number of scalar unknowns of (10), delta included, and order of its matrix."""
    n, m, r, s = plant.order, plant.B.shape[1], len(plant.C), len(plant.L)
    return n * (n + 1) + n * r + s * n + n * n + 1, 4 * n + s + m
