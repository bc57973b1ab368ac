"""Results kept by content: a JSON file per experiment, valid while nothing that it depends on has changed."""

import contextlib
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import SolverRecord
from replication.errors import AuditError, listed
from replication.files import sha256, write_atomically


def encode(name: str, value: Any, *, sort: bool = False) -> str:
    """JSON text of `value`, floats exact; raises AuditError with the path of the entry for what JSON cannot hold."""
    require_json(name, value)
    return json.dumps(value, sort_keys=sort, separators=(",", ":"), allow_nan=False)


def solvers_in(name: str, value: Any) -> tuple[SolverRecord, ...]:
    """All solver records under a key `solvers`, at any depth, in order; AuditError if one is something else."""
    try:
        return tuple(msgspec.convert(record, SolverRecord) for record in _listed(value))
    except msgspec.ValidationError as error:
        raise AuditError(f"{name}: an entry of `solvers` is not a solver record: {error}") from None


def require_json(path: str, value: Any) -> None:
    """Raise AuditError, with the path of the entry, for whatever JSON cannot hold."""
    if value is None or isinstance(value, str | int):
        return
    if isinstance(value, float):
        if not math.isfinite(value):
            raise AuditError(f"{path} is {value}, which JSON cannot hold; give None or a word and say what it means")
    elif isinstance(value, list | tuple):
        # Rows of numbers are most of what there is.
        if set(map(type, value)) == {float} and all(map(math.isfinite, value)):
            return
        for index, entry in enumerate(value):
            require_json(f"{path}[{index}]", entry)
    elif isinstance(value, dict):
        for key, entry in value.items():
            if not isinstance(key, str):
                raise AuditError(f"{path} has the key {key!r}; JSON keys are text, write {str(key)!r}")
            require_json(f"{path}.{key}", entry)
    else:
        kind = f"{type(value).__module__}.{type(value).__qualname__}".removeprefix("builtins.")
        cure = "give numbers, text, lists and dictionaries" + ("; of an array, .tolist()" * hasattr(value, "tolist"))
        raise AuditError(f"{path} is a {kind}, which JSON cannot hold; {cure}")


def _listed(value: Any) -> Iterator[Any]:
    if isinstance(value, Mapping):
        for key, entry in value.items():
            if key == "solvers" and isinstance(entry, list):
                yield from entry
            else:
                yield from _listed(entry)
    elif isinstance(value, list):
        for entry in value:
            yield from _listed(entry)


NEVER_RAN = "never ran"
UNREADABLE = "entry unreadable"
NOT_ASKED = "the cache was not asked"
_FRONT = re.compile(rb'\{"key":"(?P<key>[0-9a-f]{64})","sha256":"(?P<sha256>[0-9a-f]{64})",')
"""How an entry begins: its checksum is that of the text without these two fields, byte for byte."""
Checksums = Callable[[str], str | None]


class Dependencies(msgspec.Struct, frozen=True, kw_only=True):
    """All that a result depends on; its checksum is the key.

    sources: SHA-256 by file. function: `module:name`. inputs: canonical JSON. lock: SHA-256 of requirements.lock.
    python: minor version. packages: the versions installed, because an environment need not be the locked one.
    kernel: of the linear algebra; empty for what computes in exact numbers only.
    needed: SHA-256 of the files of other experiments that a command gets.
    """

    sources: dict[str, str] = {}
    function: str
    inputs: str
    lock: str = ""
    python: str = ""
    packages: dict[str, str] = {}
    kernel: str = ""
    needed: dict[str, str] = {}

    @property
    def key(self) -> str:
        """SHA-256 of all components."""
        return sha256(msgspec.json.encode(self, order="deterministic"))


class Entry(msgspec.Struct, frozen=True, kw_only=True):
    """A stored result with what it was computed from, how long that took and what the solvers said.

    data: the state of what it read while it was computed, which nobody knows before; see `run.tracing.state`.
    untraced: what it did that cannot be followed, so that it is computed again by every run. files: SHA-256 of the
    files that a command made, by name.
    """

    dependencies: Dependencies
    data: dict[str, str] = {}
    untraced: tuple[str, ...] = ()
    files: dict[str, str] = {}
    seconds: float
    solvers: tuple[SolverRecord, ...]
    result: Any

    @property
    def key(self) -> str:
        """SHA-256 of all that it was computed from."""
        digest = self.dependencies.key
        return sha256(f"{digest}{json.dumps(self.data, sort_keys=True)}") if self.data else digest


