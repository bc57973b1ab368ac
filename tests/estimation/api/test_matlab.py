"""The MATLAB function of an observer, read line by line as the MATLAB that it is, does what `reset` and `step` do.

The reader below knows the few constructs that such a function uses, and refuses any other.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from tests.estimation.api.running_cases import OBSERVERS, sizes

STEPS, EXACT = 300, 1e-12
WITH_MATLAB = ("multirate", "kalman", "nonuniform", "dualrate")
MEMORY = ("state", "instant", "lost_so_far")
WORDS = re.compile(r"'[^']*'|[A-Za-z_]\w*|\d[\d.e+-]*|~=|\|\||&&|.")


class Refused(Exception):
    """`error` was called."""


class Function:
    """A MATLAB function, translated to Python once; its memory is `kept`."""

    def __init__(self, text: str) -> None:
        text = re.sub(r"%.*", "", text).replace("...\n", " ")
        first, *lines = [line.strip().rstrip(";") for line in text.splitlines() if line.strip()]
        found = re.fullmatch(r"function \[(\w+), (\w+)\] = (\w+)\(u, y\)", first)
        assert found and lines.pop() == "end" and lines[0] == f"persistent {' '.join(MEMORY)}"
        self.kept: dict[str, Any] = dict.fromkeys(MEMORY)
        self.results = found[1], found[2]
        self.code = compile("\n".join(translated(lines[1:])), "<matlab>", "exec")

    def __call__(self, *given: Any) -> tuple[Any, Any]:
        names: dict[str, Any] = {**LIBRARY, **self.kept, "nargin": len(given)}
        names.update(zip(("u", "y"), given, strict=False))
        with suppress(Return):
            exec(self.code, names)
        self.kept = {name: names[name] for name in MEMORY}
        return names["estimate"].ravel(), names["missed"]


class Return(Exception):
    """`return`: ends the function."""


def translated(lines: list[str]) -> Iterator[str]:
    """Each line as Python."""
    depth = 0
    for line in lines:
        pad = "    " * depth
        if line == "end":
            depth -= 1
        elif line == "return":
            yield f"{pad}leave()"
        elif line.startswith("if "):
            depth += 1
            yield f"{pad}if {expression(line[3:])}:"
        elif line.startswith("error("):
            yield f"{pad}error({line[6:-1]})"
        elif found := re.fullmatch(r"([uy]) = \1\(:\)", line):
            yield f"{pad}{found[1]} = column({found[1]})"
        elif found := re.fullmatch(r"state\(1:(\d+)\) = y\(:\)", line):
            yield f"{pad}state[:{found[1]}] = column(y)"
        elif line == "y(left_out) = guess(left_out)":
            yield f"{pad}y[left_out] = guess[left_out]"
        elif found := re.fullmatch(r"(\w+) = \{(.*)\}", line):
            cells = [f"matrix({cell!r})" for cell in re.findall(r"\[([^\]]*)\]", found[2])]
            yield f"{pad}{found[1]} = [{', '.join(cells)}]"
        else:
            name, _, value = line.partition(" = ")
            assert re.fullmatch(r"\w+", name), line
            yield f"{pad}{name} = {expression(value)}"
    assert depth == 0


def expression(text: str) -> str:
    """An expression: `*` is the product of matrices, `name{k}` a cell, `||` takes truth."""
    python = {"||": " or ", "&&": " and ", "~=": "!=", "~": "~", "*": "@"}
    parts = []
    for word in WORDS.findall(re.sub(r"(\w+)\{(\w+)\}", r"cell(\1, \2)", text)):
        assert word in python or re.fullmatch(r"'[^']*'|\w+|\d[\d.e+-]*|[-+(),|& <>]", word), text
        parts.append(python.get(word, word))
    return "".join(parts)


def leave() -> None:
    raise Return


def refuse(text: str) -> None:
    raise Refused(text)


def matrix(text: str) -> Any:
    words = {"true": True, "false": False}
    rows = [[words[word] if word in words else float(word) for word in row.split()] for row in text.split(";")]
    return np.array(rows)


LIBRARY: dict[str, Any] = {
    "leave": leave,
    "error": refuse,
    "matrix": matrix,
    "column": lambda value: np.array(value, dtype=float).reshape(-1, 1),
    "cell": lambda cells, k: cells[k - 1],
    "isempty": lambda value: value is None,
    "ischar": lambda value: isinstance(value, str),
    "zeros": lambda rows, columns: np.zeros((rows, columns)),
    "numel": np.size,
    "any": np.any,
    "all": np.all,
    "isnan": np.isnan,
    "isinf": np.isinf,
    "sum": np.sum,
    "mod": lambda a, b: a % b,
}


def lost(name: str, rng: np.random.Generator, size: int) -> Any:
    """Measurements of which some do not come; of the filter that waits, whole samples."""
    gone = rng.random(1 if name == "nonuniform" else size) < 0.2
    return np.where(gone, np.nan, rng.standard_normal(size))


def expected(name: str, observer: Any, u: Any, y: Any) -> Any:
    step = observer.step(u if len(u) else None, y)
    # The file of the filter gives x^(k+1|k), x^(k|k) and what it looks back to.
    return np.concatenate([step.prediction, step.filtered]) if name == "kalman" else step


@pytest.mark.parametrize("name", WITH_MATLAB)
def test_it_is_equal_over_many_steps(name: str) -> None:
    observer, rng = OBSERVERS[name](), np.random.default_rng(6)
    function, (inputs, measurements) = (
        Function(observer.to_matlab("own", "A % comment\nof two lines.")),
        sizes(observer),
    )
    start = rng.standard_normal(len(observer.reset()) if name == "kalman" else observer.states)
    observer.reset(start)
    function("reset", start)
    for _ in range(STEPS):
        u, y = rng.standard_normal(inputs), lost(name, rng, measurements)
        estimate, missed = function(u, y)
        right = expected(name, observer, u, y)
        assert np.allclose(estimate[: len(right)], right, rtol=EXACT, atol=EXACT)
        assert missed == observer.missed
    assert observer.missed > 0


@pytest.mark.parametrize("name", WITH_MATLAB)
def test_another_digit_is_noticed(name: str) -> None:
    observer = OBSERVERS[name]()
    text = observer.to_matlab()
    gain = re.search(r"injection = \{ \.\.\.\n\s*\[(-?\d\.\d+)", text)
    assert gain
    other = text.replace(gain[0], gain[0].replace(gain[1], repr(float(gain[1]) + 1e-6)))
    inputs, measurements = sizes(observer)
    given = np.ones(inputs), np.ones(measurements)
    right = expected(name, observer, *given)
    assert np.allclose(Function(text)(*given)[0][: len(right)], right, rtol=EXACT)
    assert not np.allclose(Function(other)(*given)[0][: len(right)], right, rtol=1e-9)


@pytest.mark.parametrize("name", WITH_MATLAB)
def test_what_python_refuses_changes_nothing(name: str) -> None:
    observer = OBSERVERS[name]()
    function, (inputs, measurements) = Function(observer.to_matlab()), sizes(observer)
    u, y = np.ones(inputs), np.ones(measurements)
    function("reset")
    for bad in ([u, [*y[1:], np.inf]], [u, [*y, 1.0]], [[*u, 1.0], y]):
        before = dict(function.kept)
        with pytest.raises(Refused):
            function(*bad)
        assert all(np.array_equal(before[key], function.kept[key]) for key in MEMORY)


def test_bad_names_and_other_observers_have_messages() -> None:
    for bad in ("end", "9a", "a b", 3):
        with pytest.raises(InvalidInputError, match="MATLAB function"):
            OBSERVERS["multirate"]().to_matlab(bad)
    for name in ("delay", "innovations", "starting"):
        with pytest.raises(InvalidInputError, match="no periodic recursion"):
            OBSERVERS[name]().to_matlab()
