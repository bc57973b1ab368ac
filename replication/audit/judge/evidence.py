"""Evidence as plain finite numbers: what a claim answers is checked before any of it is judged or stored."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import msgspec

from replication.audit.model import Evidence
from replication.errors import AuditError


def plain(evidence: Evidence | None) -> Evidence:
    """The evidence with plain finite numbers; raises AuditError naming the field that is not."""
    if not isinstance(evidence, Evidence):
        raise AuditError(f"there is no evidence: the claim answered {evidence!r}")
    try:
        fields = msgspec.to_builtins(evidence, enc_hook=_from_numpy)
        plain = msgspec.convert(fields, Evidence)
    except (TypeError, msgspec.ValidationError) as error:
        raise AuditError(f"the evidence is not made of plain numbers: {error}") from None
    require_finite("", fields)
    return plain


def _from_numpy(value: Any) -> Any:
    """NumPy scalars and arrays as numbers and lists, known by their `tolist`."""
    if not hasattr(value, "tolist"):
        raise TypeError(f"{value!r} is a {type(value).__name__}")
    return value.tolist()


def require_finite(path: str, value: Any) -> None:
    """Raise AuditError, naming the entry below `path`, if any number in nested mappings and sequences is not finite."""
    if isinstance(value, float) and not math.isfinite(value):
        raise AuditError(f"the evidence holds {value} in {path.rstrip('.')}; only finite numbers are evidence")
    if isinstance(value, Mapping):
        for key, entry in value.items():
            require_finite(f"{path}{key}.", entry)
    elif isinstance(value, list | tuple):
        for index, entry in enumerate(value):
            require_finite(f"{path.rstrip('.')}[{index}].", entry)
