"""What a claim gains by certificates, and that a results file cannot claim more than they prove."""

import json
from collections.abc import Sequence
from dataclasses import replace as replace_data
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import sample
from cases import altered, claim, results_file
from msgspec.structs import replace

from replication.audit.inspect.check import Cause, against_files, check
from replication.audit.judge.agreement import Interval
from replication.audit.judge.proofs import NO_PREDICATE, compared, wanted, with_proofs
from replication.audit.judge.verdict import make_record
from replication.audit.model import Claim, Evidence, Kind, Outcome, StatedClaim, Verdict
from replication.audit.store.records import CertificateRecord, ClaimRecord, PaperRecord, ResultsFile, shared
from replication.errors import AuditError
from replication.verify.predicate import Exported, Predicate, Relation, Term, term

LEVEL = Evidence(method="m", value=1.3258, lower=1.3, upper=1.4)
GAIN, STABLE = term("gain", "toy"), term("stable error system", "toy")
PAIR = Evidence(method="m", value=(1.0, (2.0, -0.5)))


def certificate(
    *, of: Term | None = None, unit: str = "1", readings: tuple[str, ...] = ("none",), **more: Any
) -> CertificateRecord:
    """A theorem on the gain, or if it only says yes or no on the stability, of the plant of the paper."""
    own = {"paper": "toy", "path": "certificates/toy/c.json", "statement": "method.what", "claims": ("toy.c1",)}
    made = sample.certificate("c", **(own | more))
    items = made.items or ((made.lower, made.upper),)
    bounds = any(end for pair in items for end in pair)
    gain = Exported(of=of or GAIN, unit=unit, readings=readings, items=items)
    stable = Exported(of=of or STABLE, unit="yes or no", readings=readings, holds=made.holds)
    return replace(made, says=(*([gain] if bounds else []), *([stable] if made.holds is not None else [])))


def stated(kind: Kind, *says: Predicate, printed: str = "1.33", reading: str = "none") -> Claim:
    """A claim on the gain, or where its kind is a statement on the stability, of the plant of the paper."""
    numeric = kind in (Kind.VALUE, Kind.MATRIX)
    usual = Predicate(of=GAIN, relation="is", to=printed, unit="1", reading=reading)
    if kind is Kind.BOUND:
        usual = replace_data(usual, relation="less than", to=printed.removeprefix("<"))
    elif not numeric:
        usual = Predicate(of=STABLE, unit="yes or no", reading=reading)
    return claim(id="toy.c1", kind=kind, printed=printed, says=says or (usual,), reading=reading)


def judged(
    kind: Kind, evidence: Evidence, *certificates: CertificateRecord, says: Sequence[Predicate] = (), **more: Any
) -> ClaimRecord:
    made = stated(kind, *says, **more)
    return make_record(made, evidence, code="papers/toy.py:1", seconds=0.5, certificates=certificates)


def joined_with(
    kind: Kind, evidence: Evidence, certificates: Sequence[CertificateRecord], *says: Predicate, **more: Any
) -> tuple[Evidence, bool]:
    stands = StatedClaim(**shared(StatedClaim, stated(kind, *says, **more)))
    joined, proved, _ = with_proofs(stands, evidence, certificates)
    return joined, proved


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
    assert wide.verdict is Verdict.UNDETERMINED and not wide.judgement.proved
    assert "do not decide whether the worst-case gain of given gains" in wide.judgement.supported


def test_two_theorems_give_the_narrowest_bracket_and_ends_are_rounded_outwards() -> None:
    third = certificate(lower="1/3", upper="2/3")
    wide = Evidence(method="m", value=0.4)
    joined, proved = joined_with(Kind.VALUE, wide, [third, certificate(lower="0", upper="1/2")], printed="0.4")
    assert not proved and joined == wide, "it straddles what the print stands for"
    narrow = certificate(lower="5/14", upper="5/13")
    joined, proved = joined_with(Kind.VALUE, Evidence(method="m", value=0.36), [third, narrow], printed="0.4")
    assert proved and isinstance(joined.lower, float) and isinstance(joined.upper, float)
    low, high = joined.lower, joined.upper
    assert Fraction(low) <= Fraction(5, 14) < Fraction(low) + Fraction(1, 2**53)
    assert Fraction(high) >= Fraction(5, 13) > Fraction(high) - Fraction(1, 2**53)


