"""A delay plant in other coordinates, and in units of time and of the states that solvers need."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.terms import plant_terms
from replication.estimation.delay.plant import KINDS, ONCE, DelayPlant
from replication.estimation.validation import Array, as_matrix, positive_scalar

Change = Mapping[str, Callable[[Array], Array]]


def converted(plant: DelayPlant, rows: Change, columns: Change, time: float = 1.0) -> DelayPlant:
    """The plant in other coordinates or units: rows and columns of each kind changed, delays divided by `time`."""

    fields: dict[str, Any] = {}
    for name, kinds in KINDS.items():
        left, right = rows.get(kinds[0], np.asarray), columns.get(kinds[1], np.asarray)
        matrices = getattr(plant, name)
        fields[name] = right(left(matrices)) if name in ONCE else [right(left(matrix)) for matrix in matrices]
    ranges = [(low / time, high / time) for low, high in plant.ranges]
    return DelayPlant(delays=tuple(delay / time for delay in plant.delays), ranges=tuple(ranges), **fields)


def transformed(system: DelayPlant, change: Any) -> DelayPlant:
    """The same system in the coordinates `change`·x; shape (n, n), invertible. Raises InvalidInputError otherwise."""
    size = system.states
    matrix = as_matrix("change", change, rows=size, columns=size)
    if np.linalg.matrix_rank(matrix) < size:
        raise InvalidInputError("change must be invertible; its rank is smaller than its order")
    inverse = np.linalg.inv(matrix)
    return converted(system, {"n": lambda part: matrix @ part}, {"n": lambda part: part @ inverse})


@dataclass(frozen=True)
class Scaling:
    """x' = states x, y' = sensors y, t' = t / time; w' = √gain w and z' = z / √gain: levels are divided by gain."""

    states: Array
    sensors: Array
    time: float = 1.0  # s
    gain: float = 1.0

    def at(self, gain: float) -> Self:
        """For levels about `gain`; errors and noise keep their size in the new unit of w."""
        root = (gain / self.gain) ** 0.5
        return replace(self, states=self.states * root, sensors=self.sensors * root, gain=gain)

    def plant(self, plant: DelayPlant) -> DelayPlant:
        """The plant in these units."""
        left, root, scale = self.time * self.states[:, None], self.gain**0.5, self.sensors[:, None]
        rows = {"n": lambda part: left * part, "p": lambda part: part / root, "q": lambda part: scale * part}
        columns = {"n": lambda part: part / self.states, "r": lambda part: part / root}
        return converted(plant, rows, columns, self.time)


def time_scaled(system: DelayPlant, factor: float) -> DelayPlant:
    """The same system in time t' = t/factor, with w and z as they are: the gain does not change."""
    return Scaling(np.ones(system.states), np.ones(system.measurements), factor).plant(system)


def gain_scaled(system: DelayPlant, unit: float) -> DelayPlant:
    """The same system with w and z in units that divide every gain from w to z by `unit`: B/√unit, C_1/√unit."""
    units = Scaling(np.ones(system.states), np.ones(system.measurements), gain=positive_scalar("unit", unit))
    return units.plant(system)


def measured_last(system: DelayPlant) -> tuple[DelayPlant, Array]:
    """The system in orthogonal coordinates where C_2 = [0 c], with the matrix T of x' = T x.

    The first n-q states are unmeasured, the last q are measured; T (n, n) is orthogonal. Coordinates that already have
    this form are kept, and with them the zeros of the matrices: a sparse program is a cheap one.
    """
    if not np.any(system.c2[:, : system.states - system.measurements]):
        return system, np.eye(system.states)
    _, _, right = np.linalg.svd(system.c2)
    q = system.measurements
    change = np.vstack([right[q:], right[:q]])
    rotated = transformed(system, change)
    sensor = rotated.c2.copy()
    sensor[:, : system.states - q] = 0.0
    return replace(rotated, c2=sensor), change


# Units of time and of the states in which the matrices of a plant are of moderate size: what solvers need.
#
# Σ|A_i|, then Σ|B_i| and Σ|C_1i| are balanced by a diagonal change of the states; time is counted in the inverse of the
# spectral radius of Σ|A_i|, which no diagonal change moves and which bounds every root with Re s >= 0. Averages over a
# delay count with bounds of their weights.


STEP = 64.0
"""Units are powers of it: changes of units are exact, and a plant of moderate size keeps its own."""


def natural_units(system: DelayPlant) -> Scaling:
    """Balanced units, or the plant's own where these are within a factor √STEP of them."""
    rate = reach(system)
    time = rounded(1.0 / rate if rate > 0.0 else system.delays[-1])
    states = np.array([rounded(float(value)) for value in _balance(time_scaled(system, time))])
    return Scaling(states, np.ones(system.measurements), time)


def _balance(system: DelayPlant) -> Array:
    """Factors of the states: Σ|A_i| decides, B and C_1 where states are apart, and the largest of both are equal."""
    bounds, n = plant_terms(system).terms.bound(), system.states
    size = bounds[:n, :n]
    scale = balanced_loop(size, np.zeros(n), np.zeros(n))
    drive, output = bounds[:n, n:].max(axis=1) / scale, bounds[n : n + system.outputs, :n].max(axis=0) * scale
    if not (np.any(drive) and np.any(output)):
        return np.asarray(1.0 / scale)
    row, column = drive / drive.max(), output / output.max()  # beside rates of about one
    further = balanced_loop(size / scale[:, None] * scale, row, column)
    drive, output = drive / further, output * further
    return np.asarray(np.sqrt(output.max() / drive.max()) / (scale * further))


def balanced_loop(rates: Array, drive: Array, sight: Array) -> Array:
    """Units (n,) of the states, powers of two, that balance a loop over them: driven (n,), seen (n,) and fed back."""
    loop = np.block([[rates, drive[:, None]], [sight[None, :], np.zeros((1, 1))]])
    np.fill_diagonal(loop, 0.0)  # no change of units moves it
    scale = scipy.linalg.matrix_balance(loop, permute=False, separate=True)[1][0]
    return np.asarray(scale[:-1] / scale[-1])


def reach(system: DelayPlant) -> float:
    """Spectral radius of Σ|A_i|: the absolute value of no root with Re s >= 0 is larger."""
    n = system.states
    return float(np.abs(np.linalg.eigvals(plant_terms(system).terms.bound()[:n, :n])).max())


def rounded(value: float, step: float = STEP) -> float:
    """The nearest power of `step`."""
    return float(step ** np.round(np.log(value) / np.log(step)))
