"""The basis: orthonormality, derivative and products, against quadrature and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from replication.estimation.delay.sos import legendre

ROUNDING = 1e-11


def test_orthonormal() -> None:
    points, weights = legendre.gauss(12)
    values = legendre.evaluate(9, points)
    assert np.abs(values.T @ (weights[:, None] * values) - np.eye(9)).max() < ROUNDING


def test_derivative_against_differences() -> None:
    step, point = 1e-6, -0.37
    slope = (legendre.evaluate(7, point + step) - legendre.evaluate(7, point - step)) / (2 * step)
    assert np.abs(slope - legendre.evaluate(7, point) @ legendre.derivative(7)).max() < 1e-7


@pytest.mark.parametrize("weighted", [False, True])
def test_products_reproduce_the_product(weighted: bool) -> None:
    points = np.linspace(-1, 0, 9)
    tensor = legendre.products(9, 4, 4, weighted)
    weight = -points * (points + 1) if weighted else np.ones_like(points)
    values = np.einsum("tc,cab->tab", legendre.evaluate(9, points), tensor)
    factors = legendre.evaluate(4, points)
    assert np.abs(values - np.einsum("t,ta,tb->tab", weight, factors, factors)).max() < ROUNDING
