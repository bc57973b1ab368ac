"""Names and sampling period of a plant's signals, kept from a `control.StateSpace` and given back to one."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.errors import InvalidInputError

if TYPE_CHECKING:
    import control


ADDED = "under way"
"""What the states are called that a design adds to those of the plant."""


@dataclass(frozen=True)
class Signals:
    """Names of the states, the known inputs, the measurements and the estimated outputs.

    dt: sampling period in seconds; None if the plant is in continuous time or samples at no fixed period. units: of
    signals by name, for those that have one. disturbances: names of the inputs that disturb, where they are known.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    measurements: tuple[str, ...]
    outputs: tuple[str, ...]
    dt: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    disturbances: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Names as lists, dt, and units if there are any: plain JSON values."""
        plain = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}
        return {name: value for name, value in plain.items() if value or name not in ("units", "disturbances")}

    def called(self, names: Iterable[str]) -> tuple[str, ...]:
        """The names, each with its unit in brackets where it has one: what a curve or a column is labelled with."""
        return tuple(f"{name} ({self.units[name]})" if name in self.units else name for name in names)

    def named(
        self,
        states: Sequence[str] | None,
        inputs: Sequence[str] | None,
        measurements: Sequence[str] | None,
        outputs: Sequence[str] | None,
        units: Mapping[str, str] | None,
    ) -> Signals:
        """With other names or units. Outputs that are the states follow their names; states that a design added keep
        theirs. Raises InvalidInputError for another number of names, one twice, or the unit of no signal."""
        given = {"states": states, "inputs": inputs, "measurements": measurements, "outputs": outputs}
        own = {name: getattr(self, name) for name in given}
        own_states = sum(not name.startswith(f"{ADDED}[") for name in self.states)
        told: dict[str, Any] = {}
        for name, names in given.items():
            if names is not None:
                counts = {own_states, len(self.states)} if name == "states" else {len(own[name])}
                told[name] = _labels(name, names, counts)
        if "states" in told:
            if "outputs" not in told and own["outputs"] == own["states"][: len(own["outputs"])]:
                told["outputs"] = told["states"][: len(own["outputs"])]
            told["states"] = (*told["states"], *own["states"][len(told["states"]) :])
        every = replace(self, **told)
        known = {name for names in (every.states, every.inputs, every.measurements, every.outputs) for name in names}
        if unknown := (units or {}).keys() - known:
            raise InvalidInputError(f"units: no signal {min(unknown)!r}; there are {', '.join(sorted(known))}")
        return replace(every, units=dict(units) if units is not None else self.units)


def _labels(kind: str, names: Sequence[str], counts: set[int]) -> tuple[str, ...]:
    if isinstance(names, str) or not all(isinstance(name, str) and name for name in names):
        raise InvalidInputError(f"{kind} must be a sequence of names, got {names!r}")
    if len(set(names)) < len(names) or len(names) not in counts:
        raise InvalidInputError(f"{kind} must be {min(counts)} different names, got {', '.join(names) or 'none'}")
    return tuple(names)


def numbered(letter: str, count: int) -> tuple[str, ...]:
    """x[0], x[1], ...: the names that python-control gives."""
    return tuple(f"{letter}[{i}]" for i in range(count))


def is_statespace(plant: Any) -> bool:
    """Whether `plant` is a `control.StateSpace`; nobody can hold one who has not imported python-control."""
    loaded = sys.modules.get("control")
    return loaded is not None and isinstance(plant, loaded.StateSpace)


def each_instant(names: Iterable[str], count: int) -> list[str]:
    """name@0 ... of all names, then name@1 ...: the names of signals over one period of `count` instants."""
    named = list(names)
    return [f"{name}@{k}" for k in range(count) for name in named]


def measured_outputs(
    system: control.StateSpace, measured: int | Sequence[int | str]
) -> tuple[list[int], list[int], Signals]:
    """Indices of the measured outputs and of the others, which are to be estimated; and the names of the signals.

    measured: how many of the first outputs, or their indices or labels. Raises InvalidInputError for an output that
    does not exist or is named twice, or if one of the two groups is empty.
    """
    labels = list(system.output_labels)
    if isinstance(measured, (np.ndarray, np.generic)):
        measured = measured.tolist()
    if isinstance(measured, int) and not isinstance(measured, bool):
        chosen = list(range(measured)) if 0 <= measured <= len(labels) else []
    elif isinstance(measured, (str, bool)) or not isinstance(measured, Sequence):
        raise InvalidInputError(f"measured must be a number of outputs or a list of them, got {measured!r}")
    else:
        chosen = [index_of(name, labels, "output") for name in measured]
    others = [i for i in range(len(labels)) if i not in chosen]
    if not chosen or not others or len(set(chosen)) < len(chosen):
        raise InvalidInputError(
            f"measured must name, once each, some of the {len(labels)} outputs {', '.join(labels)} and leave at least "
            f"one to be estimated, got {measured!r}"
        )
    seen, unseen = (tuple(labels[i] for i in part) for part in (chosen, others))
    return chosen, others, Signals(tuple(system.state_labels), (), seen, unseen)


def index_of(name: int | str, labels: Sequence[str], kind: str) -> int:
    """The position of an input or output (`kind`) given by label or index; raises InvalidInputError listing all."""
    if isinstance(name, str) and name in labels:
        return labels.index(name)
    if isinstance(name, (int, np.integer)) and not isinstance(name, bool) and 0 <= name < len(labels):
        return int(name)
    raise InvalidInputError(f"no {kind} {name!r}; the {kind}s are {', '.join(labels)} (or their indices from 0)")
