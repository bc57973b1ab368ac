"""A run of an audit: compute what changed, reuse the rest, answer the claims, and hand back all that happened."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.judge.proofs import Wanted, record, wanted
from replication.audit.judge.typed import require_typed
from replication.audit.judge.validate import validate_claims, validate_theorems
from replication.audit.model import Experiment
from replication.audit.parts import Paper
from replication.audit.project import read_settings
from replication.audit.run.assemble import Computed, assemble
from replication.audit.run.pool import Executor, Processes
from replication.audit.run.progress import Action, Silent, Step
from replication.audit.run.prove import prove
from replication.audit.run.tracing import data_tree
from replication.audit.run.worker import Answer, Task, describe, function_name
from replication.audit.store.cache import Cache, Dependencies, Entry, Lookup
from replication.audit.store.jsonvalues import encode, solvers_in
from replication.audit.store.provenance import Environment, read_environment, run_record
from replication.audit.store.records import ResultsFile
from replication.audit.store.sources import SourceTree, default_packages
from replication.errors import AuditError

EDITED = "not kept: its sources or data were edited while it ran"


@dataclass(frozen=True)
class Outcome:
    """What a run gives.

    results_by_experiment: result by name, without the experiments that failed. results: the file, without figures.
    log: what was done about each experiment, in the order of the papers. failures: the errors that no record carries,
    those of findings, sensitivity and common levels. unused: experiments whose results nobody read.
    environment: that in which it ran.
    """

    results_by_experiment: Mapping[str, Any]
    results: ResultsFile
    log: tuple[Step, ...]
    failures: tuple[str, ...]
    unused: tuple[str, ...]
    environment: Environment


@dataclass(frozen=True)
class _Plan:
    """A task of the run. arguments: JSON text of what its function is given, which may hold places on this disk."""

    name: str
    dependencies: Dependencies
    lookup: Lookup
    arguments: str


def run(
    papers: Sequence[Paper],
    *,
    cache: Cache,
    root: Path,
    executor: Executor | None = None,
    progress: Silent | None = None,
    packages: Mapping[str, Path] | None = None,
) -> Outcome:
    """Audit `papers`, a project at `root` (lock, git, certificates), by `executor`; None: one process per core.

    Results do not depend on the executor and pass through JSON, so that a fresh and a stored one are the same. Each is
    stored when it is there: after an interruption, a second run takes up where the first one ended. An experiment that
    fails is an error in the records of what uses it and leaves the rest alone.
    packages: name and directory of the packages that count as sources; `default_packages(root)` unless given.
    Raises AuditError for mistakes in the papers, before anything is computed.
    """
    packages = packages or default_packages(root)
    sources, data = SourceTree(packages), data_tree(packages)
    require_typed(papers, sources)
    validate_claims(papers, sources.mentioned)
    certificates, unproved = wanted(root, [paper.key for paper in papers])
    validate_theorems(papers, {claim for certificate in certificates for claim in certificate.claims}, unproved)
    environment = read_environment(root)
    plans = _plan(papers, certificates, root, environment, partial(cache.lookup, now=data.now), sources)
    stored = {name: plan.lookup.entry for name, plan in plans.items() if plan.lookup.entry is not None}
    computed = {name: Computed(entry.dependencies, entry, "", entry.seconds) for name, entry in stored.items()}
    steps = {name: Step(name, Action.REUSED, plans[name].lookup.reason, stored[name].seconds) for name in stored}
    tasks = _longest_first([plan for name, plan in plans.items() if name not in computed], packages)
    with progress or Silent() as watcher:
        watcher.begin(len(tasks))
        for answer in (executor or Processes()).compute(tasks) if tasks else ():
            done, step = _finish(answer, plans[answer.name], cache, sources, data)
            computed[answer.name], steps[answer.name] = done, step
            watcher.step(step)
    values = {name: done.entry.result for name in plans if (done := computed[name]).entry is not None}
    proofs = [record(entry, values.pop(entry.task, None), computed[entry.task].error) for entry in certificates]
    results, failures, unused = assemble(papers, computed, run_record(root, environment), sources, proofs, unproved)
    results = msgspec.structs.replace(results, project=read_settings(root))
    return Outcome(values, results, tuple(steps[name] for name in plans), failures, unused, environment)


def _plan(
    papers: Sequence[Paper],
    certificates: Sequence[Wanted],
    root: Path,
    environment: Environment,
    lookup: Callable[[str, Dependencies], Lookup],
    sources: SourceTree,
) -> dict[str, _Plan]:
    """One task for each experiment, and for each certificate; its key holds checksums, not where the project lies."""
    verifier = f"{prove.__module__}:{prove.__name__}"
    here = {"root": str(root)}
    wanted_inputs = ({"path": certificate.path, "subject": dict(certificate.subject)} for certificate in certificates)
    asked = [
        *((experiment.name, function_name(experiment), dict(experiment.inputs), {}) for experiment in _all(papers)),
        *((one.task, verifier, inputs, here) for one, inputs in zip(certificates, wanted_inputs, strict=True)),
    ]
    plans: dict[str, _Plan] = {}
    for name, function, inputs, place in asked:
        text = encode(f"the inputs of {name}", inputs, sort=True)
        files = sources.files_of(function.partition(":")[0])
        dependencies = Dependencies.on(environment, files, function, text, exact=function == verifier)
        arguments = encode(f"the inputs of {name}", {**inputs, **place}) if place else text
        plans[name] = _Plan(name, dependencies, lookup(name, dependencies), arguments)
    return plans


def _all(papers: Sequence[Paper]) -> Iterator[Experiment]:
    """The experiments; raises AuditError if the name of one cannot name a file."""
    for experiment in (experiment for paper in papers for experiment in paper.experiments):
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]*", experiment.name):
            raise AuditError(
                f"experiment name {experiment.name!r} cannot name a file; use letters, digits, '.', '_' and '-'"
            )
        yield experiment


def _longest_first(plans: Sequence[_Plan], packages: Mapping[str, Path]) -> list[Task]:
    """Tasks by falling duration as last known, those never run in front: the short ones then fill the gaps."""
    known = [plan.lookup.last_seconds for plan in plans]
    durations = [math.inf if seconds is None else seconds for seconds in known]
    order = sorted(range(len(plans)), key=lambda index: -durations[index])
    return [Task(plans[i].name, plans[i].dependencies.function, plans[i].arguments, packages) for i in order]


def _finish(answer: Answer, plan: _Plan, cache: Cache, sources: SourceTree, data: SourceTree) -> tuple[Computed, Step]:
    """Store an answer, unless it failed or its sources and data are no longer those that it was computed from."""
    name, reason, seconds = answer.name, plan.lookup.reason, answer.seconds
    try:
        if answer.text is not None:
            result = json.loads(answer.text)
            solvers = solvers_in(f"the result of {name}", result)
            entry = Entry(
                dependencies=plan.dependencies, data=answer.data, seconds=seconds, solvers=solvers, result=result
            )
            whole = sources.unchanged(plan.dependencies.sources) and data.unchanged(answer.data)
            reason = (cache.store(name, entry) if whole else EDITED) or reason
            return Computed(plan.dependencies, entry, "", seconds), Step(name, Action.COMPUTED, reason, seconds)
        error = answer.error
    except AuditError as failure:
        error = describe(failure, sources)
    return Computed(plan.dependencies, None, error, seconds), Step(name, Action.FAILED, reason, seconds, error)
