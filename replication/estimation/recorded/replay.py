"""A filter run over a log: estimates with covariance, and whether its innovations are white and as large as it says.

The whitened innovations of the right model are independent standard normal numbers. Their sum of squares (NIS) is then
chi-square, and the autocorrelations of each sensor give the statistic of G. M. Ljung and G. E. P. Box, Biometrika 65
(1978), eq. 1.3, chi-square too.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.shown import Shown, as_text
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.kalman import Estimate, Instant, Recursion
from replication.estimation.validation import Array

LEAST_SAMPLES, LAGS, PROBABILITY = 20, 10, 0.95
UNITS = 1e6
"""Ratio of the size of a sensor's numbers to what the model expects beyond which the units are suspect."""


@dataclass(frozen=True, eq=False)
class Log:
    """Times t (N,), s; measurements y (N, q), NaN where nothing came; inputs u (N, m), held from their time on."""

    t: Array
    y: Array
    u: Array


def read_log(log: Any, plant: NoisyPlant, *, time: str = "t", inputs: tuple[str, ...] = ()) -> Log:
    """Check a log against a plant.

    Parameters
    ----------
    log : str, path, or mapping of str to array (N,)
        CSV file with a heading, or a table; a DataFrame is one. Empty or NaN where a sensor gave nothing.
    plant : NoisyPlant
        Its sensors name the columns.
    time : str
        Name of the column of times, s.
    inputs : tuple of str
        Names of the columns of the plant's known inputs, in order.

    Raises
    ------
    InvalidInputError
        A column is missing, unknown or no numbers, times do not increase, an input is NaN, or samples are too few.
    """
    columns = _columns(log)
    if time not in columns:
        raise InvalidInputError(f"the log has no column of times {time!r}, only {sorted(columns)}; name it by time=")
    if len(inputs) != plant.B_u.shape[1]:
        raise InvalidInputError(f"the plant has {plant.B_u.shape[1]} known inputs, inputs= names {len(inputs)}")
    names = list(plant.sensors)
    unknown = sorted(set(columns) - {time, *names, *inputs})
    if unknown:
        raise InvalidInputError(f"no sensor or input has the name {unknown[0]!r}: sensors are {names}; drop the column")
    for name in (*names, *inputs):
        if name not in columns:
            raise InvalidInputError(f"the log has no column {name!r}; give one, empty where nothing came")
    sizes = {name: len(column) for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        raise InvalidInputError(f"all columns must have one length, got {sizes}")
    t = columns[time]
    if not np.all(np.isfinite(t)):
        raise InvalidInputError(
            f"the time in row {int(np.argmin(np.isfinite(t)))} is no finite number; give each row one"
        )
    if np.any(wrong := np.diff(t) <= 0):
        row = int(np.argmax(wrong)) + 1
        what = "repeated" if t[row] == t[row - 1] else "not sorted"
        raise InvalidInputError(
            f"times are {what}: row {row} has t = {t[row]:.9g} s after {t[row - 1]:.9g} s; sort and merge"
        )
    y = np.column_stack([columns[name] for name in names])
    u = np.column_stack([columns[name] for name in inputs]) if inputs else np.zeros((len(t), 0))
    for name, column in zip((*names, *inputs), (*y.T, *u.T), strict=True):
        if np.any(np.isinf(column)) or (name in inputs and np.any(np.isnan(column))):
            raise InvalidInputError(
                f"column {name!r} has an entry that is no finite number; an input needs all of its own"
            )
    for name, count in zip(names, np.sum(~np.isnan(y), axis=0), strict=True):
        if count < LEAST_SAMPLES:
            raise InvalidInputError(
                f"sensor {name!r} has {count} samples, too few: at least {LEAST_SAMPLES} are needed"
            )
    return Log(t, y, u)


def _columns(log: Any) -> dict[str, Array]:
    if isinstance(log, str | PathLike):
        try:
            rows = list(csv.reader(io.StringIO(Path(log).read_text(encoding="utf-8-sig"))))
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidInputError(f"the log {log} cannot be read: {error}") from None
        rows = [row for row in rows if row]
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


def instants(recursion: Recursion, start: Estimate, log: Log) -> Iterator[Instant]:
    """What the filter knows after each row."""
    prior = start
    for i, (y, u) in enumerate(zip(log.y, log.u, strict=True)):
        known = recursion.update(prior, y, u)
        yield known
        if i + 1 < len(log.t):
            prior = recursion.predict(known, float(log.t[i + 1]))


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Replay(Shown):
    """A filter over a log.

    Attributes
    ----------
    log : Log
        What was read.
    sensors : tuple of str
        Names of the q sensors.
    estimates, covariances : array (N, n), (N, n, n)
        x^(k|k) and that of its error.
    innovations, whitened : array (N, q)
        y - C x^(k|k-1), and the same as independent numbers of variance one if the model is right; NaN where none.
    used, missing : array (q,)
        Numbers that corrected the estimate, and rows without one.
    gated : int
        Numbers beyond the gate.
    white : array (q,)
        Probability of at least this much autocorrelation if the innovations are white (Ljung-Box).
    nis : float
        Mean square of the whitened innovations; one is expected.
    interval : (float, float)
        In which `nis` lies with a probability of 95 % if the model is right.
    suspicions : tuple of str
        Of units.
    """

    log: Log
    sensors: tuple[str, ...]
    estimates: Array
    covariances: Array
    innovations: Array
    whitened: Array
    used: Array
    missing: Array
    gated: int
    white: Array
    nis: float
    interval: tuple[float, float]
    suspicions: tuple[str, ...]

    @property
    def consistent(self) -> bool:
        """Whether `nis` lies in its interval."""
        return self.interval[0] <= self.nis <= self.interval[1]

    def rows(self) -> list[tuple[str, str, str]]:
        """The lines of the table."""
        size = "as expected" if self.consistent else "too large" if self.nis > self.interval[1] else "too small"
        low, high = self.interval
        lines = [("size of the innovations", f"{self.nis:.4g}, {size}", f"NIS; 95 % interval [{low:.4g}, {high:.4g}]")]
        for name, p, used, missing in zip(self.sensors, self.white, self.used, self.missing, strict=True):
            verdict = "white" if p >= 1 - PROBABILITY else "not white"
            lines.append((f"innovations of {name}", f"{verdict}, probability {p:.3g}", f"Ljung-Box, {LAGS} lags"))
            lines.append((f"samples of {name}", f"{used} used, {missing} missing", "counted"))
        lines.append(("beyond the gate", as_text(self.gated), "counted"))
        return lines + [("suspicion", text, "size of the innovations") for text in self.suspicions]

    def panels(self) -> tuple[Panel, ...]:
        """Each state with its 95 % band, the whitened innovations, and their autocorrelation."""
        width = stats.norm.ppf((1 + PROBABILITY) / 2)
        bands = width * np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        states = [
            Panel(self.log.t, "time (s)", f"x[{i}]", {"estimate": x, "95 % below": x - b, "95 % above": x + b}, {})
            for i, (x, b) in enumerate(zip(self.estimates.T, bands.T, strict=True))
        ]
        marks = {"95 %": width, "-95 %": -width}
        curves = dict(zip(self.sensors, self.whitened.T, strict=True))
        series = {name: autocorrelation(w[~np.isnan(w)]) for name, w in curves.items()}
        bound = width / np.sqrt(float(self.used.min()))
        return (
            *states,
            Panel(self.log.t, "time (s)", "whitened innovation", curves, marks),
            Panel(np.arange(1, LAGS + 1), "lag", "autocorrelation", series, {"95 %": bound, "-95 %": -bound}),
        )

    def to_dict(self) -> dict[str, Any]:
        """The verdicts as plain JSON values."""
        return {
            "nis": self.nis,
            "interval": list(self.interval),
            "whiteness": dict(zip(self.sensors, self.white.tolist(), strict=True)),
            "used": self.used.tolist(),
            "missing": self.missing.tolist(),
            "gated": self.gated,
            "suspicions": list(self.suspicions),
        }

    def to_csv(self) -> str:
        """Time, estimates, standard deviations and innovations, row by row; empty where nothing was measured."""
        n = self.estimates.shape[1]
        head = [
            "t",
            *(f"x[{i}]" for i in range(n)),
            *(f"sd x[{i}]" for i in range(n)),
            *(f"nu {s}" for s in self.sensors),
        ]
        deviations = np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        table = np.column_stack([self.log.t, self.estimates, deviations, self.innovations])
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(head)
        writer.writerows([["" if np.isnan(v) else repr(float(v)) for v in row] for row in table])
        return text.getvalue()


def autocorrelation(w: Array) -> Array:
    """Of a series at lags 1 to LAGS, (LAGS,)."""
    w = w - w.mean()
    return np.array([w[k:] @ w[:-k] for k in range(1, LAGS + 1)]) / max(float(w @ w), np.finfo(float).tiny)


def replay(observer: StampedKalman, log: Any, *, time: str = "t", inputs: tuple[str, ...] = ()) -> Replay:
    """Run a filter over a log from its plant's P0 on; the observer itself is not touched.

    Parameters
    ----------
    observer : StampedKalman
        Its plant and gate are used.
    log, time, inputs : see there
        As in `read_log`.

    Returns
    -------
    Replay
        Estimates, innovations and verdicts.

    Raises
    ------
    InvalidInputError
        The observer is of another kind or has held noise, or the log is refused.
    """
    if not isinstance(observer, StampedKalman):
        raise InvalidInputError(f"observer must be a StampedKalman, got {type(observer).__name__}")
    plant = observer.plant
    if plant.S is not None:
        raise InvalidInputError("held noise (S) needs all sensors in each row: describe the noise as white, without S")
    data = read_log(log, plant, time=time, inputs=inputs)
    recursion = Recursion.of(plant, observer.gate)
    start = Estimate(float(data.t[0]), np.zeros(plant.order), plant.P0)
    known = list(instants(recursion, start, data))
    innovations, whitened = np.full_like(data.y, np.nan), np.full_like(data.y, np.nan)
    for i, instant in enumerate(known):
        innovations[i, instant.used] = instant.innovation
        if len(instant.innovation):
            whitened[i, instant.used] = np.linalg.solve(np.linalg.cholesky(instant.spread), instant.innovation)
    used = np.sum(~np.isnan(whitened), axis=0)
    count = int(used.sum())
    if np.any(used <= LAGS):
        raise InvalidInputError(f"the gate leaves {int(used.min())} samples of a sensor, too few; widen it")
    nis = float(np.nansum(whitened**2) / count)
    low, high = stats.chi2.interval(PROBABILITY, count) / np.float64(count)
    white = []
    for series in whitened.T:
        w = series[~np.isnan(series)]
        N = len(w)
        statistic = N * (N + 2) * np.sum(autocorrelation(w) ** 2 / (N - np.arange(1, LAGS + 1)))
        white.append(float(stats.chi2.sf(statistic, LAGS)))
    sizes = np.sqrt(np.nanmean(whitened**2, axis=0))
    suspicions = tuple(
        f"innovations of {name} have {size:.1e} times the expected size: check its units"
        for name, size in zip(plant.sensors, sizes, strict=True)
        if not 1 / UNITS < size < UNITS
    )
    return Replay(
        log=data,
        sensors=tuple(plant.sensors),
        estimates=np.array([instant.mean for instant in known]),
        covariances=np.array([instant.covariance for instant in known]),
        innovations=innovations,
        whitened=whitened,
        used=used,
        missing=len(data.t) - np.sum(~np.isnan(data.y), axis=0),
        gated=sum(instant.gated for instant in known),
        white=np.array(white),
        nis=nis,
        interval=(float(low), float(high)),
        suspicions=suspicions,
    )
