"""The results of `design`, `analyse` and `simulate` of every method: frozen, shown as text, table or HTML, exported.

A result is data and the ways to look at it; `plot` hands its curves to `replication.drawing.panels`, the only place
where matplotlib is imported, and only then.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.drawing.panel import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.export import to_c_header, to_json, to_mat
from replication.estimation.api.signals import Signals
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control
    from rich.table import Table

    from replication.drawing.panels import Figure


@dataclass(frozen=True)
class Bracket:
    """lower <= true value <= upper: lower is attained, upper guaranteed; method: how each end was found."""

    lower: float
    upper: float
    method: str

    @property
    def width(self) -> float:
        """(upper - lower) / upper, a pure number; 0 if both are zero."""
        return (self.upper - self.lower) / self.upper if self.upper else 0.0


@dataclass(frozen=True)
class Evidence:
    """One number or fact that came out, with its unit and the method that gave it."""

    what: str
    value: float | int | str | bool
    method: str
    unit: str = ""


class Shown(ABC):
    """What all results offer: text, a rich table, HTML, a dictionary of plain values, and a plot."""

    @abstractmethod
    def rows(self) -> list[tuple[str, str, str]]:
        """(what, value with unit, how) for each line of the table."""

    @abstractmethod
    def panels(self) -> tuple[Panel, ...]:
        """The curves that show the result best, computed when asked for."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values; arrays as nested lists in full precision."""

    def plot(self) -> Figure:
        """A matplotlib figure of the panels, one above the other."""
        from replication.drawing.panels import draw

        return draw(self.panels())

    def __str__(self) -> str:
        """One line for each row of the table."""
        return "\n".join(f"{what}: {value}{how and f'  ({how})'}" for what, value, how in self.rows())

    def __repr__(self) -> str:
        """The class and the first row."""
        what, value, _ = self.rows()[0]
        return f"<{type(self).__name__}: {what} {value}>"

    def __rich__(self) -> Table:
        """The table on a terminal."""
        from rich import box
        from rich.table import Table
        from rich.text import Text

        table = Table(box=box.SIMPLE)
        for heading in HEADINGS:
            table.add_column(heading)
        for row in self.rows():
            table.add_row(*(Text(cell) for cell in row))
        return table

    def _repr_html_(self) -> str:
        """The table in a notebook; everything is escaped."""
        head = "".join(f'<th scope="col">{heading}</th>' for heading in HEADINGS)
        body = "".join(
            f'<tr><th scope="row">{escape(what)}</th><td>{escape(value)}</td><td>{escape(how)}</td></tr>\n'
            for what, value, how in self.rows()
        )
        return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"


