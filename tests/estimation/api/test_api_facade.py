"""What holds for the results of all designs: names and units, laziness, tables, plots, exports, linear systems."""

import ast
import csv
import importlib
import io
import json
import pickle
import re
from dataclasses import replace
from decimal import Decimal
from html import escape
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.io

from replication.errors import InvalidInputError
from replication.estimation import multirate, nonuniform
from replication.estimation.api.plants import measured_outputs
from replication.estimation.api.results import LITTLE, Bracket, baselines, outward
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.nonuniform.plant import SampledPlant
from tests.estimation.api.api_cases import CART, CARTS, CASES, DT, METHODS, result_of, running
from tests.estimation.dualrate.slow_loops import largest


@pytest.mark.parametrize("method", METHODS)
def test_lazy_names_are_those_that_type_checkers_see(method: str) -> None:
    package = importlib.import_module(f"replication.estimation.{method}")
    tree = ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8"))
    seen = {
        alias.name: node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module not in (None, "replication.estimation", "typing")
        for alias in node.names
    }
    assert sorted(seen) == sorted(package.__all__)
    for name, module in seen.items():
        assert getattr(package, name) is getattr(importlib.import_module(module), name)
    with pytest.raises(AttributeError, match="has no attribute 'desing'"):
        package.desing  # noqa: B018


@pytest.mark.parametrize("method", CASES)
def test_a_bracket_is_around_the_gain_and_its_upper_end_is_the_value(method: str) -> None:
    result = result_of(method)
    assert 0 < result.bracket.lower <= result.bracket.upper == result.value
    assert all(fact.what and fact.method for fact in result.evidence)
    with pytest.raises(KeyError, match="there are"):
        result.fact("nothing")


@pytest.mark.parametrize("method", CASES)
def test_results_and_their_pickles_cannot_be_changed(method: str) -> None:
    result = result_of(method)
    with pytest.raises(AttributeError):
        result.method = "other"  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        next(iter(result.gains.values()))[...] = 0
    with pytest.raises(TypeError, match="does not support item assignment"):
        result.gains["L"] = 0  # type: ignore[index]
    again = pickle.loads(pickle.dumps(result))
    assert again.to_json() == result.to_json()
    assert not any(gain.flags.writeable for gain in again.gains.values())


@pytest.mark.parametrize("method", CASES)
def test_all_that_is_exported_holds_the_same_gains(method: str) -> None:
    """JSON, a MATLAB file whose bytes do not change, and a C header."""
    result = result_of(method)
    told, read = json.loads(result.to_json()), scipy.io.loadmat(io.BytesIO(result.to_mat()))
    bracket, header = result.bracket, result.to_c_header("filter")
    assert told == result.to_dict()
    assert told["bracket"] == {"lower": bracket.lower, "upper": bracket.upper, "method": bracket.method}
    assert result.to_mat() == result.to_mat() and b"Created" not in result.to_mat()
    assert header.startswith("/* ") and header.count("#ifndef FILTER_H") == header.count("#endif") == 1
    arrays = re.findall(r"^static const double filter_(\w+?)((?:\[\d+\])+) = (\{.*\});$", header, re.MULTILINE)
    for (name, gain), (in_c, shape, values) in zip(result.gains.items(), arrays, strict=True):
        assert (name, "".join(f"[{size}]" for size in gain.shape)) == (in_c, shape)
        assert np.array_equal(told["gains"][name]["value"], gain)
        assert np.array_equal(read[name].reshape(gain.shape), gain)
        assert np.array_equal(ast.literal_eval(values.replace("{", "[").replace("}", "]")), gain)
        assert all(f"#define FILTER_{name.upper()}_DIM{i} {size}\n" in header for i, size in enumerate(gain.shape))


@pytest.mark.parametrize("name", ["2nd", "a-b", "int", "", "x" * 40, "a b", "../x", "é"])
def test_a_header_needs_an_identifier(name: str) -> None:
    with pytest.raises(InvalidInputError, match="C identifier"):
        result_of("multirate").to_c_header(name)


