"""The second arithmetic against python-flint, and against exact identities: on drawn numbers, corners, certificates.

Both enclose the same number by themselves, so that their balls must meet; what is exact is equal.
"""

import json
import os
import random
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from math import ceil, floor
from pathlib import Path
from typing import Any

import byhand
import flint
import pytest
from corpus import altered, true

from replication import twice
from replication.verify import stdlib
from replication.verify.theorem import Refused

ROOT = Path(__file__).parents[2]
SEEDS = range(6)
STEP = 40 if os.environ.get("MUTANTS") == "all" else 120
"""Of the altered certificates every so many are tried; more of them with MUTANTS=all (`make mutants`)."""
WIDE = {"condition", "condition-scalar", "counterexample", "output-matrix", "prediction-bound"}
"""Certificates of which one arithmetic may prove an alteration that the other cannot decide: their balls are wide."""


def rational(rng: random.Random, digits: int = 6) -> Fraction:
    return Fraction(rng.randint(-(10**digits), 10**digits), rng.randint(1, 10**digits))


def table(rng: random.Random, rows: int, columns: int, digits: int = 3) -> list[list[Fraction]]:
    return [[rational(rng, digits) for _ in range(columns)] for _ in range(rows)]


def made(library: Any, kind: str, entries: list[list[Fraction]]) -> Any:
    exact = library.fmpq_mat([[library.fmpq(x.numerator, x.denominator) for x in row] for row in entries])
    return exact if kind == "fmpq_mat" else getattr(library, kind)(exact)


def ends(value: Any) -> tuple[Fraction, Fraction]:
    """Of a real ball, or of a rational."""
    if hasattr(value, "lower"):
        return Fraction(str(value.lower().fmpq())), Fraction(str(value.upper().fmpq()))
    return Fraction(str(value)), Fraction(str(value))


def flat(value: Any) -> list[Any]:
    """The real numbers of which something is made up."""
    if isinstance(value, (list, tuple)):
        return [part for one in value for part in flat(one)]
    if hasattr(value, "entries"):
        return flat([value.nrows(), value.ncols(), *value.entries()])
    if hasattr(value, "coeffs"):
        return flat(value.coeffs())
    return [value.real, value.imag] if isinstance(value, (flint.acb, stdlib.acb)) else [value]


def same(one: Any, other: Any, narrow: Fraction = Fraction(1, 10**8)) -> None:
    """Equal where both are exact, else enclosures that meet, and of which none is wide."""
    first, second = flat(one), flat(other)
    assert len(first) == len(second)
    for a, b in zip(first, second, strict=True):
        (low, high), (least, most) = ends(a), ends(b)
        assert max(low, least) <= min(high, most), (a, b)
        assert high - low <= narrow * max(1, abs(high)) and most - least <= narrow * max(1, abs(most)), (a, b)
        exact = isinstance(a, (int, flint.fmpq, flint.fmpz))
        assert not exact or low == least == most


