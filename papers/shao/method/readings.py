"""Readings of an under-specified simulation, the error ratios that each implies, and the search of all for the nearest.

Every structural choice is data. The printed order is the predictor form of an observer, ζ(k+1) = F ζ(k) + G u(k) + H
ȳ(k) with x̂(k) = ζ(k): a measurement acts one fast period later. In the current form x̂(k) = ζ(k) + H ȳ(k) and ζ(k+1) =
F x̂(k) + G u(k); with a discrete gain this is the textbook current observer x̂(k) = ζ(k) + L (ȳ(k) − C ζ(k)),
ζ(k+1) = Ā x̂(k) + B̄ u(k). Distance of a reading from a printed column: max over the frequencies of
|ln(computed / printed)|.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from itertools import product

import numpy as np

from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming, tracking_command
from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import DualRateLoop, Points, close_loop, time_response, tracking_error_ratio
from replication.estimation.dualrate.observers import OBSERVERS, Builder, Observer, ObserverStep, SampledModel
from replication.estimation.dualrate.problem import DualRateDesign
from replication.estimation.validation import Array

Window = tuple[int, int]
"""Start and end of a time window, in slow periods."""


class Start(StrEnum):
    """ζ(0): zero, the true x(0), or the first output followed by zeros."""

    ZERO = "zero"
    TRUE = "true state"
    OUTPUT = "output only"


@dataclass(frozen=True, kw_only=True)
class Structure:
    """The choices that every observer of a table shares; the defaults are the literal reading."""

    feedforward: Feedforward = Feedforward.PRINTED
    timing: ReferenceTiming = ReferenceTiming.HELD
    discrete_gain: bool = False
    current: bool = False


@dataclass(frozen=True)
class Reading:
    """One way to read the text; the defaults, with no window (steady state), are the literal one."""

    observer: str = "alternating_predictive"
    structure: Structure = Structure()
    start: Start = Start.ZERO
    points: Points = Points.BETWEEN
    window: Window | None = None


STRUCTURES: tuple[Structure, ...] = tuple(
    Structure(feedforward=form, timing=timing, discrete_gain=discrete, current=now)
    for now, form, timing, discrete in product((False, True), Feedforward, ReferenceTiming, (False, True))
)


@dataclass(frozen=True, eq=False)
class ReadingSpace:
    """What is read: motor, gains and rates, printed x(0), reference frequencies (rad/s).

    horizon: end of the longest window, in slow periods. substeps: points per fast period within a window.
    """

    motor: Motor
    design: DualRateDesign
    start: tuple[float, ...]
    frequencies: tuple[float, ...]
    horizon: int = 100
    substeps: int = 40

    @cached_property
    def windows(self) -> tuple[Window, ...]:
        """All windows [a, b) with 0 ≤ a < b ≤ horizon."""
        return tuple((a, b) for a in range(self.horizon) for b in range(a + 1, self.horizon + 1))

    @cached_property
    def rows(self) -> tuple[tuple[Start, Points, Window | None], ...]:
        """Of each row of `error_ratios` start, points and window: steady state per kind of points, then all windows."""
        return (*((Start.ZERO, points, None) for points in Points), *product(Start, Points, self.windows))

    def reading(self, observer: str, structure: Structure, row: int) -> Reading:
        """The reading that row `row` of `error_ratios` stands for."""
        return Reading(observer, structure, *self.rows[row])

    def loop(self, observer: str, structure: Structure, frequency: float) -> DualRateLoop:
        """The loop of a reading at one reference frequency."""
        command = tracking_command(self.motor, self.design, frequency, structure.feedforward, structure.timing)
        builder = OBSERVERS[observer]
        return close_loop(
            self.design,
            current(builder, discrete_gain=structure.discrete_gain) if structure.current else builder,
            harmonic=command,
            discrete_gain=structure.discrete_gain,
        )


def error_ratios(space: ReadingSpace, observer: str, structure: Structure) -> Array:
    """Error ratios of all readings of one observer and structure: (rows, frequencies); NaN where there is none."""
    return np.stack([_column(space, observer, structure, f) for f in space.frequencies], axis=1)


def _column(space: ReadingSpace, observer: str, structure: Structure, frequency: float) -> Array:
    loop = space.loop(observer, structure, frequency)
    try:
        steady = [tracking_error_ratio(loop, points) for points in Points]
    except InfeasibleError:  # an unstable loop still has an error in every window
        steady = [np.nan] * len(Points)
    return np.concatenate([steady, windowed_errors(space, loop).ravel()])


def windowed_errors(space: ReadingSpace, loop: DualRateLoop) -> Array:
    """Error ratios of a loop from each ζ(0), at each kind of points, over all windows: (starts, points, windows)."""
    return _window_maxima(np.array([_peaks(space, loop, start) for start in Start]))


def first_estimate(start: Start, x: Array, output: Array) -> Array:
    """ζ(0) for the plant's state x(0) and output row C."""
    return {Start.ZERO: 0 * x, Start.TRUE: x, Start.OUTPUT: output * (output @ x)}[start]


def _peaks(space: ReadingSpace, loop: DualRateLoop, start: Start) -> Array:
    """Largest |y − y_d| in each slow period from a start, shape (points, periods)."""
    x = np.array(space.start)
    estimate = first_estimate(start, x, loop.plant.C[0])
    response = time_response(loop, x, estimate, slow_periods=space.horizon, substeps=space.substeps)
    error = np.abs(response.error).reshape(space.horizon, space.design.ratio, space.substeps)
    return np.stack([error.max(axis=(1, 2)), error[..., 0].max(axis=1), error[:, 0, 0]])


