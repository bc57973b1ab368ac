"""Does every number on the page come from its results? The finished page is read again, as its reader sees it.

A number may stand on the page if it is part of a text of the results (a statement, a place such as "Table 1", a date),
or if it is a number of the results, or one that a builder derived from them and handed over as a number (a count, a
deviation), written with as many digits as one likes. Names, checksums and inputs (`code`, `pre`) and drawings (`svg`),
which have a checksum of their own, are not read. A number that was typed into a template or into a sentence is neither.
Briefs, titles and captions are written by hand: a number in them must stand elsewhere in the results.
"""

import bisect
import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from html.parser import HTMLParser
from typing import Any

import msgspec

from replication.audit.brief import Brief
from replication.audit.judge import numerals
from replication.audit.store.records import FigureRecord
from replication.errors import AuditError

NOT_READ = frozenset({"script", "style", "svg", "code", "pre"})
READ_ATTRIBUTES = frozenset({"aria-label", "alt", "title", "content"})
WITHIN = frozenset({"span", "sub", "sup"})
"""What may stand inside a word: the digits of one number, an index, a power."""
WHOLE = 100
"""Integers below are compared exactly; from here on they may be rounded numbers."""

OF_A_BOUND = numerals.SHOWN
"""A number with so many digits may be a bound, which is rounded outwards, by up to a unit of its last place."""

_POWERS = str.maketrans("⁻−⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
_RAISED = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_CARET = re.compile(r"(?<=[0-9])\^\{?\+?([-−]?[0-9]+)\}?")
_NUMBER = re.compile(
    r"(?<![\w.])([0-9]++(?:\.[0-9]++)?+|\.[0-9]++)(?:×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)|e([-+−]?[0-9]+))?(?![⁻⁰¹²³⁴⁵⁶⁷⁸⁹])"
)
_POWER = re.compile(r"(?<![\w.×])([0-9]++)([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)")
_RATIONAL = re.compile(r"-?[0-9]+/[0-9]+")
"""A text that is one exact number, such as the end of an interval, is none in whose words a number may stand."""
_AROUND = 60


def require_sourced(page: Mapping[str, str], *sources: Any) -> None:
    """Raise AuditError that names the first number on `page` that is in none of `sources`, with the text around it.

    page: HTML by the part of the report that it is, which the message names; "" for the page itself.
    sources: what the page was made from, first of all the results; dataclasses, structs, mappings and sequences are
    looked through for numbers, and the texts of the first one for numbers in words.
    """
    known = sorted({abs(Fraction(number)) for number in numbers_of(sources)})
    words = {number.group() for text in _texts(sources[0]) for number in _numbers(text)}
    for name, html in page.items():
        for text in _read(html):
            for number in _numbers(text):
                if number.group() not in words and not _is_one_of(number, known):
                    around = text[max(0, number.start() - _AROUND) : number.end() + _AROUND].strip()
                    where = f" of #{name}" if name else ""
                    raise AuditError(
                        f"the report{where} says {number.group()!r} in {around!r}, and the results hold no such "
                        "number; take it from the results, or hand it over from a builder as a number, not as a text"
                    )


def _read(html: str) -> list[str]:
    reader = _Reader()
    reader.feed(html)
    reader.close()
    return list(map(_raised, reader.texts))


def _raised(text: str) -> str:
    """A text in which a power of a number is part of it, as set: 10⁴ for 10^4."""
    return _CARET.sub(lambda match: match[1].translate(_RAISED), text)


def numbers_of(source: Any) -> set[float | Fraction]:
    """All numbers inside dataclasses, structs, mappings and sequences, at any depth; texts and flags hold none."""
    return {leaf for leaf in _leaves(source, _parts) if not isinstance(leaf, str)}


def _texts(source: Any) -> Iterator[str]:
    texts = (leaf for leaf in _leaves(source, _told) if isinstance(leaf, str))
    return (_raised(text) for text in texts if not _RATIONAL.fullmatch(text))


def _leaves(source: Any, parts: Callable[[Any], Iterable[Any]]) -> Iterator[Any]:
    """The numbers and texts of what has parts; a record that is part of many views is looked at once."""
    met, waiting = set[int](), [source]
    while waiting:
        part = waiting.pop()
        if isinstance(part, int | float | Fraction | str) and not isinstance(part, bool):
            yield part
        elif id(part) not in met:
            met.add(id(part))
            waiting.extend(parts(part))


def _told(source: Any) -> Iterable[Any]:
    """What was not written by hand."""
    if isinstance(source, FigureRecord):
        return (source.place, source.alt, source.error)
    return () if isinstance(source, Brief) else _parts(source)


def _parts(source: Any) -> Iterable[Any]:
    if isinstance(source, Mapping):
        return (part for item in source.items() for part in item)
    if isinstance(source, list | tuple | set | frozenset):
        return source
    if isinstance(source, msgspec.Struct):
        return (getattr(source, name) for name in source.__struct_fields__)
    if dataclasses.is_dataclass(source):
        return (getattr(source, field.name) for field in dataclasses.fields(source))
    return ()


def _numbers(text: str) -> Iterator[re.Match[str]]:
    yield from _NUMBER.finditer(text)
    yield from _POWER.finditer(text)


def _is_one_of(match: re.Match[str], known: list[Fraction]) -> bool:
    """Whether one of `known` (sorted, without signs) is written so to the digits shown."""
    mantissa, power = (match[1], match[2] or match[3]) if match.re is _NUMBER else ("1", match[2])
    if match.re is _POWER and match[1] != "10":
        return False
    shown = Decimal(mantissa).scaleb(int(power.translate(_POWERS)) if power else 0)
    exponent = shown.as_tuple().exponent
    assert isinstance(exponent, int)  # the pattern matches finite numbers only
    whole = not power and "." not in mantissa and shown < WHOLE
    outwards = len(shown.as_tuple().digits) >= OF_A_BOUND
    half = Fraction(0) if whole else Fraction(10) ** exponent / (1 if outwards else 2)
    # A float is rounded for the page from its binary value, which may lie a hair beyond the half.
    slack = half * Fraction(1, 10**6)
    first = bisect.bisect_left(known, Fraction(shown) - half - slack)
    return first < len(known) and known[first] <= Fraction(shown) + half + slack


class _Reader(HTMLParser):
    """Collects the texts that a reader sees or hears, each up to the next tag that is not inside a word."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.texts: list[str] = []
        self._closed_by: list[str] = []
        self._joins = self._raises = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        # What a browser may load is told to it, not to a reader.
        if not self._closed_by and "http-equiv" not in dict(attrs):
            self.texts.extend(value for name, value in attrs if name in READ_ATTRIBUTES and value)
        if tag in NOT_READ:
            self._closed_by.append(tag)
        self._joins, self._raises = self._joins and tag in WITHIN, tag == "sup"

    def handle_endtag(self, tag: str) -> None:
        if self._closed_by and tag == self._closed_by[-1]:
            self._closed_by.pop()
        self._joins = self._joins and tag in WITHIN

    def handle_data(self, data: str) -> None:
        if self._closed_by:
            return
        if self._joins:
            self.texts[-1] += f"^{data}" if self._raises and self.texts[-1][-1:].isdigit() else data
        else:
            self.texts.append(data)
        self._joins, self._raises = True, False
