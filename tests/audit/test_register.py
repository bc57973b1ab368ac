"""The page on several projects: their counts, links that lead to their reports, and nothing of theirs as markup."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

import pytest
from msgspec.structs import replace
from sample import results as sample

from replication.audit.inspect.headline import counts
from replication.audit.judge.policies import once
from replication.audit.project import Settings
from replication.audit.report.claim import anchor
from replication.audit.report.page import build_register, render_register
from replication.audit.store.records import ResultsFile, write_results
from replication.errors import AuditError, InvalidInputError

EVIL = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> {{ 7 * 7 }}"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> ResultsFile:
    return sample(tmp_path_factory.mktemp("figures"))


class Seen(HTMLParser):
    """Tags, addresses, and cells of tables by row."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.rows: list[list[str]] = []
        self.inside = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if tag == "a" and name == "href"]
        if tag == "tr":
            self.rows.append([])
        self.inside = tag in ("td", "th") or (self.inside and tag not in ("tr", "p"))
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        self.inside = self.inside and tag not in ("td", "th")

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.rows[-1][-1] += data


def project(results: ResultsFile, folder: Path, *, report: bool = True) -> Path:
    write_results(folder / "results.json", results)
    if report:
        (folder / "index.html").write_text("report", encoding="utf-8")
    return folder


def test_each_paper_has_its_counts(made: ResultsFile) -> None:
    shown = Seen(render_register([(made, "")]))
    head, *rows = shown.rows
    for paper, row in zip(made.papers, rows, strict=False):
        claims = [claim for claim in made.claims if claim.paper == paper.key]
        found = dict(zip(head, row, strict=True))
        assert found["Claims"] == str(len(once(claims)))
        assert {verdict: found[verdict] for verdict in head[2:-2]} == {
            str(verdict): str(number) for verdict, number in counts(claims).items() if str(verdict) in head
        }
        assert found["Not as expected"] == str(sum(claim.unexpected for claim in claims))


def test_links_lead_to_the_reports_that_are_there(made: ResultsFile, tmp_path: Path) -> None:
    one = project(replace(made, project=Settings(title="One")), tmp_path / "a b#c")
    two = project(replace(made, project=Settings(title="Two")), tmp_path / "two", report=False)
    page = build_register([one, two / "results.json"], tmp_path / "out" / "register.html")
    links = Seen(page.read_text(encoding="utf-8")).links
    key = made.papers[0].key
    assert links[:2] == ["../a%20b%23c/index.html", f"../a%20b%23c/index.html#{anchor('paper', key)}"]
    assert len(links) == 1 + len(made.papers)


def test_the_same_results_give_the_same_page_in_any_order(made: ResultsFile, tmp_path: Path) -> None:
    folders = [project(replace(made, project=Settings(title=name)), tmp_path / name) for name in ("one", "two")]
    first = build_register(folders, tmp_path / "first.html").read_bytes()
    assert build_register(folders[::-1], tmp_path / "second.html").read_bytes() == first


def test_nothing_of_a_project_becomes_markup(made: ResultsFile) -> None:
    papers = tuple(replace(paper, title=EVIL, authors=(EVIL,)) for paper in made.papers)
    settings = Settings(title=EVIL, subject=EVIL, authors=(EVIL,))
    run = replace(made.run, commit=EVIL, date=EVIL)
    shown = Seen(render_register([(replace(made, project=settings, papers=papers, run=run), "")]))
    assert "script" not in shown.tags and "img" not in shown.tags
    assert any(EVIL in cell for row in shown.rows for cell in row)


def test_another_schema_is_refused_by_name_and_nothing_is_written(made: ResultsFile, tmp_path: Path) -> None:
    path = project(made, tmp_path / "one") / "results.json"
    content = json.loads(path.read_bytes())
    path.write_text(json.dumps({**content, "schema_version": 99}), encoding="utf-8")
    with pytest.raises(AuditError, match=r"one/results.json has schema version 99, and this program reads"):
        build_register([tmp_path / "one"], tmp_path / "register.html")
    with pytest.raises(AuditError, match="does not exist"):
        build_register([tmp_path / "none.json"], tmp_path / "register.html")
    assert not (tmp_path / "register.html").exists()


def test_a_project_is_given_once(made: ResultsFile, tmp_path: Path) -> None:
    folder = project(made, tmp_path / "one")
    with pytest.raises(InvalidInputError, match="given 2 times"):
        build_register([folder, folder / "results.json"], tmp_path / "register.html")
