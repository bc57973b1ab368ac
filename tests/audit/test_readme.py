"""The README as a landing page, and the page of the benchmarks, which compares two runs by their ratios."""

import json
import re
from pathlib import Path
from typing import Any

import markdown
import pytest
from cases import recorded, results_file
from msgspec.structs import replace
from sample import paper_record

from benchmarks.readme import notes, replace_block, results_block, verdicts
from benchmarks.table import NOTABLE, changes, costs, document, main
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


PAGE = Path(__file__).parents[2] / "benchmarks" / "results.md"


def entry(seconds: float, name: str = "test_it", group: str | None = None, **info: object) -> dict[str, object]:
    stats = {"median": seconds, "rounds": 1}
    return {"name": name, "fullname": f"bench_x.py::{name}", "group": group, "stats": stats, "extra_info": info}


def run_of(ours: float = 1.0, machine: float = 1.0, **notes: float) -> dict[str, object]:
    """Ours beside a peer that takes two seconds, on a machine so many times slower."""
    designs = [entry(machine * 2.0, group="Designs", row="n = 3", column="peer")]
    designs += [entry(machine * ours, group="Designs", row="n = 3", column="ours")]
    run = {"python_version": "3", "machine": "m", "cpu": {}}
    return {"machine_info": run, "benchmarks": [*designs, entry(machine * ours, **notes)]}


def page(ours: float = 1.0, machine: float = 1.0, **notes: float) -> str:
    """The page of a run."""
    return document(run_of(ours, machine, **notes))


def test_each_ratio_is_ours_over_that_of_a_peer() -> None:
    assert costs(page(times_slower=4.0, of_dlqe=3.0, starts=5.0, gap=0.5)) == {
        "Designs, n = 3: peer": 0.5,
        "X, it: times slower": 0.25,
        "X, it: of dlqe": 3.0,
        "X, it: starts": 5.0,
    }


MORE = NOTABLE * 1.01


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        *((page(of_dlqe=2.0), page(machine=machine, of_dlqe=2.0), "") for machine in (0.1, 10.0)),
        (page(), page(ours=MORE), "times the peer before"),
        (page(of_dlqe=2.0), page(of_dlqe=2.0 * MORE), "times the peer before"),
        (page(times_slower=9.0), page(times_slower=9.0 / MORE), "times the peer before"),
        (page(of_dlqe=2.0), page(), "X, it: of dlqe: not measured any more"),
        (page(), page(of_dlqe=2.0), "X, it: of dlqe: new"),
    ],
)
def test_what_got_slower_is_told_and_what_got_faster_and_another_machine_are_not(
    before: str, after: str, told: str
) -> None:
    found = changes(costs(before), costs(after))
    assert bool(found) is bool(told) and all(told in text for text in found)
    assert "times" not in told or changes(costs(after), costs(before)) == []


def test_the_committed_page_is_read() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(costs(text)) >= text.count("(×") - text.count("(×1)") - 2
    slow = re.sub(r"times faster(.*?) [\d.]+", r"times faster\1 0.001", text, count=1)
    assert ["times the peer before" in told for told in changes(costs(text), costs(slow))] == [True]


@pytest.mark.parametrize(("slower", "told"), [(1.0, "0 changes in 2 ratios"), (2.0, "times the peer before")])
def test_the_page_is_written_and_the_changes_are_told(
    slower: float, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, old, new = (tmp_path / name for name in ("run.json", "old.md", "new.md"))
    run.write_text(json.dumps(run_of(ours=slower, of_dlqe=slower)), encoding="utf-8")
    old.write_text(page(of_dlqe=1.0), encoding="utf-8")
    assert main(str(run), str(old), str(new)) == int(slower > 1)
    assert told in capsys.readouterr().out and new.read_text(encoding="utf-8") == page(slower, of_dlqe=slower)
