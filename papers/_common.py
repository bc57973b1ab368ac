"""What the papers share: one plant of ours for all estimators, what claims and figures make alike, how a sketch draws
one signal over time, and `Told`, what is said of a paper in its told.toml.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec

from replication.audit.brief import Brief, Draws, Sketch, Stroke
from replication.audit.declare import Part
from replication.audit.model import Erratum, Evidence, Outcome, Proof, Reading, Results, SolverRecord
from replication.audit.parts import CommonLevel, Figure, FigureData, Formula, Table
from replication.errors import AuditError
from replication.verify.subjects import subject

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


Maker = Callable[[Mapping[str, Any]], dict[str, Any]]


def certificate(paper: str, makers: Mapping[str, Maker], name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json; makers: by statement, what finds `bound` or `witness` or both.

    What has no maker the verifier decides by itself, in exact arithmetic or in letters.
    """
    theorem = subject(paper, name)
    maker = makers.get(theorem["statement"].partition(".")[2])
    return {**theorem, "bound": {}, "witness": {}, **(maker(theorem) if maker else {})}


POSITION = "gain from force and noise to the position's error"
"""What the levels of estimators on that plant are."""


def common_levels(
    measure: str, sensors: Mapping[str, Iterable[tuple[float, float]]], multiples: Sequence[int] = MULTIPLES
) -> tuple[CommonLevel, ...]:
    """The rows of the report, by sensor a bracket for each multiple; none where a loop is unstable."""
    return tuple(
        CommonLevel(sensor=sensor, multiple=m, lower=low, upper=high, measure=measure)
        for sensor, brackets in sensors.items()
        for m, (low, high) in zip(multiples, brackets, strict=True)
        if low is not None
    )


def solvers(*results: Mapping[str, Any]) -> tuple[SolverRecord, ...]:
    """The accounts of the solvers behind results, of each its `solvers`, or its one `solver`."""
    return tuple(SolverRecord(**entry) for record in results for entry in record.get("solvers") or [record["solver"]])


def outcomes_of(margins: Mapping[str, float]) -> tuple[Outcome, ...]:
    """By reading, a statement that holds if its margin is positive."""
    return tuple(Outcome(reading=reading, holds=margin > 0, margin=margin) for reading, margin in margins.items())


def by_margin(margins: Mapping[str, float], **fields: Any) -> Evidence:
    """A statement that holds where a margin is positive; margins: by reading, that of the claim first."""
    outcomes = outcomes_of(margins)
    return Evidence(holds=outcomes[0].holds, margin=outcomes[0].margin, outcomes=outcomes, **fields)


FIRST, LAST = 8, 312
"""Where the signal begins and ends, in the frame of a sketch."""


def signal(x: float) -> float:
    """Its height at `x`, downwards."""
    return 64 - 26 * math.sin((x - 20) / 32) - 16 * math.sin((x + 4) / 57)


def curve(draws: Draws, height: Callable[[float], float] = signal, first: float = FIRST, last: float = LAST) -> Stroke:
    """A smooth line from `first` to `last`."""
    steps = max(2, round((last - first) / 5))
    return dots(draws, (first + (last - first) * step / steps for step in range(steps + 1)), height)


def dots(draws: Draws, xs: Iterable[float], height: Callable[[float], float] = signal) -> Stroke:
    """A dot, or a tick, at each of `xs`."""
    return Stroke(draws=draws, points=tuple((round(x, 1), round(height(x), 1)) for x in xs))


def ticks(draws: Draws, xs: Iterable[float], y: float) -> Stroke:
    """A tick down to the height `y` at each of `xs`."""
    return dots(draws, xs, lambda x: y)


def label(text: str, x: float, y: float, draws: Draws = Draws.LABEL) -> Stroke:
    """A text that begins at `x`."""
    return Stroke(draws=draws, points=((x, y),), text=text)


Proofs = Mapping[str, Callable[[str, Results], Proof]]
"""Errata by name: what proves each, from the words of its proof and the results."""
Columns = Mapping[str, Any]
"""The data of a figure: sequences of numbers by name."""
Drawn = Mapping[str, tuple[Callable[..., Columns], Callable[..., Any], Callable[..., Mapping[str, Any]]]]
"""Figures by name: what gives the data from results, what draws them, and what their words name."""


