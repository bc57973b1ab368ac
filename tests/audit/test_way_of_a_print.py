"""The way of one printed value from the data file to the page."""

from pathlib import Path

import pytest
from msgspec.structs import replace
from sample import results

from replication.audit.data import read_printed
from replication.audit.declare import Part, paper
from replication.audit.judge.verdict import make_record
from replication.audit.model import Evidence, Results
from replication.audit.report.page import build_report


def published(folder: Path, text: str, value: float) -> str:
    """A paper with one printed value, declared, judged and shown; the text of its report."""
    (folder / "printed.toml").write_text(f'[level]\nplace = "Table 9"\nvalue = "{text}"\n', encoding="utf-8")
    part = Part("Table 9", reading="none")

    def answer(results: Results) -> Evidence:
        """The value."""
        return Evidence(method="by hand", cross_check="twice", value=value)

    part.value("level", read_printed(folder / "printed.toml")["level"])(answer)
    file = results(folder)
    about = {"title": "t", "authors": ("A. Author",), "year": None, "venue": "", "doi": "", "summary": "", "bibtex": ""}
    claim = paper(key=file.papers[0].key, parts=[part], experiments=(), **about).claims[0]
    record = make_record(claim, answer({}), code="papers/toy.py:1", seconds=0.0, error="", certificates=[], unproved="")
    build_report(replace(file, figures=(), claims=(*file.claims, record)), folder, folder / "index.html")
    return (folder / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2.6×10⁻⁶", 2.61e-6),
        ("2.6e-6", 2.61e-6),
        ("−2.6×10⁻⁶", -2.64e-6),
        ("3.1 x 10^-3", 3.06e-3),
        ("1.2×10⁵", 123456.0),
        ("6.674(15)×10⁻¹¹", 6.68e-11),
        ("66,033", 66033.2),
        ("1,33", 1.3312),
        ("1.23 ± 0.04", 1.246),
        ("4.72 %", 4.7193),
        ("−0.0000", -1.2e-5),
        (".580", 0.58021),
    ],
)
def test_every_form_of_a_print_reaches_the_page(tmp_path: Path, text: str, value: float) -> None:
    """The finished page is read again: each number on it must be found among the results."""
    assert text.replace("-", "−") in published(tmp_path, text, value)