@pytest.mark.parametrize("method", CASES)
def test_text_and_html_show_the_same_rows(method: str) -> None:
    result = result_of(method)
    page = result._repr_html_()
    assert page.count("<tr>") == len(result.rows()) + 1
    for what, value, how in result.rows():
        assert f"{what}: {value}" in str(result) and how in str(result)
        assert all(f">{escape(cell)}<" in page for cell in (what, value, how))
    assert repr(result).startswith(f"<{type(result).__name__}: guaranteed level ")


def test_html_escapes_the_names_of_signals() -> None:
    page = replace(result_of("multirate"), quantity="<script>alert(1)</script>")._repr_html_()
    assert "<script>" not in page and "&lt;script&gt;" in page


@pytest.mark.parametrize("method", CASES)
def test_a_plot_shows_the_curve_and_the_guaranteed_level(method: str) -> None:
    result = result_of(method)
    figure = result.plot()
    (panel,) = result.panels()
    (axes,) = figure.axes
    drawn = {line.get_label(): line for line in axes.lines}
    assert {re.sub(r" [0-9.e+-]+$", "", str(label)) for label in drawn} == {*panel.lines, *panel.levels}
    for name, values in panel.lines.items():
        assert np.array_equal(drawn[name].get_ydata(), values)
        assert values.max() <= result.value * (1 + 1e-6)


@pytest.mark.parametrize("method", CASES)
def test_a_simulation_has_the_names_and_units_in_its_plot_its_table_and_its_dictionary(method: str) -> None:
    case = CASES[method]
    simulation, wanted = case.simulate(case.named()), case.columns
    assert dict(simulation.columns) == wanted
    for panel, (name, columns) in zip(simulation.panels(), wanted.items(), strict=True):
        label = name if len(columns) > 1 else f"{name}: {columns[0]}"
        assert (panel.y_label, tuple(panel.lines)) == (label, columns)
        assert f"{name}: " in str(simulation) and ", ".join(columns) in str(simulation)
    axes = simulation.plot().axes
    assert len(axes) == len([signal for signal in simulation.signals.values() if signal.size])
    drawn = {text.get_text() for one in axes for text in (*one.texts, *getattr(one.get_legend(), "texts", ()))}
    assert drawn >= {column for columns in wanted.values() if len(columns) > 1 for column in columns}
    # A table has a column for each, and reads back.
    head, *rows = csv.reader(io.StringIO(simulation.to_csv()))
    assert head == ["time (s)", *(f"{name}: {one}" for name, columns in wanted.items() for one in columns)]
    assert np.array_equal(np.array(rows, dtype=float), np.column_stack([simulation.time, *simulation.signals.values()]))
    told = json.loads(json.dumps(simulation.to_dict()))
    assert told["columns"] == {name: list(columns) for name, columns in wanted.items()}
    assert told["time"]["value"] == simulation.time.tolist()
    if simulation.ratio is not None:
        assert 0 < simulation.ratio <= result_of(method).value * (1 + 1e-6)


@pytest.mark.parametrize(
    ("lower", "upper", "shown"),
    [
        (1.0, 1.0 + 1e-9, ("1", "1.0000000011")),
        (2.0, 2.0, ("2", "2")),
        (1 / 3, 1 / 3, ("0.333333333333", "0.333333333334")),
        (0.55233001, 0.57976649, ("0.552330", "0.579767")),
        (0.1, 123.4567891, ("0.1", "123.457")),
        (1.5e-9, 2.5e-9, ("1.49999e-9", "2.50001e-9")),
    ],
)
def test_brackets_are_rounded_outwards(lower: float, upper: float, shown: tuple[str, str]) -> None:
    low, high = outward(Bracket(lower, upper, "by hand"))
    assert Decimal(low) <= Decimal(lower) and Decimal(high) >= Decimal(upper)
    assert (Decimal(low), Decimal(high)) == tuple(map(Decimal, shown))


