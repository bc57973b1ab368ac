"""Every statement that a committed certificate proves has a numeric test, or stands here with the reason why not.

The tests know plants and bounds alone: they import nothing that proves, designs or belongs to a paper.
"""

import ast
from pathlib import Path

import pytest
from definition import ROOT, certificates
from test_definitions_delay import CHECKS as DELAY
from test_definitions_dualrate import CHECKS as DUALRATE
from test_definitions_multirate import CHECKS as MULTIRATE
from test_definitions_nonuniform import CHECKS as NONUNIFORM

HERE = Path(__file__).parent
CHECKS = {**DELAY, **DUALRATE, **MULTIRATE, **NONUNIFORM}
PAPERS = sorted(path.name for path in (ROOT / "certificates").iterdir() if path.is_dir())
SEARCH = "that a program of a degree has no solution: of plain numerics only a search could speak, which shows nothing"
UNCOVERED = dict.fromkeys(("delay.degree-lower", "delay.narrow-lower"), SEARCH)
"""Statements without a numeric test, and why."""
ALLOWED = {"ast", "collections", "copy", "dataclasses", "definition", "fractions", "functools", "itertools", "json"} | {
    "math", "numpy", "pathlib", "pytest", "re", "scipy", "subprocess", "sys", "typing"
}  # fmt: skip


def test_every_statement_has_a_numeric_test_or_a_reason() -> None:
    proved = {told["statement"] for paper in PAPERS for told in certificates(paper).values()}
    assert proved - CHECKS.keys() == UNCOVERED.keys()
    assert CHECKS.keys() <= proved


@pytest.mark.parametrize("path", sorted(HERE.glob("*.py")), ids=lambda path: path.name)
def test_imports_are_numpy_and_the_standard_library(path: Path) -> None:
    imported = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            imported.add(str(node.module))
        elif isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
    tops = {name.partition(".")[0] for name in imported}
    assert {name for name in tops if not name.startswith("test_definitions_")} <= ALLOWED
    assert {name for name in imported if name.startswith("scipy")} <= {"scipy.linalg"}
