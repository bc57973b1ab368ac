"""Claims of this paper follow their print, plant and results; second computations of what they rest on."""

import copy
import json
from dataclasses import asdict, replace
from functools import cache
from itertools import product
from typing import Any

import msgspec
import numpy as np
import pytest
from computed import Computed, result
from faults import Fault, verdict
from scipy.integrate import simpson
from scipy.signal import cont2discrete

from papers._common import by_margin
from papers.shao import PAPER, printed
from papers.shao.claims.table import ordering_counts, where_larger
from papers.shao.experiments import theorem
from papers.shao.experiments.theorem import prediction_gap, rate_gap
from papers.shao.experiments.tracking import SEARCH, _energy, _over_windows, table_columns
from papers.shao.method.readings import search_block, windowed_errors
from papers.shao.printed import APO, COLUMNS, DESIGN, PMI, READINGS, START
from replication.audit.model import NO_READING, Verdict
from replication.estimation.dualrate.loop import Points, time_response
from replication.estimation.dualrate.problem import make_plant

CLAIMS = {claim.id.removeprefix("shao."): claim for claim in PAPER.claims}


@cache
def small_block() -> dict[str, Any]:
    """A small search in the place of each block of the large one."""
    small = replace(READINGS, horizon=6, substeps=8)
    return json.loads(json.dumps(asdict(search_block(small, table_columns(), 0))))


class Small(Computed):
    def __missing__(self, name: str) -> Any:
        if name in SEARCH:
            self[name] = copy.deepcopy(small_block())
            return self[name]
        return super().__missing__(name)


def verdict_on(name: str, change: Fault | None = None, text: str | None = None) -> Verdict:
    claim = CLAIMS[name] if text is None else msgspec.structs.replace(CLAIMS[name], printed=text)
    results = Small(PAPER.key)
    if change is not None:
        change(results)
    return verdict(PAPER, claim, results)


def test_table_one_is_reproduced_if_the_nearest_reading_is_printed() -> None:
    claim = CLAIMS["table.any-reading"]
    rows = claim.answer(Small(PAPER.key)).value
    nearest = "[{}]".format("; ".join(" ".join(f"{value:.2f}" for value in row) for row in rows))
    assert verdict_on("table.any-reading") is Verdict.DIFFERS
    assert verdict_on("table.any-reading", text=nearest) is not Verdict.DIFFERS
    assert len(claim.printed.split(";")) == 6


def test_a_window_is_found_where_the_print_is_made_from_it() -> None:
    """The maximum over one window is planted as the print of a cell: the search hits it, and no cell as printed."""
    assert [cell["hits"]["long"] for column in COLUMNS for cell in result("shao.windows")[column]] == [0] * 12
    errors = windowed_errors(READINGS, READINGS.loop(APO, *printed.MEASURES["fast-instants"][:1], 1.0))
    index = READINGS.windows.index((3, 9))
    planted = float(errors[1, list(Points).index(Points.FAST), index])
    column = table_columns()["apo"]
    other = replace(column, values=np.full(6, planted), half_widths=np.full(6, 1e-9))
    found = _over_windows("apo", other, 1)
    assert found["hits"]["long"] >= 1
    assert found["nearest"] == pytest.approx(100 * planted)


