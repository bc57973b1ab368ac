"""Statements on multi-rate observers: levels, counts, poles and identities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from replication.verify.multirate import counts, identities, levels, recovered
from replication.verify.theorem import Theorem

STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    **levels.STATEMENTS,
    **counts.STATEMENTS,
    **identities.STATEMENTS,
    **recovered.STATEMENTS,
}
