"""A results file held against what the kept results of its experiments give: all of it, not the verdicts alone.

Nothing is computed but what turns results into records. Where the cache holds no longer what the file was made from,
this is said, and the numbers are taken as they stand.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

import replication
from replication.audit.parts import Paper
from replication.audit.run.draw import checksums, kept_figures
from replication.audit.run.progress import Action
from replication.audit.run.runner import run
from replication.audit.run.worker import Answer, Task
from replication.audit.store.cache import Cache
from replication.audit.store.provenance import THREADS, Environment, python_minor
from replication.audit.store.records import ResultsFile, RunRecord

PARTS = {"papers": "key", "claims": "id", "errata": "id", "figures": "name", "experiments": "name"}
"""Parts of a file whose records belong to a paper, with what names a record."""

TAKEN = {
    "run.date": "the time of the run",
    "run.commit": "the sources have this state or not whatever a commit is called; the keys hold their checksums",
    "run.dirty": "as the commit",
    "run.cpu": "a fact of the machine; what it changes, the kernel, is in the keys",
    "run.platform": "a fact of the machine",
    "run.python": "its last place, which is not in the keys",
    "run.blas": "versions of libraries, which those of the packages imply; the kernel must stand in it",
    "experiments.seconds": "measured; another number makes a note, for then the kept result is of another run",
}
"""Fields of a file that a change by hand leaves without a problem, with the reason; all others are derived."""


@dataclass(frozen=True)
class Kept:
    """What the cache gives: the file that a run would write now, and which experiments and figures it would have to do.

    files: the checksums with which the files of a figure were left, by its name.
    """

    results: ResultsFile
    absent: frozenset[str]
    files: Mapping[str, Sequence[str]]
    environment: Environment


class _Nobody:
    """Computes nothing."""

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        yield from (Answer(task.name, None, 0.0, "it is not kept") for task in tasks)


def kept(papers: Sequence[Paper], root: Path, cache: Cache) -> Kept:
    """What the results in the cache give for these papers; raises as `run` does for mistakes in the papers."""
    outcome = run(papers, cache=replace(cache, write=False), root=root, executor=_Nobody())
    drawn = dict(
        kept_figures(papers, outcome.results_by_experiment, cache=cache, root=root, environment=outcome.environment)
    )
    figures = tuple(entry[0] for entry in drawn.values() if entry is not None)
    absent = {step.name for step in outcome.log if step.action is Action.FAILED}
    absent |= {name for name, entry in drawn.items() if entry is None}
    results = msgspec.structs.replace(outcome.results, figures=figures)
    files = {name: entry[1] for name, entry in drawn.items() if entry is not None}
    return Kept(results, frozenset(absent), files, outcome.environment)


def differences(results: ResultsFile, again: Kept, figures: Path) -> Iterator[tuple[str, str]]:
    """Where the file, or a file of a figure, is not what the cache gives, and what is different there."""
    yield from (("project", text) for text in _moved("", _plain(results.project), _plain(again.results.project)))
    yield from _environment(results.run, again.environment, trusted=_here(results, again))
    if not _here(results, again):
        return
    if results.run.unlocked != again.results.run.unlocked:
        yield "run.unlocked", f"{results.run.unlocked!r} is not what differs from the lock"
    keys = {record.name: record.key for record in results.experiments}
    others = [record.name for record in again.results.experiments if keys.get(record.name, record.key) != record.key]
    if others:
        more = f" (and of {len(others) - 1} more)" if others[1:] else ""
        yield others[0], f"sources, inputs or data{more} are others now, or the key was edited; run the audit again"
    unknown = _unknown(results, again)
    for part, name in PARTS.items():
        stored = {getattr(record, name): record for record in getattr(results, part)}
        for record in getattr(again.results, part):
            key = getattr(record, name)
            if key in stored and getattr(record, "paper", key) not in unknown:
                yield from ((key, text) for text in _moved("", _plain(stored[key]), _plain(record)))
    proofs = {record.path: record for record in results.certificates}
    if len(proofs) < len(results.certificates):
        yield "certificates", "one of them stands twice in the file"
    for proof in again.results.certificates:
        if proof.path in proofs and f"{proof.paper}.certificate.{proof.name}" not in again.absent:
            yield from ((proof.path, text) for text in _moved("", _plain(proofs[proof.path]), _plain(proof)))
    for name, left in again.files.items():
        if checksums(figures, name) != left:
            yield name, f"{figures / name}.csv and .svg are not as the run left them; run the audit again"


def unfounded(results: ResultsFile, again: Kept) -> str:
    """Why the numbers of some papers were taken as they stand; empty if none were."""
    if not _here(results, again):
        return "the file was made in another environment than this one, so its numbers were taken as they stand"
    unknown = sorted(_unknown(results, again))
    why = "the cache does not hold the results of this run, so the numbers were taken as they stand"
    return f"{', '.join(unknown)}: {why}; `replication run` computes what is missing" if unknown else ""


def _here(results: ResultsFile, again: Kept) -> bool:
    """Whether the file was made in this environment: so it says, or one of its keys."""
    same = not list(_environment(results.run, again.environment, trusted=True))
    keys = {record.key for record in again.results.experiments}
    return same or any(record.key in keys for record in results.experiments)


def _environment(run: RunRecord, here: Environment, *, trusted: bool) -> Iterator[tuple[str, str]]:
    """What a run says of its environment and is not so here, which counts only if its keys are of here."""
    said: dict[str, tuple[Any, Any]] = {
        "package_version": (run.package_version, replication.__version__),
        "lock_sha256": (run.lock_sha256, here.lock_sha256),
        "python": (python_minor(run.python), here.python),
        "packages": (run.packages, here.versions),
        "blas": (here.kernel in run.blas, True),
        "threads": (run.threads, THREADS),
    }
    for name, (stored, found) in said.items() if trusted else ():
        if stored != found:
            yield f"run.{name}", f"{getattr(run, name)!r} is not of the environment that the keys are of"


def _unknown(results: ResultsFile, again: Kept) -> set[str]:
    """The papers of which something is not kept, or kept of another run: what is measured in seconds differs then."""
    seconds = {record.name: record.seconds for record in again.results.experiments}
    found = {record.paper for record in results.experiments if seconds.get(record.name) != record.seconds}
    found |= {record.paper for record in again.results.experiments if record.name in again.absent}
    return found | {record.paper for record in results.figures if record.name in again.absent}


def _plain(record: Any) -> Any:
    return msgspec.to_builtins(record)


def _moved(path: str, stored: Any, found: Any) -> Iterator[str]:
    """Each leaf at which two values differ, with both."""
    if isinstance(stored, dict) and isinstance(found, dict) and stored.keys() == found.keys():
        for name in stored:
            yield from _moved(f"{path}.{name}" if path else name, stored[name], found[name])
    elif isinstance(stored, list | tuple) and isinstance(found, list | tuple) and len(stored) == len(found):
        for index, pair in enumerate(zip(stored, found, strict=True)):
            yield from _moved(f"{path}[{index}]", *pair)
    elif stored != found:
        yield f"{path} is {stored!r}, and the kept results give {found!r}"
