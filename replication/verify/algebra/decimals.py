"""Printed decimals and matrices as exact numbers."""

from __future__ import annotations

import re
from fractions import Fraction

from flint import fmpq, fmpq_mat

from replication.verify.theorem import require

DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]{1,3})?")


def decimal(printed: str) -> fmpq:
    """The exact value of a printed decimal such as "-0.0440", ".5" or "1e-3"."""
    require(DECIMAL.fullmatch(printed) is not None, f"{printed!r} is not a decimal number")
    exact = Fraction(printed)
    return fmpq(exact.numerator, exact.denominator)


def printed_matrix(printed: str) -> fmpq_mat:
    """The exact value of a printed matrix such as "[0.95 0.5; -0.1 0.9]"."""
    require(printed[:1] == "[" and printed[-1:] == "]", f"{printed!r} is not a printed matrix")
    rows = [[decimal(entry) for entry in row.split()] for row in printed[1:-1].split(";")]
    require(len({len(row) for row in rows}) == 1, f"the rows of {printed!r} differ in length")
    return fmpq_mat(rows)


def printed_poles(printed: str) -> list[list[fmpq]]:
    """Real and imaginary part of each pole of a list such as "(1.031, 1.085±0.240i)", one of each pair."""
    require(printed[:1] == "(" and printed[-1:] == ")", f"{printed!r} is not a printed list of poles")
    parts = [pole.strip().removesuffix("i").split("±") for pole in printed[1:-1].split(",")]
    return [[decimal(pole[0]), decimal(pole[1] if len(pole) > 1 else "0")] for pole in parts]


def half_unit(printed: str) -> fmpq:
    """Half a unit in the last place of the last decimal in a text."""
    places = len(re.findall(r"\.([0-9]+)", printed)[-1])
    return fmpq(1, 2 * 10**places)


def above(number: fmpq, places: int = 9) -> str:
    """`number` rounded up to so many decimals: for a sentence that says "at most"."""
    return _decimals(int((number * 10**places).ceil()), places)


def below(number: fmpq, places: int = 9) -> str:
    """`number` rounded down to so many decimals: for a sentence that says "at least"."""
    return _decimals(int((number * 10**places).floor()), places)


def _decimals(scaled: int, places: int) -> str:
    digits = str(abs(scaled)).rjust(places + 1, "0")
    return f"{'-' if scaled < 0 else ''}{digits[:-places]}.{digits[-places:]}"
