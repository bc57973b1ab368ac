"""A run of an audit: compute what changed, reuse the rest, answer the claims, and hand back all that happened."""

import functools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.judge.proofs import record, wanted
from replication.audit.judge.validate import require_typed, validate_claims, validate_theorems
from replication.audit.model import Experiment
from replication.audit.parts import Paper
from replication.audit.project import read_settings
from replication.audit.run.assemble import assemble
from replication.audit.run.command import execute, held
from replication.audit.run.draw import Drawings, Drawn
from replication.audit.run.prove import prove
from replication.audit.run.tracing import noted, state, traced
from replication.audit.run.worker import Action, Answer, Compute, Step, Task, describe, function_name, processes
from replication.audit.store.cache import Cache, Dependencies, Entry, Lookup, encode, solvers_in
from replication.audit.store.provenance import Environment, loaded, plain, read_environment, run_record
from replication.audit.store.records import ResultsFile
from replication.audit.store.sources import SourceTree, default_packages, parents
from replication.errors import AuditError
from replication.extras import canonical

EDITED = "not kept: its sources or data were edited while it ran"
TIMEOUT = 3600.0
"""Seconds that an experiment may take unless it says otherwise."""


@dataclass(frozen=True)
class Outcome:
    """What a run gives.

    results_by_experiment: result by name, without the experiments that failed. results: the file.
    log: what was done about each experiment, in the order of the papers. failures: the errors that no record carries,
    those of findings, sensitivity and common levels. unused: experiments whose results nobody read.
    traced: the state of all that was read beside the sources. untraced: what was done that cannot be followed. drawn:
    each figure, None for one that is out of date.
    """

    results_by_experiment: Mapping[str, Any]
    results: ResultsFile
    log: tuple[Step, ...]
    failures: tuple[str, ...]
    unused: tuple[str, ...]
    traced: Mapping[str, str]
    untraced: tuple[str, ...]
    drawn: Mapping[str, Drawn | None]


Plan = tuple[Task, Lookup]
"""A task of the run, and what the cache knows of it."""


def run(
    papers: Sequence[Paper],
    *,
    cache: Cache,
    root: Path,
    executor: Compute = processes,
    progress: Callable[[str], None] = lambda line: None,
    figures: Path | None = None,
    timeout: float = TIMEOUT,
) -> Outcome:
    """Audit `papers`, a project at `root` (lock, git, certificates), by `executor`, of which results do not depend.

    Each is stored when it is there, so that a second run takes up where the first one ended. An experiment that fails
    is an error in the records of what uses it alone. progress: told a line on each experiment. figures: where those are
    drawn; None to draw none. timeout: seconds of one that names none.
    Raises AuditError for mistakes in the papers, before anything is computed.
    """
    packages = default_packages(root)
    sources = SourceTree(packages)
    require_typed(papers, sources)
    validate_claims(papers, sources.mentioned)
    certificates, unproved = wanted(root, [paper.key for paper in papers])
    validate_theorems(papers, {claim for certificate in certificates for claim in certificate.claims}, unproved)
    environment = read_environment(root)
    drawings = Drawings(papers, figures, cache, root, environment)
    plans: dict[str, Plan] = {}
    steps: dict[str, Step] = {}
    proving = [
        Experiment(name=proof.task, function=prove, inputs={"path": proof.path, "subject": dict(proof.subject)})
        for proof in certificates
    ]
    experiments = [experiment for paper in papers for experiment in paper.experiments]
    for wave in _waves([*experiments, *proving]):
        steps |= {step.name: step for experiment in wave if (step := _blocked(experiment, steps)) is not None}
        ready = [experiment for experiment in wave if experiment.name not in steps]
        planned = _plan(ready, steps, root, cache, environment, sources, timeout)
        for name, (_, known) in planned.items():
            if (entry := known.entry) is not None:
                steps[name] = Step(name, Action.REUSED, known.reason, entry.seconds, entry.dependencies, entry)
        plans |= planned
        tasks = _longest_first([plan for name, plan in planned.items() if name not in steps])
        answers = executor(tasks) if tasks else ()
        for number, answer in enumerate(answers, 1):
            steps[answer.name] = _finish(answer, plans[answer.name], cache, sources)
            progress(f"[{number}/{len(tasks)}] {steps[answer.name]}")
            drawings.draw(steps)
    drawings.draw(steps)
    declared = set(map(canonical, environment.packages))
    versions = {name: version for task, _ in plans.values() for name, version in task.dependencies.packages.items()}
    imported = {name: version for name, version in plain(versions).items() if canonical(name) not in declared}
    record_of_run = run_record(root, environment, imported)
    order = [*(experiment.name for experiment in experiments), *(entry.task for entry in certificates)]
    values = {name: entry.result for name in order if (entry := steps[name].entry) is not None}
    proofs = [record(proof, values.pop(proof.task, None), steps[proof.task].error) for proof in certificates]
    with traced(root) as trace:
        results, failures, unused = assemble(papers, steps, record_of_run, sources, proofs, unproved)
    entries = [step.entry for step in steps.values() if step.entry is not None]
    drawn = [figure for figure in drawings.done.values() if figure is not None]
    seen, loose = noted(trace, sources, ())
    read = {label: now for entry in entries for label, now in entry.data.items()} | seen
    read |= {label: now for figure in drawn for label, now in figure.read.items()}
    folders = (".", *packages)
    elsewhere = [(label, sha) for task, _ in plans.values() for label, sha in task.dependencies.sources.items()]
    read |= {label: sha for label, sha in elsewhere if label.partition("/")[0] not in folders}
    notes = [entry.untraced for entry in entries] + [plot.untraced for plot in drawn] + [loose]
    figured = tuple(figure.record for figure in drawn)
    return Outcome(
        results_by_experiment=values,
        results=msgspec.structs.replace(results, project=read_settings(root), figures=figured),
        log=tuple(steps[name] for name in order),
        failures=failures,
        unused=unused,
        traced=read,
        untraced=tuple(sorted({words for part in notes for words in part})),
        drawn=drawings.done,
    )


