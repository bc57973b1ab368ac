"""C forms of observers, compiled without a warning and with traps at undefined behaviour, to be called from Python."""

import ctypes
import math
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FLAGS = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fPIC"]
LEVELS = ("-O0", "-O3", "-Os")
"""Compilers see more at each, and warn of more; at -O1 the library is compiled, where a warning is an error too."""
COMPILERS = ("gcc", "clang", "cc")
SANITIZER = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
"""Stops the process at undefined behaviour, such as an index beyond an array."""
STEPS = 1_000
EXACT = 1e-12


LIBRARIES: dict[str, ctypes.CDLL] = {}
"""By source: each is compiled once, and keeps nothing between its calls."""


def library_of(observer: Any, folder: Path, more: str = "") -> ctypes.CDLL:
    """The library of an observer that is named `own` there; more: source that it calls."""
    text = observer.to_c("own", "An observer */ of the tests.") + more
    if text in LIBRARIES:
        return LIBRARIES[text]
    if shutil.which("cc") is None and not os.environ.get("CI"):
        pytest.skip("no C compiler: apt-get install gcc libc6-dev")
    source, library = folder / "observer.c", folder / "observer.so"
    source.write_text(text, encoding="utf-8")
    command = ["cc", "-O1", *FLAGS, *SANITIZER, "-shared", source, "-o", library, "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    return LIBRARIES.setdefault(text, ctypes.CDLL(str(library)))


def warnings_of(source: str, folder: Path) -> list[str]:
    """What each compiler that there is says of a file, at every level; one that has two names says it once."""
    there = sorted({os.path.realpath(found) for name in COMPILERS if (found := shutil.which(name))})
    if not there and not os.environ.get("CI"):
        pytest.skip("no C compiler: apt-get install gcc libc6-dev")
    path, said = folder / "observer.c", []
    path.write_text(source, encoding="utf-8")
    for compiler in there:
        for level in LEVELS:
            command = [compiler, level, *FLAGS, "-c", str(path), "-o", str(folder / "observer.o")]
            done = subprocess.run(command, capture_output=True, text=True)
            said += [f"{compiler} {level}: {done.stderr}"] if done.returncode else []
    return said


def doubles(values: Any) -> Any:
    """An array of C."""
    return (ctypes.c_double * len(values))(*values)


class Compiled:
    """The C form, called with the arguments of `reset` and `step`."""

    def __init__(self, observer: Any, folder: Path) -> None:
        self.library = library_of(observer, folder)
        self.state = (ctypes.c_double * 4096)()  # more than the struct of any observer here
        self.estimates = len(observer.estimate)

    @property
    def memory(self) -> bytes:
        """All that it remembers."""
        return bytes(self.state)

    def reset(self, start: Any) -> None:
        self.library.own_init(self.state, doubles(start))

    def step(self, u: Any, y: Any) -> tuple[int, np.ndarray[Any, Any]]:
        estimate = (ctypes.c_double * self.estimates)(*[math.nan] * self.estimates)
        answer = self.library.own_step(self.state, doubles(u), doubles(y), estimate)
        return answer, np.array(estimate)


class CompiledWithStamps:
    """The C form of an estimator of three states with time stamps, called with the arguments of `reset` and `step`."""

    def __init__(self, observer: Any, folder: Path, more: str = "") -> None:
        self.library = library_of(observer, folder, more)
        self.state = (ctypes.c_double * 512)()

    def reset(self, start: Any = None) -> None:
        self.library.own_init(self.state, None if start is None else doubles(start))

    def step(self, y: Any, t: float, u: Any = None) -> tuple[int, np.ndarray[Any, Any]]:
        estimate = doubles([math.nan] * 3)
        given, sample = (None if value is None else doubles(value) for value in (u, y))
        return self.library.own_step(self.state, ctypes.c_double(t), given, sample, estimate), np.array(estimate)

    def predict(self, t: float) -> tuple[int, np.ndarray[Any, Any]]:
        estimate = doubles([math.nan] * 3)
        return self.library.own_predict(self.state, ctypes.c_double(t), estimate), np.array(estimate)
