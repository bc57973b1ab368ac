"""Coverage of a text: each numeral and numbered item of it, with its place and what it is bound to, or why to nothing.

docs/verdicts.md tells the form of coverage.toml, docs/adding-a-paper.md its bindings. No sentence of a text is stored.
Numerals are runs of digits with their decimal point; numbers in words are not listed.
"""

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from replication.audit.data import PrintedValue, converted, leaves, read_printed, read_tables, words
from replication.audit.parts import Coverage, Paper
from replication.errors import AuditError, one_of

FACTS, ASIDE, ITEMS = map(words, ("facts", "aside", "items"))
"""Why a number that states a fact, one that states none, and a numbered item are bound to nothing."""
REASONS = {**FACTS, **ASIDE, **ITEMS}
NUMERAL = re.compile(r"[0-9]+(?:\.[0-9]+)?|(?<![0-9A-Za-z])\.[0-9]+")
_SIGNED = re.compile(rf"(?:(?<![\w)}}])[-−])?(?:{NUMERAL.pattern})")
_RANGE = re.compile(r"([0-9]+)(?:-([0-9]+))?")

Row = Annotated[tuple[str, ...], msgspec.Meta(min_length=2)]


class Place(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What stands in one place of a text: rows of a print and its bindings."""

    place: str
    numerals: tuple[Row, ...] = ()
    items: tuple[Row, ...] = ()


class Text(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All that one text holds; runs: of digits; numbered: the items by kind, as `1-3, 5`."""

    runs: int
    places: tuple[Place, ...] = ()
    numbered: dict[str, str] = {}

    @property
    def rows(self) -> Iterator[tuple[str, str, Row]]:
        """The rows in the order of the text, each with its place, and whether it is of `numerals` or of `items`."""
        for place in self.places:
            yield from ((place.place, "numerals", row) for row in place.numerals)
            yield from ((place.place, "items", row) for row in place.items)


def read_coverage(path: Path) -> dict[str, Text]:
    """The texts of a paper by name; raises AuditError that names the file and the entry that is not usable."""
    tables = read_tables(path)
    return {name: converted(f"{path}: [{name}]", table, Text) for name, table in tables.items()}


def tallied(name: str, text: Text) -> Iterator[Coverage]:
    """How much of a text is bound, excused and open: of its numerals, then of its numbered items."""
    for what in ("numerals", "items"):
        sums: Counter[str] = Counter()
        for row in (row for _, of, row in text.rows if of == what):
            sums[_state(row)] += len(_integers(row[0]) if what == "items" else NUMERAL.findall(row[0]))
        counts = {state: sums[state] for state in ("bound", "excused", "open")}
        yield Coverage(text=name, of=what, total=sum(counts.values()), aside=sums["aside"], **counts)


def _state(row: Row) -> str:
    kind, _, name = row[-1].partition(":")
    if kind == "excused":
        return "aside" if name in ASIDE else "excused"
    return {"open": "open", "scope": "excused"}.get(kind, "bound")


def still_open(text: Text) -> Iterator[str]:
    """The rows that are bound to nothing and not excused, as `place: print: what is asked`."""
    for place, _, row in text.rows:
        if _state(row) == "open":
            yield f"{place}: {row[0]}: {row[-1].removeprefix('open:').strip()}"


def excuses(text: Text) -> Counter[str]:
    """How many numerals are excused or left aside, by reason; those of a part that is left out under its name."""
    counts: Counter[str] = Counter()
    for _, what, row in text.rows:
        kind, _, name = row[-1].partition(":")
        if what == "numerals" and kind in ("excused", "scope"):
            counts[name] += len(NUMERAL.findall(row[0]))
    return counts


def problems(texts: Mapping[str, Text], paper: Paper, printed: Mapping[str, Any]) -> Iterator[str]:
    """Bindings to what is not there or holds other numerals, what is not listed, and prints in no list."""
    bindings = _Bindings(paper, printed)
    for name, text in texts.items():
        for place, what, row in text.rows:
            where = f"{paper.key}: {name}, {place}: {row[0]!r}"
            yield from (f"{where}: {fault}" for fault in bindings.faults(row, what))
        yield from (f"{paper.key}: {name}: {fault}" for fault in _incomplete(text))
    yield from (f"{paper.key}: {fault}" for fault in _unbound(texts, paper, printed))


def faults(folder: Path, paper: Paper) -> list[str]:
    """All `problems` of the list in the folder of a paper, none without one; errors as of what reads both files."""
    listed, printed = folder / "coverage.toml", folder / "printed.toml"
    if not listed.is_file():
        return []
    return list(problems(read_coverage(listed), paper, read_printed(printed) if printed.is_file() else {}))


def _incomplete(text: Text) -> Iterator[str]:
    listed = _listed(text).total()
    if listed != text.runs:
        yield f"{listed} numerals are listed, and the text has {text.runs}; one was taken out or added"
    items: dict[str, Counter[int]] = {kind: Counter() for kind in text.numbered}
    for row in (row for _, what, row in text.rows if what == "items"):
        items.setdefault(row[0].split()[0], Counter()).update(_integers(row[0]))
    for kind, counts in items.items():
        numbers = Counter(_integers(text.numbered.get(kind, "")))
        for number in sorted(set(counts) | set(numbers)):
            if counts[number] != 1 or not numbers[number]:
                yield f"{kind} {number} is listed {counts[number]} times, and the text has {numbers[number]}"


def _unbound(texts: Mapping[str, Text], paper: Paper, printed: Mapping[str, Any]) -> Iterator[str]:
    """Printed values to which no row is bound, by their name or by a claim that prints them at the same place."""
    rows = (row for text in texts.values() for _, _, row in text.rows)
    bindings = [binding.partition(":")[::2] for row in rows for binding in row[1:]]
    data = {name for kind, name in bindings if kind in ("data", "size")}
    claims = {name for kind, name in bindings if kind in ("claim", "setting")}
    prints = {(claim.printed, claim.place) for claim in paper.claims if claim.id.partition(".")[2] in claims}
    for keys, value in leaves(printed):
        above = {".".join(keys[:depth]) for depth in range(1, len(keys) + 1)}
        if (
            isinstance(value, PrintedValue)
            and NUMERAL.search(value)
            and not above & data
            and (str(value), value.place) not in prints
        ):
            yield (
                f"printed.toml, {'.'.join(keys)}: no row is bound to {value!r} ({value.place}); list where the text "
                "prints it, or take it out of printed.toml"
            )


def _integers(numbering: str) -> list[int]:
    ranges = (range(int(match[1]), int(match[2] or match[1]) + 1) for match in _RANGE.finditer(numbering))
    return [number for numbers in ranges for number in numbers]


class _Bindings:
    """What a paper has that a row can be bound to."""

    def __init__(self, paper: Paper, printed: Mapping[str, Any]) -> None:
        self.printed = printed
        self.claims = {claim.id.partition(".")[2]: claim.printed for claim in paper.claims}
        self.names: dict[str, Collection[str]] = {
            "claim": self.claims,
            "setting": self.claims,
            "data": printed,
            "size": printed,
            "erratum": [erratum.id.partition(".")[2] for erratum in paper.errata],
            "reading": [reading.name for reading in paper.readings],
            "figure": [figure.name.partition("-")[2] for figure in paper.figures],
            "scope": [item.part for item in paper.scope if item.reason],
        }

    def faults(self, row: Row, what: str) -> Iterator[str]:
        """What is wrong with one row of numerals or items."""
        if not NUMERAL.search(row[0]):
            yield "a row begins with what is printed, in which there is a number"
        self.names["excused"] = ITEMS if what == "items" else {**FACTS, **ASIDE}
        for binding in row[1:]:
            kind, _, name = binding.partition(":")
            try:
                if kind != "open":
                    self._require(kind, name, row[0] if what == "numerals" else "")
            except AuditError as error:
                yield str(error)

    def _require(self, kind: str, name: str, numerals: str) -> None:
        known = self.names[one_of("kind of binding", kind, self.names)]
        if kind == "excused" and name not in known:
            raise AuditError(f"unknown excused {name!r}; there are {', '.join(known)}")
        if kind in ("data", "size"):
            value: Any = self.printed
            for part in name.split("."):
                value = value[one_of("name in printed.toml", part, value if isinstance(value, Mapping) else ())]
            text = " ".join(_strings(value) if kind == "data" else map(str, _size(value)))
            _require_in(f"{kind} {name}", text, numerals)
        elif one_of(kind, name, known) in self.claims and kind == "claim" and _signed(self.claims[name]):
            _require_in(f"the print of claim {name}", self.claims[name], numerals)


def _require_in(what: str, printed: str, numerals: str) -> None:
    """Raise AuditError for the first numeral that the print does not hold in this order."""
    left = iter(_signed(printed))
    for numeral in _signed(numerals):
        if numeral not in left:
            raise AuditError(f"{what} is {printed!r}, which does not hold {numeral!r} in this order")


def _signed(text: str) -> list[str]:
    return [numeral.replace("−", "-") for numeral in _SIGNED.findall(text)]


def _strings(value: Any) -> Iterator[str]:
    """Keys and entries of printed data in their order."""
    if isinstance(value, Mapping | list):
        for entry in [part for pair in value.items() for part in pair] if isinstance(value, Mapping) else value:
            yield from _strings(entry)
    else:
        yield str(value)


def _size(value: Any) -> tuple[int, ...]:
    """Length of a list, rows and columns of a printed matrix."""
    if isinstance(value, list):
        return (len(value),)
    rows = [_signed(row) for row in str(value).split(";")]
    return len(rows), len(rows[0])


def _listed(text: Text) -> Counter[str]:
    rows = (row for _, what, row in text.rows if what == "numerals")
    return Counter(numeral for row in rows for numeral in NUMERAL.findall(row[0]))


def differences(listed: Text, text: str) -> Iterator[str]:
    """Each numeral that stands in the text oftener or less often than in the list."""
    ours, theirs = _listed(listed), Counter(NUMERAL.findall(text))
    for numeral in sorted(ours | theirs, key=lambda numeral: (float(numeral), numeral)):
        if ours[numeral] != theirs[numeral]:
            yield f"{numeral}: {theirs[numeral]} in the text, {ours[numeral]} in the list"
