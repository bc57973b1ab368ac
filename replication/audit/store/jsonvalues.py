"""Inputs and results of experiments as JSON text: checked on the way in, floats exact on the way back."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

from replication.audit.model import SolverRecord
from replication.errors import AuditError


def encode(name: str, value: Any, *, sort: bool = False) -> str:
    """JSON text of `value`; `json.loads` gives back the same floats, bit for bit, and lists for tuples.

    Raises AuditError, with the path of the entry, for whatever JSON cannot hold: arrays, complex numbers, NaN and
    infinities, keys that are not text.
    """
    _check(name, value)
    return json.dumps(value, sort_keys=sort, separators=(",", ":"), allow_nan=False)


def solvers_in(name: str, value: Any) -> tuple[SolverRecord, ...]:
    """All solver records of a result: the lists that stand under a key `solvers`, at any depth, in order.

    Raises AuditError if such a list holds something else.
    """
    try:
        return tuple(msgspec.convert(record, SolverRecord) for record in _listed(value))
    except msgspec.ValidationError as error:
        raise AuditError(f"{name}: an entry of `solvers` is not a solver record: {error}") from None


def _check(path: str, value: Any) -> None:
    if value is None or isinstance(value, str | int):
        return
    if isinstance(value, float):
        if not math.isfinite(value):
            raise AuditError(f"{path} is {value}, which JSON cannot hold; give None or a word and say what it means")
    elif isinstance(value, list | tuple):
        # Rows of numbers are most of what there is.
        if set(map(type, value)) == {float} and all(map(math.isfinite, value)):
            return
        for index, entry in enumerate(value):
            _check(f"{path}[{index}]", entry)
    elif isinstance(value, dict):
        for key, entry in value.items():
            if not isinstance(key, str):
                raise AuditError(f"{path} has the key {key!r}; JSON keys are text, write {str(key)!r}")
            _check(f"{path}.{key}", entry)
    else:
        kind = f"{type(value).__module__}.{type(value).__qualname__}".removeprefix("builtins.")
        raise AuditError(f"{path} is a {kind}, which JSON cannot hold; give numbers, text, lists and dictionaries")


def _listed(value: Any) -> Iterator[Any]:
    if isinstance(value, Mapping):
        for key, entry in value.items():
            if key == "solvers" and isinstance(entry, list):
                yield from entry
            else:
                yield from _listed(entry)
    elif isinstance(value, list):
        for entry in value:
            yield from _listed(entry)