EXACT: dict[str, Callable[[Any, Any, Any, Any, Any], Any]] = {
    "sum": lambda library, A, B, x, y: A + B - A * x,
    "product": lambda library, A, B, x, y: A * B * y,
    "quotient": lambda library, A, B, x, y: (A / y, 2 / y, x / 3, x**3, x**-2, -x, abs(x), 1 - x),
    "order": lambda library, A, B, x, y: [int(b) for b in (x < y, x <= y, x > y, x >= 1, x == y, x == x)],
    "whole": lambda library, A, B, x, y: (*map(int, (floor(x), ceil(x))), int(x.numerator), int(x.denominator)),
    "transpose": lambda library, A, B, x, y: (A.transpose(), A[1, 2], A.entries()[3], A.det(), A.rank()),
    "low rank": lambda library, A, B, x, y: ((A * 0).rank(), (A[0, 0] * A - A * A[0, 0]).rank()),
    "charpoly": lambda library, A, B, x, y: A.charpoly(),
    "solution": lambda library, A, B, x, y: (A.solve(B), A.inv()),
    "pivots": lambda library, A, B, x, y: [
        (U[k, k], P[k, k]) for P, U in [A.numer_denom()[0].fflu()[::3]] for k in range(A.nrows())
    ],
    "symmetric": lambda library, A, B, x, y: [
        U[k, k] for U in [(A * A.transpose()).numer_denom()[0].fflu()[3]] for k in range(A.nrows())
    ],
    "polynomial": lambda library, A, B, x, y: [
        (p * q - p, p**3, q.derivative(), p + 1, 1 + p, p * x, (p * p).degree(), p(x)) for p in [A.charpoly()]
        for q in [B.charpoly() * y]
    ],
}  # fmt: skip
BALLS: dict[str, Callable[[Any, Any, Any, Any, Any], Any]] = {
    "sum": lambda library, A, B, x, y: (A + B - A * x, x + y - 1, 1 - x, -A),
    "product": lambda library, A, B, x, y: (A * B * y, A.transpose() * B, 3 * x, A / 7, A[0, 1] ** 3, (A * B).trace()),
    "quotient": lambda library, A, B, x, y: (x / y, 1 / y, x / 3),
    "functions": lambda library, A, B, x, y: (
        (x / 50).exp(), (abs(x) + 1).log(), (abs(x) + 1).sqrt(), abs(x), x.max(y), x.union(x), library.arb.pi(),
    ),
    "exponential": lambda library, A, B, x, y: ((A / 300).exp(), ((A - B) / 40).exp()),
    "solution": lambda library, A, B, x, y: A.solve(B),
    "charpoly": lambda library, A, B, x, y: (A.charpoly(), library.arb_poly(A.charpoly().coeffs()).derivative()),
    "complex": lambda library, A, B, x, y: [
        (z * w, z / w, 1 / w, z**3, abs(z), (z / 90).exp(), z + 1, 2 - w, z * x, -w)
        for z, w in [(library.acb(x, y), library.acb(y, 1))]
    ],
    "complex matrix": lambda library, A, B, x, y: [
        (M * N, M + N * z, M.solve(N), (M / 300).exp(), M.det(), M.charpoly(), M[0, 1], M / 3, M * x, z * N)
        for z in [library.acb(x, y)]
        for M, N in [(library.acb_mat(A) * z, library.acb_mat(B) + library.acb_mat(A) * library.acb(0, 1))]
    ],
    "polynomial": lambda library, A, B, x, y: [
        (p * q, p + q - p, p(x), library.acb_poly(p.coeffs())(library.acb(x, y)), q.degree())
        for p, q in [(library.arb_poly(A.entries()[:4]), library.arb_poly(B.entries()[:3]))]
    ],
}  # fmt: skip


def found(library: Any, kind: str, seed: int, what: Callable[..., Any]) -> Any:
    rng = random.Random(seed)
    size = 3 + seed % 3
    A, B = (made(library, kind, table(rng, size, size)) for _ in range(2))
    x, y = (library.fmpq(n.numerator, n.denominator) for n in (rational(rng, 2), rational(rng, 2) + 200))
    if kind == "arb_mat":
        x, y = library.arb(x), library.arb(y)
    with library.ctx.workprec(128):
        return what(library, A, B, x, y)


@pytest.mark.parametrize("name", EXACT)
def test_both_compute_the_same_exactly(name: str) -> None:
    for seed in SEEDS:
        same(*(found(library, "fmpq_mat", seed, EXACT[name]) for library in (flint, stdlib)))


@pytest.mark.parametrize("name", BALLS)
def test_both_enclose_the_same(name: str) -> None:
    for seed in SEEDS:
        same(*(found(library, "arb_mat", seed, BALLS[name]) for library in (flint, stdlib)))


def contains(ball: Any, number: Fraction) -> bool:
    low, high = ends(ball)
    return low <= number <= high