@pytest.mark.parametrize("wrong", [[0, 0], [0, 1], [], 0, 3, -1, True, "y[0]", [2], [-1]])
def test_outputs_are_measured_once_and_some_are_left_to_estimate(wrong: Any) -> None:
    system = control.ss([[-1.0]], [[1.0]], [[1.0], [2.0]], 0)
    for last in ([1], ["y[1]"], [np.int64(1)], np.array([1])):
        assert measured_outputs(system, last) == ([1], [0])
    for first in (1, np.int64(1)):
        assert measured_outputs(system, first) == ([0], [1])
    with pytest.raises(InvalidInputError):
        measured_outputs(system, wrong)


def test_the_width_of_a_bracket_is_a_share_of_its_upper_end() -> None:
    assert Bracket(1.0, 4.0, "m").width == 0.75
    assert Bracket(0.0, 0.0, "m").width == 0.0


CLOSE = 1e-10
PERIODS = 40
REPEATS = {
    "multirate": 0.4,
    "kalman": 0.4,
    "nonuniform": True,
    "dualrate": 0.2,
    "slow rate": 0.2,
    "delay": DT,
    "innovations": DT,
}
"""Sampling periods of the linear systems that run as the observers do: those of the schedules."""


@pytest.mark.parametrize("name", REPEATS)
def test_its_linear_system_gives_the_estimates_of_the_observer_with_the_names_of_the_plant(name: str) -> None:
    result, observer = result_of(name), running(name)
    system, signals = result.estimator(*((DT,) if result.method == "delay" else ())), result.signals
    m, q = len(signals.inputs), len(signals.measurements)
    period = system.ninputs // (m + q)
    driven = np.random.default_rng(8).standard_normal((PERIODS * period, m + q))
    driven[0] = 0.0
    late = result.method != "delay"  # of a delay plant a step gives the estimate at the same instant
    found = [observer.estimate] if late else []
    found += [observer.step(row[:m] if m else None, row[m:]) for row in driven]
    expected = np.array(found[: len(driven)]).reshape(PERIODS, -1)
    response = control.forced_response(
        control.StateSpace(system.A, system.B, system.C, system.D, 1), U=driven.reshape(PERIODS, -1).T, squeeze=False
    )
    assert np.abs(expected).max() > CLOSE
    assert np.allclose(response.outputs.T, expected, rtol=CLOSE, atol=CLOSE * np.abs(expected).max())
    assert system.dt == pytest.approx(REPEATS[name])
    assert [label.split("@")[0] for label in system.input_labels] == [*signals.inputs, *signals.measurements] * period
    estimated = signals.outputs if name == "nonuniform" else signals.states
    assert {label.split("@")[0] for label in system.output_labels} == {f"estimate of {name}" for name in estimated}


@pytest.mark.parametrize("name", ["innovations", "delay"])
def test_too_many_states_are_refused(name: str) -> None:
    with pytest.raises(InvalidInputError, match="states, more than 2000; choose a longer dt"):
        result_of(name).estimator(1e-4)


A, B_D, C, D = np.array([[0.9, 0.1], [0.0, 0.8]]), np.array([[0.0], [0.1]]), np.eye(2), np.diag([0.5, 0.1])
LEVELS = 1e-7


