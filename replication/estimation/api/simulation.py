"""What `simulate` of every method gives: signals over time, frozen, as text, table, HTML, plot or plain values."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from replication.drawing.panels import Panel
from replication.estimation.api.shown import Shown, as_text
from replication.estimation.validation import Array, frozen


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Simulation(Shown):
    """Signals over time.

    Attributes
    ----------
    method : str
        Name of the method.
    time : array (M,)
        In s, or in instants if the plant has no sampling period.
    time_label : str
        What the axis of time is called.
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
    time_label: str
    signals: Mapping[str, Array]
    columns: Mapping[str, tuple[str, ...]]
    ratio: float | None
    steps: bool

    def rows(self) -> list[tuple[str, str, str]]:
        """Ratio, length, largest size of each signal."""
        error = ("error over disturbance", as_text(self.ratio), "ratio of l2 norms") if self.ratio is not None else None
        return [
            *([error] if error else []),
            (self.time_label, f"{self.time[0]:.6g} to {self.time[-1]:.6g}", f"{len(self.time)} points"),
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
                self.time_label,
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
            "time": {"label": self.time_label, "value": self.time.tolist()},
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
        text = io.StringIO()
        lines = csv.writer(text, lineterminator="\n")
        lines.writerow([self.time_label, *(f"{n}: {column}" for n in self.signals for column in self.columns[n])])
        lines.writerows(np.column_stack([self.time, *self.signals.values()]).tolist())
        return text.getvalue()


def simulated(
    method: str,
    time: Array,
    signals: Mapping[str, tuple[Any, Sequence[str]]],
    *,
    ratio: float | None,
    steps: bool = True,
) -> Simulation:
    """What a method's `simulate` hands over: by name `signals` (M, k), with columns, over `time` (M,) in seconds."""
    arrays = frozen({name: signal for name, (signal, _) in signals.items()})
    columns = {name: tuple(names) for name, (_, names) in signals.items()}
    for name, array in arrays.items():
        if array.shape[1] != len(columns[name]):
            raise ValueError(f"{name} has {array.shape[1]} columns, named are {columns[name]}")
    return Simulation(
        method=method, time=time, time_label="time (s)", signals=arrays, columns=columns, ratio=ratio, steps=steps
    )
