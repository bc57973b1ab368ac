"""The report for everyone: no violation of the accessibility rules, nothing cut off on paper, cues where it scrolls."""

import json
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from looking import resize, unfold, violations
from sample import KEY, results
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from test_checkers import certified

from papers.shao.experiments.theorem import radius, theorem_constants
from papers.shao.method.motor import simulate
from papers.shao.printed import APO, COUNTEREXAMPLE, FAST, RESTARTED
from replication.audit.report.evidence import checks, played
from replication.audit.report.page import render
from replication.audit.report.templates import source
from replication.errors import InfeasibleError
from replication.estimation.dualrate.observers import Harmonic
from replication.estimation.dualrate.problem import DualRateDesign

pytestmark = pytest.mark.browser

PAPER = {"width": 190, "height": 277}
"""A4 without margins of 10 mm."""
PIXELS_PER_MM = 96 / 25.4


@pytest.mark.parametrize(("width", "scheme"), [(320, "light"), (1440, "dark")])
def test_axe_finds_no_violation(visit: Any, width: int, scheme: str) -> None:
    page = unfold(visit(width, scheme))
    assert violations(page) == []


@pytest.mark.parametrize(("width", "scheme"), [(320, "dark"), (1440, "light")])
def test_each_page_of_the_report_is_well_formed_alone(visit: Any, width: int, scheme: str) -> None:
    browser = visit(width, scheme)
    pages = [view.get_attribute("id") for view in browser.find_elements(By.CSS_SELECTOR, ".view")]
    assert len(pages) > 2
    for name in pages:
        browser.execute_async_script("location.hash = arguments[0]; requestAnimationFrame(arguments[1])", name)
        assert browser.find_element(By.ID, name).is_displayed() and violations(browser) == [], name


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


def test_a_violation_would_be_found_and_faint_text_also_where_axe_cannot_decide(visit: Any) -> None:
    page = unfold(visit())
    page.execute_script("document.querySelector('svg.figure').removeAttribute('aria-label')")
    assert [rule for rule, _ in violations(page, "main figure")] == ["svg-img-alt"]
    page.execute_script("""const cell = document.querySelector('.scroll td');
      cell.style.color = '#aaa'; cell.textContent = 'faint';""")
    assert "contrast" in {rule for rule, _ in violations(page, "main .scroll")}


def print_layout(visit: Any, scripts: bool) -> Any:
    """The page in the layout of print, as wide as A4 between its margins, with scripts on to measure it."""
    page = visit(scripts=scripts)
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    resize(page, int(PAPER["width"] * PIXELS_PER_MM))
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    page.execute_script("dispatchEvent(new Event('beforeprint'))")
    return page


@pytest.mark.parametrize("scripts", [True, False])
def test_nothing_is_cut_on_paper_or_split_between_pages(visit: Any, scripts: bool) -> None:
    """Whatever is kept in one piece fits a page, so that the browser can keep it; heads stand on each page."""
    page = print_layout(visit, scripts)
    beyond = """const edge = document.documentElement.clientWidth;
      return [...document.querySelectorAll('main *')].filter((e) => e.checkVisibility() && !e.closest('.unseen')
        && e.getBoundingClientRect().right > edge + 1).map((e) => e.outerHTML.slice(0, 120))"""
    assert page.execute_script(beyond) == []
    clipped = """return [...document.querySelectorAll('main *')].filter((e) => e.checkVisibility()
      && !e.closest('.unseen, svg, math') && e.scrollWidth > e.clientWidth + 1 && e.clientWidth
      && getComputedStyle(e).overflowX !== 'visible').map((e) => e.outerHTML.slice(0, 120))"""
    assert page.execute_script(clipped) == []
    pieces = """return [...document.querySelectorAll(arguments[0])].filter((e) => e.checkVisibility()).map((e) =>
      [getComputedStyle(e).breakInside, e.getBoundingClientRect().height, e.outerHTML.slice(0, 120)])"""
    found = page.execute_script(pieces, "tr, figure, .erratum, .claim > summary, .lane, .card")
    assert len(found) > 40
    assert [text for kept, _, text in found if kept != "avoid"] == []
    assert [text for _, height, text in found if height > PAPER["height"] * PIXELS_PER_MM] == []
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
    assert all(seen(page)), "all pictures"
    assert not any(field.is_displayed() for field in page.find_elements(By.CSS_SELECTOR, ".try input"))


# Pictures to move in Chromium: by slider, by choice, and still there without a script and on paper


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
    pane = page.find_element(By.CSS_SELECTOR, PANES)
    assert pane.find_element(By.TAG_NAME, "input").is_displayed() is scripts
    assert pane.find_element(By.CSS_SELECTOR, ".where").text == "20", "it stands where its slider begins"
    assert all(value.text for value in pane.find_elements(By.CSS_SELECTOR, ".names b"))
    page.find_elements(By.CSS_SELECTOR, ".try .choice > label")[1].click()
    assert seen(page) == [False, True]


def test_names_and_ticks_keep_clear_of_each_other_and_of_the_edge(visit: Any) -> None:
    page = visit(fragment=PLACE)
    overlaps = """
      const boxes = [...document.querySelector('.try .pane').querySelectorAll('.names li, .yt, .xt, .xl, .yl')]
        .map((e) => [e.textContent, e.getBoundingClientRect()]);
      return boxes.flatMap(([one, a], i) => boxes.slice(i + 1).filter(([, b]) => a.left < b.right - 1
        && b.left < a.right - 1 && a.top < b.bottom - 3 && b.top < a.bottom - 3).map(([other]) => [one, other]))"""
    edge = "return Math.max(...[...document.querySelectorAll('.try *')].map((e) => e.getBoundingClientRect().right))"
    for width in (1440, 768, 390, 320):
        resize(page, width)
        assert page.execute_script(overlaps) == [], width
        assert page.execute_script(edge) <= width


