"""What makes a result another one each time: random numbers without a seed, the clock, what other experiments left.

They are noted where Python asks for them; shared generators count as unseeded unless the computation seeds them.
"""

import contextlib
import decimal
import functools
import importlib
import inspect
import multiprocessing.process
import os
import random
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

SEEDLESS, CLOCK = "random numbers without a seed", "the clock"
RANDOM = re.compile(r"/(?:random|secrets)\.py$|/numpy/random/")
"""The modules that make random numbers."""
_CLOCKS = tuple(
    f"{name}{unit}"
    for name in ("time", "perf_counter", "monotonic", "process_time", "thread_time")
    for unit in ("", "_ns")
)

_seeded = False
Told = Callable[[str, FrameType], None]


@functools.cache
def listen(told: Told) -> None:
    """Tell from now on who draws without a seed or asks for the time; for as long as the process lives."""

    def asked(words: str, function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def ask(*arguments: Any) -> Any:
            told(words, sys._getframe(1))
            return function(*arguments)

        return ask

    seed = random.Random.seed

    def seeded(self: random.Random, a: Any = None, version: int = 2) -> None:
        global _seeded
        _seeded = _seeded or self is random._inst
        if a is None:
            told(SEEDLESS, sys._getframe(1))
        seed(self, a, version)

    random.Random.seed = seeded  # type: ignore[method-assign]
    random.seed = random._inst.seed
    # What SystemRandom, secrets and NumPy's generators without a seed draw from.
    random._urandom = asked(SEEDLESS, os.urandom)  # type: ignore[attr-defined]
    os.urandom = random._urandom  # type: ignore[attr-defined]
    for name in _CLOCKS:
        setattr(time, name, asked(CLOCK, getattr(time, name)))


def dates(function: Any, ours: Callable[[str], bool]) -> bool:
    """Whether a function, or one in files of `ours` that it names, asks `datetime` for now: Python tells nobody."""
    waiting, codes = [function], set[CodeType]()
    while waiting:
        subject = inspect.unwrap(waiting.pop())
        code = getattr(subject, "__code__", None)
        if code is None or code in codes or not ours(code.co_filename):
            continue
        codes.add(code)
        names = {name for part in _codes(code) for name in part.co_names}
        if names & {"now", "utcnow", "today"} and names & {"datetime", "date", "Timestamp"}:
            return True
        values = [subject.__globals__[name] for name in names & subject.__globals__.keys()]
        held = [vars(value) for value in values if isinstance(value, type | ModuleType)]
        waiting += [*values, *(inner[name] for inner in held for name in names & inner.keys())]
    return False


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code, and those of the functions and comprehensions inside."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


@contextlib.contextmanager
def shared_generators(told: Callable[[str], None]) -> Iterator[None]:
    """Tell if what runs meanwhile draws from the generators that all modules share, without seeding them."""
    global _seeded
    numpy = importlib.import_module("numpy.random") if "numpy" in sys.modules else None
    seed: Any = numpy.seed if numpy is not None else None

    def seeded(*arguments: Any) -> None:
        global _seeded
        _seeded = True
        seed(*arguments)

    _seeded, before = False, _states(numpy)
    if numpy is not None:
        numpy.seed = seeded  # type: ignore[attr-defined]
    try:
        yield
    finally:
        if numpy is not None:
            numpy.seed = seed  # type: ignore[attr-defined]
        if not _seeded and _states(numpy) != before:
            told(SEEDLESS)


def _states(numpy: Any) -> tuple[Any, ...]:
    shared = numpy.get_state() if numpy is not None else ()
    return (random.getstate(), *(part.tobytes() if hasattr(part, "tobytes") else part for part in shared))


@contextlib.contextmanager
def shared_state(told: Callable[[str], None], ours: Callable[[str], bool]) -> Iterator[None]:
    """Tell of lists, dictionaries, sets, arrays and numbers of modules that change meanwhile, and put them back.

    So are working folder, environment, warnings, settings of decimal, NumPy and mpmath; told are processes begun, too.
    """
    folder, begun = Path.cwd(), _processes()
    kinds = (list, dict, set, int, float, getattr(sys.modules.get("numpy"), "ndarray", list))
    modules = [module for module in list(sys.modules.values()) if ours(getattr(module, "__file__", None) or "")]
    before: list[tuple[ModuleType, str, Any, Any]] = [
        (module, name, value, _copy(value))
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, kinds) and not name.startswith("__")
    ]
    try:
        with decimal.localcontext(), warnings.catch_warnings(), kept_environment(), _settings():
            yield
    finally:
        os.chdir(folder)
        if _processes() != begun:
            told("processes that it begins")
        for module, name, value, old in before:
            if old is None or _same(old, vars(module).get(name)):
                continue
            told(f"changes {name} of {module.__name__}")
            if isinstance(value, dict | set):
                value.clear()
                value.update(old)
            elif not isinstance(value, int | float):
                value[... if hasattr(value, "shape") else slice(None)] = old
            setattr(module, name, value)


@contextlib.contextmanager
def _settings() -> Iterator[None]:
    """Put back how NumPy answers errors and prints, and the precision of mpmath, where they are loaded."""
    with contextlib.ExitStack() as stack:
        if numpy := sys.modules.get("numpy"):
            stack.enter_context(numpy.errstate())
            stack.enter_context(numpy.printoptions())
        if mpmath := sys.modules.get("mpmath"):
            stack.enter_context(mpmath.workprec(mpmath.mp.prec))
        yield


def _copy(value: Any) -> Any:
    """A copy of an array or of plain data; None of what holds something else."""
    with contextlib.suppress(TypeError):
        return value.copy() if hasattr(value, "shape") else copied(value)
    return None


def _same(old: Any, now: Any) -> bool:
    with contextlib.suppress(AttributeError, ValueError):
        return bool(old.tobytes() == now.tobytes() if hasattr(old, "shape") else old == now)
    return False


def copied(value: Any) -> Any:
    """A copy of plain data, at any depth; raises TypeError where it holds something else."""
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, dict):
        return {key: copied(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | set):
        # Rows of numbers are most of what there is.
        return type(value)(value if set(map(type, value)) == {float} else map(copied, value))
    raise TypeError


@contextlib.contextmanager
def kept_environment() -> Iterator[None]:
    """Put the variables of the environment back as they were."""
    before = dict(os.environ)
    try:
        yield
    finally:
        if dict(os.environ) != before:
            os.environ.clear()
            os.environ.update(before)


def _processes() -> str:
    """How many processes Python has begun by `multiprocessing`; what they read is not followed."""
    return repr(multiprocessing.process._process_counter)  # type: ignore[attr-defined]
