"""Figures that are drawn again only when something that they depend on has changed, or a file is not as it was left."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.model import Figure, Paper
from replication.audit.run.draw import write_figures
from replication.audit.run.runner import default_packages
from replication.audit.store.cache import Cache, Dependencies, Entry
from replication.audit.store.jsonvalues import encode
from replication.audit.store.provenance import Environment, read_environment
from replication.audit.store.records import FigureRecord
from replication.audit.store.sources import SourceTree

DRAWING = "replication.audit.run.draw"


def draw_figures(
    papers: Sequence[Paper],
    results: Mapping[str, Any],
    directory: Path,
    *,
    cache: Cache,
    root: Path,
    packages: Mapping[str, Path] | None = None,
) -> tuple[FigureRecord, ...]:
    """The records that `write_figures(papers, results, directory)` gives, and its files, drawing what is out of date.

    A figure depends on all files of its paper and of the drawing, on its texts, and on the results that it uses.
    root, packages: as for `runner.run`.
    """
    sources = SourceTree(packages or default_packages(root))
    environment = read_environment(root)
    return tuple(
        _draw(figure, paper, results, directory, cache, _dependencies(figure, paper, results, sources, environment))
        for paper in papers
        for figure in paper.figures
    )


def _draw(
    figure: Figure,
    paper: Paper,
    results: Mapping[str, Any],
    directory: Path,
    cache: Cache,
    dependencies: Dependencies,
) -> FigureRecord:
    name = f"figure.{figure.name}"
    entry = cache.lookup(name, dependencies).entry
    if entry is not None and entry.result["files"] == _checksums(directory, figure.name):
        return msgspec.convert(entry.result["record"], FigureRecord)
    (record,) = write_figures([dataclasses.replace(paper, figures=(figure,))], results, directory)
    if not record.error:
        result = {"record": msgspec.to_builtins(record), "files": _checksums(directory, figure.name)}
        cache.store(name, Entry(dependencies=dependencies, seconds=0.0, solvers=(), result=result))
    return record


def _dependencies(
    figure: Figure, paper: Paper, results: Mapping[str, Any], sources: SourceTree, environment: Environment
) -> Dependencies:
    # The functions of a figure may hold values of the module that made them, so all files of the paper count.
    files = {**sources.files_of(f"papers.{paper.key}"), **sources.files_of(DRAWING)}
    used = {name: _sha256(encode(name, results[name]).encode()) for name in figure.uses if name in results}
    inputs = encode(figure.name, used, sort=True)
    return Dependencies.on(environment, dict(sorted(files.items())), DRAWING, inputs)


def _checksums(directory: Path, name: str) -> list[str]:
    """SHA-256 of the two files of a figure, empty for one that is missing."""
    paths = [directory / f"{name}{suffix}" for suffix in (".csv", ".svg")]
    return [_sha256(path.read_bytes()) if path.is_file() else "" for path in paths]


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
