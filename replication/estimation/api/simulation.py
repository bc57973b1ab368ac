"""What `simulate` of every method gives: signals over time, frozen, as text, table, HTML, plot or plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from replication.drawing.panel import Panel
from replication.estimation.api.shown import Shown, as_text, frozen
from replication.estimation.validation import Array


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
    ratio : float or None
        l2 norm of the error over that of the disturbance, a lower bound of the gain; None if nothing disturbs.
    steps : bool
        Whether values are held until the next instant.
    """

    method: str
    time: Array
    time_label: str
    signals: Mapping[str, Array]
    ratio: float | None
    steps: bool

    def rows(self) -> list[tuple[str, str, str]]:
        """Ratio, length, largest size of each signal."""
        error = ("error over disturbance", as_text(self.ratio), "ratio of l2 norms") if self.ratio is not None else None
        return [
            *([error] if error else []),
            (self.time_label, f"{self.time[0]:.6g} to {self.time[-1]:.6g}", f"{len(self.time)} points"),
            *(
                (n, f"largest {np.abs(s).max(initial=0.0):.6g}", f"{s.shape[1]} columns")
                for n, s in self.signals.items()
            ),
        ]

    def panels(self) -> tuple[Panel, ...]:
        """One panel for each signal."""
        return tuple(
            Panel(self.time, self.time_label, name, _columns(name, signal), {}, steps=self.steps)
            for name, signal in self.signals.items()
            if signal.size
        )

    def to_dict(self) -> dict[str, Any]:
        """Time and signals as lists."""
        return {
            "method": self.method,
            "ratio": self.ratio,
            "time": {"label": self.time_label, "value": self.time.tolist()},
            "signals": {name: signal.tolist() for name, signal in self.signals.items()},
        }


def simulated(
    method: str, time: Array, signals: Mapping[str, Any], *, ratio: float | None, steps: bool = True
) -> Simulation:
    """What a method's `simulate` hands over: `signals` (M, k) by name over `time` (M,) in seconds."""
    return Simulation(
        method=method, time=time, time_label="time (s)", signals=frozen(signals), ratio=ratio, steps=steps
    )


def _columns(name: str, signal: Array) -> dict[str, Array]:
    if signal.shape[1] == 1:
        return {name: signal[:, 0]}
    return {f"{name}[{i}]": column for i, column in enumerate(signal.T)}
