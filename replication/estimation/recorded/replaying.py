"""A filter run over a log: estimates with covariance, and whether its innovations are white and as large as it says.

The whitened innovations of the right model are independent standard normal numbers. Their sum of squares (NIS) is then
chi-square, and the autocorrelations of each sensor give the statistic of G. M. Ljung and G. E. P. Box, Biometrika 65
(1978), eq. 1.3, chi-square too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.plants import numbered
from replication.estimation.api.shown import Shown, as_csv, as_text
from replication.estimation.nonuniform.stamped.extended import ExtendedFilter, ExtendedKalman, extended
from replication.estimation.nonuniform.stamped.kalman import Estimate, Instant
from replication.estimation.recorded.log import Log, by_sensor, read_log
from replication.estimation.recorded.series import Form, Parameters, Run, Series, of_observer, whitened
from replication.estimation.validation import Array, as_array

LAGS, PROBABILITY, BANDED = 10, 0.95, "95 % band"
UNITS = 1e6
"""Ratio of the size of a sensor's numbers to what the model expects beyond which the units are suspect."""


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
        Numbers that corrected the estimate, and rows in which one was due and did not come.
    unscheduled, gated : int
        Numbers of sensors that were not due by the schedule, which gains of a steady state leave out; and beyond the
        gate.
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
    unscheduled: int
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
            lines.append((f"samples of {name}", f"{used} used, {missing} rows without", "counted"))
        lines.append(("off the schedule", as_text(self.unscheduled), "counted"))
        lines.append(("beyond the gate", as_text(self.gated), "counted"))
        return lines + [("suspicion", text, "size of the innovations") for text in self.suspicions]

    def panels(self) -> tuple[Panel, ...]:
        """Each state with its 95 % band, the whitened innovations, and their autocorrelation."""
        width = stats.norm.ppf((1 + PROBABILITY) / 2)
        wide = width * np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        states = [
            Panel(self.log.t, "time (s)", f"x[{i}], {BANDED}", {"estimate": x}, {}, band=(x - b, x + b))
            for i, (x, b) in enumerate(zip(self.estimates.T, wide.T, strict=True))
        ]
        curves = dict(zip(self.sensors, self.whitened.T, strict=True))
        series = {name: autocorrelation(w[~np.isnan(w)]) for name, w in curves.items()}
        bound = width / np.sqrt(float(self.used.min()))
        lags = np.arange(1, LAGS + 1)
        return (
            *states,
            Panel(
                self.log.t, "time (s)", f"whitened innovation, {BANDED}", curves, {}, band=(-width, width), dots=True
            ),
            Panel(lags, "lag", f"its autocorrelation, {BANDED}", series, {}, band=(-bound, bound), dots=True),
        )

    def to_dict(self) -> dict[str, Any]:
        """The verdicts as plain JSON values."""
        return {
            "nis": self.nis,
            "interval": list(self.interval),
            "whiteness": dict(zip(self.sensors, self.white.tolist(), strict=True)),
            "used": self.used.tolist(),
            "missing": self.missing.tolist(),
            "unscheduled": self.unscheduled,
            "gated": self.gated,
            "suspicions": list(self.suspicions),
        }

    def to_csv(self) -> str:
        """Time, estimates, standard deviations and innovations, row by row; empty where nothing was measured."""
        states = numbered("x", self.estimates.shape[1])
        head = ["t", *states, *(f"sd {x}" for x in states), *(f"nu {s}" for s in self.sensors)]
        deviations = np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        return as_csv(head, np.column_stack([self.log.t, self.estimates, deviations, self.innovations]))


def replay(
    observer: Any,
    log: Any,
    *,
    time: str = "t",
    inputs: tuple[str, ...] = (),
    latencies: Mapping[str, float] | None = None,
    start: Any = None,
) -> Replay:
    """Run a Kalman filter over a log, from the covariance of its start on; the observer itself is not touched.

    Parameters
    ----------
    observer : StampedKalman, KalmanFilter, StartingFilter, RunningController, ExtendedKalman or ExtendedFilter
        With time stamps; `filter()` of a multi-rate design, `running()` of a dual-rate one, both for goal="h2"; or an
        extended filter. Where there is a base period, the first row of the log is instant 0 of the schedule.
    log : str, path, or mapping of str to array (N,)
        As in `read_log`.
    time : str
        Column of times, s.
    inputs : tuple of str
        Columns of the known inputs, in order; those of the design unless given.
    latencies : mapping of str to float, optional
        How late sensors are, s, of a filter with time stamps: their samples were taken so long before their rows.
    start : array (n,), optional
        x^(0); zero unless given.

    Returns
    -------
    Replay
        Estimates, innovations and verdicts.

    Raises
    ------
    InvalidInputError
        The observer is of another kind or has correlated noise, or the log is refused.
    """
    if isinstance(observer, ExtendedKalman | ExtendedFilter):
        return _extended(observer, log, time, inputs, latencies or {}, start)
    form = of_observer(observer)
    data = logged(form, log, time=time, inputs=inputs)
    late = by_sensor("latencies", latencies or {}, form.sensors)
    return replayed(form, data, Parameters(form.v[None], form.R[None], np.zeros((1, len(form.R)))), late, start)


