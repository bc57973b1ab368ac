"""The way of one printed value from the data file to the page: in how few files of the engine it is ever at hand."""

import sys
from pathlib import Path
from types import FrameType
from typing import Any

from msgspec.structs import replace
from sample import results

import replication
from replication.audit.data import read_printed
from replication.audit.declare import Part, paper
from replication.audit.judge.recording import make_record
from replication.audit.model import Evidence, Results
from replication.audit.report.page import build_report

ROOT = Path(replication.__file__).parents[1]
ENGINE = (f"{ROOT}/replication/", f"{ROOT}/report/")
PRINT = "7.31"
MOST = 12


def answer(results: Results) -> Evidence:
    """The value."""
    return Evidence(method="by hand", cross_check="twice", value=7.312)


def published(folder: Path) -> str:
    """A paper with one printed value, declared, judged and shown; the text of its report."""
    (folder / "printed.toml").write_text(f'[level]\nplace = "Table 9"\nvalue = "{PRINT}"\n', encoding="utf-8")
    part = Part("Table 9", reading="none")
    part.value("level", read_printed(folder / "printed.toml")["level"])(answer)
    file = results(folder)
    about = {"title": "t", "authors": ("A. Author",), "year": None, "venue": "", "doi": "", "summary": "", "bibtex": ""}
    claim = paper(key=file.papers[0].key, parts=[part], experiments=(), **about).claims[0]
    record = make_record(claim, answer({}), code="papers/toy.py:1", seconds=0.0, error="", certificates=[], unproved="")
    build_report(replace(file, figures=(), claims=(*file.claims, record)), folder, folder / "index.html")
    return (folder / "index.html").read_text(encoding="utf-8")


def test_a_printed_value_passes_few_files(tmp_path: Path) -> None:
    met: set[str] = set()

    def look(frame: FrameType, event: str, argument: Any) -> None:
        # Called for every function, so no more than comparisons of strings.
        file = frame.f_code.co_filename
        if file.startswith(ENGINE) and any(
            isinstance(value, str) and value == PRINT for value in frame.f_locals.values()
        ):
            met.add(file.removeprefix(f"{ROOT}/"))

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        page = published(tmp_path)
    finally:
        sys.setprofile(before)
    assert f">{PRINT}<" in page
    assert {
        "replication/audit/data.py",
        "replication/audit/judge/printed.py",
        "replication/audit/report/html/parts.html.j2",
    } <= met
    assert len(met) <= MOST, sorted(met)
