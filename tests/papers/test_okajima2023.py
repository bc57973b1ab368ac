"""The audit of the multi-rate paper: what is computed, what the text lacks, and what follows the print alone."""

import copy
from itertools import pairwise

import numpy as np
import pytest
from computed import Computed
from faults import put, verdict

from papers.okajima2023 import PAPER, paper
from papers.okajima2023.claims import levels
from papers.okajima2023.claims.blog import longest_gap
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.experiments.declared import (
    SEED,
    both,
)
from papers.okajima2023.experiments.designs import build, constant_matrix, norm_of_gains, of_filters
from papers.okajima2023.experiments.simulations import summation, tail_probability, timing_draws
from papers.okajima2023.printed import DATA, GAINS, PLANT, poles
from replication.audit.model import Verdict
from replication.audit.run.runner import Outcome
from replication.errors import AuditError
from replication.estimation.multirate.optimum import optimum

KEY = PAPER.key
AGREEMENT = 1e-8


@pytest.mark.slow
def test_theorems_say_every_claim_that_they_are_about(fresh_run: Outcome) -> None:
    claims = {claim.id.partition(".")[2]: claim for claim in fresh_run.results.claims if claim.paper == KEY}
    about = {name: claim.judgement for name, claim in claims.items() if claim.evidence.certificates}
    assert [name for name, judgement in about.items() if not judgement.proved] == []
    assert all(claim.judgement.unproved for name, claim in claims.items() if name not in about)


def test_printed_gains_are_within_a_unit_of_the_optimum() -> None:
    result = norm_of_gains(PLANT, [3, 3], [0, 0], GAINS["38"], 0.0005)
    assert result["optimum"] <= result["norm"]["value"] <= result["optimum"] + result["rounding_spread"]


def test_counterexamples_are_found_and_only_those() -> None:
    def cell(periods: tuple[int, int], level: float) -> dict[str, object]:
        return {"periods": list(periods), "synchronous": {"lower": level, "upper": level + 1e-6}}

    table = [cell((1, 1), 1.0), cell((1, 2), 1.2), cell((2, 1), 0.9), cell((2, 2), 1.3)]
    assert [(shorter, longer) for _, shorter, longer in counterexamples(table, "synchronous")] == [([1, 1], [2, 1])]


def test_longest_gap_is_cyclic() -> None:
    assert longest_gap([[0.0], [1.0], [0.0], [0.0]]) == 3
    assert longest_gap([[1.0], [1.0]]) == 0


def test_tail_probability_is_two_sided_and_never_zero() -> None:
    draws = np.arange(1.0, 100.0)
    assert tail_probability(draws, 50.0) == 1.0
    assert tail_probability(draws, -5.0) == pytest.approx(2 / 100)
    assert tail_probability(draws, 500.0) == tail_probability(draws, -5.0)


def test_timings_are_ranked_by_draws_as_by_their_variance() -> None:
    cases = {f"timing-{n}": {**both((3, 3), n - 1), "gains": GAINS[str(37 + n)]} for n in (1, 2, 3)}
    found = timing_draws(PLANT, cases, 200, SEED, sigma=0.2, noisy=500, last=600)
    assert sum(found["least"].values()) == pytest.approx(1.0)
    best_first = ["timing-2", "timing-3", "timing-1"]
    assert sorted(cases, key=found["long_run"].__getitem__) == best_first
    assert all(found["smaller"][a][b] > 0.5 for a, b in pairwise(best_first))
    for name, others in found["smaller"].items():
        assert all(fraction + found["smaller"][other][name] == 1.0 for other, fraction in others.items())


def test_steps_of_the_proof_hold_above_the_level_and_not_below() -> None:
    def steps(slack: float) -> dict[str, float]:
        return summation(PLANT, **both((2, 3)), gains=GAINS["33"], slack=slack, draws=3, last=20, seed=SEED)

    above, below = steps(0.05), steps(-0.05)
    assert above["epsilon"] > 0 > below["epsilon"]
    assert above["largest_ratio"] < above["bound_28"] < above["level"]
    assert max(above["sum_residual"], below["sum_residual"]) < 1e-12


def test_one_matrix_does_not_exist_where_one_instant_alone_is_unstable() -> None:
    analysed = {name: {**both((3, 3), theta), "gains": GAINS[name]} for theta, name in ((1, "39"), (2, "40"))}
    found = constant_matrix(PLANT, [2, 1], [0, 0], analysed)["analyses"]
    assert found["40"]["constant"] is None
    assert found["40"]["largest_radius"] > 1 > found["39"]["largest_radius"]
    assert found["39"]["constant"] > found["39"]["periodic"]


@pytest.mark.parametrize(
    ("periods", "sensors", "better"), [([2], [0], True), ([3], [1], False), ([2, 3], [0, 1], False)]
)
def test_filters_are_between_predictors_and_smoothers(periods: list[int], sensors: list[int], better: bool) -> None:
    problem = build(PLANT, periods, [0] * len(periods), sensors)
    predictor, smallest = optimum(problem), optimum(of_filters(problem))
    # Smoothers do as well for the state of one instant earlier.
    assert smallest.noncausal.value == pytest.approx(predictor.noncausal.value, rel=AGREEMENT)
    assert predictor.noncausal.lower <= smallest.value * (1 + AGREEMENT)
    assert (smallest.value < 0.99 * predictor.value) is better
    if not better:
        assert smallest.value == pytest.approx(predictor.value, rel=AGREEMENT)


LACKING = ("poles", "is-unstable", "gains-optimal", "error-poles")
"""Claims on the matrix that the text at hand lacks."""


@pytest.mark.slow
@pytest.mark.parametrize("name", LACKING)
def test_a_matrix_with_the_stated_poles_would_not_be_lacking(name: str) -> None:
    (claim,) = (claim for claim in PAPER.claims if claim.id == f"{KEY}.unstable.{name}")
    results = Computed(KEY)
    assert verdict(PAPER, claim, results) is claim.expected is Verdict.UNDETERMINED
    put("unstable.as-printed/poles", poles(DATA["poles"]))(results)
    with pytest.raises(AuditError, match="judge the claims on it by that matrix"):
        claim.answer(results)


def test_a_fault_in_print_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    gains, plant = copy.deepcopy(GAINS), copy.deepcopy(PLANT)
    gains["39"][0][1][1] = 0.001
    plant["D"][0][1] = 0.5
    (claim,) = (claim for claim in PAPER.claims if claim.id == f"{KEY}.gains.unmeasured")
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.noise-index")
    assert claim.answer({}).holds and erratum.prove({}).holds
    monkeypatch.setattr(levels, "GAINS", gains)
    monkeypatch.setattr(paper, "PLANT", plant)
    assert not claim.answer({}).holds
    assert not erratum.prove({}).holds
