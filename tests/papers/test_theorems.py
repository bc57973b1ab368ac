"""The theorems that papers want: there or excused, said as their claims say, and made again as tightly."""

import json
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import msgspec
import pytest

import papers
from papers.peet2019.certificates import make
from replication.audit.judge import proofs
from replication.audit.judge.proofs import Match, _told, match
from replication.audit.judge.validate import validate_theorems
from replication.audit.model import Evidence, Kind, Outcome, StatedClaim
from replication.audit.run.prove import prove
from replication.audit.store.records import CertificateRecord
from replication.certify.delay import dual, levels
from replication.verify.run import STATEMENTS, check, committed
from replication.verify.subjects import theorems

ROOT = Path(__file__).parents[2]
PROVABLE = (Kind.VALUE, Kind.BOUND, Kind.FEASIBLE)
OPEN = {
    "mustafa": {"performance-12"},
    "okajima2023": {
        *("simulation.truncation", "theory.summation"),
        *(f"unstable.{name}" for name in ("error-poles", "gains-optimal", "is-unstable", "poles")),
    },
    "peet2019": {"ex4.unstable", "theory.no-gains"},
    "shao": {"theory.prediction-rate"},
}
"""The claims of these kinds that have no theorem."""
PAPERS = papers.load()


def test_every_claim_is_wanted_as_a_theorem_or_says_why_not() -> None:
    for paper in PAPERS:
        wanted, unproved = theorems(paper.key)
        named = {claim for entry in wanted.values() for claim in entry.claims}
        excused = {claim for entry in unproved for claim in entry.claims}
        claims = {claim.id for claim in paper.claims}
        assert named | excused <= claims and not named & excused
        assert named | excused == claims or paper.key == "okajima2023"
        validate_theorems([paper], named, excused)
        provable = {claim.id for claim in paper.claims if claim.kind in PROVABLE}
        assert provable - named == {f"{paper.key}.{name}" for name in OPEN[paper.key]}


def test_every_wanted_theorem_has_a_file_and_a_statement() -> None:
    wanted = [entry for paper in PAPERS for entry in theorems(paper.key)[0].values()]
    assert {entry.statement for entry in wanted} <= set(STATEMENTS)
    files = committed(ROOT)
    assert [path for path in files if not path.is_file()] == []
    assert len(files) == len(wanted)
    sizes = [path.stat().st_size for path in files]
    assert max(sizes) < 300_000 and sum(sizes) < 8_000_000


CLAIMS = {claim.id: claim for paper in PAPERS for claim in paper.claims}


@cache
def recorded(paper: str, name: str) -> CertificateRecord:
    """The certificate as a run records it."""
    wanted = next(one for one in proofs.wanted(ROOT, [paper])[0] if one.name == name)
    return proofs.record(wanted, prove(wanted.path, str(ROOT), {}), "")


def matched(claim: str, *names: str, readings: tuple[str, ...] = ()) -> Match:
    """The match of a claim with these certificates; readings: those of the outcomes that its evidence has."""
    declared = CLAIMS[claim]
    stated = StatedClaim(**{name: getattr(declared, name) for name in StatedClaim.__struct_fields__})
    outcomes = tuple(Outcome(reading=reading) for reading in readings)
    return match(
        stated, Evidence(method="", outcomes=outcomes), [recorded(stated.id.partition(".")[0], n) for n in names]
    )


MEASURES = ("", "-fast-instants", "-corrected", "-corrected-fast-instants")


def test_an_entry_of_the_table_differs_only_if_it_does_under_each_reading() -> None:
    errors = [f"errors-apo{suffix}" for suffix in MEASURES]
    whole = matched("shao.table.apo-1", *errors)
    assert whole.proved and set(whole.by_reading.values()) == {False}
    fewer = matched("shao.table.apo-1", *errors[:-1])
    assert not fewer.proved and fewer.by_reading["literal"] is False
    assert "under the reading" in fewer.difference and "not corrected-feedforward-fast-instants" in fewer.difference
    other = matched("shao.table.apo-1", *[name.replace("apo", "pmi") for name in errors])
    assert not other.proved and "observer model_interpolation, not alternating_predictive" in other.difference


