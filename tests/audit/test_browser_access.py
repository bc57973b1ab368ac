"""The report for everyone: no violation of the accessibility rules, nothing cut off on paper, cues where it scrolls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from axe_core import violations
from looking import unfold
from sample import results
from selenium.webdriver.common.by import By

from replication.audit.report.page import render

pytestmark = pytest.mark.browser

WIDTHS = (320, 768, 1440)
PAPER = {"width": 190, "height": 277}
"""A4 without margins of 10 mm."""
PIXELS_PER_MM = 96 / 25.4


@pytest.mark.parametrize("width", [min(WIDTHS), max(WIDTHS)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_violation(visit: Any, width: int, scheme: str) -> None:
    page = unfold(visit(width, scheme))
    assert violations(page) == []


@pytest.mark.parametrize("width", [min(WIDTHS), max(WIDTHS)])
def test_each_page_of_the_report_is_well_formed_alone(visit: Any, width: int) -> None:
    browser = visit(width)
    pages = [view.get_attribute("id") for view in browser.find_elements(By.CSS_SELECTOR, ".view")]
    assert len(pages) > 2
    assert {name: found for name in pages if (found := violations(visit(width, fragment=f"#{name}")))} == {}


def test_axe_finds_no_violation_where_two_papers_have_the_same_parts(browser: Any, tmp_path: Path) -> None:
    made = results(tmp_path)
    other = msgspec.structs.replace(
        made.papers[0], key="roe2001", title="Another Paper", tables=(), scope=(), brief=None
    )
    page = tmp_path / "index.html"
    page.write_text(render(msgspec.structs.replace(made, papers=(*made.papers, other)), tmp_path), encoding="utf-8")
    browser.get(page.as_uri())
    assert len(browser.find_elements(By.CSS_SELECTOR, "[id='paper-roe2001.findings']")) == 1
    assert violations(browser) == []


def test_axe_would_find_a_violation(visit: Any) -> None:
    page = unfold(visit())
    page.execute_script("document.querySelector('svg.figure').removeAttribute('aria-label')")
    assert [rule for rule, _ in violations(page, "main figure")] == ["svg-img-alt"]


def test_faint_text_is_found_also_where_axe_cannot_decide(visit: Any) -> None:
    page = unfold(visit())
    page.execute_script("""const cell = document.querySelector('.scroll td');
      cell.style.color = '#aaa'; cell.textContent = 'faint';""")
    assert "contrast" in {rule for rule, _ in violations(page)}


@pytest.mark.parametrize("width", WIDTHS)
def test_what_scrolls_shows_that_there_is_more(visit: Any, width: int) -> None:
    """The edge behind which there is more is shaded, and no longer when that edge is reached."""
    page = unfold(visit(width))
    wide = [
        box
        for box in page.find_elements(By.CSS_SELECTOR, ".scroll")
        if page.execute_script("return arguments[0].scrollWidth > arguments[0].clientWidth + 1", box)
    ]
    assert wide or width > min(WIDTHS)
    for box in wide:
        assert box.value_of_css_property("background-image").count("linear-gradient") == 4
        assert box.value_of_css_property("background-attachment") == "local, local, scroll, scroll"


def print_layout(visit: Any, scripts: bool) -> Any:
    """The page in the layout of print, as wide as A4 between its margins, with scripts on to measure it."""
    page = visit(scripts=scripts)
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    size = {"width": int(PAPER["width"] * PIXELS_PER_MM), "height": 900, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    page.execute_script("dispatchEvent(new Event('beforeprint'))")
    return page


@pytest.mark.parametrize("scripts", [True, False])
def test_no_table_or_figure_is_cut_on_paper(visit: Any, scripts: bool) -> None:
    page = print_layout(visit, scripts)
    beyond = """const edge = document.documentElement.clientWidth;
      return [...document.querySelectorAll('main *')].filter((e) => e.checkVisibility() && !e.closest('.unseen')
        && e.getBoundingClientRect().right > edge + 1).map((e) => e.outerHTML.slice(0, 120))"""
    assert page.execute_script(beyond) == []
    clipped = """return [...document.querySelectorAll('main *')].filter((e) => e.checkVisibility()
      && !e.closest('.unseen, svg, math') && e.scrollWidth > e.clientWidth + 1 && e.clientWidth
      && getComputedStyle(e).overflowX !== 'visible').map((e) => e.outerHTML.slice(0, 120))"""
    assert page.execute_script(clipped) == []


def test_rows_and_figures_are_not_split_between_pages(visit: Any) -> None:
    """Whatever is kept in one piece fits a page, so that the browser can keep it."""
    page = print_layout(visit, scripts=True)
    kept = "tr, figure, .erratum, .claim > summary, .lane, .card"
    pieces = """return [...document.querySelectorAll(arguments[0])].filter((e) => e.checkVisibility()).map((e) =>
      [getComputedStyle(e).breakInside, e.getBoundingClientRect().height, e.outerHTML.slice(0, 120)])"""
    found = page.execute_script(pieces, kept)
    assert len(found) > 40
    assert [text for kept, _, text in found if kept != "avoid"] == []
    assert [text for _, height, text in found if height > PAPER["height"] * PIXELS_PER_MM] == []


def test_the_head_of_a_table_stands_on_each_of_its_pages(visit: Any) -> None:
    page = print_layout(visit, scripts=True)
    heads = """return [...document.querySelectorAll('main thead')].map((e) => getComputedStyle(e).display)"""
    assert set(page.execute_script(heads)) == {"table-header-group"}


def test_the_opening_takes_two_sheets_and_lists_the_contents(visit: Any) -> None:
    page = print_layout(visit, scripts=True)
    height = "return document.getElementById('answer').getBoundingClientRect().height"
    assert page.execute_script(height) < 2 * PAPER["height"] * PIXELS_PER_MM
    contents = page.find_element(By.CSS_SELECTOR, "nav.contents")
    assert contents.is_displayed() and "All claims" in contents.text
    led = """return [...document.querySelectorAll(arguments[0])].filter((e) => e.hash)
      .map((e) => document.getElementById(e.hash.slice(1)).checkVisibility())"""
    assert set(page.execute_script(led, "nav.contents a")) == {True}
    assert set(page.execute_script(led, ".toc a")) == {True, False}, "a screen shows more"
    assert not page.find_element(By.CSS_SELECTOR, "header.bar").is_displayed()