def test_a_statement_is_proved_by_what_its_theorems_say() -> None:
    evidence = Evidence(method="m", holds=True, margin=0.1)
    assert joined_with(Kind.FEASIBLE, evidence, [certificate(holds=True)]) == (evidence, True)


ENDS = ("4958645/10000000", "4999442/10000000")
ABOVE = Predicate(of=GAIN, relation="at most", to="0.4", unit="1", reading="none")
FLOATING = Evidence(method="m", holds=False, margin=-0.1, value=0.4958160, lower=0.4958160, upper=0.4999411)


@pytest.mark.parametrize("kind", [Kind.FEASIBLE, Kind.ORDER])
def test_a_proved_statement_shows_the_bracket_of_its_certificates_rounded_outwards(kind: Kind) -> None:
    proofs = [
        certificate(upper=ENDS[1]),
        certificate(lower=ENDS[0], holds=False),
        certificate(lower="1/10", holds=False),
    ]
    joined, proved = joined_with(kind, FLOATING, proofs, ABOVE)
    assert proved and isinstance(joined.lower, float) and isinstance(joined.upper, float)
    assert Fraction(joined.lower) <= Fraction(ENDS[0]) < Fraction(joined.lower) + Fraction(1, 2**54)
    assert Fraction(joined.upper) >= Fraction(ENDS[1]) > Fraction(joined.upper) - Fraction(1, 2**54)
    assert joined.value == joined.lower
    assert joined_with(kind, joined, proofs, ABOVE) == (joined, True)
    one_sided, _ = joined_with(kind, FLOATING, proofs[1:], ABOVE)
    assert (one_sided.lower, one_sided.upper) == (joined.lower, None)


@pytest.mark.parametrize(
    ("kind", "evidence", "proof", "printed", "joined"),
    [
        (Kind.VALUE, PAIR, {"items": (("1", "1"), ("7/4", "9/4"), ("-1/2", "-1/2"))}, "(1, 2-0.5i)",
         (PAIR.value, (1.0, (1.75, -0.5)), (1.0, (2.25, -0.5)))),
        # A bracket that is narrower than rounding moves the value to its end.
        (Kind.VALUE, Evidence(method="m", value=1.0 + 1e-12), {"lower": "1", "upper": "1"}, "1", (1.0, 1.0, 1.0)),
        (Kind.BOUND, Evidence(method="m", value=0.5, lower=0.4), {"upper": "5/8"}, "<0.7", (0.5, None, 0.625)),
        # Of a statement no bracket is shown that its certificates do not give.
        (Kind.FEASIBLE, FLOATING, {"holds": False}, "", (FLOATING.value, None, None)),
        (Kind.FEASIBLE, FLOATING, {"holds": False, "items": (("0", "1"), ("0", "1"))}, "",
         (FLOATING.value, None, None)),
    ],
)  # fmt: skip
def test_what_is_proved_shows_the_bracket_of_its_certificates_in_its_layout(
    kind: Kind, evidence: Evidence, proof: dict[str, Any], printed: str, joined: tuple[Any, ...]
) -> None:
    found, proved = joined_with(kind, evidence, [certificate(**proof)], printed=printed)
    assert proved and (found.value, found.lower, found.upper) == joined
    unproved, foreign = (certificate(**proof, **more) for more in ({"proved": False}, {"paper": "other"}))
    for other in (unproved, foreign):
        assert joined_with(kind, evidence, [other], printed=printed) == (evidence, False)


