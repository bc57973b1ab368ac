"""Forms on histories and their cones by quadrature; what the check of a certificate refutes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import Certificate, certificate_at
from replication.estimation.delay.sos.cone import FormSpace, cone_blocks, cone_map, required_count
from replication.estimation.delay.sos.operators import QUADRATURE, check, evaluate, observer_gains
from replication.estimation.delay.sos.synthesis import by_rates, direct
from replication.estimation.validation import Array
from tests.estimation.delay.plants import two_delays

AGREE, ROUNDING = 1e-10, 1e-11


def monomials(space: FormSpace, x: Array, histories: Array) -> Array:
    """Values of all monomials for point variables x and histories (functions, count) in Legendre coefficients."""
    moments = np.zeros((space.functions, space.count))
    kept = min(space.count, histories.shape[1])
    moments[:, :kept] = histories[:, :kept]
    functionals = np.concatenate([x, moments.T.ravel()])
    first, second = np.triu_indices(space.functionals)
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


# The operators of a certificate
@pytest.mark.parametrize(("part", "name"), [("multiplier", "S"), ("core", "P")])
def test_no_gains_without_coercivity(part: str, name: str, moderate: Certificate) -> None:
    gains = observer_gains(moderate)
    wrong = replace(gains.storage, **{part: -getattr(gains.storage, part)})
    with pytest.raises(InvalidInputError, match=f"{name} is not positive definite"):
        evaluate(replace(gains, storage=wrong), legendre.gauss(QUADRATURE)[0])


@pytest.fixture(scope="module")
def moderate() -> Certificate:
    """A level at which the gains are smooth."""
    return certificate_at(two_delays(), 2.2, 2, epsilon=1e-2)


def test_the_galerkin_check_refutes_a_lower_level_and_a_damaged_injection(moderate: Certificate) -> None:
    assert check(moderate).storage > 0 > check(moderate).dissipation
    for wrong in ({"gamma": 0.6 * moderate.gamma}, {"residual": 0.5 * moderate.residual}):
        assert check(replace(moderate, **wrong)).dissipation > 0
