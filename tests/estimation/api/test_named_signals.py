"""Names and units that a user gives are those of every simulation, its plot, its table and what is exported."""

import csv
import io
import json

import control
import numpy as np
import pytest
from api_plants import CART, CASES, SERVO, result_of

from replication.errors import InvalidInputError
from replication.estimation import dualrate, multirate, nonuniform
from replication.estimation.api.shown import Simulation
from replication.estimation.multirate import losses

UNITS = {"position": "m", "velocity": "m/s", "angle": "rad", "deep": "mm", "camera": "px", "volt": "V", "speed": "m/s"}
WANTED = {
    "multirate": {
        "error": ("position (m)", "speed (m/s)"),
        "disturbance": ("wind", "noise of encoder", "noise of camera"),
    },
    "nonuniform": {"error": ("velocity (m/s)",), "disturbance": ("push", "noise")},
    "dualrate": {"output": ("camera (px)",), "input": ("volt (V)",), "estimation error": ("angle (rad)", "rate")},
    "delay": {"error of z": ("deep (mm)",), "error of x": ("upper", "lower"), "disturbance": ("rain", "leak")},
}


def simulated(method: str) -> Simulation:
    result = result_of(method)
    known = {name for kind in result.signals.to_dict().values() if isinstance(kind, list) for name in kind}
    return CASES[method].simulate(result.named(units={name: unit for name, unit in UNITS.items() if name in known}))


@pytest.mark.parametrize("method", CASES)
def test_every_simulation_carries_them(method: str) -> None:
    simulation = simulated(method)
    assert dict(simulation.columns) == WANTED[method]
    for panel, (name, columns) in zip(simulation.panels(), WANTED[method].items(), strict=True):
        label = name if len(columns) > 1 else f"{name}: {columns[0]}"
        assert (panel.y_label, tuple(panel.lines)) == (label, columns)
    for name, columns in WANTED[method].items():
        assert f"{name}: " in str(simulation) and ", ".join(columns) in str(simulation)
    drawn = {text.get_text() for axes in simulation.plot().axes for text in axes.texts}
    drawn |= {text.get_text() for axes in simulation.plot().axes for text in getattr(axes.get_legend(), "texts", ())}
    assert drawn >= {column for columns in WANTED[method].values() if len(columns) > 1 for column in columns}
    # A table has a column for each, and reads back.
    head, *rows = csv.reader(io.StringIO(simulation.to_csv()))
    assert head == ["time (s)", *(f"{name}: {one}" for name, columns in WANTED[method].items() for one in columns)]
    assert np.array_equal(np.array(rows, dtype=float), np.column_stack([simulation.time, *simulation.signals.values()]))
    assert json.loads(json.dumps(simulation.to_dict()))["columns"] == {
        name: list(columns) for name, columns in WANTED[method].items()
    }


def test_designs_for_losses_for_time_stamps_and_for_slow_sensors_carry_them_too() -> None:
    best = result_of("multirate").named(units={"position": "m"})
    lossy = losses.simulate(losses.analyse(best, losses.InARow(1)), 20)
    assert lossy.columns["error"] == ("position (m)", "speed")
    assert lossy.columns["arrived"] == ("encoder", "camera")
    stamped = nonuniform.design_stamped(
        nonuniform.StampedPlant([[0, 1], [-4, -1.2]], [[0, 0], [1, 0]], [[1, 0]], [[0, 0.1]], np.eye(2)),
        periods=(0.05, 0.2),
        horizon=40,
    ).named(states=["place", "speed"], outputs=["place of z", "speed of z"], units={"place of z": "m"})
    assert nonuniform.simulate(stamped).columns["error"] == ("place of z (m)", "speed of z")
    slow = dualrate.design(SERVO, period=0.02, ratio=10, at="slow").named(
        states=["place", "pace"], units={"place": "rad", "camera": "px"}
    )
    response = dualrate.simulate(slow, [1.0, 0.0], slow_periods=2)
    assert response.columns == {
        "output": ("camera (px)",),
        "input": ("volt",),
        "estimation error": ("place (rad)", "pace"),
    }


def test_outputs_that_are_the_states_follow_their_names() -> None:
    named = result_of("multirate").named(states=["place", "pace"])
    assert named.signals.outputs == ("place", "pace")
    assert named.signals.measurements == ("encoder", "camera")
    own = result_of("multirate").named(states=["place", "pace"], outputs=["a", "b"])
    assert own.signals.outputs == ("a", "b")
    late = multirate.design(CART, periods=(1, 2), noise=[0.5, 0.1], disturbances=["wind"], latency=(0, 1))
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
