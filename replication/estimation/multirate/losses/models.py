"""What is known of the losses: at most so many samples in a row, independent losses, or a channel with good and bad
times (Gilbert, Bell Syst. Tech. J. 39, 1960).

A model steps from what it remembers of the past to what may come next; `automaton` makes all that may happen of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import prod
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.validation import at_most

MOST_MISSES = 50
Memory = tuple[int, ...]
Option = tuple[bool, int, float]
"""Of one channel: whether its samples come, what it remembers then, and the probability (NaN if none is known)."""


class LossModel(ABC):
    """The samples of each sensor travel on a channel of its own, or those of one instant `together` in one packet."""

    together: bool

    @property
    def _packet(self) -> str:
        return ", in one packet" if self.together else ""

    def channels(self, sensors: int) -> int:
        """How many channels there are."""
        return 1 if self.together else sensors

    def require(self, sensors: int) -> None:
        """Raise InvalidInputError unless each field has one entry, or one for each channel."""
        count = self.channels(sensors)
        for name, value in vars(self).items():
            if isinstance(value, tuple) and len(value) not in (1, count):
                raise InvalidInputError(
                    f"{name} must be one number, or one for each of {count} "
                    f"{'packet' if self.together else 'sensors'}, got {value}"
                )

    def following(self, memory: Memory, due: Sequence[bool]) -> Iterator[tuple[tuple[bool, ...], Memory, float]]:
        """Which samples may come of those that are due, what is remembered then, and with which probability."""
        busy = [any(due)] if self.together else list(due)
        options = [
            self.options(c, state) if used else [(False, state, 1.0)]
            for c, (state, used) in enumerate(zip(memory, busy, strict=True))
        ]
        for choice in product(*options):
            probability = prod(p for _, _, p in choice)
            if probability == 0:
                continue
            came = [c for c, _, _ in choice] * (len(due) if self.together else 1)
            yield tuple(a and b for a, b in zip(came, due, strict=True)), tuple(m for _, m, _ in choice), probability

    @abstractmethod
    def options(self, channel: int, state: int) -> list[Option]:
        """What may happen on a channel that is used."""

    @abstractmethod
    def __str__(self) -> str:
        """The model in words."""


@dataclass(frozen=True)
class InARow(LossModel):
    """At most so many losses in a row, in any pattern; `analyse` then gives the worst case over all of them.

    Parameters
    ----------
    misses : int or sequence of int
        Most losses in a row, of all sensors or of each; 0 for none.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        An entry is no whole number from 0 to 50.
    """

    misses: int | Sequence[int]
    together: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        entries = tuple(self.misses) if isinstance(self.misses, (Sequence, np.ndarray)) else (self.misses,)
        counts = tuple(0 if type(m) is int and m == 0 else at_most("misses", m, MOST_MISSES) for m in entries)
        object.__setattr__(self, "misses", counts)

    def options(self, channel: int, state: int) -> list[Option]:
        """Count the losses since the last arrival."""
        arrival: Option = (True, 0, np.nan)
        return [arrival, (False, state + 1, np.nan)] if state < _entry(self.misses, channel) else [arrival]

    def __str__(self) -> str:
        return f"at most {_listed(self.misses)} lost in a row{self._packet}"


@dataclass(frozen=True)
class Independent(LossModel):
    """Each sample that is due is lost with a probability, whatever happened before.

    Parameters
    ----------
    probability : float or sequence of float
        Of a loss, for all sensors or for each.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        A probability is not from 0 to 1.
    """

    probability: float | Sequence[float]
    together: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "probability", _probabilities("probability", self.probability))

    def options(self, channel: int, state: int) -> list[Option]:
        """Nothing is remembered."""
        p = _entry(self.probability, channel)
        return [(True, 0, 1 - p), (False, 0, p)]

    def __str__(self) -> str:
        return f"each sample is lost with probability {_listed(self.probability)}{self._packet}"


@dataclass(frozen=True)
class Markov(LossModel):
    """Losses that come in bursts: the probability of a loss depends on whether the sample before was lost.

    Parameters
    ----------
    after_arrival : float or sequence of float
        Probability of a loss after a sample that came, for all sensors or for each.
    after_loss : float or sequence of float
        Probability of a loss after a loss; below one.
    together : bool
        The samples of one instant travel in one packet.

    Raises
    ------
    InvalidInputError
        A probability is not from 0 to 1, or `after_loss` is one: a burst would never end.
    """

    after_arrival: float | Sequence[float]
    after_loss: float | Sequence[float]
    together: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        after = {name: _probabilities(name, getattr(self, name)) for name in ("after_arrival", "after_loss")}
        for name, probabilities in after.items():
            object.__setattr__(self, name, probabilities)
        if max(after["after_loss"]) >= 1:
            raise InvalidInputError(
                "after_loss must be below 1, or a burst never ends; leave out a sensor that is lost"
            )

    def options(self, channel: int, state: int) -> list[Option]:
        """Whether the last sample was lost is remembered."""
        p = _entry(self.after_loss if state else self.after_arrival, channel)
        return [(True, 0, 1 - p), (False, 1, p)]

    def __str__(self) -> str:
        return (
            f"lost with probability {_listed(self.after_arrival)} after an arrival, {_listed(self.after_loss)} after "
            f"a loss{self._packet}"
        )


def _entry(values: Any, channel: int) -> Any:
    return values[channel if len(values) > 1 else 0]


def _listed(values: Any) -> str:
    return ", ".join(str(value) for value in values)


def _probabilities(name: str, items: Any) -> tuple[float, ...]:
    entries = tuple(items) if isinstance(items, (Sequence, np.ndarray)) and not isinstance(items, str) else (items,)
    for value in entries:
        plain = isinstance(value, (int, float, np.floating)) and not isinstance(value, bool)
        if not plain or not 0 <= value <= 1:
            raise InvalidInputError(f"{name} must be probabilities from 0 to 1, got {value!r}")
    if not entries:
        raise InvalidInputError(f"{name} must have an entry")
    return tuple(float(value) for value in entries)
