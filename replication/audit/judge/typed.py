"""Numbers that a sentence only types: they stay when all that it is made from moves, and stand nowhere in it.

A decimal number, or one from a hundred on, that does so must be printed in the paper, or be a number of the results.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from replication.errors import AuditError

_NUMBER = re.compile(
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
        text = next(sentence for sentence in sentences if _NUMBER.sub("#", sentence) == words)
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
        (_NUMBER.sub("#", text), place): number for text in sentences for place, number in enumerate(numbers_in(text))
    }


def numbers_in(text: str) -> Iterator[str]:
    """The numbers of a text as they are written, without their sign; none of those with a power of ten."""
    return (match[0] for match in _NUMBER.finditer(text.replace("\N{MINUS SIGN}", "-")))


def _share(turn: int) -> float:
    return 1 + FIRST + (LAST - FIRST) * (turn * 0.6180339887 % 1.0)


def _moved(value: Any, turns: Iterator[int]) -> Any:
    """The same with each number moved by a share of its own and by one of its list, but for small whole ones."""
    if isinstance(value, Mapping):
        return {key: _moved(entry, turns) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        share = _share(next(turns))
        floats = set(map(type, value)) == {float}  # rows of numbers are most of what there is
        moved = (
            [e * _share(t) for e, t in zip(value, turns, strict=False)] if floats else [_moved(e, turns) for e in value]
        )
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
