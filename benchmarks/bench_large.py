"""How far each method goes: cost over the size, up to one large case each, with plants drawn from a seed."""

from typing import Any

import numpy as np
import pytest

from benchmarks.bench_multirate import random_problem
from benchmarks.clock import processor_seconds
from papers.peet2019.method import chebyshev_model, riccati_gain
from replication.estimation.delay.facade import design
from replication.estimation.delay.plant import DelayPlant, delay_system
from replication.estimation.delay.sos.certificate import minimum_gain
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.synthesis import degree_for
from replication.estimation.dualrate.loop import DualRateLoop, close_loop, stability_radius, tracking_error_ratio
from replication.estimation.dualrate.observers import OBSERVERS, Harmonic
from replication.estimation.dualrate.problem import dual_rate_design, make_plant
from replication.estimation.multirate.optimum import optimal_design

PREDICTOR = "running_prediction"
ORDER = 6
"""Order of the collocation that the least level of the delay observers is compared with."""
LIMIT = 15.0
"""Seconds of processor time within which a plant with n K = 20 and up to ten states must have its delay observer."""


def loop_of_oscillators(n: int, ratio: int) -> DualRateLoop:
    """Damped oscillators in a row with a slow sensor on the last, and a small feedback from all of them."""
    A = np.zeros((n, n))
    for i in range(0, n, 2):
        A[i : i + 2, i : i + 2] = [[0, 1], [-((1 + 0.1 * i) ** 2), -1.0]]
        if i:
            A[i + 1, i - 2] = 0.3
    B, C = np.zeros((n, 1)), np.zeros((1, n))
    B[1, 0] = C[0, n - 2] = 1.0
    design = dual_rate_design(
        make_plant(A, B, C),
        feedback=-0.05 * np.ones((1, n)),
        injection=0.05 * np.ones((n, 1)),
        period=0.01,
        ratio=ratio,
    )
    return close_loop(design, OBSERVERS[PREDICTOR], harmonic=Harmonic(1.0, np.array([1.0])))


def delayed(n: int, delays: int) -> DelayPlant:
    """A seeded plant with damped states, delays up to about two seconds, and two measurements (one if n = 2)."""
    rng = np.random.default_rng(1)
    late = 0.4 / (delays * np.sqrt(n))
    return delay_system(
        rng.standard_normal((n, n)) / np.sqrt(n) - 0.8 * np.eye(n),
        [late * rng.standard_normal((n, n)) for _ in range(delays)],
        np.cumsum(rng.uniform(0.1, 0.3, delays)).tolist(),
        np.eye(n),
        rng.standard_normal((1, n)),
        rng.standard_normal((2 if n > 2 else 1, n)),
    )


@pytest.mark.parametrize(
    ("n", "periods"), [(10, (4, 5, 6)), (20, (4, 5, 6)), (30, (3, 4)), (30, (4, 5)), (30, (4, 5, 6))], ids=str
)
def test_multirate_design(benchmark: Any, n: int, periods: tuple[int, ...]) -> None:
    problem = random_problem(n, periods, noises=2)
    common = problem.schedule.period
    benchmark.group = "Large: multi-rate design"
    benchmark.extra_info.update(row=f"n = {n}, N = {common}", column="Riccati", sizes={"n": n, "N": common})
    found = benchmark.pedantic(optimal_design, args=(problem,), rounds=1)
    assert problem.error_system(found.gains).spectral_radius() < 1


@pytest.mark.parametrize(("n", "ratio"), [(4, 50), (10, 50), (20, 10), (20, 25), (20, 50), (20, 100)], ids=str)
def test_dual_rate_loop_per_frequency(benchmark: Any, n: int, ratio: int) -> None:
    loop = loop_of_oscillators(n, ratio)
    assert stability_radius(loop) < 1
    benchmark.group = "Large: dual-rate loop, per frequency"
    benchmark.extra_info.update(row=f"n = {n}, M = {ratio}", column="exact", sizes={"n": n, "M": ratio})
    assert np.isfinite(benchmark.pedantic(tracking_error_ratio, args=(loop,), rounds=5, warmup_rounds=1))


@pytest.mark.parametrize(("n", "delays"), [(2, 2), (2, 5), (2, 10), (4, 5), (5, 4), (10, 1), (10, 2), (20, 1)], ids=str)
def test_delay_observer(benchmark: Any, n: int, delays: int) -> None:
    system = delayed(n, delays)
    degree = degree_for(system, DegreeRule.BESSEL)
    benchmark.group = "Large: observer for delays, small cone"
    benchmark.extra_info.update(
        row=f"n = {n}, K = {delays}, moments {degree}",
        column="design",
        sizes={"n": n, "K": delays, "moments": degree},
    )
    start = processor_seconds()
    found = benchmark.pedantic(design, args=(system,), rounds=1)
    seconds = processor_seconds() - start
    least = next(fact.value for fact in found.evidence if fact.what == "least level")
    benchmark.extra_info.update(excess=least / riccati_gain(chebyshev_model(system, ORDER)) - 1)
    assert n > 10 or seconds < LIMIT


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize("rule", [DegreeRule.TOTAL, DegreeRule.BESSEL], ids=str)
def test_delay_degree(benchmark: Any, rule: DegreeRule, degree: int) -> None:
    benchmark.group = "Observer for delays by degree d, n = 2, K = 2"
    benchmark.extra_info.update(row=str(degree), column=f"least level, {rule} rule", sizes={"d": degree})
    found = benchmark.pedantic(minimum_gain, args=(delayed(2, 2), degree, rule), rounds=3)
    assert np.isfinite(found.gamma)
