"""Evidence by a margin: a quantity above zero, or a residual below rounding."""

from __future__ import annotations

from typing import Any

from replication.audit.model import Evidence

ROUND_OFF = 1e-9
"""A residual below this is rounding."""


def positive(method: str, margin: float, **told: Any) -> Evidence:
    """Evidence that a statement holds if its margin is positive. told: further fields of `Evidence`."""
    return Evidence(method=method, holds=margin > 0, margin=margin, **told)


def residual(method: str, gap: float, as_printed: Evidence | None = None) -> Evidence:
    """Evidence that an identity holds up to rounding."""
    return positive(
        method,
        ROUND_OFF - gap,
        threshold=ROUND_OFF,
        threshold_reason="An identity holds up to rounding, relative to the size of its terms.",
        quantities={"residual": gap},
        as_printed=as_printed,
    )
