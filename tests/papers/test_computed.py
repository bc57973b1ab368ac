"""What a test has computed of an experiment is what a run takes for its result, and nothing else is."""

import dataclasses

import msgspec
from computed import ROOT, STORE, result

from papers.shao import PAPER
from replication.audit.parts import Paper
from replication.audit.run.runner import _plan
from replication.audit.store.cache import Lookup
from replication.audit.store.provenance import read_environment
from replication.audit.store.sources import SourceTree, default_packages
from tests.patience import PATIENCE

NAME = "shao.motor"


def lookup(paper: Paper) -> Lookup:
    sources = SourceTree(default_packages(ROOT))
    (experiment,) = (one for one in paper.experiments if one.name == NAME)
    places, environment = (ROOT, STORE[0].files), read_environment(ROOT)
    return _plan([experiment], [], places, environment, STORE[0].lookup, sources, PATIENCE)[NAME][1]


def test_a_run_reuses_what_a_test_has_computed() -> None:
    found = result(NAME)
    entry = lookup(PAPER).entry
    assert entry is not None and entry.result == found
    changed = tuple(
        dataclasses.replace(one, inputs={**one.inputs, "seed": 2}) if one.name == NAME else one
        for one in PAPER.experiments
    )
    assert lookup(msgspec.structs.replace(PAPER, experiments=changed)).reason == "changed: inputs"


def test_nobody_changes_the_result_of_another() -> None:
    result(NAME).clear()
    assert result(NAME)
