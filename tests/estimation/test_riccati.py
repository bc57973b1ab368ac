"""Riccati maps: composition, doubling and change of the reference."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from replication.estimation.linear.riccati import (
    RiccatiMap,
    apply,
    circle_angles,
    compose,
    fixed_point,
    period_map,
    recentre,
    settled,
    stacked,
)
from replication.estimation.validation import Array
from tests.tolerances import ROUNDING


def random_map(rng: np.random.Generator, n: int) -> RiccatiMap:
    C, B = rng.normal(size=(2, n)), rng.normal(size=(n, 2))
    return RiccatiMap(rng.normal(size=(n, n)), C.T @ C, B @ B.T)


def states_along(stages: list[RiccatiMap], X: Array) -> list[Array]:
    """One stage after the other, X first: slow, and nothing that can go wrong."""
    states = [X]
    for stage in stages[:-1]:
        states.append(apply(stage, states[-1]))
    return states


def random_state(rng: np.random.Generator, n: int) -> Array:
    root = rng.normal(size=(n, n))
    return root @ root.T


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 7))
def test_the_period_map_is_the_stages_one_after_the_other(seed: int, n: int, N: int) -> None:
    rng = np.random.default_rng(seed)
    stages, X = [random_map(rng, n) for _ in range(N)], random_state(rng, n)
    stepwise = X
    for stage in stages:
        stepwise = apply(stage, stepwise)
    np.testing.assert_allclose(
        apply(period_map(stacked(stages)), X), stepwise, rtol=0, atol=1e-9 * np.linalg.norm(stepwise)
    )


def test_composition_of_stacks_is_composition_one_by_one() -> None:
    rng = np.random.default_rng(0)
    first, second = ([random_map(rng, 3) for _ in range(4)] for _ in range(2))
    all_at_once = compose(stacked(first), stacked(second))
    for i in range(4):
        for together, alone in zip(all_at_once, compose(first[i], second[i]), strict=True):
            np.testing.assert_allclose(together[i], alone, rtol=ROUNDING, atol=ROUNDING)


def test_the_fixed_point_is_that_of_the_algebraic_riccati_equation() -> None:
    rng = np.random.default_rng(1)
    for n in range(1, 6):
        A, C, B = 1.3 * rng.normal(size=(n, n)), rng.normal(size=(2, n)), rng.normal(size=(n, n))
        X = fixed_point(stacked([RiccatiMap(A, C.T @ C, B @ B.T)]))
        assert X is not None
        np.testing.assert_allclose(X, scipy.linalg.solve_discrete_are(A.T, C.T, B @ B.T, np.eye(2)), rtol=1e-9)


def test_the_fixed_point_returns_after_one_period() -> None:
    rng = np.random.default_rng(2)
    stages = [random_map(rng, 4) for _ in range(5)]
    X = fixed_point(stacked(stages))
    assert X is not None
    last = states_along(stages, X)[-1]
    np.testing.assert_allclose(apply(stages[-1], last), X, rtol=0, atol=ROUNDING * np.linalg.norm(X))


@pytest.mark.parametrize("N", [1, 2, 3, 4, 5, 7, 8, 13])
def test_the_settled_states_are_those_of_one_stage_after_the_other(N: int) -> None:
    rng = np.random.default_rng(N)
    stages = [random_map(rng, 3) for _ in range(N)]
    found, start = settled(stacked(stages)), fixed_point(stacked(stages))
    assert found is not None and start is not None
    for together, alone in zip(found, states_along(stages, start), strict=True):
        np.testing.assert_allclose(together, alone, rtol=0, atol=1e-9 * np.linalg.norm(alone))


def test_a_recursion_without_limit_has_no_fixed_point() -> None:
    one = np.eye(1)
    assert settled(stacked([RiccatiMap(2 * one, 0 * one, one)])) is None
    # The first composition of this one is singular: the recursion escapes to infinity.
    assert settled(stacked([RiccatiMap(one, -one, one)] * 2)) is None


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 5))
def test_the_reference_changes_the_coordinates_only(seed: int, n: int, N: int) -> None:
    rng = np.random.default_rng(seed)
    stages, reference = [random_map(rng, n) for _ in range(N)], [random_state(rng, n) for _ in range(N)]
    X = random_state(rng, n)
    moved = [RiccatiMap(*parts) for parts in zip(*recentre(stacked(stages), np.stack(reference)), strict=True)]
    for k, (direct, deviation) in enumerate(
        zip(states_along(stages, X), states_along(moved, X - reference[0]), strict=True)
    ):
        size = np.linalg.norm(direct) + np.linalg.norm(reference[k])
        np.testing.assert_allclose(deviation + reference[k], direct, rtol=0, atol=1e-8 * size)


def test_an_undisturbed_unstable_mode_is_found_from_a_reference_and_not_from_zero() -> None:
    stage = RiccatiMap(np.array([[2.0]]), np.array([[1.0]]), np.zeros((1, 1)))
    assert fixed_point(stacked([stage])) == pytest.approx(0.0)
    deviation = fixed_point(recentre(stacked([stage]), np.ones((1, 1, 1))))
    assert deviation is not None
    # X = 4 X / (1 + X) has the solutions 0 and 3; 3 is the stabilising one.
    assert 1 + deviation[0, 0] == pytest.approx(3.0, rel=ROUNDING)


def test_circle_angles_are_the_crossings_of_a_level_whatever_the_reference() -> None:
    """1 / (z - a) has modulus g where 1 + a^2 - 2 a cos t = 1 / g^2; here by the map of the bounded real lemma."""
    a, g, one = 0.8, 2.0, np.eye(1)
    stages = stacked([RiccatiMap(a * one, -one / g**2, one)])
    crossing = np.arccos((1 + a**2 - 1 / g**2) / (2 * a))
    for reference in (0.0, 0.3, 5.0):
        angles = circle_angles(recentre(stages, reference * one[None]), 1e-7)
        np.testing.assert_allclose(angles, [crossing, crossing], rtol=ROUNDING)
