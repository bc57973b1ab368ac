"""The report in Chromium: it fits the window, makes no complaint, works without scripts and on paper."""

import base64
import itertools
import re
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from looking import claim_id, overlaps, resize, shown, unfold
from sample import HOSTILE, KEY, claims, hostile_results
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

from replication.audit.report.page import render

pytestmark = pytest.mark.browser

WIDTHS, TELEPHONE = (320, 390, 768, 1440), 390
PAPER = f"#paper-{KEY}"
CODE_LINES = """return [...document.querySelectorAll('.claim [data-code]')]
  .map((e) => getComputedStyle(e, '::after').content)"""


@pytest.mark.parametrize(("width", "scheme"), [*zip(WIDTHS, itertools.cycle(("light", "dark")))])
def test_at_each_width_it_fits_complains_of_nothing_and_is_read_and_scrolled(
    visit: Any, width: int, scheme: str
) -> None:
    page = unfold(visit(width, scheme))
    assert page.execute_script("return document.documentElement.scrollWidth") == width
    assert page.get_log("browser") == []
    assert len(shown(page)) == len(claims())
    stuck = """return [...document.querySelectorAll('body *')].filter((e) => getComputedStyle(e).overflowX === 'auto'
      && e.scrollWidth > e.clientWidth && e.tabIndex < 0 && !e.matches('.toc, .pages'))
      .map((e) => e.outerHTML.slice(0, 80))"""
    assert page.execute_script(stuck) == [], "what scrolls is reached by keyboard"
    boxes = """const boxes = [...document.querySelectorAll('.scroll')], more = (e) => e.scrollWidth - e.clientWidth;
      return [boxes.filter((e) => more(e) <= 0 && e.tabIndex >= 0), boxes.filter((e) => more(e) > 1)]"""
    idle, wide = page.execute_script(boxes)
    assert idle == [] and (wide or width > min(WIDTHS))
    for box in wide:  # the edge behind which there is more is shaded, and no longer when that edge is reached
        assert box.value_of_css_property("background-image").count("linear-gradient") == 4
        assert box.value_of_css_property("background-attachment") == "local, local, scroll, scroll"
    heights = """return [...document.querySelectorAll('math, mfrac')].map((e) =>
      [e.localName, e.getBoundingClientRect().height])"""
    set_in = page.execute_script(heights)
    assert all(height > 15 for _, height in set_in) and all(height > 30 for name, height in set_in if name == "mfrac")
    ink = page.execute_script("return getComputedStyle(document.querySelector('svg.figure text')).fill")
    assert (sum(map(int, re.findall(r"\d+", ink))) > 600) is (scheme == "dark"), "figures follow the scheme"
    others = """return document.querySelectorAll('[tabindex]:not([tabindex="0"]):not(.k)').length"""
    assert page.execute_script(others) == 0, "one stop for the whole picture"
    assert overlaps(page) == []
    page.execute_script("document.querySelector('.hero p').style.marginTop = '-3em'")
    assert overlaps(page), "and if a text lay over another, it would be found"
    if width <= TELEPHONE:
        sizes = """return [...document.querySelectorAll('svg.figure text')].map((e) =>
          parseFloat(getComputedStyle(e).fontSize) * Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b))"""
        scrolls = "return [...document.querySelectorAll('figure .scroll')].some((e) => e.scrollWidth > e.clientWidth)"
        assert min(page.execute_script(sizes)) >= 11 and not page.execute_script(scrolls)
        page.execute_script("document.querySelector('.figures').style.padding = '0 30px'")
        assert min(page.execute_script(sizes)) < 11 or width > min(WIDTHS), "and smaller text would be found"


def test_contents_and_pages_are_not_cut_and_each_page_begins_below_the_bar(visit: Any) -> None:
    page = visit(768, fragment="#behind")
    top, bar = page.execute_script("""return [document.querySelector('#behind').getBoundingClientRect().top,
      document.querySelector('.bar').getBoundingClientRect().bottom]""")
    assert top == pytest.approx(bar, abs=1)
    cut = """return [...document.querySelectorAll('.pages a, #behind .toc a')].filter((e) => {
      const box = e.getBoundingClientRect();
      return box.left < 0 || box.right > innerWidth || e.parentElement.scrollWidth > e.parentElement.clientWidth;
    }).map((e) => e.textContent)"""
    for width in (768, 390, 320):
        resize(page, width)
        assert page.execute_script(cut) == [], width
    page.execute_script("document.querySelector('.pages').append('a name that is too long '.repeat(9))")
    page.execute_script("document.querySelector('#behind .toc ol').style.flexWrap = 'nowrap'")
    assert page.execute_script(cut), "and if some were, they would be found"


def test_a_number_of_a_table_says_its_row_and_its_column(visit: Any) -> None:
    page = visit(fragment=PAPER)
    for width in (1440, 390):
        resize(page, width)
        cell = page.find_element(By.CSS_SELECTOR, f".published .cell:has([href='#{claim_id('column-5-7')}'])")
        said = cell.text.split()
        assert (said[:3] == ["Level", "Periods", "(5,7)"]) is (width == 390)
        assert {"1.93", "1.917120", "differs"} <= set(said) and "% below the print" in cell.text
        heads = page.find_elements(By.CSS_SELECTOR, ".published thead th")
        assert all(head.is_displayed() is (width == 1440) for head in heads)


