"""The results of `design` and `analyse` of every method: frozen, shown as text, table or HTML, exported.

A result is data and the ways to look at it; `plot` hands its curves to `replication.drawing.panels`, the only place
where matplotlib is imported, and only then.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Any, Self

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.export import to_c_header, to_json, to_mat
from replication.estimation.api.plants import Signals
from replication.estimation.api.shown import Shown, as_text
from replication.estimation.validation import Array, StateSpace

EXACT_GAIN = "a singular value at some frequency; no eigenvalue of the symplectic pencil on the circle"
"""How the ends of an exact l2 gain are found (`replication.estimation.linear.norms`)."""
DIGITS, MAX_DIGITS, SHOWN_WIDTH = 6, 12, Decimal("1.1")
"""Significant digits of the ends of a bracket, at least and at most, and how much wider it may then look."""


@dataclass(frozen=True)
class Bracket:
    """lower <= true value <= upper.

    Attributes
    ----------
    lower : float
        Attained.
    upper : float
        Guaranteed.
    method : str
        How each end was found.
    """

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

    def row(self) -> tuple[str, str, str]:
        """The line of a table: what, value with unit, method."""
        return self.what, f"{as_text(self.value)}{self.unit and ' '}{self.unit}", self.method

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {"what": self.what, "value": self.value, "unit": self.unit, "method": self.method}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class GainResult(Shown):
    """Gains of an estimator and the worst-case gain that they guarantee.

    Each method's class adds its plant, `observer`, which makes a `RunningObserver` with these gains, and the hooks
    `to_statespace` and `panels`.

    Attributes
    ----------
    method : str
        Name of the method.
    quantity : str
        What the worst-case gain is from and to.
    bracket : Bracket
        That gain lies inside; the upper end is guaranteed.
    gains : mapping of str to array
        The gains by name, read-only.
    axes : mapping of str to str
        What the axes of each gain are.
    evidence : tuple of Evidence
        What else came out, and how.
    signals : Signals
        Names of the plant's signals, and its sampling period (s).
    """

    method: str
    quantity: str
    bracket: Bracket
    gains: Mapping[str, Array]
    axes: Mapping[str, str]
    evidence: tuple[Evidence, ...]
    signals: Signals

    @classmethod
    def require(cls, result: Any) -> None:
        """Raise InvalidInputError unless `result` came out of the `design` or `analyse` whose results are of this kind.

        Parameters
        ----------
        result : object
            What a user gave as a result.

        Raises
        ------
        InvalidInputError
            It is something else.
        """
        if not isinstance(result, cls):
            raise InvalidInputError(f"result must be a {cls.__name__}, as design gives it, got {type(result).__name__}")

    @property
    def value(self) -> float:
        """The guaranteed level: the upper end of the bracket."""
        return self.bracket.upper

    @abstractmethod
    def observer(self, *settings: Any, **named: Any) -> Any:
        """The observer, to run in a loop.

        Parameters
        ----------
        settings, named : object
            None, but for methods in continuous time: the step `dt` (s) at which it runs, by place or by name.

        Returns
        -------
        RunningObserver
            Its `step` gives the estimate.
        """

    def estimator(self, *settings: Any, **named: Any) -> StateSpace:
        """The observer over one period of its schedule, from the known inputs and y of all instants to x^.

        Parameters
        ----------
        settings, named : object
            As in `observer`.

        Returns
        -------
        control.StateSpace
            It is what `observer()` does; `@k` is added to the names for instant k if there are several.
        """
        system: StateSpace = self.observer(*settings, **named).to_statespace()
        return system

    def to_statespace(self) -> StateSpace:
        """The estimator, or what the method says in its place, with the names of the plant.

        Returns
        -------
        control.StateSpace
            Inputs, outputs and states are named after those of the plant.
        """
        return self.estimator()

    def named(
        self,
        *,
        states: Sequence[str] | None = None,
        inputs: Sequence[str] | None = None,
        measurements: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
        units: Mapping[str, str] | None = None,
    ) -> Self:
        """Call signals otherwise; simulations, plots and all exported forms follow.

        Parameters
        ----------
        states : sequence of str, optional
            A name for each; like all that follow, unchanged unless given.
        inputs : sequence of str, optional
            Of known inputs.
        measurements : sequence of str, optional
            Of sensors.
        outputs : sequence of str, optional
            Of what is estimated; where that is the states, their names unless given.
        units : mapping of str to str, optional
            Units of signals by name.

        Returns
        -------
        GainResult
            The same result with these names.

        Raises
        ------
        InvalidInputError
            Another number of names, a name twice, or the unit of no signal.
        """
        names = {"states": states, "inputs": inputs, "measurements": measurements, "outputs": outputs}
        return replace(self, signals=self.signals.named(names, units))

    def fact(self, what: str) -> Evidence:
        """Look up one piece of evidence.

        Parameters
        ----------
        what : str
            Its name, as the table shows it.

        Returns
        -------
        Evidence
            Value, unit and method.

        Raises
        ------
        KeyError
            There is none of that name; the message lists what there is.
        """
        for evidence in self.evidence:
            if evidence.what == what:
                return evidence
        raise KeyError(f"{what!r}; there are: {', '.join(evidence.what for evidence in self.evidence)}")

    def rows(self) -> list[tuple[str, str, str]]:
        """Guaranteed level, bracket, shapes of the gains, evidence; ends of the bracket are rounded outwards."""
        low, high = outward(self.bracket)
        gains = ", ".join(f"{name} {gain.shape}" for name, gain in self.gains.items())
        return [
            ("guaranteed level", high, self.quantity),
            ("bracket", f"[{low}, {high}]", f"{self.bracket.method}; width {self.bracket.width:.1e}"),
            ("gains", gains, "shapes"),
            *(fact.row() for fact in self.evidence),
        ]

    def _panel(
        self, x: Array, x_label: str, y_label: str, curves: Mapping[str, Array], **levels: float
    ) -> tuple[Panel, ...]:
        """One panel with the guaranteed level beside curves of the gain over x."""
        shown = {name.replace("_", " "): level for name, level in levels.items()}
        return (Panel(x, x_label, y_label, curves, {**shown, "guaranteed level": self.value}),)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the plant: level, bracket, gains with their axes, evidence with its methods, names."""
        return {
            "method": self.method,
            "quantity": self.quantity,
            "value": self.value,
            "bracket": asdict(self.bracket),
            "gains": {name: {"axes": self.axes[name], "value": gain.tolist()} for name, gain in self.gains.items()},
            "evidence": [fact.to_dict() for fact in self.evidence],
            "signals": self.signals.to_dict(),
        }

    def to_json(self) -> str:
        """`to_dict` as JSON.

        Returns
        -------
        str
            Indented; numbers read back exactly.
        """
        return to_json(self.to_dict())

    def to_mat(self) -> bytes:
        """The gains and the bracket as a MATLAB file (level 5).

        Returns
        -------
        bytes
            The same every time.
        """
        return to_mat({**self.gains, "bracket": np.array([self.bracket.lower, self.bracket.upper])})

    def to_c_header(self, name: str = "observer") -> str:
        """The gains as `static const double` arrays, row-major.

        Parameters
        ----------
        name : str
            C identifier of at most 31 characters with which every identifier of the header starts.

        Returns
        -------
        str
            The header, with an include guard and the guaranteed level as a comment.

        Raises
        ------
        InvalidInputError
            `name` is no C identifier, too long, or a keyword.
        """
        comment = f"{self.method} estimator; guaranteed level {self.value!r}: {self.quantity}"
        return to_c_header(name, self.gains, self.axes, comment)


