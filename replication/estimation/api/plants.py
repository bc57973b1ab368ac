"""How a method takes its plant: the base that each method's reader fills in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Generic, TypeVar

from replication.errors import InvalidInputError
from replication.estimation.api.signals import Signals, is_statespace

P = TypeVar("P")


class PlantReader(ABC, Generic[P]):
    """A plant is of the method's own class, or a `control.StateSpace` with arguments that say what its signals are.

    Hooks: `signals_of` names the signals of the one, `read` makes the other into the one.
    """

    kind: ClassVar[type[Any]]
    arrays: ClassVar[str]
    """What makes a plant of arrays, for messages."""
    advice: ClassVar[str] = ""
    refusal: ClassVar[str]
    """What is said where the arguments of a `control.StateSpace` come with arrays."""

    @abstractmethod
    def signals_of(self, plant: P) -> Signals:
        """Names of the signals of a plant of arrays."""

    @abstractmethod
    def read(self, system: Any, **given: Any) -> tuple[P, Signals]:
        """The plant in a `control.StateSpace`, with its names; raises InvalidInputError."""

    def __call__(self, plant: Any, **given: Any) -> tuple[P, Signals]:
        """The plant that a user gave, checked, and its names; raises InvalidInputError."""
        if isinstance(plant, self.kind):
            if any(value is not None for value in given.values()):
                raise InvalidInputError(self.refusal)
            return plant, self.signals_of(plant)
        if not is_statespace(plant):
            raise InvalidInputError(
                f"plant must be a {self.arrays} or a control.StateSpace, got {type(plant).__name__}{self.advice}"
            )
        return self.read(plant, **given)
