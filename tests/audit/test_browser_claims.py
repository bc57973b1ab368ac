"""The claims of the report in Chromium: pointed at, arranged, found and opened, by mouse and by keyboard alone."""

from typing import Any

import pytest
from looking import claim_id, resize, shown
from sample import KEY, claims
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

from replication.audit.model import Verdict
from replication.audit.report.claim import anchor, targets, views

pytestmark = pytest.mark.browser

PAPER = f"#paper-{KEY}"


def drawn(page: Any, name: str) -> Any:
    """The evidence of a claim once it is drawn."""
    place = page.find_element(By.CSS_SELECTOR, f"[id='{claim_id(name)}'] > .evidence")
    WebDriverWait(page, 5).until(lambda _: place.get_attribute("data-drawn"))
    return place


def press(page: Any, *keys: str) -> Any:
    ActionChains(page).send_keys(*keys).perform()
    return page.switch_to.active_element


def test_a_permalink_opens_its_page_its_fold_and_its_evidence(visit: Any) -> None:
    page = visit(fragment=f"#{claim_id('zero')}")
    assert drawn(page, "zero").is_displayed()
    assert not page.find_element(By.ID, "answer").is_displayed()
    page = visit()
    page.execute_script("location.hash = arguments[0]", claim_id("zero"))
    assert drawn(page, "zero").is_displayed()


@pytest.mark.parametrize("fragment", ["#none", "#%%%", "#?verdict=differs", "#"])
def test_an_address_that_means_nothing_shows_the_answer(visit: Any, fragment: str) -> None:
    page = visit(fragment=fragment)
    assert page.get_log("browser") == []
    assert page.find_element(By.ID, "answer").is_displayed()


def test_what_does_not_stand_comes_first_and_what_holds_is_folded(visit: Any) -> None:
    page = visit(fragment=PAPER)
    folded = {view.record.id for view in views(claims(), targets(claims())) if view.settled}
    seen = shown(page)
    assert set(seen) == {anchor("claim", record.id) for record in claims() if record.id not in folded}
    assert claim_id("column-5-7") in seen and claim_id("far") in seen and claim_id("zero") not in seen
    for fold in page.find_elements(By.CSS_SELECTOR, ".more > summary"):
        fold.click()
    assert len(shown(page)) == len(claims())


def test_each_mark_reads_out_its_claim_and_arrows_move(visit: Any) -> None:
    page = visit()
    marks = page.find_elements(By.CSS_SELECTOR, ".k")
    assert len(marks) == len(claims())
    assert [mark for mark in marks if mark.get_attribute("tabindex") == "0"] == marks[:1]
    column = page.find_element(By.CSS_SELECTOR, f".k[href='#{claim_id('column-5-7')}']")
    ActionChains(page).move_to_element(column).perform()
    said = page.find_element(By.CSS_SELECTOR, ".read").text
    for part in (
        "differs",
        "Guaranteed level",
        "Table 1, column-5-7",
        "1.93",
        "1.917120",
        f"{KEY}.column-5-7",
        "0.67 % below the print",
    ):
        assert part in said, part
    page.execute_script("arguments[0].focus()", marks[0])
    assert press(page, Keys.ARROW_RIGHT) == marks[1]
    assert press(page, Keys.END) == marks[-1]
    assert press(page, Keys.HOME) == marks[0]
    assert press(page, Keys.ARROW_DOWN) != marks[0]
    press(page, Keys.HOME, Keys.ENTER)
    assert page.current_url.endswith(marks[0].get_attribute("href").partition("#")[2])


def test_a_verdict_is_singled_out_and_nothing_is_removed(visit: Any) -> None:
    page = visit()
    page.find_element(By.CSS_SELECTOR, ".legend [data-v=differs]").click()
    faint = "return [...document.querySelectorAll('.k')].filter((e) => getComputedStyle(e).opacity < 0.5).length"
    differing = sum(record.verdict is Verdict.DIFFERS for record in claims())
    assert page.execute_script(faint) == len(claims()) - differing
    page.find_element(By.CSS_SELECTOR, ".legend [data-v=differs]").click()
    assert page.execute_script(faint) == 0
    for chip in page.find_elements(By.CSS_SELECTOR, ".legend button"):
        page.execute_script("arguments[0].click()", chip)
        assert page.find_element(By.CSS_SELECTOR, ".read .verdict").text in chip.text, "a claim of its own beside it"


