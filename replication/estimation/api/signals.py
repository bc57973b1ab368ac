"""Names and sampling period of a plant's signals, kept from a `control.StateSpace` and given back to one."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
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
        """Plain JSON values."""
        return {
            "states": list(self.states),
            "inputs": list(self.inputs),
            "measurements": list(self.measurements),
            "outputs": list(self.outputs),
            "dt": self.dt,
        }


def numbered(letter: str, count: int) -> tuple[str, ...]:
    """x[0], x[1], ...: the names that python-control gives."""
    return tuple(f"{letter}[{i}]" for i in range(count))


def is_statespace(plant: Any) -> bool:
    """Whether `plant` is a `control.StateSpace`; nobody can hold one who has not imported python-control."""
    loaded = sys.modules.get("control")
    return loaded is not None and isinstance(plant, loaded.StateSpace)


def split_outputs(system: control.StateSpace, measured: int | Sequence[int | str]) -> tuple[list[int], list[int]]:
    """Indices of the measured outputs and of the others, which are to be estimated.

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
        chosen = [_index(name, labels) for name in measured]
    others = [i for i in range(len(labels)) if i not in chosen]
    if not chosen or not others or len(set(chosen)) < len(chosen):
        raise InvalidInputError(
            f"measured must name, once each, some of the {len(labels)} outputs {', '.join(labels)} and leave at least "
            f"one to be estimated, got {measured!r}"
        )
    return chosen, others


def _index(name: int | str, labels: list[str]) -> int:
    if isinstance(name, str) and name in labels:
        return labels.index(name)
    if isinstance(name, (int, np.integer)) and not isinstance(name, bool) and 0 <= name < len(labels):
        return int(name)
    raise InvalidInputError(f"no output {name!r}; the outputs are {', '.join(labels)} (or their indices from 0)")
