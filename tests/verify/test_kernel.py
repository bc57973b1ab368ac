"""The kernel: an obligation is proved where it holds, by whatever room, and refused where it fails, or only nearly."""

from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from flint import arb, arb_mat, arb_poly, fmpq, fmpq_mat, fmpq_poly

from replication.verify import kernel
from replication.verify.algebra.linear import identity, zeros
from replication.verify.kernel import AtMost, Below, Hurwitz, Nonnegative, Positive, Within, decide, holds
from replication.verify.run import verify
from replication.verify.theorem import Refused

DEFINITE = fmpq_mat([[2, -1, 0], [-1, 2, -1], [0, -1, 2]])
SINGULAR = fmpq_mat([[1, 1], [1, 1]])
INDEFINITE = fmpq_mat([[1, 2], [2, 1]])
HOLLOW = fmpq_mat([[0, 1], [1, 0]])
SKEW = fmpq_mat([[1, fmpq(1, 10**30)], [0, 1]])
BALL = arb(0, fmpq(1, 2))
"""From -1/2 to 1/2."""


def test_positive_definite() -> None:
    decide(Positive(DEFINITE, "M"))
    decide(Positive(DEFINITE / 7, "M"))
    decide(Positive(identity(1), "M"))
    # By 10^-60 only.
    near = fmpq_mat([[1, 1 - fmpq(1, 10**60)], [1 - fmpq(1, 10**60), 1]])
    decide(Positive(near, "M"))


@pytest.mark.parametrize("M", [SINGULAR, INDEFINITE, HOLLOW, -DEFINITE, zeros(2, 2), fmpq_mat([[0, 0], [0, 1]])])
def test_not_positive_definite(M: fmpq_mat) -> None:
    with pytest.raises(Refused, match="M is not positive definite"):
        decide(Positive(M, "M"))


def test_semidefinite() -> None:
    for M in (DEFINITE, SINGULAR, zeros(2, 2), zeros(3, 3), identity(2)):
        decide(Nonnegative(M, "M"))
    for M in (INDEFINITE, HOLLOW, -SINGULAR, -identity(3), -identity(1)):
        with pytest.raises(Refused, match="M is not positive semidefinite"):
            decide(Nonnegative(M, "M"))


def test_definiteness_is_for_symmetric_matrices() -> None:
    for judgement in (Positive, Nonnegative):
        with pytest.raises(Refused, match="M is not symmetric"):
            decide(judgement(SKEW, "M"))


@pytest.mark.parametrize(
    "M",
    [
        [[2, 0], [1, 1]],
        [[arb(1, fmpq(1, 2))]],
        [[4, 0, 0], [2, 2, 0], [2, 1, arb(fmpq(3, 2), fmpq(1, 4))]],
        [[arb(2), BALL], [BALL, arb(1)]],
    ],
)
def test_positive_definite_by_the_lower_triangle(M: list[list[arb]]) -> None:
    decide(Positive(arb_mat(M), "M"))


@pytest.mark.parametrize(
    ("M", "pivot"),
    [
        ([[0]], 0),
        ([[BALL]], 0),
        ([[arb("nan")]], 0),
        ([[-1]], 0),
        ([[1, 0], [1, 1]], 1),
        ([[1, 0], [2, 1]], 1),
        ([[1, 0], [1, arb(1, fmpq(1, 2))]], 1),
        ([[4, 0, 0], [2, 2, 0], [2, 1, 1]], 2),
        ([[4, 0, 0], [2, 2, 0], [2, 3, arb(1, fmpq(1, 2))]], 2),
    ],
)
def test_what_is_not_proved_positive_definite(M: list[list[arb]], pivot: int) -> None:
    with pytest.raises(Refused, match=f"M is not proved positive definite: pivot {pivot} is"):
        decide(Positive(arb_mat(M), "M"))


def test_only_square_matrices_are_definite() -> None:
    for M in ([[1, 0]], [[1], [0]]):
        with pytest.raises(Refused, match="M is not square"):
            decide(Positive(arb_mat(M), "M"))


def test_balls_are_less_only_if_all_points_are() -> None:
    assert holds(Below(arb(1, 0.5), arb(3, 1), "no")) and holds(AtMost(arb(1), arb(1), "no"))
    for first, second in ((arb(1), arb(1)), (arb(1, 0.5), arb(1.75, 0.5)), (2, 1), (fmpq(1), 1), (arb("nan"), 1)):
        assert Below(first, second, "the reason").failure() == "the reason"
    for first, second in ((arb(1, 0.5), arb(1.75, 0.5)), (2, 1), (fmpq(3, 2), fmpq(1)), (0, arb("nan"))):
        assert AtMost(first, second, "the reason").failure() == "the reason"
    assert not AtMost(fmpq(1), 1, "no").failure() and not Below(0, fmpq(1, 9), "no").failure()


