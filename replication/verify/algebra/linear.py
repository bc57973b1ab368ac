"""Exact linear algebra, printed decimals as exact numbers, and balls: enclosures that hold for certain."""

import re
from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import reduce
from itertools import combinations
from math import ceil, floor
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, arb_mat, ctx, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.work import spend_characteristic, spend_on_roots, spend_product, spend_solution
from replication.verify.theorem import Refused, require

STEPS, FINER = 200, 4
"""Of the search for roots, which ends as soon as nothing moves any more; how much finer its balls are than others."""


def zeros(rows: int, columns: int) -> fmpq_mat:
    """The zero matrix."""
    return fmpq_mat(rows, columns)


def identity(size: int) -> fmpq_mat:
    """The identity matrix."""
    return fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])


def block(rows: Sequence[Sequence[fmpq_mat]]) -> fmpq_mat:
    """The matrix made of these blocks; blocks without rows or columns may take part."""
    table: list[list[fmpq]] = []
    for row in rows:
        height = row[0].nrows()
        require(all(part.nrows() == height for part in row), "blocks beside each other differ in their rows")
        parts = [part.tolist() for part in row]
        table.extend([entry for part in parts for entry in part[i]] for i in range(height))
    width = sum(part.ncols() for part in rows[0])
    require(all(len(entries) == width for entries in table), "blocks above each other differ in their columns")
    return fmpq_mat(len(table), width, [entry for entries in table for entry in entries])


