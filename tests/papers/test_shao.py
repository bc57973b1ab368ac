"""The audit of the alternating predictive observer: transcription, pinned verdicts, and what changed data would do."""

import json
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest

from papers.shao import PAPER, data, problem
from papers.shao.claims_table import any_reading
from papers.shao.experiments import SEARCH
from papers.shao.findings import findings
from papers.shao.method.search import BlockResult, search_block
from papers.shao.search import block, merged, table_columns
from replication.audit.judge.validate import validate_claims
from replication.audit.judge.verdict import make_record
from replication.audit.model import Verdict
from replication.audit.store.jsonvalues import encode
from replication.estimation.dualrate.loop import close_loop, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS

SECOND_TRANSCRIPTION = """
sin(t/2) - 11.38 1.02
sin(t) - 13.89 2.93
sin(3t/2) - 18.21 5.42
sin(2t) - 24.73 9.91
sin(5t/2) - 33.85 16.73
sin(3t) - 42.03 25.92
"""
CLAIMS = {claim.id: claim for claim in PAPER.claims}
FINDINGS_USE = ("shao.bounds", "shao.theorem", "shao.table", "shao.transients", "shao.orderings")
EXPERIMENTS = {experiment.name: experiment for experiment in PAPER.experiments}


@cache
def result(name: str) -> object:
    """What the experiment leaves in the store: JSON values."""
    experiment = EXPERIMENTS[name]
    return json.loads(encode(name, experiment.function(**experiment.inputs)))


def verdict(claim_id: str, results: dict[str, object] | None = None) -> Verdict:
    claim = CLAIMS[claim_id]
    found = results or {name: result(name) for name in claim.uses}
    proof = None
    if claim.erratum is not None:
        erratum = next(e for e in PAPER.errata if e.id == claim.erratum)
        proof = erratum.prove({name: result(name) for name in erratum.uses})
    return make_record(claim, claim.answer(found), proof).verdict


def test_table_was_transcribed_twice_with_the_same_outcome() -> None:
    rows = [line.split() for line in SECOND_TRANSCRIPTION.strip().splitlines()]
    assert tuple(row[0] for row in rows) == data.REFERENCES
    assert tuple(row[2] for row in rows) == data.TABLE_PMI
    assert tuple(row[3] for row in rows) == data.TABLE_APO
    words = {"sin(t/2)": 0.5, "sin(t)": 1, "sin(3t/2)": 1.5, "sin(2t)": 2, "sin(5t/2)": 2.5, "sin(3t)": 3}
    assert tuple(words[row[0]] for row in rows) == problem.FREQUENCIES


def test_the_paper_is_well_formed_and_has_about_forty_claims() -> None:
    validate_claims([PAPER])
    assert len(PAPER.claims) >= 40
    assert sum(claim.id.startswith("shao.table.") and claim.id[-1].isdigit() for claim in PAPER.claims) == 18


@pytest.mark.parametrize(
    "claim_id", [claim.id for claim in PAPER.claims if not set(claim.uses) & {*SEARCH, "shao.stable-sets"}]
)
def test_each_claim_has_its_pinned_verdict(claim_id: str) -> None:
    assert verdict(claim_id) is CLAIMS[claim_id].expected


def test_every_erratum_holds() -> None:
    for erratum in PAPER.errata:
        assert erratum.prove({name: result(name) for name in erratum.uses}).holds, erratum.id


def test_a_printed_value_one_unit_off_is_not_reproduced() -> None:
    claim = replace(CLAIMS["shao.motor.torque-constant"], printed="3.67")
    evidence = claim.answer({"shao.motor": result("shao.motor")})
    assert make_record(claim, evidence).verdict is Verdict.DIFFERS


def test_changed_data_turn_claims_red() -> None:
    """A motor that ties the radius, and a table that agrees, are told from the pinned verdicts."""
    table = dict(result("shao.table"))
    agreeing = {**table, "ratios": {**table["ratios"], problem.APO: [float(v) for v in data.TABLE_APO]}}
    assert verdict("shao.table.apo-3", {"shao.table": agreeing}) is Verdict.REPRODUCED
    weak = {**table, "radius": {**table["radius"], problem.APO: 1.5}}
    assert verdict("shao.stability.apo", {"shao.table": weak}) is Verdict.DIFFERS


