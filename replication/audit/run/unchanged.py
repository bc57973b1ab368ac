"""A run of which nothing has changed since is not repeated: its words are said again, and its files are left alone.

What may matter to a run is every file of the project that is not hidden, the package itself, the results, figures and
entries of the cache that it left, the machine, what is installed, and what else it was seen to read. If all that is as
it was when the last run ended, so is what a run would write. Whatever is in doubt is run again, from results that are
kept one by one.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

import replication
from replication.audit.run.tracing import state
from replication.audit.store.installed import listing
from replication.audit.store.provenance import kernel, run_record
from replication.audit.store.sources import KEPT, SourceTree, default_packages
from replication.files import write_atomically

NAME = "last-run"
LANGUAGE = ("LANG", "LANGUAGE", "LC_", "TZ", "PYTHON", "VIRTUAL_ENV")
"""How variables begin that may matter though nobody asks for them by name."""
APART = ("__pycache__", "notebooks", "build", "dist")
"""Folders with what Python, the tutorials and the packaging make of the sources."""
INDEX = (f"{NAME}.json", KEPT)
"""Files of the cache that hold no result."""


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """What a run says that has nothing to compute, the tutorials to which its report links, and its exit code."""

    lines: tuple[str, ...]
    tutorials: tuple[str, ...]
    code: int


class LastRun:
    """The last complete run in these places. Made before a run starts, and asked again when it has ended.

    root: the project. written: the files, and the folders of files, that a run leaves. asked: what else it was told.
    directory: where it is kept, the folder of the cache.
    """

    def __init__(self, root: Path, written: Sequence[Path], asked: Sequence[str], directory: Path) -> None:
        self._places = [root, Path(replication.__file__).parent, *written, directory]
        self._written = [path.resolve() for path in (*written, directory)]
        self._asked, self._root, self._path = list(asked), root, directory / f"{NAME}.json"
        self._before = self._files()

    def said(self) -> Said | None:
        """What the last run said, if nothing has changed since it ended; None otherwise."""
        try:
            kept = json.loads(self._path.read_bytes())
            told = msgspec.convert(kept["said"], Said)
            whole = kept["sha256"] == self._checksum(self._before, told, kept["traced"])
            whole = whole and self._traced(kept["traced"]) == kept["traced"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return told if whole else None

    def keep(self, said: Said, traced: Iterable[str] = ()) -> None:
        """Keep what this run said, unless something else than the run itself changed files while it ran.

        traced: what the run read besides, by the names of `tracing.state`.
        """
        after = self._files()
        changed = {path for path in self._before.keys() | after.keys() if self._before.get(path) != after.get(path)}
        if all(any(Path(path).is_relative_to(place) for place in self._written) for path in changed):
            now = self._traced(traced)
            kept = {"said": msgspec.to_builtins(said), "traced": now, "sha256": self._checksum(after, said, now)}
            write_atomically(self._path, json.dumps(kept).encode())

    def _traced(self, names: Iterable[str]) -> dict[str, str]:
        tree = SourceTree(default_packages(self._root))
        return {name: state(name, tree) for name in names}

    def _files(self) -> dict[str, str]:
        found = {path.resolve() for place in self._places for path in _visible(place)}
        return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(found)}

    def _checksum(self, files: Mapping[str, str], said: Said, traced: Mapping[str, str]) -> str:
        record = msgspec.structs.replace(run_record(self._root), date="", blas=kernel())
        language = {name: value for name, value in os.environ.items() if name.startswith(LANGUAGE)}
        machine = [msgspec.to_builtins(record), language, listing()]
        whole: list[Any] = [self._asked, machine, files, msgspec.to_builtins(said), traced]
        return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()


def _visible(place: Path) -> Iterator[Path]:
    """A file, or the files of a folder and of those in it, hidden ones and folders that stand apart left out."""
    if place.is_file():
        yield place
    for folder, inner, names in os.walk(place):
        if "pyvenv.cfg" in names:  # an environment, which the versions of its packages stand for
            inner.clear()
            continue
        inner[:] = [name for name in inner if not name.startswith(".") and name not in APART]
        paths = (Path(folder, name) for name in names if not name.startswith(".") and name not in INDEX)
        yield from (path for path in paths if path.is_file())
