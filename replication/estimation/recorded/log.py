"""A log: a CSV file or a table with a column of times, NaN where nothing came; checked against sensors and inputs."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import Array
from replication.files import read_text

LEAST_SAMPLES = 20
OFF_GRID = 0.1
"""Share of a base period by which a time may miss its instant."""
SPARSE = 100
"""Instants for each row, beyond which the base period does not fit the log."""


@dataclass(frozen=True, eq=False)
class Log:
    """Times t (N,), s; measurements y (N, q), NaN where nothing came; inputs u (N, m), held from their time on."""

    t: Array
    y: Array
    u: Array

    def on_grid(self, dt: float) -> Self:
        """A row for each base period from the first row on; raises InvalidInputError for a time between two of them."""
        place = (self.t - self.t[0]) / dt
        instants = np.rint(place).astype(int)
        off = np.abs(place - instants)
        if np.any(off > OFF_GRID):
            row = int(np.argmax(off > OFF_GRID))
            raise InvalidInputError(
                f"row {row} (t = {self.t[row]:.9g} s) lies {off[row]:.2g} base periods of {dt:g} s beside the grid "
                "that begins with the first row: correct dt, or take a plant and a filter with time stamps"
            )
        if np.any(np.diff(instants) == 0):
            row = int(np.argmin(np.diff(instants))) + 1
            raise InvalidInputError(f"rows {row - 1} and {row} lie in one base period of {dt:g} s; merge them")
        count = int(instants[-1]) + 1
        if count > SPARSE * len(instants):
            raise InvalidInputError(
                f"the log has {len(instants)} rows over {count} base periods of {dt:g} s: check dt and the unit of time"
            )
        y = np.full((count, self.y.shape[1]), np.nan)
        y[instants] = self.y
        held = np.searchsorted(instants, np.arange(count), side="right") - 1
        return type(self)(self.t[0] + dt * np.arange(count), y, self.u[held])

    def taken(self, latency: Array) -> tuple[Self, Array]:
        """By the times at which samples were taken, latency (q,) earlier, each late sensor in rows of its own.

        Also says which sensor's latency moves each row (N,), -1 for none.
        """
        late = [int(j) for j in np.flatnonzero(~np.isnan(latency))]
        if not late:
            return self, np.full(len(self.t), -1)
        y = np.array(self.y)
        y[:, late] = np.nan
        t, rows, owner = [self.t], [y], [np.full(len(y), -1)]
        for j in late:
            came = ~np.isnan(self.y[:, j])
            alone = np.full((int(came.sum()), y.shape[1]), np.nan)
            alone[:, j] = self.y[came, j]
            t, rows, owner = [*t, self.t[came] - latency[j]], [*rows, alone], [*owner, np.full(len(alone), j)]
        times = np.concatenate(t)
        order = np.argsort(times, kind="stable")
        held = np.maximum(np.searchsorted(self.t, times[order], side="right") - 1, 0)
        return type(self)(times[order], np.concatenate(rows)[order], self.u[held]), np.concatenate(owner)[order]


def read_log(
    log: Any, sensors: Sequence[str], inputs: Sequence[str], *, time: str = "t", least: int = LEAST_SAMPLES
) -> Log:
    """Check a log against what a filter takes.

    Parameters
    ----------
    log : str, path, or mapping of str to array (N,)
        CSV file with a heading, or a table; a DataFrame is one. Empty or NaN where a sensor gave nothing.
    sensors : sequence of str
        Columns of the measurements, in order.
    inputs : sequence of str
        Columns of the known inputs, in order.
    time : str
        Column of times, s.
    least : int
        Samples that each sensor must have.

    Returns
    -------
    Log
        Sorted, with finite times and inputs.

    Raises
    ------
    InvalidInputError
        A column is missing, unknown or no numbers, times do not increase, an input is NaN, or samples are too few.
    """
    columns = _columns(log)
    if time not in columns:
        raise InvalidInputError(f"the log has no column of times {time!r}, only {sorted(columns)}; name it by time=")
    if unknown := sorted(set(columns) - {time, *sensors, *inputs}):
        raise InvalidInputError(
            f"no sensor or input has the name {unknown[0]!r}: sensors are {list(sensors)}; drop the column, or name "
            "the known inputs by inputs="
        )
    for name in (*sensors, *inputs):
        if name not in columns:
            raise InvalidInputError(f"the log has no column {name!r}; give one, empty where nothing came")
    sizes = {name: len(column) for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        raise InvalidInputError(f"all columns must have one length, got {sizes}")
    t = columns[time]
    if not np.all(np.isfinite(t)):
        row = int(np.argmin(np.isfinite(t)))
        raise InvalidInputError(f"the time in row {row} is no finite number; give each row one")
    if np.any(wrong := np.diff(t) <= 0):
        row = int(np.argmax(wrong)) + 1
        what = "repeated" if t[row] == t[row - 1] else "not sorted"
        raise InvalidInputError(
            f"times are {what}: row {row} has t = {t[row]:.9g} s after {t[row - 1]:.9g} s; sort and merge"
        )
    y = np.column_stack([columns[name] for name in sensors])
    u = np.column_stack([columns[name] for name in inputs]) if inputs else np.zeros((len(t), 0))
    for name, column in zip((*sensors, *inputs), (*y.T, *u.T), strict=True):
        if np.any(np.isinf(column)) or (name in inputs and np.any(np.isnan(column))):
            raise InvalidInputError(
                f"column {name!r} has an entry that is no finite number; an input needs all of its own"
            )
    for name, count in zip(sensors, np.sum(~np.isnan(y), axis=0), strict=True):
        if count < least:
            raise InvalidInputError(f"sensor {name!r} has {count} samples, too few: at least {least} are needed")
    return Log(t, y, u)


def _columns(log: Any) -> dict[str, Array]:
    if isinstance(log, str | PathLike):
        rows = [row for row in csv.reader(io.StringIO(read_text(Path(log)).removeprefix("\ufeff"))) if row]
        if not rows or any(len(row) != len(rows[0]) for row in rows) or len(set(rows[0])) < len(rows[0]):
            raise InvalidInputError(f"the log {log} is no table: a heading of different names, then rows as long as it")
        log = {name.strip(): [row[i].strip() or "nan" for row in rows[1:]] for i, name in enumerate(rows[0])}
    columns = {}
    try:
        for name in log.keys():  # noqa: SIM118 - a DataFrame, too
            columns[str(name)] = np.array([np.nan if v is None else v for v in log[name]], dtype=float)
    except (AttributeError, TypeError, ValueError) as error:
        raise InvalidInputError(f"a log is a CSV file or a table of named columns of numbers: {error}") from None
    return columns


def by_sensor(name: str, values: Mapping[str, float], sensors: Sequence[str]) -> Array:
    """One number for each sensor that `values` names, NaN for the others (q,); raises InvalidInputError."""
    try:
        numbers = {sensor: float(value) for sensor, value in values.items()}
    except (AttributeError, TypeError, ValueError):
        raise InvalidInputError(f"{name} must name sensors with a number each, got {values!r}") from None
    unknown = [sensor for sensor in numbers if sensor not in sensors]
    if unknown or not np.all(np.isfinite(list(numbers.values()))):
        raise InvalidInputError(f"{name} must be finite numbers for sensors out of {list(sensors)}, got {values!r}")
    return np.array([numbers.get(sensor, np.nan) for sensor in sensors])
