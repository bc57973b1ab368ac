"""Claims of the papers and their theorems: taken away, exchanged or moved, a theorem proves the claim no more."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import patch

import msgspec
import pytest

import papers
from replication.audit.judge import proofs
from replication.audit.judge.match import Match, _told, match
from replication.audit.model import Evidence, Outcome, StatedClaim
from replication.audit.run.prove import prove
from replication.audit.store.records import CertificateRecord

ROOT = Path(__file__).parents[2]
CLAIMS = {claim.id: claim for paper in papers.load() for claim in paper.claims}


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
