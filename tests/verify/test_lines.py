"""What a sceptic reads for a theorem is counted as it is defined, and the page shows the counts of these sources."""

import inspect
from pathlib import Path
from unittest.mock import patch

import pytest

from benchmarks import sceptic
from replication.verify import run, subjects
from replication.verify.algebra import linear, work

ROOT = Path(__file__).parents[2]
CERTIFICATES = ROOT / "certificates"
QUICK = ("okajima2023/dual-rate", "okajima2023/rows")


def shown(page: str) -> dict[str, str]:
    """The lines of the table by statement."""
    return {line.split("`")[1]: line for line in page.splitlines() if line.startswith("| `")}


@pytest.mark.slow
def test_the_page_is_that_of_these_sources() -> None:
    assert sceptic.main(["--check"]) == 0


def test_the_page_has_every_statement() -> None:
    assert shown(sceptic.PAGE.read_text(encoding="utf-8")).keys() == run.STATEMENTS.keys()


def test_functions_are_counted_whole_with_what_they_name() -> None:
    places = sceptic.entered(lambda: linear.take_rows(linear.identity(2), [0]))
    names = {piece.name for path, line in places for span, piece in sceptic.module(path).pieces if line in span}
    assert names == {"take_rows", "submatrix", "identity"}
    path = Path(linear.__file__)
    code = [line for line in inspect.getsource(linear.identity).splitlines() if line.strip() and '"""' not in line]
    source = path.read_text(encoding="utf-8").splitlines()
    counted = {source[line - 1] for line in sceptic.functions(places)[path]}
    assert set(code) <= counted and not any('"""' in line for line in counted)
    assert sceptic.declared(places).keys() == {path}


def test_what_can_only_refuse_is_not_counted_and_changes_no_sentence() -> None:
    path = CERTIFICATES / "okajima2023" / "gains-38.json"
    spent = sceptic.entered(lambda: linear.product(linear.identity(2), linear.identity(2)))
    assert not {file for file, _ in spent} & {Path(work.__file__)}
    said = run.verify(path).line()
    with (
        patch.object(work, "spend"),
        patch.object(subjects, "require_form"),
        patch.object(subjects, "require_file"),
        patch.object(subjects, "wanted_at", return_value=None),
        patch("replication.verify.statement.as_data", return_value=()),
    ):
        assert run.verify(path).line() == said
    # What only refuses returns nothing; the numbers of the estimates are read by estimates alone.
    returned = {name: function.__annotations__["return"] for name, function in vars(work).items() if is_own(function)}
    assert {name for name, kind in returned.items() if kind != "None"} == {
        "bits", "estimate_length", "multiplying", "budget"
    }  # fmt: skip


def is_own(value: object) -> bool:
    return inspect.isfunction(value) and value.__module__ == work.__name__


def test_a_stale_page_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    quick = [CERTIFICATES / f"{name}.json" for name in QUICK]
    with patch.object(sceptic, "committed", lambda: quick):
        assert sceptic.main(["--check"]) == 1
    assert "stale" in capsys.readouterr().out
    assert sceptic.main([str(quick[0])]) == 0
    assert capsys.readouterr().out.split(" lines for ")[1].startswith("okajima2023/dual-rate (frame ")
