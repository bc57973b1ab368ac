"""The wheel alone audits a paper of another field in an empty folder, as a journal takes it.

Outputs and errors speak of that paper alone, and the archive rebuilds itself.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from lab import committed

from replication.audit.publish.archive import INSTALL, RUN
from replication.extras import EXTRAS
from tests.anywhere.conftest import ROOT, Stranger, bare, environment, verdicts
from tests.patience import PATIENCE

pytestmark = pytest.mark.slow

EPIDEMIC, JOURNAL = (Path(__file__).parent / name for name in ("epidemic", "journal"))
"""The paper; settings and citation of its project, and a certificate of a plant of one's own."""
OURS = re.compile(
    r"slow.sensor|control eng|\bmake (?:report|readme|lock|artifact|coq|verify\S*|test)\b|`make|okajima|mustafa|"
    r"\bshao\b|peet\b|state estimation|estimators?\b|kalman|\[estimation\]|\bdocs/",
    re.IGNORECASE,
)
"""What is of this project, and belongs in no output of another."""


@pytest.fixture(scope="module")
def project(stranger: Stranger) -> Stranger:
    """The project of the stranger under git, run, exported and packed."""
    begun = stranger.run("replication", "new", "epidemic", "--ci")
    as_it_is = stranger.run("replication", "run")
    assert begun.returncode == as_it_is.returncode == 0, begun.stderr + as_it_is.stderr + as_it_is.stdout
    for path in EPIDEMIC.iterdir():
        shutil.copy(path, stranger.home / "papers" / "epidemic" / path.name)
    for name in ("replication.toml", "CITATION.cff"):
        shutil.copy(JOURNAL / name, stranger.home / name)
    committed(stranger.home)
    for words in (("run",), ("export",), ("artifact", "--to", "../epidemics.zip")):
        done = stranger.run("replication", *words)
        assert done.returncode == 0, done.stdout + done.stderr
        assert not OURS.search(done.stdout + done.stderr)
    return stranger


@contextmanager
def edited(project: Stranger, name: str, old: str, new: str) -> Iterator[None]:
    """A file of the paper with something else in it for a while."""
    path = project.home / "papers" / "epidemic" / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    yield
    path.write_text(text, encoding="utf-8")


def test_what_an_extra_installs_is_not_there_and_a_project_is_asked_for(stranger: Stranger) -> None:
    code = f"import importlib.util as u; print([name for name in {list(EXTRAS)} if u.find_spec(name)])"
    assert stranger.run("python", "-c", code).stdout.strip() == "[]"
    empty = stranger.home.with_name("empty")
    empty.mkdir()
    elsewhere = Stranger(empty, stranger.environment)
    assert "No module named 'papers'" in elsewhere.run("python", "-c", "import papers").stderr
    done = elsewhere.run("replication", "run")
    assert done.returncode == 2
    assert "there is no replication.toml" in done.stderr and "`replication new KEY`" in done.stderr


def test_a_paper_of_another_field_has_its_verdicts_and_report(project: Stranger) -> None:
    assert verdicts(project.home) == {
        "epidemic.growth": "reproduced",
        "epidemic.doubling": "reproduced",
        "epidemic.final": "reproduced after erratum",
    }
    packages = json.loads((project.home / "report" / "results.json").read_bytes())["run"]["packages"]
    assert not set(EXTRAS) & set(packages) and "numpy" in packages
    page = (project.home / "report" / "index.html").read_text(encoding="utf-8")
    assert all(words in page for words in ("the growth of epidemics", "Epidemics, replicated", "B. Reader"))
    assert "irregular" not in page and (project.home / "figures" / "epidemic-course.svg").is_file()


WRONG = (
    "changed verdict: epidemic.doubling is differs",
    "epidemic.doubling: the computed number is 10^-2 times the print; another unit",
)