@pytest.mark.parametrize("seed", SEEDS)
def test_a_ball_holds_what_follows_from_each_of_its_points(seed: int) -> None:
    """Wide balls and points in them: the result holds that of the points."""
    rng = random.Random(seed)
    far = Fraction(1, 10 ** rng.randint(0, 12))

    def wide() -> tuple[Any, Fraction]:
        middle = rational(rng, 3)
        point = middle + far * Fraction(rng.randint(-100, 100), 100)
        return stdlib.arb(stdlib.fmpq(str(middle)), stdlib.fmpq(str(far))), point

    pairs = [[wide() for _ in range(3)] for _ in range(3)]
    M, N = (stdlib.arb_mat([[pair[0] for pair in row] for row in rows]) for rows in (pairs, pairs[::-1]))
    exact = [[pair[1] for pair in row] for row in pairs]
    (a, x), (b, y) = pairs[0][0], pairs[0][1]
    for ball, point in ((a + b, x + y), (a - b, x - y), (a * b, x * y), (abs(a), abs(x)), (a.max(b), max(x, y))):
        assert contains(ball, point)
    if not b.contains(0):
        assert contains(a / b, x / y)
    for i in range(3):
        for j in range(3):
            assert contains((M * N)[i, j], sum((exact[i][k] * exact[2 - k][j] for k in range(3)), Fraction(0)))
            assert contains((M * a)[i, j], exact[i][j] * x) and contains((M / 7)[i, j], exact[i][j] / 7)
    # With a large diagonal for the pivots; the balls beside it may hold zero.
    large, whole = 10**5, [[x + 10**5 * (i == j) for j, x in enumerate(row)] for i, row in enumerate(exact)]
    moved = M + stdlib.arb_mat([[large * (i == j) for j in range(3)] for i in range(3)])
    solution = made(stdlib, "fmpq_mat", whole).solve(made(stdlib, "fmpq_mat", exact))
    for kind in (stdlib.arb_mat, stdlib.acb_mat):
        X = kind(moved).solve(kind(M))
        parts = [X[i, j].real if kind is stdlib.acb_mat else X[i, j] for i in range(3) for j in range(3)]
        assert all(contains(ball, Fraction(str(x))) for ball, x in zip(parts, solution.entries(), strict=True))
    # e^M e^-M is the identity for each point.
    for i in range(3):
        for j in range(3):
            assert ((M / 100).exp() * (M / -100).exp())[i, j].contains(int(i == j))
    assert ((a * a + 1).log().exp() - (a * a + 1)).contains(0)
    assert ((a * a + 1).sqrt() ** 2 - (a * a + 1)).contains(0)
    assert a <= a.upper() and a.lower() <= a and not a < a


@pytest.mark.parametrize("seed", SEEDS)
def test_exact_identities_hold(seed: int) -> None:
    """Without python-flint: a matrix solves its characteristic equation, determinants multiply, an inverse inverts."""
    rng = random.Random(seed)
    size = 1 + seed % 5
    A, B = (made(stdlib, "fmpq_mat", table(rng, size, size)) for _ in range(2))
    one = stdlib.fmpq_mat(size, size, [int(i == j) for i in range(size) for j in range(size)])
    total, power = one * 0, one
    for c in A.charpoly().coeffs():
        total, power = total + power * c, power * A
    assert total == one * 0
    assert (A * B).det() == A.det() * B.det() and A * A.inv() == one and A * A.solve(B) == B
    assert (A * B).transpose() == B.transpose() * A.transpose()


