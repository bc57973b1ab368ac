"""Robust design for a range of sampling periods: the exchange method against dense grids, over grid size and order."""

import time
from typing import Any

import numpy as np
import pytest

from benchmarks.clock import processor_seconds
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import LmiSolution, Solver, design_for_periods, normalise, robust_design

SAME = 1e-6
"""Relative distance of the levels of both methods."""
LIMIT = 30.0
"""Seconds of processor time within which a plant of ten states must have its robust design."""
OSCILLATOR = SampledPlant([[0, 1], [-16, -4.8]], [[0], [16]], [[1, 0]], [[0.1]], [[1, 0]])
MOTOR = SampledPlant([[-10, 1], [-0.02, -2]], [[2], [2]], [[1, 0]], [[0]], [[0, 1]])
EXAMPLES = {
    "oscillator": (OSCILLATOR, PeriodRange(0.01, np.pi / 25)),
    "motor": (MOTOR, PeriodRange(0.001, 0.099)),
}
RANGE = PeriodRange(0.05, 0.3)
BY_ORDER, NODES = "Robust design by order n", 129


def dense_design(plant: SampledPlant, periods: PeriodRange, nodes: int) -> LmiSolution:
    """One Lyapunov function on equally spaced periods, all at once; nothing is known between them."""
    at = normalise(plant, periods.middle)
    return design_for_periods(plant, periods.nodes(nodes).tolist(), at=at, solver=Solver.SDPA)


def chain(order: int) -> SampledPlant:
    """Damped oscillators in a row, half as many as states; the first is measured, the last to be estimated."""
    rng = np.random.default_rng(order)
    A = np.zeros((order, order))
    for i in range(0, order, 2):
        A[i : i + 2, i : i + 2] = [[0, 1], [-((1 + i) ** 2), -1.2 * (1 + i)]]
        if i:
            A[i + 1, i - 2] = 0.5 * (1 + i) ** 2
    B = np.zeros((order, 2))
    B[1, 0] = 1.0
    C, L = np.zeros((1, order)), np.zeros((1, order))
    C[0, order - 2] = L[0, 0] = 1.0
    return SampledPlant(A, B + 0.01 * rng.standard_normal((order, 2)), C, np.array([[0.0, 0.1]]), L)


@pytest.mark.parametrize("name", EXAMPLES)
def test_exchange_on_the_examples(benchmark: Any, name: str) -> None:
    benchmark.group = "Robust design by exchange, both examples"
    found = benchmark(robust_design, *EXAMPLES[name])
    begun = time.perf_counter()
    assert found.design.level == pytest.approx(dense_design(*EXAMPLES[name], NODES).level, rel=SAME)
    faster = (time.perf_counter() - begun) / benchmark.stats.stats.median
    benchmark.extra_info["times faster"] = faster
    assert faster > 1


@pytest.mark.parametrize("nodes", [9, 33, NODES])
@pytest.mark.parametrize("name", EXAMPLES)
def test_dense_grid_on_the_examples(benchmark: Any, name: str, nodes: int) -> None:
    benchmark.group = "Robust design on a dense grid, both examples"
    benchmark.extra_info.update(row=f"{nodes} nodes", column=name, sizes={"nodes": nodes})
    benchmark.pedantic(dense_design, args=(*EXAMPLES[name], nodes), rounds=2)


@pytest.mark.parametrize("order", [2, 4, 6, 8])
def test_dense_grid_over_the_order(benchmark: Any, order: int) -> None:
    plant = chain(order)
    benchmark.group = BY_ORDER
    benchmark.extra_info.update(row=f"n = {order}", column=f"{NODES} nodes", sizes={"n": order})
    benchmark.pedantic(dense_design, args=(plant, RANGE, NODES), rounds=1)


@pytest.mark.parametrize("order", [2, 4, 6, 8, 10, 12])
def test_exchange_over_the_order(benchmark: Any, order: int) -> None:
    plant = chain(order)
    benchmark.group = BY_ORDER
    benchmark.extra_info.update(row=f"n = {order}", column="exchange", sizes={"n": order})
    start = processor_seconds()
    found = benchmark.pedantic(robust_design, args=(plant, RANGE), rounds=1)
    seconds = processor_seconds() - start
    benchmark.extra_info |= {"solver calls": found.rounds, "gap": found.design.report.residuals["gap"]}
    assert order > 10 or seconds < LIMIT
