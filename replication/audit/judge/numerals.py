"""How the report writes numbers, and what numbers its sentences may have: every digit that it shows is made here.

A sentence has few numbers. One that a sentence only types stays when all that it is made from moves, and stands nowhere
in it; a decimal number, or one from a hundred on, that does so must be printed in the paper, or be one of the results.
"""

import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from typing import Any

from replication.audit.model import Numbers
from replication.errors import AuditError

SHOWN = 6
"""Significant digits of a number that no print says more of."""
BEYOND = 4
CROWDED = 1
"""Digits shown beyond the last printed place; the second where several numbers stand in a line."""

MORE = 3
"""Digits more that keep a number in its bracket at most."""

NEGLIGIBLE = 1e-6
"""Units of the last printed place below which a deviation is shown as zero."""

SMALLEST = 5
"""Zeros after which a small number is written with a power of ten."""

MINUS = "\N{MINUS SIGN}"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_DIGITS = 60
"""Digits in which the end of a bracket is written at most; a float near 1 has no more than 53."""

_LONGEST = 15
"""Digits before the point from which a number is written with a power of ten."""


def short(number: float, digits: int = SHOWN) -> str:
    """`number` to that many significant digits, with a power of ten where it is very large or small.

    Below a million all digits before the point are shown: 12 and not 10¹.
    """
    if isinstance(number, bool):
        return "yes" if number else "no"
    if isinstance(number, int) and abs(number) < 10**_LONGEST:
        return _typeset(str(number))
    if 1 <= abs(number) < 10**SHOWN:
        digits = max(digits, len(str(int(abs(number)))))
    return _typeset(f"{number:.{digits}g}")


def full(number: float) -> str:
    """The shortest digits that give exactly this float back."""
    return _typeset(repr(number))


def signed(number: float) -> str:
    """`number` to three significant digits, or whole ones, with its sign also when it is positive.

    Zero has no sign, and what is below `NEGLIGIBLE` is zero: rounding, not a deviation.
    """
    if abs(number) < NEGLIGIBLE:
        return "0"
    text = _typeset(f"{number:.0f}") if 100 <= abs(number) < 10**6 else short(number, 3)
    return text if number <= 0 else f"+{text}"


def rough(number: float) -> str:
    """`number` to two significant digits, from 10 on to three, with the zeros at the end."""
    return _typeset(f"{number:#.{2 if abs(number) < 10 else 3}g}".removesuffix("."))


def seconds(number: float) -> str:
    """Seconds to two decimals, shorter times to one digit."""
    return f"{number:.2f}" if number >= 0.01 or number == 0 else short(number, 1)


def at_print(
    number: float,
    unit: Fraction,
    beyond: int = BEYOND,
    low: Fraction | float = -math.inf,
    high: Fraction | float = math.inf,
) -> tuple[str, str]:
    """`number` cut at the last printed place `unit` (a power of ten): the digits up to there, and those beyond.

    It is rounded `beyond` digits further on, so that both parts read on as one number, and stays in its bracket from
    `low` to `high` with up to `MORE` digits more, where that is not narrower still.
    """
    decimals = max(0, len(str(unit.denominator)) - 1)
    if abs(number) >= 10.0**_LONGEST:
        return short(number), ""
    if not decimals and float(number).is_integer():
        return _typeset(f"{number:.0f}"), ""
    text = next(filter(None, (_inside(number, decimals + n, low, high) for n in range(beyond, beyond + MORE + 1))), "")
    text = text or f"{number:.{decimals + beyond}f}"
    # Beyond a whole last place the point belongs to the muted part.
    cut = text.index(".") + (1 + decimals if decimals else 0)
    return _typeset(text[:cut]), text[cut:]


def _inside(number: float, places: int, low: Fraction | float, high: Fraction | float) -> str:
    """`number` rounded to so many places, else down, else up, whichever lies between both ends; empty if none does."""
    for rounding in (ROUND_HALF_EVEN, ROUND_FLOOR, ROUND_CEILING):
        shown = Decimal(number).quantize(Decimal(1).scaleb(-places), rounding, Context(prec=MOST_DIGITS))
        if low <= Fraction(shown) <= high:
            return f"{shown:f}"
    return ""


def agreement(printed: str, computed: str) -> int:
    """How many leading characters of `computed` stand at the same places in `printed`; 0 unless the points align."""
    if printed.lstrip(MINUS).startswith("."):
        printed = printed.replace(".", "0.", 1)
    if places(printed) != places(computed):
        return 0
    shorter = min(len(printed), len(computed))
    return next((i for i, pair in enumerate(zip(printed, computed, strict=False)) if len(set(pair)) > 1), shorter)


def places(text: str) -> int:
    """Characters before the decimal point."""
    return len(text.partition(".")[0])


