"""The observer of a certificate: identities behind its gains, the closed loop, the Galerkin check, simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from papers.peet2019.method import chebyshev_model, riccati_gain
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.delay import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import Certificate, certificate_at
from replication.estimation.delay.sos.observer import ErrorSystem, error_system, hinf_norm, simulate
from replication.estimation.delay.sos.operators import (
    GainValues,
    check,
    evaluate,
    injection_operator,
    observer_gains,
    storage_operator,
)
from replication.estimation.delay.spectrum import Scheme
from tests.estimation.delay import algebra
from tests.estimation.delay.algebra import as_operator
from tests.estimation.delay.plants import one_delay, random_system, three_delays, two_delays, unstable_pair

MARGIN = 1e-4
"""The closed loop must achieve γ(1 + MARGIN)."""


def designed(system: DelayPlant, degree: int) -> tuple[Certificate, float]:
    """A certificate within MARGIN of the optimum, and the optimum."""
    best = riccati_gain(chebyshev_model(system, 12))
    return certificate_at(system, best * (1 + MARGIN), degree), best


@pytest.fixture(scope="module")
def near_optimal() -> Certificate:
    return designed(unstable_pair(), 3)[0]


@pytest.fixture(scope="module")
def moderate() -> Certificate:
    """A level at which the gains are smooth."""
    return certificate_at(two_delays(), 2.2, 2, epsilon=1e-2)


@pytest.mark.parametrize(
    ("system", "degree", "orders"),
    [
        (unstable_pair(), 3, (24, 32)),
        pytest.param(one_delay(), 2, (40, 52), marks=pytest.mark.slow),
        pytest.param(two_delays(), 2, (24, 30), marks=pytest.mark.slow),
        pytest.param(three_delays(), 2, (14, 20), marks=pytest.mark.slow),
    ],
)
def test_closed_loop_achieves_the_level(system: DelayPlant, degree: int, orders: tuple[int, int]) -> None:
    certificate, best = designed(system, degree)
    gains = observer_gains(certificate)
    norms = [hinf_norm(error_system(system, gains, order)).upper for order in orders]
    assert norms[1] <= certificate.gamma * (1 + MARGIN)
    assert norms[1] >= best * (1 - 1e-7)  # nothing beats the optimum
    assert norms[0] == pytest.approx(norms[1], rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_random_plants_ten_per_cent_above_the_optimum(seed: int) -> None:
    system = random_system(seed)
    best = riccati_gain(chebyshev_model(system, 14))
    certificate = certificate_at(system, 1.1 * best, 2)
    norm = hinf_norm(error_system(system, observer_gains(certificate), 40)).upper
    assert best * (1 - 1e-6) <= norm <= certificate.gamma
    result = check(certificate, 10)
    assert result.storage > 0 and result.dissipation < 0


def test_galerkin_check(near_optimal: Certificate) -> None:
    result = check(near_optimal, 12)
    assert result.storage > 0
    assert result.dissipation < 0


def test_galerkin_check_refutes_a_lower_level(near_optimal: Certificate) -> None:
    assert check(replace(near_optimal, gamma=0.9 * near_optimal.gamma), 12).dissipation > 0


def test_galerkin_check_refutes_a_damaged_injection(near_optimal: Certificate) -> None:
    assert check(replace(near_optimal, residual=0.5 * near_optimal.residual), 12).dissipation > 0


def test_gains_solve_p_l_equals_z(moderate: Certificate) -> None:
    """ℒ composed in the algebra from the projected inverse equals the formulas of Lemma 5, and 𝒫ℒ = 𝒵."""
    gains, count = observer_gains(moderate), 48
    injection = injection_operator(moderate)
    composed = algebra.compose(as_operator(gains.inverse, count), injection, count)
    back = algebra.compose(storage_operator(moderate), composed, count)
    scale = algebra.largest(injection)
    assert algebra.largest(algebra.add(back, algebra.scaled(injection, -1.0))) < 1e-8 * scale
    points = np.array([-1.0, -0.6, -0.1, 0.0])
    values = evaluate(gains, points)
    basis = legendre.evaluate(count, points)
    turn = np.linalg.inv(moderate.change)
    n, k = 2, 2
    point = (turn @ composed.point).reshape(n, k + 1, 1)
    assert np.abs(values.l0 - point[:, 0]).max() < 1e-7 * scale
    assert np.abs(values.l2 - np.moveaxis(point[:, 1:], 1, 0)).max() < 1e-7 * scale
    l3 = np.einsum("ij,jkqc,tc->tkiq", turn, composed.row, basis)
    l6 = np.einsum("ij,kjqc,tc->tkiq", turn, composed.multiplier, basis)
    l7 = np.einsum("ij,kjclqd,tc,ud->tkuliq", turn, composed.kernel, basis, basis)
    ends = np.einsum("ij,kjcp,tc->tkip", turn, composed.column, basis).reshape(4, k, n, k + 1, 1)
    assert np.abs(values.l3 - l3).max() < 1e-6 * scale
    assert np.abs(values.l4 - ends[..., 0, :]).max() < 1e-6 * scale
    assert np.abs(values.l5 - np.moveaxis(ends[..., 1:, :], 3, 2)).max() < 1e-6 * scale
    assert np.abs(values.l6 - l6).max() < 1e-6 * scale
    assert np.abs(values.l7 - l7).max() < 1e-6 * scale


def test_storage_operator_is_self_adjoint(moderate: Certificate) -> None:
    operator = storage_operator(moderate)
    assert algebra.largest(algebra.add(operator, algebra.scaled(algebra.adjoint(operator), -1.0))) == 0.0


def test_without_gains_the_error_is_the_plant() -> None:
    from replication.estimation.delay.sos.observer import assembled
    from replication.estimation.delay.spectrum import grid, rightmost_roots

    system, net = two_delays(), grid(18)
    m, k, n, q = net.points.size, 2, 2, 1
    silent = GainValues(
        np.zeros((n, q)),
        np.zeros((k, n, q)),
        np.zeros((m, k, n, q)),
        np.zeros((m, k, n, q)),
        np.zeros((m, k, k, n, q)),
        np.zeros((m, k, n, q)),
        np.zeros((m, k, m, k, n, q)),
    )
    values = np.linalg.eigvals(assembled(system, silent, net).a)
    assert values.real.max() == pytest.approx(rightmost_roots(system, 1)[0].real, abs=1e-8)


def test_lumped_scheme_approaches_the_collocation(moderate: Certificate) -> None:
    gains = observer_gains(moderate)
    exact = hinf_norm(error_system(two_delays(), gains, 24)).upper
    errors = [
        abs(hinf_norm(error_system(two_delays(), gains, order, Scheme.LUMPED)).upper / exact - 1) for order in (10, 40)
    ]
    assert errors[1] < errors[0] / 2
    assert errors[1] < 0.1


def scalar_error() -> ErrorSystem:
    return ErrorSystem(np.array([[-2.0]]), np.array([[1.0]]), np.array([[3.0]]))


def test_norm_of_a_first_order_lag() -> None:
    bracket = hinf_norm(scalar_error())
    assert bracket.lower == pytest.approx(1.5, rel=1e-10) and bracket.upper >= bracket.lower
    assert bracket.frequency == 0.0


def test_norm_of_a_resonance() -> None:
    damping = 0.05
    error = ErrorSystem(np.array([[0.0, 1], [-1, -2 * damping]]), np.array([[0.0], [1]]), np.array([[1.0, 0]]))
    assert hinf_norm(error).upper == pytest.approx(1 / (2 * damping * np.sqrt(1 - damping**2)), rel=1e-6)


def test_unstable_error_has_no_norm() -> None:
    with pytest.raises(InfeasibleError, match="unstable"):
        hinf_norm(ErrorSystem(np.eye(1), np.eye(1), np.eye(1)))


def test_simulation_of_a_ramp_is_exact() -> None:
    times = np.linspace(0, 2, 9)
    result = simulate(scalar_error(), times, times[:, None], 1)
    exact = (times / 2 - (1 - np.exp(-2 * times)) / 4) * 3
    assert np.abs(result.output[:, 0] - exact).max() < 1e-12


def test_simulated_gain_stays_below_the_norm(near_optimal: Certificate) -> None:
    error = error_system(unstable_pair(), observer_gains(near_optimal), 24)
    times = np.linspace(0, 30, 3001)
    disturbance = np.random.default_rng(4).standard_normal((3001, 2)).cumsum(axis=0)
    assert simulate(error, times, disturbance, 2).gain <= near_optimal.gamma * 1.001


@pytest.mark.parametrize(
    ("times", "disturbance", "message"),
    [
        (np.array([0.0, 1.0, 3.0]), np.ones((3, 1)), "equidistant"),
        (np.array([0.0]), np.ones((1, 1)), "at least two"),
        (np.array([0.0, 1.0]), np.ones((3, 1)), r"times must have shape \(3,\)"),
        (np.array([0.0, np.nan]), np.ones((2, 1)), "times must be finite"),
        (np.array([0.0, 1.0]), np.zeros((2, 1)), "must not vanish"),
    ],
)
def test_bad_simulations(times: np.ndarray, disturbance: np.ndarray, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        simulate(scalar_error(), times, disturbance, 1)
