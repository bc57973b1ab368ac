"""What a design at the slow rate refuses, before anything is solved, and the modes that prove that there is none."""

import re
from typing import Any
from unittest.mock import patch

import control
import numpy as np
import pytest

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation import dualrate
from replication.estimation.dualrate.slow import result as slow

SERVO = dualrate.make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
TWO = dualrate.make_plant([[0, 1], [0, -1]], [[0, 1], [1, 0]], np.eye(2))
OSCILLATOR = dualrate.make_plant([[0, 1], [-1, 0]], [[0], [1]], [[1, 0]])
LOADED, LIVELY = [[0, 1, 0], [0, -0.1, 1], [0, 0, 0]], {"process_noise": [0.0, 0.1, 0.01]}
HEIGHT = dualrate.make_plant(LOADED, [[0], [1], [0]], [[1, 0, 0]])
"""Height, speed and weight of something that flies."""
GIVEN: dict[str, Any] = {"period": 0.1, "ratio": 2, "at": "slow"}


REFUSED: dict[str, tuple[Any, dict[str, Any], str]] = {
    "at": (SERVO, {"at": "fast"}, "at must be one of 'continuous', 'slow', got 'fast'"),
    "goal": (SERVO, {"goal": "best"}, "goal must be one of 'hinf', 'h2', 'mixed', got 'best'"),
    "level of h2": (SERVO, {"level": 2.0}, "level belongs to the goals hinf and mixed"),
    "level": (SERVO, {"goal": "hinf", "level": -1}, "level must be positive"),
    "period": (SERVO, {"period": 0}, "period T must be positive"),
    "ratio": (SERVO, {"ratio": 1.5}, "ratio must be a whole number"),
    "no ratio": (SERVO, {"ratio": []}, "ratio must be one number, or one for each of the 1 sensors"),
    "text": (SERVO, {"ratio": "ab"}, "ratio must be a whole number"),
    "one ratio of two": (TWO, {"ratio": [2, 0]}, "ratio[1] must be at least 1"),
    "ratios": (TWO, {"ratio": [1, 2, 3]}, "one for each of the 2 sensors"),
    "holds": (TWO, {"hold": [1, 2, 3]}, "hold must be one number, or one for each of the 2 inputs"),
    "hold": (SERVO, {"hold": 0}, "hold must be at least 1"),
    "huge": (SERVO, {"ratio": 10**9}, "ratio must be at most 100000"),
    "primes": (TWO, {"ratio": [99991, 99989]}, "repeat together only"),
    "observer": (SERVO, {"observer": "kalman"}, "observer must be one of"),
    "state_weight": (SERVO, {"state_weight": [[1, 2], [0, 1]]}, "state_weight must be symmetric"),
    "input_weight": (SERVO, {"input_weight": [[0]]}, "input_weight must be symmetric and positive definite"),
    "sensor_noise": (SERVO, {"sensor_noise": [[0]]}, "sensor_noise must be symmetric and positive definite"),
    "nan": (SERVO, {"process_noise": [[np.nan, 0], [0, 1]]}, "process_noise must be finite"),
    "unweighted": (SERVO, {"state_weight": [[0, 0], [0, 1]]}, "state_weight leaves out the mode"),
    "undisturbed": (OSCILLATOR, {"process_noise": np.zeros((2, 2))}, "process_noise leaves out the mode"),
    "still loads": (HEIGHT, {"process_noise": [0, 1.0, 0]}, "process_noise leaves out the mode"),
    "no output": (HEIGHT, {"tracked": 1, **LIVELY}, "tracked must be a number from 0 to 0, got 1"),
    "name of an output": (HEIGHT, {"tracked": "y", **LIVELY}, "tracked must be a number from 0 to 0, got 'y'"),
    "half an output": (TWO, {"tracked": [1.0]}, "tracked must be a number from 0 to 1, got 1.0"),
    "twice": (TWO, {"tracked": [1, 1]}, "each named once"),
    "none": (TWO, {"tracked": []}, "choose `tracked`"),
    "more than inputs": (dualrate.make_plant(LOADED, [[0], [1], [0]], np.eye(2, 3)), LIVELY, "1 inputs hold at most"),
    "beyond reach": (dualrate.make_plant([[-1, 0, 0], [0, -1, 1], [0, 0, 0]], [[1], [0], [0]], [[0, 1, 0]]), LIVELY,
                     "no constant input holds the outputs"),
    "zero at rest": (dualrate.make_plant([[0, 1], [-1, -1]], [[0], [1]], [[0, 1]]), {"tracked": 0},
                     "no constant input holds"),
    "discrete": (control.ss([[0.5]], [[1]], [[1]], 0, 0.1), {}, "continuous-time"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_bad_input_is_named_before_anything_is_solved(case: str) -> None:
    plant, changed, told = REFUSED[case]
    with (
        patch.object(slow, "kalman", side_effect=AssertionError("solved")),
        pytest.raises(InvalidInputError, match=re.escape(told)),
    ):
        dualrate.design(plant, **{**GIVEN, **changed})


@pytest.mark.parametrize("changed", [{"ratio": [2]}, {"hold": 2}, {"goal": "hinf"}, {"goal": "mixed"}])
def test_what_belongs_to_the_slow_rate_is_refused_elsewhere(changed: dict[str, Any]) -> None:
    with pytest.raises(InvalidInputError, match='belong to designs at the slow rate: at="slow"'):
        dualrate.design(SERVO, **{"period": 0.1, "ratio": 2, **changed})


def test_the_mode_that_proves_that_there_is_none_is_named() -> None:
    loose = dualrate.make_plant([[0.5, 0], [0, -1]], [[0], [1]], [[1, 1]])
    with pytest.raises(InfeasibleError, match=r"no input moves the unstable mode 0\.5.*\[A - s I, B\] loses rank"):
        dualrate.design(loose, **GIVEN)
    blind = dualrate.make_plant([[0.5, 0], [0, -1]], [[1], [1]], [[0, 1]])
    with pytest.raises(InfeasibleError, match=r"no sensor sees the unstable mode 0\.5.*\[A - s I; C\] loses rank"):
        dualrate.design(blind, **GIVEN)


def turning(period: float, **changed: Any) -> Any:
    return dualrate.design(OSCILLATOR, **{"period": period, "ratio": 1, "at": "slow", **changed})


def test_sampling_that_folds_a_mode_is_infeasible_and_next_to_it_is_not() -> None:
    with pytest.raises(InfeasibleError, match=r"sensors, at their instants, do not see the unstable mode .*1j"):
        turning(np.pi / 4, ratio=4)
    assert turning(np.pi / 4, ratio=3).fact("monodromy radius").value < 1
    assert turning(1.001 * np.pi / 4, ratio=4).fact("monodromy radius").value < 1


def test_holding_that_loses_a_mode_is_infeasible_and_next_to_it_is_not() -> None:
    with pytest.raises(InfeasibleError, match=r"inputs, as they are held, do not move the unstable mode .*1j"):
        turning(np.pi / 4, hold=8)
    assert turning(np.pi / 4, hold=3).fact("monodromy radius").value < 1
    # Two inputs that move both coordinates still do nothing over a whole turn.
    both = dualrate.make_plant([[0, 1], [-1, 0]], np.eye(2), np.eye(2))
    with pytest.raises(InfeasibleError, match="as they are held"):
        dualrate.design(both, period=np.pi / 4, ratio=1, hold=8, at="slow")


def test_two_sensors_see_together_what_each_alone_folds() -> None:
    """One turn in six ticks: every third tick shows one sign pattern only; every second and third together do not."""
    plant = dualrate.make_plant([[0, 1], [-1, 0]], [[0], [1]], [[1, 0], [1, 0]])
    given: dict[str, Any] = {"period": np.pi / 3, "at": "slow"}
    with pytest.raises(InfeasibleError, match="do not see"):
        dualrate.design(plant, ratio=[3, 3], **given)
    assert dualrate.design(plant, ratio=[2, 3], **given).fact("monodromy radius").value < 1


def test_what_rounding_spoils_says_so() -> None:
    """A mode that grows by ten orders of magnitude between readings has gains that floating point cannot hold."""
    wild = dualrate.make_plant([[45.0, 1.0], [0.0, -3.0]], [[1.0], [1.0]], [[1.0, 1.0]])
    with pytest.raises(SolverError, match=r"lost in rounding: the fastest mode grows by a factor of .* over the 0.9 s"):
        dualrate.design(wild, period=0.01, ratio=90, at="slow")


def test_where_no_noise_reaches_a_weighted_state_the_least_level_is_zero() -> None:
    stable = dualrate.make_plant([[-1.0]], [[1.0]], [[1.0]])
    for silent in ({"process_noise": [[0.0]]}, {"state_weight": [[0.0]]}):
        assert dualrate.design(stable, **GIVEN, **silent).value < 1e-12
        with pytest.raises(InvalidInputError, match="least worst-case gain is zero"):
            dualrate.design(stable, **GIVEN, **silent, goal="hinf")


def test_a_fast_sensor_is_read_at_every_instant() -> None:
    double = dualrate.make_plant([[0, 1], [0, 0]], [[0], [1]], [[1, 0]])
    slow, fast = (
        dualrate.design(double, period=0.1, ratio=5, observer=name).fact("level from process and sensor noise").value
        for name in ("running_prediction", "fast_sensor")
    )
    one = dualrate.design(double, period=0.1, ratio=1, sensor_noise=[[2.0]])
    assert slow != fast and one.fact("level from process and sensor noise").value > 0


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InfeasibleError, match="no controller at these rates keeps the level"):
        dualrate.design(SERVO, **GIVEN, goal="mixed", level=1e-3)
    with pytest.raises(InvalidInputError, match="points must be at least 2"):
        dualrate.design(SERVO, **GIVEN).tradeoff(1)  # type: ignore[union-attr]
