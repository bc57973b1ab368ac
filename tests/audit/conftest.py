"""The report of the sample in headless Chromium, for the tests that look at it there."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from looking import resize
from sample import build
from selenium import webdriver


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    return build(tmp_path_factory.mktemp("report")).as_uri()


@pytest.fixture
def visit(browser: webdriver.Chrome, address: str) -> Callable[..., webdriver.Chrome]:
    """Open the report in a window of some width and colour scheme, with or without scripts."""

    def go(width: int = 1440, scheme: str = "light", fragment: str = "", scripts: bool = True) -> webdriver.Chrome:
        resize(browser, width)
        scheme_feature = [{"name": "prefers-color-scheme", "value": scheme}]
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": scheme_feature})
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": not scripts})
        browser.get("about:blank")
        browser.get_log("browser")  # type: ignore[no-untyped-call]  # what other pages complained of
        browser.get(f"{address}{fragment}")
        return browser

    return go
