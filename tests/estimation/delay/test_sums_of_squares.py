"""Forms on histories and their cones by quadrature; operators as matrices on values, their inverse, gains, check."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from papers.peet2019.experiments.scaling import lifted
from replication.errors import InvalidInputError
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system
from replication.estimation.delay.sos import cone as bessel
from replication.estimation.delay.sos import legendre, lie
from replication.estimation.delay.sos.certificate import Certificate, certificate_at
from replication.estimation.delay.sos.cone import (
    FormSpace,
    cone_blocks,
    cone_map,
    required_count,
    triangle,
)
from replication.estimation.delay.sos.lie import by_rates, direct
from replication.estimation.delay.sos.operators import (
    QUADRATURE,
    ObserverGains,
    Operator,
    check,
    evaluate,
    observer_gains,
)
from replication.estimation.validation import Array
from tests.estimation.delay.plants import random_system, two_delays

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


# Operators of the form (8)-(10) as matrices on values at Gauss points


NODES, WEIGHTS = legendre.gauss(QUADRATURE)


def at_nodes(point: Array, row: Array, column: Array, multiplier: Array, kernel: Array) -> Array:
    """The matrix of an operator on (x, phi_1, .., phi_K at the nodes), integrals as sums.

    point (mo, mi); row (M, K, mo, ni), column (M, K, no, mi), multiplier (M, K, no, ni), kernel (M, K, M', K, no, ni).
    """
    m, k, out = multiplier.shape[:3]
    local = np.einsum("tkij,tu,kl->tkulij", multiplier, np.eye(m), np.eye(k))
    inner = np.einsum("tkulij->ktiluj", local + kernel * WEIGHTS[:, None, None, None]).reshape(k * m * out, -1)
    across = np.einsum("t,tkij->iktj", WEIGHTS, row).reshape(len(point), -1)
    return np.block([[point, across], [np.einsum("tkij->ktij", column).reshape(k * m * out, -1), inner]])


def whole(operator: Operator) -> Array:
    basis = legendre.evaluate(operator.count, NODES)
    return at_nodes(
        operator.point,
        np.einsum("tc,mkjc->tkmj", basis, operator.row),
        np.einsum("tc,kicm->tkim", basis, operator.column),
        np.einsum("tc,kijc->tkij", basis, operator.multiplier),
        np.einsum("tc,kicljd,ud->tkulij", basis, operator.kernel, basis, optimize=True),
    )


def coercive(seed: int, n: int, delays: int, count: int) -> Operator:
    """Random, self-adjoint, twice the identity and a little more."""
    rng = np.random.default_rng(seed)
    point, row = rng.standard_normal((n, n)), 0.2 * rng.standard_normal((n, delays, n, count))
    multiplier = 0.1 * rng.standard_normal((delays, n, n, count))
    multiplier += np.einsum("kijc->kjic", multiplier)
    multiplier[..., 0] += 2.0 * np.eye(n)
    kernel = 0.1 * rng.standard_normal((delays, n, count, delays, n, count))
    kernel += np.einsum("kicljd->ljdkic", kernel)
    return Operator(2.0 * np.eye(n) + 0.1 * (point + point.T), row, np.einsum("mkic->kicm", row), multiplier, kernel)


GAINS = [(0, 1, 1), (2, 3, 2), (3, 2, 3), None]
"""Seed, delays and Legendre coefficients of drawn operators; None for those of a certificate."""


@pytest.mark.parametrize("drawn", GAINS)
def test_gains_solve_p_l_equals_z(drawn: tuple[int, int, int] | None, moderate: Certificate) -> None:
    """The values at points give L with P L = Z, in the coordinates of the program; P is self-adjoint."""
    n, q, change = 2, 1, moderate.change
    if drawn is None:
        gains = observer_gains(moderate)
    else:
        seed, k, count = drawn
        rng = np.random.default_rng(seed)
        c, ends = count, (k + 1) * q
        shapes = (n, ends), (n, k, q, c), (k, n, c, ends), (k, n, q, c), (k, n, c, k, q, c)
        injection = Operator(*(rng.standard_normal(shape) for shape in shapes))
        change = rng.standard_normal((n, n))
        gains = ObserverGains(coercive(seed, n, k, count), injection, change, 0.3)
    storage, injection = whole(gains.storage), whole(gains.injection)
    k = gains.storage.row.shape[1]
    measure = np.diag([1.0] * n + [*np.tile(np.repeat(WEIGHTS, n), k)])
    assert measure @ storage == pytest.approx((measure @ storage).T, abs=1e-12)
    L = evaluate(gains, NODES)
    ends = np.concatenate([L.l4[:, :, None], L.l5], axis=2)  # (M, K, 1 + K, n, q)
    found = at_nodes(
        np.concatenate([L.l0[None], L.l2]).transpose(1, 0, 2).reshape(n, -1),
        L.l3,
        np.einsum("tkpiq->tkipq", ends).reshape(len(NODES), k, n, (k + 1) * q),
        L.l6,
        L.l7,
    )
    units = np.kron(np.eye(1 + k * len(NODES)), change) * gains.time
    assert np.abs(storage @ units @ found - injection).max() < 1e-9 * np.abs(injection).max()
    assert np.abs(storage @ found - injection).max() > 1e-2 * np.abs(injection).max()


@pytest.mark.parametrize(("part", "name"), [("multiplier", "S"), ("point", "P")])
def test_no_gains_without_coercivity(part: str, name: str, moderate: Certificate) -> None:
    gains = observer_gains(moderate)
    wrong = replace(gains.storage, **{part: -getattr(gains.storage, part)})
    with pytest.raises(InvalidInputError, match=f"{name} is not positive definite"):
        evaluate(replace(gains, storage=wrong), NODES)


@pytest.fixture(scope="module")
def moderate() -> Certificate:
    """A level at which the gains are smooth."""
    return certificate_at(two_delays(), 2.2, 2, epsilon=1e-2)


def test_the_galerkin_check_refutes_a_lower_level_and_a_damaged_injection(moderate: Certificate) -> None:
    assert check(moderate).storage > 0 > check(moderate).dissipation
    for wrong in ({"gamma": 0.6 * moderate.gamma}, {"residual": 0.5 * moderate.residual}):
        assert check(replace(moderate, **wrong)).dissipation > 0