def outward(bracket: Bracket) -> tuple[str, str]:
    """Both ends with enough digits to show the width, the lower one rounded down and the upper one up."""
    low, high = Decimal(bracket.lower), Decimal(bracket.upper)
    for digits in range(DIGITS, MAX_DIGITS + 1):
        below = Context(prec=digits, rounding=ROUND_FLOOR).plus(low)
        above = Context(prec=digits, rounding=ROUND_CEILING).plus(high)
        if above - below <= SHOWN_WIDTH * (high - low):
            break
    return f"{below.normalize():g}", f"{above.normalize():g}"


LITTLE = 0.1
"""A level that lies less than this below that without sensors is told to be of little use."""
ADVICE = "measure more often, with less noise or something else, or do without these sensors"
OPEN = "the brackets overlap: more effort may tell which is less"


def baselines(
    level: float | Bracket,
    how: str,
    *,
    without: float | Bracket | None,
    kalman: float | None = None,
    limit: float | None = None,
    what: str = "level",
    simpler: str = "",
    others: str = "",
) -> tuple[Evidence, ...]:
    """Levels to compare a guaranteed `level` with, and advice where it is hardly below one that costs less.

    how: the measure, the same for all, called `what`. without: of the estimate zero, None if it is infinite. kalman: of
    the Kalman filter. limit: of the best smoother, which knows all measurements, past and future; None leaves either
    out. simpler: what to do where a level is hardly below that of the Kalman filter; empty for no such advice. others:
    the measure of these two, if it is another. A measure that is known within a bracket is given as one.
    """
    bracket, others = _bracket(level), others or how
    limited = "limit" if what == "level" else f"{what}, limit"
    name, meaning = f"{what} without sensors", f"estimate zero; {how}"
    if isinstance(without, Bracket):
        meaning = f"{meaning}; bracket from {without.lower:.6g}, {without.method}"
    facts = [Evidence(name, "infinite" if without is None else _bracket(without).upper, meaning)]
    if kalman is not None:
        facts.append(Evidence(f"{what} of the Kalman filter", kalman, f"white noise of unit intensity; {others}"))
    if limit is not None:
        facts.append(Evidence(f"{limited} of any smoother", limit, f"all measurements, past and future; {others}"))
    advice = () if without is None else _advice(bracket, _bracket(without), f"the {name}", ADVICE)
    if not advice and simpler and kalman is not None:
        advice = _advice(bracket, _bracket(kalman), f"the {what} of the Kalman filter", simpler)
    return (*facts, *advice)


def _bracket(level: float | Bracket) -> Bracket:
    return level if isinstance(level, Bracket) else Bracket(level, level, "")


def _advice(bracket: Bracket, reference: Bracket, name: str, advice: str) -> tuple[Evidence, ...]:
    """Not below, open, or only so much below: told of whole brackets, not of one end of each."""
    if bracket.lower >= reference.upper:
        return (Evidence("advice", f"not below {name}", advice),)
    if bracket.upper >= reference.lower:
        ends = f"[{bracket.lower:.6g}, {bracket.upper:.6g}] against [{reference.lower:.6g}, {reference.upper:.6g}]"
        return (Evidence("advice", f"open whether below {name}: {ends}", OPEN),)
    share = 1 - bracket.lower / reference.upper
    return (Evidence("advice", f"only {100 * share:.2g} % below {name}", advice),) if share < LITTLE else ()
