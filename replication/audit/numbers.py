"""Claims on plain numbers without Python: claims.toml says where each stands in a result.

Its tables, `[[claim]]`, `[[command]]`, `[[data]]`, `[[part]]` and `[[reading]]`, are told in docs/claims.md.
"""

import contextlib
import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.data import S, converted, leaves, line_of, printed_values, read_printed, read_tables
from replication.audit.declare import STATED as FILE
from replication.audit.declare import Part, command, declared, paper
from replication.audit.judge.agreement import ACCURACY
from replication.audit.judge.numerals import layout
from replication.audit.judge.printed import by_digits, decimal_fraction, parse
from replication.audit.model import NO_READING, Evidence, Experiment, Kind, Reading, Results
from replication.audit.parts import Paper
from replication.audit.project import about
from replication.audit.run.command import held
from replication.errors import AuditError, meant, one_of

OfEntries = str | dict[str, str]
"""What holds for each entry of a print, or by name what holds for some of them."""
SPLIT = ("reading", "pinned", "erratum", "meant")
"""Fields that may be such tables."""
Line = tuple[str, int]


class Stated(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename={"source": "from"}):
    """A claim as the file states it; source is its `from`, a list where a key holds a colon.

    times: what the numbers there are multiplied by for the unit of the print.
    reason, settled_by: of one without `from`, why the text does not settle it, and what would.
    """

    id: str
    statement: str
    printed: Any = ""
    place: str = ""
    unit: str = ""
    note: str = ""
    source: str | list[str] = ""
    check: str | list[str] = ""
    times: str = "1"
    method: str = ""
    part: str = ""
    uncertainty: str = ""
    tolerance: str | None = None
    tolerance_reason: str = ""
    reason: str = ""
    settled_by: str = ""
    reading: OfEntries = NO_READING
    pinned: OfEntries = ""
    erratum: OfEntries = ""
    meant: OfEntries = ""

    def of(self, field: str, name: str, default: str = "") -> str:
        """What a field says of the entry of this name."""
        value = getattr(self, field)
        return str(value.get(name, default) if isinstance(value, dict) else value)