@pytest.mark.parametrize(
    ("claim", "names", "told"),
    [
        ("mustafa.gamma.1", ["nominal-1-lower"], "do not decide"),
        ("mustafa.gamma.2", ["robust-design-2"], "for from h_l, not middle"),
        ("mustafa.filter.norm", ["printed-filter-upper"], "do not decide"),
        ("mustafa.gamma.1", ["nominal-2-upper", "nominal-2-lower"], "another plant: example-2, not example-1"),
        ("mustafa.stable.2", ["stable-1"], "another plant: our-filter, not printed-filter"),
        ("mustafa.algorithm.1", ["stall-1"], "under the reading"),
        ("mustafa.algorithm.1", ["grid-2"], "another plant: example-2, not example-1"),
        ("mustafa.l3", ["lower-end-1"], "another plant: example-1, not example-2"),
        ("shao.stability.apo", ["radius-motor-src"], "observer single_rate, not alternating_predictive"),
        ("shao.motor.hurwitz-feedback", ["hurwitz-observer"], "matrix observer, not feedback"),
        ("shao.motor.feedforward", ["feedforward-printed"], "orders [2, 1, 0], not [3, 1, 2]"),
        ("peet2019.ex2.gamma-d3", ["ex2-d3-upper", "ex2-lower"], "under the reading z2-total"),
        ("peet2019.ex1.gamma-d2", ["ex1-upper"], "do not decide"),
        ("peet2019.ex1.unstable", ["ex2-unstable"], "another plant: ex2, not ex1"),
        ("peet2019.theory.theorem-4", ["lemma-5"], "part lemma-5, not theorem-4"),
        ("peet2019.theory.identity", ["observer-bound"], "bound (7)"),
    ],
)
def test_another_theorem_proves_nothing_and_the_difference_is_told(claim: str, names: list[str], told: str) -> None:
    found = matched(claim, *names)
    assert not found.proved
    assert told in found.difference


def test_what_theorems_decide_under_each_reading_is_proved_whichever_way() -> None:
    names = ["radius-motor-pmi", "radius-motor-held", "radius-motor-one-correction", "radius-motor-slow-input"]
    found = matched("shao.stability.pmi", *names)
    assert found.by_reading["literal"] is True and found.by_reading["pmi-slow-input"] is False
    assert found.proved and found.difference == ""
    without = matched("shao.stability.pmi", *names[:-1])
    assert not without.proved and without.by_reading["pmi-slow-input"] is None


def test_what_is_proved_along_some_solutions_is_not_proved_of_all() -> None:
    """The proof of Theorem 1 needs a derivative along its solutions; without that condition the claim is not proved."""
    for name in ("theorem-1", "vanishing-error"):
        claim = CLAIMS[f"peet2019.theory.{name}"]
        assert matched(claim.id, "observer-bound").proved
        (says,) = claim.says
        of_all = msgspec.structs.replace(claim, says=(replace(says, of=replace(says.of, setting={})),))
        with patch.dict(CLAIMS, {claim.id: of_all}):
            assert not matched(claim.id, "observer-bound").proved


def test_a_reading_of_the_evidence_of_which_nothing_is_said_is_open() -> None:
    names = ("ex1-pade-upper", "ex1-pade-lower")
    assert matched("peet2019.ex1.gamma-pade", *names).proved
    found = matched("peet2019.ex1.gamma-pade", *names, readings=("pade-square", "another"))
    assert not found.proved and "othing is said under the reading another" in found.difference


def test_what_theorems_decide_under_some_readings_is_said() -> None:
    told = _told(["nothing is said under the reading c"], {"a": False, "b": True, "c": None})
    assert told == "A theorem says it under b. A theorem denies it under a. Nothing is said under the reading c."
    assert _told([], {"a": True}) == ""


FOLDER = ROOT / "certificates" / "peet2019"
BRACKETS = {
    "ex1-upper": ("ex1-lower", 1.5e-6),
    "ex2-d1-lower": ("ex2-d1-upper", 1e-5),
    "ex2-lower": ("ex2-d3-upper", 6e-6),
    "ex1-pade-lower": ("ex1-pade-upper", 1.5e-6),
}
"""The committed theorem that bounds the same level from the other side, and the largest relative distance of the two.

What a solver returns depends on the processor in its last digits, so a certificate is not one file but one theorem.
"""
ROOT_WIDTH = Fraction(4, 2**levels.ROOT_BITS)


def kept(name: str) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return loaded


def is_proved(name: str, certificate: dict[str, Any]) -> bool:
    """Whether it proves the wanted theorem `name`, and with it a bracket as narrow as stated."""
    theorem = check(certificate, place=("peet2019", name))
    if name == "ex2-unstable":
        left, right = (Fraction(certificate["witness"][side]) for side in ("left", "right"))
        return theorem.holds is True and 0 < left < right <= left + ROOT_WIDTH
    other, width = BRACKETS[name]
    opposite = check(kept(other), place=("peet2019", other))
    lower, upper = (
        Fraction(
            str(next(bound for bound in (getattr(part, side) for part in (theorem, opposite)) if bound is not None))
        )
        for side in ("lower", "upper")
    )
    return lower < upper < lower * (1 + Fraction(width))


@pytest.mark.parametrize("name", [*BRACKETS, "ex2-unstable"])
def test_what_is_made_and_what_is_committed_prove_the_same_as_tightly(name: str) -> None:
    assert is_proved(name, kept(name))
    assert is_proved(name, json.loads(json.dumps(make(name))))


def test_a_looser_certificate_is_proved_but_too_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(levels, "STEPS", (5e-6,))
    monkeypatch.setattr(dual, "INTERIOR_STEPS", (2e-5,))
    monkeypatch.setattr(levels, "BELOW", 1e-5)
    monkeypatch.setattr(levels, "ROOT_BITS", 18)
    for name in (*BRACKETS, "ex2-unstable"):
        assert not is_proved(name, make(name)), name
