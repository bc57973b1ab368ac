"""The article and the sheet of corrections on each paper, whole and linked; and the way of a print to a page."""

import csv
import re
from pathlib import Path

import msgspec
import pytest
from cases import altered
from msgspec.structs import replace
from sample import HOSTILE, KEY, hostile_results, results

from replication.audit.data import read_printed
from replication.audit.declare import Part, paper
from replication.audit.judge.verdict import make_record
from replication.audit.model import Evidence, Results, Verdict
from replication.audit.report.claim import anchor
from replication.audit.report.page import build_articles, build_report
from replication.audit.store.records import ResultsFile
from replication.errors import AuditError


@pytest.fixture
def made(tmp_path: Path) -> tuple[ResultsFile, Path]:
    known = results(tmp_path / "figures")
    return known, build_articles(known, tmp_path / "figures", tmp_path / "articles")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_data_hold_every_claim_and_correction(made: tuple[ResultsFile, Path]) -> None:
    known, folder = made
    claims, errata = rows(folder / f"{KEY}.csv"), rows(folder / f"{KEY}-corrections.csv")
    assert [row["id"] for row in claims] == [claim.id for claim in known.claims]
    assert [row["verdict"] for row in claims] == [claim.verdict for claim in known.claims]
    assert [(row["printed"], row["meant"]) for row in errata] == [(e.printed, e.meant) for e in known.errata]


def test_names_each_failing_claim_and_links_to_its_evidence(made: tuple[ResultsFile, Path]) -> None:
    known, folder = made
    failing = [c for c in known.claims if c.counted and c.verdict in {Verdict.DIFFERS, Verdict.REFUTED, Verdict.ERROR}]
    sheet = (folder / f"{KEY}-corrections.html").read_text(encoding="utf-8")
    assert failing
    for claim in failing:
        assert f'href="../index.html#claim-{claim.id}"' in sheet


@pytest.mark.parametrize("end", ["", "-corrections"])
def test_no_link_leads_nowhere(made: tuple[ResultsFile, Path], end: str) -> None:
    page = (made[1] / f"{KEY}{end}.html").read_text(encoding="utf-8")
    targets = set(re.findall(r'<a [^>]*?href="([^"]+)"', page))
    within = {target for target in targets if target.startswith("#")}
    assert within <= {f"#{name}" for name in re.findall(r'\bid="([^"]+)"', page)}
    assert {t for t in targets if t.endswith((".csv", ".html")) and "/" not in t} <= {p.name for p in made[1].iterdir()}


def test_words_of_a_paper_stay_text(tmp_path: Path) -> None:
    known = hostile_results(tmp_path / "figures", " ".join(HOSTILE))
    for page in build_articles(known, tmp_path / "figures", tmp_path / "articles").glob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert "<script" not in text
        assert "<img" not in text
        assert text.count("</main>") == 1


def test_missing_drawing_leaves_the_earlier_articles(made: tuple[ResultsFile, Path], tmp_path: Path) -> None:
    known, folder = made
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    next((tmp_path / "figures").glob("*.svg")).unlink()
    with pytest.raises(AuditError):
        build_articles(known, tmp_path / "figures", folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_paper_without_corrections_says_so(made: tuple[ResultsFile, Path], tmp_path: Path) -> None:
    papers = tuple(msgspec.structs.replace(paper, brief=None, tables=(), scope=()) for paper in made[0].papers)
    known = msgspec.structs.replace(made[0], errata=(), claims=(), papers=papers)
    folder = build_articles(known, tmp_path / "figures", tmp_path / "none")
    assert "The text needs no correction." in (folder / f"{KEY}-corrections.html").read_text(encoding="utf-8")


def test_an_article_says_what_is_so_of_its_project(made: tuple[ResultsFile, Path], tmp_path: Path) -> None:
    project = msgspec.structs.replace(made[0].project, copy="We read the preprint.")
    papers = tuple(msgspec.structs.replace(paper, brief=None) for paper in made[0].papers)
    known = msgspec.structs.replace(made[0], errata=(), certificates=(), papers=papers, project=project)
    known = msgspec.structs.replace(
        known, claims=tuple(altered(one, certificates=(), erratum=None) for one in known.claims)
    )
    folder = build_articles(known, tmp_path / "figures", tmp_path / "plain")
    page, sheet = ((folder / f"{KEY}{end}.html").read_text(encoding="utf-8") for end in ("", "-corrections"))
    assert "verify.py" not in page
    assert "verify.py" in (made[1] / f"{KEY}.html").read_text(encoding="utf-8")
    assert f"replication list {KEY}<" in page and f"replication show {KEY}<" not in page
    assert "We read the preprint." in page and "We read the preprint." in sheet and "machine conversion" not in page
    assert "no correction that would make" in sheet and "with these corrections" not in sheet


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
