"""Observers of certificates in the closed loop: levels that are kept, grids, norms and simulations of the error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from papers.peet2019.method import chebyshev_model, riccati_gain
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay import DegreeRule, DelayPlant
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.sos.observer import assembled, error_system, simulate
from replication.estimation.delay.sos.operators import GainValues, check, observer_gains
from replication.estimation.delay.spectrum import Scheme, grid, rightmost_roots
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


def test_without_gains_the_error_is_the_plant() -> None:
    system, net = two_delays(), grid(18)
    m, k, n, q = net.points.size, 2, 2, 1
    shapes = ((), (k,), (m, k), (m, k), (m, k, k), (m, k), (m, k, m, k))
    silent = GainValues(*(np.zeros((*shape, n, q)) for shape in shapes))
    values = np.linalg.eigvals(assembled(system, silent, net).A)
    assert values.real.max() == pytest.approx(rightmost_roots(system, 1)[0].real, abs=1e-8)


def test_lumped_scheme_approaches_the_collocation() -> None:
    gains = observer_gains(certificate_at(two_delays(), 2.2, 2, epsilon=1e-2))
    exact = continuous_norm(*error_system(two_delays(), gains, 24)).upper
    errors = [
        abs(continuous_norm(*error_system(two_delays(), gains, order, Scheme.LUMPED)).upper / exact - 1)
        for order in (10, 40)
    ]
    assert errors[1] < errors[0] / 2
    assert errors[1] < 0.1
    with pytest.raises(InvalidInputError, match="order"):
        error_system(two_delays(), gains, 0)


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
