"""What all results offer: text, HTML, plain values, a plot; simulations and trade-offs.

The central solution at a level is the one of least entropy, a bound of the mean square; at an infinite level it is that
of the Kalman filter. Source: Mustafa and Glover, Minimum Entropy H-infinity Control (1990).
"""

from __future__ import annotations

import csv
import io
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.validation import Array, FrozenArrays, at_most, one_of, positive_scalar

if TYPE_CHECKING:
    from replication.drawing.panels import Figure


HEADINGS = ("quantity", "value", "how")
TIME = "time (s)"


class Shown(ABC):
    """A result that prints itself on a terminal and in a notebook, and plots itself."""

    @abstractmethod
    def rows(self) -> list[tuple[str, str, str]]:
        """The lines of the table.

        Returns
        -------
        list of (str, str, str)
            Quantity, value with unit, and how it was found.
        """

    @abstractmethod
    def panels(self) -> tuple[Panel, ...]:
        """The curves that show the result best, computed when asked for.

        Returns
        -------
        tuple of Panel
            One for each set of axes.
        """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The result as plain JSON values.

        Returns
        -------
        dict
            Arrays are nested lists in full precision.
        """

    def plot(self) -> Figure:
        """Draw the panels, one above the other.

        Returns
        -------
        matplotlib.figure.Figure
            Not shown yet; `savefig` writes it.
        """
        from replication.drawing.panels import draw

        return draw(self.panels())

    def __str__(self) -> str:
        return "\n".join(f"{what}: {value}{how and f'  ({how})'}" for what, value, how in self.rows())

    def __repr__(self) -> str:
        what, value, _ = self.rows()[0]
        return f"<{type(self).__name__}: {what} {value}>"

    def _repr_html_(self) -> str:
        """The table in a notebook; everything is escaped."""
        head = "".join(f'<th scope="col">{heading}</th>' for heading in HEADINGS)
        body = "".join(
            f'<tr><th scope="row">{escape(what)}</th><td>{escape(value)}</td><td>{escape(how)}</td></tr>\n'
            for what, value, how in self.rows()
        )
        return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"


def as_text(value: float | int | str | bool) -> str:
    """A value in a table: floats with six significant digits."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def as_csv(head: Sequence[str], table: Array) -> str:
    """A line of names, then numbers that read back exactly; empty where there is none."""
    text = io.StringIO()
    lines = csv.writer(text, lineterminator="\n")
    lines.writerow(head)
    lines.writerows([["" if np.isnan(number) else number for number in row] for row in table.tolist()])
    return text.getvalue()


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Simulation(Shown):
    """Signals over time.

    Attributes
    ----------
    method : str
        Name of the method.
    time : array (M,)
        In s, or in instants if the plant has no sampling period.
    signals : mapping of str to array (M, k)
        The signals by name.
    columns : mapping of str to tuple of str
        What the columns of each signal are called, with units where the plant has them.
    ratio : float or None
        l2 norm of the error over that of the disturbance, a lower bound of the gain; None if nothing disturbs.
    steps : bool
        Whether values are held until the next instant.
    """

    method: str
    time: Array
    signals: Mapping[str, Array]
    columns: Mapping[str, tuple[str, ...]]
    ratio: float | None
    steps: bool

    def rows(self) -> list[tuple[str, str, str]]:
        """Ratio, length, largest size of each signal."""
        error = [] if self.ratio is None else [("error over disturbance", as_text(self.ratio), "ratio of l2 norms")]
        return [
            *error,
            (TIME, f"{self.time[0]:.6g} to {self.time[-1]:.6g}", f"{len(self.time)} points"),
            *(
                (n, f"largest {np.abs(s).max(initial=0.0):.6g}", ", ".join(self.columns[n]))
                for n, s in self.signals.items()
            ),
        ]

    def panels(self) -> tuple[Panel, ...]:
        """One panel for each signal; where it is a single curve its name stands beside the axes."""
        return tuple(
            Panel(
                self.time,
                TIME,
                name if len(columns) > 1 else f"{name}: {columns[0]}",
                dict(zip(columns, self.signals[name].T, strict=True)),
                {},
                self.steps,
            )
            for name, columns in self.columns.items()
            if self.signals[name].size
        )

    def to_dict(self) -> dict[str, Any]:
        """Time and signals as lists, with the names of the columns."""
        return {
            "method": self.method,
            "ratio": self.ratio,
            "time": {"label": TIME, "value": self.time.tolist()},
            "signals": {name: signal.tolist() for name, signal in self.signals.items()},
            "columns": {name: list(columns) for name, columns in self.columns.items()},
        }

    def to_csv(self) -> str:
        """Time and all signals, a column each.

        Returns
        -------
        str
            A line of names with units, then numbers that read back exactly.
        """
        head = [TIME, *(f"{n}: {column}" for n in self.signals for column in self.columns[n])]
        return as_csv(head, np.column_stack([self.time, *self.signals.values()]))


