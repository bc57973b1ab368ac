"""Which programs have checked a certificate: what they record, what the record is worth, and what the report says."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import msgspec
import pytest
from looking import evidence
from sample import results

from replication import twice
from replication.audit.judge import proofs
from replication.audit.judge import proofs as checkers
from replication.audit.judge.proofs import checked_twice, machine_checked, wanted
from replication.audit.report.page import render
from replication.errors import AuditError
from replication.machine import generate as coq

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
    with pytest.raises(AuditError, match="make verify-both"):
        checked_twice(tmp_path, ["level"])


@pytest.mark.parametrize("paper", PAPERS)
def test_the_committed_record_is_of_the_committed_certificates(paper: str) -> None:
    found, _ = wanted(ROOT, [paper])
    stale = [one.name for one in found if not one.second]
    assert not stale, "these have changed since; run `make verify-both`"


def test_the_committed_record_of_coq_is_of_the_committed_theory_and_certificates() -> None:
    found, _ = wanted(ROOT, ["okajima2023"])
    stale = [one.name for one in found if one.statement in coq.STATEMENTS and not one.machine]
    assert not stale, "these have changed since; run `make coq`"


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
    for module in (checkers, proofs):
        monkeypatch.setattr(module, "second", lambda: "changed")
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
