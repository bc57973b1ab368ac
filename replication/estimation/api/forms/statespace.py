"""Running observers as linear systems: what they do while no measurement is missing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from replication.estimation.api.phase import Phase
from replication.estimation.api.signals import Signals, each_instant
from replication.estimation.linear.periodic import PeriodicSystem, Stage, lifted_statespace
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control


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
        named(system, signals, len(phases))
    return system


def single(A: Array, B: Array, C: Array, D: Array, dt: float, signals: Signals | None) -> control.StateSpace:
    """A system with one step `dt`, from (u, y) to x^."""
    import control

    system = control.StateSpace(A, B, C, D, dt)
    if signals is not None:
        named(system, signals, 1)
    return system


def named(system: control.StateSpace, signals: Signals, count: int) -> None:
    """Names of inputs, measurements and estimates, `@k` for instant k of several."""
    inputs = [*signals.inputs, *signals.measurements]
    # An observer estimates the states; a filter (4) estimates the outputs alone.
    whole = system.noutputs == len(signals.states) * count
    outputs = [f"estimate of {name}" for name in (signals.states if whole else signals.outputs)]
    system.set_inputs(each_instant(inputs, count) if count > 1 else inputs)
    system.set_outputs(each_instant(outputs, count) if count > 1 else outputs)
