"""Wheel and source distribution, and strangers: a folder, an environment that has the wheel, what it needs, no more."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.patience import PATIENCE

ROOT = Path(__file__).parents[2]
PARTS = ("papers", "replication", "tests", "docs", "certificates", "benchmarks", "figures", ".ci")
NOT_COPIED = shutil.ignore_patterns("__pycache__", "results.json", "index.html")


@dataclass(frozen=True)
class Stranger:
    """A folder, and an environment in which only the wheel and its dependencies are installed."""

    home: Path
    environment: Path

    def run(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        words = [str(self.environment / "bin" / program), *arguments]
        return subprocess.run(words, cwd=self.home, capture_output=True, text=True, timeout=PATIENCE, check=False)


def bare(folder: Path, *tools: str) -> dict[str, str]:
    """The environment of a machine with Python and these tools; that pip is told where packages are stays."""
    (folder / "bin").mkdir(parents=True)
    for name in tools:
        (folder / "bin" / name).symlink_to(shutil.which(name) or name)
    (folder / "bin" / "python3").symlink_to(Path(sys.executable).resolve())
    kept = {name: value for name, value in os.environ.items() if name.startswith(("PIP_", "SSL_"))}
    return {"PATH": str(folder / "bin"), "HOME": str(folder), "LANG": "C.UTF-8", **kept}


def verdicts(root: Path) -> dict[str, str]:
    """What the results say of each claim; their last digits may differ from one run to the next."""
    told = json.loads((root / "report" / "results.json").read_bytes())["claims"]
    return {one["claim"]["id"]: one["judgement"]["verdict"] for one in told}


def needed(requirements: list[str], extra: str = "") -> dict[str, str]:
    """The installed distributions that these need, and those need, by name with version."""
    found: dict[str, str] = {}
    waiting = list(requirements)
    while waiting:
        wanted = Requirement(waiting.pop())
        if wanted.marker is not None and not wanted.marker.evaluate({"extra": extra}):
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


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The two files, made from a copy of the sources."""
    folder = tmp_path_factory.mktemp("built")
    source = folder / "source"
    source.mkdir()
    for name in PARTS:
        shutil.copytree(ROOT / name, source / name, ignore=NOT_COPIED)
    for path in ROOT.iterdir():
        if path.is_file() and path.name != ".git":
            shutil.copy(path, source)
    code = "from setuptools import build_meta as b; b.build_wheel('..'); b.build_sdist('..')"
    subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


@pytest.fixture(scope="module")
def stranger(built: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Stranger:
    folder = tmp_path_factory.mktemp("stranger")
    (folder / "home").mkdir()
    return Stranger(folder / "home", environment(folder / "environment", built[0]))


def environment(place: Path, wheel: Path, extra: str = "") -> Path:
    """An environment at `place` with this wheel, and with what it and an extra need as it is installed here."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    python = place / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", str(wheel)], check=True)
    site = next((place / "lib").glob("python*/site-packages"))
    (metadata,) = site.glob("slow_sensor_replication-*.dist-info/METADATA")
    required = re.findall(r"^Requires-Dist: (.+)$", metadata.read_text(encoding="utf-8"), re.MULTILINE)
    link_into(site, needed(required, extra))
    return place