def gain(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> float:
    return largest(A, B, C, np.zeros((len(C), B.shape[1])))


def test_multirate_levels_are_those_of_other_packages() -> None:
    result = multirate.design(MultiratePlant(A=A, B_d=B_D, C=C, D=D), periods=(1, 1))
    L = control.dlqe(A, np.eye(2), C, B_D @ B_D.T, D @ D.T)[0]
    kalman = gain(A - L @ C, np.hstack([B_D, -L @ D]), np.eye(2))
    assert result.fact("level without sensors").value == pytest.approx(gain(A, B_D, np.eye(2)), rel=LEVELS)
    assert result.fact("level of the Kalman filter").value == pytest.approx(kalman, rel=LEVELS)
    limit = result.fact("limit of any smoother").value
    assert isinstance(limit, float) and limit <= result.value <= kalman * (1 + LEVELS)


def test_advice_begins_where_it_is_said_to() -> None:
    def words(level: float | Bracket, without: float | Bracket = 1.0) -> list[str]:
        return [str(fact.value) for fact in baselines(level, "", without=without) if fact.what == "advice"]

    assert words(1 - LITTLE - 1e-9) == []
    assert words(0.95) == ["only 5 % below the level without sensors"]
    assert words(1.0) == words(2.0) == ["not below the level without sensors"]
    wide = Bracket(1.0, 1.2, "")
    assert words(Bracket(0.5, 0.89, ""), wide) == []
    assert words(Bracket(0.9, 0.99, ""), wide) == []
    for low, high in ((0.5, 1.0), (1.1, 1.3)):
        [told] = words(Bracket(low, high, ""), wide)
        assert told == f"open whether below the level without sensors: [{low:g}, {high:g}] against [1, 1.2]"
    assert words(Bracket(1.2, 1.3, ""), wide) == ["not below the level without sensors"]
    assert words(Bracket(0.95, 0.98, ""), Bracket(1.0, 1.01, "")) == ["only 5.9 % below the level without sensors"]


def test_nonuniform_levels_are_those_of_other_packages() -> None:
    tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    result = nonuniform.design(tank, periods=(0.2, 0.2), leaves=1, horizon=30)
    Phi, Gamma = tank.discretise(0.2)
    L = control.dlqe(Phi, np.eye(2), tank.C, Gamma @ Gamma.T, tank.D @ tank.D.T)[0]
    kalman = gain(Phi - L @ tank.C, Gamma - L @ tank.D, tank.L)
    assert result.fact("level of the Kalman filter").value == pytest.approx(kalman, rel=LEVELS)
    assert result.fact("level without sensors").value == pytest.approx(gain(Phi, Gamma, tank.L), rel=LEVELS)
    own = result.fact("level at constant periods").value
    assert isinstance(own, float) and result.bracket.lower == pytest.approx(own, rel=0.1) and own <= result.value


def test_outputs_that_are_the_states_follow_their_names() -> None:
    named = result_of("multirate").named(states=["place", "pace"])
    assert named.signals.outputs == ("place", "pace")
    assert named.signals.measurements == ("encoder", "camera")
    own = result_of("multirate").named(states=["place", "pace"], outputs=["a", "b"])
    assert own.signals.outputs == ("a", "b")
    late = multirate.design(CART, latency=(0, 1), **CARTS)
    assert late.named(states=["place", "pace"]).signals.states[:2] == ("place", "pace")
    assert late.named(states=["place", "pace"]).signals.states[2:] == late.signals.states[2:]
    for names in ([], ["place"]):
        with pytest.raises(InvalidInputError, match="states must be 2 different names"):
            late.named(states=names)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"states": "ab"}, "sequence of names"),
        *(({"states": names}, "states must be 2 different names") for names in ([], ["a"], ["a", "b", "c"])),
        ({"measurements": ["a"]}, "measurements must be 2 different names"),
        ({"measurements": ["a", "a"]}, "measurements must be 2 different names"),
        ({"inputs": [1]}, "sequence of names"),
        ({"units": {"wheel": "m"}}, "no signal 'wheel'; there are camera, encoder"),
    ],
)
def test_names_that_do_not_fit_are_refused(given: dict[str, object], said: str) -> None:
    with pytest.raises(InvalidInputError, match=said):
        result_of("multirate").named(**given)


def test_the_worst_noise_has_the_names_of_the_plant() -> None:
    system = control.ss([[0.9]], [[1.0, 0.5]], [[1.0]], 0, 0.1, inputs=["wind", "valve"], outputs=["gauge"])
    result = multirate.design(system, periods=(2,), noise=[0.3], disturbances=["wind"])
    assert result.simulate(20, disturbance="worst").columns["disturbance"] == ("wind", "noise of gauge")
    mixed = multirate.design(system, periods=(2,), noise=[[0.3, 0.1]], disturbances=["wind"], Q=[[2.0]])
    assert mixed.simulate(20, disturbance="worst").columns["disturbance"] == ("d[0]", "noise of gauge")
    plain = multirate.design(system, periods=(2,), noise=[[0.3, 0.1]], disturbances=["wind"])
    assert plain.simulate(20, disturbance="worst").columns["disturbance"] == ("wind", "w[0]", "w[1]")
