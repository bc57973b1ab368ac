"""The examples of the documentation, run for the pages and the README that show them."""

from __future__ import annotations

import ast
import contextlib
import io
import runpy
from dataclasses import dataclass
from pathlib import Path

from replication.drawing.panels import as_svg
from replication.errors import AuditError

FIGURE = "figure"
"""The variable in which an example leaves its picture, if it has one."""


@dataclass(frozen=True)
class Ran:
    """An example that was run.

    caption: first line of its docstring. code: without the docstring. drawing: stand-alone SVG, or nothing.
    """

    name: str
    caption: str
    code: str
    output: str
    drawing: str


def run_example(path: Path) -> Ran:
    """Run the script at `path`; raises AuditError that names it if it fails or says nothing of itself."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    said = ast.get_docstring(tree)
    if not said:
        raise AuditError(f"{path} has no docstring; its first line is the caption of what it draws")
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            names = runpy.run_path(str(path))
    except Exception as error:  # whatever an example raises
        raise AuditError(f"{path}: {type(error).__name__}: {error}; run it by itself and correct it") from error
    code = "\n".join(text.splitlines()[tree.body[0].end_lineno :]).strip()
    figure = names.get(FIGURE)
    drawing = "" if figure is None else as_svg(figure, path.stem)
    return Ran(path.stem, said.splitlines()[0], code, printed.getvalue().rstrip(), drawing)