def exact(number: Fraction) -> str:
    """A fraction that comes from decimals, such as an end of a rounding interval, in all its digits."""
    return decimal(_rounded(number, MOST_DIGITS))


def end(number: Fraction, *others: Fraction) -> str:
    """An end of an interval in all its digits if these end, else in enough to tell it from `others`."""
    return digits(number, *others) if 10**MOST_DIGITS % number.denominator else exact(number)


def decimal(number: Decimal) -> str:
    """`number` in all its digits, with a power of ten only where it is very large or small."""
    plain = number.normalize()
    return _typeset(f"{plain:f}" if not plain or -SMALLEST <= plain.adjusted() < _LONGEST else f"{plain:e}")


def layout(numbers: Numbers, write: Callable[[float], str] = short) -> str:
    """`numbers` in the way of their layout: a scalar, a list in parentheses, or rows in square brackets."""
    if not isinstance(numbers, tuple):
        return write(numbers)
    if any(isinstance(row, tuple) for row in numbers):
        rows = (" ".join(map(write, row)) if isinstance(row, tuple) else write(row) for row in numbers)
        return f"[{'; '.join(rows)}]"
    return f"({', '.join(write(number) for number in numbers if not isinstance(number, tuple))})"


def enclosure(low: Fraction | float, high: Fraction | float, *ends: Fraction) -> str:
    """A bracket rounded outwards, fine enough to show its width and to stand on its side of all `ends`."""
    width = high - low or math.inf
    return f"[{_outward(low, ROUND_FLOOR, width, ends)}, {_outward(high, ROUND_CEILING, width, ends)}]"


def _outward(number: Fraction | float, rounding: str, width: Fraction | float, ends: Sequence[Fraction]) -> str:
    """`number` rounded down or up by no more than `width`, in at least six digits."""
    if not math.isfinite(number):
        return _typeset(str(number))
    for count in range(6, MOST_DIGITS):
        rounded = _rounded(number, count, rounding)
        shown = Fraction(rounded)
        if -width <= shown - number <= width and all(_side(shown, end) == _side(number, end) for end in ends):
            return decimal(rounded)
    return exact(Fraction(number))


def at_most(number: float, digits: int = 2) -> str:
    """An upper bound to so many significant digits, rounded up: what "at most" stands before."""
    return decimal(_rounded(number, digits, ROUND_CEILING))


def at_least(number: float, digits: int = 2) -> str:
    """A lower bound to so many significant digits, rounded down: what "at least" stands before."""
    return decimal(_rounded(number, digits, ROUND_FLOOR))


def outward(low: float, high: float, digits: int = 4) -> tuple[float, float]:
    """Both ends of a bracket to so many significant digits, rounded outwards."""
    return float(_rounded(low, digits, ROUND_FLOOR)), float(_rounded(high, digits, ROUND_CEILING))


def _rounded(number: float | Fraction, digits: int, rounding: str = ROUND_HALF_EVEN) -> Decimal:
    exact = Fraction(number)
    return Context(prec=digits, rounding=rounding).divide(Decimal(exact.numerator), Decimal(exact.denominator))


def digits(number: Fraction, *ends: Fraction, least: int = 6) -> str:
    """`number` in `least` significant digits, or in as many as it takes to stand on its side of all `ends`."""
    value = nearest(number)
    for count in range(least, 18):
        text = f"{value:.{count}g}"
        if all(_side(Fraction(text), end) == _side(number, end) for end in ends):
            return decimal(Decimal(text))
    return full(value)


def nearest(number: Fraction) -> float:
    """The nearest float; beyond their range the largest one, which is as telling for a deviation."""
    largest = Fraction(sys.float_info.max)
    return float(max(-largest, min(largest, number)))


def _side(number: Fraction | float, end: Fraction) -> int:
    return (number > end) - (number < end)


def _typeset(text: str) -> str:
    mantissa, mark, exponent = text.partition("e")
    if mark:
        power = f"10{str(int(exponent)).translate(_SUPERSCRIPT)}"
        mantissa = power if mantissa == "1" else f"{mantissa}×{power}"
    return mantissa.replace("-", MINUS)


MOST_WORDS, MOST_WORDS_OF_TITLE, MOST_NUMBERS = 25, 15, 2

LINK = re.compile(r"\[([^\[\]]+)\]\(([+\-?]?)([\w.\-]+)\)")
"""`[words](name)`: words that link a claim or an erratum, perhaps with a sign of what they say of it."""

_NAMED = re.compile(
    r"\b(?:Theorem|Lemma|Corollary|Algorithm|Example|Table|Section|Sec|Fig|Case|step|eq|degree|column|period)s?\.?\s+"
    r"[\dIVX]+(?:(?:\s*[-–,]\s*|\s+(?:and|or)\s+)\d+)*|[(\[][\d,\s]+[)\]]",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"(?<![\w.])\d+(?:,\d{3})*(?:\.\d+)?(?:×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+|e[-+]?\d+)?|(?<![\w.])\.\d+")


