"""The claims of the report in Chromium: sorted, filtered, linked and opened, by mouse and by keyboard alone."""

from __future__ import annotations

from typing import Any

import pytest
from looking import claim_id, shown
from sample import KEY, claims
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from replication.audit.model import Verdict
from replication.audit.report.claim import anchor, targets, views

pytestmark = pytest.mark.browser

PLACE = f"#paper-{KEY}.claims"


def test_evidence_opens_by_keyboard(visit: Any) -> None:
    page = visit()
    summary = page.find_element(By.CSS_SELECTOR, "tbody.claim summary")
    summary.send_keys(" ")
    assert page.find_element(By.CSS_SELECTOR, "tbody.claim .evidence").is_displayed()


def test_filter_and_its_address(visit: Any) -> None:
    differing = {anchor("claim", c.id) for c in claims() if c.verdict is Verdict.DIFFERS}
    page = visit()
    page.find_element(By.CSS_SELECTOR, ".filter option[value=differs]").click()
    assert set(shown(page)) == differing
    assert page.current_url.endswith(f"#paper-{KEY}.claims?verdict=differs")
    page.find_element(By.NAME, "search").send_keys("shorter period")
    assert shown(page) == [claim_id("shorter-is-better")]
    page = visit(fragment=f"#paper-{KEY}.claims?verdict=differs&search=shorter+period")
    assert shown(page) == [claim_id("shorter-is-better")]
    page.find_element(By.CSS_SELECTOR, ".filter button").click()
    assert len(shown(page)) == len(claims())
    assert page.current_url.endswith(f"#paper-{KEY}.claims")


def test_permalink_opens_its_claim_even_if_it_is_filtered_out(visit: Any) -> None:
    page = visit(fragment=f"#{claim_id('zero')}")
    evidence = page.find_element(By.CSS_SELECTOR, f"[id='{claim_id('zero')}'] .evidence")
    assert evidence.is_displayed()
    page = visit(fragment="#?verdict=differs")
    page.execute_script("location.hash = arguments[0]", claim_id("zero"))
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert page.find_element(By.ID, claim_id("zero")).is_displayed()


def ids(records: Any) -> list[str]:
    return [anchor("claim", record.id) for record in records]


def sort_buttons(page: Any) -> dict[str, Any]:
    return {b.text: b for b in page.find_elements(By.CSS_SELECTOR, ".claims thead button")}


def sorted_by(page: Any) -> list[tuple[str, str]]:
    return [
        (header.get_attribute("data-sort"), header.get_attribute("aria-sort"))
        for header in page.find_elements(By.CSS_SELECTOR, ".claims th[aria-sort]")
    ]


def test_sorts_by_any_of_four_columns_in_both_directions(visit: Any) -> None:
    worst = [view.record for view in views(claims(), targets(claims()))]
    known = [record for record in worst if record.judgement.deviation_ulp is not None]
    unknown = [record for record in worst if record.judgement.deviation_ulp is None]
    size = {record.id: abs(record.judgement.deviation_ulp or 0) for record in known}
    orders = {
        ("place", "ascending"): list(claims()),
        ("place", "descending"): list(claims())[::-1],
        ("deviation", "descending"): sorted(known, key=lambda record: -size[record.id]) + unknown,
        ("deviation", "ascending"): sorted(known, key=lambda record: size[record.id]) + unknown,
        ("verdict", "ascending"): worst,
        ("verdict", "descending"): worst[::-1],
    }
    page = visit()
    assert (shown(page), sorted_by(page)) == (ids(worst), [("verdict", "ascending")])
    buttons = sort_buttons(page)
    assert list(buttons) == ["Verdict", "Place", "Deviation", "Seconds"]
    for (column, direction), records in orders.items():
        buttons[column.capitalize()].click()
        assert shown(page) == ids(records), (column, direction)
        assert sorted_by(page) == [(column, direction)]
        assert page.current_url.endswith(f"{PLACE}?sort={column}&order={direction}")


