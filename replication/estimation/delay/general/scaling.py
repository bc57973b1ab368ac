"""Units in which the matrices of a general plant are of moderate size: states, time, and those of w and z.

As `natural_units` of a plant without noise, with delayed and spread terms among the A_i, delayed disturbances among B.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.estimation.delay.exact.central import normal_states, whitened
from replication.estimation.delay.exact.forms import plant_terms
from replication.estimation.delay.exact.ladder import ladder_model
from replication.estimation.delay.general.lines import Line, LineForm
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.system import DelaySystem
from replication.estimation.delay.units import natural_units
from replication.estimation.validation import Array

MOMENTS = 3
"""On each piece of the past, in the model of the Kalman filter."""


@dataclass(frozen=True)
class Scaling:
    """x' = states * x, y' = sensors * y, t' = t / time; w' = sqrt(gain) w and z' = z / sqrt(gain).

    So levels are divided by gain.
    """

    states: Array
    sensors: Array
    time: float
    gain: float

    def at(self, gain: float) -> Scaling:
        """For levels about `gain`; errors and noise keep their size in the new unit of w."""
        root = (gain / self.gain) ** 0.5
        return replace(self, states=self.states * root, sensors=self.sensors * root, gain=gain)

    def plant(self, plant: DelayPlant) -> DelayPlant:
        """The plant in these units."""
        left, right = self.time * self.states[:, None], 1.0 / self.states
        root, seen = self.gain**0.5, self.sensors[:, None]
        return DelayPlant(
            a0=left * plant.a0 * right,
            delays=tuple(delay / self.time for delay in plant.delays),
            b=left * plant.b / root,
            c10=plant.c10 * right / root,
            c2=seen * plant.c2 * right,
            a=tuple(left * a * right for a in plant.a),
            c1=tuple(c * right / root for c in plant.c1),
            b_delayed=tuple(left * b / root for b in plant.b_delayed),
            c2_delayed=tuple(seen * c * right for c in plant.c2_delayed),
            d11=plant.d11 / self.gain,
            d21=seen * plant.d21 / root,
            d21_delayed=tuple(seen * d / root for d in plant.d21_delayed),
            a_spread=tuple(left * a * right for a in plant.a_spread),
            c1_spread=tuple(c * right / root for c in plant.c1_spread),
            c2_spread=tuple(seen * c * right for c in plant.c2_spread),
        )

    def back(self, form: LineForm) -> LineForm:
        """A line form in these units in those of the plant, with the same signals on the lines."""
        p, root = form.outputs, self.gain**0.5
        rows = np.concatenate([1.0 / (self.time * self.states), np.full(p, root), 1.0 / self.sensors])[:, None]
        columns = np.concatenate([self.states, np.full(form.inputs, root)])
        lines = (
            Line(line.delay * self.time, line.carry * columns, rows * line.end, rows * line.moments)
            for line in form.lines
        )
        return replace(form, now=rows * form.now * columns, lines=tuple(lines))


def scaling_of(plant: DelayPlant) -> Scaling:
    """Time in natural units, at most the longest delay; errors of the Kalman filter of unit size; w and z as they are.

    So a slow mode is as large as its error, and not as what it becomes in its own time. Where there is no Kalman filter
    the states are balanced.
    """
    a = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.a, plant.a_spread, strict=True))
    b = np.hstack([plant.b, *plant.b_delayed])
    c1 = tuple(now + np.abs(spread).sum(axis=0) for now, spread in zip(plant.c1, plant.c1_spread, strict=True))
    seen = np.eye(1, plant.states)  # no unit hangs on what is measured
    units = natural_units(DelaySystem(plant.a0, a, plant.delays, b, plant.c10, c1, seen))
    noise = np.linalg.norm(np.hstack([plant.d21, *plant.d21_delayed]), axis=1)
    sensors = np.array([1.0 / _power(size) if size > 0.0 else 1.0 for size in noise])
    natural = Scaling(np.diag(units.change).copy(), sensors, min(units.time, _power(plant.delays[-1])), 1.0)
    model = ladder_model(plant_terms(natural.plant(plant)), MOMENTS)
    if np.linalg.matrix_rank(model.dy) < len(model.dy):
        return natural
    return replace(natural, states=natural.states * normal_states(whitened(model))[1][: plant.states])


def _power(value: float) -> float:
    return float(2.0 ** np.round(np.log2(value)))
