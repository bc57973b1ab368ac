"""The invented results, with their figures, their report in headless Chromium, and the toy project."""

from collections.abc import Callable
from pathlib import Path

import pytest
from lab import Inside, make_inside
from looking import resize
from sample import build, results
from selenium import webdriver

from replication.audit.store.records import ResultsFile


@pytest.fixture(scope="session")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the figures of `made`, to be left as it is."""
    return tmp_path_factory.mktemp("figures")


@pytest.fixture(scope="session")
def made(figures: Path) -> ResultsFile:
    return results(figures)


@pytest.fixture(scope="session")
def page_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Their report."""
    return build(tmp_path_factory.mktemp("report"))


@pytest.fixture
def lab(tmp_path: Path) -> Inside:
    """The toy project, run in this process."""
    return make_inside(tmp_path / "lab")


@pytest.fixture
def window(browser: webdriver.Chrome) -> Callable[..., webdriver.Chrome]:
    """A window of some width and colour scheme, with or without scripts."""

    def go(width: int = 1440, scheme: str = "light", scripts: bool = True) -> webdriver.Chrome:
        resize(browser, width)
        scheme_feature = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": scheme_feature})
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not scripts})
        return browser

    return go


@pytest.fixture
def visit(window: Callable[..., webdriver.Chrome], page_path: Path) -> Callable[..., webdriver.Chrome]:
    """Open the report in such a window."""

    def go(width: int = 1440, scheme: str = "light", fragment: str = "", scripts: bool = True) -> webdriver.Chrome:
        browser = window(width, scheme, scripts)
        browser.get("about:blank")
        browser.get_log("browser")  # type: ignore[no-untyped-call]  # what other pages complained of
        browser.get(f"{page_path.as_uri()}{fragment}")
        return browser

    return go