def test_brackets_of_a_statement_that_have_nothing_in_common_are_an_error() -> None:
    with pytest.raises(AuditError, match=r"prove \[0\.6, 0\.7.*\], and the computed value is 0\.4999411"):
        joined_with(Kind.FEASIBLE, FLOATING, [certificate(lower="6/10", upper="7/10", holds=False)], ABOVE)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        *((Kind.FEASIBLE, {"lower": end}) for end in (0.4958646, None)),
        *((Kind.FEASIBLE, {"upper": end}) for end in (0.4999411, None)),
        (Kind.FEASIBLE, {"value": 0.4958160}),
        *((Kind.VALUE, change) for change in ({"lower": 1.3256}, {"upper": 1.32585})),
        *((Kind.VALUE, change) for change in ({"proved": False}, {"certificates": ()})),
    ],
)
def test_a_proof_changed_by_hand_is_found(kind: Kind, change: dict[str, Any]) -> None:
    proof, says, evidence = certificate(lower="43441/32768", upper="43447/32768"), (), LEVEL
    if kind is Kind.FEASIBLE:
        proof, says, evidence = certificate(lower=ENDS[0], upper=ENDS[1], holds=False), (ABOVE,), FLOATING
    record = judged(kind, evidence, proof, says=says, printed="1.33" if kind is Kind.VALUE else "")
    file = replace(results_file(altered(record, expected=record.verdict)), certificates=(proof,))
    assert check(file, None) == []
    forged = replace(file, claims=(altered(file.claims[0], **change),))
    assert Cause.FORGED in [problem.cause for problem in check(forged, None)]


@pytest.mark.parametrize(
    ("kind", "evidence", "proof", "message"),
    [
        (Kind.VALUE, LEVEL, {"lower": "2", "upper": "3"}, "prove .2.0, 3.0., and the computed value is 1.3258"),
        (
            Kind.VALUE,
            LEVEL,
            {"lower": "133/100", "upper": "3"},
            r"prove .1\.32999\d*, 3\.0., and the computed value is 1",
        ),
        (Kind.FEASIBLE, Evidence(method="m", holds=True), {"holds": False}, "contradict the evidence"),
        (
            Kind.VALUE,
            Evidence(method="m", holds=True),
            {"lower": "133/100", "upper": "133/100"},
            "the evidence has none",
        ),
    ],
)
def test_a_theorem_that_contradicts_the_evidence_is_an_error(
    kind: Kind, evidence: Evidence, proof: dict[str, Any], message: str
) -> None:
    with pytest.raises(AuditError, match=message):
        joined_with(kind, evidence, [certificate(**proof)])
    assert judged(kind, evidence, certificate(**proof)).verdict is Verdict.ERROR


