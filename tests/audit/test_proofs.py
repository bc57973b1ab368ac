"""What a claim gains by certificates, and that a results file cannot claim more than they prove."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from cases import altered, claim, results_file
from msgspec.structs import replace

from replication.audit.inspect.check import Cause, against_files, check
from replication.audit.judge.proofs import proved_ends, wanted, with_proofs
from replication.audit.judge.verdict import make_record
from replication.audit.model import Evidence, Kind, Verdict
from replication.audit.store.records import CertificateRecord, ClaimRecord, PaperRecord
from replication.errors import AuditError

LEVEL = Evidence(method="m", value=1.3258, lower=1.3, upper=1.4)
PAIR = Evidence(method="m", value=(1.0, (2.0, -0.5)))


def certificate(**more: Any) -> CertificateRecord:
    fields: dict[str, Any] = {
        "paper": "toy",
        "name": "c",
        "path": "certificates/toy/c.json",
        "sha256": "0",
        "claims": ("toy.c1",),
        "statement": "method.what",
        "proved": True,
        "reason": "",
        "sentence": "It is so.",
        "lower": None,
        "upper": None,
        "holds": None,
        "items": (),
    }
    return CertificateRecord(**(fields | more))


def judged(kind: Kind, evidence: Evidence, *certificates: CertificateRecord, printed: str = "1.33") -> ClaimRecord:
    made = claim(id="toy.c1", kind=kind, printed=printed)
    return make_record(made, evidence, code="papers/toy.py:1", seconds=0.5, certificates=certificates)


def test_the_proved_bracket_takes_the_place_of_the_computed_one_and_decides() -> None:
    proved = certificate(lower="43441/32768", upper="43447/32768")
    record = judged(Kind.VALUE, LEVEL, proved)
    assert (record.evidence.lower, record.evidence.upper, record.judgement.proved) == (
        43441 / 32768,
        43447 / 32768,
        True,
    )
    assert record.evidence.certificates == ("certificates/toy/c.json",)
    assert record.verdict is Verdict.REPRODUCED
    wide = judged(Kind.VALUE, LEVEL, certificate(lower="13/10", upper="14/10"))
    assert wide.verdict is Verdict.UNDETERMINED and "straddles" in wide.judgement.reason


def test_two_theorems_give_the_narrowest_bracket_and_ends_are_rounded_outwards() -> None:
    third = certificate(lower="1/3", upper="2/3")
    ((low, high),) = proved_ends([third, certificate(lower="0", upper="1/2")])
    assert low is not None and high is not None
    assert Fraction(low) <= Fraction(1, 3) < Fraction(low) + Fraction(1, 2**53)
    assert high == 0.5
    ((_, above),) = proved_ends([third])
    assert above is not None and Fraction(above) >= Fraction(2, 3)


def test_lists_of_numbers_keep_the_layout_of_the_value() -> None:
    items = (("1", "1"), ("7/4", "9/4"), ("-1/2", "-1/2"))
    joined, _ = with_proofs(Kind.VALUE, PAIR, [certificate(items=items)])
    assert (joined.lower, joined.upper) == ((1.0, (1.75, -0.5)), (1.0, (2.25, -0.5)))


def test_a_bracket_narrower_than_rounding_moves_the_value_to_its_end() -> None:
    joined, _ = with_proofs(Kind.VALUE, Evidence(method="m", value=1.0 + 1e-12), [certificate(lower="1", upper="1")])
    assert joined.value == 1.0


def test_a_bound_may_have_one_side() -> None:
    joined, proved = with_proofs(Kind.BOUND, Evidence(method="m", value=0.5, lower=0.4), [certificate(upper="5/8")])
    assert (joined.lower, joined.upper, proved) == (None, 0.625, True)


def test_a_statement_is_proved_by_what_its_theorems_say() -> None:
    evidence = Evidence(method="m", holds=True, margin=0.1)
    assert with_proofs(Kind.FEASIBLE, evidence, [certificate(holds=True)]) == (evidence, True)


ENDS = ("4958645/10000000", "4999442/10000000")
FLOATING = Evidence(method="m", holds=False, margin=-0.1, value=0.4958160, lower=0.4958160, upper=0.4999411)


@pytest.mark.parametrize("kind", [Kind.FEASIBLE, Kind.ORDER])
def test_a_proved_statement_shows_the_bracket_of_its_certificates_rounded_outwards(kind: Kind) -> None:
    proofs = [
        certificate(upper=ENDS[1]),
        certificate(lower=ENDS[0], holds=False),
        certificate(lower="1/10", holds=False),
    ]
    joined, proved = with_proofs(kind, FLOATING, proofs)
    assert proved and isinstance(joined.lower, float) and isinstance(joined.upper, float)
    assert Fraction(joined.lower) <= Fraction(ENDS[0]) < Fraction(joined.lower) + Fraction(1, 2**54)
    assert Fraction(joined.upper) >= Fraction(ENDS[1]) > Fraction(joined.upper) - Fraction(1, 2**54)
    assert joined.value == joined.lower
    assert with_proofs(kind, joined, proofs) == (joined, True)
    one_sided, _ = with_proofs(kind, FLOATING, proofs[1:])
    assert (one_sided.lower, one_sided.upper) == (joined.lower, None)


@pytest.mark.parametrize("proof", [{}, {"items": (("0", "1"), ("0", "1"))}])
def test_a_proved_statement_shows_no_bracket_that_its_certificates_do_not_give(proof: dict[str, Any]) -> None:
    joined, _ = with_proofs(Kind.FEASIBLE, FLOATING, [certificate(holds=False, **proof)])
    assert (joined.value, joined.lower, joined.upper) == (FLOATING.value, None, None)
    unproved, proved = with_proofs(Kind.FEASIBLE, FLOATING, [certificate(holds=False, proved=False)])
    assert (unproved, proved) == (FLOATING, False)


def test_brackets_of_a_statement_that_have_nothing_in_common_are_an_error() -> None:
    with pytest.raises(AuditError, match=r"prove \[0\.6, 0\.7.*\], and the computed value is 0\.4999411"):
        with_proofs(Kind.FEASIBLE, FLOATING, [certificate(lower="6/10", upper="7/10", holds=False)])


@pytest.mark.parametrize(
    "change", [{"lower": 0.4958646}, {"upper": 0.4999411}, {"lower": None}, {"upper": None}, {"value": 0.4958160}]
)
def test_a_stored_bracket_of_a_proved_statement_that_is_not_the_certificates_is_found(change: dict[str, Any]) -> None:
    proof = certificate(lower=ENDS[0], upper=ENDS[1], holds=False)
    record = judged(Kind.FEASIBLE, FLOATING, proof, printed="")
    file = replace(results_file(altered(record, expected=record.verdict)), certificates=(proof,))
    assert check(file, None) == []
    forged = replace(file, claims=(altered(file.claims[0], **change),))
    assert [problem.cause for problem in check(forged, None)] == [Cause.FORGED]


@pytest.mark.parametrize(
    ("kind", "evidence", "proof", "message"),
    [
        (Kind.VALUE, LEVEL, {"lower": "2", "upper": "3"}, "prove .2.0, 3.0., and the computed value is 1.3258"),
        (Kind.VALUE, LEVEL, {"upper": "3"}, "leave a side open"),
        (Kind.VALUE, LEVEL, {"items": (("1", "2"), ("1", "2"))}, "bound 2 numbers, the evidence has 1"),
        (Kind.FEASIBLE, Evidence(method="m", holds=True), {"holds": False}, "contradict the evidence"),
        (Kind.FEASIBLE, Evidence(method="m", holds=True), {"upper": "1"}, "do not say whether"),
        (Kind.VALUE, Evidence(method="m", holds=True), {"lower": "1", "upper": "1"}, "the evidence has none"),
    ],
)
def test_a_theorem_that_contradicts_the_evidence_is_an_error(
    kind: Kind, evidence: Evidence, proof: dict[str, Any], message: str
) -> None:
    with pytest.raises(AuditError, match=message):
        with_proofs(kind, evidence, [certificate(**proof)])
    assert judged(kind, evidence, certificate(**proof)).verdict is Verdict.ERROR


def test_a_certificate_that_is_not_proved_proves_nothing() -> None:
    refused = certificate(proved=False, reason="P_0 is not positive definite", lower="1", upper="2")
    good = certificate(lower="43441/32768", upper="43447/32768")
    assert judged(Kind.VALUE, LEVEL, good, refused).judgement.proved is False
    problems = check(replace(results_file(judged(Kind.VALUE, LEVEL, refused)), certificates=(refused,)), None)
    assert (refused.path, Cause.ERROR) in [(problem.where, problem.cause) for problem in problems]


@pytest.mark.parametrize(
    "change",
    [{"lower": 1.3256}, {"upper": 1.32585}, {"proved": False}, {"certificates": ()}],
)
def test_a_proof_changed_by_hand_is_found(change: dict[str, Any]) -> None:
    proof = certificate(lower="43441/32768", upper="43447/32768")
    record = judged(Kind.VALUE, LEVEL, proof)
    assert check(replace(results_file(record), certificates=(proof,)), None) == []
    forged = replace(results_file(altered(record, **change)), certificates=(proof,))
    assert Cause.FORGED in [problem.cause for problem in check(forged, None)]


def project(root: Path) -> Path:
    """A project that wants one certificate and explains one claim without any."""
    folder = root / "papers" / "toy"
    folder.mkdir(parents=True)
    entries = [
        {"name": "c", "claims": ["toy.c1"], "statement": "method.what", "plant": "", "parameters": {}},
        {"claims": ["toy.c2"], "reason": "a random draw"},
    ]
    (folder / "theorems.json").write_text(json.dumps(entries), encoding="utf-8")
    (folder / "printed.toml").write_text('[X]\nplace = "p"\nvalue = "1"\n', encoding="utf-8")
    (root / "certificates" / "toy").mkdir(parents=True)
    (root / "certificates" / "toy" / "c.json").write_text("{}", encoding="utf-8")
    return root


def test_what_a_paper_wants_is_read_with_its_checksums(tmp_path: Path) -> None:
    (entry,), reasons = wanted(project(tmp_path), ["toy", "other"])
    assert entry.path == "certificates/toy/c.json" and entry.task == "toy.certificate.c"
    assert sorted(entry.subject) == ["certificates/toy/c.json", "papers/toy/printed.toml", "papers/toy/theorems.json"]
    assert reasons == {"toy.c2": "a random draw"}


def test_the_proofs_of_a_file_must_be_of_the_certificates_that_lie_there(tmp_path: Path) -> None:
    (entry,), _ = wanted(project(tmp_path), ["toy"])
    proof = certificate(sha256=entry.subject[entry.path], holds=True)
    record = judged(Kind.FEASIBLE, Evidence(method="m", holds=True), proof, printed="")
    page = PaperRecord(**dict.fromkeys(PaperRecord.__struct_fields__, ()) | {"key": "toy"})
    file = replace(results_file(record), papers=(page,), certificates=(proof,))
    assert list(against_files(file, tmp_path)) == []
    (tmp_path / entry.path).write_text("{ }", encoding="utf-8")
    assert list(against_files(file, tmp_path)) == [
        (entry.path, "the file is not the one that was verified; run the audit again")
    ]
    gone = replace(file, certificates=())
    assert list(against_files(gone, tmp_path)) == [(entry.path, "the certificate is wanted and not in the file")]
    vague = replace(file, claims=(altered(record, unproved="too hard"),))
    assert (record.id, "the reason why there is no theorem is not the one that the paper gives") in list(
        against_files(vague, tmp_path)
    )


def test_a_malformed_list_of_theorems_is_named(tmp_path: Path) -> None:
    (project(tmp_path) / "papers" / "toy" / "theorems.json").write_text('[{"name": "c"}]', encoding="utf-8")
    with pytest.raises(AuditError, match=r"papers/toy/theorems\.json\[0\] lacks the field"):
        wanted(tmp_path, ["toy"])
