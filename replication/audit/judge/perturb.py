"""How far results move while one printed number moves within its own rounding, all others held."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from replication.audit.judge.printed import Printed, parse
from replication.audit.parts import Sensitivity
from replication.errors import ReplicationError

Parameters = Mapping[str, Any]
"""Printed parameters as numbers: a float, or the rows of a matrix as lists."""

Values = Mapping[str, list[Fraction]]
Quantities = Mapping[str, float]
"""Results by id of the claim that they answer."""


def spread(prints: Mapping[str, str], compute: Callable[[Parameters], Quantities]) -> dict[str, Any]:
    """What `compute` gives at the printed numbers, and with each of them half a unit lower and higher.

    Whole numbers stand for themselves and are left alone. Returns JSON: `base`, and `rows` with `parameter`, `printed`,
    `low` and `high`; an end where `compute` finds no result (an `InfeasibleError`, for example) is None.
    """
    parsed = {name: parse(text) for name, text in prints.items()}
    exact = {name: [entry.value for entry in printed.entries] for name, printed in parsed.items()}
    rows = []
    for name, printed in parsed.items():
        for index, entry in enumerate(printed.entries):
            if entry.unit < 1:
                ends = (_moved(exact, name, index, side * entry.unit / 2) for side in (-1, 1))
                low, high = (_attempt(compute, _numbers(parsed, values)) for values in ends)
                row = {"parameter": _label(name, printed, index), "printed": entry.text, "low": low, "high": high}
                rows.append(row)
    return {"base": dict(compute(_numbers(parsed, exact))), "rows": rows}


def sensitivities(spread: Mapping[str, Any]) -> tuple[Sensitivity, ...]:
    """The records of what `spread` returned."""
    return tuple(
        Sensitivity(
            claim=claim,
            parameter=row["parameter"],
            printed=row["printed"],
            base=base,
            low=None if row["low"] is None else row["low"][claim],
            high=None if row["high"] is None else row["high"][claim],
        )
        for claim, base in spread["base"].items()
        for row in spread["rows"]
    )


def _moved(exact: Values, name: str, index: int, by: Fraction) -> Values:
    changed = list(exact[name])
    changed[index] += by
    return {**exact, name: changed}


def _numbers(parsed: Mapping[str, Printed], values: Values) -> dict[str, Any]:
    """Floats in the layout of the prints."""
    return {name: _layout(printed, [float(value) for value in values[name]]) for name, printed in parsed.items()}


def _layout(printed: Printed, values: list[float]) -> Any:
    if len(printed.shape) < 2:
        return values if printed.shape else values[0]
    columns = printed.shape[1]
    return [values[begin : begin + columns] for begin in range(0, len(values), columns)]


def _attempt(compute: Callable[[Parameters], Quantities], parameters: Parameters) -> dict[str, float] | None:
    try:
        return dict(compute(parameters))
    except ReplicationError:
        return None


def _label(name: str, printed: Printed, index: int) -> str:
    place = printed.labels[index].removeprefix("entry ")
    return f"{name}{place if place.startswith('(') else place and f'({place})'}"
