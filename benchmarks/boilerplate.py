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
any call. The modules are read in the order of their names.
"""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
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
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    trees = {path: ast.parse(text) for path, text in texts.items()}
    constants = {name: value for tree in trees.values() for name, value in _constants(tree)}
    ids = {_id(text, package.name) for tree in trees.values() for text in _declared(tree, constants)} | {package.name}
    standing = {name for name, value in constants.items() if _id(value, package.name) in ids}
    said: set[str] = set()
    kinds: Counter[str] = Counter()
    for path, tree in trees.items():
        imported = {n for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom) for n in _span(node)}
        again = set()
        for node in sorted(
            ast.walk(tree), key=lambda node: (getattr(node, "lineno", 0), getattr(node, "col_offset", 0))
        ):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in standing:
                again.add(node.lineno)
            own = _id(node.value, package.name) if isinstance(getattr(node, "value", None), str) else ""
            if own in ids:
                again |= {node.lineno} if own in said else set()
                said.add(own)
        for number, line in enumerate(texts[path].splitlines(), start=1):
            if line.strip():
                plain = "repeated" if number in again else "other"
                kinds["imports" if number in imported else "brackets" if BRACKETS.fullmatch(line) else plain] += 1
    return Count(kinds.total(), kinds["imports"], kinds["brackets"], kinds["repeated"])


def _declared(tree: ast.Module, constants: Mapping[str, str]) -> Iterator[str]:
    """The ids that a module declares."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            function = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            named = [word.value for word in node.keywords if word.arg in NAMING]
            for value in (*(node.args[:1] if function in DECLARING else ()), *named):
                text = constants.get(value.id) if isinstance(value, ast.Name) else getattr(value, "value", None)
                if isinstance(text, str):
                    yield text


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


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        print(f"{folder}: {measure(Path(folder))}")
