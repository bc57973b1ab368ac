"""The inverse of an operator of the form (8) as one of that form again, to be composed with others."""

from __future__ import annotations

import numpy as np

from replication.estimation.delay.operators import QUADRATURE, Inverse, Operator, multiplier_inverse
from replication.estimation.delay.sos import legendre


def as_operator(inverse: Inverse, count: int, quadrature: int = 2 * QUADRATURE) -> Operator:
    """The inverse with its rational functions projected on `count` Legendre polynomials (converges geometrically)."""
    operator = inverse.operator
    nodes, weights = legendre.gauss(max(quadrature, count + 8))
    fine = legendre.evaluate(count, nodes) * weights[:, None]
    basis = legendre.evaluate(operator.count, nodes)
    s = multiplier_inverse(operator, nodes)
    shape = np.einsum("te,tkij,tc->kiejc", fine, s, basis, optimize=True)  # coefficients of Ŝ p_c, column by column
    row = np.einsum("mkjc,kiejc->mkie", inverse.h, shape, optimize=True)  # S symmetric
    multiplier = np.einsum("te,tkij->kije", fine, s)
    kernel = np.einsum("kiejc,kjclqd,lrfqd->kielrf", shape, inverse.gamma, shape, optimize=True)
    return Operator(inverse.point, row, np.einsum("mkie->kiem", row), multiplier, kernel)
