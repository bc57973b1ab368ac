"""The audit of the nonuniform-sampling paper: data, verdicts, brackets, and that they change when the print does."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from papers.mustafa import PAPER
from papers.mustafa.errata import dimension
from papers.mustafa.experiments.covering import _modal, condition
from papers.mustafa.experiments.identities import identities
from papers.mustafa.experiments.levels import grids, level_curve, nominal, problem, subject
from papers.mustafa.method import AS_PRINTED, CORRECT, WITH_SET_MINUS
from papers.mustafa.printed import DATA, EXAMPLES, GAMMA, example, printed_filter, upper_end
from replication.audit.data import PrintedValue
from replication.audit.run.runner import Outcome
from replication.estimation.nonuniform.filters import periodic_gain

KEY = PAPER.key


def test_transcription_of_the_plants() -> None:
    """A second reading of the numbers, typed from the text in another order and another form."""
    second = example(2)
    assert second["plant"]["A"] == [[-10.0, 1.0], [-0.02, -2.0]]
    assert (second["plant"]["L"], second["plant"]["C"], second["plant"]["B"]) == ([[0, 1]], [[1, 0]], [[2], [2]])
    assert second["plant"]["D"] == [[0.0]]
    assert second["periods"] == [0.001, 0.099]
    first = example(1)
    assert first["plant"]["A"] == [[0, 1], [-16, -4.8]]
    assert (first["plant"]["B"], first["plant"]["D"]) == ([[0], [16]], [[0.1]])
    assert first["plant"]["C"] == first["plant"]["L"] == [[1, 0]]
    assert first["periods"] == pytest.approx([0.01, 0.12566370614359174], rel=1e-15)
    printed = printed_filter()
    assert printed["A"] == [[-0.044, 0.0373], [-1.0674, 0.9048]]
    assert (printed["B"], printed["C"]) == ([[0.6505], [1.0666]], [[0, 1]])
    assert (GAMMA[1], GAMMA[2], DATA["gamma-14"]) == ("0.1017", "0.0952", "1.8174")
    assert list(DATA["gamma-13"].values()) == ["0.4647", "0.4876"]


def test_the_first_example_by_three_routes() -> None:
    result = nominal(**example(1))
    assert result["riccati"] == pytest.approx(result["formula"], rel=1e-8)
    for route in ("lmi", "printed_lmi"):
        assert result[route]["level"] == pytest.approx(result["formula"], rel=1e-8)
        assert result[route]["norm"] == pytest.approx(result["formula"], rel=1e-8)


def test_the_literal_algorithm_ends_by_itself() -> None:
    for e in EXAMPLES:
        runs = grids(**example(e), limit=20)["algorithm"]
        assert runs[AS_PRINTED.name]["end"] == "STALLED"
        assert runs[CORRECT.name]["end"] == "COVERED"


def test_identities_tell_right_from_wrong() -> None:
    found = identities(5, 1)
    assert found["map reordered"] < 1e-10 < found["map as printed"]
    assert found["(12) as printed"] > 1e-10 > found["congruence"]
    assert max(found["recovery"], found["sigma 11"]) < 1e-10


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


def test_upper_end_and_dimensions() -> None:
    assert upper_end("0.0952") == pytest.approx(0.09525, rel=1e-15)
    assert dimension("N m s") == dimension("kg m^2 s^-1") == (1, 2, -1)


def test_restoring_the_set_minus_does_not_end_the_stall() -> None:
    for e in EXAMPLES:
        assert grids(**example(e), limit=20)["algorithm"][WITH_SET_MINUS.name]["end"] == "STALLED"


def test_every_erratum_of_the_text_alone_is_proved() -> None:
    proofs = {erratum.id: erratum.prove({}) for erratum in PAPER.errata if not erratum.uses}
    assert {f"{KEY}.unit-of-J", f"{KEY}.step"} == set(proofs)
    assert all(proof.holds for proof in proofs.values())


def test_a_wrong_unit_or_step_is_not_proved(monkeypatch: pytest.MonkeyPatch) -> None:
    """The two proofs fail on a text without the misprints."""
    errata = {erratum.id: erratum for erratum in PAPER.errata}
    monkeypatch.setitem(DATA, "J", PrintedValue("0.01", "Sec. VI-B", "kg m^2"))
    monkeypatch.setitem(DATA, "step-against-large-grids", "1")
    assert not errata[f"{KEY}.unit-of-J"].prove({}).holds
    assert not errata[f"{KEY}.step"].prove({}).holds


def test_another_filter_does_not_bear_out_the_motor_constant(monkeypatch: pytest.MonkeyPatch) -> None:
    """With A_f = Phi - B_f C for K_theta = 0 in the second row the proof fails."""
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.motor-constant")
    results = {f"{KEY}.nominal.2": nominal(**example(2))}
    assert erratum.prove(results).holds
    monkeypatch.setitem(DATA["filter"], "B_f", PrintedValue("[0.6505; 1.0674]", "Sec. VI-B"))
    assert not erratum.prove(results).holds


def test_the_motor_constant_is_one_only_if_both_symbols_are_alone() -> None:
    """A value for K_theta, or another symbol without one, leaves the reading open."""
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.motor-constant")
    results, constants = {f"{KEY}.nominal.2": nominal(**example(2))}, DATA["constants"]
    for which, symbol in (("with a value", "K_theta"), ("in A", "K_e")):
        with patch.dict(DATA, {"constants": {**constants, which: [*constants[which], symbol]}}):
            assert not erratum.prove(results).holds


def test_a_square_right_half_has_no_row_too_many() -> None:
    (erratum,) = (erratum for erratum in PAPER.errata if erratum.id == f"{KEY}.row")
    results = {f"{KEY}.identities": identities(2, 1)}
    assert erratum.prove(results).holds
    lmi = DATA["lmi"]
    for right in (lmi["right"][1:], [*dict.fromkeys(lmi["right"]), "0, 0"]):
        with patch.dict(DATA, {"lmi": {**lmi, "right": right}}):
            assert not erratum.prove(results).holds


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
        robust = results[f"{KEY}.robust.{e}"]
        # The design is the best of all filters for one Lyapunov function, so no filter is guaranteed less by one.
        assert robust["exchange"] < found["common"] * (1 + 1e-6)
        # Knowing what comes must pay: the tree ends below what one Lyapunov function and what half the leaves prove.
        half = min(level for leaves, level in found["history"] if leaves <= found["leaves"] / 2)
        assert found["upper"] < half < found["common"]
        assert robust["exchange"] == pytest.approx(robust["dense"], rel=1e-6)
        assert robust["exchange"] < found["lower"] or e == 2
        # The certified level is the number to quote: the solver's own may lie a rounding below it.
        assert robust["guaranteed"] == pytest.approx(robust["exchange"], rel=1e-3)
        assert robust["one_cell_small_gain"] > 1
    degenerate = results[f"{KEY}.nominal.2"]
    assert degenerate["riccati"] == pytest.approx(degenerate["formula"], rel=1e-6)


@pytest.mark.slow
def test_figures_can_be_drawn_and_described(fresh_run: Outcome) -> None:
    for figure in PAPER.figures:
        drawn = figure.data({name: fresh_run.results_by_experiment[name] for name in figure.uses})
        assert figure.plot(drawn) is not None
        assert any(character.isdigit() for character in figure.alt(drawn))