def test_the_address_keeps_sorting_and_filter_together(visit: Any) -> None:
    page = visit(fragment=f"{PLACE}?kind=value&sort=place&order=descending")
    wanted = ids(record for record in claims()[::-1] if record.claim.kind == "value")
    assert shown(page) == wanted
    found = page.find_element(By.CSS_SELECTOR, ".found").text
    assert found == f"{len(wanted)} of {len(claims())} claims, from the end of the paper"
    page.find_element(By.CSS_SELECTOR, ".filter [name=proved]").click()
    assert shown(page) == ids(
        record for record in claims()[::-1] if record.claim.kind == "value" and record.judgement.proved
    )
    assert page.current_url.endswith(f"{PLACE}?kind=value&proved=yes&sort=place&order=descending")


@pytest.mark.parametrize("query", ["sort=price&order=up", "sort=constructor", "verdict=&kind=none", "%%%=&search=%"])
def test_an_address_that_means_nothing_does_no_harm(visit: Any, query: str) -> None:
    page = visit(fragment=f"{PLACE}?{query}")
    assert page.get_log("browser") == []
    page.find_element(By.CSS_SELECTOR, ".filter button").click()
    assert shown(page) == ids(view.record for view in views(claims(), targets(claims())))


def test_a_count_of_the_summary_leads_to_its_claims(visit: Any) -> None:
    page = visit()
    page.find_element(By.CSS_SELECTOR, ".counts td[data-label=differs] a").click()
    assert set(shown(page)) == set(ids(c for c in claims() if c.verdict is Verdict.DIFFERS))
    visit().find_element(By.CSS_SELECTOR, ".counts td[data-label='of them proved'] a").click()
    assert set(shown(page)) == set(ids(c for c in claims() if c.judgement.proved))


def test_says_so_when_no_claim_fits(visit: Any) -> None:
    page = visit(fragment=f"{PLACE}?search=there+is+no+such+word")
    assert shown(page) == []
    assert page.find_element(By.CSS_SELECTOR, ".none").is_displayed()


def test_everything_is_done_with_the_keyboard_alone(visit: Any) -> None:
    """Skip link, filter, sort and evidence, reached in the order of the page by Tab and worked by Enter and Space."""
    page = visit()

    def press(*keys: str) -> Any:
        ActionChains(page).send_keys(*keys).perform()
        return page.switch_to.active_element

    def tab_to(selector: str) -> Any:
        for _ in range(200):
            focused = press(Keys.TAB)
            outline = focused.value_of_css_property("outline-style")
            assert outline != "none", focused.get_attribute("outerHTML")[:80]
            if page.execute_script("return arguments[0].matches(arguments[1])", focused, selector):
                return focused
        raise AssertionError(f"Tab does not come to {selector}")

    assert press(Keys.TAB).get_attribute("class") == "skip"
    press(Keys.ENTER)
    assert page.current_url.endswith("#main")
    tab_to(".filter select[name=verdict]")
    press("d")
    assert set(shown(page)) == set(ids(c for c in claims() if c.verdict is Verdict.DIFFERS))
    tab_to(".filter [name=search]")
    press("shorter period")
    assert shown(page) == [claim_id("shorter-is-better")]
    tab_to(".filter button")
    press(Keys.SPACE)
    assert len(shown(page)) == len(claims())
    tab_to("th[data-sort=place] button")
    press(Keys.ENTER)
    assert shown(page) == ids(claims())
    press(Keys.SPACE)
    assert shown(page) == ids(claims()[::-1])
    evidence = tab_to("tbody.claim summary").find_element(By.XPATH, "..")
    press(Keys.ENTER)
    assert evidence.get_attribute("open") is not None
    focused = tab_to("tbody.claim .evidence a")
    assert evidence.find_elements(By.CSS_SELECTOR, ".evidence a")[0] == focused


def test_tab_follows_the_page(visit: Any) -> None:
    """No element jumps the queue, and what is sorted is reached in the order in which it is seen."""
    page = visit(fragment=f"{PLACE}?sort=place&order=descending")
    positive = "return document.querySelectorAll('[tabindex]:not([tabindex=\"0\"])').length"
    assert page.execute_script(positive) == 0
    tops = "return [...document.querySelectorAll('tbody.claim summary')].map((e) => e.getBoundingClientRect().top)"
    seen = page.execute_script(tops)
    assert seen == sorted(seen)
