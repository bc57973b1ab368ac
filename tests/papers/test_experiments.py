"""Experiments: what a test computed is what a run takes, sweeps go on when killed, two papers meet on one plant."""

import dataclasses
import json
import os
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import msgspec
import numpy as np
import pytest
from computed import ROOT, STORE, result

import papers
from papers import mustafa, okajima2023
from papers._common import MULTIPLES, PLANT, Told
from papers.mustafa.experiments import levels as irregular
from papers.okajima2023.experiments import designs as slow
from papers.peet2019.experiments import examples as late
from papers.peet2019.experiments.declared import DEFAULT_CELLS
from papers.shao import PAPER
from papers.shao.experiments.tracking import SEARCH
from replication.audit.model import Results
from replication.audit.parts import Paper
from replication.audit.run import runner
from replication.audit.run.runner import Outcome, _plan, run
from replication.audit.run.worker import Action, processes
from replication.audit.store.cache import Cache, Lookup
from replication.audit.store.provenance import read_environment
from replication.audit.store.sources import SourceTree, default_packages
from replication.errors import AuditError
from tests.patience import PATIENCE

NAME = "shao.motor"


def lookup(paper: Paper) -> Lookup:
    sources = SourceTree(default_packages(ROOT))
    (experiment,) = (one for one in paper.experiments if one.name == NAME)
    return _plan([experiment], {}, ROOT, STORE[0], read_environment(ROOT), sources, PATIENCE)[NAME][1]


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


SWEEPS = {
    "readings": tuple(f"shao.{name}" for name in SEARCH),
    "cells": tuple(f"peet2019.ex4.n{n}k{k}" for n, k in DEFAULT_CELLS),
}
"""Experiments of each sweep."""
TRIED, FINISHED = 2, 1
"""Parts of a sweep that the test runs, and how many are stored when the run is killed."""


def cut(sweep: str) -> Paper:
    """The paper of a sweep with nothing but the first parts of it."""
    (paper,) = papers.load([SWEEPS[sweep][0].partition(".")[0]])
    parts = tuple(experiment for experiment in paper.experiments if experiment.name in SWEEPS[sweep][:TRIED])

    def nothing(results: Results) -> tuple[()]:
        return ()

    return msgspec.structs.replace(
        paper, experiments=parts, claims=(), errata=(), figures=(), tables=(), scope=(), findings=nothing,
        sensitivity=nothing, common=nothing,
    )  # fmt: skip


def resume(sweep: str, root: Path, progress: Callable[[str], None] = lambda line: None) -> Outcome:
    """Run the parts in a project at `root` with no certificates, whose results lie there too."""
    executor = partial(processes, jobs=1)
    with patch.object(runner, "default_packages", lambda _: default_packages(ROOT)):
        return run([cut(sweep)], cache=Cache(root / "results"), root=root, executor=executor, progress=progress)


def kill(line: str) -> None:
    """End this process, and not kindly, as soon as enough parts are stored."""
    assert " computed " in line
    if line.startswith(f"[{FINISHED}/"):
        os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.parametrize("sweep", SWEEPS)
def test_a_killed_sweep_goes_on_with_what_is_left(sweep: str, tmp_path: Path) -> None:
    child = os.fork()
    if child == 0:
        try:
            resume(sweep, tmp_path, kill)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    results = tmp_path / "results"
    left = {path.name: path.stat().st_mtime_ns for path in results.iterdir()}
    resumed = resume(sweep, tmp_path)
    done = [step.action for step in resumed.log]
    assert done == [Action.REUSED] * FINISHED + [Action.COMPUTED] * (TRIED - FINISHED), resumed.log
    assert len(left) == FINISHED
    assert {name: (results / name).stat().st_mtime_ns for name in left} == left
    stored = {path.stem: json.loads(path.read_text())["result"] for path in results.iterdir()}
    assert stored == resumed.results_by_experiment


AGREEMENT = 1e-9


@pytest.fixture(scope="module")
def found() -> dict[str, list[list[float]]]:
    return slow.on_common_plant(PLANT, list(MULTIPLES))


def test_two_estimators_give_the_same_level_with_the_ideal_sensor(found: dict[str, list[list[float]]]) -> None:
    ((other, _),) = irregular.on_common_plant(PLANT, [1], leaves=2, horizon=50)
    assert other == pytest.approx(found["slow"][0][1], rel=AGREEMENT)
    assert found["late"][0] == found["slow"][0]


def test_slower_and_later_is_never_better(found: dict[str, list[list[float]]]) -> None:
    for name in ("slow", "late"):
        levels = np.array(found[name])
        assert np.all(np.diff(levels[:, 0]) > 0)
        assert np.all(levels[:, 0] <= levels[:, 1])
    # A measurement that comes m - 1 instants late brings more than one every m instants, which is as old at the most.
    assert np.all(np.array(found["late"])[1:, 1] < np.array(found["slow"])[1:, 0])


@pytest.mark.slow
def test_continuous_time_delays_cost_more_the_longer_they_are() -> None:
    levels = np.array(late.on_common_plant(PLANT, list(MULTIPLES), 2))
    assert np.all(levels[:, 0] <= levels[:, 1])
    # The brackets do not even touch.
    assert np.all(levels[1:, 0] > levels[:-1, 1])


@pytest.mark.parametrize("module", [mustafa, okajima2023])
@pytest.mark.parametrize("what", ["errata", "figures"])
def test_what_told_toml_names_and_no_function_makes_is_refused(what: str, module: ModuleType) -> None:
    told = Told.read(str(module.__file__))
    make = getattr(told, what)
    with pytest.raises(AuditError, match=f"do not name the same {what}; only one of them has .*another"):
        make({**dict.fromkeys(told.said[what]), "another": None})


def test_a_finding_is_left_out_or_said_for_each_case_as_its_facts_say() -> None:
    told = Told({"findings": {"one": "One {n}.", "none": "Not {n}.", "each": "{n} in {case}.", "empty": "{case}"}}, {})
    facts = {"n": 0, "none": False, "each": [{"case": "a"}, {"case": "b"}], "empty": []}
    assert told.findings(lambda results: facts)({}) == ("One 0.", "0 in a.", "0 in b.")


def test_a_number_that_told_toml_names_and_nothing_gives_is_refused() -> None:
    with pytest.raises(AuditError, match=r"told.toml has {mincx} in .*; give that number"):
        Told.read(str(okajima2023.__file__)).simple()