EXACT_GAIN = "a singular value at some frequency; no eigenvalue of the symplectic pencil on the circle"
"""How the ends of an exact l2 gain are found (`replication.estimation.linear.norms`)."""
HEADINGS = ("quantity", "value", "how")
DIGITS, MAX_DIGITS, SHOWN_WIDTH = 6, 12, Decimal("1.1")
"""Significant digits of the ends of a bracket, at least and at most, and how much wider it may then look."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class GainResult(Shown):
    """Gains of an estimator and the worst-case gain that they guarantee.

    method: name of the method. quantity: what the worst-case gain is from and to. bracket: that gain lies inside;
    `value` is the upper end, which is guaranteed. gains: read-only arrays by name; axes: what their axes are. Each
    method's class adds `observer`, which makes a `RunningObserver` with these gains.
    """

    method: str
    quantity: str
    bracket: Bracket
    gains: Mapping[str, Array]
    axes: Mapping[str, str]
    evidence: tuple[Evidence, ...]
    signals: Signals

    @property
    def value(self) -> float:
        """The guaranteed level: the upper end of the bracket."""
        return self.bracket.upper

    @abstractmethod
    def to_statespace(self) -> control.StateSpace:
        """The estimator (or, where it says so, its error) as a `control.StateSpace` with the names of the plant."""

    def fact(self, what: str) -> Evidence:
        """The evidence called `what`; raises KeyError that lists what there is."""
        for evidence in self.evidence:
            if evidence.what == what:
                return evidence
        raise KeyError(f"{what!r}; there are: {', '.join(evidence.what for evidence in self.evidence)}")

    def rows(self) -> list[tuple[str, str, str]]:
        """Guaranteed level, bracket, gains, evidence."""
        low, high = outward(self.bracket)
        gains = ", ".join(f"{name} {gain.shape}" for name, gain in self.gains.items())
        return [
            ("guaranteed level", high, self.quantity),
            ("bracket", f"[{low}, {high}]", f"{self.bracket.method}; width {self.bracket.width:.1e}"),
            ("gains", gains, "shapes"),
            *((fact.what, f"{_text(fact.value)}{fact.unit and ' '}{fact.unit}", fact.method) for fact in self.evidence),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Everything but the plant: level, bracket, gains with their axes, evidence with its methods, names."""
        return {
            "method": self.method,
            "quantity": self.quantity,
            "value": self.value,
            "bracket": {"lower": self.bracket.lower, "upper": self.bracket.upper, "method": self.bracket.method},
            "gains": {name: {"axes": self.axes[name], "value": gain.tolist()} for name, gain in self.gains.items()},
            "evidence": [
                {"what": fact.what, "value": fact.value, "unit": fact.unit, "method": fact.method}
                for fact in self.evidence
            ],
            "signals": self.signals.to_dict(),
        }

    def to_json(self) -> str:
        """`to_dict` as JSON; numbers read back exactly."""
        return to_json(self.to_dict())

    def to_mat(self) -> bytes:
        """The gains and the bracket as a MATLAB file (level 5), the same bytes every time."""
        return to_mat({**self.gains, "bracket": np.array([self.bracket.lower, self.bracket.upper])})

    def to_c_header(self, name: str = "observer") -> str:
        """The gains as `static const double` arrays, row-major; `name` starts every identifier.

        Raises InvalidInputError if `name` is no C identifier.
        """
        comment = f"{self.method} estimator; guaranteed level {self.value!r}: {self.quantity}"
        return to_c_header(name, self.gains, self.axes, comment)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Simulation(Shown):
    """Signals over time. time (M,) in s, or in instants if the plant has no dt; signals: name to (M, k) array.

    ratio: l2 norm of the error over that of the disturbance, a lower bound of the gain; None if nothing disturbs.
    """

    method: str
    time: Array
    time_label: str
    signals: Mapping[str, Array]
    ratio: float | None
    steps: bool

    def rows(self) -> list[tuple[str, str, str]]:
        """Ratio, length, largest and last size of each signal."""
        error = ("error over disturbance", _text(self.ratio), "ratio of l2 norms") if self.ratio is not None else None
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


def frozen(arrays: Mapping[str, Any]) -> FrozenArrays:
    """Read-only float copies."""
    copies = {name: np.array(array, dtype=float) for name, array in arrays.items()}
    for copy in copies.values():
        copy.flags.writeable = False
    return FrozenArrays(copies)


class FrozenArrays(Mapping[str, Array]):
    """Arrays by name, of which none can be replaced; a copy by pickling is read-only again, as numpy's is not."""

    def __init__(self, arrays: dict[str, Array]) -> None:
        self._arrays = arrays

    def __getitem__(self, name: str) -> Array:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        return repr(self._arrays)

    def __reduce__(self) -> tuple[Any, tuple[dict[str, Array]]]:
        return frozen, (self._arrays,)


def require_result(result: Any, kind: type[GainResult]) -> None:
    """Raise InvalidInputError unless `result` came out of the `design` or `analyse` whose results are of this kind."""
    if not isinstance(result, kind):
        raise InvalidInputError(f"result must be a {kind.__name__}, as design gives it, got {type(result).__name__}")


def outward(bracket: Bracket) -> tuple[str, str]:
    """Both ends with enough digits to show the width, the lower one rounded down and the upper one up."""
    low, high = Decimal(bracket.lower), Decimal(bracket.upper)
    for digits in range(DIGITS, MAX_DIGITS + 1):
        below = Context(prec=digits, rounding=ROUND_FLOOR).plus(low)
        above = Context(prec=digits, rounding=ROUND_CEILING).plus(high)
        if above - below <= SHOWN_WIDTH * (high - low):
            break
    return f"{below.normalize():g}", f"{above.normalize():g}"


def _columns(name: str, signal: Array) -> dict[str, Array]:
    if signal.shape[1] == 1:
        return {name: signal[:, 0]}
    return {f"{name}[{i}]": column for i, column in enumerate(signal.T)}


def _text(value: float | int | str | bool) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
