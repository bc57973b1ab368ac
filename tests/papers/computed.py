"""Results of single experiments as a run stores them, each computed once for all processes that share the tests.

They lie where the fresh run looks first: what a test has computed is no work of it, and the other way about.
"""

import functools
import json
from pathlib import Path
from typing import Any

import papers
from replication.audit.model import Experiment
from replication.audit.run.runner import Plan, _finish, _plan
from replication.audit.run.worker import compute
from replication.audit.store.cache import Cache
from replication.audit.store.provenance import Environment, read_environment
from replication.audit.store.sources import SourceTree, default_packages
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
STORE = [Cache(ROOT / "nowhere", read=False)]
"""Where the session keeps its results: conftest says it."""


def result(name: str) -> Any:
    """The result of an experiment by its full name; nobody else has the same object."""
    return json.loads(_stored(name))


class Computed(dict[str, Any]):
    """The results of a paper by their short names, each computed where it is asked for."""

    def __init__(self, key: str) -> None:
        super().__init__()
        self.key = key

    def __missing__(self, name: str) -> Any:
        self[name] = result(f"{self.key}.{name}")
        return self[name]


@functools.cache
def _stored(name: str) -> str:
    (store,), (environment, sources) = STORE, _project()

    def planned() -> Plan:
        return _plan([_experiments()[name]], {}, ROOT, store, environment, sources, PATIENCE)[name]

    plan = planned()
    if plan[1].entry is None:
        answer = compute(plan[0])
        assert answer.text is not None, answer.error
        _finish(answer, plan, store, sources)
        plan = planned()
    assert plan[1].entry is not None, plan[1].reason
    return json.dumps(plan[1].entry.result)


@functools.cache
def _experiments() -> dict[str, Experiment]:
    return {experiment.name: experiment for paper in papers.load() for experiment in paper.experiments}


@functools.cache
def _project() -> tuple[Environment, SourceTree]:
    return read_environment(ROOT), SourceTree(default_packages(ROOT))
