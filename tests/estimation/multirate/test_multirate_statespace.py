"""Observers and error systems as `control.StateSpace`, against the recursions that they stand for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest
from multirate_examples import PAPER, problem

from replication.errors import InvalidInputError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import lifted_statespace, simulate
from replication.estimation.multirate.optimum import kalman_design
from replication.estimation.multirate.problem import observer_system
from tests.tolerances import GRID, ROUNDING

DRIVEN = problem(replace(PAPER, B_u=np.array([[1.0, 0], [0, 2], [1, 1]])), (2, 3), (0, 1))


def test_plant_minus_observer_is_the_error_system() -> None:
    """u moves plant and observer alike, and what is left is driven by d and w as the error system says."""
    rng, plant, T = np.random.default_rng(8), DRIVEN.plant, 60
    gains = kalman_design(DRIVEN).gains
    u, d, w = rng.normal(size=(T, 2)), rng.normal(size=(T, 1)), rng.normal(size=(T, 2))
    x, states = np.zeros(3), []
    for k in range(T):
        states.append(x)
        x = plant.A @ x + plant.B_u @ u[k] + plant.B_d @ d[k]
    measured = np.array(states) @ plant.C.T + w @ plant.D.T
    measured[~DRIVEN.schedule.mask[np.arange(T) % 6]] = 1e3  # what is not measured must not matter
    estimates = simulate(observer_system(DRIVEN, gains), np.hstack([u, measured]))
    errors = np.zeros((T, 3))
    e = np.zeros(3)
    for k in range(T):
        errors[k] = plant.W @ e
        rows = list(DRIVEN.schedule.measured(k))
        L = gains[k % 6][:, rows]
        e = (plant.A - L @ plant.C[rows]) @ e + plant.B_d @ d[k] - L @ plant.D[rows] @ w[k]
    np.testing.assert_allclose(np.array(states) @ plant.W.T - estimates, errors, atol=1e-8)


def test_the_lifted_observer_gives_the_same_estimates_period_by_period() -> None:
    rng = np.random.default_rng(9)
    observer = observer_system(DRIVEN, kalman_design(DRIVEN).gains)
    lifted = lifted_statespace(observer, dt=0.5)
    assert isinstance(lifted, control.StateSpace)
    assert lifted.dt == 3.0
    assert (lifted.nstates, lifted.ninputs, lifted.noutputs) == (3, 6 * 4, 6 * 3)
    inputs = rng.normal(size=(60, 4))
    response = control.forced_response(lifted, inputs=inputs.reshape(10, 24).T)
    np.testing.assert_allclose(response.outputs.T.reshape(60, 3), simulate(observer, inputs), atol=ROUNDING)


def test_the_norm_of_the_lifted_error_system_is_the_gain() -> None:
    system = DRIVEN.error_system(kalman_design(DRIVEN).gains)
    lifted = lifted_statespace(system)
    gain = l2_gain(system)
    response = lifted(np.exp(1j * gain.angle))
    assert np.linalg.norm(response, 2) == pytest.approx(gain.value, rel=ROUNDING)
    grid = max(np.linalg.norm(lifted(np.exp(1j * t)), 2) for t in np.linspace(0, np.pi, 400))
    assert grid <= gain.upper * (1 + GRID)


def test_what_does_not_fit_is_named() -> None:
    not_a_problem: Any = PAPER
    with pytest.raises(InvalidInputError, match="problem must be a MultirateProblem"):
        observer_system(not_a_problem, np.zeros((6, 3, 2)))
    with pytest.raises(InvalidInputError, match="gains must have shape"):
        observer_system(DRIVEN, np.zeros((5, 3, 2)))
    with pytest.raises(InvalidInputError, match="dt must be positive"):
        lifted_statespace(observer_system(DRIVEN, np.zeros((6, 3, 2))), dt=0)
