"""Printed data of a paper: a TOML file beside its module, every number a string that knows where it stands.

docs/claims.md has the form of the file; `{key}` in a place stands for the keys that lead to an entry.
"""

from __future__ import annotations

import contextlib
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextvars import ContextVar
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from replication.errors import AuditError, meant

S = TypeVar("S", bound=msgspec.Struct)


class PrintedTable(msgspec.Struct, frozen=True):
    """A table of the file."""

    place: str
    value: Any
    unit: str = ""
    note: str = ""


class PrintedValue(str):
    """The string that stands in a paper, whose digits are its tolerance; with its place, its unit and a note on it."""

    place: str
    unit: str
    note: str

    def __new__(cls, text: str, place: str = "", unit: str = "", note: str = "") -> PrintedValue:
        """The text itself, as a string, with where it stands."""
        value = super().__new__(cls, text)
        value.place, value.unit, value.note = place, unit, note
        return value


@dataclass
class Watched:
    """A print that is looked for as data are read. met: whether it was among them; instead: what they then hold."""

    printed: str
    place: str
    instead: str = ""
    met: bool = False

    def seen(self, value: Any) -> Any:
        """The value as it is to be read, with what it holds."""
        if isinstance(value, dict):
            return Entries({name: self.seen(entry) for name, entry in value.items()})
        if isinstance(value, list):
            return [self.seen(entry) for entry in value]
        if isinstance(value, PrintedValue) and (value, value.place) == (self.printed, self.place):
            self.met = True
            return PrintedValue(self.instead or value, value.place, value.unit, value.note)
        return value


_watched: ContextVar[Watched | None] = ContextVar("watched", default=None)


@contextlib.contextmanager
def watched(printed: str, place: str, instead: str = "") -> Iterator[Watched]:
    """Look meanwhile whether this print is read, and let it be read as `instead`."""
    watch = Watched(printed, place, instead)
    token = _watched.set(watch)
    try:
        yield watch
    finally:
        _watched.reset(token)


class Entries(dict[str, Any]):
    """Printed data by name; one that is not there is told with those that are."""

    def __getitem__(self, name: str) -> Any:
        value, watch = super().__getitem__(name), _watched.get()
        return value if watch is None else watch.seen(value)

    def __missing__(self, name: str) -> Any:
        raise AuditError(f"printed.toml has no {name!r} there; {meant(str(name), self)}")


def read_printed(file: str | Path) -> Mapping[str, Any]:
    """The values of a file of printed data by name, each string a `PrintedValue`; AuditError by file and entry.

    file: the TOML file, or the module beside it that has its name: `read_printed(__file__)` in printed.py.
    """
    path = Path(file).with_suffix(".toml")
    return printed_values(path, read_tables(path))


def read_tables(path: Path) -> Mapping[str, Any]:
    """The tables of a file of printed data as they stand there; raises AuditError if it cannot be read."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"), parse_float=Decimal)
    except OSError as error:
        raise AuditError(f"{path} cannot be read: {error.strerror}") from None
    except (ValueError, ArithmeticError) as error:
        raise AuditError(f"{path} is not valid TOML: {error}; correct it") from None


def converted(where: str | Callable[[str], str], table: Any, kind: type[S]) -> S:
    """A table as a record; raises AuditError for a field that is unknown or of another form, by `where` it stands."""
    at = where if callable(where) else lambda field: where
    if not isinstance(table, Mapping):
        raise AuditError(f"{at('')} is {table!r:.80} and no table; write its fields below its name in brackets")
    known = [field.encode_name for field in msgspec.structs.fields(kind)]
    if unknown := sorted(table.keys() - set(known)):
        raise AuditError(f"{at(unknown[0])}: unknown field {unknown[0]!r}; {meant(unknown[0], known)}")
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as error:
        field = re.search(r"\$\.(\w+)", str(error))
        message = str(error).replace("`str | object`", "a string, or a table by entry")
        raise AuditError(f"{at(field[1] if field else '')}: {message}; correct it") from None


@cache
def words(table: str) -> dict[str, str]:
    """A table of `words.toml`: what names of verdicts, policies and the like mean."""
    return dict(read_tables(Path(__file__).with_name("words.toml"))[table])


def line_of(path: Path, table: str, number: int = 1) -> int:
    """The line of a TOML file at which a table begins, or table so and so of a list of that name."""
    parts = r"\s*\.\s*".join(rf"[\"']?{re.escape(part)}[\"']?" for part in table.split("."))
    return _line(path, rf"\s*\[\[?\s*{parts}\s*\]", number)


def line_of_field(path: Path, field: str) -> int:
    """The line of a TOML file on which a field of its top level is given; 1 if it is nowhere."""
    return _line(path, rf"{re.escape(field)}\s*=", 1)


def _line(path: Path, form: str, number: int) -> int:
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
    return [*(line for line, text in lines if re.match(form, text)), *[1] * number][number - 1]


def printed_values(path: Path, tables: Mapping[str, Any]) -> Mapping[str, Any]:
    """The values of the tables of `path` by name; raises as `read_printed`."""
    return Entries({name: _entry(f"{path}:{line_of(path, name)}: [{name}]", table) for name, table in tables.items()})


def _entry(where: str, table: Any) -> Any:
    record = converted(where, table, PrintedTable)
    if not record.place.strip():
        raise AuditError(f"{where}: the place is empty; say where in the text this is printed")
    return _value(where, record.value, record.place, partial(PrintedValue, unit=record.unit, note=record.note), ())


def leaves(value: Any, keys: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """What stands in tables and lists at any depth, each with the keys that lead there, places of lists from 1 on."""
    if not isinstance(value, Mapping | list | tuple):
        yield keys, value
        return
    for key, entry in value.items() if isinstance(value, Mapping) else enumerate(value, 1):
        yield from leaves(entry, (*keys, str(key)))


def _value(where: str, value: Any, place: str, kind: Callable[..., PrintedValue], keys: tuple[str, ...]) -> Any:
    if isinstance(value, str):
        if not value:
            raise AuditError(f"{where} holds an empty string; give what stands in the paper")
        return kind(value, place.replace("{key}", ", ".join(keys)))
    if isinstance(value, dict | list) and not value:
        raise AuditError(f"{where} holds nothing; give what stands in the paper")
    if isinstance(value, dict):
        return Entries(
            {key: _value(f"{where} {key}", entry, place, kind, (*keys, key)) for key, entry in value.items()}
        )
    if isinstance(value, list):
        return [_value(f"{where} {i}", entry, place, kind, (*keys, str(i))) for i, entry in enumerate(value, 1)]
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    raise AuditError(f"{where} is {value}; write a printed number as a string, since its digits are its tolerance")