@dataclass(frozen=True)
class Lookup:
    """What the cache knows of an experiment: the entry if it is valid, otherwise why not; the last seconds if known."""

    entry: Entry | None
    reason: str
    last_seconds: float | None


@dataclass(frozen=True)
class Cache:
    """A directory of entries. With `read=False` nothing stored is used, and results are stored all the same.

    write: whether results are stored.
    Entries are JSON and never bring code along; but checksums find damage, not malice: `read=False` computes all anew.
    """

    directory: Path
    read: bool = True
    write: bool = True

    @property
    def files(self) -> Path:
        """Where files that commands made are kept, by their checksum."""
        return self.directory / "files"

    def lookup(self, name: str, dependencies: Dependencies, now: Checksums = lambda label: None) -> Lookup:
        """The entry of experiment `name` if it was computed from exactly these dependencies and data, else the reason.

        now: the checksum of a data file as it is. A damaged file is reported as unreadable and never used.
        """
        try:
            entry = _read(self._path(name).read_bytes())
        except (FileNotFoundError, NotADirectoryError):
            return Lookup(None, NEVER_RAN, None)
        except OSError:
            entry = None
        if entry is None:
            return Lookup(None, UNREADABLE, None)
        read = {label: sha256 for label in entry.data if (sha256 := now(label)) is not None}
        changes = [*_changes(entry.dependencies, dependencies), *_moved(entry.data, read)]
        if changes:
            return Lookup(None, f"changed: {listed(changes)}", entry.seconds)
        if any(not (self.files / sha256).is_file() for sha256 in entry.files.values()):
            return Lookup(None, "the files that it made are gone", entry.seconds)
        if entry.untraced:
            return Lookup(None, f"cannot be followed: {', '.join(entry.untraced)}", entry.seconds)
        if not self.read:
            return Lookup(None, NOT_ASKED, entry.seconds)
        return Lookup(entry, "unchanged", entry.seconds)

    def data(self, name: str, key: str) -> Mapping[str, str]:
        """The state of what was read for the result of this key, as far as it is kept."""
        with contextlib.suppress(OSError):
            entry = _read(self._path(name).read_bytes())
            return entry.data if entry is not None and entry.key == key else {}
        return {}

    def store(self, name: str, entry: Entry) -> str:
        """Write the entry, whole or not at all; why it could not be written, empty if it was."""
        content = encode(name, msgspec.to_builtins(entry)).encode()
        if not self.write:
            return ""
        front = f'{{"key":"{entry.key}","sha256":"{sha256(content)}",'
        try:
            write_atomically(self._path(name), front.encode() + content[1:] + b"\n")
        except OSError as error:
            return f"not kept: the cache cannot be written: {error.strerror}"
        return ""

    def forget(self, names: Iterable[str]) -> None:
        """Keep no result of these experiments."""
        for name in names if self.write else ():
            self._path(name).unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        return self.directory / f"{name}.json"


def _read(text: bytes) -> Entry | None:
    """The entry of a file's content, or None unless it is exactly what `store` wrote."""
    front = _FRONT.match(text)
    content = b"{" + text[front.end() : -1] if front else b""
    if front is None or not text.endswith(b"}\n") or front["sha256"].decode() != sha256(content):
        return None
    # The standard reader keeps integers of any size, which msgspec turns into floats.
    try:
        entry = msgspec.convert(json.loads(content), Entry)
    except (ValueError, TypeError, RecursionError):
        return None
    return entry if front["key"].decode() == entry.key else None


def _changes(old: Dependencies, new: Dependencies) -> Iterator[str]:
    fields = ("function", "inputs", "lock", "python", "kernel")
    yield from (name for name in fields if getattr(old, name) != getattr(new, name))
    yield from _moved(old.needed, new.needed)
    yield from _moved(old.packages, new.packages)
    yield from _moved(old.sources, new.sources)


def _moved(old: Mapping[str, str], new: Mapping[str, str]) -> Iterator[str]:
    for name in sorted(old.keys() | new.keys()):
        if name not in old:
            yield f"{name} (new)"
        elif name not in new:
            yield f"{name} (no longer used)"
        elif old[name] != new[name]:
            yield name
