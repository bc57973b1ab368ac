"""The way of printed values from the data file to the page."""

from pathlib import Path

from msgspec.structs import replace
from sample import results

from replication.audit.data import read_printed
from replication.audit.declare import Part, paper
from replication.audit.judge.verdict import make_record
from replication.audit.model import Evidence, Results
from replication.audit.report.claim import anchor
from replication.audit.report.page import build_report

PRINTS = {
    "2.6×10⁻⁶": 2.61e-6, "2.6e-6": 2.61e-6, "−2.6×10⁻⁶": -2.64e-6, "3.1 x 10^-3": 3.06e-3, "1.2×10⁵": 123456.0,
    "6.674(15)×10⁻¹¹": 6.68e-11, "66,033": 66033.2, "1,33": 1.3312, "1.23 ± 0.04": 1.246, "4.72 %": 4.7193,
    "−0.0000": -1.2e-5, ".580": 0.58021,
}  # fmt: skip
"""What is printed, and what is computed."""


def test_every_form_of_a_print_reaches_the_page(tmp_path: Path) -> None:
    """The finished page is read again: each number on it must be found among the results."""
    listed = ", ".join(f'"{text}"' for text in PRINTS)
    (tmp_path / "printed.toml").write_text(f'[level]\nplace = "Table 9"\nvalue = [{listed}]\n', encoding="utf-8")
    part, file = Part("Table 9", reading="none"), results(tmp_path)
    for number, text in enumerate(read_printed(tmp_path / "printed.toml")["level"]):

        def answer(results: Results, text: str = str(text)) -> Evidence:
            """The value."""
            return Evidence(method="by hand", cross_check="twice", value=PRINTS[text])

        part.value(f"level-{number}", text)(answer)
    about = dict.fromkeys(("title", "venue", "doi", "summary", "bibtex"), "") | {"authors": ("A. Author",)}
    made = paper(key=file.papers[0].key, year=None, parts=[part], experiments=(), **about)
    records = [make_record(claim, claim.answer({}), code="papers/toy.py:1", seconds=0.0) for claim in made.claims]
    build_report(replace(file, figures=(), claims=(*file.claims, *records)), tmp_path, tmp_path / "index.html")
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    for record, text in zip(records, PRINTS, strict=True):
        line = page.partition(f'id="{anchor("claim", record.id)}"')[2].partition("</summary>")[0]
        assert text.replace("-", "−") in line
