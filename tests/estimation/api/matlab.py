"""The MATLAB function of an observer, read line by line as the MATLAB that it is.

The reader knows the few constructs that such a function uses, and refuses any other.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

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


class Interpreted:
    """The form, called as a compiled one is."""

    def __init__(self, observer: Any, _: Any = None) -> None:
        self.function = Function(observer.to_matlab("own", "A % comment\nof two lines."))

    @property
    def memory(self) -> list[Any]:
        """All that it remembers."""
        return [np.copy(value).tolist() for value in self.function.kept.values()]

    def reset(self, start: Any) -> None:
        self.function("reset", start)

    def step(self, u: Any, y: Any) -> tuple[int, Any]:
        try:
            return 0, self.function(np.asarray(u), np.asarray(y))[0]
        except Refused:
            return 1, None


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