def test_corners() -> None:
    empty, one = stdlib.fmpq_mat(0, 3), stdlib.fmpq_mat([[1]])
    assert (empty.nrows(), empty.ncols(), empty.transpose().nrows()) == (0, 3, 3)
    assert empty.transpose() * empty == stdlib.fmpq_mat(3, 3) and stdlib.fmpq_mat(0, 0).det() == 1
    assert (
        str(stdlib.fmpq(-6, -4)) == "3/2" and str(stdlib.fmpq("-0/5")) == "0" and hash(stdlib.fmpq(1, 2)) == hash(0.5)
    )
    singular = stdlib.fmpq_mat([[1, 2], [2, 4]])
    for refused in (lambda: singular.inv(), lambda: stdlib.arb_mat(singular).solve(stdlib.arb_mat(singular))):
        with pytest.raises(ZeroDivisionError):
            refused()
    around = stdlib.arb(0, 1)
    for what in (lambda: one[0, 0] / around, around.log, around.sqrt, (around * 10**9 + 10**9).exp):
        with pytest.raises(Refused):
            what()
    with pytest.raises(ZeroDivisionError):
        stdlib.fmpq(1, 0)
    assert stdlib.arb(stdlib.fmpq(1, 3)) != stdlib.arb(stdlib.fmpq(2, 3))
    third = stdlib.arb(stdlib.fmpq(1, 3))
    assert [third == third, third != third, stdlib.arb(2) == stdlib.fmpq(2)] == [False, False, True]
    # The first pivot of this symmetric matrix is zero: it is no definite one, and its rows are exchanged.
    P, _, _, U = stdlib.fmpz_mat([[0, 1], [1, 0]]).fflu()
    assert stdlib.fmpz_mat([[1, 0], [0, 1]]) != P and U[1, 1] != 0


SQUARE, LONG, COLUMN = [[2, 1], [0, 3]], [[1, 2, 3], [4, 5, 6]], [[1], [2], [3]]


