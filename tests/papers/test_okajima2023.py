"""The audit of the multi-rate paper: what is computed, and that each answer, and each proof of an erratum, can fail.

A fault is one number that an experiment might have returned and did not, or one printed number. It must change the
verdict, to another one than an error.
"""

import copy
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from computed import Computed
from faults import Fault, Results, all_of, put, times, verdict

from papers.okajima2023 import PAPER, errata
from papers.okajima2023.claims import levels
from papers.okajima2023.claims.blog import longest_gap
from papers.okajima2023.claims.levels import counterexamples
from papers.okajima2023.experiments.declared import (
    CASES,
    DRAWS,
    GAIN_SETS,
    PERIOD_TABLE,
    SEED,
    TIMINGS,
    both,
    case,
    gain_set,
    pair,
)
from papers.okajima2023.experiments.designs import build, constant_matrix, design, norm_of_gains, of_filters
from papers.okajima2023.experiments.identities import summation
from papers.okajima2023.experiments.simulations import DENOMINATORS, distribution, draws, tail_probability, timing_draws
from papers.okajima2023.printed import DATA, GAINS, PLANT, SCHEDULES, TABLE_1, poles
from replication.audit.model import Claim, Kind, Verdict
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


def test_levels_of_another_plant_are_not_those_of_the_table() -> None:
    """With one entry of A moved by a twentieth no column agrees with the print."""
    plant = copy.deepcopy(PLANT)
    plant["A"][0][0] -= 0.05
    assert not any(f"{design(plant, **both(periods))['optimum']:.2f}" == level for periods, level in TABLE_1.items())


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


def test_draws_depend_on_the_seed() -> None:
    case = {"periods": [3, 3], "offsets": [0, 1], "sensors": [0, 1], "gains": GAINS["39"]}
    one, again, other = (
        distribution(draws(PLANT, {"own": case}, 20, seed, sigma=0.2, noisy=50, last=60), {"own": 0.4})
        for seed in (1, 1, 2)
    )
    assert one == again != other


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


def copied(source: str, target: str, *entries: str) -> Fault:
    """Entries of one result in another."""

    def change(results: Results) -> None:
        results[target] |= {entry: results[source][entry] for entry in entries}

    return change


def level(name: str, factor: float = 1.01) -> Fault:
    """Another optimum, with its bracket."""
    return all_of(*(put(f"{name}/{end}", times(factor)) for end in ("optimum", "lower", "upper")))


def gain(name: str) -> Fault:
    return all_of(*(put(f"{name}/norm/{end}", times(1.01)) for end in ("value", "lower", "upper")))


def drawn(who: str, *path: str, factor: float) -> Fault:
    return put("/".join((DRAWS, who, *path)), times(factor))


def in_order(results: Results) -> None:
    """A table of periods in which each longer period has the larger optimum."""
    for cell in results[PERIOD_TABLE]:
        for timing in ("synchronous", "best"):
            cell[timing] |= dict.fromkeys(("lower", "upper"), float(sum(cell["periods"])))


def measured(name: str) -> Fault:
    """A sensor that measures where it does not, or the other way round."""
    return put(f"schedule.{name}/diagonals/1/0", lambda entry: 1.0 - entry)


LEVELS = {
    "gamma.proposed": case("proposed"),
    "blog.proposed": case("proposed"),
    **{f"{part}.case-{name.lower()}": case(name) for part in ("gamma", "blog") for name in "ABC"},
    **{f"table1.n{a}{b}": pair((a, b)) for a, b in TABLE_1},
    **{f"{part}{n}": name for part in ("timing.case-", "blog.timing-") for n, name in enumerate(TIMINGS, start=1)},
    "blog.n11": pair((1, 1)),
    "blog.n33": pair((3, 3)),
}
RECOVERED = "unstable.recovered"
FAULTS: dict[str, Fault] = {
    **{claim: level(name) for claim, name in LEVELS.items()},
    # It differs, and agrees with a slightly larger optimum.
    "table1.n21": level(pair((2, 1)), 1.0005),
    **{f"gains.eq{equation}": gain(gain_set(equation)) for equation in GAIN_SETS},
    **{f"schedule.{name}": measured(name) for name in SCHEDULES},
    "schedule.common-period": put("schedule.sec-4a/period", 12),
    "size.cyclic-larger": put(f"{case('proposed')}/size/cyclic_rows", 9),
    "size.variables": put(f"{case('proposed')}/size/variables", 72),
    "size.rows": put(f"{case('proposed')}/size/rows", 8),
    "theory.observable": put("observability/margin", 0.0),
    "theory.dual-rate": measured("dual-rate"),
    "theory.error-system": put("identities/error_system", 1e-6),
    "theory.dissipation": put("identities/dissipation", 1e-6),
    "theory.schur": put("identities/schur", 1e-6),
    "theory.product": put("product-orders/shifted/0", times(1.001)),
    "theory.summation": put("summation/excess_27", -1e-3),
    "theory.sufficient-1": put(f"{gain_set('40')}/spectral_radius", 1.001),
    "theory.sufficient-2": put(f"{pair((3, 3), 1)}/lmi/norm", times(1.01)),
    "theory.theorem1": put(f"{gain_set('39')}/theorem1", times(1.0001)),
    "theory.theorem2": put(f"{pair((3, 3), 1)}/lmi/level", times(0.9999)),
    "theory.gains-attain": put(f"{case('C')}/lmi/norm", times(1.0001)),
    "theory.stable": put(f"{gain_set('40')}/spectral_radius", 1.001),
    "order.proposed-best": level(case("A"), 0.5),
    "order.shorter-in-table": level(pair((1, 3)), 1.2),
    "order.timing-matters": copied(TIMINGS[2], TIMINGS[1], "lower", "upper"),
    "order.timing-best": level(TIMINGS[2], 0.99),
    "order.more-outputs": drawn("B", "errors", factor=0.2),
    "order.beyond-table": in_order,
    "gains.depend-on-timing": copied(TIMINGS[0], TIMINGS[1], "gains"),
    # The print counts as met while one reading of the denominator allows it, so the fault is in all of them.
    **{
        f"gsim.{name.lower()}": all_of(*(drawn(name, "ratios", reading, factor=4.0) for reading in DENOMINATORS))
        for name in CASES
    },
    "gsim.below-level": level(case("B"), 0.25),
    "gsim.smallest": drawn("proposed", "ratios", DENOMINATORS[2], factor=2.0),
    "simulation.lowest-error": drawn("B", "errors", factor=0.2),
    "simulation.truncation": drawn("C", "largest_tail_effect", factor=1e7),
    "simulation.timing": put("timing-draws/smaller/timing-2/timing-3", 0.45),
    "unstable.stabilised": put("unstable.any-entries/radius", 1.1),
    "unstable.one-plant": put(f"{RECOVERED}/outputs/error_poles/0/0", 1.1),
    "unstable.designable": put("unstable.stated-designs/any entries/reduced_lmi/norm", times(1.001)),
    "blog.periodic-matrices": put("constant-matrix/analyses/38/constant", 1.43),
    "blog.idle-instants": put("schedule.case-1/diagonals/1/0", 1.0),
    "blog.evenness": put("schedule.case-2/diagonals/1/1", 0.0),
}
ERRATA: dict[str, Fault] = {
    "denominator": drawn("A", "ratios", DENOMINATORS[-1], factor=1.5),
    "diagonal-of-a": put("unstable.diagonals/found/1/fits", 1),
    "sensor-index": put("schedule.sec-4a/diagonals/0", [1.0, 1.0, 1.0]),
}
LACKING = ("poles", "is-unstable", "gains-optimal", "error-poles")
"""Claims on the matrix that the text at hand lacks."""
IN_PRINT = {"gains.unmeasured": (levels, "GAINS"), "noise-index": (errata, "PLANT")}
"""What a claim or erratum reads from the printed data alone."""