def _window_maxima(peaks: Array) -> Array:
    """Maxima over all windows [a, b) of the last axis, in the order of `ReadingSpace.windows`."""
    size = peaks.shape[-1]
    rows = np.where(np.tri(size, k=-1, dtype=bool), -np.inf, peaks[..., None, :])
    first, last = np.triu_indices(size)
    return np.asarray(np.maximum.accumulate(rows, axis=-1)[..., first, last])


def current(builder: Builder, *, discrete_gain: bool = False) -> Builder:
    """A builder of the current form of what `builder` builds; `discrete_gain` as in `close_loop`."""

    def built(model: SampledModel) -> Observer:
        F = model.predictor.state if discrete_gain else model.F
        predictor, free = builder(model), builder(replace(model, F=F, H=np.zeros_like(model.H)))
        steps = tuple(_current_step(step, bare) for step, bare in zip(predictor.steps, free.steps, strict=True))
        return replace(predictor, steps=steps)

    return built


def _current_step(step: ObserverStep, bare: ObserverStep) -> ObserverStep:
    """Correct first, then move on without correction: what a step has beyond the bare one is the correction."""
    correction, reading = step.transition - bare.transition, step.injection - bare.injection
    corrected = np.eye(len(correction)) + correction
    return ObserverStep(
        transition=bare.transition @ corrected,
        input=bare.input,
        injection=bare.transition @ reading + bare.injection,
        forcing=bare.forcing,
        readout=step.readout @ corrected,
        feedthrough=step.feedthrough + step.readout @ reading,
    )


@dataclass(frozen=True, eq=False)
class Column:
    """A printed column: observers that may stand for it, values, and half-widths to print."""

    observers: tuple[str, ...]
    values: Array
    half_widths: Array


@dataclass(frozen=True)
class Near:
    """The nearest reading found so far: its distance, its row within (observer, structure), and its values."""

    distance: float
    observer: str
    structure: int
    row: int
    values: tuple[float, ...]


@dataclass(frozen=True)
class BlockResult:
    """What one block found.

    Per column: nearest; tried, how many readings; distinct, how many of them differ to print within a structure; hits
    to print; best distance per observer. joint: the columns' readings at the nearest common reading; joint_hits: all
    columns to print.
    """

    structure: int
    nearest: Mapping[str, Near]
    tried: Mapping[str, int]
    distinct: Mapping[str, int]
    hits: Mapping[str, int]
    by_observer: Mapping[str, float]
    joint: Mapping[str, Near]
    joint_hits: int

    @property
    def joint_distance(self) -> float:
        """Distance of the nearest common reading."""
        return max(near.distance for near in self.joint.values())


def search_block(space: ReadingSpace, columns: Mapping[str, Column], index: int) -> BlockResult:
    """Search all readings of structure number `index`; deterministic, ties go to the first reading.

    Per column, in arrays over (observers, readings): NaN marks one without a steady state, infinitely far from all.
    """
    values, distances, hits = {}, {}, {}
    for name, column in columns.items():
        errors = np.stack([error_ratios(space, observer, STRUCTURES[index]) for observer in column.observers])
        away = np.abs(np.log(errors) - np.log(column.values)).max(axis=2)
        values[name], distances[name] = errors, np.nan_to_num(away, nan=np.inf)
        hits[name] = np.any(np.all(np.abs(errors - column.values) <= column.half_widths, axis=2), axis=0)

    def near(name: str, row: int) -> Near:
        which = int(np.argmin(distances[name][:, row]))
        ratios = tuple(values[name][which, row].tolist())
        return Near(float(distances[name][which, row]), columns[name].observers[which], index, row, ratios)

    nearest = {name: away.min(axis=0) for name, away in distances.items()}
    tried = {name: np.isfinite(away) for name, away in distances.items()}
    row = int(np.argmin(np.max(list(nearest.values()), axis=0)))
    return BlockResult(
        structure=index,
        nearest={name: near(name, int(np.argmin(away))) for name, away in nearest.items()},
        tried={name: int(finite.sum()) for name, finite in tried.items()},
        distinct={
            name: len(np.unique(np.rint(values[name][tried[name]] / (2 * column.half_widths)), axis=0))
            for name, column in columns.items()
        },
        hits={name: int(hit.sum()) for name, hit in hits.items()},
        by_observer={
            observer: float(away.min())
            for name, column in columns.items()
            for observer, away in zip(column.observers, distances[name], strict=True)
        },
        joint={name: near(name, row) for name in columns},
        joint_hits=int(np.sum(np.all(list(hits.values()), axis=0))),
    )


def merge(blocks: Sequence[BlockResult]) -> BlockResult:
    """The result of all blocks together; independent of their order."""
    blocks = sorted(blocks, key=lambda block: block.structure)
    best = min(blocks, key=lambda block: block.joint_distance)

    def added(parts: Sequence[Mapping[str, int]]) -> dict[str, int]:
        return {name: sum(part[name] for part in parts) for name in parts[0]}

    return BlockResult(
        structure=best.structure,
        nearest={name: min((b.nearest[name] for b in blocks), key=lambda near: near.distance) for name in best.nearest},
        tried=added([block.tried for block in blocks]),
        distinct=added([block.distinct for block in blocks]),
        hits=added([block.hits for block in blocks]),
        by_observer={name: min(b.by_observer[name] for b in blocks) for name in best.by_observer},
        joint=best.joint,
        joint_hits=sum(block.joint_hits for block in blocks),
    )


def reading_of(space: ReadingSpace, near: Near) -> Reading:
    """The reading behind a `Near`."""
    return space.reading(near.observer, STRUCTURES[near.structure], near.row)
