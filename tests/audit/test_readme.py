"""The README as a landing page: two screens, links that lead somewhere, a picture of sources that were committed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import markdown
import pytest
from cases import recorded, results_file
from msgspec.structs import replace
from sample import paper_record

from benchmarks.readme import notes, replace_block, results_block, verdicts
from replication.audit.model import Evidence
from replication.errors import AuditError

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
WIDTH, TWO_SCREENS = 1000, 2 * 1080
STYLE = """body { margin: 0; padding: 32px; font: 16px/1.5 system-ui, sans-serif }
  h1 { font-size: 32px; line-height: 1.25 }
  h1, h2 { border-bottom: 1px solid #ddd; padding-bottom: 5px; margin: 24px 0 16px } p, ul { margin: 0 0 16px }
  pre { background: #f6f8fa; padding: 16px; margin: 0 0 16px; overflow: auto; font: 13.6px/1.45 monospace }
  img { max-width: 100% }"""


@pytest.mark.browser
def test_it_takes_two_screens(browser: Any, tmp_path: Path) -> None:
    body = markdown.markdown(TEXT, extensions=["tables", "fenced_code"])
    page = tmp_path / "readme.html"
    base = f'<base href="{ROOT.as_uri()}/">'
    page.write_text(f"<!DOCTYPE html><meta charset=utf-8>{base}<style>{STYLE}</style>{body}", encoding="utf-8")
    size = {"width": WIDTH, "height": 100, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(page.as_uri())
    broken = "return [...document.images].filter((e) => !e.complete || !e.naturalWidth).map((e) => e.src)"
    assert browser.execute_script(broken) == []
    assert browser.execute_script("return document.documentElement.scrollHeight") <= TWO_SCREENS


def test_its_links_lead_somewhere() -> None:
    named = re.findall(r'\]\(([^)\s]+)\)|src="([^"]+)"', TEXT)
    paths = [address or source for address, source in named]
    assert len(paths) > 10
    for path in paths:
        file, _, anchor = path.partition("#")
        assert (ROOT / file).is_file(), path
        headings = re.findall(r"^#+ (.*)$", (ROOT / file).read_text(encoding="utf-8"), re.M) if anchor else []
        assert not anchor or anchor in [heading.lower().replace(" ", "-") for heading in headings], path


def test_no_picture_is_taken_of_edited_sources_or_of_a_verdict_that_moved() -> None:
    good = recorded(Evidence(method="m", value=1.33))
    file = results_file(good)
    clean = replace(file, run=replace(file.run, commit="a" * 40, dirty=False))
    assert set(notes(clean).values()) == {"a" * 40, verdicts(clean)}
    for run in (replace(clean.run, dirty=True), replace(clean.run, commit="")):
        with pytest.raises(AuditError, match="not committed"):
            notes(replace(clean, run=run))
    moved = replace(clean, claims=(recorded(Evidence(method="m", value=1.4)),))
    with pytest.raises(AuditError, match=r"unexpected \(toy\.value\)"):
        notes(moved)
    assert verdicts(moved) != verdicts(clean)


def test_a_paper_is_told_by_headline_or_card_or_else_by_its_first_finding() -> None:
    file = results_file(recorded(Evidence(method="m", value=1.33)))

    def told(**more: Any) -> str:
        return results_block(replace(file, papers=(replace(paper_record(()), key="toy", **more),)))

    brief = replace(paper_record(()).brief, card="The [level](+value) agrees.", holds="", correct="", guess="")
    assert "holds) The level agrees." in told(brief=brief).replace("](docs/badges/toy.svg)", ")")
    assert "The level agrees." not in told(brief=replace(brief, headline="It is {value}"))
    assert "It is 1.33." in told(brief=replace(brief, headline="It is {value}"))
    found = told(brief=None, findings=("The level holds.", "More."))
    assert "The level holds." in found and "More." not in found
    assert "toy: 1 holds" in told(brief=None, findings=())


@pytest.mark.parametrize("text", ["", "<a>", "<b> <a>", "<a> <b> <a>", "<a> <b> <b>", "<a> <a> <b>"])
def test_a_part_is_replaced_between_markers_that_stand_there_once_in_their_order(text: str) -> None:
    assert replace_block("before <a> old <b> after", "new", "<a>", "<b>") == "before new after"
    with pytest.raises(AuditError, match="once each, in this order"):
        replace_block(text, "new", "<a>", "<b>")
