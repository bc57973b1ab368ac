"""Padé in lossless form, Chebyshev collocation."""

from __future__ import annotations

import control
import numpy as np
import pytest

from papers.peet2019.method import chebyshev_model, lmi_gain, pade_model, riccati_gain, without_noise
from replication.errors import InvalidInputError
from replication.estimation.delay.exact.central import FilterModel
from replication.estimation.delay.spectrum import Scheme, grid
from replication.estimation.validation import Array
from tests.estimation.delay.plants import ANCHORS, frequency_response, one_delay, scalar, tanks, two_delays

OMEGA = np.array([0.1, 1.0, 4.0])


def response(model: FilterModel, omega: float) -> Array:
    return np.asarray(model.cz @ np.linalg.solve(1j * omega * np.eye(len(model.a)) - model.a, model.b))


@pytest.mark.parametrize("order", [1, 2, 3, 4, 7, 10])
def test_it_is_the_approximant_of_python_control(order: int) -> None:
    numerator, denominator = control.pade(0.7, order)
    model = pade_model(scalar([-1.0], [0.7]), order)
    for omega in OMEGA:
        delayed = np.polyval(numerator, 1j * omega) / np.polyval(denominator, 1j * omega)
        assert response(model, omega)[0, 0] == pytest.approx(1 / (1j * omega + delayed), rel=1e-9)


@pytest.mark.parametrize("order", [1, 2, 5, 10, 30])
def test_lossless(order: int) -> None:
    part = pade_model(scalar([-1.0], [0.4]), order)
    late, enters = part.a[1:, 1:], part.a[1:, 0]
    assert np.abs(0.4 * (late + late.T) + np.outer(0.4 * enters, 0.4 * enters)).max() < 1e-11 * np.abs(late).max()
    system, model = tanks(), pade_model(tanks(), order)
    still = -(system.c10 + system.c1[0]) @ np.linalg.solve(system.a0 + system.a[0], system.b)
    assert response(model, 0.0) == pytest.approx(still, rel=1e-9)


@pytest.mark.parametrize("build", [pade_model, chebyshev_model])
def test_models_approach_the_exact_response(build: object) -> None:
    for system in (scalar([-1.0], [1.0]), one_delay(), two_delays()):
        model = build(system, 14)  # type: ignore[operator]
        for omega in OMEGA:
            assert np.abs(response(model, omega) - frequency_response(system, omega)[0]).max() < 1e-9


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
        pade_model(scalar([-1.0], [1.0]), order)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="order"):
        chebyshev_model(scalar([-1.0], [1.0]), order)  # type: ignore[arg-type]


# LMI (3) and the Riccati equation agree with the exact anchors


SEVEN_DIGITS = 1e-7


@pytest.mark.parametrize(("system", "exact"), ANCHORS)
def test_anchors(system: object, exact: float) -> None:
    pade, chebyshev = pade_model(system, 10), chebyshev_model(system, 10)  # type: ignore[arg-type]
    assert lmi_gain(pade).gamma == pytest.approx(exact, rel=SEVEN_DIGITS)
    assert riccati_gain(pade) == pytest.approx(exact, rel=SEVEN_DIGITS)
    assert riccati_gain(chebyshev) == pytest.approx(exact, rel=SEVEN_DIGITS)


def test_the_program_agrees_with_the_riccati_equation() -> None:
    model = pade_model(one_delay(), 4)
    assert lmi_gain(model).gamma == pytest.approx(riccati_gain(model), rel=1e-6)


def test_undetectable_model() -> None:
    model = without_noise(np.diag([1.0, -1.0]), np.eye(2), np.eye(2), np.array([[0.0, 1.0]]))
    for solve in (lmi_gain, riccati_gain):
        with pytest.raises(InvalidInputError, match="not detectable"):
            solve(model)


def test_optimum_of_zero() -> None:
    """y shows w, or all states, or z does not depend on what is hidden: no level is too low."""
    a, eye = np.array([[-1.0, 0.5], [0.3, -2.0]]), np.eye(2)
    for b, c1, c2 in (([[1.0], [1.0]], eye, [[1.0, 0.0]]), (eye, eye, eye), (eye, [[0.0, 3.0]], [[0.0, 1.0]])):
        assert riccati_gain(without_noise(a, np.array(b), np.array(c1), np.array(c2))) == 0.0
