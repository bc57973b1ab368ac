"""Pictures to move in Chromium: by slider, by choice, and still there without a script and on paper."""

from __future__ import annotations

from typing import Any

import pytest
from sample import KEY
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

pytestmark = pytest.mark.browser

PLACE = f"#paper-{KEY}.explore"
PANES = ".try .pane"


def seen(page: Any) -> list[bool]:
    return [pane.is_displayed() for pane in page.find_elements(By.CSS_SELECTOR, PANES)]


def test_the_slider_moves_line_and_values_by_keyboard(visit: Any) -> None:
    page = visit(fragment=PLACE)
    slider = page.find_element(By.CSS_SELECTOR, f"{PANES} input")
    values = "return [...document.querySelectorAll('.try .pane b')].map((e) => e.textContent)"
    line = "return document.querySelector('.try .now').getBoundingClientRect().x"
    before, place = page.execute_script(values), page.execute_script(line)
    assert slider.is_displayed() and slider.get_attribute("aria-valuetext").startswith("20: ")
    slider.send_keys(Keys.ARROW_RIGHT)
    after = page.execute_script(values)
    assert slider.get_attribute("aria-valuetext").startswith("21: ")
    assert page.execute_script(line) > place
    changed = [one != other for one, other in zip(before, after, strict=True)]
    assert all(changed), "each value, and the place on the abscissa"
    table = page.find_element(By.CSS_SELECTOR, PANES).get_attribute("innerHTML")
    assert after[0] in table
    dots = "return [...document.querySelectorAll('.try .dot')].filter((e) => e.checkVisibility()).length"
    assert page.execute_script(dots) == 2, "a band has no dot"


@pytest.mark.parametrize("scripts", [True, False])
def test_a_choice_shows_its_picture_alone(visit: Any, scripts: bool) -> None:
    page = visit(fragment=PLACE, scripts=scripts)
    assert seen(page) == [True, False]
    page.find_elements(By.CSS_SELECTOR, ".try .choice > label")[1].click()
    assert seen(page) == [False, True]


def test_without_a_script_each_picture_stands_where_its_slider_begins(visit: Any) -> None:
    page = visit(fragment=PLACE, scripts=False)
    pane = page.find_element(By.CSS_SELECTOR, PANES)
    assert not pane.find_element(By.TAG_NAME, "input").is_displayed()
    assert pane.find_element(By.CSS_SELECTOR, ".where").text == "20"
    assert all(value.text for value in pane.find_elements(By.CSS_SELECTOR, ".names b"))


@pytest.mark.parametrize("width", [320, 390, 768, 1440])
def test_names_and_ticks_keep_clear_of_each_other_and_of_the_edge(visit: Any, width: int) -> None:
    page = visit(width, fragment=PLACE)
    overlaps = """
      const boxes = [...document.querySelector('.try .pane').querySelectorAll('.names li, .yt, .xt, .xl, .yl')]
        .map((e) => [e.textContent, e.getBoundingClientRect()]);
      return boxes.flatMap(([one, a], i) => boxes.slice(i + 1).filter(([, b]) => a.left < b.right - 1
        && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3).map(([other]) => [one, other]))"""
    assert page.execute_script(overlaps) == []
    edge = "return Math.max(...[...document.querySelectorAll('.try *')].map((e) => e.getBoundingClientRect().right))"
    assert page.execute_script(edge) <= width


def test_all_pictures_are_on_paper(visit: Any) -> None:
    page = visit(fragment=PLACE)
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert all(seen(page))
    assert not any(field.is_displayed() for field in page.find_elements(By.CSS_SELECTOR, ".try input"))
