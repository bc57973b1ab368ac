"""The estimator as a linear system gives what the running observer gives."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest

from replication.errors import InvalidInputError
from tests.estimation.api.api_plants import METHODS, result_of
from tests.estimation.api.running_cases import DT, innovations

CLOSE = 1e-10
PERIODS = 40
RESULTS = (*METHODS, "innovations")


def made(name: str) -> tuple[Any, Any, Any]:
    """Result, running observer and linear system."""
    result = innovations() if name == "innovations" else result_of(name)
    given = (DT,) if result.method == "delay" else ()
    return result, result.observer(*given), result.estimator(*given)


@pytest.mark.parametrize("name", RESULTS)
def test_it_gives_the_estimates_of_the_running_observer(name: str) -> None:
    result, observer, system = made(name)
    m, q = len(result.signals.inputs), len(result.signals.measurements)
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


@pytest.mark.parametrize("name", RESULTS)
def test_it_has_the_names_of_the_plant(name: str) -> None:
    result, _, system = made(name)
    signals = result.signals
    estimated = signals.outputs if name == "nonuniform" else signals.states
    assert [label.split("@")[0] for label in system.input_labels] == [*signals.inputs, *signals.measurements] * (
        system.ninputs // (len(signals.inputs) + len(signals.measurements))
    )
    assert {label.split("@")[0] for label in system.output_labels} == {f"estimate of {name}" for name in estimated}


@pytest.mark.parametrize(("name", "dt"), [("multirate", 0.4), ("dualrate", 0.2), ("delay", DT), ("nonuniform", True)])
def test_its_period_is_that_of_the_schedule(name: str, dt: float | bool) -> None:
    assert made(name)[2].dt == pytest.approx(dt)


@pytest.mark.parametrize("result", [innovations, lambda: result_of("delay")])
def test_too_many_states_are_refused(result: Any) -> None:
    with pytest.raises(InvalidInputError, match="states, more than 2000; choose a longer dt"):
        result().estimator(1e-4)
