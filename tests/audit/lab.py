"""A small project in a temporary directory, run in processes of its own: its `papers` never meets the real one."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import papers
import replication
from tests.patience import PATIENCE

TOY = Path(__file__).parent / "toy"
AUDIT = """
import json, sys
from pathlib import Path
import msgspec, papers
from replication.audit.store.cache import Cache
from replication.audit.run.pool import Processes
from replication.audit.run.pool import Plain
from replication.audit.run.runner import run
options = json.loads(sys.argv[1])
root = Path.cwd()
outcome = run(papers.load(options["papers"] or papers.KEYS), cache=Cache(root / ".cache", read=options["read"]),
              root=root, executor=Processes(options["jobs"]), progress=Plain(sys.stderr))
print(json.dumps({"values": outcome.results_by_experiment, "log": {step.name: [step.action, step.reason, step.error]
      for step in outcome.log}, "failures": outcome.failures, "file": msgspec.to_builtins(outcome.results)}))
"""


def hear_interruptions() -> None:
    """For `preexec_fn`: a process begun in the background of a shell ignores Ctrl-C, and so would its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@dataclass(frozen=True)
class Lab:
    """The toy project; `python` runs an interpreter in it, `cli` the command line, `audit` the runner alone."""

    root: Path

    def python(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.root,
            env=self.environment(**environment),
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE,
        )

    def environment(self, **extra: str) -> dict[str, str]:
        path = os.pathsep.join([str(self.root), str(Path(replication.__file__).parents[1])])
        return {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "SOURCE_DATE_EPOCH": "0", **extra}

    def cli(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return self.python("-m", "replication", *arguments, **environment)

    def audit(self, *keys: str, jobs: int = 1, read: bool = True, **environment: str) -> dict[str, Any]:
        options = json.dumps({"papers": keys, "jobs": jobs, "read": read})
        done = self.python("-c", AUDIT, options, **environment)
        assert done.returncode == 0, done.stderr
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer

    def path(self, name: str) -> Path:
        return self.root / "papers" / name

    def edit(self, name: str, old: str, new: str) -> None:
        text = self.path(name).read_text(encoding="utf-8")
        assert old in text
        self.path(name).write_text(text.replace(old, new), encoding="utf-8")


def make_lab(root: Path) -> Lab:
    """Copy the toy project to `root`; the module that finds papers is the real one."""
    shutil.copytree(TOY, root, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(Path(papers.__file__), root / "papers" / "__init__.py")
    (root / "replication.toml").write_text('title = "Toy"\n', encoding="utf-8")
    lock = "".join(f"{name}=={version(name)}\n" for name in ("numpy", "msgspec"))
    (root / "requirements.lock").write_text(lock, encoding="utf-8")
    (root / "pyproject.toml").write_text('[project]\nname = "toy"\ndependencies = ["numpy>=2"]\n', encoding="utf-8")
    return Lab(root)
