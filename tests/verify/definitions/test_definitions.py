"""Every statement that a committed certificate proves has a numeric test, or stands here with the reason why not.

A test agrees with each certificate, and tells the false ones of `false.toml`. The tests know plants and bounds alone:
they import nothing that proves, designs or belongs to a paper.
"""

import ast
import tomllib
from pathlib import Path
from typing import Any

import definitions_delay as delay
import definitions_dualrate as dualrate
import definitions_multirate as multirate
import definitions_nonuniform as nonuniform
import pytest
from definition import ROOT, Altered, Data, Matrix, altered, certificate, names

HERE = Path(__file__).parent
MODULES: dict[str, Any] = {one.PAPER: one for one in (delay, dualrate, multirate, nonuniform)}
CHECKS = {name: check for module in MODULES.values() for name, check in module.CHECKS.items()}
PAPERS = sorted(path.name for path in (ROOT / "certificates").iterdir() if path.is_dir())
SEARCH = "that a program of a degree has no solution: of plain numerics only a search could speak, which shows nothing"
UNCOVERED = dict.fromkeys(("delay.degree-lower", "delay.narrow-lower"), SEARCH)
"""Statements without a numeric test, and why."""
ALLOWED = {"ast", "collections", "copy", "dataclasses", "definition", "fractions", "functools", "itertools", "json"} | {
    "math", "numpy", "pathlib", "pytest", "re", "scipy", "tomllib", "typing"
}  # fmt: skip


FALSE: dict[str, Any] = tomllib.loads((HERE / "false.toml").read_text(encoding="utf-8"))
EQUATIONS = [(paper, *row) for paper, rows in FALSE.pop("equations").items() for row in rows]
ALTERED = [(paper, Altered(**{**row, "path": tuple(row["path"])})) for paper, rows in FALSE.items() for row in rows]
SPOKEN_OF = [(paper, name) for paper in PAPERS for name, stated in names(paper).items() if stated not in UNCOVERED]


def holds(told: Data) -> None:
    CHECKS[told["statement"]](told)


def test_every_statement_has_a_numeric_test_or_a_reason() -> None:
    proved = {statement for paper in PAPERS for statement in names(paper).values()}
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
    assert {name for name in tops if not name.startswith("definitions_")} <= ALLOWED
    assert {name for name in imported if name.startswith("scipy")} <= {"scipy.linalg"}


@pytest.mark.parametrize(("paper", "name"), SPOKEN_OF)
def test_sentence_agrees_with_its_definition(paper: str, name: str) -> None:
    holds(certificate(paper, name))


@pytest.mark.parametrize(("paper", "change"), ALTERED, ids=str)
def test_false_sentence_is_told(paper: str, change: Altered) -> None:
    with pytest.raises(AssertionError):
        holds(altered(paper, change))


@pytest.mark.parametrize(("paper", "name", "equation", "factor"), EQUATIONS)
def test_false_equation_is_told(
    paper: str, name: str, equation: str, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MODULES[paper].FACTORS, equation, factor)
    with pytest.raises(AssertionError):
        holds(certificate(paper, name))


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("entry", [(0, 0), (0, -1), (-1, -1)])
def test_altered_inequality_is_told(which: int, entry: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(*phase: Any) -> tuple[Matrix, Matrix]:
        both = right(*phase)
        both[which][entry] *= 1.01
        return both

    right = multirate.inequality
    monkeypatch.setattr(multirate, "inequality", wrong)
    with pytest.raises(AssertionError):
        multirate.dissipation(certificate(multirate.PAPER, "dissipation"))
        multirate.schur(certificate(multirate.PAPER, "schur"))
