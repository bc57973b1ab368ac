"""Matrices of symbols: the rules of algebra, and what is an identity."""

import pytest
from flint import fmpq

from replication.verify.algebra.symbolic import Symbolic, blocks, symbols, unit
from replication.verify.kernel import Identity, decide
from replication.verify.theorem import Refused


def test_matrices_of_symbols_obey_the_rules() -> None:
    m = symbols({"A": (2, 2), "B": (2, 1), "S": (2, 2), "g": (1, 1)}, ("S",))
    A, B, S, g = m["A"], m["B"], m["S"], m["g"].entry
    assert S.T == S and A.T != A
    assert (A @ B).T == B.T @ A.T
    assert ((A + S) @ B - A @ B - S @ B).is_zero()
    assert not (A @ S - S @ A).is_zero()
    assert (A * g - A.each(lambda entry: g * entry)).is_zero()
    assert unit(2, g**0) @ A == A
    first, second = A.rows[0]
    assert (A @ B).rows[0][0] == first * B.rows[0][0] + second * B.rows[1][0]
    assert len({str(entry) for row in A.rows + S.rows for entry in row}) == 7
    assert not Symbolic(((g - g, g),)).is_zero()
    assert -(A * 2) == A * -2 == A - A * 3
    ragged = Symbolic(((g, g), (g,)))
    for wrong in (lambda: A @ B.T, lambda: A + B, lambda: B.T + A, lambda: ragged.T):
        with pytest.raises(ValueError, match="zip"):
            wrong()


def test_mirrored_and_diagonal_symbols() -> None:
    m = symbols({"P": (2, 2), "C": (1, 2), "D": (2, 2), "g": (1, 1)}, symmetric=("P",), diagonal=("D",))
    entries = {str(entry) for M in m.values() for row in M.rows for entry in row}
    assert entries == {"C_0_0", "C_0_1", "P_0_0", "P_0_1", "P_1_1", "D_0_0", "D_1_1", "g_0_0", "0"}
    assert m["P"].rows[0][1] == m["P"].rows[1][0]
    assert m["D"].rows[0][1].is_zero() and m["D"].rows[1][0].is_zero()


def test_blocks_must_fit() -> None:
    m = symbols({"A": (2, 2), "row": (1, 2)})
    A, row = m.values()
    assert blocks([[A, A], [row, row]]).rows[2] == row.rows[0] * 2
    with pytest.raises(ValueError, match="zip"):
        blocks([[A, row]])


def test_what_is_no_identity_is_refused() -> None:
    a, b, c = symbols({"a": (1, 2), "b": (2, 1), "c": (1, 1)}).values()
    same = a @ b
    decide(Identity(same, (same + same) * fmpq(1, 2), ""))
    assert len({str(entry) for M in (a, b, c) for row in M.rows for entry in row}) == 5
    with pytest.raises(Refused, match="row is no identity"):
        decide(Identity(a, blocks([[Symbolic(((a.rows[0][0],),)), c]]), "row"))
    for other in (c, same * 2, same + c):
        with pytest.raises(Refused, match="sum is no identity"):
            decide(Identity(same, other, "sum"))