def test_erratum_without_its_proof_does_not_count() -> None:
    claim = CLAIMS["shao.motor.feedforward"]
    evidence = claim.answer({"shao.motor": result("shao.motor")})
    assert make_record(claim, evidence).verdict is Verdict.ERROR


def test_stored_blocks_merge_to_what_was_searched() -> None:
    small = replace(problem.READINGS, horizon=6, substeps=8)
    found = [search_block(small, table_columns(4, 1), index) for index in (0, 3)]
    stored = [json.loads(json.dumps(asdict(one))) for one in found]
    again = merged(stored)
    assert isinstance(again, BlockResult)
    assert again == merged([asdict(one) for one in reversed(found)])


def test_steady_state_is_near_that_of_a_fast_sensor_and_the_transient_is_not() -> None:
    table, constants = result("shao.table"), result("shao.transients")["time_constants"]
    own, fast = (np.array(table["ratios"][name]) for name in (problem.APO, problem.FAST))
    assert np.abs(own / fast - 1)[1:].max() < 0.03
    assert constants[problem.APO] > 5 * constants[problem.FAST]
    assert all(constants[problem.APO] > constants[name] for name in (problem.PMI, problem.HELD, problem.SINGLE))


def test_every_cell_of_the_table_was_simulated_at_its_own_frequency() -> None:
    agreement = result("shao.table")["agreement"]
    for name in (problem.PMI, problem.APO):
        assert len(agreement[name]) == len(problem.FREQUENCIES)
        assert max(agreement[name]) < 1e-10


def test_bounds_of_the_proof_are_approached_and_a_broken_one_is_told() -> None:
    bounds = result("shao.bounds")
    assert 0.2 < bounds["worst"]["12"] <= 1
    broken = {**bounds, "worst": {**bounds["worst"], "14": 1.01}}
    assert verdict("shao.theory.estimate-bound", {"shao.bounds": broken}) is Verdict.DIFFERS


def test_weak_gain_finding_is_not_an_artefact_of_the_table_experiment() -> None:
    """Held measurements with L/M: the loop itself, built again, is stable and slow as the virtual one."""
    weak = replace(problem.DESIGN, injection=problem.DESIGN.injection / problem.DESIGN.ratio)
    virtual = stability_radius(close_loop(problem.DESIGN, OBSERVERS[problem.APO]))
    for name in (problem.PMI, problem.HELD):
        assert stability_radius(close_loop(weak, OBSERVERS[name])) == pytest.approx(virtual, rel=0.02)


@pytest.mark.slow
def test_no_reading_hits_table_one_and_near_misses_are_chance() -> None:
    results = {name: result(name) for name in SEARCH}
    found = merged(list(results.values()))
    assert sum(found.tried.values()) >= 1e6
    assert found.joint_hits == 0
    assert verdict("shao.table.any-reading") is Verdict.DIFFERS
    assert 0 < sum(found.distinct.values()) < sum(found.tried.values()) / 10
    words = " ".join(findings({**results, **{name: result(name) for name in FINDINGS_USE}}))
    assert "Not searched: delays" in words
    assert f"{100 * found.joint['apo'].values[0]:.2f}" in words
    shares = [v for k, v in any_reading(results).quantities.items() if k.startswith("share")]
    assert len(shares) == 3
    assert min(shares) > 0.05


@pytest.mark.slow
def test_a_block_of_the_search_is_the_same_again() -> None:
    assert json.dumps(block(3, 5, 7)) == json.dumps(block(3, 5, 7))
    assert np.isfinite(block(3, 5, 7)["joint_distance"])


@pytest.mark.slow
def test_figures_have_data_and_words() -> None:
    for figure in PAPER.figures:
        drawn = figure.data({name: result(name) for name in figure.uses})
        assert all(np.all(np.isfinite(column)) for column in drawn.columns.values())
        assert len(figure.alt(drawn)) > 40
        assert figure.plot(drawn).axes
