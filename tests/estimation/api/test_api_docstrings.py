"""Docstrings, their examples, and habits of all methods."""

import dataclasses
import doctest
import enum
import importlib
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from replication import estimation
from replication.estimation import delay, dualrate, multirate, nonuniform
from replication.estimation.api.design import Design
from replication.estimation.api.results import Bracket, GainResult
from replication.estimation.api.running import PeriodicObserver, RunningObserver
from replication.estimation.api.shown import Shown, Simulation
from replication.estimation.delay.sos.observer import RunningDelayObserver
from replication.estimation.nonuniform.result import RunningFilter
from tests.estimation.api.api_cases import METHODS

SHARED: tuple[type, ...] = (Bracket, Shown, GainResult, Design, Simulation)
SHARED += (RunningObserver, PeriodicObserver, RunningFilter, RunningDelayObserver)
SECTION = re.compile(r"^(\w+)\n-{3,}$", re.MULTILINE)
ORDER = ("Parameters", "Attributes", "Returns", "Raises", "Notes", "Examples")


def sections(docstring: str) -> dict[str, str]:
    """The text under each heading of a docstring, in their order."""
    parts = SECTION.split(docstring)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def documented(text: str) -> dict[str, bool]:
    """The names of a section, each with whether a type and an explanation follow."""
    entries = re.findall(r"^(\S.*)\n((?:(?: {4}.*)?\n?)*)", text, re.MULTILINE)
    found = {}
    for heading, explanation in entries:
        names, _, kind = heading.partition(" : ")
        found |= dict.fromkeys(names.split(", "), bool(kind) and bool(explanation.strip()))
    return found


def taken(thing: Any) -> list[str]:
    """The arguments of a function, or of the making of an instance; the fields of a dataclass that adds some."""
    if dataclasses.is_dataclass(thing):
        inherited = {name for base in thing.__mro__[1:] for name in getattr(base, "__dataclass_fields__", {})}
        return [field.name for field in dataclasses.fields(thing) if field.name not in inherited]
    function = thing.__init__ if inspect.isclass(thing) else thing
    return [name for name in inspect.signature(function).parameters if name not in ("self", "cls")]


def omissions(thing: Any, *, door: bool = True) -> list[str]:
    """What the docstring leaves out, or names although it is not there; a function at the `door` checks its input."""
    found = sections(inspect.getdoc(thing) or "")
    said = documented(found.get("Parameters", "") + found.get("Attributes", ""))
    wanted = taken(thing)
    missing = [f"{name} is not documented" for name in wanted if name not in said]
    missing += [f"{name} is no argument" for name in said if name not in wanted]
    missing += [f"{name} lacks its type or meaning" for name, whole in said.items() if not whole]
    if not missing and list(said) != wanted:
        missing.append(f"documented in another order than {wanted}")
    if inspect.isfunction(thing):
        given = inspect.signature(thing).return_annotation
        if given not in (None, "None", inspect.Signature.empty) and "Returns" not in found:
            missing.append("no section Returns")
        if (door or re.search(r"^\s+raise ", inspect.getsource(thing), re.MULTILINE)) and "Raises" not in found:
            missing.append("no section Raises")
    if [name for name in ORDER if name in found] != list(found):
        missing.append(f"sections in another order, or unknown: {list(found)}")
    return missing


def methods(kind: type) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The public methods that a class adds; one that fills in a hook is documented where the hook is."""
    for name, value in vars(kind).items():
        function = getattr(value, "__func__", value)
        hook = any(hasattr(base, name) for base in kind.__mro__[1:])
        if inspect.isfunction(function) and not name.startswith("_") and not hook:
            yield name, function


def public() -> dict[str, Any]:
    """Every function and class that users meet, by its full name, and the methods of these classes."""
    found: dict[str, Any] = {}
    for method in METHODS:
        package = importlib.import_module(f"replication.estimation.{method}")
        found |= {f"{method}.{name}": getattr(package, name) for name in package.__all__}
    found |= {kind.__name__: kind for kind in SHARED}
    classes = {name: thing for name, thing in found.items() if inspect.isclass(thing)}
    found |= {f"{name}.{called}": function for name, kind in classes.items() for called, function in methods(kind)}
    return {name: thing for name, thing in found.items() if callable(thing)}


PUBLIC = public()
DOORS = {name for name in PUBLIC if name.partition(".")[0] in METHODS and name.count(".") == 1}


@pytest.mark.parametrize("name", PUBLIC)
def test_what_is_taken_given_and_raised_is_documented(name: str) -> None:
    thing = PUBLIC[name]
    assert inspect.getdoc(thing)
    if not (inspect.isclass(thing) and issubclass(thing, enum.Enum)) and thing is not Shown:
        assert omissions(thing, door=name in DOORS) == []


@pytest.mark.parametrize("method", METHODS)
def test_every_design_has_an_example_and_a_source(method: str) -> None:
    found = sections(inspect.getdoc(PUBLIC[f"{method}.design"]) or "")
    assert ">>> " in found["Examples"] and re.search(r"eqs?\. \(|Theorem|LMI \(", found["Notes"])


@pytest.mark.parametrize(
    ("pattern", "replacement", "found"),
    [
        ("", "", []),
        (r"^steps : ", "step : ", ["steps is not documented", "step is no argument"]),
        (r"^(steps : int\n)    .*\n", r"\1", ["steps lacks its type or meaning"]),
        (r"^(steps : (?:.*\n)+?)(disturbance : (?:.*\n)+?)(?=initial)", r"\2\1", ["documented in another order than"]),
        (r"Raises\n------(?s:.*)", "", ["no section Raises"]),
        (r"Returns\n-------\n(?:.*\n)+?\n", "", ["no section Returns"]),
    ],
)
def test_a_planted_omission_is_found(pattern: str, replacement: str, found: list[str], monkeypatch: Any) -> None:
    text = inspect.getdoc(Design.simulate) or ""
    planted = re.sub(pattern, replacement, text, count=1, flags=re.MULTILINE)
    assert (planted == text) == (not found)
    monkeypatch.setattr(Design.simulate, "__doc__", planted)
    told = omissions(Design.simulate)
    assert len(told) == len(found) and all(map(str.startswith, told, found))


@pytest.mark.parametrize(
    ("module", "least"),
    [
        ("multirate.facade", 3),
        ("nonuniform.facade", 3),
        ("nonuniform.stamped.kalman", 1),
        ("nonuniform.stamped.running", 1),
        ("dualrate.facade", 3),
        ("delay.facade", 3),
    ],
)
def test_doctests(module: str, least: int) -> None:
    failures, tried = doctest.testmod(importlib.import_module(f"replication.estimation.{module}"))
    assert (failures, tried >= least) == (0, True)


PACKAGES = (estimation, multirate, nonuniform, dualrate, delay)


@pytest.mark.parametrize("package", PACKAGES)
def test_dir_shows_the_public_names_alone(package: Any) -> None:
    assert [name for name in dir(package) if not name.startswith("__")] == sorted(package.__all__)
