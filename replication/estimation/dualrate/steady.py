"""Constant loads and set-points of a dual-rate loop: what is held, with what input, and what error is left.

A state that no input moves and that stands still by itself, as a weight or the sag of a battery, is a load b = F x: a
model of what acts on the plant, which feedback need not stabilise. With x = J x_s + V b, x_s = E x,

    x_s' = A_s x_s + A_b b + B_s u,    and at rest  x = X (b, r), u = U (b, r)

where the tracked outputs C_t x stand at the set-points r. Feedback acts on what x and u lack of that: this is integral
action, as the observer estimates b. Source: Francis and Wonham, The internal model principle (1976), for constants.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.api.results import Evidence
from replication.estimation.dualrate.loop import Driven
from replication.estimation.dualrate.problem import Plant, row_of_output, units_of
from replication.estimation.validation import Array, finite_vector

STILL, REACHED, ROUNDS = 1e-12, 1e-9, 8
"""Relative size of what moves a load, and of what is missing at rest, that is rounding; of finding units."""


@dataclass(frozen=True, eq=False)
class Steady:
    """A plant apart from its loads, and where it rests.

    load: F (b, n). kept: E (n - b, n). back: J (n, n - b). inner: A_s, B_s, C J. states: X (n, b + t).
    inputs: U (m, b + t). tracked: rows of C. asked: whether there are set-points.
    """

    load: Array
    kept: Array
    back: Array
    inner: Plant
    states: Array
    inputs: Array
    tracked: tuple[int, ...]
    asked: bool

    @property
    def loads(self) -> int:
        """Number of loads b."""
        return len(self.load)

    @property
    def deviation(self) -> Array:
        """E - E X F (n - b, n): x_s less where the loads hold it."""
        return np.asarray(self.kept - self.kept @ self.states[:, : self.loads] @ self.load)

    @property
    def references(self) -> Array:
        """X and U for the set-points alone (n + m, t); no columns unless they are asked for."""
        both = np.vstack([self.states, self.inputs])
        return both[:, self.loads :] if self.asked else both[:, :0]

    def feedback(self, inner: Array) -> Array:
        """K (m, n) of a feedback of x_s (m, n - b): u = inner (x_s - E X b) + U b."""
        return np.asarray(inner @ self.deviation + self.inputs[:, : self.loads] @ self.load)

    def ahead(self, feedback: Array) -> Array:
        """N (m, t) of u = K x^ + N r."""
        n = len(self.states)
        return np.asarray(self.references[n:] - feedback @ self.references[:n])


def steady_of(plant: Plant, tracked: Any = None) -> Steady | None:
    """The loads of a plant and where it rests; None without loads and set-points.

    tracked: outputs that are held at set-points, all of them unless given. Raises InvalidInputError if there is no such
    output, or no input that holds them.
    """
    load, fixed = _loads(plant)
    if not len(load) and tracked is None:
        return None
    count, n, m = len(plant.C), plant.order, plant.B_u.shape[1]
    outputs = range(count) if tracked is None else [tracked] if np.ndim(tracked) == 0 else list(tracked)
    rows = tuple(row_of_output(plant, output, "tracked") for output in outputs)
    if len(set(rows)) != len(rows) or not 0 < len(rows) <= m:
        raise InvalidInputError(
            f"{m} inputs hold at most as many outputs at rest, each named once, got {list(rows)}: choose `tracked`"
        )
    moving = np.setdiff1d(np.arange(n), fixed)
    kept, back, carried = np.eye(n)[moving], np.zeros((n, n - len(load))), np.eye(n)[:, fixed]
    back[moving] = np.eye(len(moving))
    back[fixed] = -load[:, moving]
    inner = Plant(kept @ plant.A @ back, kept @ plant.B_u, plant.C @ back)
    C, at = plant.C[list(rows)], len(moving)
    equations = np.block([[inner.A, inner.B_u], [C @ back, np.zeros((len(rows), m))]])
    aims = np.zeros((len(equations), len(load) + len(rows)))
    aims[:at, : len(load)], aims[at:, : len(load)] = -kept @ plant.A @ carried, -C @ carried
    aims[at:, len(load) :] = np.eye(len(rows))
    rest = _solved(equations, aims)
    if rest is None:
        raise InvalidInputError(
            f"no constant input holds the outputs {list(rows)} at rest under loads and set-points: the plant has a "
            "zero at s = 0 from the inputs to them, or a load that the inputs do not reach; track others"
        )
    states = back @ rest[:at]
    states[:, : len(load)] += carried
    return Steady(load, kept, back, inner, states, rest[at:], rows, tracked is not None)


def wanted(setpoint: Any, count: int) -> Array:
    """r (t,), zero unless given; raises InvalidInputError."""
    if setpoint is not None and not count:
        raise InvalidInputError("the design follows no set-points: name the outputs that do, tracked=[..], in `design`")
    return np.zeros(count) if setpoint is None else finite_vector("setpoint", setpoint, count)


def steady_error(steady: Steady, plant: Plant, loop: Sequence[Driven]) -> Evidence:
    """The largest error at rest of a loop at any instant, one of loads and set-points being one."""
    (size, references), count = loop[0].drive.shape, steady.loads
    readout = np.vstack([steady.load, plant.C[list(steady.tracked)]])
    rows = np.hstack([readout, np.zeros((len(readout), size - plant.order))])
    total = np.eye(size + references)
    steps = []
    for instant in loop:
        steps.append(total)
        joint = np.eye(size + references)
        joint[:size] = np.hstack([instant.state, instant.drive])
        total = joint @ total
    conditions = np.vstack([np.hstack([rows[:count], np.zeros((count, references))]), np.eye(size + references)[size:]])
    moved = (total - np.eye(len(total)))[:size]
    rest = _solved(np.vstack([moved, conditions]), np.eye(size + count + references)[:, size:])
    how = "of a tracked output at rest, for one of each load and set-point; exact, all fast instants"
    if rest is None:
        return Evidence("steady error", "none: no rest", how)
    output = np.hstack([rows[count:], np.zeros((len(rows) - count, references))])
    aims = np.zeros((len(output), count + references))
    aims[:, count:] = np.eye(len(output), references)
    return Evidence("steady error", max(float(np.abs(output @ step @ rest - aims).max()) for step in steps), how)


def _loads(plant: Plant) -> tuple[Array, Array]:
    """F (b, n) with F A = 0 and F B = 0, and the states of which it is the unit matrix."""
    n = plant.order
    units = units_of(plant)
    moved = np.hstack([plant.A * units, plant.B_u]) / units[:, None]
    sizes = np.linalg.norm(moved, axis=0)  # columns have units of their own
    moved = moved[:, sizes > 0.0] / sizes[sizes > 0.0]
    moved /= max(float(np.linalg.norm(moved)), np.finfo(float).tiny)
    left, values, _ = np.linalg.svd(moved)
    kernel = left[:, np.count_nonzero(values > STILL) :].T / units
    if not len(kernel):
        return np.zeros((0, n)), np.zeros(0, dtype=int)
    fixed = np.sort(scipy.linalg.qr(kernel * units, pivoting=True)[2][: len(kernel)])
    load = np.linalg.solve(kernel[:, fixed], kernel)
    return np.where(np.abs(load) * units > STILL * np.abs(load * units).max(axis=1, keepdims=True), load, 0.0), fixed


def _solved(matrix: Array, aims: Array) -> Array | None:
    """The least solution in units in which rows and columns have unit length, or None."""
    rows, columns = np.ones((len(matrix), 1)), np.ones(matrix.shape[1])
    for _ in range(ROUNDS):
        sizes = np.linalg.norm(matrix / rows / columns, axis=1, keepdims=True)
        rows *= np.where(sizes > 0.0, sizes, 1.0)
        sizes = np.linalg.norm(matrix / rows / columns, axis=0)
        columns *= np.where(sizes > 0.0, sizes, 1.0)
    solution = np.linalg.lstsq(matrix / rows / columns, aims / rows, rcond=None)[0] / columns[:, None]
    missing = np.abs(matrix @ solution - aims) / rows
    known = np.abs(matrix / rows) @ np.abs(solution) + np.abs(aims / rows)
    return np.asarray(solution) if np.all(missing <= REACHED * np.maximum(known.max(axis=0), 1e-300)) else None
