"""The wheel alone, with what it needs and nothing more, audits a paper of another field in an empty folder."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from replication.extras import EXTRAS
from tests.patience import PATIENCE

ROOT = Path(__file__).parents[2]
EPIDEMIC = Path(__file__).parent / "epidemic"
PARTS = ("replication", "papers", "README.md", "LICENSE", "pyproject.toml")
STABLE = {
    "format": "replication-certificate/1",
    "paper": None,
    "name": "stable",
    "claims": [],
    "statement": "dualrate.stable",
    "plant": {
        "name": "scalar",
        "A": [["1"]],
        "B": [["1"]],
        "C": [["1"]],
        "K": [["-2"]],
        "L": [["2"]],
        "T": "1/1000",
        "M": "5",
    },
    "parameters": {"observer": "fast_sensor"},
    "bound": {},
    "witness": {"radius": "1023/1024"},
}
"""A certificate of a plant of one's own."""

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Stranger:
    """A folder, and an environment in which only the wheel and its dependencies are installed."""

    home: Path
    environment: Path

    def run(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        words = [str(self.environment / "bin" / program), *arguments]
        return subprocess.run(words, cwd=self.home, capture_output=True, text=True, timeout=PATIENCE, check=False)


def needed(requirements: list[str]) -> dict[str, str]:
    """The installed distributions that these need, and those need, by name with version."""
    found: dict[str, str] = {}
    waiting = list(requirements)
    while waiting:
        wanted = Requirement(waiting.pop())
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": ""}):
            continue
        try:
            there = distribution(wanted.name)
        except PackageNotFoundError:
            continue
        if there.name not in found:
            found[there.name] = there.version
            waiting += there.requires or []
    return found


def link_into(site: Path, names: dict[str, str]) -> None:
    """Let `site` have the top level of each distribution, as an installation of it alone would."""
    for name in names:
        there = distribution(name)
        tops = {file.parts[0] for file in there.files or () if file.parts[0] not in ("..", "__pycache__")}
        for top in tops:
            if not (site / top).exists():
                (site / top).symlink_to(Path(str(there.locate_file(top))).resolve())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    (folder / "source").mkdir()
    for part in PARTS:
        copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy
        copy(ROOT / part, folder / "source" / part)
    code = "from setuptools import build_meta as b; b.build_wheel('..')"
    subprocess.run([sys.executable, "-c", code], cwd=folder / "source", check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def stranger(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Stranger:
    folder = tmp_path_factory.mktemp("stranger")
    (folder / "home").mkdir()
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "environment"], check=True)
    python = folder / "environment" / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", str(wheel)], check=True)
    site = next((folder / "environment" / "lib").glob("python*/site-packages"))
    (metadata,) = site.glob("slow_sensor_replication-*.dist-info/METADATA")
    required = re.findall(r"^Requires-Dist: (.+)$", metadata.read_text(encoding="utf-8"), re.MULTILINE)
    link_into(site, needed(required))
    return Stranger(folder / "home", folder / "environment")


def test_what_an_extra_installs_is_not_there(stranger: Stranger) -> None:
    code = f"import importlib.util as u; print([name for name in {list(EXTRAS)} if u.find_spec(name)])"
    assert stranger.run("python", "-c", code).stdout.strip() == "[]"
    assert "No module named 'papers'" in stranger.run("python", "-c", "import papers").stderr


def test_outside_of_a_project_it_says_how_to_begin_one(stranger: Stranger) -> None:
    done = stranger.run("replication", "run")
    assert done.returncode == 2
    assert "there is no replication.toml" in done.stderr and "`replication new KEY`" in done.stderr


def test_a_paper_of_another_field(stranger: Stranger) -> None:
    begun = stranger.run("replication", "new", "epidemic")
    assert begun.returncode == 0, begun.stderr
    as_it_is = stranger.run("replication", "run")
    assert as_it_is.returncode == 0, as_it_is.stdout + as_it_is.stderr
    for path in EPIDEMIC.iterdir():
        shutil.copy(path, stranger.home / "papers" / "epidemic" / path.name)
    settings = 'title = "Epidemics, replicated"\nsubject = "the growth of epidemics"\nauthors = ["B. Reader"]\n'
    (stranger.home / "replication.toml").write_text(settings, encoding="utf-8")
    done = stranger.run("replication", "run")
    assert done.returncode == 0, done.stdout + done.stderr
    results = json.loads((stranger.home / "report" / "results.json").read_bytes())
    verdicts = {record["claim"]["id"]: record["judgement"]["verdict"] for record in results["claims"]}
    assert verdicts == {
        "epidemic.growth": "reproduced",
        "epidemic.doubling": "reproduced",
        "epidemic.final": "reproduced after erratum",
    }
    assert not set(EXTRAS) & set(results["run"]["packages"]) and "numpy" in results["run"]["packages"]
    page = (stranger.home / "report" / "index.html").read_text(encoding="utf-8")
    for words in ("the growth of epidemics", "Epidemics, replicated", "B. Reader"):
        assert words in page
    for words in ("state estimation", "slow-sensor-replication developers", "irregular"):
        assert words not in page
    assert (stranger.home / "figures" / "epidemic-course.svg").is_file()
    for command in ("check", "coverage", "list"):
        done = stranger.run("replication", command)
        assert done.returncode == 0, done.stdout + done.stderr


def test_its_results_stand_in_a_register(stranger: Stranger) -> None:
    done = stranger.run("replication", "register", "report", "--to", "out/register.html")
    assert done.returncode == 0, done.stdout + done.stderr
    page = (stranger.home / "out" / "register.html").read_text(encoding="utf-8")
    assert "Epidemics, replicated" in page and 'href="../report/index.html#' in page


def test_a_wrong_number_changes_verdict_and_exit_code(stranger: Stranger) -> None:
    printed = stranger.home / "papers" / "epidemic" / "printed.toml"
    text = printed.read_text(encoding="utf-8")
    printed.write_text(text.replace('"1.85"', '"1.58"'), encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 1
    printed.write_text(text, encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 0


@pytest.mark.parametrize("print_", ["1,85", "1.85(2)", "1.85 ± 0.02", "185 %"])
def test_a_print_as_other_fields_write_it(stranger: Stranger, print_: str) -> None:
    printed = stranger.home / "papers" / "epidemic" / "printed.toml"
    text = printed.read_text(encoding="utf-8")
    printed.write_text(text.replace('"1.85"', f'"{print_}"'), encoding="utf-8")
    done = stranger.run("replication", "run")
    printed.write_text(text, encoding="utf-8")
    if print_ == "185 %":  # which is computed in per cent, and here it is not
        assert done.returncode == 1
        assert "epidemic.doubling: the computed number is 10^-2 times the print; another unit" in done.stdout
    else:
        assert done.returncode == 0, done.stdout + done.stderr


def test_reasons_ask_for_no_certificate_and_a_theorem_is_verified_without_its_extra(stranger: Stranger) -> None:
    names = ["growth", "doubling", "final"]
    entry = {"claims": [f"epidemic.{name}" for name in names], "reason": "Computed in floating point."}
    listed = stranger.home / "papers" / "epidemic" / "theorems.json"
    listed.write_text(json.dumps([entry]), encoding="utf-8")
    assert stranger.run("replication", "run").returncode == 0
    done = stranger.run("replication", "verify")
    listed.unlink()
    assert (done.returncode, done.stdout, done.stderr) == (1, "0 of 0 certificates proved\n", "")
    certificate = stranger.home / "stable.json"
    certificate.write_text(json.dumps(STABLE), encoding="utf-8")
    proved = stranger.run("replication", "verify", "stable.json")
    assert proved.returncode == 0 and proved.stdout.startswith("proved stable.json: own plant: ")
    radius = {"radius": "511/1024"}  # below what it is
    certificate.write_text(json.dumps({**STABLE, "witness": radius}), encoding="utf-8")
    refused = stranger.run("replication", "verify", "stable.json")
    certificate.unlink()
    assert refused.returncode == 1 and refused.stdout.startswith("NOT PROVED stable.json: ")


def test_what_needs_an_extra_says_which(stranger: Stranger) -> None:
    experiments = stranger.home / "papers" / "epidemic" / "experiments.py"
    text = experiments.read_text(encoding="utf-8")
    experiments.write_text("import scipy\n" + text, encoding="utf-8")
    done = stranger.run("replication", "run")
    experiments.write_text(text, encoding="utf-8")
    assert done.returncode == 2
    assert 'pip install "slow-sensor-replication[estimation]"' in done.stderr
    assert "[papers/epidemic/experiments.py:1]" in done.stderr
