"""Which programs have checked a certificate: what they record, what the record is worth, and what the report says."""

import hashlib
import json
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import pytest
from looking import evidence
from sample import results

from replication import machine as coq
from replication import twice
from replication.audit.judge import proofs
from replication.audit.judge.proofs import checked_twice, machine_checked, wanted
from replication.audit.report.evidence import MOST_BYTES, checkable, checks, packed
from replication.audit.report.page import render
from replication.audit.report.templates import source
from replication.audit.store.records import CertificateRecord, ResultsFile
from replication.errors import AuditError

ROOT = Path(__file__).parents[2]
PAPERS = sorted(path.parent.name for path in (ROOT / "papers").glob(f"*/{twice.RECORD}"))


def made(root: Path, content: str) -> Path:
    certificate = root / "certificates" / "toy" / "level.json"
    certificate.parent.mkdir(parents=True)
    certificate.write_text(content, encoding="utf-8")
    twice.record([certificate], root)
    return certificate


def test_what_is_recorded_is_read_back(tmp_path: Path) -> None:
    certificate = made(tmp_path, "{}")
    sums = {"level": hashlib.sha256(certificate.read_bytes()).hexdigest()}
    assert checked_twice(tmp_path / "papers" / "toy", ["level"]) == sums
    assert checked_twice(tmp_path, []) == {} and machine_checked(tmp_path, []) == ("", {})


@pytest.mark.parametrize("text", ["{", "[]", json.dumps({"other": {}})])
def test_a_record_that_cannot_be_read_says_how_to_make_it(tmp_path: Path, text: str) -> None:
    (tmp_path / twice.RECORD).write_text(text, encoding="utf-8")
    with pytest.raises(AuditError, match=r"python verify\.py --both"):
        checked_twice(tmp_path, ["level"])


@pytest.mark.parametrize("paper", PAPERS)
def test_the_committed_records_are_of_the_committed_certificates_and_of_the_theory_of_coq(paper: str) -> None:
    found, _ = wanted(ROOT, [paper])
    assert not [one.name for one in found if not one.second], "these have changed since; run `make verify-both`"
    by_coq = [one for one in found if paper == "okajima2023" and one.statement in coq.STATEMENTS]
    assert not [one.name for one in by_coq if not one.machine], "these have changed since; run `make coq`"
    assert by_coq or paper != "okajima2023"


def test_a_record_that_names_what_is_not_stated_is_refused(tmp_path: Path) -> None:
    """`rows` is a theorem of the paper and none of Coq's; `more` is no theorem at all."""
    folder = copied(tmp_path)
    for record, name, message in (
        ("machine-checked.json", "rows", "names rows, of which Coq has no statement"),
        (twice.RECORD, "more", "names more, which theorems.json does not"),
    ):
        kept = (folder / record).read_text(encoding="utf-8")
        forged = json.loads(kept)
        forged["certificates"][name] = "0"
        (folder / record).write_text(json.dumps(forged), encoding="utf-8")
        with pytest.raises(AuditError, match=message):
            wanted(tmp_path, [folder.name])
        (folder / record).write_text(kept, encoding="utf-8")


@pytest.mark.parametrize("part", ["coq/Decimals.v", "theorems.json", "Statement.v", "Theory.v"])
def test_what_coq_read_has_changed(part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = copied(tmp_path)
    theory = tmp_path / "theory"
    shutil.copytree(coq.THEORY, theory)
    monkeypatch.setattr(coq, "THEORY", theory)
    assert any(one.machine for one in wanted(tmp_path, [folder.name])[0])
    changed = folder / part if (folder / part).is_file() else theory / part
    text = changed.read_text(encoding="utf-8")
    wider = text.replace('"relative": "1/1000000"', '"relative": "1/2"')
    changed.write_text(text + "\n" if wider == text else wider, encoding="utf-8")
    assert not any(one.machine for one in wanted(tmp_path, [folder.name])[0])


def test_another_second_arithmetic_has_proved_nothing_yet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = copied(tmp_path)
    assert all(one.second for one in wanted(tmp_path, [folder.name])[0])
    before = dict(wanted(tmp_path, [folder.name])[0][0].subject)
    monkeypatch.setattr(proofs, "second", lambda: "changed")
    found, _ = wanted(tmp_path, [folder.name])
    assert not any(one.second for one in found) and dict(found[0].subject) != before


def copied(root: Path) -> Path:
    """A project with the certificates of one paper, and what is recorded of them."""
    folder, certificates = root / "papers" / "okajima2023", root / "certificates" / "okajima2023"
    (folder / "coq").mkdir(parents=True)
    for name in ("theorems.json", "printed.toml", twice.RECORD, "machine-checked.json", "coq/Decimals.v"):
        shutil.copy(ROOT / "papers" / "okajima2023" / name, folder / name)
    shutil.copytree(ROOT / "certificates" / "okajima2023", certificates)
    return folder


def test_a_certificate_that_has_changed_does_not_count(tmp_path: Path) -> None:
    folder = copied(tmp_path)
    name = "optimum-1-1"
    kept = tmp_path / "certificates" / folder.name / f"{name}.json"
    (entry,) = (one for one in wanted(tmp_path, [folder.name])[0] if one.name == name)
    assert entry.second and entry.machine == "replication/machine/multirate/Statement.v"
    kept.write_bytes(kept.read_bytes() + b"\n")
    (entry,) = (one for one in wanted(tmp_path, [folder.name])[0] if one.name == name)
    assert not entry.second and not entry.machine


def test_the_report_says_which_verifier_has_checked(tmp_path: Path) -> None:
    given = results(tmp_path)
    first, *others = given.certificates
    page = render(given, tmp_path)
    assert "checked by the verifier in one arithmetic" in " ".join(evidence(page).values())
    assert "0 are proved in both arithmetics, and 0 by Coq" in page
    checked = msgspec.structs.replace(first, second=True, machine="replication/machine/multirate/Statement.v")
    page = render(msgspec.structs.replace(given, certificates=(checked, *others)), tmp_path)
    assert "checked by the verifier in both arithmetics and Coq, as" in " ".join(evidence(page).values())
    assert (
        "1 are proved in both arithmetics, and 1 by Coq" in page and '<td data-label="Checked by">refused</td>' in page
    )


# Proofs in the page: what is packed into it, and what its buttons say in Chromium, with no network


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