@pytest.mark.parametrize("name", ["column-8-9", "zero"])
def test_a_link_opens_a_claim_without_a_script_and_it_shows_what_it_rests_on(visit: Any, name: str) -> None:
    page = visit(fragment=f"#{claim_id(name)}", scripts=False)
    # Asking needs scripts; those of the page did not run, as they were off when it was loaded.
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    seen = """return [...document.querySelectorAll('.claim .reason')].filter((e) => e.checkVisibility())
      .map((e) => e.closest('.claim').id)"""
    assert page.execute_script(seen) == [claim_id(name)]
    proved = ("Lower bound 2.635", "Upper bound 2.635", "Certificate: ") if name == "column-8-9" else ()
    rests_on = "return document.querySelector(arguments[0]).innerText"
    for word in ("Method: ", *proved, "Code: papers/"):
        assert word in page.execute_script(rests_on, f"[id='{claim_id(name)}'] .aside")
    drawn = visit(fragment=f"#{claim_id(name)}").find_element(By.ID, claim_id(name))
    WebDriverWait(drawn, 5).until(lambda _: "in all digits" in drawn.text)
    assert drawn.text.count("Certificate") == bool(proved), "all evidence takes its place"
    drawn.find_element(By.CSS_SELECTOR, "summary").click()
    assert not drawn.find_element(By.CSS_SELECTOR, ".evidence").is_displayed(), "and it closes again"


def test_everything_is_there_without_scripts(visit: Any) -> None:
    page = visit(scripts=False)
    assert len(page.find_elements(By.CSS_SELECTOR, ".claim")) == len(claims())
    assert all(view.is_displayed() for view in page.find_elements(By.CSS_SELECTOR, ".view"))
    assert not page.find_element(By.CSS_SELECTOR, ".find").is_displayed()
    for fold in page.find_elements(By.CSS_SELECTOR, ".more > summary"):
        fold.click()
    claim = page.find_element(By.ID, claim_id("zero"))
    reason = claim.find_element(By.CSS_SELECTOR, ".reason")
    assert not reason.is_displayed()
    claim.find_element(By.CSS_SELECTOR, "summary").click()
    assert reason.is_displayed() and reason.text
    assert page.find_element(By.CSS_SELECTOR, ".unscripted").is_displayed()
    page.find_element(By.CSS_SELECTOR, f".k[href='#{claim_id('far')}']").send_keys(Keys.ENTER)
    assert page.current_url.endswith(claim_id("far"))


@pytest.mark.parametrize("scripts", [True, False])
def test_prints_every_claim_in_a_line(visit: Any, scripts: bool) -> None:
    page = visit(scripts=scripts)
    pdf = base64.b64decode(page.print_page())
    assert pdf.startswith(b"%PDF")
    assert 3 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 12
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    # Asking needs scripts; those of the page did not run, as they were off when it was loaded.
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    visible = "return [...document.querySelectorAll('.claim > summary')].map((e) => e.checkVisibility())"
    assert page.execute_script(visible) == [True] * len(claims()), "folds open on paper"
    evidence = "return [...document.querySelectorAll('.evidence')].filter((e) => e.checkVisibility()).length"
    assert page.execute_script(evidence) == 0
    moves = "return [...document.querySelectorAll('.moves')].filter((e) => e.checkVisibility()).length"
    assert page.execute_script(moves) == 0, "paper cannot be moved or followed"
    assert set(page.execute_script(CODE_LINES)) == {'", claims.py:42"'}
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "screen"})
    assert set(page.execute_script(CODE_LINES)) == {"none"}, "on a screen it stands in the evidence"


def test_figures_have_words_with_numbers_and_can_be_saved(visit: Any) -> None:
    page = visit(fragment=PAPER)
    figures = page.find_elements(By.CSS_SELECTOR, "svg.figure")
    assert figures
    for figure in figures:
        assert re.search(r"\d", figure.get_attribute("aria-label") or "")
    # The browser would write a file; what it is given is caught instead.
    page.execute_script("""window.saved = [];
      URL.createObjectURL = (blob) => { saved.push(blob); return 'blob:none'; };
      HTMLAnchorElement.prototype.click = function () { saved.push(this.download); }""")
    page.find_element(By.CSS_SELECTOR, "[data-save]").click()
    text, name = page.execute_async_script(
        "const [blob, name] = saved; blob.text().then((t) => arguments[0]([t, name]))"
    )
    assert name == f"{KEY}-fig2.svg"
    drawing = ET.fromstring(text)
    assert drawing.tag.endswith("}svg")
    used = set(re.findall(r'class="(f[0-9a-f]{6})"', text))
    assert used and all(f".{rule}{{" in text for rule in used)


def test_counts_of_all_verdicts_fit_a_narrow_window(visit: Any) -> None:
    page = visit(320, fragment=PAPER)
    lines = page.find_elements(By.CSS_SELECTOR, ".bar-of + .tally li")
    timed = [one for one in claims() if one.claim.kind == "cited" and one.claim.unit == "s"]
    found = Counter(str(claim.verdict) for claim in claims() if claim not in timed)
    found["run time of another computer" if len(timed) == 1 else "run times of another computer"] = len(timed)
    told = {words: int(number) for number, words in (line.text.split(" ", 1) for line in lines)}
    assert told == {words: number for words, number in found.items() if number}
    assert all(line.rect["x"] + line.rect["width"] <= 320 for line in lines)


def test_hostile_strings_do_nothing_and_break_nothing(browser: Any, visit: Any, tmp_path: Path) -> None:
    made = hostile_results(tmp_path, " ".join(HOSTILE))
    (tmp_path / "index.html").write_text(render(made, tmp_path), encoding="utf-8")
    visit(max(WIDTHS))
    browser.get((tmp_path / "index.html").as_uri())
    unfold(browser)
    for width in (max(WIDTHS), min(WIDTHS)):
        resize(browser, width)
        assert browser.execute_script("return document.documentElement.scrollWidth") == width
    assert browser.get_log("browser") == []
    assert len(shown(browser)) == len(claims())