def logged(form: Form, log: Any, *, time: str, inputs: tuple[str, ...]) -> Log:
    """The log as the form takes it; raises InvalidInputError."""
    known = form.D_u.shape[1]
    names = tuple(inputs) or form.inputs
    if len(names) != known:
        raise InvalidInputError(f"there are {known} known inputs, inputs= names {len(names)}: {list(names)}")
    data = read_log(log, form.sensors, names, time=time)
    return data if form.dt is None else data.on_grid(form.dt)


def replayed(form: Form, log: Log, noise: Parameters, latency: Array, start: Any) -> Replay:
    """The verdicts on a form over its log."""
    if np.any(~np.isnan(latency)) and form.dt is not None:
        raise InvalidInputError("latencies belong to filters with time stamps; a multi-rate plant has latency=")
    series = Series(form, log, latency, start)
    return judged(series.log, form.sensors, form.expected(len(series.log.t)), series.run(noise), form.under_way)


def _extended(
    observer: ExtendedKalman | ExtendedFilter, log: Any, time: str, inputs: tuple[str, ...], latencies: Any, start: Any
) -> Replay:
    """An extended filter from one row to the next."""
    plant, run = observer.plant, extended(observer.plant, observer.gate)
    if len(inputs) != plant.inputs:
        raise InvalidInputError(f"there are {plant.inputs} known inputs, inputs= names {len(inputs)}: {list(inputs)}")
    data = read_log(log, plant.sensors, inputs, time=time)
    late = by_sensor("latencies", latencies, plant.sensors)
    due = np.ones((1, len(late)), dtype=bool)
    if isinstance(observer, ExtendedFilter):
        if latencies:
            raise InvalidInputError("latencies belong to filters with time stamps: take an ExtendedKalman")
        data, due = data.on_grid(plant.dt), observer.schedule.mask
    data, _ = data.taken(late)
    x0 = plant.x0 if start is None else as_array("start", start, (plant.order,))
    N, q, prior = len(data.t), len(late), Estimate(float(data.t[0]), x0, plant.P0)
    instants: list[Instant] = []
    e, V, used = np.zeros((N, 1, q)), np.tile(np.eye(q), (N, 1, 1, 1)), np.zeros((N, q), dtype=bool)
    for k, (y, u) in enumerate(zip(data.y, data.u, strict=True)):
        if k:
            prior = run.predict(instants[-1], float(data.t[k]))
        instants.append(now := run.update(prior, y, u))
        used[k] = now.used
        e[k, 0, used[k]], V[k, 0][np.ix_(used[k], used[k])] = now.innovation, now.spread
    x, P = np.array([instant.mean for instant in instants]), np.array([instant.covariance for instant in instants])
    outcome = Run(x, P, e, V, used, sum(instant.gated for instant in instants))
    return judged(data, tuple(plant.sensors), due[np.arange(N) % len(due)], outcome)


def judged(log: Log, sensors: tuple[str, ...], due: NDArray[np.bool_], run: Run, under_way: int = 0) -> Replay:
    """The verdicts on what a filter made of a log; under_way: how many of the last states are late samples."""
    w, came = whitened(run), ~np.isnan(log.y)
    used, n = run.used.sum(axis=0), run.x.shape[1] - under_way
    for name, few, all_of in zip(sensors, used, came.sum(axis=0), strict=True):
        if few <= LAGS:
            raise InvalidInputError(
                f"{few} of {all_of} samples of {name!r} are used, too few: they come off the schedule (shift its "
                "offset), or lie beyond the gate (widen it)"
            )
    count = int(used.sum())
    low, high = stats.chi2.interval(PROBABILITY, count) / np.float64(count)
    sizes = np.sqrt(np.nanmean(w**2, axis=0))
    suspicions = tuple(
        f"innovations of {name} have {size:.1e} times the expected size: check its units"
        for name, size in zip(sensors, sizes, strict=True)
        if not 1 / UNITS < size < UNITS
    )
    return Replay(
        log=log,
        sensors=sensors,
        estimates=run.x[:, :n],
        covariances=run.P[:, :n, :n],
        innovations=np.where(run.used, run.e[:, 0], np.nan),
        whitened=w,
        used=used,
        missing=np.sum(due & ~came, axis=0),
        unscheduled=int(np.sum(came & ~due)),
        gated=int(run.gated),
        white=np.array([ljung_box(series[~np.isnan(series)]) for series in w.T]),
        nis=float(np.nansum(w**2) / count),
        interval=(float(low), float(high)),
        suspicions=suspicions,
    )


def ljung_box(w: Array) -> float:
    """The probability of at least this much autocorrelation in a white series."""
    N = len(w)
    statistic = N * (N + 2) * np.sum(autocorrelation(w) ** 2 / (N - np.arange(1, LAGS + 1)))
    return float(stats.chi2.sf(statistic, LAGS))


def autocorrelation(w: Array) -> Array:
    """Of a series at lags 1 to LAGS, (LAGS,)."""
    w = w - w.mean()
    return np.array([w[k:] @ w[:-k] for k in range(1, LAGS + 1)]) / max(float(w @ w), np.finfo(float).tiny)
