"""Results kept by content: one JSON file per experiment, valid as long as nothing that it depends on has changed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import SolverRecord
from replication.audit.store.jsonvalues import encode
from replication.audit.store.provenance import Environment
from replication.files import write_atomically

NEVER_RAN = "never ran"
UNREADABLE = "entry unreadable"
NOT_ASKED = "the cache was not asked"
NAMED = 4
"""Changes that a reason names; it counts the others."""


class Dependencies(msgspec.Struct, frozen=True, kw_only=True):
    """All that a result depends on; its checksum is the key.

    sources: SHA-256 by file. function: `module:name`. inputs: canonical JSON. lock: SHA-256 of requirements.lock.
    python: minor version. packages: the versions installed, because an environment need not be the locked one.
    """

    sources: dict[str, str]
    function: str
    inputs: str
    lock: str
    python: str
    packages: dict[str, str]

    @classmethod
    def on(cls, environment: Environment, sources: Mapping[str, str], function: str, inputs: str) -> Dependencies:
        """Those of a result that is computed in this environment."""
        return cls(
            sources=dict(sources),
            function=function,
            inputs=inputs,
            lock=environment.lock_sha256,
            python=environment.python,
            packages=environment.packages,
        )

    @property
    def key(self) -> str:
        """SHA-256 of all components."""
        return _sha256(msgspec.json.encode(self, order="deterministic"))


class Entry(msgspec.Struct, frozen=True, kw_only=True):
    """A stored result with what it was computed from, how long that took and what the solvers said."""

    dependencies: Dependencies
    seconds: float
    solvers: tuple[SolverRecord, ...]
    result: Any


@dataclass(frozen=True)
class Lookup:
    """What the cache knows of an experiment: the entry if it is valid, otherwise why not; the last seconds if known."""

    entry: Entry | None
    reason: str
    last_seconds: float | None


@dataclass(frozen=True)
class Cache:
    """A directory of entries. With `read=False` nothing stored is used, and results are stored all the same."""

    directory: Path
    read: bool = True

    def lookup(self, name: str, dependencies: Dependencies) -> Lookup:
        """The entry of experiment `name` if it was computed from exactly these dependencies, else the reason.

        A file that is damaged in any way is reported as unreadable and never used.
        """
        path = self._path(name)
        if not path.is_file():
            return Lookup(None, NEVER_RAN, None)
        entry = _read(path)
        if entry is None:
            return Lookup(None, UNREADABLE, None)
        changes = list(_changes(entry.dependencies, dependencies))
        if changes:
            more = f" and {len(changes) - NAMED} more" if len(changes) > NAMED else ""
            return Lookup(None, f"changed: {', '.join(changes[:NAMED])}{more}", entry.seconds)
        if not self.read:
            return Lookup(None, NOT_ASKED, entry.seconds)
        return Lookup(entry, "unchanged", entry.seconds)

    def store(self, name: str, entry: Entry) -> None:
        """Write the entry, whole or not at all."""
        content = msgspec.to_builtins(entry)
        text = encode(name, {"key": entry.dependencies.key, "sha256": _checksum(content), **content})
        write_atomically(self._path(name), text.encode() + b"\n")

    def _path(self, name: str) -> Path:
        return self.directory / f"{name}.json"


def _read(path: Path) -> Entry | None:
    """The entry of a file, or None unless it is exactly what `store` wrote."""
    # The standard reader keeps integers of any size, which msgspec turns into floats.
    try:
        content = json.loads(path.read_bytes())
        key, checksum = content.pop("key"), content.pop("sha256")
        entry = msgspec.convert(content, Entry)
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError, OSError):
        return None
    return entry if checksum == _checksum(content) and key == entry.dependencies.key else None


def _changes(old: Dependencies, new: Dependencies) -> Iterator[str]:
    yield from (name for name in ("function", "inputs", "lock", "python") if getattr(old, name) != getattr(new, name))
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


def _checksum(content: Any) -> str:
    return _sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode())


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
