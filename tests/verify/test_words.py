"""Words in letters that do not commute: the rules of algebra, and what equalities make of them."""

from flint import fmpq

from replication.verify.algebra.symbolic import Words, blocks, letter, letters, number, one, unit
from replication.verify.kernel import Identity, decide


def test_letters_obey_the_rules_of_matrices() -> None:
    A, B, P = letter("A"), letter("B"), letter("P", symmetric=True)
    assert (A * B).T == B.T * A.T
    assert not (A * B - B * A).is_zero()
    assert ((A + B) * (A + B) - A * A - A * B - B * A - B * B).is_zero()
    assert P.T == P and A.T != A and A.T.T == A
    assert (A.T * P * B).T == B.T * P * A
    assert (A * one() - A).is_zero() and (one() * A - A).is_zero()
    assert (A * fmpq(1, 2) + A * fmpq(1, 2) - A).is_zero()
    assert (A * 0).is_zero()


def test_numbers_commute_with_all() -> None:
    A, B, t, g = letter("A"), letter("B"), number("t"), number("g")
    assert (A * t * B - t * A * B).is_zero() and (A * g * t - t * g * A).is_zero()
    assert (t.T - t).is_zero()
    assert not (t * t - t).is_zero()


def test_words_are_reduced_by_equalities() -> None:
    A, X = letter("A"), letter("X")
    inverse = {(("A", False), ("X", False)): one(), (("X", False), ("A", False)): one()}
    assert (A * X * A - A).reduced(inverse).is_zero()
    assert (X * A * X * number("t") - X * number("t")).reduced(inverse).is_zero()
    assert (A * A * X).reduced(inverse) == A
    assert not (A * X.T).reduced(inverse).is_zero()
    assert (A * X - one()).reduced({}) == A * X - one()


def test_letters_that_are_zero_and_letters_that_are_numbers() -> None:
    A, B = letter("A"), letter("B")
    form = A * B.T * number("t") * 3 - A + one()
    assert form.without("B") == one() - A
    assert form.at({"A": fmpq(2), "B": fmpq(5), "t": fmpq(1, 3)}) == 10 - 2 + 1
    assert Words({}).at({}) == 0


def test_blocks_of_letters_multiply_as_matrices() -> None:
    A, B, P = letters("A", "B", "P", symmetric=("P",))
    zero, same = A * 0, unit(1, one())
    M = blocks([[A, B], [zero, same]])
    decide(Identity(M.T, blocks([[A.T, zero], [B.T, same]]), "the transpose"))
    decide(Identity(M @ M, blocks([[A @ A, A @ B + B], [zero, same]]), "the square"))
    decide(Identity((M.T @ blocks([[P, zero], [zero, P]]) @ M).T, M.T @ blocks([[P, zero], [zero, P]]) @ M, "a form"))
    assert not (A @ B - B @ A).is_zero()
