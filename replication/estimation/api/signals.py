"""Names and sampling period of a plant's signals, kept from a `control.StateSpace` and given back to one."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.errors import InvalidInputError

if TYPE_CHECKING:
    import control


@dataclass(frozen=True)
class Signals:
    """Names of the states, the known inputs, the measurements and the estimated outputs.

    dt: sampling period in seconds; None if the plant is in continuous time or samples at no fixed period.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    measurements: tuple[str, ...]
    outputs: tuple[str, ...]
    dt: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Names as lists and dt: plain JSON values."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


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