def test_marks_are_arranged_by_distance(visit: Any) -> None:
    """Farther from the print is farther right; what rounds to the print lies left of the line, the rest right of it."""
    page = visit()
    place = """const cells = getComputedStyle(document.querySelector('.cells'));
      const half = parseFloat(cells.getPropertyValue('--half'));
      return [...document.querySelectorAll('.k[data-d]')].map((e) =>
        [Math.abs(e.dataset.d), parseFloat(e.style.left) - half])"""
    for width in (1440, 390):
        resize(page, width)
        page.find_element(By.CSS_SELECTOR, "[data-by=distance]").click()
        placed = sorted(page.execute_script(place))
        assert len(placed) > 10
        assert [x for _, x in placed] == sorted(x for _, x in placed)
        assert all((x < 0) == (units <= 0.5) for units, x in placed)
        assert page.execute_script("return document.documentElement.scrollWidth") == width
        page.find_element(By.CSS_SELECTOR, "[data-by=stake]").click()
        assert not page.find_elements(By.CSS_SELECTOR, ".k[style*=left]")


NAMES = {
    "differs": {"differs"},
    "false": {"refuted"},
    "fails": {"differs", "refuted"},
    "undecided": {"undetermined"},
    "reproduced after erratum": {"reproduced-after-erratum"},
}
"""What may be searched for, and the verdicts that are meant."""


def asked(page: Any, query: str) -> list[Any]:
    """What the search finds."""
    field = page.find_element(By.NAME, "find")
    field.clear()
    field.send_keys(query)
    return page.find_elements(By.CSS_SELECTOR, "#hits a")  # type: ignore[no-any-return]


def test_search_finds_place_name_and_words(visit: Any) -> None:
    page = visit()
    cited = page.find_element(By.CSS_SELECTOR, "[data-cited]").get_attribute("data-cited")
    wanted = {"table 1, column-4-5": "column-4-5", "column-4-5": "column-4-5", f"{KEY}.zero": "zero"}
    for query, first in (wanted | {"shorter": "shorter-is-better"}).items():
        hits = asked(page, query)
        assert hits[0].get_attribute("href").endswith(claim_id(first))
        assert cited and all(cited in hit.text.splitlines()[-1] for hit in hits)
        press(page, Keys.ENTER)
        assert drawn(page, first).is_displayed()
        assert not page.find_element(By.CSS_SELECTOR, ".hits").is_displayed()


def test_a_verdict_by_any_name_finds_the_claims_that_its_chips_count(visit: Any) -> None:
    page = visit()
    for query, verdicts in NAMES.items():
        hits = asked(page, query)
        chips = page.find_elements(By.CSS_SELECTOR, ".legend button")
        counted = sum(int(chip.text.split()[-1]) for chip in chips if chip.get_attribute("data-v") in verdicts)
        assert int(page.find_element(By.CSS_SELECTOR, ".hits p").text.split()[0]) == counted > 0, query
        said = [hit.find_element(By.TAG_NAME, "small").text.rpartition(": ")[2].split(",")[0] for hit in hits]
        assert {word.replace(" ", "-") for word in said} <= verdicts, query