def require_short(sentence: str, most_words: int = MOST_WORDS, what: str = "finding") -> str:
    """`sentence` itself; AuditError that says by how much it is too long, or has too many numbers.

    Links count as their words. Theorem 3, degree 2 or (34) is a name, no number.
    """
    text = LINK.sub(r"\1", sentence)
    words, numbers = text.split(), _NUMBER.findall(_NAMED.sub(" ", text))
    if len(words) > most_words:
        raise AuditError(
            f"a {what} has at most {most_words} words, this one {len(words)}: {text!r}; shorten or split it"
        )
    if len(numbers) > MOST_NUMBERS:
        raise AuditError(
            f"a {what} has at most {MOST_NUMBERS} numbers, this one {', '.join(numbers)}: {text!r}; say it with fewer"
        )
    return sentence


def require_title(title: str) -> str:
    """The same for the title of a figure or picture, which is its message."""
    return require_short(title, MOST_WORDS_OF_TITLE, "title")


_WRITTEN = re.compile(
    r"(?<![\w.,^])(?<![eE][-+])(?:(?:[0-9]{1,3}(?:,[0-9]{3})+|[0-9]+)(?:\.[0-9]+)?|\.[0-9]+)(?!\.?[\w^])"
)
WHOLE = 100
"""Whole numbers below may count something."""
FIRST, LAST = 0.1, 0.6
"""Shares by which numbers are moved, spread between these by the golden ratio."""


def require_found(what: str, ask: Callable[[Any], Iterable[str]], given: Any, elsewhere: Iterable[str]) -> None:
    """Raise AuditError for the first number of the sentences that does not move with what they are made from.

    what: the kind of sentence. given: JSON, or mappings of columns. elsewhere: texts in which a number may stand as
    well. Where the function fails on what was moved, nothing is decided.
    """
    known = {number for text in elsewhere for number in numbers_in(text)}
    sentences = list(ask(given))
    items = _by_place(sentences).items()
    # A number that says more than how many, or which one.
    telling = [(place, number) for place, number in items if "." in number or float(number.replace(",", "")) >= WHOLE]
    suspects = {place: number for place, number in telling if number not in known}
    for turn in (0, 1):
        if not suspects:
            return
        try:
            again = _by_place(ask(_moved(given, iter(range(turn, 10**9)))))
        except Exception:  # noqa: BLE001 - a sentence may have no words for what cannot be
            return
        suspects = {place: number for place, number in suspects.items() if again.get(place) == number}
    for (words, _), number in suspects.items():
        text = next(sentence for sentence in sentences if _WRITTEN.sub("#", sentence) == words)
        if not any(_is(value, number) for value in _values(given)):
            raise AuditError(
                f"the {what} {text!r} says {number}, which the paper does not print, is no number of what the sentence "
                "is made from, and does not change with that; take it from there"
            )


def _is(value: float, number: str) -> bool:
    """Whether a value is written so; a whole number may be its neighbour, as the last of so many."""
    shown, places = float(number.replace(",", "")), len(number.partition(".")[2])
    return abs(abs(value) - shown) <= 1 if not places else round(abs(value), places) == shown


def _by_place(sentences: Iterable[str]) -> dict[tuple[str, int], str]:
    """The numbers by the words around them, numbers aside, and their place among these."""
    return {
        (_WRITTEN.sub("#", text), place): number for text in sentences for place, number in enumerate(numbers_in(text))
    }


def numbers_in(text: str) -> Iterator[str]:
    """The numbers of a text as they are written, without their sign; none of those with a power of ten."""
    return (match[0] for match in _WRITTEN.finditer(text.replace("\N{MINUS SIGN}", "-")))


def _share(turn: int) -> float:
    return 1 + FIRST + (LAST - FIRST) * (turn * 0.6180339887 % 1.0)


def _moved(value: Any, turns: Iterator[int]) -> Any:
    """The same with each number moved by a share of its own and by one of its list, but for small whole ones."""
    if isinstance(value, Mapping):
        return {key: _moved(entry, turns) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        share, moved = _share(next(turns)), [_moved(entry, turns) for entry in value]
        return type(value)(share * entry if isinstance(entry, float) else entry for entry in moved)
    if isinstance(value, bool) or not isinstance(value, int | float) or (isinstance(value, int) and value < WHOLE):
        return value
    return type(value)(value * _share(next(turns)))


def _values(value: Any) -> Iterator[float]:
    """All numbers, and how many stand in each list."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        yield len(value)
        for entry in value:
            yield from _values(entry)
    elif isinstance(value, int | float):
        yield float(value)