@pytest.mark.parametrize(("growth", "doubling", "said"), [("0,375", "1.85(2)", ()), ("0.375 ± 0.002", "185 %", WRONG)])
def test_a_print_as_other_fields_write_it(project: Stranger, growth: str, doubling: str, said: tuple[str, ...]) -> None:
    with (
        edited(project, "printed.toml", '"0.375"', f'"{growth}"'),
        edited(project, "printed.toml", '"1.85"', f'"{doubling}"'),
    ):
        done = project.run("replication", "run", "--output", "../other")
    assert done.returncode == (1 if said else 0), done.stdout + done.stderr
    assert all(words in done.stdout for words in said), done.stdout
    told = json.loads((project.home.parent / "other" / "results.json").read_bytes())["claims"]
    assert [one["judgement"]["verdict"] for one in told if one["claim"]["id"] == "epidemic.growth"] == ["reproduced"]


def test_reasons_ask_for_no_certificate_and_a_theorem_is_verified_without_its_extra(project: Stranger) -> None:
    names = ["growth", "doubling", "final"]
    entry = {"claims": [f"epidemic.{name}" for name in names], "reason": "Computed in floating point."}
    listed = project.home / "papers" / "epidemic" / "theorems.json"
    listed.write_text(json.dumps([entry]), encoding="utf-8")
    assert project.run("replication", "run", "--output", "../other").returncode == 0
    done = project.run("replication", "verify")
    listed.unlink()
    assert (done.returncode, done.stdout, done.stderr) == (1, "0 of 0 certificates proved\n", "")
    radius = {"radius": "511/1024"}  # below what it is
    stable = json.loads((JOURNAL / "stable.json").read_bytes())
    for changed, begins in (({}, "proved stable.json: own plant: "), ({"witness": radius}, "NOT PROVED stable.json: ")):
        (project.home / "stable.json").write_text(json.dumps({**stable, **changed}), encoding="utf-8")
        done = project.run("replication", "verify", "stable.json")
        assert done.returncode == bool(changed) and done.stdout.startswith(begins)
    (project.home / "stable.json").unlink()


@pytest.fixture(scope="module")
def unpacked(project: Stranger) -> Path:
    with zipfile.ZipFile(project.home.parent / "epidemics.zip") as archive:
        archive.extractall(project.home.parent / "elsewhere")
    return project.home.parent / "elsewhere" / "epidemics"


def test_no_output_speaks_of_another_project(project: Stranger, unpacked: Path) -> None:
    texts = {
        path.relative_to(unpacked).as_posix(): path.read_text(encoding="utf-8")
        for path in unpacked.rglob("*")
        if path.is_file() and path.suffix != ".whl"
    }
    assert {"codecheck.yml", ".zenodo.json", "exports/claims.jsonld", "REBUILD.md",
            "report/index.html", "report/articles/epidemic.html", "Dockerfile",
            "ro-crate-metadata.json"} <= set(texts)  # fmt: skip
    wheel = re.compile(r"\S*tool/slow_sensor_replication-\S+\.whl\S*")
    found = {name: said for name, text in texts.items() if (said := OURS.findall(wheel.sub("", text)))}
    assert not found


SAYS = """
import contextlib, io, json, sys
from replication.cli import main
told = []
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code
    told.append([code, out.getvalue()])
print(json.dumps(told))
"""
COMMANDS = [
    *(([name, "--help"], 0) for name in ("new", "run", "export", "artifact", "guide", "coverage", "check")),
    (["--help"], 0),
    (["new", "Upper"], 2),
    (["show", "odd"], 2),
    (["guide", "odd"], 2),
    (["check"], 0),
    (["list"], 0),
    (["coverage"], 0),
]


def test_no_help_and_no_error_speaks_of_another_project(project: Stranger) -> None:
    done = project.run("python", "-c", SAYS, json.dumps([words for words, _ in COMMANDS]))
    assert done.returncode == 0, done.stderr
    for (words, code), (found, text) in zip(COMMANDS, json.loads(done.stdout), strict=True):
        assert found == code, (words, text)
        text = text.replace("replication design multirate cart.toml", "")
        lines = [line for line in text.splitlines() if OURS.search(line) and not line.lstrip().startswith("design ")]
        assert (words, lines) == (words, [])


