"""Bounds between the points that were looked at, rank and inertia tests, units of programs."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest

from papers.peet2019.method import _IntervalBound, frequency_response, pade_model
from replication.errors import InvalidInputError, SolverError
from replication.estimation.delay import DelayPlant, delay_system, design
from replication.estimation.delay.exact.central import FilterModel
from replication.estimation.delay.exact.limit import _angle, _hamiltonian, filter_level
from replication.estimation.delay.exact.loop import error_response, plant_terms
from replication.estimation.delay.exact.response import Cells
from replication.estimation.delay.general.synthesis import _Program, require_noise
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import _found, certificate_at, minimum_gain
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.operators import check, generator
from replication.estimation.delay.spectrum import undetectable_root
from tests.estimation.delay.exact_cases import late, two_delays

EYE = np.eye(2)


def tanks(delay: float = 0.4) -> DelayPlant:
    return delay_system([[-1, 0.2], [0.5, -2]], [[[-0.3, 0], [0.5, 0.2]]], [delay], EYE, EYE, [[1, 0]], [0.3 * EYE])


@pytest.mark.parametrize("seed", range(5))
def test_the_bound_of_an_interval_is_above_the_gain_all_over_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, late_a, b, c, late_c = rng.normal(size=(5, 2, 2))
    system = delay_system(a, [late_a], [rng.uniform(0.2, 2.0)], b, c, [[1, 0]], [late_c])
    centers, halves = rng.uniform(0.0, 6.0, 200), 10.0 ** rng.uniform(-3, -0.5, 200)
    lower, upper = _IntervalBound(system)(centers, halves)
    inside = centers[:, None] + halves[:, None] * np.linspace(-1.0, 1.0, 21)
    gains = np.linalg.norm(frequency_response(system, inside.ravel()), 2, axis=(1, 2)).reshape(inside.shape)
    assert np.all(gains.max(axis=1) <= upper * (1 + 1e-12))
    assert np.all(lower <= gains.max(axis=1) * (1 + 1e-12))


@pytest.mark.parametrize("seed", range(3))
def test_the_bound_of_a_cell_is_above_the_gain_all_over_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plant = DelayPlant([[-0.1, 2], [-2, -0.1]], [0.7], EYE, [[1, 0]], [[0, 1]], a=[rng.normal(size=(2, 2)) / 3])
    plant = replace(plant, d21=[[0.1, 0.2]])
    response = error_response(plant_terms(plant), design(plant, degree=2).gains_of.terms)
    omega, half = rng.uniform(0.0, 5.0, 300), 10.0 ** rng.uniform(-3, 0, 300)
    delays = np.tile(response.loop.delays, (300, 1))
    _, above, _ = response.bounded(Cells(omega, half, delays, np.zeros_like(delays)))
    for center, width, bound in zip(omega, half, above, strict=True):
        assert response.gains(center + width * np.linspace(-1.0, 1.0, 15)).max() <= bound * (1 + 1e-12)


def test_an_integrator_that_y_does_not_see_is_found() -> None:
    root = undetectable_root(delay_system([[0, 0], [0, -1]], [np.zeros((2, 2))], [1.0], EYE, EYE, [[0, 1]]))
    assert root is not None
    assert abs(root) < 1e-9
    assert undetectable_root(delay_system([[-0.1, 0], [0, -1]], [np.zeros((2, 2))], [1.0], EYE, EYE, [[0, 1]])) is None


@pytest.mark.parametrize("order", [1, 2, 3])
def test_pades_approximant_of_any_order_passes_what_does_not_change(order: int) -> None:
    system, model = tanks(), pade_model(tanks(), order)
    still = -(system.c10 + system.c1[0]) @ np.linalg.solve(system.a0 + system.a[0], system.b)
    assert -model.c1 @ np.linalg.solve(model.a, model.b) == pytest.approx(still, rel=1e-12)


@pytest.mark.parametrize("size", [1e-3, 300.0])
def test_a_certificate_does_not_hang_on_the_unit_of_z(size: float) -> None:
    system = tanks()
    system = replace(system, c10=size * system.c10, c1=tuple(size * c for c in system.c1))
    level = 1.05 * minimum_gain(system, 1, DegreeRule.BESSEL).gamma
    found = check(certificate_at(system, level, 1))
    assert found.storage > 0
    assert found.dissipation <= 0


def test_the_least_gain_allows_for_what_the_point_misses() -> None:
    assembly = SimpleNamespace(system=tanks(), degree=1, rule=DegreeRule.BESSEL)
    report = SimpleNamespace(residuals={"gap": 0.0})
    solution = SimpleNamespace(objective=2.0, dual_objective=1.9, slip=0.25, report=report)
    assert _found(assembly, 1e-6, 4.0, solution).gamma == 4.0 * 2.25  # type: ignore[arg-type]


def test_histories_move_at_the_rate_of_their_delay() -> None:
    """phi' / tau of phi = p_2, by its Legendre coefficients."""
    count, delay = 4, 0.4
    matrix = generator(tanks(delay), count)[2 : 2 + count, 2 : 2 + count]
    second = np.eye(count)[2]
    assert matrix @ second == pytest.approx(legendre.derivative(count) @ second / delay)
    points = np.linspace(-0.9, -0.1, 5)
    slope = (legendre.evaluate(count, points + 1e-6) - legendre.evaluate(count, points - 1e-6)) @ second / 2e-6
    assert legendre.evaluate(count, points) @ (matrix @ second) == pytest.approx(slope / delay, rel=1e-6)