class Pinned(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A file that no command makes, with its checksum."""

    file: str
    sha256: str


class LeftOut(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part of the text without claims, and why."""

    title: str
    reason: str


@dataclass(frozen=True)
class Numbers:
    """What the file declares: parts with their claims, experiments that these rest on, readings."""

    parts: tuple[Part, ...]
    experiments: tuple[Experiment, ...]
    readings: tuple[Reading, ...]


def paper_of_tables(module: str) -> Paper:
    """The paper whose claims all stand in claims.toml: `PAPER = paper_of_tables(__file__)` is all its Python."""
    content = numbers(module)
    return paper(**about(module), parts=content.parts, experiments=content.experiments, readings=content.readings)


def numbers(module: str) -> Numbers:
    """The parts of a paper with the claims that claims.toml states, in its order, and the experiments that these need.

    module: a module beside the file, as `__file__`. A part is called as `part` says, or as the place up to its first
    comma. Raises AuditError that names file, line and field for what is no such claim.
    """
    path = Path(module).with_name(FILE)
    tables = read_tables(path)
    for name, rows in tables.items():
        if name not in TABLES or not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            advice = f"write [[{name}]]" if name in TABLES else meant(name, TABLES)
            raise AuditError(f"{path}: {name!r} is no list of tables that it may have; {advice}")
    commands = [_command(path, where, row) for where, row, _ in _rows(path, tables, "command")]
    pins = [converted(_at(where, row), row, Pinned) for where, row, _ in _rows(path, tables, "data")]
    files = _Files(commands, {pin.file: pin.sha256 for pin in pins})
    parts = {out.title: Part(out.title, reason=out.reason) for out in _all(path, tables, "part", LeftOut)}
    for where, row, line in _rows(path, tables, "claim"):
        claim = converted(_at(where, row), row, Stated)
        entries = [(".".join(keys), printed) for keys, printed in leaves(_prints(path, where, claim))]
        _require_named(claim, [name for name, _ in entries if name], where)
        for entry, printed in entries:
            title = claim.part or getattr(printed, "place", claim.place).partition(",")[0]
            part = parts.setdefault(title, Part(title))
            _declare(part, claim, entry, printed, files, where, (str(path), line))
    if idle := [pin.file for pin in pins if pin.file not in files.experiments]:
        raise AuditError(f"{path}: [[data]] pins {idle[0]}, which no claim reads; {meant(idle[0], files.experiments)}")
    for part in parts.values():
        part.module = f"{path.parent.parent.name}.{path.parent.name}.{FILE}"
    readings = tuple(_all(path, tables, "reading", Reading))
    return Numbers(tuple(parts.values()), (*commands, *files.experiments.values()), readings)


TABLES = ("claim", "command", "data", "part", "reading")


class _Files:
    """The files that claims read, each as an experiment of its own, with the command that makes it."""

    def __init__(self, commands: Sequence[Experiment], pinned: Mapping[str, str]) -> None:
        self.makers: dict[str, str] = {}
        for maker in commands:
            for name in maker.inputs["writes"]:
                if self.makers.setdefault(name, maker.name) != maker.name:
                    raise AuditError(
                        f"{name!r} is written by {self.makers[name]!r} and {maker.name!r}; let one write it"
                    )
        self.pinned, self.experiments = pinned, dict[str, Experiment]()

    def source(self, first: str) -> tuple[str, ...]:
        """The experiments behind what a way begins with: a file, or the name of an experiment."""
        if "/" not in first and not first.endswith((".csv", ".json")):
            return (first,)
        name = re.sub(r"[^A-Za-z0-9._-]+", "-", first).strip("-.")
        needs = (self.makers[first],) if first in self.makers else ()
        inputs = {"file": first, "sha256": self.pinned.get(first, "")}
        self.experiments.setdefault(first, Experiment(name=name, function=held, inputs=inputs, needs=needs))
        return (name, *needs)


def _rows(path: Path, tables: Mapping[str, Any], name: str) -> Iterator[tuple[str, dict[str, Any], int]]:
    """The tables of a list, each with where it stands in words, and its line."""
    for number, row in enumerate(tables.get(name, ()), 1):
        line = line_of(path, name, number)
        yield f"{path}:{line}: [[{name}]]", row, line


def _at(where: str, row: Mapping[str, Any]) -> str:
    return f"{where} {row.get('id', '')}".rstrip()


def _all(path: Path, tables: Mapping[str, Any], name: str, kind: type[S]) -> Iterator[S]:
    return (converted(_at(where, row), row, kind) for where, row, _ in _rows(path, tables, name))


def _command(path: Path, where: str, row: dict[str, Any]) -> Experiment:
    fields, known = dict(row), list(inspect.signature(command).parameters)
    if unknown := sorted(row.keys() - set(known)):
        raise AuditError(f"{where} has the unknown field {unknown[0]!r}; {meant(unknown[0], known)}")
    try:
        experiment = command(fields.pop("name"), fields.pop("line"), **fields)
    except KeyError as missing:
        raise AuditError(f"{where} has no {missing.args[0]}; give name and line") from None
    except TypeError as error:
        raise AuditError(f"{where}: {str(error).partition(') ')[2] or error}; correct it") from None
    except AuditError as error:
        raise AuditError(f"{where}: {error}") from None
    for name in experiment.inputs["reads"]:
        texts = [path.with_name(file) for file in (FILE, "printed.toml", "coverage.toml")]
        if any(file.is_relative_to(folder / name) for file in texts for folder in path.parents):
            raise AuditError(f"{where} reads {name!r}, and so what the paper prints; let it read what it computes from")
    return experiment


def _prints(path: Path, where: str, claim: Stated) -> Any:
    """What the claim prints, each string with its place and unit."""
    kind, _, name = str(claim.printed).partition(":") if isinstance(claim.printed, str) else ("", "", "")
    if kind == "data":
        value: Any = read_printed(path.with_name("printed.toml"))
        for key in name.split("."):
            value = value[one_of(f"name in printed.toml, at {where}", key, value if isinstance(value, Mapping) else ())]
        return value
    if not claim.place or not (claim.printed or claim.reason):
        raise AuditError(f'{where} {claim.id}: give place and printed, or printed = "data:NAME" of printed.toml')
    table = {"place": claim.place, "value": claim.printed, "unit": claim.unit, "note": claim.note}
    try:
        return printed_values(path, {claim.id: table})[claim.id] if claim.printed else ""
    except AuditError as error:
        raise AuditError(f"{where} {claim.id}: {str(error).partition('] ')[2]}") from None


def _require_named(claim: Stated, names: Sequence[str], where: str) -> None:
    """Raise AuditError for a field that says something of an entry that is not there."""
    for field in SPLIT:
        value = getattr(claim, field)
        for name in value if isinstance(value, dict) else ():
            if name not in names:
                raise AuditError(f"{where}: {field} speaks of the entry {name!r}; {meant(name, names)}")


def _declare(part: Part, claim: Stated, entry: str, printed: Any, files: _Files, where: str, line: Line) -> None:
    def way(source: str | list[str]) -> list[str]:
        return [step.replace("{key}", entry) for step in (source.split(":") if isinstance(source, str) else source)]

    if not isinstance(printed, str):
        raise AuditError(f"{where}: a claim is on a printed number, and {printed!r} is none; write it as a string")
    if not entry and any("{key}" in str(text) for text in (claim.id, claim.statement, claim.source, claim.check)):
        raise AuditError(
            f"{where} {claim.id}: {{key}} stands for the entries of a table, and one number is printed here"
        )
    if bool(claim.source) == bool(claim.reason):
        raise AuditError(f"{where} {claim.id}: give from, where the number stands, or a reason why none settles it")
    name = claim.id.replace("{key}", entry) if "{key}" in claim.id else ".".join(filter(None, (claim.id, entry)))
    fields: dict[str, Any] = {
        # An id is in lower case and without blanks, whatever points or cases are called in print.
        "name": re.sub(r"[_\s]+", "-", name).lower(),
        "printed": printed,
        "place": getattr(printed, "place", claim.place),
        "statement": claim.statement.replace("{key}", entry),
        "reading": claim.of("reading", entry, NO_READING),
    }
    if claim.reason:
        part.cited(**fields, reason=claim.reason, settled_by=claim.settled_by, line=line)
        return
    ways = [way(source) for source in (claim.source, claim.check) if source]
    if ways[1:] == ways[:1]:
        raise AuditError(
            f"{where}: check is {':'.join(ways[0])!r}, the result itself; give the same number by another method, or "
            "leave it out"
        )
    uses = [files.source(steps[0]) for steps in ways]
    try:
        print_, meant_here, _ = parse(printed), claim.of("meant", entry), decimal_fraction(claim.times)
    except AuditError as error:
        raise AuditError(f"{where} {claim.id}: {error}") from None
    part.claim(
        Kind.BOUND if print_.relation else Kind.MATRIX if print_.shape else Kind.VALUE,
        pinned=claim.of("pinned", entry) or ("reproduced after erratum" if meant_here else ""),
        erratum=claim.of("erratum", entry) or None,
        meant=meant_here,
        uncertainty=claim.uncertainty,
        tolerance=claim.tolerance,
        tolerance_reason=claim.tolerance_reason,
        **fields,
    )(declared(line, partial(_answer, where, str(printed), claim, list(zip(ways, uses, strict=True)))))


def _answer(
    where: str, printed: str, claim: Stated, ways: Sequence[tuple[Sequence[str], Sequence[str]]], results: Results
) -> Evidence:
    for _, names in ways:
        with contextlib.suppress(KeyError):
            _ = [results[name] for name in reversed(names)]  # of one that failed this raises its error
    values = [_scaled(value_at(where, steps, names[0], results), claim.times) for steps, names in ways]
    paths = [":".join(steps) for steps, _ in ways]
    loose = [steps[0] for steps, names in ways if names[0] != steps[0] and len(names) == 1]
    text = claim.method or f"As it stands at {paths[0]}{f', times {claim.times}' * (claim.times != '1')}."
    text += "".join(f" Nothing here makes {file}." for file in loose)
    if len(values) == 1:
        return Evidence(method=text, value=values[0])
    print_ = by_digits(parse(printed), isinstance(values[0], tuple))
    aligned = [print_.align(what, value) for what, value in zip(("value", "second value"), values, strict=True)]
    for entry, first, second in zip(print_.entries, *aligned, strict=True):
        if abs(first - second) > float(entry.unit / 2 + ACCURACY * Fraction(abs(first))):
            raise AuditError(
                f"{where}: {paths[0]} is {first!r} and {paths[1]} is {second!r}, more than half a printed place apart; "
                "find out which of the two is wrong"
            )
    return Evidence(method=text, cross_check=f"{paths[1]} gives {layout(values[1], '{:.9g}'.format)}.", value=values[0])


def _scaled(value: Any, times: str) -> Any:
    if isinstance(value, tuple):
        return tuple(_scaled(entry, times) for entry in value)
    return value if times == "1" else float(Fraction(value) * decimal_fraction(times))


# Where a number stands in a result: a way of steps into what an experiment returned, or a file holds.
#
# Of JSON a step is a key, or a place in a list from 0 on. Of a table the first step is a row: what its first column
# holds, `column=value` (several with commas), or `#3`, the third; then a column. `*` takes all rows, `low,high` two.


def value_at(where: str, steps: Sequence[str], name: str, results: Results) -> Any:
    """What stands there in the results, lists as tuples; AuditError says where the way ends, and what is there.

    where: in words, for messages. steps: what the way begins with, then its steps. name: of the experiment with it.
    """
    first, *rest = steps
    if name not in results:
        names = ", ".join(list(results)[:8])
        raise AuditError(f"{where}: {':'.join(steps)!r} leads nowhere: among the results there is {names}")
    value = results[name]
    if first.endswith(".csv"):
        header, columns = list(value), value.values()
        value = [dict(zip(header, cells, strict=True)) for cells in zip(*columns, strict=True)]
        if rest and not re.search(r"^[#*]|=", rest[0]):
            rest[0] = f"{header[0]}={rest[0]}"
    return _inside(f"{where}: {':'.join(steps)!r}", first, value, rest)


def _inside(where: str, so_far: str, value: Any, steps: Sequence[str]) -> Any:
    """What a way leads to inside a value."""
    if not steps:
        return _tupled(f"{where}: at {so_far!r}", value)
    step, *rest = steps
    if step == "*" and isinstance(value, list):
        return tuple(_inside(where, f"{so_far}:{number}", entry, rest) for number, entry in enumerate(value))
    inside = value if isinstance(value, Mapping) else dict(enumerate(value)) if isinstance(value, list) else {}
    several = step.split(",")
    if isinstance(value, list):
        if "=" in step:
            rows = [entry for entry in value if isinstance(entry, Mapping) and entry]
            hits = [row for row in rows if _fits(row, several)]
            if len(hits) > 1:
                raise AuditError(f"{where}: {len(hits)} rows of {so_far} have {step}; add ,column=value, or write #1")
            inside = {step: hits[0]} if hits else {next(iter(row.values())): row for row in rows}
        elif step.startswith("#"):
            inside = {f"#{number}": entry for number, entry in enumerate(value, 1)}
    elif step not in inside and len(several) > 1 and all(column in inside for column in several):
        inside = {step: [inside[column] for column in several]}
    key: Any = int(step) if isinstance(value, list) and step.isdecimal() else step
    if key not in inside:
        names = ", ".join(map(str, list(inside)[:8])) or f"only {value!r:.40}"
        raise AuditError(f"{where} leads nowhere: in {so_far} there is {names}, and no {step}")
    return _inside(where, f"{so_far}:{step}", inside[key], rest)


def _fits(row: Mapping[str, Any], conditions: Sequence[str]) -> bool:
    """Whether each `column=value` holds, as text or as a number."""
    pairs = [(row.get(column), value) for column, _, value in (condition.partition("=") for condition in conditions)]
    return all(cell is not None and (str(cell) == value or _number(cell) == _number(value)) for cell, value in pairs)


def _number(cell: Any) -> Any:
    """The number that a cell holds; else an object that equals no other."""
    try:
        return float(cell)
    except (TypeError, ValueError):
        return object()


def _tupled(where: str, value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_tupled(where, entry) for entry in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        cure = (
            "write it with a point and without unit or sign of thousands"
            if re.search(r"\d", str(value)) and isinstance(value, str)
            else "name a place where one stands"
        )
        raise AuditError(f"{where} there is {value!r:.60}, which is no number; {cure}")
    return float(value)
