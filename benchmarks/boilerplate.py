"""How much of a paper's Python says nothing of the paper: `python benchmarks/boilerplate.py papers/KEY ...`.

The share is taken over the lines of all its Python that are not blank, comments and docstrings included. A line is
boilerplate if it is

- a part of an import;
- brackets and commas alone;
- or a line that says an id again: it holds a string that is an id, whole or behind `claim:`, which an earlier line has
  said, or a constant that stands for such a string alone.

An id is the key of the paper or the name of a claim, experiment, figure or erratum, each with or without the key in
front, as it is written where it is declared: the first string of a call to `experiment` or to a kind of claim
(`value`, `matrix`, `bound`, `order`, `feasible`, `statistical`, `cited`), and what stands for `id`, `name` or `key` in
any call. The modules are read in the order in which one of them builds on another, imported ones first.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DECLARING = ("experiment", "value", "matrix", "bound", "order", "feasible", "statistical", "cited")
NAMING = ("id", "name", "key")
BRACKETS = re.compile(r"[\s()\[\]{},*]+")


@dataclass(frozen=True)
class Count:
    """Lines of a paper's Python that are not blank, by what makes them boilerplate; a line counts once."""

    lines: int
    imports: int
    brackets: int
    repeated: int

    @property
    def share(self) -> float:
        """The part of the lines that is boilerplate."""
        return (self.imports + self.brackets + self.repeated) / self.lines

    def __str__(self) -> str:
        return (
            f"{self.lines} lines, {100 * self.share:.1f} % boilerplate: {self.imports} imports, "
            f"{self.brackets} brackets, {self.repeated} that repeat an id"
        )


def measure(package: Path) -> Count:
    """Count the lines of a package of a paper; its key is the name of the folder."""
    texts = {path: path.read_text(encoding="utf-8") for path in _ordered(package)}
    trees = {path: ast.parse(text) for path, text in texts.items()}
    ids = {package.name} | {_id(name, package.name) for tree in trees.values() for name in _declared(tree)}
    constants = {name for tree in trees.values() for name, value in _constants(tree) if _id(value, package.name) in ids}
    said: set[str] = set()
    lines = imports = brackets = repeated = 0
    for path, tree in trees.items():
        imported = {n for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom) for n in _span(node)}
        again = _repeats(tree, package.name, ids, constants, said)
        for number, line in enumerate(texts[path].splitlines(), start=1):
            if line.strip():
                lines += 1
                imports += number in imported
                brackets += number not in imported and BRACKETS.fullmatch(line) is not None
                repeated += number not in imported and number in again
    return Count(lines, imports, brackets, repeated)


def _repeats(tree: ast.Module, key: str, ids: set[str], constants: set[str], said: set[str]) -> set[int]:
    """The lines that say again an id of `said`, to which those of this module are added."""
    again = set()
    for node in sorted(ast.walk(tree), key=lambda node: (getattr(node, "lineno", 0), getattr(node, "col_offset", 0))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and _id(node.value, key) in ids:
            if _id(node.value, key) in said:
                again.add(node.lineno)
            said.add(_id(node.value, key))
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in constants:
            again.add(node.lineno)
    return again


def _declared(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            named = [word.value for word in node.keywords if word.arg in NAMING]
            for value in (*(node.args[:1] if function in DECLARING else ()), *named):
                if isinstance(value, ast.Constant) and isinstance(value.value, str):
                    yield value.value
                if isinstance(value, ast.Name):
                    yield from (text for name, text in _constants(tree) if name == value.id)


def _constants(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """Names of a module that stand for a string alone, with the string."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield from ((name.id, node.value.value) for name in node.targets if isinstance(name, ast.Name))


def _id(text: str, key: str) -> str:
    """A string as an id: without `claim:` and the key in front."""
    return text.removeprefix("claim:").removeprefix(f"{key}.").removeprefix(f"{key}-")


def _span(node: ast.stmt) -> range:
    return range(node.lineno, (node.end_lineno or node.lineno) + 1)


def _ordered(package: Path) -> list[Path]:
    """The modules of a package, each after those that it imports, otherwise by name."""
    paths = {
        ".".join([package.name, *path.relative_to(package).with_suffix("").parts]).removesuffix(".__init__"): path
        for path in sorted(package.rglob("*.py"))
    }
    placed: dict[str, Path] = {}

    def place(name: str) -> None:
        if name in paths and name not in placed:
            path = paths.pop(name)
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module:
                    module = node.module.removeprefix("papers.")
                    for imported in (module, *(f"{module}.{alias.name}" for alias in node.names)):
                        place(imported)
            placed[name] = path

    for name in sorted(paths):
        place(name)
    return list(placed.values())


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        print(f"{folder}: {measure(Path(folder))}")
