"""LMI (3): printed form, Z eliminated and Riccati agree with the exact anchors; the companion form misleads."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from replication.errors import InvalidInputError, ReplicationError
from replication.estimation.delay import DelayPlant
from replication.estimation.delay import models as lmi
from replication.estimation.delay.models import (
    Model,
    chebyshev_model,
    lmi_gain,
    lossless_delay,
    pade_model,
    riccati_gain,
)
from replication.estimation.delay.observer import ErrorSystem, hinf_norm
from replication.estimation.delay.spectrum import hinf_gain
from tests.estimation.delay.plants import blind_pair, blind_two_delays, one_delay, scalar, unstable_pair

SEVEN_DIGITS = 1e-7


def anchors() -> list[object]:
    return [
        (unstable_pair(), 1 / np.sqrt(18)),
        (blind_pair(), hinf_gain(scalar([-1.0], [1.0])).upper),
        pytest.param(blind_two_delays(), hinf_gain(scalar([-0.5, -0.5], [0.5, 1.0])).upper, marks=pytest.mark.slow),
    ]


@pytest.mark.parametrize(("system", "exact"), anchors())
def test_anchors(system: object, exact: float) -> None:
    pade, chebyshev = pade_model(system, 10), chebyshev_model(system, 10)  # type: ignore[arg-type]
    assert lmi_gain(pade).gamma == pytest.approx(exact, rel=SEVEN_DIGITS)
    assert riccati_gain(pade) == pytest.approx(exact, rel=SEVEN_DIGITS)
    assert riccati_gain(chebyshev) == pytest.approx(exact, rel=SEVEN_DIGITS)


def test_elimination_does_not_change_the_level() -> None:
    model = pade_model(one_delay(), 4)
    assert lmi_gain(model).gamma == pytest.approx(lmi_gain(model, eliminate=False).gamma, rel=1e-6)
    assert lmi_gain(model).gamma == pytest.approx(riccati_gain(model), rel=1e-6)


def in_companion_form(system: DelayPlant, order: int) -> Model:
    """The Padé model of a plant with one delay, the states of the delay in companion coordinates."""
    model, section = pade_model(system, order), lossless_delay(order, system.delays[0])
    powers = [np.linalg.matrix_power(section.a, k) @ section.b for k in range(order)]
    channels = (len(model.a) - system.states) // order
    back = scipy.linalg.block_diag(np.eye(system.states), np.kron(np.eye(channels), np.hstack(powers)))
    change = np.linalg.inv(back)
    return Model(change @ model.a @ back, change @ model.b, model.c1 @ back, model.c2 @ back)


def test_companion_form_misleads() -> None:
    """The same plant in other coordinates: the program is never accepted as solved at the right level."""
    exact = 1 / np.sqrt(18)
    for order in (4, 6, 10):
        try:
            gamma = lmi_gain(in_companion_form(unstable_pair(), order), tolerance=1e-8).gamma
        except ReplicationError:
            continue
        assert abs(gamma / exact - 1) > 1e-3


def test_gain_of_the_printed_form_stabilises() -> None:
    model = pade_model(one_delay(), 3)
    result = lmi_gain(model, eliminate=False, tolerance=1e-7)
    assert result.gain is not None
    error = model.a + result.gain @ model.c2
    assert np.linalg.eigvals(error).real.max() < 0
    assert hinf_norm(ErrorSystem(error, -model.b, model.c1)).lower <= result.gamma * (1 + 1e-5)


def test_undetectable_model() -> None:
    model = Model(np.diag([1.0, -1.0]), np.eye(2), np.eye(2), np.array([[0.0, 1.0]]))
    for solve in (lmi_gain, riccati_gain):
        with pytest.raises(InvalidInputError, match="not detectable"):
            solve(model)


def test_singular_filter_problem_is_refused_by_the_riccati_route() -> None:
    model = Model(np.array([[-1.0, 1], [0, -1]]), np.array([[1.0], [0]]), np.eye(2), np.array([[0.0, 1.0]]))
    with pytest.raises(InvalidInputError, match="C_2 B"):
        riccati_gain(model)


def test_optimum_of_zero() -> None:
    """y shows w, or all states, or z does not depend on what is hidden: no level is too low."""
    a, eye = np.array([[-1.0, 0.5], [0.3, -2.0]]), np.eye(2)
    for b, c1, c2 in (([[1.0], [1.0]], eye, [[1.0, 0.0]]), (eye, eye, eye), (eye, [[0.0, 3.0]], [[0.0, 1.0]])):
        assert riccati_gain(Model(a, np.array(b), np.array(c1), np.array(c2))) == 0.0


def test_a_negative_solution_of_the_equation_is_none() -> None:
    """Y^2 + 4 Y + 1 = 0 has a stabilising solution, and it is negative; with -4 Y both are positive."""
    one, zero = np.eye(1), np.zeros((1, 1))
    assert not lmi._solvable(2.0 * one, one, one, zero, 1.0)
    assert lmi._solvable(-2.0 * one, one, one, zero, 1.0)
