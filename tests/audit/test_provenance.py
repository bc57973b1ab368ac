"""A run that finds everything as the last one left it says the same and does nothing; any change makes it work."""

import hashlib
import importlib.metadata
import shutil
from pathlib import Path
from unittest.mock import patch

import pytest
from lab import committed, git, make_lab

import replication.audit.run.last as unchanged
from replication import extras
from replication.audit.run.last import Last
from replication.audit.run.tracing import Trace
from replication.audit.store import provenance
from replication.audit.store.provenance import git_state, read_environment, run_date, run_record
from replication.errors import AuditError


@pytest.fixture
def project(tmp_path: Path) -> Path:
    root = tmp_path / "project"
    for name in ("papers/a.py", "report/template.html.j2", "report/results.json", "figures/f.svg", "README.md"):
        write(root / name, "one\n")
    return committed(root)


def test_commit_of_a_clean_tree(project: Path) -> None:
    assert git_state(project) == (git(project, "rev-parse", "HEAD"), False)


SOURCES = ("papers/a.py", "papers/new.py", "report/template.html.j2", "replication/x.py")
WRITTEN = (
    *("report/results.json", "report/index.html", "report/toy2020/index.html", "figures/f.svg", "figures/new.csv"),
    *(".cache/replication/e.json", "benchmarks/results.md"),
)


@pytest.mark.parametrize("name", [*SOURCES, *WRITTEN])
def test_edited_and_untracked_sources_make_it_dirty_and_what_a_run_writes_does_not(project: Path, name: str) -> None:
    write(project / name, "two\n")
    assert git_state(project)[1] is (name in SOURCES)


def test_what_git_refuses_says_nothing(project: Path) -> None:
    assert provenance.git(project, "rev-parse", "HEAD")
    assert provenance.git(project, "rev-parse", "no-such-branch") is None


def test_without_git_nothing_is_claimed(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inner = project / "unpacked"
    inner.mkdir()
    assert git_state(inner) == ("unknown", None), "the repository around an unpacked archive is not meant"
    shutil.rmtree(project / ".git")
    assert git_state(project) == ("unknown", None)
    monkeypatch.setenv("PATH", "")
    assert git_state(project) == ("unknown", None)


@pytest.mark.parametrize("epoch", ["", "soon", "1.5", "9" * 30])
def test_the_date_comes_from_the_environment_or_is_refused(monkeypatch: pytest.MonkeyPatch, epoch: str) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert run_date() == "1970-01-02T00:00:00Z"
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert run_date() > "2024"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    with pytest.raises(AuditError, match=f"SOURCE_DATE_EPOCH must be whole seconds since 1970, got '{epoch}'"):
        run_date()


def test_environment_names_lock_and_declared_packages(tmp_path: Path) -> None:
    (tmp_path / "requirements.lock").write_bytes(b"numpy==1\n")
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "toy"\ndependencies = ["numpy>=2; python_version>\'3\'", "msgspec"]\n', encoding="utf-8"
    )
    environment = read_environment(tmp_path)
    assert environment.lock_sha256 == hashlib.sha256(b"numpy==1\n").hexdigest()
    assert environment.packages == {name: importlib.metadata.version(name) for name in ("msgspec", "numpy")}


def test_a_declared_package_that_is_missing_is_named(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "toy"\ndependencies = ["no-such-package-anywhere"]\n', encoding="utf-8"
    )
    with pytest.raises(AuditError, match=r"no-such-package-anywhere is not installed; install it with pip"):
        read_environment(tmp_path)


def test_record_of_this_project_is_complete() -> None:
    root = Path(__file__).parents[2]
    record = run_record(root, read_environment(root), {})
    assert record.threads == 1
    assert "openblas" in record.blas.lower() or "mkl" in record.blas.lower() or "accelerate" in record.blas.lower()
    assert {"numpy", "scipy", "cvxpy", "clarabel", "control"} <= set(record.packages)
    assert record.cpu and record.platform and len(record.lock_sha256) == 64


