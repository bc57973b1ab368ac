"""Exact induced norms against closed forms, brute-force grids and the truncated operator."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from papers.okajima2023.method.lmi import cyclic
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.linear.norms import balanced, compressed, hinf_norm, l2_gain, spectral_norm
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response
from tests.tolerances import AGREEMENT, GRID, NORM_BRACKET, ROUNDING


def stable_system(seed: int, n: int, N: int, *, radius: float = 0.95) -> PeriodicSystem:
    rng = np.random.default_rng(seed)
    stages = []
    for _ in range(N):
        m, p = rng.integers(1, 4, 2)
        stages.append([rng.normal(size=(n, n)), *(rng.normal(size=s) for s in ((n, m), (p, n), (p, m)))])
    factor = (radius / PeriodicSystem(tuple(Stage(*s) for s in stages)).spectral_radius()) ** (1 / N)
    return PeriodicSystem(tuple(Stage(factor * A, B, C, D) for A, B, C, D in stages))


def on_grid(system: PeriodicSystem, points: int = 2000) -> float:
    lifted = system.lift()
    return max(np.linalg.norm(frequency_response(lifted, t), 2) for t in np.linspace(0, np.pi, points))


@pytest.mark.parametrize("a", [0.0, 0.5, -0.9, 0.999, 1 - 1e-6])
def test_first_order_lag(a: float) -> None:
    norm = hinf_norm([[a]], [[2.0]], [[3.0]], [[0.0]])
    assert norm.value == pytest.approx(6 / (1 - abs(a)), rel=AGREEMENT)
    assert norm.angle == pytest.approx(0 if a >= 0 else np.pi)


def test_lightly_damped_pair() -> None:
    r, t = 1 - 1e-5, 1.1
    A = r * np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
    norm = hinf_norm(A, [[0], [1]], [[1, 0]], [[0]])
    angles = t + np.linspace(-1e-4, 1e-4, 20001)
    brute = max(abs(frequency_response(Stage(A, np.eye(2)[:, 1:], np.eye(2)[:1], np.zeros((1, 1))), s)) for s in angles)
    assert norm.lower <= norm.upper
    assert norm.value == pytest.approx(float(brute[0, 0]), rel=GRID)
    assert norm.upper >= brute[0, 0] * (1 - ROUNDING)


def test_all_pass_system_has_a_flat_response() -> None:
    a = 0.7
    norm = hinf_norm([[a]], [[1 - a**2]], [[1.0]], [[-a]])
    assert norm.value == pytest.approx(1.0, rel=ROUNDING)
    assert norm.upper == pytest.approx(1.0, rel=GRID)


def test_static_system() -> None:
    assert hinf_norm([[0.0]], [[0.0]], [[0.0]], [[3.0]]).value == pytest.approx(3.0)


def test_gain_zero() -> None:
    assert hinf_norm([[0.5]], [[0.0]], [[1.0]], [[0.0]]).upper == 0.0
    assert hinf_norm([[0.5]], np.zeros((1, 0)), [[1.0]], np.zeros((1, 0))).upper == 0.0


def test_peak_at_a_zero_of_the_first_samples() -> None:
    """The response e^{-jt} - e^{-3jt} vanishes at 0 and pi, where the search starts."""
    A = np.eye(3, k=1)
    assert hinf_norm(A, [[0], [0], [1]], [[-1, 0, 1]], [[0]]).value == pytest.approx(2.0, rel=NORM_BRACKET)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 5))
def test_the_bracket_holds_a_brute_force_grid(seed: int, n: int, N: int) -> None:
    system = stable_system(seed, n, N)
    norm, grid = l2_gain(system), on_grid(system, 500)
    assert norm.lower <= norm.upper <= norm.lower * (1 + 1e-6)
    assert grid <= norm.upper * (1 + ROUNDING)
    attained = np.linalg.norm(frequency_response(system.lift(), norm.angle), 2)
    assert attained == pytest.approx(norm.lower, rel=AGREEMENT)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 5))
def test_lifted_and_cyclic_norms_agree(seed: int, n: int, N: int) -> None:
    system = stable_system(seed, n, N)
    assert hinf_norm(*cyclic(system)).value == pytest.approx(l2_gain(system).value, rel=AGREEMENT)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4))
def test_the_norm_is_free_of_the_units_of_the_states(seed: int, n: int, N: int) -> None:
    system, rng = stable_system(seed, n, N), np.random.default_rng(seed)
    units = 10.0 ** rng.uniform(-4, 4, n)
    other = PeriodicSystem(
        tuple(Stage(units[:, None] * A / units, units[:, None] * B, C / units, D) for A, B, C, D in system.stages)
    )
    assert l2_gain(other).value == pytest.approx(l2_gain(system).value, rel=AGREEMENT)


def test_the_norm_does_not_depend_on_the_first_phase() -> None:
    system = stable_system(5, 4, 5)
    shifted = PeriodicSystem(system.stages[2:] + system.stages[:2])
    assert l2_gain(shifted).value == pytest.approx(l2_gain(system).value, rel=AGREEMENT)


def test_balanced_and_compressed_systems_have_the_same_response() -> None:
    system = stable_system(6, 3, 4)
    lifted = system.lift()
    tall = Stage(lifted.A, lifted.B[:, :1], lifted.C, lifted.D[:, :1])
    assert len(compressed(tall).C) == 4 < len(tall.C)
    for angle in (0.0, 0.4, 3.0):
        response = frequency_response(tall, angle)
        gram = response.conj().T @ response
        turned = frequency_response(compressed(tall), angle)
        np.testing.assert_allclose(turned.conj().T @ turned, gram, rtol=ROUNDING)
        np.testing.assert_allclose(
            frequency_response(balanced(system).lift(), angle), frequency_response(lifted, angle), rtol=1e-8, atol=1e-9
        )


def test_spectral_norm_is_the_largest_singular_value() -> None:
    rng = np.random.default_rng(7)
    for shape in ((3, 5), (5, 3), (1, 1), (0, 3)):
        matrix = rng.normal(size=shape) + 1j * rng.normal(size=shape)
        expected = np.linalg.norm(matrix, 2) if matrix.size else 0.0
        assert spectral_norm(matrix) == pytest.approx(expected, rel=ROUNDING)


@pytest.mark.parametrize("a", [1.0, -1.0, 1.5])
def test_an_unstable_system_has_no_finite_gain(a: float) -> None:
    with pytest.raises(InfeasibleError, match="not stable"):
        hinf_norm([[a]], [[1.0]], [[1.0]], [[0.0]])


@pytest.mark.parametrize("bad", [[["a"]], [[1, 2]], [1.0], [[float("nan")]], [[1j]]])
def test_bad_matrices_are_named(bad: Any) -> None:
    with pytest.raises(InvalidInputError, match="A"):
        hinf_norm(bad, [[1.0]], [[1.0]], [[0.0]])
