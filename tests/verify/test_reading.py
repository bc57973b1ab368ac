"""Strict reading: a certificate that two readers could understand in two ways, or that is too large, is refused."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from flint import fmpq, fmpq_mat

from replication.verify import reading
from replication.verify.theorem import Refused

GOOD = (Path(__file__).parents[2] / "certificates" / "okajima2023" / "gains-33.json").read_bytes()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (GOOD[:-20], "not valid JSON"),
        (GOOD[: len(GOOD) // 2], "not valid JSON"),
        (GOOD + b"}", "not valid JSON"),
        (b"", "not valid JSON"),
        (b"\xff\xfe", "not valid JSON"),
        (b"{'a': 1}", "not valid JSON"),
        (b"[" * 100_000, "not valid JSON"),
        (b'{"a": NaN}', "the number NaN is not exact"),
        (b'{"a": Infinity}', "the number Infinity is not exact"),
        (b'{"a": -Infinity}', "the number -Infinity is not exact"),
        (b'{"a": 1.5}', "the number 1.5 is not exact"),
        (b'{"a": 1e400}', "the number 1e400 is not exact"),
        (b'{"a": 1234567890}', "the integer 1234567890... is too long"),
        (b'{"a": ' + b"9" * 100_000 + b"}", "is too long"),
        (b'{"a": 1, "a": 1}', "the key 'a' stands twice"),
        (b'{"a": {"b": 1, "c": 2, "b": 3}}', "the key 'b' stands twice"),
        (b" " * (reading.MAX_BYTES + 1), "bytes, more than"),
    ],
)
def test_a_file_that_is_not_strict_is_refused(content: bytes, reason: str) -> None:
    with pytest.raises(Refused, match=reason):
        reading.parse(content)


def test_what_is_read_is_what_is_written() -> None:
    value = json.loads(GOOD)
    assert reading.parse(GOOD) == value
    assert reading.parse(b'{"a": -12345678, "b": 123456789}') == {"a": -12345678, "b": 123456789}
    assert reading.parse(b" " * (reading.MAX_BYTES - 2) + b"{}") == {}
    M = fmpq_mat([[1, fmpq(-2, 3)], [0, 5]])
    assert reading.matrix(reading.written(M), "M") == M
    assert reading.written({"a": (fmpq(1, 2), None, True, 3, "x"), "b": [M]}) == {
        "a": ["1/2", None, True, 3, "x"],
        "b": [[["1", "-2/3"], ["0", "5"]]],
    }


LONGEST = ["1" * reading.MAX_DIGITS, "-" + "1" * reading.MAX_DIGITS + "/" + "3" * reading.MAX_DIGITS]


@pytest.mark.parametrize("text", ["0", "1", "-1", "12/7", "-12/7", "4/6", "3/100", *LONGEST])
def test_rationals(text: str) -> None:
    number, wanted = reading.rational(text, "x"), Fraction(text)
    assert (int(number.numer()), int(number.denom())) == (wanted.numerator, wanted.denominator)


@pytest.mark.parametrize(
    "value",
    [
        "NaN", "inf", "-inf", "1.5", "1e3", "0x1", "1/0", "1/-2", "--1", "+1", "01", "1/02", "1 ", " 1", "", "-", "/2",
        "1/", "1/2/3", "１", "1_0", 1, 1.5, None, True, ["1"], "1" * (reading.MAX_DIGITS + 1),
        "1/" + "1" * (reading.MAX_DIGITS + 1), "9" * 10**6,
    ],
)  # fmt: skip
def test_what_is_no_rational(value: Any) -> None:
    with pytest.raises(Refused, match=r"^x\[2\] "):
        reading.rational(value, "x[2]")


def test_positive_numbers_and_integers() -> None:
    assert reading.positive("1/9", "x") == fmpq(1, 9)
    for text in ("0", "-1"):
        with pytest.raises(Refused, match="x must be positive"):
            reading.positive(text, "x")
    assert reading.integer(0, "x") == 0 and reading.integer(2, "x", 2) == 2
    for value, least in ((-1, 0), (1, 2), (True, 0), ("1", 0), (None, 0)):
        with pytest.raises(Refused, match="x must be"):
            reading.integer(value, "x", least)


def test_names() -> None:
    assert [reading.name_of(name, "x") for name in ("a", "A.b_c-9", "x" * 80)] == ["a", "A.b_c-9", "x" * 80]
    for name in ("", "a b", "a\n", "a/b", "é", "x" * 81):
        with pytest.raises(Refused, match="x must have 1 to 80 letters"):
            reading.name_of(name, "x")


def test_names_and_integers_out_of_a_range_are_refused() -> None:
    assert reading.one_of("b", "x", ("a", "b")) == "b" and reading.integer(3, "x", 0, 3) == 3
    assert reading.integer(10**8, "x") == 10**8
    with pytest.raises(Refused, match="x must be one of a, b, got 'c'"):
        reading.one_of("c", "x", ("a", "b"))
    with pytest.raises(Refused, match="x must be a string"):
        reading.one_of(["a"], "x", ("a", "b"))
    with pytest.raises(Refused, match="x must be at most 3, got 4"):
        reading.integer(4, "x", 0, 3)


def test_a_file_is_read_as_far_as_its_size_allows(tmp_path: Path) -> None:
    with mock.patch.object(reading, "MAX_BYTES", 10):
        for size in (0, 10):
            (tmp_path / "file").write_bytes(b"1" * size)
            assert reading.content(tmp_path / "file") == b"1" * size
        (tmp_path / "file").write_bytes(b"1" * 11)
        with pytest.raises(Refused, match="the file has 11 bytes, more than 10"):
            reading.content(tmp_path / "file")
        with pytest.raises(Refused, match="no regular file"):
            reading.content(tmp_path)
        # Of a file that grew since it was measured no more is read than shows that.
        measured = tmp_path / "empty"
        measured.touch()
        (tmp_path / "file").write_bytes(b"1" * 12)
        before = measured.stat()
        with mock.patch.object(Path, "stat", lambda path: before):
            assert reading.content(tmp_path / "file") == b"1" * 11


def test_the_common_denominator_of_a_matrix_is_limited() -> None:
    half = 10 ** (reading.MAX_DIGITS // 2)
    assert reading.matrix([[f"1/{half - 1}", f"1/{half}"]], "M").ncols() == 2
    assert reading.matrix([["1/" + "9" * reading.MAX_DIGITS]], "M").ncols() == 1
    with pytest.raises(Refused, match="M has a common denominator of more than 1000 digits"):
        reading.matrix([[f"1/{2**reading.MAX_DIGITS}", f"1/{5**reading.MAX_DIGITS}"]], "M")
    with pytest.raises(Refused, match="M has a common denominator of more than 1000 digits"):
        reading.matrix([[f"1/{half - 1}", f"1/{half}", f"1/{half + 1}"]], "M")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([], "M must have 2 entries, got 0"),
        ([[], []], r"rows of one length, at least 1, got \[0\]"),
        ([["1"], ["1", "2"]], r"rows of one length, at least 1, got \[1, 2\]"),
        ([["1", "2"]], "M must have 2 entries, got 1"),
        ([["1"], ["2"]], "M must have 2 columns"),
        ([["1", "2"], ["3", "nan"]], r"M\[1\]\[1\] must be a rational"),
        ([["1", "2"], "34"], r"M\[1\] must be a list"),
        ("M", "M must be a list"),
    ],
)
def test_matrices_of_another_shape_are_refused(value: Any, reason: str) -> None:
    with pytest.raises(Refused, match=reason):
        reading.matrix(value, "M", 2, 2)


def test_sizes_are_limited() -> None:
    assert reading.matrix([["1"] * 200] * 200, "M").ncols() == 200
    assert len(reading.sequence(["1"] * 40_000, "x", reading.rational)) == 40_000
    with pytest.raises(Refused, match="more than 40000"):
        reading.matrix([["1"] * 201] * 200, "M")
    with pytest.raises(Refused, match="more than 40000"):
        reading.sequence(["1"] * 40_001, "x", reading.rational)


def test_symmetric_matrices() -> None:
    assert reading.symmetric([["1", "2"], ["2", "3"]], "M", 2)[0, 1] == 2
    for value, reason in (
        ([["1", "2"], ["2/1", "3"]], None),
        ([["1", "2"], ["3", "3"]], "M must be symmetric"),
        ([["1", "2"]], "M must be square"),
    ):
        if reason is None:
            assert reading.symmetric(value, "M") == reading.matrix([["1", "2"], ["2", "3"]], "M")
        else:
            with pytest.raises(Refused, match=reason):
                reading.symmetric(value, "M")


def test_matrices_of_states_are_square_and_limited() -> None:
    assert reading.square([["1", "2"], ["3", "4"]], "A")[1, 0] == 3
    assert reading.states([["1"] * 50] * 50, "A").nrows() == 50
    with pytest.raises(Refused, match="A must be square, got 1 x 2"):
        reading.square([["1", "2"]], "A")
    with pytest.raises(Refused, match="A has 51 states, more than 50"):
        reading.states([["1"] * 51] * 51, "A")


def test_some_fields_of_an_object_may_be_read() -> None:
    assert reading.known_fields({"c": 3, "b": 2, "a": 1}, "x", "a", "b") == (1, 2)
    for value, reason in (({"a": 1}, "x lacks the field b"), ([], "x must be an object")):
        with pytest.raises(Refused, match=reason):
            reading.known_fields(value, "x", "a", "b")


def test_lists_of_some_entries() -> None:
    assert reading.several(["1"], "x", reading.rational, 1) == [1]
    assert reading.several(["1", "2"], "x", reading.rational) == [1, 2]
    for value, reason in (([], "x is empty"), (["1", "2"], "x has more than 1 entries"), ("1", "x must be a list")):
        with pytest.raises(Refused, match=reason):
            reading.several(value, "x", reading.rational, 1)
