"""The audit of the multi-rate paper: verdicts, and that they change when the print or the plant does."""

from __future__ import annotations

import copy
import dataclasses
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import pytest

from papers.okajima2023 import PAPER
from papers.okajima2023.claims.blog import longest_gap
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.experiments.declared import SEED, both, pair
from papers.okajima2023.experiments.designs import build, constant_matrix, design, norm_of_gains, of_filters
from papers.okajima2023.experiments.identities import summation
from papers.okajima2023.experiments.simulations import distribution, draws, tail_probability, timing_draws
from papers.okajima2023.printed import GAINS, PLANT, TABLE_1
from replication.audit.model import Verdict
from replication.audit.parts import ScopeItem
from replication.audit.run.pool import processes
from replication.audit.run.runner import Outcome, run
from replication.audit.store.cache import Cache
from replication.errors import InvalidInputError
from replication.estimation.multirate.optimum import optimum

ROOT = Path(__file__).resolve().parents[2]
KEY = PAPER.key
AGREEMENT = 1e-8
NORM_OF_GAINS = 1e-7


@pytest.mark.slow
def test_theorems_say_every_claim_that_they_are_about(fresh_run: Outcome) -> None:
    claims = {claim.id.partition(".")[2]: claim for claim in fresh_run.results.claims if claim.paper == KEY}
    about = {name: claim.judgement for name, claim in claims.items() if claim.evidence.certificates}
    assert [name for name, judgement in about.items() if not judgement.proved] == []
    assert all(claim.judgement.unproved for name, claim in claims.items() if name not in about)


@pytest.mark.slow
def test_three_routes_agree(fresh_run: Outcome) -> None:
    designs = {n: r for n, r in fresh_run.results_by_experiment.items() if n.startswith(f"{KEY}.design.")}
    assert len(designs) == 13
    for name, result in designs.items():
        assert result["lmi"]["level"] == pytest.approx(result["optimum"], rel=AGREEMENT), name
        assert result["reduced_lmi"]["level"] == pytest.approx(result["optimum"], rel=AGREEMENT), name
        for norm in (result["lmi"]["norm"], result["reduced_lmi"]["norm"], result["norm_central"]["value"]):
            assert result["lower"] * (1 - 1e-12) <= norm <= result["optimum"] * (1 + NORM_OF_GAINS), name


@pytest.mark.slow
def test_changed_plant_turns_claims_red(tmp_path: Path) -> None:
    """The same claims on a plant with one entry of A moved by a twentieth: no level agrees with print and proofs."""
    plant = copy.deepcopy(PLANT)
    plant["A"][0][0] -= 0.05
    wanted = {f"{KEY}.{pair(periods)}" for periods in TABLE_1}
    changed = tuple(
        dataclasses.replace(experiment, inputs={**experiment.inputs, "plant": plant})
        for experiment in PAPER.experiments
        if experiment.name in wanted
    )
    columns = [claim for claim in PAPER.claims if claim.id.startswith(f"{KEY}.table1.")]
    claims = tuple(msgspec.structs.replace(claim, repeats="") for claim in columns)
    paper = msgspec.structs.replace(
        PAPER, experiments=changed, claims=claims, errata=(), figures=(), tables=(), findings=lambda results: (),
        scope=(ScopeItem(part="Table 1", claims=tuple(claim.id for claim in claims)),),
    )  # fmt: skip
    outcome = run([paper], cache=Cache(tmp_path), root=ROOT, executor=partial(processes, jobs=1))
    assert {record.verdict for record in outcome.results.claims} <= {Verdict.DIFFERS, Verdict.ERROR}


def test_design_refuses_a_plant_that_does_not_fit() -> None:
    plant = PLANT | {"C": [[1.0, 0.0]], "D": [[1.0]]}
    with pytest.raises(InvalidInputError, match="C must have 3 columns"):
        design(plant, [2], [0], [0])


def test_table_entry_that_differs_is_bracketed_away_from_the_print() -> None:
    result = design(PLANT, [2, 1], [0, 0], [0, 1])
    assert result["upper"] < 1.135 < float(TABLE_1[2, 1])


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


def test_draws_depend_on_the_seed_and_not_on_the_parts() -> None:
    case = {"periods": [3, 3], "offsets": [0, 1], "sensors": [0, 1], "gains": GAINS["39"]}

    def found(seed: int, parts: int) -> object:
        answers = [
            draws(PLANT, {"own": case}, 20, seed, part, parts, sigma=0.2, noisy=50, last=60) for part in range(parts)
        ]
        return distribution(answers, "own", {"own": 0.4})

    assert found(1, 1) == found(1, 3) != found(2, 3)


def test_timings_are_ranked_by_draws_as_by_their_variance() -> None:
    cases = {f"timing-{n}": {**both((3, 3), n - 1), "gains": GAINS[str(37 + n)]} for n in (1, 2, 3)}
    found = timing_draws(PLANT, cases, 200, SEED, sigma=0.2, noisy=500, last=600)
    assert sum(found["least"].values()) == pytest.approx(1.0)
    by_draws, by_variance = (sorted(cases, key=found[what].__getitem__) for what in ("mean_energy", "long_run"))
    assert by_draws == by_variance == ["timing-2", "timing-3", "timing-1"]
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
