"""The regenerated figures: from results to data in the digits that are certain, to CSV and SVG, the same bytes always.

A figure is drawn again only if something that it depends on has changed, or a file is not as it was left.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.judge.numerals import require_found, require_title
from replication.audit.parts import Figure, FigureData, Paper
from replication.audit.project import read_settings
from replication.audit.run.chance import copied
from replication.audit.run.tracing import noted, state, traced
from replication.audit.run.worker import Step, describe
from replication.audit.store.cache import Cache, Dependencies, Entry, encode
from replication.audit.store.provenance import Environment, loaded
from replication.audit.store.records import FigureRecord, shared
from replication.audit.store.sources import SourceTree, default_packages
from replication.drawing.panels import as_svg
from replication.drawing.style import house_style
from replication.errors import AuditError
from replication.files import csv_text, read_columns, sha256, write_atomically

DIGITS = 10
"""Significant digits of a new number. Another processor rounds otherwise, and some number always lies at an edge: data
that lie there already are therefore kept while the new ones agree with them.
"""
RELATIVE, OF_LARGEST = 1e-6, 1e-7
"""How near to a number, and to the largest of its column: processors differ by 3.3e-7 and 5.6e-8 at most."""


def settled(fresh: FigureData, path: Path) -> FigureData:
    """The data of the CSV file at `path` if all of `fresh` agrees with them, else `fresh` in `DIGITS` digits."""
    try:
        columns = read_columns(path)
    except (OSError, ValueError):
        columns = {}
    if list(columns) == list(fresh.columns) and all(_agree(columns[name], fresh.columns[name]) for name in columns):
        return FigureData(columns=columns)
    return FigureData(columns={name: tuple(map(_rounded, column)) for name, column in fresh.columns.items()})


def _agree(column: Sequence[float], fresh: Sequence[float]) -> bool:
    largest = max(map(abs, fresh), default=0.0)
    return len(column) == len(fresh) and all(
        abs(old - new) <= RELATIVE * abs(new) + OF_LARGEST * largest for old, new in zip(column, fresh, strict=True)
    )


def _rounded(number: float) -> float:
    return float(f"{float(number):.{DIGITS}g}") if math.isfinite(number) else number


@dataclass(frozen=True)
class Drawn:
    """A figure as it was left. files: their checksums. read: the state of what it read. untraced: as of a trace."""

    record: FigureRecord
    files: Sequence[str]
    read: Mapping[str, str]
    untraced: tuple[str, ...] = ()


class Drawings:
    """The figures of `papers`, each drawn as soon as what it uses has ended; without a directory none is drawn."""

    def __init__(
        self, papers: Sequence[Paper], directory: Path | None, cache: Cache, root: Path, environment: Environment
    ) -> None:
        self._directory, self._cache, self._root, self._environment = directory, cache, root, environment
        self._tree = SourceTree(default_packages(root))
        self._waiting = [(paper, figure) for paper in papers for figure in paper.figures]
        self.done: dict[str, Drawn | None] = {figure.name: None for _, figure in self._waiting}

    def draw(self, steps: Mapping[str, Step]) -> None:
        """Draw those that wait for no other experiments than these, which have ended, where they are out of date."""
        waiting, self._waiting = self._waiting, []
        for paper, figure in waiting:
            if not steps.keys() >= {*figure.uses}:
                self._waiting.append((paper, figure))
                continue
            results = {name: entry.result for name in figure.uses if (entry := steps[name].entry) is not None}
            needed = self._needed(paper, figure, results)
            drawing = self._cache.lookup(f"figure.{figure.name}", needed, partial(state, tree=self._tree)).entry
            drawn = None if drawing is None else msgspec.convert({**drawing.result, "read": drawing.data}, Drawn)
            if self._directory is not None and (
                drawn is None or drawn.files != checksums(self._directory, figure.name)
            ):
                drawn = self._drawn(self._directory, paper, figure, results, needed)
            self.done[figure.name] = drawn

    def _needed(self, paper: Paper, figure: Figure, results: Mapping[str, Any]) -> Dependencies:
        """A figure depends on all files of its paper and of the drawing, its texts, and the results that it uses."""
        module = f"{read_settings(self._root).papers}.{paper.key}"
        files = self._tree.files_of(module) | self._tree.files_of(__name__)
        inputs = {name: sha256(encode(name, result)) for name, result in results.items()}
        return Dependencies(
            sources=dict(sorted(files.items())),
            function=__name__,
            inputs=encode(figure.name, inputs, sort=True),
            **self._environment.of_key(loaded(self._tree.installed_of(module))),
        )

    def _drawn(
        self, directory: Path, paper: Paper, figure: Figure, results: Mapping[str, Any], needed: Dependencies
    ) -> Drawn:
        with traced(self._root) as trace:
            trace.written.update(f"{(directory / figure.name).resolve()}{suffix}" for suffix in (".csv", ".svg"))
            record = write_figure(figure, paper.key, results, directory, self._tree)
        data, loose = noted(trace, self._tree, needed.sources)
        files = checksums(directory, figure.name)
        if not (record.error or loose):
            result = {"record": msgspec.to_builtins(record), "files": files}
            entry = Entry(dependencies=needed, data=data, seconds=0.0, solvers=(), result=result)
            self._cache.store(f"figure.{figure.name}", entry)
        return Drawn(record, files, data, loose)


def to_csv(data: FigureData) -> bytes:
    """The columns as CSV in exact digits, short ones end in blanks; AuditError for none, or for no finite number."""
    if not any(data.columns.values()):
        raise AuditError("the figure has no data; give at least one column with one number")
    columns = [[_cell(name, number) for number in column] for name, column in data.columns.items()]
    return csv_text(data.columns, zip_longest(*columns)).encode()


def write_figure(
    figure: Figure, paper: str, results: Mapping[str, Any], directory: Path, sources: SourceTree
) -> FigureRecord:
    """Write NAME.csv and NAME.svg and return the record: with the error and no files where anything fails."""
    targets = directory / f"{figure.name}.csv", directory / f"{figure.name}.svg"
    table, drawing, alt, failure = b"", b"", "", ""
    title = figure.name if callable(figure.title) else figure.title
    try:
        missing = [name for name in figure.uses if name not in results]
        if missing:
            raise AuditError(f"no result of {', '.join(missing)}; see the error of that experiment")
        data = _data(figure, {name.removeprefix(f"{paper}."): results[name] for name in figure.uses}, targets[0])
        # Whoever reads nothing else reads the title, so it is short.
        title = require_title(_said("title", figure.title, data, [figure.caption, figure.place]))
        table, drawing, alt = to_csv(data), _draw(figure, data), _described(figure, data)
    except Exception as error:  # noqa: BLE001 - whatever one figure does, the report of the others is still written
        failure = describe(error, sources)
    for path, content in zip(targets, (table, drawing), strict=True):
        if failure:
            path.unlink(missing_ok=True)  # a figure of an earlier run would pass for one of this run
        else:
            write_atomically(path, content)
    return FigureRecord(
        **shared(FigureRecord, figure) | {"title": title},
        paper=paper,
        alt="" if failure else alt,
        csv_sha256="" if failure else sha256(table),
        error=failure,
        code=sources.location(figure.plot),
    )


def _data(figure: Figure, results: Mapping[str, Any], path: Path) -> FigureData:
    """What a figure draws, `path` being where its CSV lies; AuditError for anything else than columns of numbers."""
    data = figure.data({name: copied(result) for name, result in results.items()})
    if not isinstance(data, FigureData):
        raise AuditError(f"its function gave {data!r:.80}; give FigureData(columns={{name: numbers}})")
    to_csv(data)  # what cannot be written must not be compared either
    return FigureData(columns=_Columns(settled(data, path).columns))


class _Columns(dict[str, Any]):
    """Columns by name; asking for one that is not there says which there are."""

    def __missing__(self, name: str) -> Any:
        raise AuditError(f"there is no column {name!r}; the data has {', '.join(map(repr, self))}")


def checksums(directory: Path, name: str) -> list[str]:
    """SHA-256 of the two files of a figure, empty for one that is missing."""
    return [sha256(directory / f"{name}{suffix}") for suffix in (".csv", ".svg")]


def _draw(figure: Figure, data: FigureData) -> bytes:
    """Plot `data` and return the tidied SVG file."""
    with house_style():
        drawn = figure.plot(data)
    if not hasattr(drawn, "savefig"):
        raise AuditError(f"its plot gave {drawn!r:.80}; return the figure of matplotlib")
    return as_svg(drawn, figure.name).encode()


def _said(what: str, text: object, data: FigureData, stated: Sequence[str]) -> str:
    """A text of a figure, or what its function says of the data; stated: where its numbers may stand as well."""

    def ask(columns: Any) -> tuple[Any]:
        return (text(FigureData(columns=columns)) if callable(text) else text,)

    (words,) = ask(data.columns)
    if not isinstance(words, str):
        raise AuditError(f"its {what} is {words!r:.80}; return a string")
    require_found(what, ask, data.columns, stated)
    return words


def _described(figure: Figure, data: FigureData) -> str:
    """The alternative text; whoever cannot see the figure learns its numbers from it, so it must hold some."""
    stated = [figure.title if isinstance(figure.title, str) else "", figure.caption, figure.place]
    text = _said("alternative text", figure.alt, data, stated)
    if not any(character.isdigit() for character in text):
        raise AuditError(f"the alternative text {text!r} holds no number; say with numbers of the data what is drawn")
    return text


def _cell(name: str, number: float) -> str:
    value = float(number)
    if not math.isfinite(value):
        raise AuditError(f"column {name!r} of the figure holds {value}; leave points without a finite value out")
    return repr(value)
