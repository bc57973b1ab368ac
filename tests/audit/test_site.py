"""The documentation site: it builds without a warning, loads nothing, shows what ran, and serves every reader."""

import ast
import contextlib
import functools
import itertools
import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from runpy import run_path
from typing import Any
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

import html5lib
import pytest
from looking import violations
from mkdocs.commands.build import build
from mkdocs.config import load_config
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.wait import WebDriverWait

from benchmarks.readme import run_example
from replication.audit.publish.notebooks import build_notebooks
from replication.errors import AuditError

ROOT = Path(__file__).resolve().parents[2]
SVG = "{http://www.w3.org/2000/svg}svg"
EXAMPLES = {
    "multirate": "multirate_drone.py",
    "nonuniform": "nonuniform_reactor.py",
    "dualrate": "dualrate_crane.py",
    "delay": "delay_mixers.py",
}
METHODS = tuple(EXAMPLES)
RUN_HERE = sorted((ROOT / "docs" / "examples").glob("*.py"))
LINES = 10
"""Of an example, at most."""
EVERY = os.environ.get("PAGES") == "all"
PAGES = ("index", "methods/index", "methods/costs", "reference/dualrate", "tutorials/nonuniform", "another-field")
"""One page of each kind, narrow and light, wide and dark; `PAGES=all` looks at every page in all ways."""

STUCK = """return [...document.querySelectorAll('main *')].filter((e) => getComputedStyle(e).overflowX === 'auto'
  && e.scrollWidth > e.clientWidth && e.tabIndex < 0).map((e) => e.outerHTML.slice(0, 80))"""
"""What scrolls and cannot be reached by Tab."""

WIDTHS = (320, 1440)
WIDE = """return [...document.querySelectorAll('pre, .scroll, .formula')].filter(
  (e) => e.scrollWidth > e.clientWidth + 1).map((e) => getComputedStyle(e).backgroundAttachment)"""
LISTED = """const at = document.querySelector('.pages [aria-current]').getBoundingClientRect();
  return [at.top >= 0 && at.bottom <= innerHeight, scrollY]"""

CUT = """return [...document.querySelectorAll('figure svg text')].filter((e) => {
  const text = e.getBoundingClientRect(), drawing = e.ownerSVGElement.getBoundingClientRect();
  return text.left < drawing.left - 1 || text.right > drawing.right + 1;
}).map((e) => e.textContent)"""
"""Words that a drawing does not hold."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built in this process, which has imported the library already; a warning ends it."""
    directory = tmp_path_factory.mktemp("site")
    with contextlib.chdir(ROOT):
        build(load_config("mkdocs.yml", site_dir=str(directory), strict=True))
    return directory


@pytest.fixture(scope="module")
def read(site: Path) -> Callable[[str], Element]:
    @functools.cache
    def parse(page: str) -> Element:
        return html5lib.parse((site / f"{page}.html").read_text(encoding="utf-8"), namespaceHTMLElements=False)

    return parse


@pytest.fixture
def visit_page(window: Callable[..., Any], site: Path) -> Callable[..., Any]:
    """Open a page of the site in such a window."""

    def go(page: str = "index", width: int = 1440, scheme: str = "light") -> Any:
        opened = window(width, scheme)
        opened.get((site / f"{page}.html").as_uri())
        return opened

    return go


def names(site: Path) -> list[str]:
    return [path.relative_to(site).with_suffix("").as_posix() for path in sorted(site.rglob("*.html"))]


def words(node: Element) -> str:
    return " ".join("".join(node.itertext()).split())


def squeezed(text: str) -> str:
    return "".join(text.split())


def test_it_loads_nothing_from_elsewhere(site: Path, read: Callable[[str], Element]) -> None:
    assert len(names(site)) > 20
    for name in names(site):
        page = read(name)
        loaded = [node.get("src") or "" for tag in ("script", "img", "iframe") for node in page.iter(tag)]
        loaded += [node.get("href") or "" for node in page.iter("link")]
        assert not [address for address in loaded if re.match(r"(https?:)?//", address)], name