@pytest.mark.parametrize(
    ("line", "cure"),
    [
        ("import scipy", "install it with `python -m pip install scipy`"),
        ("import sklearn.svm", "install it with `python -m pip install scikit-learn`"),
        ("import papers.epidemic.absent", "No module named 'papers.epidemic.absent'"),
    ],
)
def test_a_package_that_is_missing_is_told_with_its_own_name(project: Stranger, line: str, cure: str) -> None:
    with edited(project, "experiments.py", "", f"{line}\n"):
        done = project.run("replication", "run")
    assert done.returncode == 2 and cure in done.stderr and "[papers/epidemic/experiments.py:1]" in done.stderr
    assert not OURS.search(done.stderr) and ("pip" in done.stderr) is ("pip" in cure)


def test_what_this_program_itself_wants_is_told_with_its_versions(project: Stranger) -> None:
    done = project.run("replication", "design", "multirate", "plant.toml", "--periods", "1,4")
    assert done.returncode == 2 and 'install it with `python -m pip install "' in done.stderr
    assert "scipy>=" in done.stderr and "slow-sensor" not in done.stderr


def test_the_reply_of_the_authors_stands_with_the_claim(project: Stranger) -> None:
    said = "Two digits were exchanged in proof."
    shown = project.run("replication", "show", "epidemic.final").stdout
    assert f"  text: {said}\n  by: A. Author\n  date: '2031-05-04'" in shown
    page = (project.home / "report" / "index.html").read_text(encoding="utf-8")
    assert page.count(said) == 1 and f"A. Author replies, 2031-05-04:</strong> <bdi>{said}" in page
    graph = json.loads((project.home / "report" / "exports" / "claims.jsonld").read_bytes())["@graph"]
    comments = [node["comment"] for node in graph if "comment" in node]
    assert comments == [[{"@type": "Comment", "text": said, "author": "A. Author", "dateCreated": "2031-05-04"}]]


def test_a_reply_to_no_claim_is_told(project: Stranger) -> None:
    with edited(project, "paper.toml", '"final"', '"finale"'):
        done = project.run("replication", "run")
    assert done.returncode == 2 and "finale', which does not exist" in done.stderr and "final" in done.stderr


def test_workflow_and_container_take_the_steps_of_the_page(unpacked: Path) -> None:
    workflow = yaml.safe_load((unpacked / ".github" / "workflows" / "replication.yml").read_text(encoding="utf-8"))
    steps = workflow["jobs"]["audit"]["steps"]
    assert [step["run"] for step in steps if "run" in step] == [*INSTALL, *RUN]
    container = (unpacked / "Dockerfile").read_text(encoding="utf-8").splitlines()
    assert [line.removeprefix("RUN ") for line in container if line.startswith("RUN ")] == [*INSTALL]
    assert steps_of(unpacked)[2:] == [*INSTALL, *RUN]


def steps_of(unpacked: Path) -> list[str]:
    page = (unpacked / "REBUILD.md").read_text(encoding="utf-8")
    return page.partition("```sh\n")[2].partition("\n```")[0].splitlines()


def test_there_is_a_file_for_each_line_of_codecheck(unpacked: Path) -> None:
    content = yaml.safe_load((unpacked / "codecheck.yml").read_text(encoding="utf-8"))
    assert [item["file"] for item in content["manifest"] if not (unpacked / item["file"]).is_file()] == []
    assert content["certificate"] == "2026-001" and "check_time" not in content