@pytest.mark.parametrize(
    ("coefficients", "stable"),
    [
        ([], False),
        ([1], True),
        ([-3], True),
        ([1, 2], True),
        ([1, -2], True),
        ([2, 1], False),
        ([1, 1], False),
        ([-1, 1], False),
        ([0, 0, 0, 5], True),
        # z^2 - z + 1/2 has roots of modulus 1/sqrt(2); z^2 - 2 z + 1 a double one; z^2 + 1 a pair on the circle.
        ([1, -2, 2], True),
        ([1, -2, 1], False),
        ([1, 0, 1], False),
        # (z - 1/2)(z - 2) and (z - 1/2)(z - 1/3)(z + 3/4): 24 times.
        ([2, -5, 2], False),
        ([3, -11, -2, 24], True),
        # (z - 1)(z - 1/2)(z + 1/2)
        ([1, -1, -4, 4], False),
    ],
)
def test_schur(coefficients: list[int], stable: bool) -> None:
    assert holds(Within(fmpq_poly(coefficients), "roots")) is stable


def companion(*coefficients: int) -> fmpq_mat:
    """A matrix with the characteristic polynomial s^n + .. + a_1 s + a_0, given a_0, a_1, .."""
    n = len(coefficients)
    last = [[-entry for entry in coefficients]]
    return fmpq_mat([[int(j == i + 1) for j in range(n)] for i in range(n - 1)] + last)


# s + 1, s^2 + s + 1, (s + 1)^3, s^4 + 2 s^3 + 3 s^2 + 2 s + 1, s^3 + s^2 + 2 s + 1, (s + 1)^5.
@pytest.mark.parametrize("M", [(1,), (1, 1), (1, 3, 3), (1, 2, 3, 2), (1, 2, 1), (1, 5, 10, 10, 5)])
def test_hurwitz(M: tuple[int, ...]) -> None:
    decide(Hurwitz(companion(*M), "M"))


@pytest.mark.parametrize("M", [(0,), (-1,), (1, 0), (0, 1), (-1, 1), (1, 1, 1), (4, 2, 1), (0, 1, 1), (1, 1, 1, 1)])
def test_not_hurwitz(M: tuple[int, ...]) -> None:
    with pytest.raises(Refused, match="M is not Hurwitz"):
        decide(Hurwitz(companion(*M), "M"))


def test_schur_of_a_high_degree_ends() -> None:
    """Of degree 40: a recursion that multiplies by both ends would double the digits 40 times."""
    inside = fmpq_poly([fmpq(1, 3), *[fmpq(1, 1000 + k) for k in range(39)], 1])
    assert holds(Within(inside, "roots"))
    assert not holds(Within(fmpq_poly(inside.coeffs()[::-1]), "roots"))
    assert holds(Within(fmpq_poly([fmpq(1, 2), *[0] * 39, 1]), "roots"))


@pytest.mark.parametrize("seed", range(20))
def test_roots_within_a_circle_are_told_from_roots_outside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    coefficients = [*rng.integers(-9, 10, size=int(rng.integers(1, 6))).tolist(), 3]
    polynomial, size = arb_poly(coefficients), float(max(abs(np.roots(coefficients[::-1]))))
    decide(Within(polynomial, "roots", fmpq(int(size * 1001) + 1, 1000)))
    with pytest.raises(Refused, match="roots are not proved to lie inside"):
        decide(Within(polynomial, "roots", fmpq(int(size * 999), 1000)))
    with pytest.raises(Refused, match="roots are not proved to lie inside"):
        decide(Within(arb_poly([-1, 1]), "roots"))


PROVED = (
    "okajima2023/gains-38", "okajima2023/optimum-1-1", "okajima2023/gains-33-one-matrix", "okajima2023/schur",
    "mustafa/lemma-2", "mustafa/stable-1", "mustafa/our-filter-lower", "mustafa/nominal-1-upper", "mustafa/floor-2",
    "shao/lyapunov", "shao/coordinates", "shao/counterexample", "peet2019/ex1-lower", "peet2019/ex1-upper",
    "peet2019/observer-bound",
)  # fmt: skip


@pytest.mark.parametrize("name", PROVED)
def test_no_obligation_is_handed_over_in_vain(name: str) -> None:
    """Whichever of them is not proved, neither is the theorem."""
    path = Path(__file__).parents[2] / "certificates" / f"{name}.json"
    with patch.object(kernel, "require") as settled:
        assert verify(path).theorem is not None
    stated = settled.call_count
    assert stated > 0 and not any(call.args[1] for call in settled.call_args_list)
    for last in sorted({0, stated // 2, stated - 1}):
        refusal = [None] * last + [Refused("as planted")]
        with patch.object(kernel, "require", side_effect=refusal):
            assert verify(path).reason == "as planted"
