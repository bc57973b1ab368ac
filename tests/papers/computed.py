"""Results of single experiments as a run stores them, each computed once for all processes that share the tests.

They lie where the fresh run looks first: what a test has computed is no work of it, and the other way about.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

import papers
from replication.audit.model import Experiment
from replication.audit.run.worker import Task, compute, function_name
from replication.audit.store.cache import Cache, Dependencies, Entry
from replication.audit.store.jsonvalues import encode, solvers_in
from replication.audit.store.provenance import Environment, read_environment
from replication.audit.store.sources import SourceTree, default_packages

ROOT = Path(__file__).resolve().parents[2]
STORE = [Cache(ROOT / "nowhere", read=False)]
"""Where the session keeps its results: conftest says it."""


def result(name: str) -> Any:
    """The result of an experiment by its full name; nobody else has the same object."""
    return json.loads(_stored(name))


@functools.cache
def _stored(name: str) -> str:
    found, (store,) = _experiments()[name], STORE
    function, inputs = function_name(found), encode(name, dict(found.inputs), sort=True)
    environment, sources = _project()
    needed = Dependencies.on(environment, sources.files_of(function.partition(":")[0]), function, inputs)
    entry = store.lookup(name, needed).entry
    if entry is None:
        answer = compute(Task(name, function, inputs, sources.packages))
        assert answer.text is not None, answer.error
        value = json.loads(answer.text)
        solvers = solvers_in(name, value)
        entry = Entry(dependencies=needed, seconds=answer.seconds, solvers=solvers, result=value)
        store.store(name, entry)
    return json.dumps(entry.result)


@functools.cache
def _experiments() -> dict[str, Experiment]:
    return {experiment.name: experiment for paper in papers.load() for experiment in paper.experiments}


@functools.cache
def _project() -> tuple[Environment, SourceTree]:
    return read_environment(ROOT), SourceTree(default_packages(ROOT))
