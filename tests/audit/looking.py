"""What of the report a reader sees in the browser."""

from __future__ import annotations

from sample import KEY
from selenium import webdriver

from replication.audit.report.claim import anchor


def claim_id(name: str) -> str:
    return anchor("claim", f"{KEY}.{name}")


def shown(browser: webdriver.Chrome) -> list[str]:
    """The ids of the claims that are on the page, in their order."""
    seen = "return [...document.querySelectorAll('tbody.claim')].filter((e) => e.checkVisibility()).map((e) => e.id)"
    found: list[str] = browser.execute_script(seen)
    return found
