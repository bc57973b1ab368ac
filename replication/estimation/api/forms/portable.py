"""What all running observers share beside their steps: names of the signals, a file that loads again, other forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, Self

from replication.errors import InvalidInputError
from replication.estimation.api.c_code import c_source
from replication.estimation.api.export import to_mat
from replication.estimation.api.forms.matlab import matlab_source
from replication.estimation.api.forms.stored import arrays_in, encoded, file_text
from replication.estimation.api.phase import Recursion
from replication.estimation.api.signals import Signals

if TYPE_CHECKING:
    import control

NOT_GIVEN: Final = object()
"""Stands for an argument that was left out, where None means that nothing was measured."""


class Portable:
    """A running observer is made again from what it was made with, so nothing else has to be kept in a file.

    Attributes
    ----------
    signals : Signals or None
        Names of inputs and measurements, for `step({"name": value})`.
    """

    signals: Signals | None = None
    _made_with: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        """Remember the arguments."""
        made = super().__new__(cls)
        made._made_with = args, kwargs
        return made

    def named(self, signals: Signals | None) -> Self:
        """Call inputs and measurements by these names.

        Parameters
        ----------
        signals : Signals or None
            Names, and the sampling period.

        Returns
        -------
        RunningObserver
            The same observer.
        """
        self.signals = signals
        return self

    def to_json(self) -> str:
        """The observer as a file that `load` reads.

        Returns
        -------
        str
            JSON with a format and its version; numbers read back exactly. The loaded observer stands at instant 0.
        """
        args, kwargs = self._made_with
        return file_text(type(self), encoded(self, args, kwargs), self.signals)

    def to_mat(self) -> bytes:
        """All arrays of the observer as a MATLAB file (level 5).

        Returns
        -------
        bytes
            The same every time; variables are named after the fields in `to_json`, with `_1`, `_2` for phases.
        """
        args, kwargs = self._made_with
        return to_mat(arrays_in(encoded(self, args, kwargs)))

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The observer as one C99 file that compiles by itself; see `c_code`.

        Parameters
        ----------
        name : str
            C identifier of at most 31 characters with which every name begins.
        comment : str
            What it is, for the top of the file.

        Returns
        -------
        str
            `NAME_init`, `NAME_step` and all matrices; it does what `reset` and `step` do.

        Raises
        ------
        InvalidInputError
            `name` is no C identifier, or the observer is no periodic recursion and has no C form of its own.
        """
        return c_source(name, comment, self._recursion())

    def to_matlab(self, name: str = "observer", comment: str = "") -> str:
        """The observer as a MATLAB function with a memory; see `matlab`.

        Parameters
        ----------
        name : str
            Name of the function and of its file, at most 31 characters.
        comment : str
            What it is, for its help.

        Returns
        -------
        str
            The text of NAME.m.

        Raises
        ------
        InvalidInputError
            `name` does not fit, or the observer is no periodic recursion.
        """
        return matlab_source(name, comment, self._recursion())

    def to_statespace(self) -> control.StateSpace:
        """The observer as a linear system, as it runs while no measurement is missing.

        Returns
        -------
        control.StateSpace
            From the known inputs and the measurements to the estimate; over one period, if the observer is periodic.

        Raises
        ------
        InvalidInputError
            The observer changes with time, and is no linear system with constant matrices.
        """
        raise InvalidInputError(f"a {type(self).__name__} has no constant matrices; run it by `step`")

    def _recursion(self) -> Recursion:
        raise InvalidInputError(
            f"a {type(self).__name__} is no periodic recursion, from which this form is made; run it by `step`"
        )

    def _by_name(self, u: Any, y: Any) -> tuple[Any, Any]:
        """(u, y) with values by name put in order; one dict holds inputs and measurements."""
        if not isinstance(u, dict) and not isinstance(y, dict):
            raise InvalidInputError("step takes u and y, or one dict of values by name")
        if self.signals is None:
            raise InvalidInputError("this observer has no names of signals; give u and y in order")
        inputs, measurements = self.signals.inputs, self.signals.measurements
        if y is NOT_GIVEN:
            if both := sorted(set(inputs) & set(measurements)):
                raise InvalidInputError(f"{both[0]!r} is an input and a measurement; give two dicts, step(u, y)")
            _known_names(u, (*inputs, *measurements), "signal")
            y = {name: value for name, value in u.items() if name in measurements}
            u = {name: value for name, value in u.items() if name in inputs}
        if isinstance(u, dict):
            _known_names(u, inputs, "input")
            if lacking := [name for name in inputs if u.get(name) is None]:
                raise InvalidInputError(f"input {lacking[0]!r} has no value; an input is known at every instant")
            u = [u[name] for name in inputs]
        if isinstance(y, dict):
            _known_names(y, measurements, "measurement")
            y = [y.get(name) for name in measurements]
        return u, y


def _known_names(given: dict[Any, Any], names: tuple[str, ...], kind: str) -> None:
    for name in given:
        if name not in names:
            raise InvalidInputError(f"no {kind} {name!r}; the {kind}s are {', '.join(names)}")