@pytest.mark.parametrize(
    ("what", "error"),
    [
        (lambda M: M(2, 2, [1, 2, 3]), "3 entries for 2 x 2"),
        (lambda M: M([[1], [1, 2]]), "differ in length"),
        (lambda M: M(SQUARE) + M(LONG), "different shapes are added"),
        (lambda M: M(COLUMN).transpose() + M(COLUMN), "different shapes are added"),
        (lambda M: M(LONG) * M(SQUARE), "shapes do not fit are multiplied"),
        (lambda M: M(LONG).solve(M(SQUARE)), "shapes of an equation do not fit"),
        (lambda M: M(SQUARE).solve(M(COLUMN)), "shapes of an equation do not fit"),
        (lambda M: M(LONG).charpoly(), "only a square matrix"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(what: Callable[[Any], Any], error: str) -> None:
    with pytest.raises(ValueError, match=error):
        what(stdlib.fmpq_mat)


def test_matrices_of_rationals_know_their_shape_and_lowest_terms() -> None:
    with pytest.raises(TypeError, match="an entry that is none"):
        stdlib.fmpq_mat([[1, 0.5]])
    for made, shape in (
        (stdlib.fmpq_mat([]), (0, 0)),
        (stdlib.fmpq_mat(LONG), (2, 3)),
        (stdlib.fmpq_mat(2, 0) * stdlib.fmpq_mat(0, 3), (2, 3)),
    ):
        assert (made.nrows(), made.ncols()) == shape
    half = stdlib.fmpq_mat([[Fraction(1, 2), Fraction(1, 4)]])
    assert (half.low, (half * 4).low, (half * 4).rows, (half / 2).low, (half + half).low) == (4, 1, [[2, 1]], 8, 2)
    assert (
        half != half * 2 and stdlib.fmpq_mat([[1, 2]]) != stdlib.fmpq_mat([[1], [2]]) and half == stdlib.fmpq_mat(half)
    )
    half[0, 1] = Fraction(1, 3)
    assert (half[0, 0], half[0, 1], half.low) == (Fraction(1, 2), Fraction(1, 3), 6)
    assert [stdlib.fmpz_mat(rows).rank() for rows in ([[0, 1], [0, 2]], [[0, 0], [0, 0]], [[1, 2, 3], [2, 4, 7]])] == [
        1,
        0,
        2,
    ]
    assert [stdlib.fmpz_mat([[n]]).inv()[0, 0] * n for n in (-3, 1, 2)] == [1] * 3
    assert (stdlib.fmpq_mat([[3]]) / 2)[0, 0] == Fraction(3, 2)


def test_polynomials_add_up_multiply_and_have_values() -> None:
    p, q = stdlib.fmpq_poly([2, 3, 1, 4]), stdlib.fmpq_poly([1, 2])
    assert [c.degree() for c in (stdlib.fmpq_poly(), stdlib.fmpq_poly([5]), stdlib.fmpq_poly([1, 0, 0]), q)] == [
        -1,
        0,
        0,
        1,
    ]
    assert p.derivative().coeffs() == [3, 2, 12] and (p * q).coeffs() == [2, 7, 7, 6, 8] and q != p
    assert (p(2), stdlib.fmpq_poly()(7), (q - q).coeffs(), (-q).coeffs(), (q + 1).coeffs()) == (
        44,
        0,
        [],
        [-1, -2],
        [2, 2],
    )


@pytest.mark.slow
def test_it_serves_where_there_is_nothing_else(tmp_path: Path) -> None:
    """Without any package: `-S` leaves out all that is installed."""
    path = ROOT / "certificates" / "okajima2023" / "optimum-1-1.json"
    for options in ([], ["--arithmetic", "stdlib"]):
        command = [sys.executable, "-S", "verify.py", *options, str(path)]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
        assert done.stdout.endswith("1 of 1 certificates proved\n"), done
    command = [sys.executable, "-S", "-c", "import flint"]
    assert subprocess.run(command, capture_output=True, check=False).returncode


@pytest.mark.slow
def test_both_say_the_same_of_altered_certificates(tmp_path: Path) -> None:
    paths = []
    for place, (name, certificate) in enumerate((name, each) for name, one in true().items() for each in altered(one)):
        if place % STEP == 0:
            paths.append(tmp_path / f"{name.replace('/', '-')}-{place}.json")
            paths[-1].write_text(json.dumps({**certificate, "paper": None, "claims": []}), encoding="utf-8")
    for name, attack in byhand.attacks().items():
        paths.append(tmp_path / f"attack-{name}.json".replace("/", "-"))
        paths[-1].write_text(json.dumps(attack), encoding="utf-8")
    pairs = list(zip(paths, *(twice.by(name, paths, ROOT, 1) for name in twice.ARITHMETICS), strict=True))
    differing = {path.stem.rpartition("-")[0].partition("-")[2] for path, a, b in pairs if twice.difference(a, b)}
    assert differing <= WIDE
    proved = [path.stem for path, one, _ in pairs if one["proved"]]
    assert not any(name.startswith("attack") for name in proved) and 5 < len(proved) < len(paths) / 2
    assert not any("ended in" in one["line"] for _, *both in pairs for one in both)


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("proved", False),
        ("lower", "1/3"),
        ("holds", False),
        ("sentence", "another"),
        ("items", [["1", "2"]]),
        ("says", []),
    ],
)
def test_a_difference_is_told(part: str, value: Any) -> None:
    (one,) = twice.said([ROOT / "certificates" / "okajima2023" / "optimum-1-1.json"], ROOT, 1)
    assert twice.difference(one, one) == "" and twice.difference(one, {**one, part: value})


@pytest.mark.parametrize(
    ("one", "other", "same_"),
    [
        ("at most 1.500000000", "at most 1.500000001", True),
        ("at most 1.500", "at most 1.501", False),
        ("in [1.87 +/- 4.77e-7]", "in [1.87 +/- 4.78e-7]", True),
        ("in [1.87 +/- 4.77e-7]", "in [1.88 +/- 4.77e-7]", False),
        ("at most 1.5", "at least 1.5", False),
        ("at least 3 of 1.5", "at least 4 of 1.5", False),
        ("at 1.5", "at 1.5 and 1.6", False),
    ],
)
def test_sentences_are_the_same_but_for_ends_of_enclosures(one: str, other: str, same_: bool) -> None:
    assert twice._same_words(one, other) is same_