def model(seed: int, direct: float = 0.0) -> FilterModel:
    rng = np.random.default_rng(seed)
    a, b, cz, cy = (rng.standard_normal(shape) for shape in ((4, 4), (4, 3), (2, 4), (1, 4)))
    return FilterModel(a, b, cz, direct * np.eye(2, 3), cy, np.eye(3)[[2]])


def test_no_filter_has_a_level_below_what_passes_at_once() -> None:
    """D_z w of size 1, which y does not show: below it R has another inertia."""
    plant = model(0, direct=1.0)
    assert _hamiltonian(plant, 0.9) is None
    assert _hamiltonian(plant, 1.1) is not None
    assert _angle(plant, 0.9) == -1.0
    assert filter_level(plant).value >= 1.0


@pytest.mark.parametrize("seed", range(6))
def test_the_least_level_is_where_a_plain_bisection_finds_it(seed: int) -> None:
    plant = model(seed)
    found = filter_level(plant)
    assert _angle(plant, 0.98 * found.smoother) <= 0.0
    low, high = found.smoother, 1e3 * found.value
    while high > low * (1 + 1e-9):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if _angle(plant, middle) > 0.0 else (middle, high)
    assert found.value == pytest.approx(high, rel=1e-7)


def test_eigenvalues_on_the_axis_have_no_stabilising_solution() -> None:
    plant = model(0)
    assert _angle(plant, 0.98 * filter_level(plant).smoother) == -1.0


def test_more_measurements_than_disturbances_have_no_noise_of_their_own() -> None:
    plant = DelayPlant([[-1.0]], [1.0], [[1.0]], [[1.0]], [[1.0], [2.0]], d21=[[1.0], [1.0]])
    with pytest.raises(InvalidInputError, match="high frequencies"):
        require_noise(plant)


def test_a_proof_within_rounding_is_none() -> None:
    plant, proved = late(0.0, 1.0, 1.0), _Program.proved

    def hardly(*given):  # type: ignore[no-untyped-def]
        return replace(proved(*given), slack=1e-16, rounding=1e-15)

    level = 1.2 * float(design(plant).fact("least level").value)
    with patch.object(_Program, "proved", hardly), pytest.raises(SolverError, match="rounding"):
        design(plant, level=level)


@pytest.mark.parametrize("scale", [1e-3, 3600.0])
def test_gains_in_another_unit_of_time(scale: float) -> None:
    plant = two_delays()
    slow = replace(
        plant,
        a0=plant.a0 / scale,
        a=tuple(a / scale for a in plant.a),
        b=plant.b / scale,
        delays=tuple(delay * scale for delay in plant.delays),
        ranges=(),
    )
    own, other = design(plant, degree=3), design(slow, degree=3)
    assert other.value == pytest.approx(own.value, rel=1e-4)
    assert other.bracket.lower == pytest.approx(own.bracket.lower, rel=1e-2)
    assert other.gains["L0"] * scale == pytest.approx(own.gains["L0"], rel=0.2)