def test_each_page_has_landmarks_one_heading_and_the_way_to_all_others(
    site: Path, read: Callable[[str], Element]
) -> None:
    for name in names(site):
        page = read(name)
        assert [len(list(page.iter(tag))) for tag in ("main", "header", "h1")] == [1, 1, 1], name
        (navigation,) = (nav for nav in page.iter("nav") if nav.get("aria-label") == "Pages")
        links = {os.path.normpath((site / name).parent / str(link.get("href"))) for link in navigation.iter("a")}
        assert links == {str(site / f"{other}.html") for other in names(site)}, name
        report = next(link for link in page.iter("a") if link.get("class") == "report").get("href")
        assert os.path.normpath((ROOT / "build" / "docs" / name).parent / str(report)) == str(
            ROOT / "report" / "index.html"
        )


@pytest.mark.parametrize("path", RUN_HERE, ids=lambda path: path.stem)
def test_an_example_ran_is_short_and_prints_a_level(path: Path, read: Callable[[str], Element]) -> None:
    """It stands on one page, and its output right below it; it uses only the public functions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    statements = [node for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    assert ast.get_docstring(tree) and len(statements) - 1 <= LINES + 1  # imports of two packages count as one
    assert {node.module for node in statements if isinstance(node, ast.ImportFrom)} == {"replication.estimation"}
    (page,) = (page for page in (ROOT / "docs").rglob("*.md") if f"<!-- example: {path.stem} -->" in page.read_text())
    blocks = read(page.relative_to(ROOT / "docs").with_suffix("").as_posix()).iter("div")
    shown = [(node.get("class"), words(node)) for node in blocks if node.get("class") in ("codehilite", "output")]
    code = squeezed("\n".join(path.read_text(encoding="utf-8").splitlines()[tree.body[0].end_lineno :]))
    (place,) = (i for i, (kind, text) in enumerate(shown) if kind == "codehilite" and squeezed(text) == code)
    kind, printed = shown[place + 1]
    assert kind == "output" and "guaranteed level: " in printed


def test_examples_stand_there_with_what_they_print_and_draw(site: Path, read: Callable[[str], Element]) -> None:
    gallery = read("gallery")
    outputs = [words(node) for node in gallery.iter("div") if node.get("class") == "output"]
    labels = [node.get("aria-label") for node in gallery.iter(SVG)]
    assert {path.stem.partition("_")[0] for path in RUN_HERE} == {*METHODS}
    for method in METHODS:
        path = ROOT / "docs" / "examples" / EXAMPLES[method]
        source = path.read_text(encoding="utf-8")
        assert " ".join(source.strip().splitlines()[-1].split()) in words(gallery), path.name
        assert source.splitlines()[0].strip('"') in labels, path.name
    assert len([text for text in outputs if "guaranteed level: " in text]) >= len(METHODS)
    for name in names(site):
        assert not re.search(r"--8|<!-- (example|picture): |<!-- figures", (site / f"{name}.html").read_text()), name


def test_the_gallery_shows_every_figure_with_data_and_code(site: Path, read: Callable[[str], Element]) -> None:
    gallery = read("gallery")
    shown = {Path(str(node.get("src"))).stem for node in gallery.iter("img")}
    assert shown == {path.stem for path in (ROOT / "figures").glob("*.svg")}
    codes = " ".join(words(node) for node in gallery.iter("summary"))
    for name in shown:
        assert (site / "figures" / f"{name}.csv").read_bytes() == (ROOT / "figures" / f"{name}.csv").read_bytes()
        assert f"The code of {name}" in codes


@pytest.mark.parametrize("method", METHODS)
def test_a_tutorial_shows_the_outputs_of_its_cells(method: str, read: Callable[[str], Element]) -> None:
    page = read(f"tutorials/{method}")
    outputs = [node for node in page.iter("div") if node.get("class") == "output"]
    assert len(outputs) > 5
    assert any(output.find(f".//{SVG}") is not None for output in outputs)
    assert any(output.find(".//table") is not None for output in outputs)


@pytest.mark.parametrize("method", METHODS)
def test_every_argument_stands_in_a_table(method: str, read: Callable[[str], Element]) -> None:
    from importlib import import_module
    from inspect import signature

    page = read(f"reference/{method}")
    cells = {words(row[0]) for table in page.iter("table") for row in table.iter("tr") if len(row)}
    for name in ("design", "analyse", "simulate"):
        function = getattr(import_module(f"replication.estimation.{method}"), name)
        assert set(signature(function).parameters) <= cells, name


def test_what_a_plant_is_made_with_is_documented(site: Path) -> None:
    pages = "".join(path.read_text(encoding="utf-8") for path in (site / "reference").glob("*.html"))
    plants = ("MultiratePlant", "SampledPlant", "PeriodRange", "Filter", "make_plant", "delay_system")
    for name in (*plants, "search_timing"):
        assert re.search(rf'id="replication\.estimation\.[^"]+\.{name}"', pages), name


def test_a_formula_is_mathml_and_does_not_part_its_sentence(site: Path, read: Callable[[str], Element]) -> None:
    text = (site / "methods" / "multirate.html").read_text(encoding="utf-8")
    assert text.count("<math") > 5 and "$" not in re.sub(r"<(pre|code|annotation).*?</\1>", "", text, flags=re.DOTALL)
    for name in names(site):
        (main,) = read(name).iter("main")
        assert not [words(node) for node in main if str(node.tag).endswith("math")], name
    typeset = run_path(str(ROOT / "docs" / "site" / "formulas.py"))["on_page_markdown"]
    for text in ("$x$ is", "so that\n$A$ is", "- so that\n  $A - LC$ is"):
        assert len(re.findall(r"^ *<span><math", typeset(text), re.MULTILINE)) == 1


def test_every_link_leads_to_a_place_that_is_there(site: Path, read: Callable[[str], Element]) -> None:
    pages = {site / f"{name}.html": read(name) for name in names(site)}
    places = {path: {node.get("id") for node in page.iter()} for path, page in pages.items()}
    lost = []
    for path, page in pages.items():
        for link in (link for link in page.iter("a") if link.get("href") and link.get("class") != "report"):
            address = urlsplit(str(link.get("href")))
            target = Path(os.path.normpath(path.parent / unquote(address.path))) if address.path else path
            if not address.scheme and (
                not target.is_file() or (address.fragment and address.fragment not in places.get(target, ()))
            ):
                lost.append((path.name, link.get("href")))
    assert lost == []


def test_the_index_knows_every_page_and_leads_to_places_that_are_there(site: Path) -> None:
    script = (site / "index.js").read_text(encoding="utf-8")
    sections = json.loads(script.removeprefix("window.searchIndex = ").removesuffix(";\n"))
    found: dict[str, set[str]] = {}
    for section in sections:
        page, _, anchor = section["address"].partition("#")
        found.setdefault(page.removesuffix(".html"), set()).add(anchor)
    assert set(found) == set(names(site))
    for page, anchors in found.items():
        text = (site / f"{page}.html").read_text(encoding="utf-8")
        assert all(f'id="{anchor}"' in text for anchor in anchors if anchor), page


def test_an_example_that_fails_or_says_nothing_is_named(tmp_path: Path) -> None:
    path = tmp_path / "wrong.py"
    path.write_text('"""It fails."""\nassert 1 == 2\n', encoding="utf-8")
    with pytest.raises(AuditError, match=r"wrong\.py: AssertionError"):
        run_example(path)
    path.write_text("print(1)\n", encoding="utf-8")
    with pytest.raises(AuditError, match=r"wrong\.py has no docstring"):
        run_example(path)


@pytest.mark.browser
def test_axe_finds_no_violation(site: Path, visit_page: Callable[..., Any]) -> None:
    wrong = {}
    looks = list(itertools.product((320, 1440), ("light", "dark")))
    for name in names(site) if EVERY else PAGES:
        for width, scheme in looks if EVERY else looks[::3]:
            page = visit_page(name, width, scheme)
            page.execute_script("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
            if found := violations(page):
                wrong[name, width, scheme] = found
    assert wrong == {}


@pytest.mark.browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_pages_of_tutorials_are_for_everyone(scheme: str, tmp_path: Path, window: Callable[..., Any]) -> None:
    """No violation, nothing wider than the window, and a tab stop for each box that scrolls."""
    for built, _ in build_notebooks(ROOT, tmp_path, METHODS if EVERY else METHODS[:1]):
        for width in (1440, 320):
            page = window(width, scheme)
            page.get(built.as_uri())
            assert violations(page) == [], (built, width)
            assert page.execute_script("return document.documentElement.scrollWidth") == width, built
            assert page.execute_script(STUCK) == [], (built, width)
        box = page.find_element(By.CSS_SELECTOR, ".input")
        page.find_element(By.TAG_NAME, "body").send_keys(Keys.TAB)
        assert page.switch_to.active_element == box
        box.send_keys(Keys.ARROW_RIGHT)
        WebDriverWait(page, 10).until(lambda page: page.execute_script("return document.activeElement.scrollLeft > 0"))


@pytest.mark.browser
@pytest.mark.parametrize("width", WIDTHS)
def test_pages_fit_the_window_and_what_scrolls_has_a_tab_stop(
    width: int, site: Path, visit_page: Callable[..., Any]
) -> None:
    for name in names(site) if EVERY or width == min(WIDTHS) else (*PAGES, "changelog"):
        page = visit_page(name, width)
        assert page.execute_script("return document.documentElement.scrollWidth") == width, name
        assert page.execute_script(STUCK) == [], name
        assert page.execute_script(CUT) == [], name
        shaded = page.execute_script(WIDE)
        assert shaded or (name, width) != ("methods/index", min(WIDTHS))
        assert {*shaded} <= {"local, local, scroll, scroll"}, "an edge behind which there is more is shaded"
        assert width < max(WIDTHS) or page.execute_script(LISTED) == [True, 0], "the list shows the page that is open"


@pytest.mark.browser
def test_the_keyboard_opens_the_list_of_pages_and_goes_to_one(visit_page: Callable[..., Any]) -> None:
    page = visit_page("index", 390)
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.TAB)
    summary = page.find_element(By.CSS_SELECTOR, ".pages summary")
    for _ in range(6):
        if page.switch_to.active_element != summary:
            page.switch_to.active_element.send_keys(Keys.TAB)
    assert page.switch_to.active_element == summary
    assert page.find_element(By.CSS_SELECTOR, ".pages details").get_attribute("open") is None
    summary.send_keys(Keys.ENTER)
    assert page.find_element(By.CSS_SELECTOR, ".pages details").get_attribute("open")
    for _ in range(2):  # the page that is open, then the next one
        page.switch_to.active_element.send_keys(Keys.TAB)
    link = page.switch_to.active_element
    target = link.get_attribute("href")
    assert target != page.current_url
    link.send_keys(Keys.ENTER)
    WebDriverWait(page, 10).until(lambda _: page.current_url == target)


@pytest.mark.browser
def test_the_keyboard_finds_a_page_and_reads_it(visit_page: Callable[..., Any]) -> None:
    page = visit_page("index", 390)

    def press(*keys: str) -> Any:
        page.switch_to.active_element.send_keys(*keys)
        return page.switch_to.active_element

    page.find_element(By.TAG_NAME, "body").send_keys(Keys.TAB)
    assert page.switch_to.active_element.get_attribute("class") == "skip"
    assert press(Keys.TAB).get_attribute("class") == "brand"
    assert press(Keys.TAB).get_attribute("id") == "find"
    press("offsets best")
    box = page.find_element(By.CSS_SELECTOR, ".hits")
    WebDriverWait(page, 10).until(lambda _: box.is_displayed())
    first = press(Keys.TAB)
    assert first.find_element(By.XPATH, "ancestor::div").get_attribute("class") == "hits"
    assert press(Keys.ESCAPE).get_attribute("id") == "find" and not box.is_displayed()
    press(" nonsenseword")
    WebDriverWait(page, 10).until(lambda _: "Nothing found" in box.text)
    press(Keys.CONTROL + "a")
    press("drone barometer")
    WebDriverWait(page, 10).until(lambda _: "drone" in box.text)
    target = box.find_element(By.TAG_NAME, "a").get_attribute("href")
    press(Keys.ENTER)
    WebDriverWait(page, 10).until(lambda _: page.current_url == target)
    page.find_element(By.TAG_NAME, "body").send_keys(Keys.TAB)
    scrolls = page.find_elements(By.CSS_SELECTOR, "main [tabindex='0']")
    assert scrolls
    for _ in range(40):
        if page.switch_to.active_element in scrolls:
            break
        press(Keys.TAB)
    assert page.switch_to.active_element in scrolls
    press(Keys.ARROW_RIGHT)
    moved = "return document.activeElement.scrollLeft > 0"
    WebDriverWait(page, 10).until(lambda _: page.execute_script(moved))