@dataclass(frozen=True)
class Told:
    """What told.toml beside the modules of a paper says of it, as tables; numbers: what `{name}` in some texts is."""

    said: Mapping[str, Any]
    numbers: Mapping[str, Any]

    @classmethod
    def read(cls, module: str, **numbers: Any) -> Told:
        """The file beside a module, which is given as `__file__`."""
        return cls(tomllib.loads(Path(module).with_name("told.toml").read_text(encoding="utf-8")), numbers)

    def simple(self) -> dict[str, Any]:
        """What needs nothing else, as `paper` takes it: readings, formulas and tables."""
        readings = [{"name": name, **self._filled(entry)} for name, entry in self.said["readings"].items()]
        return {
            "readings": msgspec.convert(readings, tuple[Reading, ...], strict=False),
            "formulas": msgspec.convert(self.said["formulas"], tuple[Formula, ...]),
            "tables": msgspec.convert(self.said["tables"], tuple[Table, ...]),
        }

    def brief(self, sketch: Sketch, **others: Any) -> Brief:
        """The brief, with what is made rather than said."""
        return msgspec.convert({**self.said["brief"], **msgspec.to_builtins({"sketch": sketch, **others})}, Brief)

    def parts(self, *parts: Part) -> tuple[Part, ...]:
        """All parts of the text in its order: these, and those that are left out with a reason."""
        index = {part.title: part for part in parts}
        return tuple(index[entry] if isinstance(entry, str) else Part(**entry) for entry in self.said["scope"]["parts"])

    def errata(self, proofs: Proofs) -> tuple[Erratum, ...]:
        """The errata, each with the function of its name that proves it, which gets the words of its `proof`."""
        _require_same("errata", self.said["errata"], proofs)
        errata = []
        for name, entry in self.said["errata"].items():
            fields = dict(entry)
            prove = partial(proofs[name], fields.pop("proof"))
            errata.append(Erratum(id=name, prove=prove, **self._filled(fields)))
        return tuple(errata)

    def figures(self, drawn: Drawn) -> tuple[Figure, ...]:
        """The figures; drawn: by name what gives the data of each, what draws them, and what `title` and `alt` name.

        That may be a column of the data too: `{tau[0]:g}` is its first entry.
        """
        _require_same("figures", self.said["figures"], drawn)
        figures = []
        for name, (data, plot, facts) in drawn.items():
            entry = dict(self.said["figures"][name])
            title, alt = (partial(_worded, entry.pop(word), facts) for word in ("title", "alt"))
            fields = {**self._filled(entry), "uses": tuple(entry["uses"])}
            figures.append(Figure(name=name, data=_data(data), plot=_plot(plot), title=title, alt=alt, **fields))
        return tuple(figures)

    def findings(self, facts: Callable[[Results], Mapping[str, Any]]) -> Callable[[Results], tuple[str, ...]]:
        """The sentences that lead the page, with what `facts` finds.

        Where that has the name of a sentence, it is left out if False, and said for each of a list.
        """

        def sentences(results: Results) -> Iterator[str]:
            values = facts(results)
            for name, text in self.said["findings"].items():
                named = values.get(name)
                cases = named if isinstance(named, list) else [] if named is False else [{}]
                yield from (text.format(**{**values, **case}) for case in cases)

        return lambda results: tuple(sentences(results))

    def _filled(self, row: Mapping[str, Any]) -> dict[str, Any]:
        try:
            return {name: text.format(**self.numbers) if isinstance(text, str) else text for name, text in row.items()}
        except KeyError as missing:
            raise AuditError(f"told.toml has {{{missing.args[0]}}} in {row}; give that number to `Told.read`") from None


def _worded(text: str, facts: Callable[[Columns], Mapping[str, Any]], figure: FigureData) -> str:
    return text.format(**{**figure.columns, **facts(figure.columns)})


def _data(function: Callable[[Results], Columns]) -> Callable[[Results], FigureData]:
    return wraps(function)(
        lambda results: FigureData(
            columns={name: tuple(map(float, values)) for name, values in function(results).items()}
        )
    )


def _plot(function: Callable[[Columns], Any]) -> Callable[[FigureData], Any]:
    return wraps(function)(lambda figure: function(figure.columns))


class Read(dict[str, Any]):
    """Of results those that were read."""

    def __init__(self, results: Results) -> None:
        super().__init__()
        self._results = results

    def __missing__(self, name: str) -> Any:
        return self.setdefault(name, self._results[name])


def _require_same(what: str, entries: Iterable[str], functions: Iterable[str]) -> None:
    """Raise AuditError for an entry of told.toml that no function makes, or the other way about."""
    lost = sorted(set(entries) ^ set(functions))
    if lost:
        raise AuditError(
            f"told.toml and the modules do not name the same {what}; only one of them has {', '.join(lost)}"
        )


def parts_of(*modules: ModuleType) -> tuple[Part, ...]:
    """The parts that are names of modules of claims, each once."""
    values = (value for module in modules for value in vars(module).values())
    return tuple(dict.fromkeys(value for value in values if isinstance(value, Part)))
