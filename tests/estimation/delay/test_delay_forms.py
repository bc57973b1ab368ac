"""The cones and the derivative of their forms against quadrature of their definitions on random histories."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from papers.peet2019.experiments.scaling import lifted
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system
from replication.estimation.delay.sos import cone as bessel
from replication.estimation.delay.sos import legendre, lie
from replication.estimation.delay.sos.cone import (
    FormSpace,
    cone_blocks,
    cone_map,
    required_count,
    triangle,
    triangle_index,
)
from replication.estimation.delay.sos.lie import by_rates, direct
from replication.estimation.validation import Array
from tests.estimation.delay.plants import random_system, three_delays, two_delays

AGREE, ROUNDING = 1e-10, 1e-11


def monomials(space: FormSpace, x: Array, histories: Array) -> Array:
    """Values of all monomials for point variables x and histories (functions, count) in Legendre coefficients."""
    moments = np.zeros((space.functions, space.count))
    kept = min(space.count, histories.shape[1])
    moments[:, :kept] = histories[:, :kept]
    functionals = np.concatenate([x, moments.T.ravel()])
    first, second = triangle(space.functionals)
    nodes, weights = legendre.gauss(histories.shape[1] + space.count)
    values = legendre.evaluate(histories.shape[1], nodes) @ histories.T
    degree, left, right = space.multiplier_functions()
    basis = legendre.evaluate(space.count, nodes)
    multiplier = np.einsum("t,tk,tk,tk->k", weights, basis[:, degree], values[:, left], values[:, right])
    return np.concatenate([functionals[first] * functionals[second], multiplier])


def test_triangle_index_inverts_triangle() -> None:
    first, second = triangle(5)
    assert np.array_equal(triangle_index(5, second, first), np.arange(15))


@pytest.mark.parametrize("rule", [rule for rule in DegreeRule if rule is not DegreeRule.BESSEL])
@pytest.mark.parametrize("weighted", [False, True])
def test_cone_is_the_integral_of_its_definition(rule: DegreeRule, weighted: bool) -> None:
    rng = np.random.default_rng(3)
    block = cone_blocks(2, rule)[int(weighted)]
    space = FormSpace(2, 2, 2, required_count(2, rule))
    size = block.size(space)
    root = rng.standard_normal((size, size))
    m = root @ root.T
    x, histories = rng.standard_normal(2), rng.standard_normal((4, 5))
    value = cone_map(block, space) @ m.ravel() @ monomials(space, x, histories)
    nodes, weights = legendre.gauss(20)
    total = 0.0
    for node, weight in zip(nodes, weights, strict=True):
        basis = legendre.evaluate(5, node)[0]
        phi = basis @ histories.T
        inner, outer = block.kernel_basis()
        z1 = [basis[a] * phi for a in range(block.degree + 1)]
        z2 = [basis[i] * histories[:, o] for i, o in zip(inner, outer, strict=True)]
        zeta = np.concatenate([x, *z1, *z2])
        total += weight * (-node * (node + 1) if weighted else 1.0) * zeta @ m @ zeta
    assert value == pytest.approx(total, rel=AGREE)


@pytest.mark.parametrize("system", [two_delays(), three_delays()])
def test_derivative_along_the_error_dynamics(system: DelayPlant) -> None:
    """d/dt of V on a polynomial trajectory, by the chain rule on the histories themselves."""
    rng = np.random.default_rng(5)
    count, n, k = 3, system.states, system.delay_count
    space, target = lie.state_space(system, count), lie.derivative_space(system, count)
    coefficients = rng.standard_normal(space.size)
    _, left, right = space.multiplier_functions()
    coefficients[space.pair_count :][left // n != right // n] = 0.0
    histories = rng.standard_normal((k, n, 4))
    e = rng.standard_normal(n)
    histories[..., 0] += e - histories @ legendre.evaluate(4, 0.0)[0]  # φ_i(0) = e
    late = histories @ legendre.evaluate(4, -1.0)[0]
    w, v = rng.standard_normal(system.inputs), rng.standard_normal(system.outputs)
    rate = system.a0 @ e + sum(a @ late[i] for i, a in enumerate(system.a)) - system.b @ w
    moving = histories @ legendre.derivative(4).T / np.array(system.delays)[:, None, None]
    flat, flat_rate = histories.reshape(k * n, 4), moving.reshape(k * n, 4)
    step = 1e-4
    ahead = monomials(space, e + step * rate, flat + step * flat_rate)
    behind = monomials(space, e - step * rate, flat - step * flat_rate)
    expected = coefficients @ (ahead - behind) / (2 * step)  # exact for a quadratic form, but for rounding
    h = np.concatenate([w, v, e, late.ravel()])
    value = (lie.lie_derivative(system, count) @ coefficients) @ monomials(target, h, flat)
    assert value == pytest.approx(expected, rel=1e-7)


def test_supply_rate() -> None:
    system, rng = two_delays(), np.random.default_rng(7)
    space = lie.derivative_space(system, 2)
    h, histories = rng.standard_normal(space.points), np.zeros((space.functions, 2))
    v, e, _ = lie.point_offsets(system)
    cross, level = lie.supply(system, 2)
    values = monomials(space, h, histories)
    output = np.hstack([system.c10, *system.c1]) @ h[e:]
    assert cross @ values == pytest.approx(2 * h[v:e] @ output, rel=AGREE)
    assert level @ values == pytest.approx(-h[:e] @ h[:e], rel=AGREE)


def disturbed(system: DelayPlant, b: Any) -> DelayPlant:
    """The same plant with other disturbances."""
    return delay_system(system.a0, system.a, system.delays, b, system.c10, system.c2, system.c1)


@pytest.mark.parametrize("inputs", [3, 5])
def test_rates_in_place_of_disturbances_give_the_same_forms(inputs: int) -> None:
    """dV/dt and the supply rate at ω = (ẋ, ..) are those at w; the derivative of V names no matrix of the plant."""
    rng = np.random.default_rng(3)
    system = disturbed(random_system(1, 3, 2), np.eye(3, inputs) + 0.2 * rng.standard_normal((3, inputs)))
    drive, count = by_rates(system), 2
    space, target = lie.state_space(system, count), lie.derivative_space(system, count)
    coefficients = rng.standard_normal(space.size)
    _, left, right = space.multiplier_functions()
    coefficients[space.pair_count :][left // 3 != right // 3] = 0.0
    h, histories = rng.standard_normal(target.points), rng.standard_normal((space.functions, count))
    plain = h.copy()
    plain[:inputs] = drive.signal @ h
    for changed, kept in (
        (lie.lie_derivative(system, count, drive) @ coefficients, lie.lie_derivative(system, count) @ coefficients),
        (lie.supply(system, count, drive)[0], lie.supply(system, count)[0]),
        (lie.supply(system, count, drive)[1], lie.supply(system, count)[1]),
    ):
        expected = kept @ monomials(target, plain, histories)
        assert changed @ monomials(target, h, histories) == pytest.approx(expected, rel=1e-9)
    assert np.count_nonzero(drive.rate) == 3 and np.count_nonzero(direct(system).rate) > 20


def test_weak_disturbances_are_kept() -> None:
    """A rate over a disturbance that hardly drives it, or drives two states alike, would spoil the numbers."""
    system = two_delays()
    for b in (np.diag([1.0, 1e-6]), np.array([[1.0, 0.0], [1.0, 1e-6]]), np.ones((2, 1)), np.zeros((2, 2))):
        weak = disturbed(system, b)
        assert np.array_equal(by_rates(weak).rate, direct(weak).rate)


def test_the_basis_is_orthonormal_and_its_derivative_and_products_are_those_of_the_functions() -> None:
    points, weights = legendre.gauss(12)
    values = legendre.evaluate(9, points)
    assert np.abs(values.T @ (weights[:, None] * values) - np.eye(9)).max() < ROUNDING
    step = 1e-6
    slope = (legendre.evaluate(7, points + step) - legendre.evaluate(7, points - step)) / (2 * step)
    assert np.abs(slope - legendre.evaluate(7, points) @ legendre.derivative(7)).max() < 1e-6
    factors = legendre.evaluate(4, points)
    for weighted, weight in ((False, np.ones(12)), (True, -points * (points + 1))):
        found = np.einsum("tc,cab->tab", values, legendre.products(9, 4, 4, weighted))
        assert np.abs(found - np.einsum("t,ta,tb->tab", weight, factors, factors)).max() < ROUNDING


def semidefinite(rng: np.random.Generator, size: int) -> Array:
    """Of rank below its order, on the boundary of the cone."""
    root = rng.standard_normal((size, max(1, size - 1)))
    return np.asarray(root @ root.T)


@pytest.mark.parametrize(("moments", "rule"), [(1, DegreeRule.TOTAL), (1, DegreeRule.TENSOR), (2, DegreeRule.TENSOR)])
@pytest.mark.parametrize("ramp", [True, False])
def test_its_forms_lie_in_the_cone_of_corollary_2(moments: int, rule: DegreeRule, ramp: bool) -> None:
    rng = np.random.default_rng(8)
    space = FormSpace(3, 2, 2, required_count(1, rule))
    small, labels = bessel.cone(space, moments, ramp=ramp)
    blocks = [semidefinite(rng, label.size) for label in labels]
    target = cone_blocks(1, rule)
    large = lifted(blocks, space, moments, target)
    form = sum(cone_map(block, space) @ matrix.ravel() for block, matrix in zip(target, large, strict=True))
    assert np.allclose(form, small @ np.concatenate([block.ravel() for block in blocks]), atol=1e-10)
    for matrix in large:
        assert np.linalg.eigvalsh(matrix)[0] >= -1e-12 * np.linalg.norm(matrix)
