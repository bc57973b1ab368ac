"""Mutation testing of the verifier: small changes of its source, each of which some test must notice.

A mutant changes one comparison, operator, constant, sign or negation, swaps `any` and `all` or `min` and `max`, or
leaves out one `require..` or `decide` call. It is run in a process of its own, where what the changed source defines
takes the place of what the module defined, wherever that was imported; the checks are the tests that call the function
that changed, one by one until one fails.
"""

from __future__ import annotations

import ast
import contextlib
import cProfile
import faulthandler
import functools
import importlib
import importlib.util
import io
import itertools
import os
import signal
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import pytest

from replication.verify.statement import Statement

ROOM = ("replication.verify",)
SECONDS = 20
"""Of the processor, after which a child counts as noticed: it runs for ever."""
LEAST, LONGER = 2, 3
"""So many seconds, and so many times as long as a check without any mutant: in it a mutant runs for ever."""
ARITHMETIC = tuple(f"{ROOM[0]}.stdlib{part}" for part in (".balls", ".exact", ""))
"""The second arithmetic: classes made of each other, so that all that comes after a changed module is made anew."""
STRANGER = 8
"""How many times its calls a check costs in the order if it calls nothing of the module."""
COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Add,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.Mod: ast.Mult,
    ast.FloorDiv: ast.Mult,
}
REFUSING = ("require", "decide", "need")
"""How the names begin of what refuses a certificate."""
SWAPPED = {"any": "all", "all": "any", "min": "max", "max": "min"}


@dataclass(frozen=True)
class Mutant:
    """One changed module.

    line, text: of the change; change: what became of what; place: the numbers of the node among those that may change,
    and of its change; function: the lines of the function in which it is, none if it is done at import.
    """

    module: str
    line: int
    text: str
    change: str
    place: tuple[int, int]
    function: range

    def __str__(self) -> str:
        return f"{self.module}:{self.line}: {self.change}"

    @functools.cached_property
    def code(self) -> CodeType:
        """The whole module, changed: compiled of those alone that are tried."""
        tree, (node, change) = ast.parse(_original(self.module)), self.place
        _apply(next(itertools.islice(_places(tree), node, None)), change)
        return compile(ast.fix_missing_locations(tree), str(sys.modules[self.module].__file__), "exec")


def mutants_of(module: str) -> list[Mutant]:
    """All mutants of a module, from its source; texts, annotations and imports are left alone."""
    original = _original(module)
    tree, lines = ast.parse(original), [line.strip() for line in original.split("\n")]
    functions, found = _functions(tree), []
    for number, node in enumerate(list(_places(tree))):
        whole = {field: list(value) if isinstance(value, list) else value for field, value in vars(node).items()}
        for change in itertools.count():
            words = _apply(node, change)
            if words is None:
                break
            line = getattr(node, "lineno", 0)
            place = functions.get(id(node), range(0))
            found.append(Mutant(module, line, lines[line - 1], words, (number, change), place))
            vars(node).update({field: list(v) if isinstance(v, list) else v for field, v in whole.items()})
    return found


def _original(module: str) -> str:
    spec = importlib.util.find_spec(module)
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).read_text(encoding="utf-8")


def _functions(tree: ast.Module) -> dict[int, range]:
    """By the identity of each node in the body of a function, or method, the lines of the outermost one."""
    found: dict[int, range] = {}
    for outer in ast.walk(tree):
        if isinstance(outer, ast.FunctionDef):
            first = min(part.lineno for part in (outer, *outer.decorator_list))
            lines = range(first, (outer.end_lineno or first) + 1)
            for part in outer.body:
                for inner in ast.walk(part):
                    found.setdefault(id(inner), lines)
    return found


def survivors(module: str, mutants: Sequence[Mutant], tests: Sequence[str]) -> list[Mutant]:
    """Those mutants of a module that none of the checks of these test modules notices."""
    importlib.import_module(module)
    runs = [run for name in tests for run in runs_of(name)]
    left, found = [], [1] * len(runs)
    for mutant in mutants:
        # The quick checks first, and those that noticed much so far: a mutant then dies soon. What is done at import
        # reaches all of them, but one that calls nothing of the module seldom notices it.
        order = sorted(
            range(len(runs)), key=lambda i: runs[i].calls / found[i] * (1 if runs[i].entered[module] else STRANGER)
        )
        reached = [i for i in order if runs[i].reaches(mutant)]
        limits = {i: LEAST + LONGER * runs[i].seconds for i in reached}
        noticed = told_by_a_child(functools.partial(_first_failure, mutant, tests, limits))
        if noticed is None:
            left.append(mutant)
        elif noticed >= 0:
            found[noticed] += 1
    return left


@dataclass(frozen=True)
class Run:
    """One check without any mutant. calls: how much it does; seconds: of the processor; entered: by module of the
    verifier, the first lines of what it called there.
    """

    calls: int
    seconds: float
    entered: Mapping[str, set[int]]

    def reaches(self, mutant: Mutant) -> bool:
        """Whether it called the function that changed; whatever is done at import reaches every check."""
        return not mutant.function or not self.entered[mutant.module].isdisjoint(mutant.function)


