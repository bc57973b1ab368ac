"""The built packages: what they hold, that they install and run elsewhere, and what they say of themselves."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from dataclasses import dataclass
from email.parser import Parser
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import papers
from replication.audit.project import read_settings
from replication.audit.publish.linked_data import read_software
from replication.extras import EXTRAS

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PARTS = ("papers", "replication", "tests", "docs", "certificates", "benchmarks", "figures", ".ci")
NOT_COPIED = shutil.ignore_patterns("__pycache__", "results.json", "index.html")
PYTHONS = ("3.11", "3.12", "3.13")


@dataclass(frozen=True)
class Built:
    """The two files, and the folder in which they were made."""

    wheel: Path
    sdist: Path
    folder: Path


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    folder = tmp_path_factory.mktemp("built")
    source = folder / "source"
    source.mkdir()
    for part in PARTS:
        shutil.copytree(ROOT / part, source / part, ignore=NOT_COPIED)
    for path in ROOT.iterdir():
        if path.is_file() and path.name != ".git":
            shutil.copy(path, source)
    code = "from setuptools import build_meta as b; b.build_wheel('..'); b.build_sdist('..')"
    subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True)
    return Built(*folder.glob("*.whl"), *folder.glob("*.tar.gz"), folder)


@pytest.mark.slow
def test_the_wheel_holds_the_packages_and_their_data_and_nothing_else(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as wheel:
        names = wheel.namelist()
        metadata = Parser().parsestr(
            wheel.read(next(name for name in names if name.endswith("METADATA"))).decode("utf-8")
        )
    expected = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "replication").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {name for name in names if ".dist-info/" not in name} == expected
    assert {"replication/py.typed", "replication/audit/report/html/template.html.j2"} <= expected
    assert metadata["License-Expression"] == "MIT"
    assert metadata["Requires-Python"] == ">=3.11"
    assert set(PROJECT["optional-dependencies"]) == set(metadata.get_all("Provides-Extra") or ())


@pytest.mark.slow
def test_the_source_distribution_holds_what_make_needs(built: Built) -> None:
    with tarfile.open(built.sdist) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    for name in (
        "Makefile",
        "requirements.lock",
        ".zenodo.json",
        "CITATION.cff",
        "verify.py",
        "replication.toml",
        ".ci/run",
    ):
        assert name in names
    parts = {
        "tests": "*.py",
        "papers": "*.toml",
        "replication": "*.j2",
        "certificates": "*.json",
        "docs": "*.md",
        "figures": "*.svg",
    }
    for folder, pattern in parts.items():
        found = [path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob(pattern)]
        assert found and set(found) <= names


@pytest.mark.slow
def test_a_clean_environment_runs_the_installed_wheel(built: Built) -> None:
    """The dependencies come from this environment, the package itself from the wheel alone."""
    clean, work = built.folder / "clean", built.folder / "work"
    work.mkdir()
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", clean], check=True)
    python = clean / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", str(built.wheel)], check=True)
    site = next((clean / "lib").glob("python*/site-packages"))
    # Without the .pth files of that directory: an editable install of this project stays out.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")

    def run(*arguments: str) -> str:
        done = subprocess.run([clean / "bin" / arguments[0], *arguments[1:]], cwd=work, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert str(site) in run("python", "-c", "import replication; print(replication.__file__)")
    plant = ROOT / "docs" / "examples" / "cart.toml"
    assert "guaranteed level" in run("replication", "design", "multirate", str(plant), "--periods", "1,4")
    assert (work / "cart-multirate" / "index.html").is_file()
    before = sorted(site.rglob("*"))
    asked = ("run", "list", "check", "certify", "verify", "notebooks", "artifact")
    said = run("python", "-c", "from replication.cli import main; import sys; sys.stderr = sys.stdout\n"
               f"for word in {asked}: print(main([word]))")  # fmt: skip
    assert said.count(f"there is no replication.toml in {work} or above it") == said.count("\n2\n") == len(asked)
    assert [path for path in sorted(site.rglob("*")) if path.suffix != ".pyc"] == [
        path for path in before if path.suffix != ".pyc"
    ]


def test_each_extra_for_computing_is_named_with_its_modules() -> None:
    modules = {"python-flint": "flint", "sdpa-python": "sdpap"}
    for extra in set(EXTRAS.values()):
        declared = [Requirement(text).name for text in PROJECT["optional-dependencies"][extra]]
        assert {modules.get(name, name) for name in declared} == {name for name, of in EXTRAS.items() if of == extra}


def test_the_python_versions_are_named() -> None:
    named = {text.rpartition(" :: ")[2] for text in PROJECT["classifiers"] if text.startswith("Programming Language")}
    assert set(PYTHONS) <= named
    assert PROJECT["requires-python"] == f">={PYTHONS[0]}"
    assert PROJECT["license"] == "MIT"


def test_the_changelog_begins_with_this_version() -> None:
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.M)
    assert headings[:2] == ["Unreleased", PROJECT["version"]]


def test_zenodo_says_what_the_citation_says() -> None:
    zenodo, citation = json.loads((ROOT / ".zenodo.json").read_bytes()), read_software(ROOT)
    for name in ("title", "version", "license"):
        assert zenodo[name] == getattr(citation, name)
    assert zenodo["description"] == citation.abstract
    assert tuple(zenodo["keywords"]) == citation.keywords == tuple(PROJECT["keywords"])
    assert [creator["name"] for creator in zenodo["creators"]] == [person.full_name for person in citation.authors]
    assert zenodo["version"] == PROJECT["version"]
    settings = read_settings(ROOT)
    assert list(settings.authors) == [person.full_name for person in citation.authors]
    assert settings.title.partition(":")[0] == citation.title.partition(":")[0] == PROJECT["name"]
    related = {entry["identifier"] for entry in zenodo["related_identifiers"]}
    assert related == {paper.doi for paper in papers.load() if paper.doi}
