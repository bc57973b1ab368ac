"""Running observers in files: JSON with a version, made of numbers, arrays and the fields of frozen records.

A file names classes of this library and what they are made with; to load it calls nothing else, and no code of the file
is run.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from inspect import signature
from typing import Any

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.export import to_json
from replication.estimation.api.signals import Signals
from replication.estimation.validation import Array

FORMAT, VERSION = "running observer", 1
ROOM = "replication.estimation."
KINDS = {"f": "float", "i": "int", "b": "bool"}
"""Kinds of arrays, by numpy's letter."""


def file_text(kind: type[Any], made_with: Mapping[str, Any], signals: Signals | None) -> str:
    """The file of an observer of class `kind`."""
    names = None if signals is None else signals.to_dict()
    return to_json(
        {"format": FORMAT, "version": VERSION, "observer": _name(kind), "made_with": made_with, "signals": names}
    )


def encoded(made: Any, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments with which `made` was made, by name, as plain JSON values."""
    given = signature(type(made).__init__).bind(made, *args, **kwargs).arguments
    return {name: _plain(value) for name, value in list(given.items())[1:]}


def decoded(value: Any) -> Any:
    """What `encoded` made a JSON value of."""
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


def arrays_in(value: Any, name: str = "") -> dict[str, Array]:
    """All arrays of an encoded value that are not empty, by field, with a number where there are several of one."""
    if isinstance(value, dict) and "array" in value:
        array = decoded(value)
        return {name: array} if array.size else {}
    if isinstance(value, list):
        several = len(value) > 1
        parts = [(f"{name}_{i}" if several else name, part) for i, part in enumerate(value, start=1)]
    elif isinstance(value, dict) and "record" in value:
        # A list of records, the phases say, gives its numbers to the fields.
        number = name[name.rindex("_") :] if name[-1:].isdigit() and "_" in name else ""
        parts = [(f"{field}{number}", part) for field, part in value["fields"].items()]
    elif isinstance(value, dict):
        parts = list(value.items())
    else:
        return {}
    found: dict[str, Array] = {}
    for label, part in parts:
        for key, array in arrays_in(part, label).items():
            found[key if key not in found else f"{label}_{key}"] = array
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not np.isfinite(value):
        return {"number": str(float(value))}  # JSON has no NaN
    if value is None or isinstance(value, (bool, int, float, str)):
        return value.item() if isinstance(value, np.generic) else value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in KINDS:
            raise InvalidInputError(f"an array of {value.dtype} has no place in the file of an observer")
        # The order in memory decides in which order products are summed.
        order = "F" if value.flags.f_contiguous and not value.flags.c_contiguous else "C"
        kind = KINDS[value.dtype.kind]
        entries = value
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
    module, _, own = name.partition(":")
    try:
        found = getattr(importlib.import_module(ROOM + module), own)
    except (ImportError, AttributeError):
        raise InvalidInputError(f"{name!r} is not known; it may have been written by another release") from None
    if not isinstance(found, type) or found.__module__ != ROOM + module:
        raise InvalidInputError(f"{name!r} is no class of this library")
    return found
