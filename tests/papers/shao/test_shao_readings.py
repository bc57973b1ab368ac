"""Readings and their search: rows mean what they say, planted columns are found, blocks merge in any order."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from papers.shao.method import readings as search
from papers.shao.method.readings import STRUCTURES, Reading, ReadingSpace, Start, Structure, current, error_ratios
from papers.shao.printed import DESIGN, MOTOR, START, literal_loop
from replication.estimation.dualrate.loop import (
    Points,
    close_loop,
    monodromy,
    stability_radius,
    time_response,
    tracking_error_ratio,
)
from replication.estimation.dualrate.observers import OBSERVERS

SPACE = ReadingSpace(MOTOR, DESIGN, tuple(START), (0.5, 1.5, 3.0), horizon=12, substeps=5)
APO, PMI = "alternating_predictive", "held_measurement"


def ratio_of(reading: Reading, frequency: float) -> float:
    """The error ratio of one reading, by the steady state or along the whole response."""
    loop = SPACE.loop(reading.observer, reading.structure, frequency)
    if reading.window is None:
        return tracking_error_ratio(loop, reading.points)
    estimate = {Start.ZERO: 0 * START, Start.TRUE: START, Start.OUTPUT: np.array([START[0], 0.0, 0.0])}[reading.start]
    response = time_response(loop, START, estimate, slow_periods=SPACE.horizon, substeps=SPACE.substeps)
    stride = SPACE.substeps * (1 if reading.points is Points.FAST else DESIGN.ratio)
    first, last = (end * SPACE.substeps * DESIGN.ratio for end in reading.window)
    return float(np.max(np.abs(response.error[first : last : 1 if reading.points is Points.BETWEEN else stride])))


def planted(reading: Reading, *observers: str) -> search.Column:
    return search.Column(observers, np.array([ratio_of(reading, f) for f in SPACE.frequencies]), np.full(3, 5e-5))


def test_the_literal_reading_is_the_default_and_the_first_row() -> None:
    assert SPACE.reading(APO, STRUCTURES[0], 0) == Reading(observer=APO)
    assert STRUCTURES[0] == Structure()
    expected = [tracking_error_ratio(literal_loop(APO, f)) for f in SPACE.frequencies]
    np.testing.assert_allclose(error_ratios(SPACE, APO, Structure())[0], expected, rtol=1e-12)


def test_rows_count_and_mean_what_the_reading_says() -> None:
    rng = np.random.default_rng(3)
    for structure in (STRUCTURES[0], STRUCTURES[7], STRUCTURES[11], STRUCTURES[15]):
        values = error_ratios(SPACE, APO, structure)
        assert values.shape == (len(SPACE.rows), 3)
        for row in rng.integers(0, len(SPACE.rows), 12):
            reading = SPACE.reading(APO, structure, int(row))
            assert ratio_of(reading, 1.5) == pytest.approx(values[row, 1], rel=1e-9)


def test_distinct_readings_are_those_that_differ_to_print() -> None:
    """Against a set of the printed strings."""
    column = planted(Reading(window=(0, 3)), APO)
    values = error_ratios(SPACE, APO, STRUCTURES[0])
    printed = {tuple(f"{100 * v:.2f}" for v in row) for row in values}
    result = search.search_block(SPACE, {"apo": column}, 0)
    assert result.distinct["apo"] == len(printed) < result.tried["apo"]
    assert search.merge([result, search.search_block(SPACE, {"apo": column}, 1)]).distinct["apo"] > len(printed)


def test_structures_are_all_different() -> None:
    assert len(set(STRUCTURES)) == len(STRUCTURES) == 24


def test_planted_columns_are_found_and_hit() -> None:
    structure = STRUCTURES[5]
    wanted = {
        "pmi": Reading(observer=PMI, structure=structure, start=Start.TRUE, window=(3, 9)),
        "apo": Reading(observer=APO, structure=structure, start=Start.TRUE, window=(3, 9)),
    }
    columns = {name: planted(reading, reading.observer) for name, reading in wanted.items()}
    blocks = [search.search_block(SPACE, columns, index) for index in (4, 5)]
    result = search.merge(blocks)
    assert result.joint_distance < 1e-9
    assert result.joint_hits >= 1
    for name, reading in wanted.items():
        assert result.nearest[name].distance < 1e-9
        assert search.reading_of(SPACE, result.joint[name]).structure == reading.structure
        assert result.hits[name] >= 1


def test_search_is_deterministic_resumable_and_merges_in_any_order() -> None:
    columns = {"apo": planted(Reading(observer=APO, window=(0, 3)), APO, "running_prediction")}
    whole, resumed = ([search.search_block(SPACE, columns, i) for i in order] for order in ([0, 1, 2, 3], [2, 3, 0, 1]))
    assert search.merge(whole) == search.merge(resumed)
    assert search.merge(whole).tried["apo"] > 0


def test_unstable_readings_are_counted_only_where_they_exist() -> None:
    column = planted(Reading(observer=APO), "slow_input_interpolation")
    result = search.search_block(SPACE, {"pmi": column}, 0)
    assert result.tried["pmi"] == len(SPACE.rows) - len(Points)


def test_current_form_with_a_discrete_gain_is_the_textbook_current_observer() -> None:
    """x̂ = ζ + L(y − Cζ), ζ' = Āx̂ + B̄u at every fast instant."""
    model, L, K = DESIGN.model, DESIGN.injection, DESIGN.feedback
    Ad, Bd = scipy.signal.cont2discrete((model.A, model.B_u, model.C, [[0]]), DESIGN.period)[:2]
    gap = np.eye(3) - L @ model.C
    # x' = Ad x + Bd K x̂, ζ' = Ad x̂ + Bd K x̂ with x̂ = LC x + (I − LC) ζ
    estimate = np.hstack([L @ model.C, gap])
    textbook = np.vstack([np.hstack([Ad, np.zeros((3, 3))]) + Bd @ K @ estimate, (Ad + Bd @ K) @ estimate])
    design = replace(DESIGN, ratio=1)
    ours = monodromy(close_loop(design, current(OBSERVERS["fast_sensor"], discrete_gain=True), discrete_gain=True))
    expected = np.sort(np.abs(np.linalg.eigvals(textbook)))
    np.testing.assert_allclose(np.sort(np.abs(np.linalg.eigvals(ours)))[-6:], expected, atol=1e-8)


@pytest.mark.parametrize("name", [name for name in OBSERVERS if name != "state_feedback"])
def test_current_forms_coincide_at_ratio_one_and_differ_from_the_predictor(name: str) -> None:
    design = replace(DESIGN, ratio=1)
    radii = [stability_radius(close_loop(design, current(OBSERVERS[other]))) for other in (name, "fast_sensor")]
    assert radii[0] == pytest.approx(radii[1], rel=1e-8)
    assert abs(radii[0] - stability_radius(close_loop(design, OBSERVERS[name]))) > 1e-3