def test_the_archive_runs_beside_nothing_but_python_and_packs_itself(project: Stranger, unpacked: Path) -> None:
    """As REBUILD.md says; the packages of its lock are linked, not installed anew."""
    (wheel,) = (unpacked / "tool").glob("*.whl")
    with zipfile.ZipFile(wheel) as packed, zipfile.ZipFile(next(project.home.glob("tool/*.whl"))) as first:
        assert packed.read("replication/cli.py") == first.read("replication/cli.py")
    place = environment(project.home.parent / "bare", wheel)
    pins = dict(re.findall(r"^(\S+)==(\S+)$", (unpacked / "requirements.lock").read_text(), re.MULTILINE))
    assert {"numpy", "msgspec", "matplotlib"} <= set(pins) and "slow-sensor-replication" not in pins
    alone = {"PATH": str(place / "bin"), "HOME": str(project.home.parent), "LANG": "C.UTF-8"}
    for step in (*RUN, "replication artifact --to again.zip", "replication artifact --check ."):
        done = subprocess.run(step.split(), cwd=unpacked, env=alone, capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == (1 if "--check" in step else 0), done.stdout + done.stderr
    changed = [line.partition(":")[0] for line in done.stdout.splitlines()[:-1]]
    assert all(name.startswith(("report/", "figures/")) for name in changed)
    assert verdicts(unpacked) == verdicts(project.home)
    assert (unpacked / "again.zip").is_file()


REBUILD = pytest.mark.skipif(
    os.environ.get("REBUILD") != "all", reason="installs everything anew; `make rebuild` asks for it"
)


@REBUILD
def test_the_archive_installs_itself_from_its_lock(project: Stranger, tmp_path: Path) -> None:
    with zipfile.ZipFile(project.home.parent / "epidemics.zip") as archive:
        archive.extractall(tmp_path)
    steps = "set -e\n" + "\n".join(steps_of(tmp_path / "epidemics"))
    succeeded([shutil.which("sh") or "sh", "-c", steps], tmp_path / "epidemics", bare(tmp_path / "alone"))
    assert verdicts(tmp_path / "epidemics") == verdicts(project.home)


TOOLS = ("sh", "make", "awk", "cp", "find", "mkdir", "rm", "test", "touch", "true", "uname")
"""Beside Python all that there is: make, and what POSIX promises to its recipes. No git, compiler, browser or Java."""
NEW_EACH_TIME = ("report/", "exports/", "SHA256SUMS", "ro-crate-metadata.json")
"""What holds times, dates and all digits of the run; its verdicts are compared by themselves."""


def succeeded(words: list[str], folder: Path, environment: dict[str, str] | None = None) -> str:
    ran = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert ran.returncode == 0, f"{words}: {ran.stderr[-3000:]}{ran.stdout[-1000:]}"
    return ran.stdout


def sums(archive: Path) -> dict[str, bytes]:
    """Each file of an archive that is the same in every run."""
    with zipfile.ZipFile(archive) as file:
        named = {name.partition("/")[2]: file.read(name) for name in file.namelist()}
    return {name: data for name, data in named.items() if not name.startswith(NEW_EACH_TIME)}


def test_a_machine_with_python_and_make_alone_has_no_more_and_another_source_is_seen(tmp_path: Path) -> None:
    alone = bare(tmp_path / "alone", *TOOLS)
    assert "Python 3" in succeeded(["python3", "--version"], tmp_path, alone)
    assert not any(shutil.which(absent, path=alone["PATH"]) for absent in ("git", "cc", "chromium", "java", "coqc"))
    for name, text in (("one", "same"), ("two", "same"), ("three", "other")):
        with zipfile.ZipFile(tmp_path / f"{name}.zip", "w") as archive:
            archive.writestr(f"{name}/papers/a.toml", text)
            archive.writestr(f"{name}/report/index.html", name)
    one, two, three = (sums(tmp_path / f"{name}.zip") for name in ("one", "two", "three"))
    assert one == two != three


@REBUILD
def test_the_archive_of_this_project_builds_itself_with_python_and_make_alone(tmp_path: Path) -> None:
    """The packages are installed from the lock, by the network."""
    first = tmp_path / "first"
    succeeded(["git", "clone", "--quiet", str(ROOT), str(first)], tmp_path)
    succeeded([sys.executable, "-m", "replication", "run"], first)
    succeeded([sys.executable, "-m", "replication", "artifact", "--to", "../one.zip"], first)
    with zipfile.ZipFile(tmp_path / "one.zip") as archive:
        archive.extractall(tmp_path)
    succeeded(["make", "artifact"], tmp_path / "one", bare(tmp_path / "alone", *TOOLS))
    (again,) = (tmp_path / "one" / "dist").glob("*.zip")
    assert sums(again) == sums(tmp_path / "one.zip")
    assert verdicts(tmp_path / "one") == verdicts(first)
