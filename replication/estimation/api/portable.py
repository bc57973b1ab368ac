"""What all running observers share beside their steps: names of the signals, a file that loads again, other forms.

A file names classes of this library and what they are made with; to load it calls nothing else, and no code of the file
is run.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from inspect import signature
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.export import Recursion, c_source, matlab_source, to_json, to_mat
from replication.estimation.api.plants import Signals
from replication.estimation.validation import Array, StateSpace

FORMAT, VERSION = "running observer", 1
ROOM = "replication.estimation."
KINDS = {"f": "float", "i": "int", "b": "bool"}
"""Kinds of arrays, by numpy's letter."""


def decoded(value: Any) -> Any:
    """What `_plain` made a JSON value of."""
    if isinstance(value, list):
        return tuple(decoded(part) for part in value)
    if not isinstance(value, dict):
        return value
    if "array" in value:
        kind, order = value["kind"], value["order"]
        if kind not in KINDS.values() or order not in ("C", "F"):
            raise InvalidInputError(f"an array of kind {kind!r} and order {order!r} is not known")
        entries = np.array(value["array"], dtype=kind).reshape(value["shape"])
        return np.array(entries, order=order)
    if "number" in value:
        return float(value["number"])
    record = class_named(value["record"])
    if not is_dataclass(record):
        raise InvalidInputError(f"{value['record']} is no record")
    return record(**{name: decoded(part) for name, part in value["fields"].items()})


def arrays_in(arguments: dict[str, Any]) -> dict[str, Array]:
    """All arrays of plain arguments that are not empty, by field; where one is taken, by that of its record before."""
    arrays: dict[str, Array] = {}
    for argument, value in arguments.items():
        for holder, name, array in _arrays(value, argument, argument):
            arrays[name if name not in arrays else f"{holder}_{name}"] = array
    return arrays


def _arrays(value: Any, holder: str, field: str, number: str = "") -> Iterator[tuple[str, str, Array]]:
    """Each with the field of its record, and its own with the number of the entry where there are several."""
    if isinstance(value, list):
        for i, part in enumerate(value, start=1):
            yield from _arrays(part, holder, field, f"{number}_{i}" if len(value) > 1 else number)
    elif isinstance(value, dict) and "array" in value:
        if (array := decoded(value)).size:
            yield holder, f"{field}{number}", array
    elif isinstance(value, dict):
        for name, part in value.get("fields", {}).items():
            yield from _arrays(part, field, name, number)


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not np.isfinite(value):
        return {"number": str(float(value))}  # JSON has no NaN
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in KINDS:
            raise InvalidInputError(f"an array of {value.dtype} has no place in the file of an observer")
        # The order in memory decides in which order products are summed.
        order = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
        kind, entries = KINDS[value.dtype.kind], value
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            entries = np.where(np.isfinite(value), value.astype(object), value.astype(str))
        return {"array": entries.tolist(), "shape": list(value.shape), "kind": kind, "order": order}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if is_dataclass(value) and type(value).__module__.startswith(ROOM):
        parts = {field.name: _plain(getattr(value, field.name)) for field in fields(value) if field.init}
        return {"record": _name(type(value)), "fields": parts}
    raise InvalidInputError(f"a {type(value).__name__} has no place in the file of an observer")


def _name(kind: type[Any]) -> str:
    return f"{kind.__module__.removeprefix(ROOM)}:{kind.__qualname__}"


def class_named(name: str) -> type[Any]:
    """A class of the estimation room; nothing that it imports from elsewhere, and nothing else of it."""
    module, _, label = name.partition(":")
    try:
        kind = getattr(importlib.import_module(ROOM + module), label)
    except (ImportError, AttributeError):
        raise InvalidInputError(f"{name!r} is not known; it may have been written by another release") from None
    if not isinstance(kind, type) or kind.__module__ != ROOM + module:
        raise InvalidInputError(f"{name!r} is no class of this library")
    return kind


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
        instance = super().__new__(cls)
        instance._made_with = args, kwargs
        return instance

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
        held = {"format": FORMAT, "version": VERSION, "observer": _name(type(self)), "made_with": self._arguments()}
        return to_json({**held, "signals": None if self.signals is None else self.signals.to_dict()})

    def to_mat(self) -> bytes:
        """All arrays of the observer as a MATLAB file (level 5).

        Returns
        -------
        bytes
            The same every time; variables are named after the fields in `to_json`, with `_1`, `_2` for phases.
        """
        return to_mat(arrays_in(self._arguments()))

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """The observer as one C99 file that compiles by itself; see `export.c_source`.

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
        """The observer as a MATLAB function with a memory; see `export.matlab_source`.

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

    def to_statespace(self) -> StateSpace:
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

    def _arguments(self) -> dict[str, Any]:
        """With which the observer was made, by name, as plain JSON values."""
        args, kwargs = self._made_with
        arguments = signature(type(self).__init__).bind(self, *args, **kwargs).arguments
        return {name: _plain(value) for name, value in arguments.items() if name != "self"}

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
            known_names(u, (*inputs, *measurements), "signal")
            y = {name: value for name, value in u.items() if name in measurements}
            u = {name: value for name, value in u.items() if name in inputs}
        if isinstance(u, dict):
            known_names(u, inputs, "input")
            if lacking := [name for name in inputs if u.get(name) is None]:
                raise InvalidInputError(f"input {lacking[0]!r} has no value; an input is known at every instant")
            u = [u[name] for name in inputs]
        if isinstance(y, dict):
            known_names(y, measurements, "measurement")
            y = [y.get(name) for name in measurements]
        return u, y


def known_names(labels: Iterable[Any], names: Sequence[str], kind: str) -> None:
    """Raise InvalidInputError for a label that is none of the names."""
    for name in labels:
        if name not in names:
            raise InvalidInputError(f"no {kind} {name!r}; the {kind}s are {', '.join(names)}")


def load(path: str | Path) -> Portable:
    """Read a running observer from a file.

    Parameters
    ----------
    path : path
        What the `to_json` of an observer gave.

    Returns
    -------
    RunningObserver
        At instant 0, of the class that was written, with the same names; it takes the same steps.

    Raises
    ------
    InvalidInputError
        The file cannot be read, is no file of an observer, or has a version that is not known.
    """
    try:
        held = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{path} cannot be read as JSON: {error}") from None
    if not isinstance(held, dict) or held.get("format") != FORMAT:
        raise InvalidInputError(f"{path} is no file of a running observer; observer().to_json() writes one")
    if held.get("version") != VERSION:
        raise InvalidInputError(f"{path} has version {held.get('version')!r}; known is version {VERSION}")
    try:
        kind = class_named(held["observer"])
        if not issubclass(kind, Portable):
            raise InvalidInputError(f"{held['observer']} is no running observer")
        observer = kind(**{name: decoded(value) for name, value in held["made_with"].items()})
        if (names := held["signals"]) is None:
            return observer
        plain: dict[str, Any] = {key: tuple(v) if isinstance(v, list) else v for key, v in names.items()}
        return observer.named(Signals(**plain))
    except InvalidInputError as error:
        raise InvalidInputError(f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InvalidInputError(f"{path} is not whole: {type(error).__name__} {error}") from None
