"""The examples of the documentation run, are short, and use only the public functions."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "docs" / "examples").glob("*.py"))
LINES = 10
METHODS = {"multirate", "nonuniform", "dualrate", "delay"}


def test_there_is_an_example_of_each_method() -> None:
    assert {path.name.partition("_")[0] for path in EXAMPLES} == METHODS


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_is_short(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    statements = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    assert ast.get_docstring(tree) and len(statements) - 1 <= LINES + 1  # imports of two packages count as one
    assert {node.module for node in statements if isinstance(node, ast.ImportFrom)} == {"replication.estimation"}
    runpy.run_path(str(path))
    printed = capsys.readouterr().out
    assert "guaranteed level: " in printed and "bracket: [" in printed
