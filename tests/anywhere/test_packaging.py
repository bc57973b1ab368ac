"""Set-up and the built packages: the lock, what they hold, that they run elsewhere, what they say of themselves."""

import json
import re
import shutil
import subprocess
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import papers
import replication
from replication.audit.project import read_settings
from replication.audit.publish.linked_data import read_software
from replication.extras import EXTRAS, declared, part
from tests.anywhere.conftest import Stranger, environment

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
PROJECT = tomllib.loads(TEXT)["project"]
PYTHONS = ("3.11", "3.12", "3.13")
DECLARED = [*PROJECT["dependencies"], *(text for extra in PROJECT["optional-dependencies"].values() for text in extra)]
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
PIN = r"^([a-z0-9._-]+)==([^\s;\\]+)"
PINS = dict(re.findall(PIN, LOCK, re.MULTILINE))


@pytest.mark.slow
def test_the_wheel_holds_the_packages_and_their_data_and_nothing_else(built: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(built[0]) as wheel:
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
def test_the_source_distribution_holds_what_make_needs(built: tuple[Path, Path]) -> None:
    with tarfile.open(built[1]) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    tops = ("Makefile", "requirements.lock", ".zenodo.json", "CITATION.cff", "verify.py", "replication.toml", ".ci/run")
    parts = ("tests/*.py", "papers/*.toml", "replication/*.j2", "certificates/*.json", "docs/*.md", "figures/*.svg")
    for folder, _, pattern in (named.partition("/") for named in parts):
        found = [path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob(pattern)]
        assert found and {*tops, *found} <= names


@pytest.mark.slow
def test_a_clean_environment_runs_the_installed_wheel(built: tuple[Path, Path], tmp_path: Path) -> None:
    """The dependencies are those of this environment, the package itself is from the wheel alone."""
    home, plant = tmp_path / "home", str(ROOT / "docs" / "examples" / "cart.toml")
    home.mkdir()
    clean = Stranger(home, environment(tmp_path / "clean", built[0], "estimation"))

    def files() -> list[Path]:
        return [
            path
            for path in sorted(clean.environment.rglob("*"))
            if path.suffix != ".pyc" and path.name != "__pycache__"
        ]

    before = files()
    done = clean.run("replication", "design", "multirate", plant, "--periods", "1,4")
    assert "guaranteed level" in done.stdout, done.stderr
    assert (home / "cart-multirate" / "index.html").is_file()
    asked = ("run", "list", "check", "certify", "verify", "notebooks", "artifact")
    code = f"from replication.cli import main\nfor word in {asked}: print(main([word]))"
    done = clean.run("python", "-c", code)
    assert done.stderr.count(f"there is no replication.toml in {home} or above it") == len(asked)
    assert done.stdout == "2\n" * len(asked) and files() == before


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
    assert headings[:2] == ["Unreleased", PROJECT["version"]] == ["Unreleased", replication.__version__]


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


# What is set up, and by what


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", *arguments], cwd=folder, capture_output=True, text=True, check=False)


def test_lock_has_what_is_declared_with_its_hash_and_it_is_installed() -> None:
    for requirement in map(Requirement, DECLARED):
        name = requirement.name.lower()
        assert requirement.specifier.contains(PINS.get(name, "none")), f"{name}: run `make lock`"
        assert version(name) == PINS[name], f"{name}: run `make lint`, which installs what the lock asks for"
    blocks = re.split(r"^(?=[a-z0-9._-]+==)", LOCK, flags=re.MULTILINE)[1:]
    assert len(blocks) >= len(PINS) > 0
    assert [block.split()[0] for block in blocks if "--hash=sha256:" not in block] == []


TOY = """\
a==1.0 ; sys_platform == 'linux' \\
    --hash=sha256:aa
    # via slow (pyproject.toml)
b==2.0 \\
    --hash=sha256:bb
    # via
    #   a
    #   c
c==3.0 \\
    --hash=sha256:cc
    # via b
d==4.0 \\
    --hash=sha256:dd
    # via slow (pyproject.toml)
"""


def test_a_part_of_the_lock_has_what_is_wanted_at_any_depth_and_no_more() -> None:
    assert re.findall(r"^\w", part(TOY, ["A>=1"]), re.MULTILINE) == ["a", "b", "c"]
    assert part(TOY, ["d"]) == TOY[TOY.index("d==") :]
    with pytest.raises(KeyError, match="e-missing"):
        part(TOY, ["e_missing"])


def test_the_report_installs_a_third_of_the_packages() -> None:
    report = set(re.findall(PIN, part(LOCK, declared(TEXT, ["estimation", "proofs"])), re.MULTILINE))
    assert {("control", PINS["control"]), ("pyparsing", PINS["pyparsing"])} <= report
    assert not {"selenium", "mkdocs", "nbconvert", "mypy"} & {name for name, _ in report}
    assert len(report) <= 45
    whole = re.findall(PIN, part(LOCK, declared(TEXT, PROJECT["optional-dependencies"])), re.MULTILINE)
    assert set(whole) == set(PINS.items())


def test_what_is_locked_is_installed_whatever_else_an_index_has() -> None:
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8")
    installs = [line for line in recipe.splitlines() if "$(PIP) install" in line]
    # Without --no-deps pip 23.2 takes `coverage[toml]` of a later release for a package that the lock does not pin.
    assert len(installs) == 2 and all(" --no-deps " in line for line in installs)


def test_help_lists_every_target() -> None:
    declared = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert declared is not None
    done = make(ROOT, "help")
    assert done.returncode == 0
    listed = re.findall(r"^  make (\S+)", done.stdout, re.MULTILINE)
    assert sorted(listed) == sorted(declared[1].split())


def test_too_old_a_python_is_named_before_anything_is_installed(tmp_path: Path) -> None:
    (tmp_path / "replication").mkdir()
    for name in ("Makefile", "requirements.lock", "pyproject.toml", "replication/extras.py"):
        shutil.copy(ROOT / name, tmp_path / name)
    old = tmp_path / "python2.7"
    old.write_text('#!/bin/sh\n[ "$1" = --version ] && echo "Python 2.7.18" && exit 0\nexit 1\n', encoding="utf-8")
    old.chmod(0o755)
    done = make(tmp_path, f"PYTHON={old}")
    assert done.returncode != 0
    assert f"Python 3.11 or later is needed, {old} is Python 2.7.18; try: make PYTHON=python3.12" in done.stderr
    assert not (tmp_path / ".venv").exists()


def test_ci_script_is_sound() -> None:
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    assert script.read_text(encoding="utf-8").rstrip().endswith("make test")
    assert subprocess.run(["bash", "-n", str(script)], check=False).returncode == 0
