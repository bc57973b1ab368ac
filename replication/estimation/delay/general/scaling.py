"""Units in which the matrices of a general plant are of moderate size: states, time, and those of w and z.

As `natural_units` of a plant without noise, with delayed and spread terms among the A_i, delayed disturbances among B.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.central import ladder_model, normal_states, whitened
from replication.estimation.delay.exact.loop import plant_terms
from replication.estimation.delay.exact.terms import PlantTerms, axis
from replication.estimation.delay.general.lines import Line, LineForm
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.system import natural_units
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
    units = natural_units(DelayPlant(plant.a0, plant.delays, b, plant.c10, seen, a, c1))
    noise = np.linalg.norm(np.hstack([plant.d21, *plant.d21_delayed]), axis=1)
    sensors = np.array([1.0 / _power(size) if size > 0.0 else 1.0 for size in noise])
    natural = Scaling(np.diag(units.change).copy(), sensors, min(units.time, _power(plant.delays[-1])), 1.0)
    model = ladder_model(plant_terms(natural.plant(plant)), MOMENTS)
    if np.linalg.matrix_rank(model.dy) < len(model.dy):
        return natural
    return replace(natural, states=natural.states * normal_states(whitened(model))[1][: plant.states])


def _power(value: float) -> float:
    return float(2.0 ** np.round(np.log2(value)))


# Whether the measurements of a plant have noise at all frequencies: without it an observer may differentiate, and the
# least level is not attained


NONE = 1e-6
"""Least singular value, relative to rows of unit length, that counts as none."""
POINTS, DECADES, ROUNDS = 400, 4, 40


def require_noise(plant: DelayPlant) -> None:
    """Raise InvalidInputError where a combination of measurements is free of noise, at some frequency or at high ones.

    [j omega - A(j omega), B(j omega); C_2(j omega), D_21(j omega)] must have full row rank.
    """
    fast = _direct_noise(plant)
    if fast <= NONE:
        raise InvalidInputError(
            "a combination of measurements is free of noise at high frequencies (D_21 with its delayed parts loses "
            "rank there); add a disturbance of its own to each row of d21"
        )
    # Neither the unit of a state nor that of w makes noise small: in units of the errors.
    scaling = scaling_of(plant)
    omega, least = _weakest(scaling.plant(plant))
    omega /= scaling.time
    if least <= NONE:
        raise InvalidInputError(
            f"a combination of measurements is free of noise at {omega:.6g} rad/s; add a disturbance of its own to "
            "each row of d21, or drop a measurement"
        )


def _direct_noise(plant: DelayPlant) -> float:
    """The least singular value of D_21 + sum D_21i e^{-j omega tau_i} over frequencies beyond all dynamics."""
    sizes = np.linalg.norm(plant.d21, axis=1) + sum(np.linalg.norm(d, axis=1) for d in plant.d21_delayed)
    if plant.measurements > plant.inputs or np.any(sizes == 0.0):
        return 0.0

    def values(omega: Array) -> Array:
        total = np.tile(plant.d21.astype(complex), (len(omega), 1, 1))
        for delay, matrix in zip(plant.delays, plant.d21_delayed, strict=True):
            total += np.exp(-1j * omega * delay)[:, None, None] * matrix
        return np.asarray(np.linalg.svd(total / sizes[:, None], compute_uv=False)[:, -1])

    return _least(values, np.linspace(0.0, 40.0 * np.pi / plant.delays[0], 4000))[1]


def _weakest(plant: DelayPlant) -> tuple[float, float]:
    """The frequency where the pencil comes closest to losing a row, and how close."""
    terms, rate = plant_terms(plant), 1.0 / plant.delays[-1]
    grid = np.concatenate([[0.0], rate * np.logspace(-DECADES, DECADES / 2, POINTS), rate * np.linspace(0, 50, POINTS)])
    return _least(lambda omega: _sizes(terms, omega), np.unique(grid))


def _least(values: Callable[[Array], Array], omega: Array) -> tuple[float, float]:
    """Where a function is least, near the least of its values on a grid, and that value."""
    on_grid = values(omega)
    best = int(np.argmin(on_grid))
    left, right = omega[max(best - 1, 0)], omega[min(best + 1, len(omega) - 1)]
    for _ in range(ROUNDS):
        first, second = left + (right - left) / 3.0, right - (right - left) / 3.0
        low, high = values(np.array([first, second]))
        left, right = (left, second) if low < high else (first, right)
    middle = (left + right) / 2.0
    found = float(values(np.array([middle]))[0])
    return (middle, found) if found < on_grid[best] else (float(omega[best]), float(on_grid[best]))


def _sizes(terms: PlantTerms, omega: Array) -> Array:
    return np.asarray(np.linalg.svd(terms.pencil(omega, terms.terms.at(axis(omega))), compute_uv=False)[:, -1])
