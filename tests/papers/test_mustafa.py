"""The audit of the nonuniform-sampling paper and its method: routes, grids, identities, errata, verdicts, brackets."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from papers.mustafa import PAPER, certificates
from papers.mustafa.experiments.levels import grids, level_curve, nominal, problem, subject
from papers.mustafa.experiments.small_gain import _modal, condition, identities
from papers.mustafa.method import (
    AS_PRINTED,
    CORRECT,
    Step4,
    UpperEnd,
    build_grid,
    covered_interval,
    robust_lmi_design,
    small_gain_alpha,
)
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, example, printed_filter, upper_end
from replication.audit.data import PrintedValue
from replication.audit.run.runner import Outcome
from replication.estimation.nonuniform.filters import periodic_gain
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import robust_design
from replication.verify.run import check

OSCILLATOR, OSCILLATOR_RANGE = problem(**example(1))
MOTOR, MOTOR_RANGE = problem(**example(2))
EXACT = 1e-12


def test_lmi_13_improves_with_more_cells_holds_at_every_period_and_never_beats_the_common_optimum():
    """Eliminating xi = Delta eta with the multiplier gives (10) at every period of the cell, up to what is lost."""
    designs = [robust_lmi_design(OSCILLATOR, OSCILLATOR_RANGE, cells) for cells in (4, 8, 16)]
    levels, design = [design.level for design in designs], designs[1]
    assert levels[0] > levels[1] > levels[2] > robust_design(OSCILLATOR, OSCILLATOR_RANGE).design.level
    for h in OSCILLATOR_RANGE.nodes(25):
        gain = periodic_gain(OSCILLATOR, design.filter, [float(h)]).value
        assert gain <= design.level * (1 + 1e-6)


@pytest.mark.parametrize(("plant", "periods"), [(OSCILLATOR, OSCILLATOR_RANGE), (MOTOR, MOTOR_RANGE)])
def test_the_correct_algorithm_1_covers_unless_its_limit_is_reached(plant, periods):
    grid = build_grid(plant, periods, CORRECT)
    assert grid.end == "COVERED"
    reached = periods.h_l
    for interval in grid.intervals:
        assert interval.lower < reached + 1e-15
        reached = max(reached, interval.upper)
    assert reached > periods.h_u
    # Step 1 comes before step 3: a grid of N_0 elements ends the run even if it covers.
    for limit in (1, len(grid.periods)):
        assert build_grid(plant, periods, CORRECT, limit=limit).end == "LIMIT"
    assert build_grid(plant, periods, CORRECT, limit=len(grid.periods) + 1).end == "COVERED"


def test_covered_interval_is_where_the_bound_of_lemma_3_reaches_one():
    h, gain = 1.0, 3.0
    for A in ([[-2.0, 1.0], [0.0, -1.0]], [[-2.0, 5.0], [0.0, -1.0]]):
        plant = SampledPlant(A, [[1], [1]], [[1, 1]], [[1]], [[1, 0]])
        interval = covered_interval(plant, h, gain, UpperEnd.CORRECTED)
        for end, sign in ((interval.lower, -1), (interval.upper, 1)):
            mu = np.linalg.eigvalsh((sign * plant.A + sign * plant.A.T) / 2)[-1]
            assert gain * np.expm1(mu * abs(end - h)) / mu == pytest.approx(1.0, rel=EXACT)
    slow = SampledPlant([[-4.0]], [[1]], [[1]], [[1]], [[1]])
    assert covered_interval(slow, h, gain).upper == np.inf


def test_brackets_of_the_small_gain_hold_for_three_states() -> None:
    A = [[0, 1, 0], [-4, -1, 2], [0, 0, -3]]
    B, L = [[0, 0], [1, 0], [0, 1]], [[0, 1, 0], [1, 0, 1]]
    system = SampledPlant(A, B, [[1, 0, 0]], [[0.1, 0.2]], L)
    h = PeriodRange(1 / 20, np.pi / 30).middle
    made = certificates._bracket(system, h, 1e-6)
    lower, upper = Fraction(made["lower"]), Fraction(made["upper"])
    assert lower < small_gain_alpha(system, h) < upper < lower * Fraction("1.000003")


@pytest.mark.parametrize("name", ["nominal-1-upper", "nominal-2-lower", "printed-filter-lower", "grid-2", "stall-1"])
def test_theorems_of_the_paper_are_made_again(name: str) -> None:
    theorem = check(certificates.make(name))
    assert theorem.sentence


KEY = PAPER.key


def test_what_the_root_of_step_4_adds_depends_on_what_is_read_between_range_and_union() -> None:
    uncut = {}
    for e in EXAMPLES:
        runs = grids(**example(e), limit=20)["algorithm"]
        for step_4 in (Step4.SET_MINUS, Step4.CUT):
            assert {runs[form.name]["end"] for form in AS_PRINTED[step_4]} == {"STALLED"}
        uncut |= {(e, form.upper): runs[form.name] for form in AS_PRINTED[Step4.UNCUT]}
        assert runs[CORRECT.name]["end"] == "COVERED"
    assert {case: (run["end"], run["size"]) for case, run in uncut.items()} == {
        (1, UpperEnd.PRINTED): ("LIMIT", 20),
        (1, UpperEnd.CORRECTED): ("LIMIT", 20),
        (2, UpperEnd.PRINTED): ("STALLED", 1),
        (2, UpperEnd.CORRECTED): ("STALLED", 3),  # then the union has no upper end, and so no middle
    }


def test_the_levels_hold_between_the_ends_and_not_beyond() -> None:
    """Next to either end the norm of the filter is on the side of the printed level that the end says."""
    printed = printed_filter()
    problem_2 = example(2)
    level = upper_end(GAMMA[2])
    found = level_curve(**problem_2, printed=printed, nodes=41, level=level)
    system, span = problem(**problem_2)
    filter_ = subject(system, span, printed)
    assert span.h_l < found["holds_from"] < found["middle"] < found["holds_to"] < span.h_u
    for end, inward in ((found["holds_from"], 1e-6), (found["holds_to"], -1e-6)):
        assert periodic_gain(system, filter_, [end + inward]).value < level
        assert periodic_gain(system, filter_, [end - inward]).value > level


def test_ends() -> None:
    assert example(1)["periods"] == pytest.approx([0.01, np.pi / 25], rel=1e-15)
    assert upper_end("0.0952") == pytest.approx(0.09525, rel=1e-15)


ERRATA = {erratum.id.removeprefix(f"{KEY}."): erratum for erratum in PAPER.errata}
LMI, CONSTANTS, PRINTED = DATA["lmi"], DATA["constants"], DATA["filter"]
RESULTS: dict[str, Callable[[], dict[str, Any]]] = {
    "unit-of-J": dict,
    "step": dict,
    "motor-constant": lambda: {"nominal.2": nominal(**example(2))},
    "row": lambda: {"identities": identities(2, 1)},
}
"""What the proof of an erratum reads beside the text."""


@pytest.mark.parametrize(
    ("name", "entry", "other"),
    [
        pytest.param("unit-of-J", "J", PrintedValue("0.01", "Sec. VI-B", "kg m^2"), id="a unit without the misprint"),
        pytest.param("step", "step-against-large-grids", "1", id="the step without the misprint"),
        pytest.param("motor-constant", "filter", {**PRINTED, "B_f": "[0.6505; 1.0674]"}, id="filter for K_theta = 0"),
        *(
            pytest.param("motor-constant", "constants", {**CONSTANTS, which: [*CONSTANTS[which], symbol]}, id=symbol)
            for which, symbol in (("with a value", "K_theta"), ("in A", "K_e"))
        ),
        pytest.param("row", "lmi", {**LMI, "right": LMI["right"][1:]}, id="a square right half"),
        pytest.param("row", "lmi", {**LMI, "right": [*dict.fromkeys(LMI["right"]), "0, 0"]}, id="no row twice"),
    ],
)
def test_the_text_and_not_another_one_proves_an_erratum(name: str, entry: str, other: Any) -> None:
    results = RESULTS[name]()
    assert ERRATA[name].prove(results).holds
    with patch.dict(DATA, {entry: other}):
        assert not ERRATA[name].prove(results).holds


def test_the_elements_by_condition_8_cover_and_fewer_do_not() -> None:
    """By the formula in modal coordinates on a finer mesh: the grid of Algorithm 1 covers, its first element not."""
    given = example(1)
    system, span = problem(**given)
    rates, h = np.linalg.eigvals(system.A), span.nodes(1001)
    found = condition(**given, nodes=41, centres=3)
    assert np.max(_modal(rates, np.array([span.middle]), h)) > 1
    quarters = np.array([span.h_l + (span.h_u - span.h_l) * part for part in (0.5, 0.1, 0.9)])
    assert np.max(np.min(_modal(rates, quarters, h), axis=0)) < 1
    assert 1 < found["modal_elements"] <= found["elements"]


@pytest.mark.slow
def test_brackets_are_narrow_and_above_the_print(fresh_run: Outcome) -> None:
    results = fresh_run.results_by_experiment
    for e, printed in GAMMA.items():
        found = results[f"{KEY}.bracket.{e}"]
        assert float(printed) < found["lower"] < found["upper"] < 1.01 * found["lower"]
        seconds = results[f"{KEY}.bracket-duration.{e}"]
        assert float(printed) < seconds["lower"] < seconds["upper"] < found["lower"], "as it is said below the bars"
        robust = results[f"{KEY}.robust.{e}"]
        # The design is the best of all filters for one Lyapunov function, so no filter is guaranteed less by one.
        assert robust["guaranteed"] < found["common"] * (1 + 1e-3)
        # Knowing what comes must pay: the tree ends below what one Lyapunov function proves.
        assert found["upper"] < found["common"]
        assert robust["one_cell_small_gain"] > 1
        nominal = results[f"{KEY}.nominal.{e}"]
        # The second example is degenerate: there a solver stays far from the infimum.
        routes = [nominal["riccati"], *([nominal["printed_lmi"], *nominal["lmi"].values()][:3] if e == 1 else [])]
        assert routes == pytest.approx([nominal["formula"]] * len(routes), rel=1e-8)
