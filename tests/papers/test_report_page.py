"""The report of a fresh run in Chromium: what it weighs, how it prints, and whether all of it can be read."""

import gzip
import re
from pathlib import Path

import computed
import pytest
from looking import overlaps, pages_of, resize, unfold
from selenium import webdriver

from replication.audit.report.page import build_articles, build_report
from replication.audit.run.runner import Outcome

pytestmark = [pytest.mark.slow, pytest.mark.browser]

LARGEST, LARGEST_SCREEN = 1_900_000, 120_000
"""Bytes of the page, and compressed those of what its first screen needs."""
MOST_SHEETS, MOST_SHEETS_OF_OPENING = 34, 2
MOST_SHEETS_OF_ARTICLE = 8
MOST_STOPS = 150
WIDTHS = (320, 390, 768, 1440)


@pytest.fixture(scope="module")
def page(fresh_run: Outcome, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("report") / "index.html"
    return build_report(fresh_run.results, computed.ROOT / "figures", output, computed.ROOT)


def opened(browser: webdriver.Chrome, page: Path, width: int = 1440) -> webdriver.Chrome:
    resize(browser, width)
    browser.get("about:blank")
    browser.get(page.as_uri())
    return browser


def test_it_is_light(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) <= LARGEST
    papers = text.index('<section class="view" id="paper-'), text.index("</main>")
    packed = re.search(r'<script type="text/plain" id="evidence">.*?</script>', text, flags=re.S)
    assert packed is not None
    first = (text[: papers[0]] + text[papers[1] :]).replace(packed[0], "")
    assert len(gzip.compress(first.encode())) <= LARGEST_SCREEN


def test_it_prints_on_few_sheets_and_its_opening_on_two(browser: webdriver.Chrome, page: Path) -> None:
    opened(browser, page)
    sheets = pages_of(browser)
    assert sheets <= MOST_SHEETS
    browser.execute_script("document.querySelectorAll('main > :not(#answer), footer').forEach((e) => e.remove())")
    assert pages_of(browser) <= min(MOST_SHEETS_OF_OPENING, sheets - 1)


def test_no_text_lies_over_another_whatever_is_chosen_and_every_index_is_set(
    browser: webdriver.Chrome, page: Path
) -> None:
    unfold(opened(browser, page))
    choose = """const [place] = arguments; return [...document.querySelectorAll('.choices')].map((group) => {
      const field = group.querySelectorAll(':scope > .choice > input')[place];
      if (field) field.checked = true;
      return Boolean(field); }).some(Boolean)"""
    for width in WIDTHS:
        resize(browser, width)
        place = 0
        while browser.execute_script(choose, place):
            assert overlaps(browser) == [], (width, place)
            assert browser.execute_script("return document.documentElement.scrollWidth") == width
            place += 1
        assert place > 1
    raw = r"""const found = [];
      const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
      while (walk.nextNode()) {
        const { data, parentElement } = walk.currentNode;
        if (parentElement.closest('code, pre, script, style')) continue;
        found.push(...data.match(/\S*\p{L}\p{M}*[_^]\S*/gu) ?? []);
      }
      return found"""
    assert browser.execute_script(raw) == []


def test_the_last_paper_is_few_stops_away(browser: webdriver.Chrome, page: Path) -> None:
    opened(browser, page)
    stops = """const links = [...document.querySelectorAll('a[href], button, input, summary, [tabindex]')]
        .filter((e) => e.tabIndex >= 0 && e.checkVisibility());
      const last = [...document.querySelectorAll('[id^=paper-].view')].at(-1);
      return [links.length, links.findIndex((e) => e.hash === `#${last.id}`)]"""
    total, before = browser.execute_script(stops)
    assert 0 <= before < total < MOST_STOPS


def test_each_entry_of_a_table_that_differs_says_by_how_much(browser: webdriver.Chrome, page: Path) -> None:
    """In the table, in the line of the claim and where the picture is pointed at: the same words."""
    opened(browser, page)
    said = """return [...document.querySelectorAll('.published .cell[data-v=differs] small')].map((small) => {
      const hash = small.closest('a').hash;
      const claim = document.getElementById(hash.slice(1));
      const mark = [...document.querySelectorAll('.k')].find((e) => e.hash === hash);
      const said = small.textContent;
      return [said, claim.querySelector('.ov small').textContent, mark?.dataset.f ?? said]; })"""
    found = browser.execute_script(said)
    assert found and all(len(set(words)) == 1 for words in found)


def test_each_article_is_short_on_paper(browser: webdriver.Chrome, fresh_run: Outcome, tmp_path: Path) -> None:
    for page in sorted(build_articles(fresh_run.results, computed.ROOT / "figures", tmp_path / "a").glob("*.html")):
        browser.get(page.as_uri())
        assert pages_of(browser) <= MOST_SHEETS_OF_ARTICLE, page.name
        assert not overlaps(browser), page.name
