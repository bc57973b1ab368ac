"""Observers in the closed loop: levels that are kept, norms, simulations; closed forms, a sample of the benchmark."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks import delay_designs
from papers.peet2019.method import chebyshev_model, riccati_gain
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system, design, exact_gain, limit
from replication.estimation.delay.exact import limit as limits
from replication.estimation.delay.general import design as designs
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.sos.observer import error_system, simulate
from replication.estimation.delay.sos.operators import check, observer_gains
from replication.estimation.delay.units import natural_units
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.linear.periodic import Stage
from tests.estimation.delay.plants import awkward, one_delay, random_system, three_delays, two_delays, unstable_pair

BESSEL, TENSOR = DegreeRule.BESSEL, DegreeRule.TENSOR
NEAR = 1 + 1e-4


@pytest.mark.parametrize(
    ("system", "share", "degree", "rule", "orders"),
    [
        (unstable_pair(), NEAR, 3, TENSOR, (24, 32)),
        pytest.param(one_delay(), NEAR, 2, TENSOR, (40, 52), marks=pytest.mark.slow),
        pytest.param(two_delays(), NEAR, 2, TENSOR, (24, 30), marks=pytest.mark.slow),
        pytest.param(three_delays(), NEAR, 2, TENSOR, (14, 20), marks=pytest.mark.slow),
        (two_delays(), 1.05, 3, BESSEL, (20, 24)),
        (three_delays(), 1.05, 3, BESSEL, (20, 24)),
        *((random_system(seed), 1.1, 2, TENSOR, (32, 40)) for seed in range(10)),
        *((awkward(one_delay(), factor), 1.1, 2, BESSEL, (20, 24)) for factor in (1e-6, 1e6)),
    ],
)
def test_closed_loop_keeps_the_level(
    system: DelayPlant, share: float, degree: int, rule: DegreeRule, orders: tuple[int, int]
) -> None:
    best = riccati_gain(chebyshev_model(natural_units(system).plant(system), 14))
    certificate = certificate_at(system, share * best, degree, rule)
    verified = check(certificate)
    assert verified.storage > 0 and verified.dissipation <= 1e-6 * verified.scale
    norms = [continuous_norm(*error_system(system, observer_gains(certificate), order)).upper for order in orders]
    assert best * (1 - 1e-6) <= norms[1] <= certificate.gamma * (1 + 1e-4)  # nothing beats the optimum
    assert norms[0] == pytest.approx(norms[1], rel=1e-3)


def test_the_lower_end_is_of_the_gains_whatever_the_grid_and_an_observer_that_a_grid_spoils_is_refused() -> None:
    """Points of the histories are of the running observer; the gain of a delay system does not hang on them."""
    plant = delay_system([[-1, 0.2], [0.5, -2]], [[[0, 0], [0.5, 0.2]]], [0.4], np.eye(2), np.eye(2), [[1, 0]])
    for order in (2, 3, 24):
        result = design(plant, order=order)
        attained = result.gains_of.gain_at(np.array([result.fact("lower end attained at").value]), 80)
        assert attained * (1 - 1e-9) <= result.bracket.lower <= attained * (1 + 1e-12)
    with pytest.raises(SolverError, match=r"on 2 points they have 0\.766"):
        design(plant, order=1)
    unstable = delay_system(
        [[-0.7, 1.2, 0.2], [1, -1.4, -1], [0.1, -0.7, -0.2]], [-np.eye(3)], [1.6], np.eye(3), np.eye(3), np.eye(2, 3)
    )
    assert design(unstable, degree=2, order=2).bracket.lower == design(unstable, degree=2).bracket.lower


LAG = Stage(*(np.array([[entry]]) for entry in (-2.0, 1.0, 3.0, 0.0)))
DAMPING = 0.05
RESONANCE = Stage(np.array([[0.0, 1], [-1, -2 * DAMPING]]), np.eye(2)[:, 1:], np.eye(2)[:1], np.zeros((1, 1)))


def test_norms_in_closed_form() -> None:
    bracket = continuous_norm(*LAG)
    assert bracket.lower == pytest.approx(1.5, rel=1e-10) and bracket.upper >= bracket.lower
    assert bracket.angle == 0.0
    assert continuous_norm(*RESONANCE).upper == pytest.approx(1 / (2 * DAMPING * np.sqrt(1 - DAMPING**2)), rel=1e-6)
    with pytest.raises(InfeasibleError, match="unstable"):
        continuous_norm(*[np.eye(1)] * 4)
    # (s - 1)/(s + 1) passes all frequencies alike; 2 + 1/(s + 1) has its peak at rest, 2 - 1/(s + 1) at infinity.
    one = np.eye(1)
    for gain, direct, norm in ((-2.0, 1.0, 1.0), (1.0, 2.0, 3.0), (-1.0, 2.0, 2.0)):
        bracket = continuous_norm(-one, one, gain * one, direct * one)
        assert bracket.lower == pytest.approx(norm, rel=1e-9) and bracket.upper == pytest.approx(norm, rel=1e-6)
    assert bracket.angle > 1e9


@pytest.mark.parametrize("seed", range(4))
def test_a_norm_with_a_direct_part_is_that_of_a_sweep(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A, B, C, D = (rng.standard_normal(shape) for shape in ((5, 5), (5, 2), (3, 5), (3, 2)))
    A -= (np.linalg.eigvals(A).real.max() + 0.1) * np.eye(5)
    bracket = continuous_norm(A, B, C, D)
    omega = np.linspace(-0.02, 0.02, 801) + bracket.angle
    omega = np.concatenate([omega, np.linspace(0, 20, 4001)])
    swept = np.linalg.norm(C @ np.linalg.solve(1j * omega[:, None, None] * np.eye(5) - A, B) + D, 2, axis=(1, 2)).max()
    assert swept * (1 - 1e-6) <= bracket.lower <= bracket.upper <= bracket.lower * (1 + 1e-8)
    assert swept <= bracket.upper


def test_simulation_of_a_ramp_is_exact_and_no_gain_exceeds_the_norm() -> None:
    times = np.linspace(0, 2, 9)
    exact = (times / 2 - (1 - np.exp(-2 * times)) / 4) * 3
    assert np.abs(simulate(LAG, times, times[:, None], 1).output[:, 0] - exact).max() < 1e-12
    times = np.linspace(0, 60, 6001)
    at_peak = np.sin(np.sqrt(1 - 2 * DAMPING**2) * times)[:, None]
    assert (
        0.7 * continuous_norm(*RESONANCE).lower
        < simulate(RESONANCE, times, at_peak, 2).gain
        <= continuous_norm(*RESONANCE).upper
    )


@pytest.mark.parametrize(
    ("times", "disturbance", "message"),
    [
        ([0.0, 1.0, 3.0], np.ones((3, 1)), "equidistant"),
        ([0.0], np.ones((1, 1)), "at least two"),
        ([0.0, 1.0], np.ones((3, 1)), r"times must have shape \(3,\)"),
        ([0.0, np.nan], np.ones((2, 1)), "times must be finite"),
        ([0.0, 1.0], np.zeros((2, 1)), "must not vanish"),
    ],
)
def test_bad_simulations(times: Any, disturbance: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        simulate(LAG, times, disturbance, 1)


# Integrators, slow modes, biases, averages, two delays, any units: closed forms, and a sample of the benchmark


LEAST = "least level of any observer"


def lag(rate: float, **sensor: Any) -> DelayPlant:
    """One slow state, and a sensor with noise."""
    return DelayPlant([[rate]], [2.0], [[1, 0]], [[1]], [[0]], d21=[[0, 1]], **sensor)


@pytest.mark.parametrize("sensor", [{"c2_delayed": [[[1.0]]]}, {"c2_spread": [[[1.0]]]}])
def test_a_slow_mode_tends_to_an_integrator(sensor: dict[str, Any]) -> None:
    levels = [limit(lag(rate, **sensor)) for rate in (0.0, -1e-6, -1e-5)]
    assert all(found.settled for found in levels)
    for found in levels[1:]:
        assert found.level == pytest.approx(levels[0].level, rel=2e-5)
    # A rate of a tenth is no integrator any more.
    assert abs(limit(lag(-0.1, **sensor)).level / levels[0].level - 1.0) > 1e-2


@pytest.mark.parametrize("index", [0, 2, 3, 5, 6, 9])
def test_a_sample_of_the_benchmark(index: int) -> None:
    """Each of another family or other units; five have a closed form, the recycle a chain of samples."""
    row = delay_designs.measured(index, hinf=index in (3, 6))
    assert ("mixed" in row) == (index in (3, 6))
    assert row["errors"] == [] and delay_designs.faults(row) == []
    assert row["settled"]


def test_the_benchmark_tells_what_is_off() -> None:
    row = delay_designs.measured(3, hinf=False)
    for name in ("limit", "rms", "least rms"):
        assert delay_designs.faults({**row, name: row[name] * 1.01})
    assert delay_designs.faults({**row, "proved": 0.99 * row["limit"]})
    both = {"proved": 2.0 * row["limit"], "exact": row["limit"], "hinf rms": row["rms"]}
    assert delay_designs.faults({**row, **both, "mixed": (row["limit"], row["rms"])}) == []
    assert delay_designs.faults({**row, **both, "mixed": (row["limit"], 1.01 * row["rms"])})


def test_a_least_level_above_an_attained_one_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = lag(0.0, c2_delayed=[[[1.0]]])
    least = limit(plant)
    monkeypatch.setattr(designs, "limit", lambda _: replace(least, level=1.2 * least.level))
    fact = designs.known_levels(plant, least.level)[0]
    assert fact.value == "open" and "attained" in fact.method
    monkeypatch.setattr(designs, "limit", lambda _: replace(least, moving=0.1 * least.level))
    fact = designs.known_levels(plant)[0]
    assert fact.value == "open" and "do not agree" in fact.method
    monkeypatch.undo()
    assert designs.known_levels(plant, least.level)[0].value == least.level


def test_rounding_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    def singular(*_: Any) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    plant = lag(0.0, c2_delayed=[[[1.0]]])
    observer = design(plant, goal="h2").gains_of  # type: ignore[union-attr]
    monkeypatch.setattr(limits, "climbed", singular)
    with pytest.raises(SolverError, match="rounding decides"):
        limit(plant)
    monkeypatch.setattr("replication.estimation.delay.general.observer.gain_bracket", singular)
    with pytest.raises(SolverError, match="rounding decides"):
        exact_gain(observer)
