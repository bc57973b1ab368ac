"""Every long sweep is cut into experiments: a run that is killed in the middle goes on with the parts that are left."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest

import papers
from papers.mustafa.experiments.draws import DRAWS as SEQUENCES
from papers.okajima2023.experiments.declared import DRAWS, PERIOD_TABLE
from papers.peet2019.experiments.declared import DEFAULT_CELLS
from papers.shao.experiments.tracking import SEARCH
from replication.audit.model import Results
from replication.audit.parts import Paper
from replication.audit.run.pool import Action, processes
from replication.audit.run.runner import Outcome, run
from replication.audit.store.cache import Cache
from replication.audit.store.sources import default_packages

ROOT = Path(__file__).resolve().parents[2]
SWEEPS: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "timings": (tuple(f"okajima2023.{name}" for name in PERIOD_TABLE), {"largest": 2}),
    "readings": (tuple(f"shao.{name}" for name in SEARCH), {}),
    "sequences": (tuple(f"mustafa.{name}" for name in SEQUENCES), {"seeds": 8}),
    "draws": (tuple(f"okajima2023.{name}" for name in DRAWS), {"seeds": 8}),
    "cells": (tuple(f"peet2019.ex4.n{n}k{k}" for n, k in DEFAULT_CELLS), {}),
}
"""Experiments of each sweep, and the inputs that make them short."""
TRIED, FINISHED = 2, 1
"""Parts of a sweep that the test runs, and how many are stored when the run is killed."""


def cut(sweep: str) -> Paper:
    """The paper of a sweep with nothing but the first parts of it."""
    names, short = SWEEPS[sweep]
    paper = papers.load([names[0].partition(".")[0]])[0]
    parts = tuple(
        dataclasses.replace(experiment, inputs={**experiment.inputs, **short})
        for experiment in paper.experiments
        if experiment.name in names[:TRIED]
    )

    def nothing(results: Results) -> tuple[()]:
        return ()

    return msgspec.structs.replace(
        paper, experiments=parts, claims=(), errata=(), figures=(), tables=(), scope=(), findings=nothing,
        sensitivity=nothing, common=nothing,
    )  # fmt: skip


def resume(sweep: str, root: Path, progress: Callable[[str], None] = lambda line: None) -> Outcome:
    """Run the parts in a project at `root` with no certificates, whose results lie there too."""
    cache = Cache(root / "results")
    return run(
        [cut(sweep)],
        cache=cache,
        root=root,
        packages=default_packages(ROOT),
        executor=partial(processes, jobs=1),
        progress=progress,
    )


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