def test_without_a_project_the_packages_are_those_of_this_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert {"numpy", "scipy", "msgspec"} <= set(read_environment(tmp_path).packages)
    assert "pytest" not in read_environment(tmp_path).packages
    before = read_environment(tmp_path)
    installed = importlib.metadata.version
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "9" if name == "numpy" else installed(name))
    assert read_environment(tmp_path) != before
    monkeypatch.setattr(extras, "DISTRIBUTION", "no-such-package-anywhere")
    assert read_environment(tmp_path).packages == {}


SAID = ("all is well",), 0


@pytest.fixture
def a_project(tmp_path: Path) -> Path:
    for name in ("papers/one.py", "papers/data/table.csv", "requirements.lock", "report/page.html.j2"):
        write(tmp_path / name, name)
    return tmp_path


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def last(root: Path, *asked: str) -> Last:
    written = [root / "figures", root / "report" / "results.json"]
    return Last(root, written, asked, root / ".cache" / "replication")


def a_run(root: Path) -> None:
    watched = last(root)
    write(root / "report" / "results.json", "{}")
    write(root / "figures" / "one.svg", "<svg/>")
    write(root / ".cache" / "replication" / "one.json", "a result")
    watched.keep(SAID, Trace())


def test_what_was_left_alone_says_the_same(a_project: Path) -> None:
    assert last(a_project).said() is None
    a_run(a_project)
    assert last(a_project).said() == SAID
    write(a_project / ".venv" / "thing.py", "installed")
    write(a_project / "papers" / "__pycache__" / "one.pyc", "compiled")
    write(a_project / "env" / "pyvenv.cfg", "home = /usr")
    write(a_project / "env" / "lib" / "thing.py", "installed")
    assert last(a_project).said() == SAID


@pytest.mark.parametrize(
    ("name", "text"),
    [
        *(("papers/one.py", "changed"), ("papers/two.py", "new"), ("papers/data/table.csv", "1,2")),
        *(("papers/data/table.csv", None), ("requirements.lock", "numpy==0"), ("report/page.html.j2", "changed")),
        *(("report/results.json", "[]"), ("figures/one.svg", "<svg></svg>"), ("figures/one.svg", None)),
        *((".cache/replication/one.json", None), (".cache/replication/one.json", "damaged")),
        *((".cache/replication/last-run.json", text) for text in ("{", '{"said": 1, "sha256": ""}')),
    ],
)
def test_every_change_counts(a_project: Path, name: str, text: str | None) -> None:
    a_run(a_project)
    (a_project / name).unlink() if text is None else write(a_project / name, text)
    assert last(a_project).said() is None


def test_other_words_of_an_unchanged_run_are_not_believed(a_project: Path) -> None:
    a_run(a_project)
    kept = a_project / ".cache" / "replication" / "last-run.json"
    kept.write_text(kept.read_text().replace("all is well", "all is fine"))
    assert last(a_project).said() is None


def test_another_question_or_machine_is_another_run(a_project: Path) -> None:
    a_run(a_project)
    assert last(a_project, "one").said() is None
    with patch.object(unchanged, "machine", return_value=["another processor"]):
        assert last(a_project).said() is None


def test_a_source_edited_meanwhile_is_not_taken_for_what_was_run(a_project: Path) -> None:
    watched = last(a_project)
    write(a_project / "report" / "results.json", "{}")
    write(a_project / "report" / "page.html.j2", "edited by hand")
    watched.keep(SAID, Trace())
    assert last(a_project).said() is None


@pytest.mark.slow
def test_the_second_run_after_a_run_reads_no_result(tmp_path: Path) -> None:
    lab = make_lab(tmp_path / "lab")
    assert lab.cli("run").returncode == 0
    first = lab.cli("run")
    again = lab.python("-X", "importtime", "-m", "replication", "run")
    assert (again.stdout, again.returncode) == (first.stdout, first.returncode)
    assert "0 computed" in again.stdout
    assert not [name for name in ("papers.toy2020", "numpy", "scipy", "audit.declare") if name in again.stderr]
    kept = next((lab.root / ".cache" / "replication").glob("toy2020.*.json"))
    kept.unlink()
    assert "1 computed" in lab.cli("run").stdout
    source = lab.root / "papers" / "other2021.py"
    source.write_text(source.read_text() + "\n# edited\n")
    edited = lab.python("-X", "importtime", "-m", "replication", "run")
    assert "1 computed" in edited.stdout and "papers.toy2020" in edited.stderr