def _waves(experiments: Sequence[Experiment]) -> Iterator[list[Experiment]]:
    """The experiments, those first that need no other; AuditError for a circle."""
    known = {experiment.name: experiment for experiment in experiments}
    order = TopologicalSorter({experiment.name: experiment.needs for experiment in experiments})
    try:
        order.prepare()
    except CycleError as error:
        raise AuditError(
            f"experiments need each other in a circle: {', '.join(error.args[1])}; take one `needs` away"
        ) from None
    while order.is_active():
        wave = order.get_ready()
        yield [known[name] for name in wave]
        order.done(*wave)


def _blocked(experiment: Experiment, steps: Mapping[str, Step]) -> Step | None:
    """The failure of an experiment that needs one which failed; None for any other."""
    failed = [name for name in experiment.needs if steps[name].entry is None]
    if not failed:
        return None
    inputs = encode(experiment.name, dict(experiment.inputs), sort=True)
    none = Dependencies(function=function_name(experiment), inputs=inputs)
    error = f"it needs {', '.join(failed)}, which failed"
    return Step(experiment.name, Action.FAILED, "not started", 0.0, none, error=error)


def _plan(
    experiments: Sequence[Experiment],
    steps: Mapping[str, Step],
    root: Path,
    cache: Cache,
    environment: Environment,
    sources: SourceTree,
    timeout: float,
) -> dict[str, Plan]:
    """One task for each experiment; its key holds checksums, not where the project lies."""
    plans: dict[str, Plan] = {}
    folders = {name: str(folder) for name, folder in sources.packages.items()}
    packages = functools.cache(lambda module: loaded(sources.installed_of(module)))
    for experiment in experiments:
        name, function, inputs = experiment.name, function_name(experiment), dict(experiment.inputs)
        files_of = [entry.files for need in experiment.needs if (entry := steps[need].entry) is not None]
        needed = {file: sha256 for files in files_of for file, sha256 in files.items()}
        place: dict[str, Any] = {"root": str(root)}
        if experiment.function is not prove:
            place |= {"store": str(cache.files), "needed": needed}
        internal = experiment.function in (prove, execute, held)
        module = function.partition(":")[0]
        text = encode(f"the inputs of {name}", inputs, sort=True)
        files, dynamic = sources.files_of(module), sources.is_dynamic(module)
        if dynamic:  # it may import by a computed name whatever its package imports, too
            files |= {label: sha for parent in parents(module) for label, sha in sources.files_of(parent).items()}
        setting = environment.of_key(packages(module), exact=experiment.function is prove)
        dependencies = Dependencies(sources=files, function=function, inputs=text, needed=needed, **setting)
        arguments = encode(f"the inputs of {name}", {**inputs, **place}) if internal else text
        task = Task(name, dependencies, arguments, folders, dynamic, experiment.timeout or timeout)
        plans[name] = task, cache.lookup(name, dependencies, partial(state, tree=sources))
    return plans


def _longest_first(plans: Sequence[Plan]) -> list[Task]:
    """Those by falling duration as last known, those never run in front: the short ones then fill the gaps."""
    lasting = {task.name: math.inf if known.last_seconds is None else known.last_seconds for task, known in plans}
    return sorted((task for task, _ in plans), key=lambda task: -lasting[task.name])


def _finish(answer: Answer, plan: Plan, cache: Cache, sources: SourceTree) -> Step:
    """Store an answer, unless it failed or its sources and data are no longer those that it was computed from."""
    (task, known), error = plan, answer.error
    step = partial(Step, answer.name, seconds=answer.seconds, dependencies=task.dependencies)
    try:
        if answer.text is not None:
            result = json.loads(answer.text)
            solvers = solvers_in(f"the result of {answer.name}", result)
            fields = {name: getattr(answer, name) for name in ("data", "untraced", "files", "seconds")}
            entry = Entry(dependencies=task.dependencies, solvers=solvers, result=result, **fields)
            read = {**task.dependencies.sources, **answer.data}
            moved = any(state(label, sources) != then for label, then in read.items())
            unkept = EDITED if moved else cache.store(answer.name, entry)
            return step(action=Action.COMPUTED, reason=unkept or known.reason, entry=entry)
    except AuditError as failure:
        error = describe(failure, sources)
    return step(action=Action.FAILED, reason=known.reason, error=error)
