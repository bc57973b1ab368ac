"""Running observers as linear systems: what they do while no measurement is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.phase import Phase
from replication.estimation.api.signals import Signals, each_instant
from replication.estimation.linear.periodic import PeriodicSystem, Stage, lifted_statespace
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control

MOST_STATES = 2000
"""Of a linear system that a user is given."""


def statespace(phases: Sequence[Phase], signals: Signals | None) -> control.StateSpace:
    """The recursion of `phases` over one period, from (u, y) at all instants to the estimates x^ at them."""
    stages = []
    for phase in phases:
        drive = np.hstack([phase.input, phase.injection * phase.due])
        direct = np.zeros((len(phase.readout), drive.shape[1]))
        stages.append(Stage(phase.transition, drive, phase.readout, direct))
    dt = None if signals is None else signals.dt
    system = lifted_statespace(PeriodicSystem(tuple(stages)), dt=1.0 if dt is None else dt)
    if dt is None:
        system.dt = True
    if signals is not None:
        _name(system, signals, len(phases))
    return system


def require_small(states: int) -> None:
    """Raise InvalidInputError if a linear system of so many states is of no use."""
    if states > MOST_STATES:
        raise InvalidInputError(
            f"as a linear system the observer has {states} states, more than {MOST_STATES}; choose a longer dt"
        )


def single(following: Array, estimate: Array, dt: float, signals: Signals | None) -> control.StateSpace:
    """One step of `dt`: rows of the following state and of x^, columns of the state and of (u, y)."""
    import control

    n = len(following)
    made = control.StateSpace(following[:, :n], following[:, n:], estimate[:, :n], estimate[:, n:], dt)
    if signals is not None:
        _name(made, signals, 1)
    return made


def _name(system: control.StateSpace, signals: Signals, count: int) -> None:
    """Names of inputs, measurements and estimates, `@k` for instant k of several."""
    inputs = [*signals.inputs, *signals.measurements]
    outputs = [f"estimate of {name}" for name in signals.states[: system.noutputs // count]]
    system.set_inputs(each_instant(inputs, count) if count > 1 else inputs)
    if len(outputs) * count == system.noutputs:  # a controller's outputs are more than the states
        system.set_outputs(each_instant(outputs, count) if count > 1 else outputs)