def submatrix(M: fmpq_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpq_mat:
    """These rows and columns of M."""
    return fmpq_mat(len(rows), len(columns), [M[i, j] for i in rows for j in columns])


def take_rows(M: fmpq_mat, rows: Sequence[int]) -> fmpq_mat:
    """These rows of M, all columns."""
    return submatrix(M, rows, range(M.ncols()))


def product(A: fmpq_mat, B: fmpq_mat) -> fmpq_mat:
    """A B, its work estimated."""
    spend_product(A, B)
    result: fmpq_mat = A * B
    return result


def characteristic_polynomial(M: fmpq_mat | arb_mat) -> Any:
    """det(z I − M), in rationals its work estimated."""
    if isinstance(M, fmpq_mat):
        spend_characteristic(M)
    return M.charpoly()


def solved(M: Any, right: Any, what: str) -> Any:
    """M^{-1} right, in rationals or balls; refused, by these words, if M is not proved invertible."""
    spend_solution(M, right)
    try:
        return M.solve(right)
    except ZeroDivisionError:
        raise Refused(what) from None


def resolved(A: Any, z: acb, right: acb_mat, what: str = "zI - A is not proved invertible") -> acb_mat:
    """(z I - A)^{-1} right, A in balls."""
    solution: acb_mat = solved(acb_mat(identity(A.nrows())) * z - acb_mat(A), right, what)
    return solution


def between(low: fmpq, high: fmpq) -> arb:
    """A ball that holds every number from `low` to `high`."""
    return arb(low).union(arb(high))


def ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Rationals that bound every number of a ball."""
    require(ball.is_finite(), "a ball has no finite ends")
    return ball.lower().fmpq(), ball.upper().fmpq()


def rounded_ends(ball: arb, bits: int = 40) -> tuple[fmpq, fmpq]:
    """Multiples of 2^-bits on both sides of a ball."""
    low, high = ends(ball)
    return fmpq(floor(low * 2**bits), 2**bits), fmpq(ceil(high * 2**bits), 2**bits)


def largest(values: Sequence[arb]) -> arb:
    """The maximum of balls."""
    return reduce(arb.max, values)


def parts(amplitudes: Iterable[acb]) -> arb_mat:
    """The real parts of complex numbers, a column, beside their imaginary parts."""
    return arb_mat([[amplitude.real, amplitude.imag] for amplitude in amplitudes])


def amplitudes(columns: arb_mat) -> list[acb]:
    """The inverse of `parts`."""
    return [acb(*row) for row in columns.tolist()]


def energy(M: acb_mat | arb_mat) -> arb:
    """The sum of the squared moduli of all entries."""
    real = parts(M.entries()) if isinstance(M, acb_mat) else M
    return sum((entry * entry for entry in real.entries()), arb(0))


def complex_of(pair: Sequence[fmpq]) -> acb:
    """The number with this real and imaginary part."""
    real, imaginary = pair
    return acb(arb(real), arb(imaginary))


def circle_point(t: fmpq) -> acb:
    """(1 + it) / (1 - it) = (1 - t^2 + 2it) / (1 + t^2), a point of the unit circle."""
    return acb(arb((1 - t * t) / (1 + t * t)), arb(2 * t / (1 + t * t)))


def beside(left: arb_mat, right: arb_mat) -> arb_mat:
    """[left, right]."""
    return arb_mat([[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)])


def generator(A: fmpq_mat, B: fmpq_mat) -> arb_mat:
    """N = [[A, B], [0, 0]]: the upper rows of its exponential at t are those of `hold`."""
    return arb_mat(block([[A, B], [zeros(B.ncols(), A.ncols()), zeros(B.ncols(), B.ncols())]]))


def hold(A: fmpq_mat, B: fmpq_mat, time: fmpq | arb) -> tuple[arb_mat, arb_mat]:
    """e^{A t} and ∫₀^t e^{A τ} dτ · B, which take state and held input to the next state, for all t in a ball."""
    n = A.nrows()
    upper = (generator(A, B) * arb(time)).exp().tolist()[:n]
    return arb_mat([row[:n] for row in upper]), arb_mat([row[n:] for row in upper])


def roots(polynomial: fmpq_poly) -> list[acb]:
    """Enclosures of all roots; refused where they are not told apart, as a root is not that occurs twice.

    As many balls of `root_near`, apart from each other, as there are roots hold one each. If the mirror image of a ball
    belongs to it, so does that of its root, which is then real.
    """
    spend_on_roots(polynomial)
    guesses = _guesses(polynomial)
    with ctx.workprec(FINER * ctx.prec):
        whole = acb_poly(polynomial.coeffs())
        near = [root_near(whole, guess) for guess in guesses]
    near = [acb(z.real, z.imag.union(-z.imag)) if z.imag.contains(0) else z for z in near]
    apart = all(not (first - second).contains(0) for first, second in combinations(near, 2))
    require(apart, "the roots of a polynomial are not told apart")
    return [acb(z.real) if z.imag.contains(0) else z for z in near]


def _guesses(polynomial: fmpq_poly) -> list[acb]:
    """Approximations of all roots, by the iteration of Durand and Kerner in middles of balls, as doubles; nothing is
    proved.
    """
    with ctx.workprec(FINER * ctx.prec):
        whole = acb_poly(polynomial.coeffs())
        *others, leading = whole.coeffs()
        size = largest([abs(c / leading) for c in others]).mid() + 1
        points = [acb(fmpq(2, 5), fmpq(9, 10)) ** k * size for k in range(len(others))]
        for _ in range(STEPS):
            before = [*points]
            for i, z in enumerate(points):
                factors = (z - other for j, other in enumerate(points) if j != i)
                apart = reduce(lambda total, factor: (total * factor).mid(), factors, leading)
                points[i] = z if apart.contains(0) else (z - whole(z) / apart).mid()
            if points == before:
                break
    doubles = [[fmpq(*float(part).as_integer_ratio()) for part in (z.real, z.imag)] for z in points]
    return [complex_of((a, b if abs(b) * 2**53 > abs(a) else fmpq(0))) for a, b in doubles]


def root_near(polynomial: acb_poly, guess: acb) -> acb:
    """A ball that holds a root: one lies within n |p(z)/p'(z)| of z, since p'/p is the sum of 1/(z − root)."""
    slope = polynomial.derivative()(guess)
    require(not slope.contains(0), "the derivative of the characteristic polynomial may vanish at the guessed root")
    distance = (polynomial.degree() * abs(polynomial(guess) / slope)).upper()
    return acb(arb(guess.real, distance), arb(guess.imag, distance))


def without_root(polynomial: acb_poly, root: acb) -> acb_poly:
    """p(z)/(z − root) of a polynomial that has this root, by Horner's scheme."""
    quotient = [acb(0)]
    for coefficient in polynomial.coeffs()[:0:-1]:
        quotient.append(coefficient + quotient[-1] * root)
    return acb_poly(quotient[:0:-1])


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
    return _decimals(ceil(number * 10**places), places)


def below(number: fmpq, places: int = 9) -> str:
    """`number` rounded down to so many decimals: for a sentence that says "at least"."""
    return _decimals(floor(number * 10**places), places)


def _decimals(scaled: int, places: int) -> str:
    digits = str(abs(scaled)).rjust(places + 1, "0")
    return f"{'-' if scaled < 0 else ''}{digits[:-places]}.{digits[-places:]}"
