"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from replication.estimation.certificates import nonuniform, nonuniform_grid
from replication.verify.subjects import subject

KEY = "mustafa"
LEAVES = {"range-1-upper": 250, "range-2-upper": 20, "duration-1-upper": 100, "duration-2-upper": 100}
"""Storage matrices over a range of periods; one where nothing is said."""
HORIZONS = {"range-1-lower": 600, "range-2-lower": 1500, "duration-1-lower": 200, "duration-2-lower": 250}
"""Samples in the search for a bad pattern of periods; a constant period where nothing is said."""


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    theorem = subject(KEY, name)
    return {**theorem, **_made(theorem)}


def _made(theorem: Mapping[str, Any]) -> dict[str, Any]:
    name, constant = theorem["name"], theorem["parameters"].get("from") == theorem["parameters"].get("to")
    match theorem["statement"].removeprefix("nonuniform."):
        case "gain-upper" | "keeps-level":
            return nonuniform.gain_upper(theorem, leaves=LEAVES.get(name, 1))
        case "gain-lower" | "breaks-level":
            return nonuniform.gain_lower(theorem, horizon=HORIZONS.get(name, 0))
        case "optimum-upper":
            return nonuniform.nominal_upper(theorem) if constant else nonuniform.robust_upper(theorem)
        case "optimum-lower" | "no-filter-keeps-level":
            return nonuniform.optimum_lower(theorem)
        case "grid-size":
            return nonuniform_grid.grid(theorem)
        case "one-interval":
            return nonuniform_grid.one_interval(theorem)
        case "stalls":
            return nonuniform_grid.stall(theorem)
        case "same-level":
            return nonuniform_grid.same_level(theorem)
        case _:
            # What the verifier decides by itself, in exact arithmetic or with a symbol for every entry.
            return {"bound": {}, "witness": {}}
