"""Speed of the exact dual-rate analysis against sub-stepped and stepped simulation, and of the search of readings."""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.clock import median_times
from papers.shao.experiments.tracking import table_columns
from papers.shao.method.motor import simulate
from papers.shao.method.readings import search_block
from papers.shao.printed import APO, DESIGN, FREQUENCIES, PMI, READINGS, START, literal_loop, table_1
from replication.estimation.dualrate.loop import reference, stability_radius, time_response, tracking_error_ratio

HALF_UNIT = 0.5 * 10.0 ** -len(table_1("DRC-APO")[0].split(".")[1])
"""Half a unit of the last printed place of Table I, percent."""
SUBSTEPS = 39
"""The first grid from 30 points on that happens to meet the peaks to the printed digits, which flatters the
simulation: most finer ones do not."""
TURNS = 15
SETTLING, PERIODS = 150, 520
"""Slow periods until the transient is below the printed digits, and in all. With σ = 1 rad/s the slow instants come
back to nearly the same phase after 22 periods, so that it takes 355 to see the largest error to the printed digits."""


def table_of(largest: Callable[[str, float], float]) -> np.ndarray:
    """The largest error of both observers over the frequencies, percent."""
    return np.array([[100 * largest(name, frequency) for frequency in FREQUENCIES] for name in (PMI, APO)])


def lifted_table() -> np.ndarray:
    return table_of(lambda name, frequency: tracking_error_ratio(literal_loop(name, frequency)))


def simulated_table() -> np.ndarray:
    """After the settling time of a simulation from the printed start."""

    def largest(name: str, frequency: float) -> float:
        harmonic = reference(literal_loop(name, frequency))
        trace = simulate(DESIGN, name, harmonic, START, 0 * START, slow_periods=PERIODS, substeps=SUBSTEPS)
        errors = np.abs(trace.output - np.sin(frequency * trace.time))
        return float(errors[trace.time >= SETTLING * DESIGN.slow_period].max())

    return table_of(largest)


def lifted_simulated_table() -> np.ndarray:
    """The same maxima by a simulation from slow instant to slow instant, all times of a loop in one product."""

    def largest(name: str, frequency: float) -> float:
        counts = {"slow_periods": PERIODS, "substeps": SUBSTEPS}
        trace = time_response(literal_loop(name, frequency), START, 0 * START, **counts)
        return float(np.abs(trace.error[trace.time >= SETTLING * DESIGN.slow_period]).max())

    return table_of(largest)


def test_table_by_the_lifted_form(benchmark: Any) -> None:
    assert np.all(np.isfinite(benchmark(lifted_table)))


def test_table_by_sub_stepped_simulation_to_the_same_digits(benchmark: Any) -> None:
    table = benchmark.pedantic(simulated_table, rounds=1)
    ratio = benchmark.stats.stats.median / median_times(lifted_table, rounds=5)[0]
    gap = float(np.abs(table - lifted_table()).max())
    benchmark.extra_info.update(slow_periods=PERIODS, gap=gap, times_slower=ratio)
    assert gap <= HALF_UNIT
    assert ratio >= 200


def test_table_by_lifted_simulation_to_the_same_digits(benchmark: Any) -> None:
    """The fairer comparison: no loop over the fast instants is left."""
    table = benchmark.pedantic(lifted_simulated_table, rounds=5)
    gap = float(np.abs(table - lifted_table()).max())
    ours, simulated = median_times(lifted_table, lifted_simulated_table, rounds=TURNS)
    benchmark.extra_info.update(slow_periods=PERIODS, gap=gap, of_lifted_simulation=ours / simulated)
    assert gap <= HALF_UNIT
    assert ours <= 0.4 * simulated


def test_stability_radius(benchmark: Any) -> None:
    assert benchmark(lambda: stability_radius(literal_loop(APO, 1.0))) < 1


def test_one_block_of_the_search(benchmark: Any) -> None:
    result = benchmark.pedantic(search_block, args=(READINGS, table_columns(), 0), rounds=3)
    benchmark.extra_info.update(readings=sum(result.tried.values()))