@pytest.mark.parametrize(("row", "column"), [(1, 2), (2, 1), (2, 2)])
def test_another_plant_is_told_from_the_motor(row: int, column: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """One entry of A is off by a per cent: (23) is no longer these matrices, or the structure of x is lost."""
    state = DESIGN.model.A.copy()
    state[row, column] *= 1.01
    other = replace(DESIGN, model=make_plant(state, DESIGN.model.B_u, DESIGN.model.C))
    monkeypatch.setattr(theorem, "DESIGN", other)
    assert theorem.motor_model(1)["transfer_gap"] > 1e-4


def test_other_gains_and_periods_turn_the_motor_claims(monkeypatch: pytest.MonkeyPatch) -> None:
    other = replace(DESIGN, feedback=-DESIGN.feedback, injection=-DESIGN.injection, period=0.21)
    monkeypatch.setattr(theorem, "DESIGN", other)
    found = json.loads(json.dumps(theorem.motor_model(1)))
    for name in ("motor.hurwitz-feedback", "motor.hurwitz-observer", "motor.slow-period"):
        assert verdict_on(name, lambda results: results["motor"].update(found)) is not CLAIMS[name].expected


def test_the_reading_of_a_claim_is_that_of_its_first_outcome() -> None:
    for claim in PAPER.claims:
        outcomes = claim.answer(Small(PAPER.key)).outcomes
        assert not outcomes or claim.reading in (outcomes[0].reading, NO_READING), claim.id


def test_outcomes_that_hang_on_a_reading_are_listed_under_each() -> None:
    """Which observer, and from which start: the answer is not the same under all."""

    def outcomes(name: str) -> dict[str, bool | None]:
        evidence = CLAIMS[name].answer(Small(PAPER.key))
        return {outcome.reading: outcome.holds for outcome in evidence.outcomes}

    assert outcomes("order.transient") == {
        "slowest-mode": False,
        "start-zero": False,
        "start-output": True,
        "start-true": True,
    }
    for name in ("order.apo-below-pmi", "order.bandwidth", "order.estimate-2", "order.estimate-3"):
        found = outcomes(name)
        (failing,) = (reading for reading, holds in found.items() if not holds)
        assert failing.removeprefix("estimate-") == "pmi-one-correction"
    assert outcomes("stability.pmi")["pmi-slow-input"] is False
    assert by_margin({"one": -1.0, "other": 1.0}, method="m").holds is False


def test_energy_of_a_transient_is_that_of_the_response_less_its_steady_state() -> None:
    """With five slow periods in a turn the steady state repeats, and late periods show it; Simpson's rule in time."""
    sigma, substeps = 2 * np.pi / (5 * DESIGN.slow_period), 100
    for choice, estimate in (("start-zero", 0 * START), ("start-output", START * [1, 0, 0]), ("start-true", START)):
        loop = printed.literal_loop(APO, sigma)
        response = time_response(loop, START, estimate, slow_periods=300, substeps=substeps)
        turn = 5 * DESIGN.ratio * substeps
        squares = (response.error - np.tile(response.error[-turn:], 300 // 5)) ** 2
        coarse, fine = (simpson(squares[::step], dx=step * DESIGN.period / substeps) for step in (2, 1))
        value = _energy(loop, choice)
        assert abs(value - fine) < max(abs(fine - coarse), 1e-9 * fine)
        rectangles = float(np.sum(squares)) * DESIGN.period / substeps
        assert abs(rectangles - fine) > 100 * abs(value - fine)  # from |e| = 0.5 a left sum is too high


def test_single_rate_responses_grow_by_the_radius_from_every_start() -> None:
    for name, estimate in product(printed.SINGLE_RATES.values(), (0 * START, START * [1, 0, 0], START)):
        response = time_response(printed.literal_loop(name, 1.0), START, estimate, slow_periods=40, substeps=1)
        sizes = np.abs(response.error).reshape(40, -1).max(axis=1)
        assert sizes[-1] / sizes[-2] == pytest.approx(result("shao.table")["radius"][name], rel=1e-3)


def test_state_feedback_at_the_slow_instants_by_the_plant_held_over_a_slow_period() -> None:
    model = DESIGN.model
    state, drive = cont2discrete((model.A, model.B_u, model.C, [[0]]), DESIGN.slow_period)[:2]
    radius = np.abs(np.linalg.eigvals(state + drive @ DESIGN.feedback)).max()
    assert result("shao.table")["slow_feedback"] == pytest.approx(radius, rel=1e-9)


def test_the_restarted_predictor_meets_the_inequality_that_the_printed_one_breaks() -> None:
    for design, period in product((DESIGN, printed.COUNTEREXAMPLE), (1e-4, 1e-5)):
        at = replace(design, period=period)
        worst, bound = prediction_gap(at)
        own, same = prediction_gap(at, restarted=True)
        assert own < same == bound < worst


def test_the_rate_of_the_virtual_output_by_a_fine_simulation() -> None:
    """The departure rests on the integral of C A ζ + C B u: here by many small Euler steps; with ζ_p there is none."""
    A, B, C, L = DESIGN.model.A, DESIGN.model.B_u, DESIGN.model.C, DESIGN.injection
    period, steps = 1e-3, 20000
    rng = np.random.default_rng(5)
    zeta, u, y = rng.normal(size=(3, 1)), rng.normal(size=(1, 1)), rng.normal(size=(1, 1))
    own, model, integral, predicted = zeta.copy(), zeta.copy(), 0.0, 0.0
    width = period / steps
    for _ in range(steps):
        integral += width * (C @ A @ own + C @ B @ u).item()
        predicted += width * (C @ A @ model + C @ B @ u).item()
        own = own + width * (A @ own + B @ u + L @ (y - C @ own))
        model = model + width * (A @ model + B @ u)
    change = (C @ (model - zeta)).item()
    size = np.linalg.norm(np.concatenate([zeta, u, y]))
    at = replace(DESIGN, period=period)
    assert 0.05 * rate_gap(at) * size < abs(change - integral) / period <= rate_gap(at) * size * (1 + 1e-3)
    assert change == pytest.approx(predicted, rel=1e-12)
    assert rate_gap(at, predicted=True) < 1e-12 < rate_gap(at)


def test_ties_up_to_rounding_are_counted_apart() -> None:
    column = [1.0, 2.0, 3.0]
    unstable = dict.fromkeys((*printed.PMI_READINGS, *printed.APO_READINGS))
    for factor, outcome in ((0.9, "holds"), (1.1, "fails"), (1 + 1e-13, "tied"), (1 - 1e-13, "tied"), (1.0, "tied")):
        ratios = {**unstable, PMI: column, APO: [factor * value for value in column]}
        counts = ordering_counts([{"ratios": ratios}])
        assert counts[outcome] == sum(counts.values()) == 1
    mixed = {**unstable, PMI: column, APO: [0.9, 2.2, 2.7]}
    assert ordering_counts([{"ratios": mixed}])["fails"] == 1


def test_the_note_names_where_the_error_of_the_alternating_controller_is_the_larger() -> None:
    """By observer, each once whatever the command; an unstable loop is not named."""
    low, high = [1.0, 2.0], [1.5, 2.5]
    entries = [
        {"ratios": dict.fromkeys(printed.PMI_READINGS) | {PMI: high, printed.SINGLE: own, APO: [1.2, 2.2]}}
        for own in (low, low, [1.0, 2.3], [1.0, 2.3])
    ]
    assert where_larger(entries) == (
        "DRC-APO has the larger error at every frequency of Table I against DRC-PMI, one correction and model. "
        "DRC-APO has the larger error at some frequencies of Table I against DRC-PMI, one correction and model. "
    )
    assert where_larger([{"ratios": {**dict.fromkeys(printed.PMI_READINGS), APO: low}}]) == ""
