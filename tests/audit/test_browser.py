"""The report in Chromium: it fits the window, makes no complaint, works without scripts and on paper."""

from __future__ import annotations

import base64
import re
from collections import Counter
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import pytest
from looking import claim_id, shown
from sample import HOSTILE, KEY, claims, hostile_results
from selenium.webdriver.common.by import By

from replication.audit.model import Verdict
from replication.audit.report.page import render

pytestmark = pytest.mark.browser

WIDTHS = (320, 768, 1440)
SMALLEST_CONTRAST = 4.5


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_fits_the_window_without_complaint(visit: Any, width: int, scheme: str) -> None:
    page = visit(width, scheme)
    page.execute_script("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert page.execute_script("return document.documentElement.scrollWidth") == width
    assert page.get_log("browser") == []
    assert len(shown(page)) == len(claims())


@pytest.mark.parametrize("width", WIDTHS)
def test_what_scrolls_can_be_reached_by_keyboard(visit: Any, width: int) -> None:
    page = visit(width)
    page.execute_script("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    stuck = """return [...document.querySelectorAll('body *')].filter((e) => getComputedStyle(e).overflowX === 'auto'
      && e.scrollWidth > e.clientWidth && e.tabIndex < 0).map((e) => e.outerHTML.slice(0, 80))"""
    assert page.execute_script(stuck) == []
    idle = """return [...document.querySelectorAll('.scroll')].filter((e) => e.scrollWidth <= e.clientWidth
      && e.tabIndex >= 0).length"""
    assert page.execute_script(idle) == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast(visit: Any, scheme: str) -> None:
    """Contrast of each text colour with the paper and the raised paper, WCAG 2 level AA."""
    page = visit(scheme=scheme)
    colours = page.execute_script("""
      const style = (e) => getComputedStyle(e);
      const texts = [...document.querySelectorAll('body *')].filter((e) => e.checkVisibility()
        && [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim()));
      const raised = style(document.querySelector('.raised')).backgroundColor;
      return [[style(document.body).backgroundColor, raised], [...new Set(texts.map((e) => style(e).color))]];""")
    papers, inks = ([tuple(map(int, re.findall(r"\d+", colour)[:3])) for colour in group] for group in colours)
    assert len(inks) > len(Verdict)
    for paper in papers:
        for ink in inks:
            assert contrast(ink, paper) >= SMALLEST_CONTRAST, (ink, paper)


def contrast(one: tuple[int, ...], other: tuple[int, ...]) -> float:
    low, high = sorted(luminance(colour) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def luminance(colour: tuple[int, ...]) -> float:
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (part / 255 for part in colour)]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_dark_is_dark_and_figures_follow(visit: Any) -> None:
    ink = "return getComputedStyle(document.querySelector('svg.figure text')).fill"
    light, dark = (visit(scheme=scheme).execute_script(ink) for scheme in ("light", "dark"))
    assert sum(map(int, re.findall(r"\d+", dark))) > 600 > sum(map(int, re.findall(r"\d+", light)))


def test_mathml_is_set(visit: Any) -> None:
    heights = "return [...document.querySelectorAll('math')].map((e) => e.getBoundingClientRect().height)"
    page = visit()
    assert all(height > 15 for height in page.execute_script(heights))
    fraction = "const f = document.querySelector('mfrac'); return f.getBoundingClientRect().height"
    assert page.execute_script(fraction) > 30


def test_everything_is_there_without_scripts(visit: Any) -> None:
    page = visit(scripts=False)
    assert len(shown(page)) == len(claims())
    assert not page.find_element(By.CSS_SELECTOR, "form.filter").is_displayed()
    assert not page.find_elements(By.CSS_SELECTOR, ".claims button")
    first = page.find_element(By.CSS_SELECTOR, "tbody.claim summary")
    evidence = page.find_element(By.CSS_SELECTOR, "tbody.claim .evidence")
    assert not evidence.is_displayed()
    first.click()
    assert evidence.is_displayed()


@pytest.mark.parametrize("scripts", [True, False])
def test_prints_with_all_evidence(visit: Any, scripts: bool, tmp_path: Path) -> None:
    page = visit(scripts=scripts)
    pdf = base64.b64decode(page.print_page())
    assert pdf.startswith(b"%PDF")
    pages = len(re.findall(rb"/Type\s*/Page\b", pdf))
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    # Asking needs scripts; those of the page did not run, as they were off when it was loaded.
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    visible = "return [...document.querySelectorAll('.evidence')].map((e) => e.checkVisibility())"
    assert page.execute_script(visible) == [True] * len(claims()), "closed details open on paper"
    assert pages > 3


def test_figures_have_words_with_numbers_and_data_to_download(visit: Any, address: str) -> None:
    page = visit()
    figures = page.find_elements(By.CSS_SELECTOR, "svg.figure")
    assert figures
    for figure in figures:
        assert re.search(r"\d", figure.get_attribute("aria-label") or "")
    links = page.find_elements(By.CSS_SELECTOR, "a[download]")
    assert len(links) == 2 * len(figures)
    for link in links:
        name, data = link.get_attribute("download"), link.get_attribute("href")
        written = Path(unquote(urlparse(address).path)).parent / "figures" / name
        assert unquote(data.partition(",")[2]) == written.read_text(encoding="utf-8")


def test_counts_of_all_verdicts_fit_a_narrow_window(visit: Any) -> None:
    page = visit(320)
    edges = (
        "return [...document.querySelectorAll('.counts td')].filter((e) => e.checkVisibility())"
        ".map((e) => [e.dataset.label, e.textContent, e.getBoundingClientRect().right])"
    )
    shown_counts = page.execute_script(edges)
    found = Counter(str(claim.verdict) for claim in claims())
    assert {label: int(number) for label, number, _ in shown_counts} == {
        **found,
        "all": len(claims()),
        "of them proved": sum(claim.judgement.proved for claim in claims()),
    }
    assert all(right <= 320 for _, _, right in shown_counts)


@pytest.mark.parametrize("width", [320, 1440])
def test_hostile_strings_do_nothing_and_break_nothing(browser: Any, visit: Any, tmp_path: Path, width: int) -> None:
    made = hostile_results(tmp_path, " ".join(HOSTILE))
    (tmp_path / "index.html").write_text(render(made, tmp_path), encoding="utf-8")
    visit(width)
    browser.get((tmp_path / "index.html").as_uri())
    browser.execute_script("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert browser.execute_script("return document.documentElement.scrollWidth") == width
    assert browser.get_log("browser") == []
    assert len(shown(browser)) == len(claims())


def test_a_printed_number_is_found_with_two_clicks(visit: Any) -> None:
    page = visit()
    page.find_element(By.CSS_SELECTOR, f".contents a[href='#paper-{KEY}.claims']").click()
    row = page.find_element(By.ID, claim_id("column-5-7"))
    assert row.find_element(By.CSS_SELECTOR, ".print").text.split() == ["printed", "1.93"]
    matrix = page.find_element(By.ID, claim_id("gains"))
    assert not matrix.find_element(By.CSS_SELECTOR, ".entries").is_displayed()
    matrix.find_element(By.CSS_SELECTOR, "summary").click()
    assert matrix.find_element(By.CSS_SELECTOR, ".entries").is_displayed()
