"""Claims on numbers, declared in the file of printed data, without a function for each.

    [doubling]
    place = "Sec. 3, the time"
    value = "1.85"
    [doubling.claim]
    statement = "The infected double in this time."
    result = "epidemic.doubling"     # experiment, then keys and indices of what it returns
    method = "Slope of the logarithm of the course."
    check = "closed.doubling"        # the same number by another method
    part = "Sec. 3"                  # optional, as are reading, pinned, erratum, meant and id

Where the value is a table or a list, `{key}` in these texts stands for the name of each entry, and `erratum`, `meant`,
`pinned` and `reading` may be tables with what holds for some of the entries, such as meant = { B = "1.85" }.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.data import line_of, printed_values, read_tables
from replication.audit.declare import Part, declared
from replication.audit.judge.printed import parse
from replication.audit.model import NO_READING, Evidence, Kind, Results
from replication.errors import AuditError, meant

OfEntries = str | dict[str, str]
"""What holds for each entry of a value, or by name what holds for some of them."""
SPLIT = ("reading", "pinned", "erratum", "meant")
"""Fields that may be such tables."""


class Declared(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A claim as the file declares it; id: without the key of the paper, by default the name of the entry."""

    statement: str
    result: str
    method: str
    check: str = ""
    part: str = ""
    reading: OfEntries = NO_READING
    pinned: OfEntries = ""
    erratum: OfEntries = ""
    meant: OfEntries = ""
    id: str = ""

    def of(self, field: str, name: str, default: str = "") -> str:
        """What a field says of the entry of this name."""
        said = getattr(self, field)
        return str(said.get(name, default) if isinstance(said, dict) else said)


def numbers(file: str | Path) -> tuple[Part, ...]:
    """The parts of a paper with the claims that its file of printed data declares, in the order of the file.

    file: as for `read_printed`. A part is called as `part` says, or as the place up to its first comma.
    Raises AuditError that names file, entry and field for what is no such claim.
    """
    path = Path(file).with_suffix(".toml")
    tables = read_tables(path)
    data = printed_values(path, tables)
    parts: dict[str, Part] = {}
    for name, table in tables.items():
        if "claim" in table:
            line = line_of(path, f"{name}.claim")
            where = f"{path}:{line}: [{name}.claim]"
            try:
                claim = msgspec.convert(table["claim"], Declared)
            except msgspec.ValidationError as error:
                unknown = sorted(set(table["claim"]) - set(Declared.__struct_fields__)) if _is_table(table) else []
                advice = meant(unknown[0], Declared.__struct_fields__) if unknown else "correct it"
                said = str(error).replace("`str | object`", "a string, or a table by entry")
                raise AuditError(f"{where}: {said}; {advice}") from None
            title = claim.part or table["place"].partition(",")[0]
            part = parts.setdefault(title, Part(title))
            entries = list(_entries(data[name], ()))
            _require_named(claim, [".".join(keys) for keys, _ in entries if keys], where)
            for keys, printed in entries:
                _declare(part, name, claim, keys, printed, where, (str(path), line))
    return tuple(parts.values())


def _require_named(claim: Declared, names: Sequence[str], where: str) -> None:
    """Raise AuditError for a field that says something of an entry that is not there."""
    for field in SPLIT:
        said = getattr(claim, field)
        for name in said if isinstance(said, dict) else ():
            if name not in names:
                raise AuditError(f"{where}: {field} speaks of the entry {name!r}; {meant(name, names)}")


def _is_table(table: Any) -> bool:
    return isinstance(table["claim"], Mapping)


def _entries(value: Any, keys: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    inner = value.items() if isinstance(value, Mapping) else enumerate(value, 1) if isinstance(value, list) else ()
    if not isinstance(value, Mapping | list):
        yield keys, value
    for key, entry in inner:
        yield from _entries(entry, (*keys, str(key)))


def _declare(
    part: Part, name: str, claim: Declared, keys: tuple[str, ...], printed: str, where: str, place: tuple[str, int]
) -> None:
    if not isinstance(printed, str):
        raise AuditError(f"{where}: a claim is on a printed number, and {printed!r} is none; write it as a string")

    entry = ".".join(keys)

    def filled(text: str) -> str:
        return text.replace("{key}", entry)

    found = parse(printed)
    kind = Kind.BOUND if found.relation else Kind.MATRIX if found.shape else Kind.VALUE
    result, check = filled(claim.result), filled(claim.check)
    if check == result:
        raise AuditError(
            f"{where}: check is {check!r}, the result itself; give the same number by another method, or leave it out"
        )
    meant_here = claim.of("meant", entry)
    answer = partial(_answer, where, str(printed), result, claim.method, check)
    part.claim(
        kind,
        # An id is in lower case, whatever points or cases are called in print.
        (filled(claim.id) or ".".join([name.replace("_", "-"), *keys])).lower(),
        printed,
        statement=filled(claim.statement),
        pinned=claim.of("pinned", entry) or ("reproduced after erratum" if meant_here else ""),
        uses=dict.fromkeys(path.partition(".")[0] for path in (result, check) if path),
        erratum=claim.of("erratum", entry) or None,
        meant=meant_here,
        reading=claim.of("reading", entry, NO_READING),
    )(declared(place, answer))


def _answer(where: str, printed: str, result: str, method: str, check: str, results: Results) -> Evidence:
    value = _at(where, result, results)
    if not check:
        return Evidence(method=method, value=value)
    other, print_ = _at(where, check, results), parse(printed)
    pairs = zip(print_.entries, print_.align("value", value), print_.align("second value", other), strict=True)
    for entry, first, second in pairs:
        if abs(first - second) > entry.unit / 2:
            raise AuditError(
                f"{where}: {result} is {first!r} and {check} is {second!r}, more than half a printed place apart; find "
                "out which of the two is wrong"
            )
    return Evidence(method=method, cross_check=f"{check} gives {_told(other)}.", value=value)


def _told(value: Any) -> str:
    return f"[{', '.join(map(_told, value))}]" if isinstance(value, tuple) else f"{value:.9g}"


def _at(where: str, path: str, results: Results) -> Any:
    """What stands at `experiment.key.0` in the results, lists as tuples; AuditError says where the way ends."""
    value: Any = results
    with contextlib.suppress(KeyError):
        results[path.partition(".")[0]]  # of an experiment that failed this raises its error
    for depth, step in enumerate(path.split(".")):
        inside = value if isinstance(value, Mapping) else dict(enumerate(value)) if isinstance(value, list) else {}
        key: Any = int(step) if isinstance(value, list) and step.isdecimal() else step
        if key not in inside:
            so_far = ".".join(path.split(".")[:depth]) or "the results"
            there = ", ".join(map(str, list(inside)[:8])) or f"only {value!r:.40}"
            raise AuditError(f"{where}: {path!r} leads nowhere: in {so_far} there is {there}")
        value = inside[key]
    return _tupled(where, path, value)


def _tupled(where: str, path: str, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_tupled(where, path, entry) for entry in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise AuditError(f"{where}: at {path!r} there is {value!r:.60}, which is no number")
    return float(value)