def test_search_finds_places_in_full_before_words_and_leads_to_all_that_it_found(visit: Any) -> None:
    page = visit()
    for query, other in (("table 1", "Table I"), ("table i", "Table 1")):
        places = [hit.find_element(By.TAG_NAME, "b").text for hit in asked(page, query)]
        assert places if query == "table 1" else not places
        assert all(not place.startswith(other) and f"{place} ".lower().startswith(query) for place in places)
    assert asked(page, "fig. 2")[0].text.startswith("Fig. 2")
    assert asked(page, "there is no such word") == []
    told, rest = (page.find_element(By.CSS_SELECTOR, f".hits {part}") for part in ("p", "button"))
    assert "Nothing found" in told.text
    assert len(asked(page, "table")) == 12 < int(told.text.split()[0])
    assert rest.text == f"Show all {told.text.split()[0]}"
    rest.click()
    found = page.find_elements(By.CSS_SELECTOR, "#hits a")
    assert len(found) == int(told.text.split()[0]) and not rest.is_displayed()
    assert page.switch_to.active_element == found[12]
    assert 0 < len(asked(page, "column-5-7")) <= 12 and not rest.is_displayed()


def test_keys_are_told_only_where_they_work(visit: Any) -> None:
    assert visit().find_element(By.CSS_SELECTOR, ".keyed").is_displayed()
    assert not visit(scripts=False).find_element(By.CSS_SELECTOR, ".keyed").is_displayed()
    page = visit(390)
    touch = {"enabled": True, "maxTouchPoints": 5}
    page.execute_cdp_cmd("Emulation.setEmitTouchEventsForMouse", {"enabled": True, "configuration": "mobile"})
    page.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
    try:
        assert not page.find_element(By.CSS_SELECTOR, ".keyed").is_displayed()
    finally:
        page.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
        page.execute_cdp_cmd("Emulation.setEmitTouchEventsForMouse", {"enabled": False})


def test_everything_is_done_with_the_keyboard_alone(visit: Any) -> None:
    """Skip link, page, search, picture, claim and evidence, reached by Tab and worked by Enter and Space."""
    page = visit()

    def tab_to(selector: str) -> Any:
        for _ in range(60):
            focused = press(page, Keys.TAB)
            assert focused.value_of_css_property("outline-style") != "none", focused.get_attribute("outerHTML")[:80]
            if page.execute_script("return arguments[0].matches(arguments[1])", focused, selector):
                return focused
        raise AssertionError(f"Tab does not come to {selector}")

    assert press(page, Keys.TAB).get_attribute("class") == "skip"
    tab_to(".find input")
    press(page, "column-5-7", Keys.ARROW_DOWN)
    press(page, Keys.ENTER)
    assert drawn(page, "column-5-7").is_displayed()
    page = visit()
    tab_to(".k")
    press(page, Keys.END)
    press(page, Keys.ENTER)
    assert not page.find_element(By.ID, "answer").is_displayed()
    page = visit(fragment=PAPER)
    claim = tab_to(".claim > summary").find_element(By.XPATH, "..")
    assert "in all digits" not in claim.get_attribute("textContent")
    press(page, Keys.SPACE)
    assert claim.get_attribute("open") is not None
    place = claim.find_element(By.CSS_SELECTOR, ":scope > .evidence")
    WebDriverWait(page, 5).until(lambda _: place.get_attribute("data-drawn"))
    assert "Printed and computed, in all digits" in place.text
    tab_to(".claim > .evidence a")


def test_drawing_the_evidence_does_not_lose_the_place_of_the_keyboard(visit: Any) -> None:
    page = visit(fragment=PAPER)
    held = page.execute_async_script("""const done = arguments[0];
      const claim = document.querySelector('.claim:not([open])'), place = claim.querySelector(':scope > .evidence');
      place.innerHTML = '<a href="#answer">what stands there before</a>';
      claim.open = true;
      place.firstChild.focus();
      const wait = () => place.dataset.drawn ? done(place.contains(document.activeElement)) : setTimeout(wait, 10);
      wait();""")
    assert held


def test_the_contents_follow(visit: Any) -> None:
    page = visit(fragment=f"{PAPER}.claims")
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    current = page.find_elements(By.CSS_SELECTOR, ".toc a[aria-current]")
    assert [link.get_attribute("textContent") for link in current] == ["All claims"]
    assert page.find_element(By.CSS_SELECTOR, ".here").get_attribute("textContent") == "All claims"
    assert page.find_element(By.CSS_SELECTOR, ".pages a[aria-current]").get_attribute("hash") == PAPER
