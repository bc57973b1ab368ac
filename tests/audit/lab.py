"""A small project in a temporary directory, run in processes of its own: its `papers` never meets the real one."""

import contextlib
import importlib
import io
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar
from unittest.mock import patch

import msgspec

import papers
import replication
from replication.audit.project import find_project
from replication.audit.run.runner import Outcome, run
from replication.audit.run.worker import Answer, Task, compute
from replication.audit.store.cache import Cache
from replication.cli import main
from tests.patience import PATIENCE

TOY = Path(__file__).parent / "toy"
AUDIT = """
import json, sys
from pathlib import Path
from lab import told
from replication.audit.project import find_project
from replication.audit.store.cache import Cache
from replication.audit.run.worker import processes
from functools import partial
from replication.audit.run.runner import run
options = json.loads(sys.argv[1])
root = Path.cwd()
outcome = run(find_project(root).load(options["papers"]), cache=Cache(root / ".cache", read=options["read"]),
              root=root, executor=partial(processes, jobs=options["jobs"]),
              progress=lambda line: print(line, file=sys.stderr))
print(json.dumps(told(outcome)))
"""


def told(outcome: Outcome) -> dict[str, Any]:
    log = {step.name: [step.action, step.reason, step.error] for step in outcome.log}
    file = msgspec.to_builtins(outcome.results)
    return {"values": outcome.results_by_experiment, "log": log, "failures": outcome.failures, "file": file}


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
        path = os.pathsep.join([str(self.root), str(Path(replication.__file__).parents[1]), str(TOY.parent)])
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


LabT = TypeVar("LabT", bound=Lab)


@dataclass(frozen=True)
class Inside(Lab):
    """The same in this process, which costs no imports; its papers have a package of their own, not in what it says.

    Not for what processes do: their end, their environment when Python starts, interruptions.
    """

    package: str

    @contextlib.contextmanager
    def _inside(self, environment: dict[str, str]) -> Iterator[None]:
        for name in [name for name in sys.modules if name.partition(".")[0] == self.package]:
            del sys.modules[name]
        importlib.invalidate_caches()
        with (
            contextlib.chdir(self.root),
            patch.dict(os.environ, {"SOURCE_DATE_EPOCH": "0", **environment}),
            patch.object(sys, "dont_write_bytecode", True),
            patch.object(sys, "path", list(sys.path)),
        ):
            yield

    def _said(self, text: str) -> str:
        return re.sub(rf"\b{self.package}\b", "papers", text)

    def cli(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        told, failed = io.StringIO(), io.StringIO()
        with (
            self._inside(environment),
            contextlib.redirect_stdout(told),
            contextlib.redirect_stderr(failed),
            patch("replication.commands.run._executor", lambda chosen: computed_here),
        ):
            try:
                code = main(arguments)
            except SystemExit as error:
                code = int(error.code or 0)
        return subprocess.CompletedProcess(arguments, code, self._said(told.getvalue()), self._said(failed.getvalue()))

    def audit(self, *keys: str, jobs: int = 1, read: bool = True, **environment: str) -> dict[str, Any]:
        with self._inside(environment):
            cache = Cache(self.root / ".cache", read=read)
            outcome = run(find_project(self.root).load(keys), cache=cache, root=self.root, executor=computed_here)
        answer: dict[str, Any] = json.loads(self._said(json.dumps(told(outcome))))
        return answer

    def path(self, name: str) -> Path:
        return self.root / self.package / name


def computed_here(tasks: Sequence[Task]) -> Iterator[Answer]:
    """By this process."""
    return map(compute, tasks)


def make_inside(root: Path) -> Inside:
    """`make_lab` for this process."""
    lab = make_lab(root)
    package = f"texts{next(NUMBERS)}"
    lab.root.joinpath("papers").rename(root / package)
    (root / "replication.toml").write_text(f'title = "Toy"\npapers = "{package}"\n', encoding="utf-8")
    for file in (root / package).rglob("*.py"):
        file.write_text(re.sub(r"\bpapers(?=[. ])", package, file.read_text(encoding="utf-8")), encoding="utf-8")
    return Inside(root, package)


def git(root: Path, *words: str) -> str:
    """What git says in this folder, of commits by an author of its own."""
    identity = ("-c", "user.name=Toy", "-c", "user.email=toy@example.org", "-c", "commit.gpgsign=false")
    done = subprocess.run(["git", "-C", str(root), *identity, *words], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def committed(root: Path) -> Path:
    """Put what lies in a folder under git."""
    for words in (("init", "--quiet"), ("add", "."), ("commit", "--quiet", "-m", "start")):
        git(root, *words)
    return root


NUMBERS = itertools.count()


def make_lab(root: Path) -> Lab:
    """Copy the toy project to `root`; the module that finds papers is the real one."""
    shutil.copytree(TOY, root, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(Path(papers.__file__), root / "papers" / "__init__.py")
    (root / "replication.toml").write_text('title = "Toy"\n', encoding="utf-8")
    lock = "".join(f"{name}=={version(name)}\n" for name in ("numpy", "msgspec"))
    (root / "requirements.lock").write_text(lock, encoding="utf-8")
    (root / "pyproject.toml").write_text('[project]\nname = "toy"\ndependencies = ["numpy>=2"]\n', encoding="utf-8")
    return Lab(root)


def emptied(lab: LabT) -> LabT:
    """The project without its papers."""
    shutil.rmtree(lab.path("toy2020"))
    lab.path("other2021.py").unlink()
    return lab
