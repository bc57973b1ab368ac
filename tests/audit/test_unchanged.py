"""A run that finds everything as the last one left it says the same and does nothing; any change makes it work."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import pytest
from lab import make_lab

import replication.audit.run.tracing as unchanged
from replication.audit.run.tracing import LastRun, Said

SAID = Said(lines=("all is well",), tutorials=("delay",), code=0)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    for name in ("papers/one.py", "papers/data/table.csv", "requirements.lock", "report/page.html.j2"):
        write(tmp_path / name, name)
    return tmp_path


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def last(root: Path, *asked: str) -> LastRun:
    written = [root / "figures", root / "report" / "results.json"]
    return LastRun(root, written, asked, root / ".cache" / "replication")


def a_run(root: Path) -> None:
    watched = last(root)
    write(root / "report" / "results.json", "{}")
    write(root / "figures" / "one.svg", "<svg/>")
    write(root / ".cache" / "replication" / "one.json", "a result")
    watched.keep(SAID)


def test_what_was_left_alone_says_the_same(project: Path) -> None:
    assert last(project).said() is None
    a_run(project)
    assert last(project).said() == SAID
    write(project / ".venv" / "thing.py", "installed")
    write(project / "papers" / "__pycache__" / "one.pyc", "compiled")
    write(project / "env" / "pyvenv.cfg", "home = /usr")
    write(project / "env" / "lib" / "thing.py", "installed")
    assert last(project).said() == SAID


@pytest.mark.parametrize(
    "edit",
    [
        lambda root: write(root / "papers" / "one.py", "changed"),
        lambda root: write(root / "papers" / "two.py", "new"),
        lambda root: write(root / "papers" / "data" / "table.csv", "1,2"),
        lambda root: (root / "papers" / "data" / "table.csv").unlink(),
        lambda root: write(root / "requirements.lock", "numpy==0"),
        lambda root: write(root / "report" / "page.html.j2", "changed"),
        lambda root: write(root / "report" / "results.json", "[]"),
        lambda root: write(root / "figures" / "one.svg", "<svg></svg>"),
        lambda root: (root / "figures" / "one.svg").unlink(),
        lambda root: (root / ".cache" / "replication" / "one.json").unlink(),
        lambda root: write(root / ".cache" / "replication" / "one.json", "damaged"),
        lambda root: write(root / ".cache" / "replication" / "last-run.json", "{"),
        lambda root: write(root / ".cache" / "replication" / "last-run.json", '{"said": 1, "sha256": ""}'),
    ],
)
def test_every_change_counts(project: Path, edit: Callable[[Path], None]) -> None:
    a_run(project)
    edit(project)
    assert last(project).said() is None


def test_other_words_of_an_unchanged_run_are_not_believed(project: Path) -> None:
    a_run(project)
    kept = project / ".cache" / "replication" / "last-run.json"
    kept.write_text(kept.read_text().replace("all is well", "all is fine"))
    assert last(project).said() is None


def test_another_question_or_machine_is_another_run(project: Path) -> None:
    a_run(project)
    assert last(project, "one").said() is None
    with patch.object(unchanged, "kernel", return_value="of another processor"):
        assert last(project).said() is None


def test_a_source_edited_meanwhile_is_not_taken_for_what_was_run(project: Path) -> None:
    watched = last(project)
    write(project / "report" / "results.json", "{}")
    write(project / "report" / "page.html.j2", "edited by hand")
    watched.keep(SAID)
    assert last(project).said() is None


@pytest.mark.slow
def test_the_second_run_after_a_run_reads_no_result(tmp_path: Path) -> None:
    lab = make_lab(tmp_path / "lab")
    assert lab.cli("run").returncode == 0
    first = lab.cli("run")
    again = lab.python("-X", "importtime", "-m", "replication", "run")
    assert (again.stdout, again.returncode) == (first.stdout, first.returncode)
    assert "0 computed" in again.stdout and "papers.toy2020" not in again.stderr
    kept = next((lab.root / ".cache" / "replication").glob("toy2020.*.json"))
    kept.unlink()
    assert "1 computed" in lab.cli("run").stdout
    assert "0 computed" in lab.cli("run").stdout
    source = lab.root / "papers" / "other2021.py"
    source.write_text(source.read_text() + "\n# edited\n")
    edited = lab.python("-X", "importtime", "-m", "replication", "run")
    assert "1 computed" in edited.stdout and "papers.toy2020" in edited.stderr