RUNS: dict[str, list[Run]] = {}
"""By test module; no cache of functools, which `_forget` would empty."""


def runs_of(test: str) -> list[Run]:
    """Each check of a test module, run once for the mutants of all modules; none finds what another one computed."""
    if test not in RUNS:
        checks, own = checks_of(importlib.import_module(test)), _own_modules()
        RUNS[test] = [_run(check, own) for check in checks]
    return RUNS[test]


def _run(check: Callable[[], None], own: Sequence[ModuleType]) -> Run:
    _forget(own)
    profile, before = cProfile.Profile(builtins=False), os.times()
    profile.runcall(check)
    after = os.times()
    files = {module.__file__: name for name, module in list(sys.modules.items()) if name.startswith(ROOM)}
    calls, entered = 0, defaultdict[str, set[int]](set)
    for entry in profile.getstats():
        calls += entry.callcount
        if isinstance(entry.code, CodeType) and entry.code.co_filename in files:
            entered[files[entry.code.co_filename]].add(entry.code.co_firstlineno)
    return Run(calls, after.user + after.system - before.user - before.system, entered)


def checks_of(module: ModuleType) -> list[Callable[[], None]]:
    """The tests of a module, one for each set of parameters; slow ones, and those with other fixtures, are left out."""
    found: list[Callable[[], None]] = []
    for name, function in vars(module).items():
        if name.startswith("test_") and callable(function):
            marks = getattr(function, "pytestmark", [])
            if not any(mark.name == "slow" for mark in marks):
                found.extend(_calls(function, [mark.args for mark in marks if mark.name == "parametrize"]))
    return found


def _calls(function: Callable[..., None], parameters: list[tuple[Any, ...]]) -> Iterator[Callable[[], None]]:
    tables = []
    for names, values, *_ in parameters:
        keys = [key.strip() for key in names.split(",")] if isinstance(names, str) else list(names)
        rows = [getattr(row, "values", row) if not isinstance(row, dict) else row for row in values]
        tables.append([dict(zip(keys, row if len(keys) > 1 else _single(row), strict=True)) for row in rows])
    wanted = set(function.__code__.co_varnames[: function.__code__.co_argcount])
    for chosen in itertools.product(*tables):
        arguments = {key: _current(value) for row in chosen for key, value in row.items()}
        if wanted - FIXTURES.keys() == set(arguments):
            yield functools.partial(_call, function, arguments, wanted & FIXTURES.keys())


def _current(value: Any) -> Any:
    """A member of an enumeration as its module has it now: no mutant is noticed for defining the class anew."""
    if not isinstance(value, Enum):
        return value
    kind = type(value)
    return vars(sys.modules[kind.__module__])[kind.__name__][value.name]


def _call(function: Callable[..., None], arguments: Mapping[str, Any], fixtures: Iterable[str]) -> None:
    with contextlib.ExitStack() as stack:
        given = {name: stack.enter_context(FIXTURES[name]()) for name in fixtures}
        function(**arguments, **given)


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


class Printed:
    """What was printed since it was last asked for."""

    def __init__(self) -> None:
        self.stream = io.StringIO()

    def readouterr(self) -> Printed:
        """The text, as `out`."""
        self.out = self.stream.getvalue()
        self.stream.seek(0)
        self.stream.truncate()
        return self


@contextlib.contextmanager
def _printed() -> Iterator[Printed]:
    printed = Printed()
    with contextlib.redirect_stdout(printed.stream):
        yield printed


FIXTURES: Mapping[str, Callable[[], contextlib.AbstractContextManager[Any]]] = {
    "tmp_path": _folder, "capsys": _printed, "monkeypatch": pytest.MonkeyPatch.context
}  # fmt: skip
"""Those of pytest that a check may have."""


def _single(row: Any) -> tuple[Any]:
    return (row,)


def told_by_a_child(first: Callable[[], int | str], seconds: float = SECONDS) -> int | None:
    """What `first` finds in a process of its own: a number, or None for "none"; -1 if the process ends before."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        _die_alone(seconds)
        answer = "none"
        try:
            answer = str(first())
        finally:
            os.write(writer, answer.encode())
            os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as stream:
        answer = stream.read()
    os.waitpid(child, 0)
    # A mutant that was ended by its limit, or by an abort of FLINT, says nothing.
    return None if answer == "none" else int(answer or -1)


def _die_alone(seconds: float) -> None:
    """End this process after its share of the processor, and say nothing of it, nor of an abort."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    _end_after(seconds)
    faulthandler.disable()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)


def _end_after(seconds: float) -> None:
    """Let this process have so much of the processor from now on."""
    signal.setitimer(signal.ITIMER_PROF, seconds)


