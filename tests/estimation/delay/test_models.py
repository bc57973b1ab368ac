"""Padé in lossless form, Chebyshev collocation."""

from __future__ import annotations

import control
import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay.models import (
    AllPass,
    chebyshev_model,
    lossless_delay,
    pade_model,
)
from replication.estimation.delay.spectrum import Scheme, frequency_response, grid
from tests.estimation.delay.plants import one_delay, scalar, two_delays

OMEGA = np.array([0.1, 1.0, 4.0])


def response(part: AllPass, s: complex) -> complex:
    inner = np.linalg.solve(s * np.eye(part.a.shape[0]) - part.a, part.b)
    return complex((part.c @ inner)[0, 0] + part.d)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7, 10])
def test_it_is_the_approximant_of_python_control(order: int) -> None:
    numerator, denominator = control.pade(0.7, order)
    part = lossless_delay(order, 0.7)
    for omega in OMEGA:
        expected = np.polyval(numerator, 1j * omega) / np.polyval(denominator, 1j * omega)
        assert response(part, 1j * omega) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("order", [1, 2, 5, 10, 30])
def test_lossless(order: int) -> None:
    part = lossless_delay(order, 0.4)
    assert np.abs(part.a + part.a.T + part.b @ part.b.T).max() < 1e-12 * np.abs(part.a).max()
    assert np.array_equal(part.c, -part.d * part.b.T)
    assert abs(response(part, 37j)) == pytest.approx(1.0, abs=1e-12)


def test_high_order_is_the_delay() -> None:
    assert response(lossless_delay(30, 1.0), 5j) == pytest.approx(np.exp(-5j), abs=1e-12)


@pytest.mark.parametrize("build", [pade_model, chebyshev_model])
def test_models_approach_the_exact_response(build: object) -> None:
    for system in (scalar([-1.0], [1.0]), one_delay(), two_delays()):
        model = build(system, 14)  # type: ignore[operator]
        for omega in OMEGA:
            inner = np.linalg.solve(1j * omega * np.eye(model.a.shape[0]) - model.a, model.b)
            assert np.abs(model.c1 @ inner - frequency_response(system, float(omega))[0]).max() < 1e-9


def test_only_the_row_space_is_delayed() -> None:
    assert pade_model(two_delays(), 5).a.shape[0] == 2 + 2 * 5 * 2
    assert pade_model(scalar([-1.0, 0.0], [0.5, 1.0]), 5).a.shape[0] == 1 + 5


def test_grids_differentiate_and_integrate() -> None:
    net = grid(12)
    assert net.points[0] == 0.0 and net.points[-1] == -1.0
    assert np.abs(net.slope @ np.exp(net.points) - np.exp(net.points)).max() < 1e-10
    assert net.weights @ np.exp(net.points) == pytest.approx(1 - np.exp(-1), abs=1e-13)
    lumped = grid(200, Scheme.LUMPED)
    assert lumped.weights @ np.exp(lumped.points) == pytest.approx(1 - np.exp(-1), abs=5e-3)
    assert (lumped.slope @ np.exp(lumped.points))[1:] == pytest.approx(np.exp(lumped.points[1:]), abs=5e-3)


@pytest.mark.parametrize("order", [0, -2, 1.5])
def test_bad_orders(order: float) -> None:
    with pytest.raises(InvalidInputError, match="order"):
        lossless_delay(order, 1.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="order"):
        chebyshev_model(scalar([-1.0], [1.0]), order)  # type: ignore[arg-type]
