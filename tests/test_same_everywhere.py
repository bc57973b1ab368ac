"""The suite is the same on every machine and run: the tests are read here for what could make it another."""

import ast
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

HERE = Path(__file__).parent
MAY_WAIT = {"patience.py", "verify/mutants.py"}
"""Where a test waits for another process, with a limit that only a hang reaches."""
MAY_CHOOSE_KERNELS = {"papers/test_processors.py", "test_same_everywhere.py"}
"""Asks the processor first."""
CLOCKS = {"time", "time_ns", "monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "process_time"}
CLOCKS |= {"process_time_ns", "thread_time", "now", "today", "utcnow", "sleep", "default_timer", "times", "getrusage"}
UNSEEDED = {"default_rng", "Random", "RandomState", "Generator"}
KERNELS = ("OPENBLAS_CORETYPE", "MKL_ENABLE_INSTRUCTIONS", "NPY_DISABLE_CPU_FEATURES")
CLOCK_MODULES, DRAWING_MODULES = {"time", "timeit", "datetime", "os", "resource"}, {"random", "secrets", "uuid"}
TOLD = {
    "import time\nassert time.perf_counter() < 3": "a clock",
    "from time import process_time as p\nassert p() < 3": "a clock",
    "import datetime as d\nd.datetime.now()": "a clock",
    "import os\nassert sum(os.times()) < 3": "a clock",
    "import subprocess\nsubprocess.run([], timeout=20)": "a limit in seconds",
    "rng = np.random.default_rng()": "a draw without a seed",
    "rng = np.random.default_rng(None)": "a draw without a seed",
    "x = np.random.normal()": "a draw without a seed",
    "import random\nx = random.random()": "a draw without a seed",
    "import random\nx = random.Random()": "a draw without a seed",
    "from random import random": "a draw without a seed",
    "import uuid\nuuid.uuid4()": "a draw without a seed",
    "import os\nos.urandom(3)": "a draw without a seed",
    "@settings(derandomize=False)\ndef f(): ...": "a draw without a seed",
    "@settings(deadline=200)\ndef f(): ...": "a clock",
    'env = {"OPENBLAS_CORETYPE": "Zen"}': "a kernel of one processor",
}
FINE = (
    "import random\nrng = random.Random(3)",
    "rng = np.random.default_rng(seed)",
    "rng = np.random.default_rng([3, 4])\nx = rng.normal()",
    "subprocess.run([], timeout=PATIENCE)",
    "ran = subprocess.run([], timeout=2 * PATIENCE)",
    "from time import struct_time",
    "@settings(max_examples=3)\ndef f(): ...",
)


def faults(text: str) -> Iterator[str]:
    """What in a test's source depends on the clock, on a draw or on the processor."""
    names: dict[str, str] = {}  # what stands for a module, or for a function of one
    nodes = list(ast.walk(ast.parse(text)))
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {(name.asname or name.name).partition(".")[0]: name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {name.asname or name.name: f"{node.module}.{name.name}" for name in node.names}
            if node.module in DRAWING_MODULES and not {name.name for name in node.names} <= {"Random"}:
                yield f"line {node.lineno}: a draw without a seed"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in KERNELS:
            yield f"line {node.lineno}: a kernel of one processor"
    for node in nodes:
        if isinstance(node, ast.Call):
            for fault in _of_a_call(node, names):
                yield f"line {node.lineno}: {fault}"


def _of_a_call(node: ast.Call, names: dict[str, str]) -> Iterator[str]:
    path = ast.unparse(node.func)
    head, _, rest = path.partition(".")
    path = names.get(head, head) + ("." + rest if rest else "")
    module, last = path.partition(".")[0], path.rpartition(".")[2]
    seed = node.args[0] if node.args else next((k.value for k in node.keywords if k.arg == "seed"), None)
    given = {word.arg: word.value for word in node.keywords}
    if module in CLOCK_MODULES and last in CLOCKS:
        yield "a clock"
    unseeded = seed is None or (isinstance(seed, ast.Constant) and seed.value is None)
    if last in UNSEEDED:
        if unseeded:
            yield "a draw without a seed"
    elif module in DRAWING_MODULES or path in ("os.urandom", f"np.random.{last}", f"numpy.random.{last}"):
        yield "a draw without a seed"
    if "timeout" in given and "PATIENCE" not in ast.unparse(given["timeout"]):
        yield "a limit in seconds"
    if last == "settings":
        if "derandomize" in given:
            yield "a draw without a seed"
        if "deadline" in given:
            yield "a clock"


@pytest.mark.parametrize(("text", "fault"), [*TOLD.items(), *((text, "") for text in FINE)])
def test_what_makes_a_test_another_one_elsewhere_is_told_and_nothing_else(text: str, fault: str) -> None:
    found = list(faults(text))
    assert bool(found) is bool(fault) and all(fault in told for told in found)


def test_no_test_depends_on_clock_processor_or_luck() -> None:
    found = []
    for path in sorted(HERE.rglob("*.py")):
        name = path.relative_to(HERE).as_posix()
        if name in MAY_WAIT or "toy" in path.parts:
            continue
        allowed = "a kernel of one processor" if name in MAY_CHOOSE_KERNELS else None
        found += [f"{name}, {fault}" for fault in faults(path.read_text()) if fault.partition(": ")[2] != allowed]
    assert found == []
    assert hypothesis.settings().derandomize and hypothesis.settings().database is None
    assert hypothesis.settings().deadline is None
