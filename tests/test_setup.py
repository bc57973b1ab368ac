import re
import shutil
import subprocess
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import replication
from replication.locked import declared, part

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = [text for extra in PROJECT["optional-dependencies"].values() for text in extra]
DECLARED = [Requirement(text) for text in (*PROJECT["dependencies"], *EXTRAS)]
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
PIN = r"^([a-z0-9._-]+)==([^\s;\\]+)"
PINS = dict(re.findall(PIN, LOCK, re.MULTILINE))


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", *arguments], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("requirement", DECLARED, ids=str)
def test_lock_has_what_is_declared_and_it_is_installed(requirement: Requirement) -> None:
    name = requirement.name.lower()
    assert name in PINS, "run `make lock`"
    assert requirement.specifier.contains(PINS[name]), "run `make lock`"
    assert version(name) == PINS[name], "run `make lint`, which installs what the lock asks for"


def test_every_pin_has_its_hash() -> None:
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
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    report = set(re.findall(PIN, part(LOCK, declared(project, ["estimation", "proofs"])), re.MULTILINE))
    assert {("control", PINS["control"]), ("pyparsing", PINS["pyparsing"])} <= report
    assert not {"selenium", "mkdocs", "nbconvert", "mypy"} & {name for name, _ in report}
    assert len(report) <= 45
    whole = re.findall(PIN, part(LOCK, declared(project, PROJECT["optional-dependencies"])), re.MULTILINE)
    assert set(whole) == set(PINS.items())


def test_what_is_locked_is_installed_whatever_else_an_index_has() -> None:
    recipe = (ROOT / "Makefile").read_text(encoding="utf-8")
    installs = [line for line in recipe.splitlines() if "$(PIP) install" in line]
    # Without --no-deps pip 23.2 takes `coverage[toml]` of a later release for a package that the lock does not pin.
    assert len(installs) == 2 and all(" --no-deps " in line for line in installs)


def test_version_is_the_same_everywhere() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert replication.__version__ == PROJECT["version"]
    assert f"\nversion: {PROJECT['version']}\n" in citation


def test_help_lists_every_target() -> None:
    declared = re.search(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert declared is not None
    done = make(ROOT, "help")
    assert done.returncode == 0
    listed = re.findall(r"^  make (\S+)", done.stdout, re.MULTILINE)
    assert sorted(listed) == sorted(declared[1].split())


def test_too_old_a_python_is_named_before_anything_is_installed(tmp_path: Path) -> None:
    (tmp_path / "replication").mkdir()
    for name in ("Makefile", "requirements.lock", "pyproject.toml", "replication/locked.py"):
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
