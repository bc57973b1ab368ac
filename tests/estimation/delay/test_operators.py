"""Operators of the form (8)-(10) as matrices on values at Gauss points: the inverse, the gains, the Galerkin check."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.certificate import Certificate, certificate_at
from replication.estimation.delay.sos.operators import (
    QUADRATURE,
    Inverse,
    Operator,
    check,
    evaluate,
    generator,
    injection_operator,
    invert,
    multiplier_inverse,
    observer_gains,
    storage_operator,
)
from replication.estimation.validation import Array
from tests.estimation.delay.plants import tanks, two_delays

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


def whole_inverse(inverse: Inverse) -> Array:
    basis, s = legendre.evaluate(inverse.operator.count, NODES), multiplier_inverse(inverse.operator, NODES)
    shape = np.einsum("tc,tkij->tkcij", basis, s)
    row = np.einsum("mkic,tkcij->tkmj", inverse.h, shape)
    kernel = np.einsum("tkcij,kjclmd,uldmn->tkulin", shape, inverse.gamma, shape, optimize=True)
    return at_nodes(inverse.point, row, np.einsum("tkmj->tkjm", row), s, kernel)


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


@pytest.fixture(scope="module")
def moderate() -> Certificate:
    """A level at which the gains are smooth."""
    return certificate_at(two_delays(), 2.2, 2, epsilon=1e-2)


@pytest.mark.parametrize(("seed", "delays", "count"), [(0, 1, 2), (1, 2, 2), (2, 3, 2), (3, 2, 3), (4, 1, 1)])
def test_inverse_on_both_sides(seed: int, delays: int, count: int) -> None:
    operator = coercive(seed, 2, delays, count)
    direct, back = whole(operator), whole_inverse(invert(operator))
    for product in (direct @ back, back @ direct):
        assert np.abs(product - np.eye(len(product))).max() < 1e-11


@pytest.mark.parametrize("part", ["multiplier", "point"])
def test_no_inverse_without_coercivity(part: str) -> None:
    operator = coercive(0, 2, 1, 2)
    name = {"multiplier": "S", "point": "P"}[part]
    with pytest.raises(InvalidInputError, match=f"{name} is not positive definite"):
        invert(replace(operator, **{part: -getattr(operator, part)}))


def test_gains_solve_p_l_equals_z(moderate: Certificate) -> None:
    """The formulas of Lemma 5 give L with P L = Z, in the coordinates of the program; P is self-adjoint."""
    storage = whole(storage_operator(moderate))
    measure = np.diag([1.0] * 2 + [*np.tile(np.repeat(WEIGHTS, 2), 2)])
    assert measure @ storage == pytest.approx((measure @ storage).T, abs=1e-12)
    L = evaluate(observer_gains(moderate), NODES)
    n, k, q = 2, 2, 1
    ends = np.concatenate([L.l4[:, :, None], L.l5], axis=2)  # (M, K, 1 + K, n, q)
    gains = at_nodes(
        np.concatenate([L.l0[None], L.l2]).transpose(1, 0, 2).reshape(n, -1),
        L.l3,
        np.einsum("tkpiq->tkipq", ends).reshape(len(NODES), k, n, (k + 1) * q),
        L.l6,
        L.l7,
    )
    change = np.kron(np.eye(1 + k * len(NODES)), moderate.change) * moderate.time
    injection = whole(injection_operator(moderate))
    assert np.abs(storage @ change @ gains - injection).max() < 1e-9 * np.abs(injection).max()
    assert np.abs(storage @ gains - injection).max() > 1e-2 * np.abs(injection).max()


def test_the_galerkin_check_refutes_a_lower_level_and_a_damaged_injection(moderate: Certificate) -> None:
    assert check(moderate).storage > 0 > check(moderate).dissipation
    for wrong in ({"gamma": 0.6 * moderate.gamma}, {"residual": 0.5 * moderate.residual}):
        assert check(replace(moderate, **wrong)).dissipation > 0


def test_histories_move_at_the_rate_of_their_delay() -> None:
    """phi' / tau of phi = p_2, by its Legendre coefficients."""
    count, delay = 4, 0.4
    matrix = generator(tanks(delay), count)[2 : 2 + count, 2 : 2 + count]
    second = np.eye(count)[2]
    assert matrix @ second == pytest.approx(legendre.derivative(count) @ second / delay)
    points = np.linspace(-0.9, -0.1, 5)
    slope = (legendre.evaluate(count, points + 1e-6) - legendre.evaluate(count, points - 1e-6)) @ second / 2e-6
    assert legendre.evaluate(count, points) @ (matrix @ second) == pytest.approx(slope / delay, rel=1e-6)