def _first_failure(mutant: Mutant, tests: Sequence[str], limits: Mapping[int, float]) -> int | str:
    """The number of the check that a mutant fails, tried in this order, each with its limit, or "none"; -1 if it cannot
    be imported.
    """
    try:
        _take_the_place(mutant)
    except Exception:  # noqa: BLE001 - whatever a mutant does to an import, it is noticed
        return -1
    checks = [check for name in tests for check in checks_of(sys.modules[name])]
    for index, limit in limits.items():
        _end_after(limit)
        try:
            checks[index]()
        except BaseException:  # noqa: BLE001 - a failed test, in whatever way
            return index
    return "none"


def _take_the_place(mutant: Mutant) -> None:
    """Run the changed source in the module, and put what it defines in place of what others took from there before."""
    module = sys.modules[mutant.module]
    after = ARITHMETIC[ARITHMETIC.index(mutant.module) + 1 :] if mutant.module in ARITHMETIC else ()
    anew = [module, *(sys.modules[name] for name in after)]
    before = {name: value for made in anew for name, value in vars(made).items()}
    exec(mutant.code, vars(module))
    for made in anew[1:]:
        importlib.reload(made)
    now = {name: value for made in anew for name, value in vars(made).items()}
    changed = _changed(before, now)
    others = [other for other in _own_modules() if other not in anew]
    for other in others:
        for name, old in before.items():
            if not name.startswith("__") and vars(other).get(name) is old:
                setattr(other, name, now[name])
        _replace(vars(other), changed)
    _forget([*anew, *others])


def _own_modules() -> list[ModuleType]:
    """The verifier and its tests."""
    here = os.path.dirname(__file__)  # noqa: PTH120 - asked of every module before each check
    named = list(sys.modules.items())
    return [m for name, m in named if name.startswith(ROOM) or (getattr(m, "__file__", None) or "").startswith(here)]


def _forget(modules: Iterable[ModuleType]) -> None:
    """Empty the caches of functions: what was computed before a change must not stand in for what comes after it."""
    for module in modules:
        for value in vars(module).values():
            if isinstance(value, functools._lru_cache_wrapper):
                value.cache_clear()


def _changed(before: Mapping[Any, Any], after: Mapping[Any, Any]) -> dict[int, Any]:
    """By the identity of each function and class of a namespace, and of its tables, the one that came after it."""
    found = {}
    for name, old in before.items():
        new = after.get(name)
        if isinstance(old, dict) and isinstance(new, dict) and not str(name).startswith("__"):
            found |= _changed(old, new)
        elif callable(old) and new is not old:
            found[id(old)] = new
    return found


def _replace(table: dict[Any, Any], changed: Mapping[int, Any]) -> None:
    for key, value in list(table.items()):
        if id(value) in changed:
            table[key] = changed[id(value)]
        elif isinstance(value, dict) and not str(key).startswith("__"):
            _replace(value, changed)
        elif isinstance(value, Statement):
            # Readers of the changed module stand in the tables of the statements of others.
            _replace(vars(value), changed)


def _places(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes that may change, in a fixed order."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "type_params"):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST) and not _left_alone(node):
                yield node
                yield from _places(node)


def _left_alone(node: ast.AST) -> bool:
    """Messages, imports, dataclasses, `strict=True` of a zip, which guards against mistakes of the verifier only,
    guesses that are enclosed afterwards, and estimates of work: none is part of a proof, and the tests of work bombs
    hold that they stop what they should.
    """
    return (
        (isinstance(node, ast.FunctionDef) and node.name == "_guesses")
        or isinstance(node, ast.JoinedStr | ast.Import | ast.ImportFrom)
        or (isinstance(node, ast.keyword) and node.arg == "strict")
        or (isinstance(node, ast.Call) and _called(node) == "dataclass")
        or (isinstance(node, ast.Call) and _called(node).startswith(("spend", "estimate_")))
    )


def _apply(node: ast.AST, change: int) -> str | None:
    """Make the change with this number in place, and say what it is; None if there is no such change."""
    if isinstance(node, ast.Compare):
        pairs = [(i, new) for i, op in enumerate(node.ops) for new in COMPARISONS[type(op)]]
        if change < len(pairs):
            place, new = pairs[change]
            old, node.ops[place] = node.ops[place], new()
            return f"{type(old).__name__} became {new.__name__}"
    elif change > 0:
        return None
    elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        old_operator, node.op = node.op, OPERATORS[type(node.op)]()
        return f"{type(old_operator).__name__} became {type(node.op).__name__}"
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return f"became {type(node.op).__name__}"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else ast.Not()
        if isinstance(node.op, ast.Not):
            node.operand = ast.UnaryOp(ast.Not(), node.operand)
        return "lost its sign or negation"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        node.value = not node.value
        return f"became {node.value}"
    elif isinstance(node, ast.Constant) and isinstance(node.value, int):
        node.value += 1
        return f"became {node.value}"
    elif isinstance(node, ast.Name) and node.id in SWAPPED:
        node.id = SWAPPED[node.id]
        return f"became {node.id}"
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and _called(node.value).startswith(REFUSING):
        words = f"{_called(node.value)} left out"
        node.value = ast.Constant(None)
        return words
    return None


def _called(call: ast.Call) -> str:
    return call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
