"""An exact proof that condition (18) does not imply stability: the scalar loop A = B = C = 1, K = −2, L = 2.

With h = e^T − 1 every matrix of (5) to (7) is rational in h: Ā = 1 + h, B̄ = h, F = 1/(1 + h), G = h/(1 + h) and
H = 2h/(1 + h). So (1 + h)^{3M} det(I − Φ) is a polynomial q(h) with integer coefficients. If q(h) < 0, the
characteristic polynomial of Φ is negative at one and positive at infinity: a real eigenvalue exceeds one.
All arithmetic is in integers and fractions.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from itertools import permutations
from math import isqrt

Polynomial = tuple[int, ...]
"""Coefficients in ascending powers of h."""
Row = tuple[Polynomial, ...]

ONE: Polynomial = (1,)
ZERO: Polynomial = (0,)
ONE_PLUS_H: Polynomial = (1, 1)


@dataclass(frozen=True)
class InstabilityProof:
    """q of the loop with ratio M; `period` T₀ up to which q < 0 is proved; an upper bound of the periods of (18)."""

    ratio: int
    polynomial: Polynomial
    period: Fraction
    allowed_period_below: Fraction
    allowed_period_above: Fraction
    unstable: bool

    @property
    def holds(self) -> bool:
        """Every period allowed by (18) gives an unstable loop."""
        return self.unstable and self.allowed_period_above <= self.period


def prove_instability(ratio: int, period: Fraction) -> InstabilityProof:
    """Try to prove q(h) < 0 for all 0 < h ≤ e^{T₀} − 1, T₀ = period, by the dominance of its lowest coefficient."""
    q = characteristic_at_one(ratio)
    order = next(i for i, c in enumerate(q) if c != 0)
    reach = exponential_bounds(period)[1] - 1
    rest = sum((max(c, 0) * reach ** (i - order) for i, c in enumerate(q) if i > order), Fraction(0))
    below, above = allowed_periods()
    return InstabilityProof(ratio, q, period, below, above, unstable=q[order] < 0 and rest < -q[order])


def characteristic_at_one(ratio: int) -> Polynomial:
    """(1 + h)^{3M} det(I − Φ) over the state (x, ζ, y_p), with the observer as printed in (3) to (7)."""
    # Rows times (1 + h): x' = (1+h) x − 2h ζ, (1+h) ζ' = ζ − 2h ζ + 2h ȳ, y_p' = (1+h) ζ − 2h ζ.
    plant: Row = (_multiply(ONE_PLUS_H, ONE_PLUS_H), _multiply((0, -2), ONE_PLUS_H), ZERO)
    virtual: Row = (ZERO, _multiply((1, -1), ONE_PLUS_H), ZERO)
    fresh = (plant, ((0, 2), (1, -2), ZERO), virtual)
    predicted = (plant, (ZERO, (1, -2), (0, 2)), virtual)
    total: tuple[Row, ...] = fresh
    for _ in range(ratio - 1):
        total = _matrix_product(predicted, total)
    scale = ONE
    for _ in range(ratio):
        scale = _multiply(scale, ONE_PLUS_H)
    shifted = tuple(
        tuple(_add(scale if i == j else ZERO, _scale(entry, -1)) for j, entry in enumerate(row))
        for i, row in enumerate(total)
    )
    return _determinant(shifted)


def exponential_bounds(x: Fraction, terms: int = 12) -> tuple[Fraction, Fraction]:
    """Lower and upper bound of e^x for 0 < x < 1: the Taylor sum, and with the geometric bound of its remainder."""
    total, term = Fraction(0), Fraction(1)
    for n in range(terms):
        total, term = total + term, term * x / (n + 1)
    return total, total + term / (1 - x)


def allowed_periods(digits: int = 12) -> tuple[Fraction, Fraction]:
    """Bounds of the largest T in (18): here P = [[1/2, 1/2], [1/2, 3/2]] and α₄ λ_max = 64 λ_max²/λ_min = 128 λ_max³.

    λ_max = 1 + √½ and λ_min λ_max = 1/2; the factor 64 is 2 (α₂ + 2 α₁ + 4 α₃ + 2 α₃) √λ_min with α₁ = 5, α₂ = 16
    and α₃ = 1 over √λ_min.
    """
    scale = 10**digits
    root = isqrt(scale * scale // 2)
    lower, upper = 1 + Fraction(root, scale), 1 + Fraction(root + 1, scale)
    return 1 / (128 * upper**3), 1 / (128 * lower**3)


def _multiply(p: Polynomial, q: Polynomial) -> Polynomial:
    product = [0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            product[i + j] += a * b
    return tuple(product)


def _add(p: Polynomial, q: Polynomial) -> Polynomial:
    size = max(len(p), len(q))
    return tuple((p[i] if i < len(p) else 0) + (q[i] if i < len(q) else 0) for i in range(size))


def _scale(p: Polynomial, factor: int) -> Polynomial:
    return tuple(factor * c for c in p)


def _matrix_product(left: tuple[Row, ...], right: tuple[Row, ...]) -> tuple[Row, ...]:
    columns = list(zip(*right, strict=True))
    return tuple(tuple(_dot(row, column) for column in columns) for row in left)


def _dot(left: Row, right: Row) -> Polynomial:
    total: Polynomial = ZERO
    for p, q in zip(left, right, strict=True):
        total = _add(total, _multiply(p, q))
    return total


def _determinant(matrix: tuple[Row, ...]) -> Polynomial:
    """Leibniz's formula; the matrices here are three by three."""
    size = len(matrix)
    total: Polynomial = ZERO
    for order in permutations(range(size)):
        inversions = sum(order[i] > order[j] for i in range(size) for j in range(i + 1, size))
        term: Polynomial = (-1 if inversions % 2 else 1,)
        for row, column in enumerate(order):
            term = _multiply(term, matrix[row][column])
        total = _add(total, term)
    return total
