"""The delay paper: its transcription, what could fool its experiments, its records of seconds, its degree rules."""

import runpy
from operator import ge

import computed
import numpy as np
import pytest

from papers.peet2019 import PAPER
from papers.peet2019.claims.cost import largest_ratio, printed_seconds
from papers.peet2019.claims.gains import attained
from papers.peet2019.claims.theory import GROUPS, OF_OUR_COPY
from papers.peet2019.experiments import identities, scaling
from papers.peet2019.experiments.declared import OFF_THE_PRINT
from papers.peet2019.experiments.examples import as_printed, refuted, synthesised
from papers.peet2019.experiments.identities import DELAYS, MISPRINTS, N, Poly, coercive, matrix_3, sample, storage
from papers.peet2019.experiments.readings import HOUSE, READINGS, Rule, attainable, inside
from papers.peet2019.printed import COLUMNS, DATA, DELAY_COUNTS, EXAMPLES, STATES, published
from replication.estimation.delay import delay_system
from replication.estimation.delay.sos.cone import ConeBlock
from replication.estimation.delay.sos.synthesis import assemble, program
from replication.estimation.validation import Array
from replication.verify.delay import levels
from replication.verify.delay.sos import bases, kernels

ROUNDING = 1e-10


def test_misprints_of_the_identity_that_may_be_of_the_copy_are_those_of_the_errata_that_say_so() -> None:
    errata = {erratum.id.removeprefix("peet2019."): erratum for erratum in PAPER.errata}
    assert {name for name in GROUPS if errata[name].scan} == set(OF_OUR_COPY)
    assert sorted(name for names in GROUPS.values() for name in names) == sorted({*MISPRINTS} - {"none"})


def test_the_storage_is_coercive_by_the_corrected_difference() -> None:
    """With S, Q and R zero and P = I by hand; with τ_K = 1 print and correction would agree."""
    x = sample(np.random.default_rng(3))
    assert coercive(x, 0.0) == {"corrected": 0.0, "printed": 0.0}
    nothing = Poly(np.zeros((3, 2, 2)))
    x.p, x.q, x.s = np.eye(2), [nothing] * 2, [nothing] * 2
    x.r = [[Poly(np.zeros((3, 3, 2, 2)))] * 2] * 2
    assert storage(x) == pytest.approx(DELAYS[-1] * float(x.e0 @ x.e0))


def test_a_wrong_term_in_lmi_3_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def smaller(p: Array, z: Array, plant: dict[str, Array], gamma: float) -> Array:
        matrix = matrix_3(p, z, plant, gamma)
        matrix[:N, N:] *= 0.9
        return matrix

    monkeypatch.setattr("papers.peet2019.experiments.identities.matrix_3", smaller)
    found = identities.lmi_3(10, 5)
    assert found["largest"] > 1.0 and found["form"] > 1e-3


def test_what_refutes_the_printed_signs_spares_the_limit_and_the_corrected_ones() -> None:
    found = as_printed(EXAMPLES["2"], 1)
    assert found["0.001"]["refuted"] and not found["0.0"]["refuted"]
    assert not refuted(program(assemble(delay_system(**EXAMPLES["2"]), 1), 1e-3))


@pytest.mark.parametrize(("erratum", "plant"), [("eq-2-dimensions", "1"), ("eq-2-limits", "3")])
def test_errata_by_the_print_follow_the_print(erratum: str, plant: str, monkeypatch: pytest.MonkeyPatch) -> None:
    prove = next(entry.prove for entry in PAPER.errata if entry.id == f"peet2019.{erratum}")
    monkeypatch.setitem(EXAMPLES, plant, EXAMPLES[plant] | {"delays": [1.0], "c2": EXAMPLES[plant]["b"]})
    assert not prove({}).holds


def test_seconds_are_recorded_for_every_published_cell() -> None:
    cells = scaling.timed(scaling.recorded(scaling.SECONDS))
    assert set(cells) == {f"ex{e}.{c}" for e in EXAMPLES for c in COLUMNS} | {f"n{n}k{k}" for n, k, _ in published()}
    assert all(cell["solver"] is not None for name, cell in cells.items() if name.startswith("ex"))
    assert all(cell["assembly"] > 0.0 for cell in cells.values())


def test_costs_of_equal_products_are_compared() -> None:
    assert largest_ratio({(1, 6): 1.0, (2, 3): 3.0, (6, 1): 2.0, (1, 5): 100.0}) == 3.0
    assert 1.5 < largest_ratio(printed_seconds()) < 2.0


def test_the_cost_does_not_say_more_than_the_point_holds() -> None:
    found = scaling.cost(2, 2, None, threads=1)
    residuals = found["solver"]["residuals"]
    assert 0.0 < found["gamma"] < float(DATA["small-gain"].lstrip("<"))
    # The point is inside the cones by more than it misses the equalities.
    assert residuals["least eigenvalue"] > residuals["equalities"]
    # With more threads SDPA may add in another order, which is all that may change.
    assert scaling.cost(2, 2, None, threads=2)["gamma"] == pytest.approx(found["gamma"], rel=1e-4)


