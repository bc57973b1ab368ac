"""Proofs in the page: what is packed into it, and what its buttons say in Chromium, with no network."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import pytest
from sample import results

from replication.audit.report.checks import MOST_BYTES, checkable, checks
from replication.audit.report.evidence import packed
from replication.audit.report.templates import source
from replication.audit.store.records import CertificateRecord, ResultsFile

ROOT = Path(__file__).parents[2]
PATH = "certificates/okajima2023/optimum-2-1.json"


@cache
def invented() -> ResultsFile:
    with TemporaryDirectory() as figures:
        return results(Path(figures))


def certified(path: str = PATH, root: Path = ROOT, **changes: Any) -> ResultsFile:
    """Results whose run verified a certificate."""
    content = (root / path).read_bytes()
    written = json.loads(content)
    fields = {"sha256": hashlib.sha256(content).hexdigest(), "proved": True, "statement": written["statement"]}
    record = CertificateRecord(
        paper=written["paper"], name=written["name"], path=path, claims=(), reason="", sentence="",
        lower=None, upper=None, holds=None, items=(), **{**fields, **changes},
    )  # fmt: skip
    return msgspec.structs.replace(invented(), certificates=(record,))


def test_a_page_holds_the_file_that_the_run_verified_and_what_the_paper_wants() -> None:
    made = checks(certified(), ROOT)
    entry = made["entries"][PATH]
    assert entry["text"] == (ROOT / PATH).read_text(encoding="utf-8")
    assert entry["wanted"]["parameters"]["periods"] == [2, 1]
    assert made["plants"][entry["wanted"]["plant"]]["A"][0] == ["19/20", "1/2", "1/5"]


@pytest.mark.parametrize(
    ("path", "changes"),
    [
        (PATH, {"sha256": "0" * 64}),
        (PATH, {"proved": False}),
        (PATH, {"statement": "multirate.selection"}),
        ("certificates/peet2019/ex2-d2-upper.json", {}),
    ],
)
def test_what_the_run_did_not_verify_or_the_page_cannot_check_is_left_out(path: str, changes: Any) -> None:
    assert not checks(certified(path, **changes), ROOT)["entries"]
    assert not checks(certified(path, **changes), None)["entries"]


def test_the_statements_are_those_of_the_script() -> None:
    assert "multirate.optimum-noncausal" in checkable() and "dualrate.counterexample" in checkable()
    assert (ROOT / "certificates/peet2019/ex2-d2-upper.json").stat().st_size > MOST_BYTES


@pytest.fixture
def tried(browser: Any, tmp_path: Path) -> Callable[..., Any]:
    """The element that a button writes into, on a page with this pack."""

    def go(pack: str, name: str = PATH) -> Any:
        page = tmp_path / "page.html"
        page.write_text(
            f'<!DOCTYPE html><meta charset="utf-8"><button data-check="{name}">Check</button>'
            f'<script type="text/plain" id="certificates">{pack}</script>'
            f'<script id="check">{source("check.js")}</script>',
            encoding="utf-8",
        )
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
        browser.get(page.as_uri())
        return browser.execute_async_script("""
          const done = arguments[0], button = document.querySelector("button");
          button.click();
          const wait = () => document.querySelector(".checked .word") ? done(document.querySelector(".checked")) : setTimeout(wait, 5);
          wait();""")  # noqa: E501

    return go


@pytest.mark.browser
def test_a_button_proves_its_claim_step_by_step_and_shows_the_code(tried: Any, browser: Any) -> None:
    place = tried(packed(checks(certified(), ROOT)))
    assert place.text.startswith("Proved here, in ") and len(place.find_elements("css selector", "li")) == 5
    place.find_element("css selector", "summary").click()
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert place.find_element("css selector", "pre").get_attribute("textContent") == source("check.js")


@pytest.mark.browser
def test_damage_is_told_and_nothing_breaks_out(tried: Any, browser: Any) -> None:
    made = checks(certified(), ROOT)
    whole = packed(made)
    assert "damaged or missing" in tried(whole[: len(whole) // 2]).text
    assert "damaged or missing" in tried("").text
    assert "damaged or missing" in tried(whole, "certificates/other.json").text
    entry = made["entries"][PATH]
    evil = "</script><img src=x onerror=alert(1)>"
    entry["wanted"]["statement"] = evil
    entry["text"] = entry["text"].replace('"multirate.optimum-noncausal"', json.dumps(evil))
    assert "not checked in the browser" in tried(packed(made)).text
    assert not browser.find_elements("css selector", "img")
    entry["text"] = entry["text"].replace('"19/20"', '"18/20"', 1)
    assert "plant is not that of the paper's theorem" in tried(packed(made)).text
