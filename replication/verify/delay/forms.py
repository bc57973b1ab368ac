"""Quadratic forms on R^m x L2[-1,0]^F with polynomial kernels, in exact numbers.

A form is u'P u + 2 u' int Q(s)f(s) ds + int f(s)'S(s)f(s) ds + int int f(s)'R(s,t)f(t) ds dt, where u is a vector and
f are F functions on [-1, 0]. Q, S and R are matrix polynomials: the matrix of each power, by exponent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TypeVar

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import submatrix
from replication.verify.algebra.work import PLACE, spend

K = TypeVar("K")
Kernel = dict[tuple[int, int], fmpq_mat]
Polynomial = dict[int, fmpq_mat]


@dataclass(frozen=True)
class Form:
    """P (m, m) symmetric; Q[c] (m, F); S[c] (F, F) symmetric; R[a, b] (F, F) with R[b, a] the transpose of R[a, b]."""

    P: fmpq_mat
    Q: Polynomial
    S: Polynomial
    R: Kernel


def add_to(table: dict[K, fmpq_mat], key: K, term: fmpq_mat) -> None:
    """Add a term to the coefficient of a power."""
    table[key] = table[key] + term if key in table else term


def total(first: Form, second: Form) -> Form:
    """The sum of two forms."""
    return Form(first.P + second.P, _sum(first.Q, second.Q), _sum(first.S, second.S), _sum(first.R, second.R))


def _sum(first: Mapping[K, fmpq_mat], second: Mapping[K, fmpq_mat]) -> dict[K, fmpq_mat]:
    result = dict(first)
    for key, term in second.items():
        add_to(result, key, term)
    return result


UNIFORM: Mapping[int, int] = {0: 1}
"""The weight g(s) = 1, by powers."""
BUMP: Mapping[int, int] = {1: -1, 2: -1}
"""The weight g(s) = -s(s + 1), positive between -1 and 0."""


def moment(weight: Mapping[int, int], power: int) -> fmpq:
    """int g(s) s^power ds over [-1, 0]."""
    return sum((fmpq(factor * (-1) ** (power + k), power + k + 1) for k, factor in weight.items()), fmpq(0))


RULES: Mapping[str, Callable[[int, int, int], bool]] = {
    "each": lambda a, b, degree: True,
    "total": lambda a, b, degree: a + b <= degree,
    "outer": lambda a, b, degree: a == 0,
    "inner": lambda a, b, degree: b == 0,
}
"""Which powers (a, b) of s and t the kernels of a degree hold, of those up to the degree each."""
Powers = Sequence[tuple[int, int]]


def kernels(degree: int, rule: str = "each") -> Powers:
    """The powers (a, b) of s and t in zeta of `square` by a rule."""
    powers = range(degree + 1)
    spend(len(powers) ** 2 * PLACE, f"the powers of degree {degree}")
    return [(a, b) for a, b in product(powers, powers) if RULES[rule](a, b, degree)]


def basis_size(points: int, functions: int, degree: int, powers: Powers | None = None) -> int:
    """Number of entries of zeta in `square`."""
    return points + functions * (degree + 1 + len(kernels(degree) if powers is None else powers))


def square(
    M: fmpq_mat, weight: Mapping[int, int], points: int, functions: int, degree: int, powers: Powers | None = None
) -> Form:
    """int g(s) zeta(s)'M zeta(s) ds, which is non-negative for M >= 0 and g >= 0.

    zeta(s) = [u; s^a f(s), a = 0..degree; s^a int t^b f(t) dt, (a, b) in `powers`, up to the degree each if None].
    """
    powers = kernels(degree) if powers is None else powers
    u = range(points)
    starts = range(points, basis_size(points, functions, degree, powers), functions)
    columns = [range(start, start + functions) for start in starts]
    local = dict(enumerate(columns[: degree + 1]))
    distributed = dict(zip(powers, columns[degree + 1 :], strict=True))
    Q: Polynomial = {}
    S: Polynomial = {}
    R: Kernel = {}
    for a, right in local.items():
        for k, factor in weight.items():
            add_to(Q, a + k, submatrix(M, u, right) * factor)
    for (a, b), right in distributed.items():
        add_to(Q, b, submatrix(M, u, right) * moment(weight, a))
    for (a, left), (other, right) in product(local.items(), local.items()):
        for k, factor in weight.items():
            add_to(S, a + other + k, submatrix(M, left, right) * factor)
    for (a, left), ((other, b), right) in product(local.items(), distributed.items()):
        part = submatrix(M, left, right)
        for k, factor in weight.items():
            add_to(R, (a + other + k, b), part * factor)
            add_to(R, (b, a + other + k), part.transpose() * factor)
    for ((a, b), left), ((other, c), right) in product(distributed.items(), distributed.items()):
        add_to(R, (b, c), submatrix(M, left, right) * moment(weight, a + other))
    return Form(submatrix(M, u, u) * moment(weight, 0), Q, S, R)
