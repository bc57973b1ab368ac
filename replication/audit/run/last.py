"""The last run and the last check: where nothing has changed since, their words are said again and files left alone.

What may matter is every file of the project that is not hidden, the package, what was written, the machine, what is
installed, and what else was seen to be read. Whatever is in doubt is done again, from results kept one by one.
"""

import contextlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

import replication
from replication.audit.project import read_settings
from replication.audit.run.tracing import Trace, labels, state, untraced
from replication.audit.store.provenance import machine
from replication.audit.store.sources import SourceTree, default_packages
from replication.files import sha256, visible, write_atomically

RUN, CHECK = "last-run.json", "last-check.json"
LANGUAGE = ("LANG", "LANGUAGE", "LC_", "TZ", "PYTHON", "VIRTUAL_ENV", "OPENBLAS_", "MKL_", "BLIS_", "NPY_")
"""How variables begin that may matter though nobody asks for them by name."""
Said = tuple[tuple[str, ...], int]
"""The lines of a run or a check that has nothing to do, and its exit code."""


class Last:
    """The last one in these places. Made before another one starts, and asked again when it has ended.

    root: the project. written: the files, and the folders of files, that it leaves. asked: what else it was told.
    directory: the folder of the cache, in which it is kept as `name`.
    """

    def __init__(
        self, root: Path, written: Sequence[Path], asked: Sequence[str], directory: Path, name: str = RUN
    ) -> None:
        self._places = [root, Path(replication.__file__).parent, *written, directory]
        self._written = [path.resolve() for path in (*written, directory)]
        self._asked, self._root, self._path = list(asked), root, directory / name
        self._before = self._files()

    def said(self) -> Said | None:
        """What was said, if nothing has changed since; None otherwise."""
        try:
            record = json.loads(self._path.read_bytes())
            answer = msgspec.convert(record["said"], Said)
            whole = record["sha256"] == self._checksum(self._before, answer, record["read"])
            whole = whole and self._now(record["read"]) == record["read"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return answer if whole else None

    def keep(self, said: Said, loading: Trace, read: Iterable[str] = (), loose: Iterable[str] = ()) -> None:
        """Keep what was said, unless something cannot be followed, or something else changed files meanwhile.

        loading: what was read while the papers were loaded. read: what was read besides, by the names of
        `tracing.state`.
        """
        tree = SourceTree(default_packages(self._root))
        if untraced(loading, tree, None) or list(loose) or not self._path.parent.is_dir():
            return
        after = self._files()
        changed = {path for path in self._before.keys() | after.keys() if self._before.get(path) != after.get(path)}
        if all(any(Path(path).is_relative_to(place) for place in self._written) for path in changed):
            now = self._now(filter(self._hidden, sorted({*read, *labels(loading, tree, None)})))
            record = {"said": said, "read": now, "sha256": self._checksum(after, said, now)}
            with contextlib.suppress(OSError):
                write_atomically(self._path, json.dumps(record).encode())

    def _hidden(self, label: str) -> bool:
        """Whether the files that are looked through lack what was read."""
        inside = label.removeprefix("./").split("/")
        inner = label.startswith("./") or inside[0] in ("replication", read_settings(self._root).papers)
        return not inner or any(part.startswith(".") for part in inside)

    def _now(self, names: Iterable[str]) -> dict[str, str]:
        tree = SourceTree(default_packages(self._root))
        return {name: state(name, tree) for name in names}

    def _files(self) -> dict[str, str]:
        paths = {path for place in self._places for path in visible(place.resolve()) if path.name not in (RUN, CHECK)}
        return {str(path): sha256(path) for path in sorted(paths)}

    def _checksum(self, files: Mapping[str, str], answer: Said, read: Mapping[str, str]) -> str:
        language = {name: value for name, value in os.environ.items() if name.startswith(LANGUAGE)}
        whole: list[Any] = [self._asked, machine(self._root), language, files, answer, read]
        return sha256(json.dumps(whole, sort_keys=True))
