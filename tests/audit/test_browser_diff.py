"""The comparison of two runs in Chromium: it fits the window, is accessible, and tells changed verdicts first."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from axe_core import violations
from sample import HOSTILE, results
from selenium.webdriver.common.by import By

from replication.audit.inspect.compare import compare
from replication.audit.model import Verdict
from replication.audit.report.page import build_page
from replication.audit.store.records import ClaimRecord, ResultsFile

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page of two runs: one claim is gone, one has another verdict, one other words; the machine is another."""
    folder = tmp_path_factory.mktemp("runs")
    old = results(folder)
    first, second, third, *others = old.claims
    new = msgspec.structs.replace(
        old, claims=(refuted(second), reworded(third), *others), run=msgspec.structs.replace(old.run, cpu=HOSTILE[0])
    )
    assert first.id not in {claim.id for claim in new.claims}
    return build(old, new, folder / "diff.html").as_uri()


def build(old: ResultsFile, new: ResultsFile, output: Path) -> Path:
    return build_page(old, new, compare(old, new), output)


def refuted(record: ClaimRecord) -> ClaimRecord:
    return msgspec.structs.replace(
        record, judgement=msgspec.structs.replace(record.judgement, verdict=Verdict.REFUTED, reason="x" * 300)
    )


def reworded(record: ClaimRecord) -> ClaimRecord:
    return msgspec.structs.replace(record, claim=msgspec.structs.replace(record.claim, statement=HOSTILE[0] * 9))


@pytest.mark.parametrize("width", [320, 390, 768, 1440])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_comparison_fits_and_axe_finds_no_violation(visit: Any, width: int, scheme: str) -> None:
    page = visit(width, scheme)
    page.execute_script("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    assert page.execute_script("return document.documentElement.scrollWidth") == width
    assert violations(page) == []


def test_changed_verdicts_come_first_and_the_rest_is_folded(visit: Any) -> None:
    page = visit()
    assert page.find_element(By.TAG_NAME, "h1").text.startswith("3 of ")
    heads = [head.text for head in page.find_elements(By.TAG_NAME, "h2")]
    assert heads == [
        "Changed verdicts",
        "The same verdict, other numbers or words",
        "The runs",
    ]
    folds = page.find_elements(By.CSS_SELECTOR, "details")
    assert [fold.get_attribute("open") is not None for fold in folds] == [True, False, False]
    assert len(page.find_elements(By.TAG_NAME, "mark")) == 1