@pytest.mark.parametrize(("states", "delays"), [(1, 1), (3, 2), (2, 5)])
def test_certificate_of_the_small_cone_is_one_of_degree_one(states: int, delays: int) -> None:
    found = scaling.small_cone_cost(states, delays, scaling.SMALL_LEVEL)
    full, program = found["full"], scaling.cost_program(states, delays, scaling.SMALL_LEVEL)
    assert full["equalities"] == program.a.shape[0] > found["equalities"]
    assert full["residual"] < ROUNDING and full["least_eigenvalue"] > -ROUNDING
    assert found["solver"]["residuals"]["least eigenvalue"] > 0.0


def test_the_record_of_the_full_run_holds_every_published_cell_and_the_one_left_out() -> None:
    small = [cell for cell in scaling.recorded(scaling.FULL_RUN) if cell["cone"] == "bessel"]
    assert {(cell["states"], cell["delays"]) for cell in small} == {(n, k) for n in STATES for k in DELAY_COUNTS}
    for cell in small:
        assert cell["gamma"] < float(DATA["small-gain"].lstrip("<"))
        assert cell["residual"] < ROUNDING and cell["peak"] < 10.0


def test_the_page_of_the_full_run_is_that_of_its_record() -> None:
    path = scaling.FULL_RUN.parents[2] / "benchmarks" / "bench_delay.py"
    module = runpy.run_path(str(path))
    assert path.with_name("delay_full.md").read_text(encoding="utf-8") == module["page"](module["recorded"]())


@pytest.mark.slow
def test_no_reading_of_the_degree_rule_gives_both_prints() -> None:
    found = computed.result("peet2019.readings")
    printed = {example: float(DATA[f"gamma-{example}"]["d1"]) for example in OFF_THE_PRINT}
    assert attainable(found, printed) == attained(found) == ("z2-wide", "z2-total-z1", "z2-total-next")
    for name in attained(found):  # γ solved at the ε for the print is the print: it is linear enough
        for example, part in found[name].items():
            assert part["epsilon"] > 0.0 and part["solved"] == pytest.approx(printed[example], abs=1e-5)
    # The rule of the library, by other code and in both units.
    for example in OFF_THE_PRINT:
        ours = synthesised(EXAMPLES[example], 1)["tensor"]["gamma"]
        house = found[HOUSE][example]
        assert [house["gamma"], house["rescaled"]] == pytest.approx([ours] * 2, rel=1e-6)


def test_rules_that_hold_all_certificates_of_another_are_known() -> None:
    held = {name: {other for other in READINGS if inside(READINGS[name], READINGS[other], 1)} for name in READINGS}
    assert held["z2-outer"] >= {"z2-total-same", "z2-each-same", "z2-wide"}
    assert held["z2-total"] >= {"z2-each", "z2-total-same", "z2-total-z1", "z2-total-next"}
    assert "z2-outer" not in held["z2-inner"] and held["z2-wide"] == {"z2-wide"}
    for name, others in held.items():
        assert all(held[other] <= others for other in others), name


def _members(block: ConeBlock) -> set[tuple[int, int]]:
    return set(zip(*(powers.tolist() for powers in block.kernel_basis()), strict=True))


@pytest.mark.parametrize("degree", levels.DEGREES)
def test_theorems_speak_of_the_rules_that_hold_their_squares(degree: int) -> None:
    """What the verifier says of the readings, against the members of Z_1 and Z_2 that they list."""
    for given in range(1, degree + 1):
        for total, name in ((False, "z2-each"), (True, "z2-total")):
            said = levels.above(degree, total=total).readings({"degree": given})
            shape = READINGS[name].storage(given)
            fixed = Rule(lambda _, shape=shape: shape, lambda _, shape=shape: shape)
            holding = {other for other, rule in READINGS.items() if inside(fixed, rule, degree)}
            assert set(said) == holding if given == degree else set(said) <= holding
        for rule, name in levels.NARROW.items():
            assert levels.narrow(degree).readings({"degree": given, "rule": rule}) == (name,)
            allowed = READINGS[name].storage(degree)
            # A bound from below is on all squares of the reading, of a lower degree too.
            assert all(block.degree == degree for block in allowed)
            assert all(_members(block) == set(kernels(degree, rule)) for block in allowed)
            assert levels.narrow(given, ge).readings({"degree": degree, "rule": rule}) == (name,)
            for (_, order, powers), block in zip(bases(given, rule), allowed, strict=True):
                assert order <= block.degree
                assert set(powers) <= _members(block)
    assert levels.narrow(degree).readings({"degree": degree + 1, "rule": "outer"}) == ()
    assert levels.narrow(degree + 1, ge).readings({"degree": degree, "rule": "inner"}) == ()
    assert set(levels.ALL) == set(READINGS)
