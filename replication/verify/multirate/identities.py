"""Identities of the multi-rate paper, checked with a symbol for each entry of each matrix, at the size asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from replication.verify.algebra.symbolic import Symbolic, Symbols, blocks, minus, plus, times, transposed, width
from replication.verify.reading import fields, integer
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]

LARGEST_SIZE = 6
"""Of a vector, and so of a matrix: the polynomials grow with its fourth power."""


def error_system(certificate: Certificate) -> Theorem:
    """Eq. (16): plant (2), (13) less observer (15) is the error system, whatever the entries of L_k and S_k."""
    n, q, m, p = _sizes(certificate)
    symbols = Symbols(
        {
            "A": (n, n), "B_u": (n, p), "B_d": (n, m), "C": (q, n), "D": (q, q), "L": (n, q), "S": (q, q),
            "x": (n, 1), "o": (n, 1), "u": (p, 1), "d": (m, 1), "w": (q, 1),
        },
        diagonal=("S",),
    )  # fmt: skip
    A, B_u, B_d, C, D, L, S, x, o, u, d, w = symbols.matrices.values()
    measured = plus(times(S, C, x), times(S, D, w))
    plant = plus(times(A, x), times(B_u, u), times(B_d, d))
    observer = plus(times(A, o), times(B_u, u), times(L, minus(measured, times(S, C, o))))
    A_e, error = minus(A, times(L, S, C)), minus(x, o)
    wanted = minus(plus(times(A_e, error), times(B_d, d)), times(L, S, D, w))
    return _theorem(
        "The error of the observer (15) obeys eq. (16) for all entries of all matrices",
        certificate,
        minus(plant, observer) == wanted,
    )


def dissipation(certificate: Certificate) -> Theorem:
    """Eqs. (20)-(23): the quadratic form of the matrix (20) is what the weighted square of the error loses."""
    symbols, closed, level = _closed_loop(certificate)
    P, before, W, e, d, w = (symbols.matrices[name] for name in ("P", "Q", "W", "e", "d", "w"))
    xi, noise, z = blocks([[e], [d], [w]]), blocks([[d], [w]]), times(W, e)
    following = times(blocks([closed]), xi)
    loss = minus(
        plus(times(transposed(e), before, e), times(transposed(noise), level, noise)),
        times(transposed(following), P, following),
        times(transposed(z), z),
    )
    return _theorem(
        "The quadratic form of the matrix (20) is the left-hand side of eq. (23)",
        certificate,
        times(transposed(xi), _theta(symbols, closed), xi) == loss,
    )


def schur(certificate: Certificate) -> Theorem:
    """Eqs. (30)-(32): with Y = P L, the Schur complement of P in the matrix (30) is the matrix (20).

    The blocks beside P are P F with F = [A_e, B_d, -L S D], so that the complement is the rest less F'P F.
    """
    symbols, closed, level = _closed_loop(certificate)
    A, B_d, C, D, L, S, W, P, before = (symbols.matrices[name] for name in ("A", "B_d", "C", "D", "L", "S", *"WPQ"))
    Y, none, F = times(P, L), symbols.zeros(len(P), width(level)), blocks([closed])
    sensed = minus(symbols.zeros(len(P), width(D)), times(Y, S, D))
    beside = blocks([[minus(times(P, A), times(Y, S, C)), times(P, B_d), sensed]])
    rest = blocks([[minus(before, times(transposed(W), W)), none], [transposed(none), level]])
    complement = minus(rest, times(transposed(F), P, F))
    return _theorem(
        "With Y = P L, the Schur complement of P in the matrix (30) is the matrix (20)",
        certificate,
        (beside, complement) == (times(P, F), _theta(symbols, closed)),
    )


def _closed_loop(certificate: Certificate) -> tuple[Symbols, list[Symbolic], Symbolic]:
    """All symbols of Theorems 1 and 2 at one phase (Q is P_(k-1)); A_e, B_d, -L S D; and gamma^2 I."""
    n, q, m, _ = _sizes(certificate)
    symbols = Symbols(
        {
            "A": (n, n), "B_d": (n, m), "C": (q, n), "D": (q, q), "L": (n, q), "S": (q, q), "W": (n, n),
            "P": (n, n), "Q": (n, n), "e": (n, 1), "d": (m, 1), "w": (q, 1),
        },
        scalars=("g2",),
        symmetric=("P", "Q"),
        diagonal=("S",),
    )  # fmt: skip
    A, B_d, C, D, L, S, *_ = symbols.matrices.values()
    closed = [minus(A, times(L, S, C)), B_d, minus(symbols.zeros(n, q), times(L, S, D))]
    return symbols, closed, symbols.diagonal([symbols.symbols["g2"] for _ in range(m + q)])


def _theta(symbols: Symbols, closed: list[Symbolic]) -> Symbolic:
    """The matrix (20), block by block as printed."""
    A_e, B_d, negative = closed
    P, before, W, D = (symbols.matrices[name] for name in ("P", "Q", "W", "D"))
    M = minus(symbols.zeros(len(P), width(D)), negative)

    def weighted(first: Symbolic, second: Symbolic) -> Symbolic:
        return times(transposed(first), P, second)

    def level(columns: Symbolic) -> Symbolic:
        return symbols.diagonal([symbols.symbols["g2"] for _ in transposed(columns)])

    corner = minus(symbols.zeros(len(P), width(B_d)), weighted(A_e, B_d))
    return blocks(
        [
            [minus(before, weighted(A_e, A_e), times(transposed(W), W)), corner, weighted(A_e, M)],
            [transposed(corner), minus(level(B_d), weighted(B_d, B_d)), weighted(B_d, M)],
            [transposed(weighted(A_e, M)), transposed(weighted(B_d, M)), minus(level(M), weighted(M, M))],
        ]
    )


def _sizes(certificate: Certificate) -> tuple[int, ...]:
    fields(certificate["witness"], "witness")
    fields(certificate["bound"], "bound")
    names = ("states", "sensors", "disturbances", "inputs")
    given = fields(certificate["parameters"], "parameters", *names)
    sizes = tuple(integer(value, f"parameters.{name}", 1) for name, value in zip(names, given, strict=True))
    require(max(sizes) <= LARGEST_SIZE, f"parameters: the largest size is {max(sizes)}, more than {LARGEST_SIZE}")
    return sizes


def _theorem(sentence: str, certificate: Certificate, holds: bool) -> Theorem:
    """The theorem that an identity holds; refused if it does not, as nothing is proved of the paper then."""
    n, q, m, p = _sizes(certificate)
    require(holds, f"this is no identity: {sentence}")
    return Theorem(sentence=f"{sentence} ({n} states, {q} sensors, {m} disturbances, {p} inputs).", holds=True)


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "multirate.error-system": error_system,
    "multirate.dissipation": dissipation,
    "multirate.schur": schur,
}
