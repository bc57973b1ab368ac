"""The verdicts of a fresh run, paper by paper: each is the pinned one, and a print that is one unit off has another."""

from __future__ import annotations

import msgspec
import pytest

import papers
from papers import KEYS
from replication.audit.judge.verdict import rejudge
from replication.audit.model import Kind, Policy, Verdict
from replication.audit.run.runner import Outcome

PAPERS = {paper.key: paper for paper in papers.load()}
FLIPPED = {"mustafa": 4, "okajima2023": 50}
"""Prints of one number that come out, moved up and down: at least so many."""
COMES_OUT = (Verdict.REPRODUCED, Verdict.REPRODUCED_AFTER_ERRATUM)


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_every_claim_has_its_pinned_verdict(key: str, fresh_run: Outcome) -> None:
    claims = [claim for claim in fresh_run.results.claims if claim.paper == key]
    assert len(claims) == len(PAPERS[key].claims) >= 30
    assert {claim.id: claim.judgement.reason for claim in claims if claim.unexpected} == {}
    assert fresh_run.failures == ()
    (findings,) = (paper.findings for paper in fresh_run.results.papers if paper.key == key)
    assert len(findings) == len(set(findings)) >= 10


def test_no_number_differs_that_is_computed_from_printed_results() -> None:
    """Where gains or a filter went in as printed, the evidence would have to hold the range over their rounding."""
    papers_ = [PAPERS[key] for key in FLIPPED]
    inputs = {experiment.name: set(experiment.inputs) for paper in papers_ for experiment in paper.experiments}
    differing = [claim for paper in papers_ for claim in paper.claims if claim.expected is Verdict.DIFFERS]
    assert differing
    for claim in differing:
        used = set().union(*(inputs[name] for name in claim.uses))
        assert not used & {"gains", "printed_gains", "printed", "stated_poles"}, claim.id


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_every_erratum_is_proved(key: str, fresh_run: Outcome) -> None:
    errata = [erratum for erratum in fresh_run.results.errata if erratum.paper == key]
    assert len(errata) == len(PAPERS[key].errata)
    assert [erratum.id for erratum in errata if not erratum.holds or erratum.error] == []


@pytest.mark.slow
@pytest.mark.parametrize("key", FLIPPED)
def test_one_unit_in_the_last_place_flips_the_verdict(key: str, fresh_run: Outcome) -> None:
    errata = {erratum.id: erratum for erratum in fresh_run.results.errata}
    flipped = 0
    for record in fresh_run.results.claims:
        if record.paper != key or record.claim.kind is not Kind.VALUE or record.verdict not in COMES_OUT:
            continue
        places = len(record.claim.printed.partition(".")[2])
        for sign in (1, -1):
            other = f"{float(record.claim.printed) + sign * 10.0**-places:.{places}f}"
            reprinted = msgspec.structs.replace(record.claim, printed=other)
            moved = rejudge(msgspec.structs.replace(record, claim=reprinted), errata, readings=PAPERS[key].readings)
            # One unit more of an optimum may be where a solver stopped; that is no agreement as printed.
            by_solver = sign > 0 and Policy.SOLVER in moved.policies
            assert moved.verdict is (Verdict.COMPATIBLE if by_solver else Verdict.DIFFERS), (record.id, moved.reason)
            flipped += moved.verdict not in COMES_OUT
    assert flipped >= FLIPPED[key]