# The counter-example to play with: its arithmetic against the simulation and the theorem of the paper's package


ROOT = Path(__file__).parents[2]
LOOP = "certificates/shao/counterexample.json"
OBSERVERS = {"printed": APO, "restarted": RESTARTED, "fast": FAST}
SETTINGS = [
    {},
    {"M": 2},
    {"M": 20},
    {"T": 0.01, "M": 8},
    {"T": 0.178, "M": 12},
    {"K": -4.0, "L": 5.5},
    {"K": -1.5, "L": 1.1, "T": 0.05},
    {"K": -8.0, "L": 8.0, "T": 0.3, "M": 3},
    {"L": 0.5},
    {"K": -0.5},
    {"L": 1.0},
]
"""What the sliders are moved to, from the certified case; gains that the theorem does not allow among them."""
IN_NODE = """
const fs = require("fs"), vm = require("vm"), context = vm.createContext({});
vm.runInContext(fs.readFileSync(process.argv[1], "utf8"), context);
const { radius, condition, run } = context.dualRate, names = ["printed", "restarted", "fast"];
const said = (loop) => ({ condition: condition(loop), loops: Object.fromEntries(names.map((name) =>
  [name, { radius: radius(loop, name), x: run(loop, name, 4 * loop.M * loop.T) }])) });
process.stdout.write(JSON.stringify(JSON.parse(process.argv[2]).map(said)));
"""


def certified_loop() -> dict[str, Any]:
    loop: dict[str, Any] = json.loads(played(checks(certified(LOOP), ROOT))["shao"])
    return loop


def design(setting: Mapping[str, Any]) -> DualRateDesign:
    loop = certified_loop() | setting
    gains = {"feedback": np.array([[loop["K"]]]), "injection": np.array([[loop["L"]]])}
    return replace(COUNTEREXAMPLE, **gains, period=loop["T"], ratio=int(loop["M"]))


def test_the_sliders_start_at_the_certified_loop() -> None:
    assert certified_loop() == {"name": "play-shao", "a": 1, "b": 1, "c": 1, "K": -2, "L": 2, "T": 0.001, "M": 5}
    assert played(checks(certified(), ROOT)) == {}


@pytest.mark.skipif(not shutil.which("node"), reason="needs Node")
def test_condition_radius_and_course_are_those_of_the_paper_s_package(tmp_path: Path) -> None:
    (tmp_path / "play.js").write_text(source("play.js"), encoding="utf-8")
    loops = json.dumps([certified_loop() | setting for setting in SETTINGS])
    command = ["node", "-e", IN_NODE, str(tmp_path / "play.js"), loops]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    none = Harmonic(1.0, np.zeros(1))
    for setting, told in zip(SETTINGS, said, strict=True):
        made = design(setting)
        try:
            wanted = theorem_constants(made).condition
        except InfeasibleError:
            wanted = None
        assert told["condition"] == (wanted if wanted is None else pytest.approx(wanted, rel=1e-9)), setting
        for name, observer in OBSERVERS.items():
            found = told["loops"][name]
            assert found["radius"] == pytest.approx(radius(made, observer), rel=1e-9, abs=1e-12), (setting, name)
            trace = simulate(made, observer, none, np.ones(1), np.zeros(1), slow_periods=5, substeps=1)
            x = found["x"][: len(trace.output)]
            assert len(x) > 3 * made.ratio
            np.testing.assert_allclose(x, trace.output[: len(x)], rtol=1e-9, atol=1e-9)
    assert said[0]["condition"] < 1 < said[0]["loops"]["printed"]["radius"]


MOVE = """
  const [inputs, [at, value]] = [[...document.querySelectorAll(".play input")], arguments];
  inputs[at].value = value;
  inputs[at].dispatchEvent(new Event("input"));
  return document.querySelector(".play").innerText;
"""


@pytest.mark.browser
def test_titles_lamp_and_key_follow_the_sliders(browser: Any, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    data = json.dumps(certified_loop()).replace('"', "&quot;")
    page.write_text(
        f'<!DOCTYPE html><meta charset="utf-8"><div class="play" hidden role="group" data-play="{data}"></div>'
        f"<script>{source('play.js')}</script>",
        encoding="utf-8",
    )
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
    browser.get(page.as_uri())
    begin = browser.find_element("css selector", ".play").text
    assert begin.startswith("Condition (18) is met, and the loop diverges all the same")
    assert browser.find_element("css selector", ".lamp").get_attribute("data-met") == "true"
    assert browser.execute_script(MOVE, 3, "6").startswith("The loop decays as printed; condition (18) is met")
    assert "is not Hurwitz" in browser.execute_script(MOVE, 2, "-0.5")
    slow = browser.execute_script(MOVE, 0, "45")
    assert "T = 0.178 s" in slow and "grows, ×" in slow
    browser.find_element("css selector", ".play button").click()
    assert browser.find_element("css selector", ".play").text == begin
    assert len(browser.find_elements("css selector", ".play path.line")) == len(OBSERVERS)
