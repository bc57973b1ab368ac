"""What the papers share: one plant of ours for all estimators, and how a sketch draws one signal over time.

The plant is a damped oscillator whose position is measured through noise, in SI units; it stands for no device. Every
paper's estimator is tried on it with a sensor that is slower, less regular or later, and each result is compared with
that of the ideal sensor, which measures at every base period at once.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.brief import Brief, Draws, Sketch, Stroke
from replication.audit.model import Reading
from replication.audit.parts import Figure, Formula

PLANT: dict[str, Any] = {
    "A": [[0.0, 1.0], [-1.0, -0.6]],
    "B": [[0.0], [1.0]],
    "C": [[1.0, 0.0]],
    "noise": 0.1,
    "h": 0.2,
}
"""A damped oscillator, which stands for no device: position and speed; force per mass; sensor noise; base period in s.

Every paper's estimator is tried on it with a sensor that is slower, less regular or later, beside the ideal one, which
measures at every base period at once.
"""

MULTIPLES = (1, 2, 3, 4, 6, 8)
"""How many base periods: from one measurement to the next, at the most, or of lateness plus one."""

MINCX = 0.01
"""Relative accuracy, of what it minimises, at which mincx stops by default, says its documentation."""

INPUTS: dict[str, Any] = {"plant": PLANT, "multiples": list(MULTIPLES)}


FIRST, LAST = 8, 312
"""Where the signal begins and ends, in the frame of a sketch."""


def signal(x: float) -> float:
    """Its height at `x`, downwards."""
    return 64 - 26 * math.sin((x - 20) / 32) - 16 * math.sin((x + 4) / 57)


def curve(draws: Draws, height: Callable[[float], float] = signal, first: float = FIRST, last: float = LAST) -> Stroke:
    """A smooth line from `first` to `last`."""
    steps = max(2, round((last - first) / 5))
    xs = [first + (last - first) * step / steps for step in range(steps + 1)]
    return Stroke(draws=draws, points=tuple((round(x, 1), round(height(x), 1)) for x in xs))


def dots(draws: Draws, xs: Iterable[float], height: Callable[[float], float] = signal) -> Stroke:
    """A dot at each of `xs`."""
    return Stroke(draws=draws, points=tuple((round(x, 1), round(height(x), 1)) for x in xs))


def ticks(draws: Draws, xs: Iterable[float], y: float) -> Stroke:
    """A tick down to the height `y` at each of `xs`."""
    return Stroke(draws=draws, points=tuple((round(x, 1), y) for x in xs))


def label(text: str, x: float, y: float, draws: Draws = Draws.LABEL) -> Stroke:
    """A text that begins at `x`."""
    return Stroke(draws=draws, points=((x, y),), text=text)


@dataclass(frozen=True)
class Told:
    """What told.toml beside the modules of a paper says of it: readings, formulas, the brief, captions of figures."""

    readings: tuple[Reading, ...]
    formulas: tuple[Formula, ...]
    _brief: Mapping[str, Any]
    _figures: Mapping[str, Mapping[str, Any]]

    @classmethod
    def read(cls, module: str, **numbers: Any) -> Told:
        """The file beside a module, given as `__file__`; numbers: what `{name}` in a reading stands for."""
        found = tomllib.loads(Path(module).with_name("told.toml").read_text(encoding="utf-8"))
        readings = [
            {"name": name} | {key: value.format(**numbers) if isinstance(value, str) else value for key, value in one}
            for name, one in ((name, fields.items()) for name, fields in found["readings"].items())
        ]
        return cls(
            msgspec.convert(readings, tuple[Reading, ...], strict=False),
            msgspec.convert(found["formulas"], tuple[Formula, ...]),
            found["brief"],
            found["figures"],
        )

    def brief(self, sketch: Sketch, **others: Any) -> Brief:
        """The brief, with what is made rather than said."""
        return msgspec.convert({**self._brief, **msgspec.to_builtins({"sketch": sketch, **others})}, Brief)

    def figures(self, drawn: Mapping[str, tuple[Callable[..., Any], ...]]) -> tuple[Figure, ...]:
        """The figures by name; drawn: of each what gives its data, what draws them, its title, and its words."""
        return tuple(
            Figure(
                name=name, data=data, plot=plot, title=title, alt=alt,
                **{**self._figures[name], "uses": tuple(self._figures[name]["uses"])},
            )
            for name, (data, plot, title, alt) in drawn.items()
        )  # fmt: skip
