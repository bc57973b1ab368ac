"""The archive of the whole project, unpacked where there is nothing but Python and make, builds itself again.

Only `make rebuild` does so: the packages are installed from the lock, by the network. `make test` does the same with a
small project and the packages that are there (tests/audit/test_exports.py).
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.patience import PATIENCE

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ("sh", "make", "awk", "cp", "find", "mkdir", "rm", "test", "touch", "true", "uname")
"""Beside Python all that there is: make, and what POSIX promises to its recipes. No git, compiler, browser or Java."""
NEW_EACH_TIME = ("report/", "exports/", "SHA256SUMS", "ro-crate-metadata.json")
"""What holds times, dates and all digits of the run; its verdicts are compared by themselves."""


def bare(folder: Path, home: Path) -> dict[str, str]:
    """The environment of a machine with `TOOLS` and Python; that pip is told where packages are stays."""
    folder.mkdir()
    home.mkdir()
    for name in TOOLS:
        (folder / name).symlink_to(shutil.which(name) or name)
    (folder / "python3").symlink_to(Path(sys.executable).resolve())
    kept = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_"))}
    return {"PATH": str(folder), "HOME": str(home), "LANG": "C.UTF-8", **kept}


def done(words: list[str], folder: Path, environment: Mapping[str, str] | None = None) -> str:
    ran = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert ran.returncode == 0, f"{words}: {ran.stderr[-3000:]}{ran.stdout[-1000:]}"
    return ran.stdout


def sums(archive: Path) -> dict[str, str]:
    """The checksum of each file of an archive that is the same in every run."""
    with zipfile.ZipFile(archive) as file:
        named = {name.partition("/")[2]: file.read(name) for name in file.namelist()}
    return {
        name: hashlib.sha256(data).hexdigest() for name, data in named.items() if not name.startswith(NEW_EACH_TIME)
    }


def verdicts(root: Path) -> dict[str, str]:
    """What the results say of each claim; their last digits may differ from one run to the next."""
    told = json.loads((root / "report" / "results.json").read_text(encoding="utf-8"))["claims"]
    return {one["claim"]["id"]: one["judgement"]["verdict"] for one in told}


def test_a_machine_with_python_and_make_alone_has_no_more(tmp_path: Path) -> None:
    environment = bare(tmp_path / "tools", tmp_path / "home")
    assert "Python 3" in done(["python3", "--version"], tmp_path, environment)
    for absent in ("git", "cc", "chromium", "java", "coqc"):
        assert shutil.which(absent, path=environment["PATH"]) is None


def test_a_source_that_is_not_the_same_is_seen(tmp_path: Path) -> None:
    for name, text in (("one", "same"), ("two", "same"), ("three", "other")):
        with zipfile.ZipFile(tmp_path / f"{name}.zip", "w") as archive:
            archive.writestr(f"{name}/papers/a.toml", text)
            archive.writestr(f"{name}/report/index.html", name)
    one, two, three = (sums(tmp_path / f"{name}.zip") for name in ("one", "two", "three"))
    assert one == two != three


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("REBUILD") != "all", reason="installs everything anew; `make rebuild` asks for it")
def test_the_archive_builds_itself_with_python_and_make_alone(tmp_path: Path) -> None:
    first = tmp_path / "first"
    done(["git", "clone", "--quiet", str(ROOT), str(first)], tmp_path)
    done([sys.executable, "-m", "replication", "run"], first)
    done([sys.executable, "-m", "replication", "artifact", "--to", "../one.zip"], first)
    with zipfile.ZipFile(tmp_path / "one.zip") as archive:
        archive.extractall(tmp_path)
    unpacked = tmp_path / "one"
    environment = bare(tmp_path / "tools", tmp_path / "home")
    done(["make", "artifact"], unpacked, environment)
    again = sorted((unpacked / "dist").glob("*.zip"))
    assert len(again) == 1
    assert sums(again[0]) == sums(tmp_path / "one.zip")
    assert verdicts(unpacked) == verdicts(first)
