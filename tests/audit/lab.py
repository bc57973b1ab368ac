"""A small project in a temporary directory, run in processes of its own: its `papers` never meets the real one.

The command line and the runner run in children of this process, which have its packages and import the project anew.
"""

from __future__ import annotations

import atexit
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import papers
import replication
from tests.patience import PATIENCE

TOY = Path(__file__).parent / "toy"
OWN = ("papers", "replication", "tests")
"""Packages that a child imports anew."""
HEAVY = (
    "jinja2", "joblib.externals.loky", "latex2mathml.converter", "matplotlib.backends.backend_svg", "matplotlib.figure",
    "msgspec", "numpy", "rich.progress", "threadpoolctl", "yaml",
)  # fmt: skip
"""Packages that it has from this process."""
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


def _hear_interruptions() -> None:
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

    def begin(self, *arguments: str) -> subprocess.Popen[str]:
        """An interpreter in a session of its own, which hears Ctrl-C also if this one was begun in the background."""
        return subprocess.Popen(
            [sys.executable, *arguments],
            cwd=self.root,
            env=self.environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=_hear_interruptions,
        )

    def environment(self, **extra: str) -> dict[str, str]:
        path = os.pathsep.join([str(self.root), str(Path(replication.__file__).parents[1])])
        return {**os.environ, "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "SOURCE_DATE_EPOCH": "0", **extra}

    def cli(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        if environment:  # which may be for the interpreter or for packages that it loads
            return self.fresh(*arguments, **environment)
        return self._child(("replication", *arguments), _command_line)

    def fresh(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """The command line in an interpreter of its own, for what it imports, and beside threads of this one."""
        return self.python("-m", "replication", *arguments, **environment)

    def audit(self, *keys: str, jobs: int = 1, read: bool = True, **environment: str) -> dict[str, Any]:
        options = json.dumps({"papers": keys, "jobs": jobs, "read": read})
        done = self.python("-c", AUDIT, options, **environment) if environment else self._child(("", options), _audit)
        assert done.returncode == 0, done.stderr
        answer: dict[str, Any] = json.loads(done.stdout)
        return answer

    def _child(self, words: Sequence[str], work: Callable[[], int]) -> subprocess.CompletedProcess[str]:
        """What a child of this process prints and returns, as an interpreter with these words in `sys.argv` would."""
        for name in HEAVY:
            importlib.import_module(name)
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            child = os.fork()
            if child == 0:
                self._be(words, work, (out.fileno(), err.fileno()))
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            out.seek(0)
            err.seek(0)
            return subprocess.CompletedProcess(words, code, out.read(), err.read())

    def _be(self, words: Sequence[str], work: Callable[[], int], streams: tuple[int, int]) -> None:
        """In the child: what an interpreter is at its beginning, then the work, then what it does at its end."""
        code: object = 1
        try:
            atexit._clear()
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.alarm(PATIENCE)
            for number, stream in enumerate(streams, start=1):
                os.dup2(stream, number)
            sys.stdout, sys.stderr, sys.argv = open(1, "w"), open(2, "w"), list(words)  # noqa: SIM115
            _warn_as_usual()
            os.chdir(self.root)
            os.environ.clear()
            os.environ.update(self.environment())
            tests = str(Path(__file__).parents[1])
            sys.path[:] = [str(self.root), *(path for path in sys.path if path and not path.startswith(tests))]
            for name in [name for name in sys.modules if name.partition(".")[0] in OWN]:
                del sys.modules[name]
            code = work()
        except SystemExit as end:
            code = end.code
        except BaseException:  # noqa: BLE001 - as the interpreter does
            traceback.print_exc()
        finally:
            try:
                threading._shutdown()  # type: ignore[attr-defined]
                atexit._run_exitfuncs()
                sys.stdout.flush()
                sys.stderr.flush()
            finally:
                os._exit(code if isinstance(code, int) else int(code is not None))

    def path(self, name: str) -> Path:
        return self.root / "papers" / name

    def edit(self, name: str, old: str, new: str) -> None:
        text = self.path(name).read_text(encoding="utf-8")
        assert old in text
        self.path(name).write_text(text.replace(old, new), encoding="utf-8")


def _command_line() -> int:
    from replication.cli import main

    return main(sys.argv[1:])


def _audit() -> int:
    exec(AUDIT, {"__name__": "__main__"})
    return 0


def _warn_as_usual() -> None:
    """Warnings go where they are seen, whatever pytest does with them."""

    def shown(message: Any, category: Any, filename: str, lineno: int, file: Any = None, line: Any = None) -> None:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno, line))

    warnings.showwarning = shown
    warnings.resetwarnings()
    for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", kind)


def make_lab(root: Path) -> Lab:
    """Copy the toy project to `root`; the module that finds papers is the real one."""
    shutil.copytree(TOY, root, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(Path(papers.__file__), root / "papers" / "__init__.py")
    (root / "replication.toml").write_text('title = "Toy"\n', encoding="utf-8")
    lock = "".join(f"{name}=={version(name)}\n" for name in ("numpy", "msgspec"))
    (root / "requirements.lock").write_text(lock, encoding="utf-8")
    (root / "pyproject.toml").write_text('[project]\nname = "toy"\ndependencies = ["numpy>=2"]\n', encoding="utf-8")
    return Lab(root)