def verdict_on(claim: Claim, results: Results) -> Verdict:
    return verdict(PAPER, claim, results, proof=True)


def named(names: dict[str, Any]) -> list[Any]:
    """The names as parameters; those that need the long search are slow."""
    long = ("unstable.", "setting", "diagonal")
    return [pytest.param(name, marks=pytest.mark.slow) if name.startswith(long) else name for name in names]


def test_every_claim_and_erratum_has_a_fault() -> None:
    lacking = {f"{KEY}.unstable.{name}" for name in LACKING}
    checked = {claim.id for claim in PAPER.claims if claim.kind is not Kind.CITED} - lacking
    assert {f"{KEY}.{name}" for name in (*FAULTS, "gains.unmeasured")} == checked
    assert {f"{KEY}.{name}" for name in (*ERRATA, "noise-index")} == {erratum.id for erratum in PAPER.errata}


@pytest.mark.parametrize("name", named(FAULTS))
def test_a_fault_changes_the_verdict(name: str) -> None:
    (claim,) = (claim for claim in PAPER.claims if claim.id == f"{KEY}.{name}")
    before = verdict_on(claim, Computed(KEY))
    assert before is claim.expected
    faulty = Computed(KEY)
    FAULTS[name](faulty)
    assert verdict_on(claim, faulty) not in (before, Verdict.ERROR)


@pytest.mark.slow
@pytest.mark.parametrize("name", LACKING)
def test_a_matrix_with_the_stated_poles_would_not_be_lacking(name: str) -> None:
    (claim,) = (claim for claim in PAPER.claims if claim.id == f"{KEY}.unstable.{name}")
    results = Computed(KEY)
    assert verdict_on(claim, results) is claim.expected is Verdict.UNDETERMINED
    put("unstable.as-printed/poles", poles(DATA["poles"]))(results)
    with pytest.raises(AuditError, match="judge the claims on it by that matrix"):
        claim.answer(results)


@pytest.mark.parametrize("name", named(ERRATA))
def test_a_fault_refutes_the_proof_of_an_erratum(name: str) -> None:
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.{name}")
    results = Computed(KEY)
    assert erratum.prove(results).holds
    ERRATA[name](results)
    assert not erratum.prove(results).holds


def test_a_fault_in_print_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    gains, plant = copy.deepcopy(GAINS), copy.deepcopy(PLANT)
    gains["39"][0][1][1] = 0.001
    plant["D"][0][1] = 0.5
    (claim,) = (claim for claim in PAPER.claims if claim.id == f"{KEY}.gains.unmeasured")
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.noise-index")
    assert claim.answer({}).holds and erratum.prove({}).holds
    for (module, name), faulty in zip(IN_PRINT.values(), (gains, plant), strict=True):
        monkeypatch.setattr(module, name, faulty)
    assert not claim.answer({}).holds
    assert not erratum.prove({}).holds


def test_repeats_print_the_number_of_another_claim_again() -> None:
    claims = {claim.id: claim for claim in PAPER.claims}
    repeats = [claim for claim in PAPER.claims if claim.repeats]
    assert len(repeats) == 11
    for claim in repeats:
        original = claims[claim.repeats]
        assert (claim.printed, claim.reading) == (original.printed, original.reading)
        assert not original.repeats and original.id != claim.id
