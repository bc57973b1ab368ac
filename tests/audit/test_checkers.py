"""Which programs have checked a certificate: what they record, what the record is worth, and what the report says."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import msgspec
import pytest
from looking import evidence
from sample import results

from replication import twice
from replication.audit.judge.checkers import checked_twice, machine_checked
from replication.audit.judge.proofs import wanted
from replication.audit.report.page import render
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
    assert checked_twice(tmp_path / "papers" / "toy") == sums
    assert checked_twice(tmp_path) == {} and machine_checked(tmp_path) == ("", {})


@pytest.mark.parametrize("text", ["{", "[]", json.dumps({"other": {}})])
def test_a_record_that_cannot_be_read_says_how_to_make_it(tmp_path: Path, text: str) -> None:
    (tmp_path / twice.RECORD).write_text(text, encoding="utf-8")
    with pytest.raises(AuditError, match="make verify-both"):
        checked_twice(tmp_path)


@pytest.mark.parametrize("paper", PAPERS)
def test_the_committed_record_is_of_the_committed_certificates(paper: str) -> None:
    found, _ = wanted(ROOT, [paper])
    stale = checked_twice(ROOT / "papers" / paper).keys() - {one.name for one in found if one.second}
    assert not stale, "these have changed since; run `make verify-both`"


def test_a_certificate_that_has_changed_does_not_count(tmp_path: Path) -> None:
    (paper,) = [key for key in PAPERS if key == "okajima2023"]
    for name in (f"papers/{paper}", "certificates"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("theorems.json", twice.RECORD):
        (tmp_path / "papers" / paper / name).write_bytes((ROOT / "papers" / paper / name).read_bytes())
    kept = next(iter(checked_twice(ROOT / "papers" / paper)))
    copy = tmp_path / "certificates" / paper / f"{kept}.json"
    copy.parent.mkdir()
    copy.write_bytes((ROOT / "certificates" / paper / copy.name).read_bytes())
    assert [one.name for one in wanted(tmp_path, [paper])[0] if one.second] == [kept]
    by_machine = {"statement": "s.v", "certificates": {kept: hashlib.sha256(copy.read_bytes()).hexdigest()}}
    (tmp_path / "papers" / paper / "machine-checked.json").write_text(json.dumps(by_machine), encoding="utf-8")
    assert [one.name for one in wanted(tmp_path, [paper])[0] if one.machine] == [kept]
    copy.write_bytes(copy.read_bytes() + b"\n")
    assert not any(one.machine for one in wanted(tmp_path, [paper])[0])
    assert not any(one.second for one in wanted(tmp_path, [paper])[0])


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
