"""Units in which the matrices of a general plant are of moderate size: states, time, and those of w and z.

As `natural_units` of a plant without noise, with delayed and spread terms among the A_i, delayed disturbances among B.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.estimation.delay.general.lines import Line, LineForm
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.system import DelaySystem
from replication.estimation.delay.units import natural_units
from replication.estimation.validation import Array


@dataclass(frozen=True)
class Scaling:
    """x' = states * x, t' = t / time; w' = sqrt(gain) w and z' = z / sqrt(gain), so that levels are divided by gain."""

    states: Array
    time: float
    gain: float

    def plant(self, plant: DelayPlant) -> DelayPlant:
        """The plant in these units."""
        left, right = self.time * self.states[:, None], 1.0 / self.states
        root = self.gain**0.5
        return DelayPlant(
            a0=left * plant.a0 * right,
            delays=tuple(delay / self.time for delay in plant.delays),
            b=left * plant.b / root,
            c10=plant.c10 * right / root,
            c2=plant.c2 * right,
            a=tuple(left * a * right for a in plant.a),
            c1=tuple(c * right / root for c in plant.c1),
            b_delayed=tuple(left * b / root for b in plant.b_delayed),
            c2_delayed=tuple(c * right for c in plant.c2_delayed),
            d11=plant.d11 / self.gain,
            d21=plant.d21 / root,
            d21_delayed=tuple(d / root for d in plant.d21_delayed),
            a_spread=tuple(left * a * right for a in plant.a_spread),
            c1_spread=tuple(c * right / root for c in plant.c1_spread),
            c2_spread=tuple(c * right for c in plant.c2_spread),
        )

    def back(self, form: LineForm) -> LineForm:
        """A line form in these units in those of the plant, with the same signals on the lines."""
        n, p, root = form.states, form.outputs, self.gain**0.5
        rows = np.concatenate([1.0 / (self.time * self.states), np.full(p, root), np.ones(form.measurements)])[:, None]
        columns = np.concatenate([self.states, np.full(form.inputs, root)])
        lines = (
            Line(line.delay * self.time, line.carry * columns, rows * line.end, rows * line.moments)
            for line in form.lines
        )
        return replace(form, now=rows * form.now * columns, lines=tuple(lines))


def scaling_of(plant: DelayPlant) -> Scaling:
    """Balanced states and a natural time; w and z as they are."""
    a = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.a, plant.a_spread, strict=True))
    b = np.hstack([plant.b, *plant.b_delayed])
    c1 = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.c1, plant.c1_spread, strict=True))
    seen = np.eye(1, plant.states)  # no unit hangs on what is measured
    units = natural_units(DelaySystem(plant.a0, a, plant.delays, b, plant.c10, c1, seen))
    return Scaling(np.diag(units.change).copy(), units.time, 1.0)