def simulated(
    method: str,
    time: Array,
    signals: Mapping[str, tuple[Any, Sequence[str]]],
    *,
    ratio: float | None,
    steps: bool = True,
) -> Simulation:
    """What a method's `simulate` hands over: by name `signals` (M, k), with columns, over `time` (M,) in seconds."""
    arrays = FrozenArrays({name: signal for name, (signal, _) in signals.items()})
    columns = {name: tuple(names) for name, (_, names) in signals.items()}
    return Simulation(method=method, time=time, signals=arrays, columns=columns, ratio=ratio, steps=steps)


BALANCE = 1e-6
"""Width, on the way from the least level (0) to the Kalman design (1), at which the search for the balance ends."""
MOST_POINTS = 1000


class Goal(StrEnum):
    """What a design makes least: the worst-case gain, the mean square under white noise, or something of both."""

    HINF = "hinf"
    H2 = "h2"
    MIXED = "mixed"


def aimed(goal: Any, level: Any) -> tuple[Goal, float | None]:
    """Goal and level as a user gave them, checked; raises InvalidInputError, also for a level of the goal h2."""
    aim = one_of(Goal, goal)
    if aim is Goal.H2 and level is not None:
        raise InvalidInputError("level belongs to the goals hinf and mixed; what is designed for h2 has the one it has")
    return aim, None if level is None else positive_scalar("level", level)


Measures = tuple[float, float]
"""Exact gain and root mean square of a design."""


@dataclass(frozen=True, eq=False, repr=False)
class TradeOff(Shown):
    """What each level costs in mean error, and the other way round.

    Attributes
    ----------
    method : str
        Name of the method.
    what : str
        Of what the root mean square is.
    level : array (M,)
        Levels of the design, from the least one to infinity (the Kalman design).
    gain : array (M,)
        Gain of the design, the upper end of its exact value; never above the level.
    rms : array (M,)
        Root of the mean square for white noise, exact.
    """

    method: str
    what: str
    level: Array
    gain: Array
    rms: Array

    def rows(self) -> list[tuple[str, str, str]]:
        """One line for each level."""
        return [
            (
                f"designed for level {as_text(float(level)) if np.isfinite(level) else 'infinite'}",
                f"{self.what} {rms:.6g}",
                f"gain {gain:.6g}; both exact",
            )
            for level, gain, rms in zip(self.level, self.gain, self.rms, strict=True)
        ]

    def panels(self) -> tuple[Panel, ...]:
        """What is lost of the one measure for each loss of the other."""
        gain, rms = (100 * (measure / measure.min() - 1) for measure in (self.gain, self.rms))
        curves = {"from the least gain to the Kalman design": rms}
        return (Panel(gain, "guaranteed gain above the least (%)", f"{self.what} above the least (%)", curves, {}),)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values; the infinite level is null."""
        levels = [level if np.isfinite(level) else None for level in self.level.tolist()]
        return {"method": self.method, "level": levels, "gain": self.gain.tolist(), "rms": self.rms.tolist()}


def between(least: float, share: float) -> float:
    """The level on the way from the least one (share 0) to an infinite one (1); more of them where most changes."""
    return float(least / np.sqrt(1 - share**2)) if share < 1 else np.inf


class Traded(ABC):
    """A result of a method that designs at any level: of least entropy, from the least gain to the least mean error."""

    method: str
    mean: ClassVar[str] = "rms error"
    """Of what the root mean square is."""

    @abstractmethod
    def designs(self) -> tuple[float, Callable[[float], Measures]]:
        """The designs for the same plant.

        Returns
        -------
        tuple of float and function (float) -> (float, float)
            Just above the least level, and gain and root mean square of the design at a level.
        """

    def tradeoff(self, points: int = 12) -> TradeOff:
        """What a smaller guaranteed gain costs in mean error, for this plant.

        Parameters
        ----------
        points : int
            Number of designs, from just above the least level to the Kalman design; at least 2.

        Returns
        -------
        TradeOff
            Level, exact gain and exact root mean square of each; it prints and plots itself.

        Raises
        ------
        InvalidInputError
            `points` is no whole number from 2 to 1000, or the plant has no such designs: nothing is disturbed, or white
            noise reaches z itself.
        InfeasibleError
            The least level is zero.
        SolverError
            The gains at a level, or their measures, are not found.
        """
        count = at_most("points", points, MOST_POINTS)
        if count < 2:
            raise InvalidInputError(f"points must be at least 2, the two ends, got {count}")
        least, measures = self.designs()
        levels = np.array([between(least, share) for share in np.linspace(0.0, 1.0, count).tolist()])
        gain, rms = np.array([measures(level) for level in levels.tolist()]).T
        return TradeOff(self.method, self.mean, levels, gain, rms)


def balanced(least: float, least_gain: float, measures: Callable[[float], Measures], width: float = BALANCE) -> float:
    """The level whose design has a gain and a mean that exceed the least ones by the same share."""
    from scipy.optimize import brentq  # slow to load

    least_rms = measures(np.inf)[1]

    def excess(share: float) -> float:
        """Of the mean over that of the gain."""
        gain, rms = measures(between(least, share))
        return rms / least_rms - gain / least_gain

    if excess(0.0) <= 0:
        return between(least, 0.0)
    if excess(1.0) >= 0:
        return np.inf
    return between(least, brentq(excess, 0.0, 1.0, xtol=width))
