"""On another type of processor, which the BLAS imitates, a run changes no file that is committed.

`make test` computes two papers, and each experiment on two of the four types, one with AVX2 and the oldest or newest;
what the others give, and the proofs, which no BLAS touches, are those of the fresh run. `make processors` computes all
of all papers on each.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import computed
import pytest

import papers
from replication.audit.run.runner import Outcome
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
TYPES = {"Haswell": 0, "Zen": 1, "SkylakeX": 0, "Prescott": 1}
"""The first of every two experiments that is computed. Haswell and Zen have AVX2 and nearly the same kernels, SkylakeX
has AVX-512; Prescott, the oldest, has neither AVX nor fused products.
"""
WHOLE = os.environ.get("PROCESSORS") == "all"
MULTIPLY = "import numpy; a = numpy.ones((64, 64)); assert (a @ a == 64).all()"
PAPERS = () if WHOLE else ("okajima2023", "shao")
FOLDERS = ("replication", "papers", "figures", "certificates", "docs")
WRITTEN = ("figures", "docs", "README.md", "papers")


def copied(target: Path) -> Path:
    """The project without what is built."""
    target.mkdir()
    for path in ROOT.iterdir():
        if path.is_dir() and path.name in FOLDERS:
            shutil.copytree(path, target / path.name, ignore=shutil.ignore_patterns("__pycache__"))
        elif path.is_file():
            shutil.copy(path, target)
    return target


def contents(root: Path) -> dict[str, str]:
    """The checksum of each file that commands write among the sources."""
    files = [
        path for name in WRITTEN for path in ([root / name] if (root / name).is_file() else (root / name).rglob("*"))
    ]
    return {
        str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
        if path.is_file() and "__pycache__" not in path.parts
    }


def changed(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """The files that are other than before, new, or gone."""
    return sorted(name for name in before | after if before.get(name) != after.get(name))


def test_a_digit_that_changes_is_seen(tmp_path: Path) -> None:
    folder = shutil.copytree(ROOT / "figures", tmp_path / "figures")
    before = contents(tmp_path)
    one, two = sorted(folder.glob("*.csv"))[:2]
    one.write_bytes(one.read_bytes().replace(b"1", b"2", 1))
    two.unlink()
    assert changed(before, contents(tmp_path)) == [f"figures/{one.name}", f"figures/{two.name}"]


def can_run(kind: str) -> bool:
    """Whether this processor has the instructions of the kernels: asked of a child, which an unknown one would end."""
    words, environment = [sys.executable, "-c", MULTIPLY], {**os.environ, "OPENBLAS_CORETYPE": kind}
    return subprocess.run(words, env=environment, capture_output=True, timeout=PATIENCE).returncode == 0


def test_some_kernels_can_be_run() -> None:
    assert any(can_run(kind) for kind in TYPES)
    assert subprocess.run([sys.executable, "-c", "import os; os.kill(os.getpid(), 4)"]).returncode == -4


def left_out(project: Path, first: int, fresh: Outcome) -> set[str]:
    """Give the project what a fresh run computed, but every second experiment, whose names are returned."""
    halves = shutil.ignore_patterns(".*")  # what another process is about to write
    store = shutil.copytree(computed.STORE[0].directory, project / ".cache" / "replication", ignore=halves)
    assert not fresh.failures
    names = sorted(experiment.name for paper in papers.load(PAPERS) for experiment in paper.experiments)[first::2]
    for name in names:
        (store / f"{name}.json").unlink()
    return set(names)


@pytest.mark.slow
@pytest.mark.parametrize("kind", TYPES)
def test_a_run_on_another_processor_leaves_the_sources_as_they_are(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if not can_run(kind):
        pytest.skip(f"this processor lacks instructions that the kernels for {kind} use")
    project = copied(tmp_path / "project")
    wanted = set() if WHOLE else left_out(project, TYPES[kind], request.getfixturevalue("fresh_run"))
    before = contents(project)
    environment = {**os.environ, "OPENBLAS_CORETYPE": kind, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    commands = [["replication", "run", *PAPERS], *([["replication.audit.publish.readme"]] if WHOLE else [])]
    for command in commands:
        words = [sys.executable, "-m", *command]
        ran = subprocess.run(words, cwd=project, env=environment, capture_output=True, text=True, timeout=PATIENCE)
        assert ran.returncode == 0, ran.stderr[-2000:] + ran.stdout[-2000:]
        assert wanted <= set(re.findall(r"computed (\S+)", ran.stdout))
    assert changed(before, contents(project)) == []