HOLDING, DIGITS = Evidence(method="m", holds=True), {"lower": "133/100", "upper": "133/100"}
ATTACKS: dict[str, tuple[Kind, Evidence, CertificateRecord, str]] = {
    **{
        what: (Kind.VALUE, LEVEL, certificate(of=of, **DIGITS), told)
        for what, of, told in (
            ("another plant", term("gain", "other"), "another plant: other, not toy"),
            ("an own plant of the same name", term("gain", "own plant toy"), "another plant: own plant toy, not toy"),
            ("an instance", term("gain", "toy", periods=[2, 3]), "for periods [2, 3] of all"),
            ("another class", term("gain", "toy", "one-step predictors"), "for one-step predictors, not for none"),
        )
    },
    "an unrelated theorem": (
        Kind.FEASIBLE,
        HOLDING,
        certificate(of=term("observability", "toy"), holds=True),
        "it is about the observability of (C, A), not the stability of the error system",
    ),
    "another reading": (
        Kind.VALUE,
        LEVEL,
        certificate(readings=("seconds",), **DIGITS),
        "under the reading seconds only, not none",
    ),
    "another unit": (Kind.VALUE, LEVEL, certificate(unit="dB", **DIGITS), "says it otherwise"),
    "the wrong side": (Kind.VALUE, LEVEL, certificate(lower="131/100"), "do not decide whether"),
    "bounds for a statement": (
        Kind.FEASIBLE,
        HOLDING,
        certificate(upper="1"),
        "it is about the worst-case gain of given gains, not the stability",
    ),
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_a_true_theorem_that_says_something_else_supports_and_does_not_prove(attack: str) -> None:
    kind, evidence, proof, difference = ATTACKS[attack]
    record = judged(kind, evidence, proof)
    assert not record.judgement.proved and difference in record.judgement.supported
    assert (record.evidence.value, record.evidence.lower) == (evidence.value, evidence.lower)
    file = replace(results_file(altered(record, expected=record.verdict)), certificates=(proof,))
    assert check(file, None) == []
    for forged in ({"proved": True}, {"supported": "Nothing is missing."}):
        assert Cause.FORGED in {
            problem.cause for problem in check(replace(file, claims=(altered(record, **forged),)), None)
        }


def test_a_claim_without_predicate_is_supported() -> None:
    made = claim(id="toy.c1", kind=Kind.FEASIBLE, printed="")
    record = make_record(made, Evidence(method="m", holds=True), certificates=[certificate(holds=True)])
    assert (record.judgement.proved, record.judgement.supported) == (False, NO_PREDICATE)


SMALL, LARGE = term("gain", "toy", N=1), term("gain", "toy", N=2)


@pytest.mark.parametrize(
    ("relation", "upper", "proved", "holds"),
    [
        ("less than", "1", True, True),
        ("at most", "2", True, True),
        ("less than", "5/2", False, None),
        ("more than", "1", True, False),
        ("is not", "1", True, True),
        ("is", "1", True, False),
        ("is", "2", False, None),
        ("is not", "2", False, None),
    ],
)
def test_the_order_of_two_terms_follows_from_their_brackets(
    relation: Relation, upper: str, proved: bool, holds: bool | None
) -> None:
    both = [certificate(of=SMALL, lower="0", upper=upper), certificate(of=LARGE, lower="2", upper="3")]
    said = Predicate(of=SMALL, relation=relation, to=LARGE, unit="1", reading="none")
    evidence = Evidence(method="m", holds=holds is not False)
    assert joined_with(Kind.ORDER, evidence, both, said) == (evidence, proved)
    assert joined_with(Kind.ORDER, evidence, both[:1], said) == (evidence, False)


@pytest.mark.parametrize(
    ("ours", "theirs", "holds"),
    [
        ((1, 1), (1, 1), (False, True, True, False)),
        ((0, 1), (1, 2), (None, True, None, False)),
        ((1, 2), (0, 1), (False, None, True, None)),
        ((0, 1), (2, 3), (True, True, False, False)),
        ((0, 2), (1, 3), (None, None, None, None)),
    ],
)
def test_an_end_that_two_brackets_share_decides_the_relations_that_hold_it(
    ours: tuple[int, int], theirs: tuple[int, int], holds: tuple[bool | None, ...]
) -> None:
    one, other = (Interval(*map(Fraction, ends)) for ends in (ours, theirs))
    relations: tuple[Relation, ...] = ("less than", "at most", "at least", "more than")
    assert tuple(compared(relation, one, other) for relation in relations) == holds


def test_theorems_that_contradict_each_other_are_an_error() -> None:
    both = [certificate(holds=holds) for holds in (True, False)]
    with pytest.raises(AuditError, match="contradict each other"):
        joined_with(Kind.FEASIBLE, Evidence(method="m", holds=True), both)


def test_every_part_of_a_claim_must_be_said_and_one_false_part_refutes_it() -> None:
    second = Predicate(of=term("observability", "toy"), unit="yes or no", reading="none")
    says = (Predicate(of=STABLE, unit="yes or no", reading="none"), second)
    one, true, false = certificate(holds=True), *(certificate(of=second.of, holds=holds) for holds in (True, False))
    holding, failing = (Evidence(method="m", holds=holds) for holds in (True, False))
    assert joined_with(Kind.FEASIBLE, holding, [one], *says) == (holding, False)
    assert joined_with(Kind.FEASIBLE, holding, [one, true], *says) == (holding, True)
    assert joined_with(Kind.FEASIBLE, failing, [one, false], *says) == (failing, True)


def test_a_claim_that_rests_on_several_readings_needs_a_theorem_under_each() -> None:
    outcomes = tuple(Outcome(reading=name, holds=True) for name in ("a", "b"))
    evidence = Evidence(method="m", holds=True, outcomes=outcomes)
    says = [Predicate(of=STABLE, unit="yes or no", reading=name) for name in ("a", "b")]
    first, second = (certificate(readings=(name,), holds=True) for name in ("a", "b"))
    assert joined_with(Kind.FEASIBLE, evidence, [first, second], *says) == (evidence, True)
    assert joined_with(Kind.FEASIBLE, evidence, [first], *says) == (evidence, False)
    assert joined_with(Kind.FEASIBLE, evidence, [first, second], says[0]) == (evidence, False)


def test_a_theorem_under_another_reading_than_that_of_the_claim_proves_nothing() -> None:
    """The predicate is under `b`, and so is the theorem; the verdict rests on `a`."""
    under = Predicate(of=STABLE, unit="yes or no", reading="b")
    evidence, proof = Evidence(method="m", holds=True), certificate(readings=("b",), holds=True)
    for reading, proved in (("a", False), ("none", False), ("b", True)):
        record = judged(Kind.FEASIBLE, evidence, proof, says=(under,), printed="", reading=reading)
        assert record.judgement.proved is proved
        assert proved or f"othing is said under the reading {reading}" in record.judgement.supported


def test_numbers_that_contradict_each_other_stop_the_run() -> None:
    first, second = certificate(lower="4/3"), certificate(upper="5/4")
    with pytest.raises(AuditError, match="contradict each other: one says at least 4/3, another at most 5/4"):
        joined_with(Kind.VALUE, LEVEL, [first, second])


def test_what_plants_and_statements_import_renews_a_proof(tmp_path: Path) -> None:
    """Directly and not, and from where a function imports it; what they do not import leaves it as it is."""
    root = project(tmp_path)
    folder = root / "papers" / "toy"
    files = {
        "statements": "from papers.toy.rule import holds", "rule": "from papers.toy import deeper", "deeper": "x = 1",
        "plants": "def plants(data):\n    from papers.toy.data import y\n    return y", "data": "y = {}",
        "__init__": "", "other": "z = 1",
    }  # fmt: skip
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    (root / "papers" / "__init__.py").write_text("", encoding="utf-8")
    seen = dict(wanted(root, ["toy"])[0][0].subject)
    for name in files:
        (folder / f"{name}.py").write_text(files[name] + "\n# changed", encoding="utf-8")
        changed = dict(wanted(root, ["toy"])[0][0].subject)
        assert (changed != seen) is (name != "other"), name
        seen = changed
    (folder / "rule.py").write_text("def (", encoding="utf-8")
    with pytest.raises(AuditError, match=r"rule\.py"):
        wanted(root, ["toy"])


def test_a_certificate_that_is_not_proved_proves_nothing() -> None:
    refused = certificate(proved=False, reason="P_0 is not positive definite", lower="1", upper="2")
    good = certificate(lower="43441/32768", upper="43447/32768")
    assert judged(Kind.VALUE, LEVEL, good, refused).judgement.proved is False
    problems = check(replace(results_file(judged(Kind.VALUE, LEVEL, refused)), certificates=(refused,)), None)
    assert (refused.path, Cause.ERROR) in [(problem.where, problem.cause) for problem in problems]


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
    beside = ["papers/toy/printed.toml", "papers/toy/theorems.json", "replication/verify/stdlib"]
    assert sorted(entry.subject) == ["certificates/toy/c.json", *beside]
    assert reasons == {"toy.c2": "a random draw"}


def test_the_proofs_of_a_file_must_be_of_the_certificates_that_lie_there(tmp_path: Path) -> None:
    (entry,), _ = wanted(project(tmp_path), ["toy"])
    proof = certificate(sha256=entry.subject[entry.path], holds=True)
    record = judged(Kind.FEASIBLE, Evidence(method="m", holds=True), proof, printed="")
    page = PaperRecord(**dict.fromkeys(PaperRecord.__struct_fields__, ()) | {"key": "toy"})
    file = replace(results_file(record), papers=(page,), certificates=(proof,))

    def told(file: ResultsFile) -> list[tuple[str, str]]:
        return [(problem.where, problem.message) for problem in against_files(file, tmp_path)]

    assert told(file) == []
    (tmp_path / entry.path).write_text("{ }", encoding="utf-8")
    assert told(file) == [(entry.path, "the file is not the one that was verified; run the audit again")]
    gone = replace(file, certificates=())
    assert told(gone) == [(entry.path, "the certificate is wanted and not in the file")]
    vague = replace(file, claims=(altered(record, unproved="too hard"),))
    assert (record.id, "the reason why there is no theorem is not the one that the paper gives") in told(vague)


def test_a_malformed_list_of_theorems_is_named(tmp_path: Path) -> None:
    (project(tmp_path) / "papers" / "toy" / "theorems.json").write_text('[{"name": "c"}]', encoding="utf-8")
    with pytest.raises(AuditError, match=r"papers/toy/theorems\.json\[0\] lacks the field"):
        wanted(tmp_path, ["toy"])
