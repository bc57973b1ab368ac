"""On another type of processor, which the BLAS imitates, a run changes no file that is committed.

`make test` computes two papers. Of each function behind their experiments, one experiment is computed on the oldest of
the types that are not this machine's own; all else, and the proofs, which no BLAS touches, is of the fresh run.
`make processors` computes all of all papers on each.
"""

import functools
import hashlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Set
from pathlib import Path

import computed
import msgspec
import pytest

import papers
from replication.audit.run.runner import Outcome
from replication.audit.run.worker import function_name
from replication.audit.store.cache import Cache, _read
from replication.audit.store.provenance import kernel
from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
TYPES = ("Prescott", "Haswell", "Zen", "SkylakeX")
"""The oldest has neither AVX nor fused products; Haswell and Zen have AVX2 and nearly the same kernels, SkylakeX has
AVX-512.
"""
WHOLE = os.environ.get("PROCESSORS") == "all"
MULTIPLY = """
import numpy
a = numpy.ones((64, 64))
assert (a @ a == 64).all()
from replication.audit.store.provenance import kernel
print(kernel())
"""
PAPERS = () if WHOLE else ("okajima2023", "shao")
FOLDERS = ("replication", "papers", "figures", "certificates", "docs", "benchmarks")
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


@functools.cache
def kernel_of(kind: str) -> str:
    """The kernels that a type stands for, as the cache knows them, if this processor has their instructions.

    Asked of a child, which an unknown instruction would end.
    """
    words, environment = [sys.executable, "-c", MULTIPLY], {**os.environ, "OPENBLAS_CORETYPE": kind}
    ran = subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=PATIENCE)
    return ran.stdout.strip()


def test_some_kernels_can_be_run() -> None:
    assert any(kernel_of(kind) for kind in TYPES)
    assert subprocess.run([sys.executable, "-c", "import os; os.kill(os.getpid(), 4)"]).returncode == -4


@functools.cache
def share() -> tuple[str, frozenset[str]]:
    """The oldest type other than this machine's own, and what is computed there: the first of each function."""
    other = next((kind for kind in TYPES if kernel_of(kind) not in ("", kernel())), "")
    experiments = [experiment for paper in papers.load(PAPERS) for experiment in paper.experiments]
    firsts = {function_name(experiment): experiment.name for experiment in reversed(experiments)}
    return other, frozenset(firsts.values())


def leave_out(project: Path, kind: str, names: Set[str]) -> None:
    """Give the project what a fresh run computed, as if by these kernels, but the experiments of these names."""
    store = Cache(project / ".cache" / "replication")
    for path in computed.STORE[0].directory.glob("[!.]*.json"):
        entry = _read(path.read_bytes())
        if entry is not None and path.stem not in names:
            named = entry.dependencies
            if named.kernel:  # what computes in exact numbers only has none
                named = msgspec.structs.replace(named, kernel=kernel_of(kind))
            store.store(path.stem, msgspec.structs.replace(entry, dependencies=named))


@pytest.mark.slow
@pytest.mark.parametrize("kind", TYPES)
def test_a_run_on_another_processor_leaves_the_sources_as_they_are(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if not kernel_of(kind):
        pytest.skip(f"this processor lacks instructions that the kernels for {kind} use")
    if not WHOLE and kind != share()[0]:
        pytest.skip(f"`make processors` computes on the kernels for {kind}")
    project = copied(tmp_path / "project")
    if not WHOLE:
        fresh: Outcome = request.getfixturevalue("fresh_run")
        assert not fresh.failures
        leave_out(project, kind, share()[1])
    before = contents(project)
    environment = {**os.environ, "OPENBLAS_CORETYPE": kind, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    commands = (
        [["replication", "run"], ["benchmarks.readme"]] if WHOLE else [["replication", "run", *PAPERS, "--jobs=1"]]
    )
    for command in commands:
        words = [sys.executable, "-m", *command]
        ran = subprocess.run(words, cwd=project, env=environment, capture_output=True, text=True, timeout=PATIENCE)
        assert ran.returncode == 0, ran.stderr[-2000:] + ran.stdout[-2000:]
        assert WHOLE or set(re.findall(r"computed (\S+)", ran.stdout)) == share()[1]
    assert changed(before, contents(project)) == []
