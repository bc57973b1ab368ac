"""The algebra of operators: composition, adjoint, derivative, inverse - identities on random data."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replication.errors import InvalidInputError
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.operators import Operator, invert
from replication.estimation.validation import Array
from tests.estimation.delay import algebra
from tests.estimation.delay.algebra import as_operator

IDENTITY = 1e-10
SEEDS = st.integers(0, 2**31)


def random_operator(rng: np.random.Generator, out: int, into: int, delays: int, count: int) -> Operator:
    n, m = out, into
    return Operator(
        rng.standard_normal((n, m)),
        rng.standard_normal((n, delays, m, count)),
        rng.standard_normal((delays, n, count, m)),
        rng.standard_normal((delays, n, m, count)),
        rng.standard_normal((delays, n, count, delays, m, count)),
    )


def coercive(rng: np.random.Generator, n: int, delays: int, count: int) -> Operator:
    raw = algebra.scaled(random_operator(rng, n, n, delays, count), 0.1)
    eye = algebra.scaled(algebra.identity(n, n, delays), 2.0)
    return algebra.add(algebra.add(raw, algebra.adjoint(raw)), eye)


def inner(x: Array, phi: Array, y: Array, psi: Array) -> float:
    count = max(phi.shape[-1], psi.shape[-1])
    left, right = np.zeros((*phi.shape[:2], count)), np.zeros((*psi.shape[:2], count))
    left[..., : phi.shape[-1]], right[..., : psi.shape[-1]] = phi, psi
    return float(x @ y + np.sum(left * right))


@settings(max_examples=20)
@given(SEEDS)
def test_composition_is_application_twice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = random_operator(rng, 3, 2, 2, 3), random_operator(rng, 2, 1, 2, 2)
    x, phi = rng.standard_normal(1), rng.standard_normal((2, 1, 3))
    once = algebra.apply(algebra.product(first, second), x, phi)
    twice = algebra.apply(first, *algebra.apply(second, x, phi))
    assert np.abs(once[0] - twice[0]).max() < IDENTITY * (1 + np.abs(twice[0]).max())
    count = twice[1].shape[-1]
    assert np.abs(once[1][..., :count] - twice[1][..., : once[1].shape[-1]]).max() < 1e-9


@settings(max_examples=20)
@given(SEEDS)
def test_adjoint(seed: int) -> None:
    rng = np.random.default_rng(seed)
    operator = random_operator(rng, 2, 3, 2, 3)
    x, phi = rng.standard_normal(3), rng.standard_normal((2, 3, 2))
    y, psi = rng.standard_normal(2), rng.standard_normal((2, 2, 4))
    left = inner(*algebra.apply(operator, x, phi), y, psi)
    right = inner(x, phi, *algebra.apply(algebra.adjoint(operator), y, psi))
    assert left == pytest.approx(right, rel=1e-9, abs=1e-9)


def test_derivative_of_the_image() -> None:
    rng = np.random.default_rng(1)
    operator = random_operator(rng, 2, 2, 1, 3)
    x, phi = rng.standard_normal(2), rng.standard_normal((1, 2, 3))
    _, image = algebra.apply(operator, x, phi)
    slope = image @ legendre.derivative(image.shape[-1]).T
    only_s = Operator(
        0 * operator.point, 0 * operator.row, 0 * operator.column, operator.multiplier, 0 * operator.kernel
    )
    _, first = algebra.apply(algebra.differentiated(operator), x, phi)
    _, second = algebra.apply(only_s, x, phi @ legendre.derivative(3).T)
    assert np.abs(slope - first - second).max() < IDENTITY * np.abs(slope).max()


@settings(max_examples=15)
@given(SEEDS, st.integers(1, 3))
def test_inverse_on_both_sides(seed: int, delays: int) -> None:
    operator = coercive(np.random.default_rng(seed), 2, delays, 2)
    inverse = as_operator(invert(operator), 40)
    eye = algebra.scaled(algebra.identity(2, 2, delays), -1.0)
    for product in (algebra.compose(operator, inverse, 40), algebra.compose(inverse, operator, 40)):
        assert algebra.largest(algebra.add(product, eye)) < 1e-7


def test_inverse_of_the_identity_is_the_identity() -> None:
    eye = algebra.identity(2, 2, 2, 3)
    assert algebra.largest(algebra.add(as_operator(invert(eye), 3), algebra.scaled(eye, -1.0))) < IDENTITY


def test_no_inverse_without_coercivity() -> None:
    eye = algebra.identity(2, 2, 1)
    with pytest.raises(InvalidInputError, match="S is not positive definite"):
        invert(Operator(eye.point, eye.row, eye.column, -eye.multiplier, eye.kernel))
    with pytest.raises(InvalidInputError, match="P is not positive definite"):
        invert(Operator(-eye.point, eye.row, eye.column, eye.multiplier, eye.kernel))


def test_operators_of_other_sizes_do_not_compose() -> None:
    with pytest.raises(ValueError, match="do not compose"):
        algebra.product(algebra.identity(2, 2, 1), algebra.identity(3, 3, 1))
