"""The last run and the last check: where nothing has changed since, their words are said again and files left alone.

What may matter is every file of the project that is not hidden, the package, what was written, the machine, what is
installed, and what else was seen to be read. Whatever is in doubt is done again, from results kept one by one.
"""

import json
import os
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import msgspec

import replication
from replication.audit.project import read_settings
from replication.audit.run.tracing import Trace, noted, state
from replication.audit.store.cache import Cache, Dependencies, Entry
from replication.audit.store.provenance import machine
from replication.audit.store.sources import SourceTree, default_packages
from replication.files import sha256, visible

RUN, CHECK = "last-run", "last-check"
"""The names in the cache."""
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
        self._asked, self._root, self._cache, self._name = list(asked), root, Cache(directory), name
        self._before = self._needed()

    def said(self) -> Said | None:
        """What was said, if nothing has changed since; None otherwise."""
        tree = SourceTree(default_packages(self._root))
        entry = self._cache.lookup(self._name, self._before, partial(state, tree=tree)).entry
        return None if entry is None else msgspec.convert(entry.result, Said)

    def keep(self, said: Said, loading: Trace, read: Iterable[str] = (), loose: Iterable[str] = ()) -> None:
        """Keep what was said, unless something cannot be followed, or something else changed files meanwhile.

        loading: what was read while the papers were loaded. read: what was read besides, by the names of
        `tracing.state`.
        """
        tree = SourceTree(default_packages(self._root))
        loaded, untraced = noted(loading, tree, None)
        if untraced or list(loose) or not self._cache.directory.is_dir():
            return
        before, after = self._before.sources, self._needed()
        changed = {path for path, _ in before.items() ^ after.sources.items()}
        if all(any(Path(path).is_relative_to(place) for place in self._written) for path in changed):
            outside = filter(self._hidden, sorted({*read, *loaded}))
            now = {name: state(name, tree) for name in outside}
            kept = Entry(dependencies=after, data=now, seconds=0.0, solvers=(), result=said)
            self._cache.store(self._name, kept)

    def _hidden(self, label: str) -> bool:
        """Whether the files that are looked through lack what was read."""
        inside = label.removeprefix("./").split("/")
        inner = label.startswith("./") or inside[0] in ("replication", read_settings(self._root).papers)
        return not inner or any(part.startswith(".") for part in inside)

    def _needed(self) -> Dependencies:
        """All that it depends on as it is now, but for what it reads outside of its places."""
        own = (f"{RUN}.json", f"{CHECK}.json")
        paths = {path for place in self._places for path in visible(place.resolve()) if path.name not in own}
        language = {name: value for name, value in os.environ.items() if name.startswith(LANGUAGE)}
        return Dependencies(
            sources={str(path): sha256(path) for path in sorted(paths)},
            function=self._name,
            inputs=json.dumps([self._asked, machine(self._root), language], sort_keys=True),
        )
