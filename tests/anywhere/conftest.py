"""The wheel, built once, and strangers: a folder, and an environment that has the wheel, what it needs, and no more."""

from __future__ import annotations

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
PARTS = ("replication", "papers", "README.md", "LICENSE", "pyproject.toml")


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


@pytest.fixture(scope="session")
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
    return Stranger(folder / "home", environment(folder / "environment", wheel))


def environment(place: Path, wheel: Path) -> Path:
    """An environment at `place` with this wheel, and with what it needs as it is installed here."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    python = place / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", "--no-deps", "--no-index", str(wheel)], check=True)
    site = next((place / "lib").glob("python*/site-packages"))
    (metadata,) = site.glob("slow_sensor_replication-*.dist-info/METADATA")
    required = re.findall(r"^Requires-Dist: (.+)$", metadata.read_text(encoding="utf-8"), re.MULTILINE)
    link_into(site, needed(required))
    return place
