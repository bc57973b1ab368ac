"""Periodic systems: lifted and cyclic forms against the recursion itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from papers.okajima2023.method.lmi import cyclic
from replication.errors import InvalidInputError
from replication.estimation.linear.periodic import PeriodicSystem, Stage, block_diagonal, frequency_response, simulate
from tests.tolerances import ROUNDING


def varying_system(seed: int, n: int = 3, N: int = 4) -> PeriodicSystem:
    """Stages with different numbers of inputs and outputs, none among them."""
    rng = np.random.default_rng(seed)
    sizes = [(k % 3, (k + 1) % 3) for k in range(N)]
    return PeriodicSystem(
        tuple(
            Stage(
                rng.normal(size=(n, n)) / n, rng.normal(size=(n, m)), rng.normal(size=(p, n)), rng.normal(size=(p, m))
            )
            for m, p in sizes
        )
    )


def test_the_lifted_system_is_the_recursion_over_one_period() -> None:
    system, rng = varying_system(1), np.random.default_rng(2)
    lifted = system.lift()
    x = start = rng.normal(size=3)
    inputs, outputs = [], []
    for stage in system.stages:
        v = rng.normal(size=stage.B.shape[1])
        inputs.append(v)
        outputs.append(stage.C @ x + stage.D @ v)
        x = stage.A @ x + stage.B @ v
    v = np.concatenate(inputs)
    np.testing.assert_allclose(lifted.A @ start + lifted.B @ v, x, rtol=ROUNDING)
    np.testing.assert_allclose(lifted.C @ start + lifted.D @ v, np.concatenate(outputs), rtol=ROUNDING)
    np.testing.assert_allclose(lifted.A, system.monodromy(), rtol=ROUNDING)


def test_the_cyclic_system_moves_one_state_copy_per_phase() -> None:
    system = varying_system(3)
    turned, n, N = cyclic(system), system.order, system.period
    power = np.linalg.matrix_power(turned.A, N)
    np.testing.assert_allclose(power[:n, :n], system.monodromy(), rtol=ROUNDING)
    # Its eigenvalues are all N-th roots of the characteristic multipliers.
    roots = np.linalg.eigvals(turned.A) ** N
    multipliers = np.linalg.eigvals(system.monodromy())
    for multiplier in multipliers:
        assert np.sum(np.abs(roots - multiplier) < 1e-8) == N


def test_the_frequency_response_solves_its_equation() -> None:
    stage = varying_system(4).lift()
    z = np.exp(0.7j)
    impulse = [stage.D] + [stage.C @ np.linalg.matrix_power(stage.A, k) @ stage.B for k in range(300)]
    series = sum(h * z**-k for k, h in enumerate(impulse))
    np.testing.assert_allclose(frequency_response(stage, 0.7), series, atol=1e-9)


def test_blocks_without_rows_or_columns_keep_their_place() -> None:
    total = block_diagonal([np.ones((1, 0)), np.ones((0, 2)), np.ones((1, 1))])
    np.testing.assert_array_equal(total, [[0, 0, 0], [0, 0, 1]])


ONE = np.eye(1)


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        ((), "at least one stage"),
        (((ONE, ONE, ONE),), "four matrices"),
        ((7,), "four matrices"),
        (((np.zeros((0, 0)), ONE, ONE, ONE),), "at least one state"),
        (((np.ones((2, 1)), ONE, ONE, ONE),), "A_0 must have 2 columns"),
        (((ONE, np.ones((2, 1)), ONE, ONE),), "B_0 must have 1 rows"),
        (((ONE, ONE, np.ones((1, 2)), ONE),), "C_0 must have 1 columns"),
        (((ONE, ONE, ONE, np.ones((2, 1))),), "D_0 must have 1 rows"),
        (((ONE, ONE, ONE, ONE), (np.eye(2), ONE, ONE, ONE)), "A_1 must have 1 rows"),
        (((ONE, ONE, ONE, ONE * np.nan),), "D_0 must be finite"),
    ],
)
def test_stages_that_do_not_fit_are_named(stages: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        PeriodicSystem(stages)


def test_a_simulation_of_one_period_is_the_lifted_system() -> None:
    rng = np.random.default_rng(7)
    system = PeriodicSystem(
        tuple(Stage(*(rng.normal(size=shape) for shape in ((2, 2), (2, 3), (1, 2), (1, 3)))) for _ in range(4))
    )
    inputs, start, lifted = rng.normal(size=(4, 3)), rng.normal(size=2), system.lift()
    expected = lifted.C @ start + lifted.D @ inputs.ravel()
    assert np.abs(simulate(system, inputs, start).ravel() - expected).max() < ROUNDING * np.abs(expected).max()
