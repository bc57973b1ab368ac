"""Makes the certificates of the wanted theorems of this paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from papers.mustafa.experiments.declared import EXPERIMENTS
from papers.mustafa.method import certify_grid
from replication.certify.nonuniform import gain as nonuniform
from replication.verify.subjects import subject

BRACKETS = {"range": "bracket", "duration": "bracket-duration"}
"""Experiments whose bracket over a range the theorems of these names prove; with their effort."""


def make(name: str) -> dict[str, Any]:
    """The certificate of one entry of theorems.json."""
    theorem = subject("mustafa", name)
    return {**theorem, **_made(theorem)}


def _made(theorem: Mapping[str, Any]) -> dict[str, Any]:
    effort = _effort(theorem["name"])
    constant = theorem["parameters"].get("from") == theorem["parameters"].get("to")
    match theorem["statement"].removeprefix("nonuniform."):
        case "gain-upper" | "keeps-level":
            return nonuniform.gain_upper(theorem, **_chosen(effort, "leaves", "cuts"))
        case "gain-lower" | "breaks-level":
            return nonuniform.gain_lower(theorem, **_chosen(effort, "horizon", "final_horizon"))
        case "optimum-upper":
            return nonuniform.nominal_upper(theorem) if constant else nonuniform.robust_upper(theorem)
        case "optimum-lower" | "no-filter-keeps-level":
            return nonuniform.optimum_lower(theorem)
        case "grid-size":
            return certify_grid.grid(theorem)
        case "one-interval":
            return certify_grid.one_interval(theorem)
        case "stalls":
            return certify_grid.stall(theorem)
        case "same-level":
            return certify_grid.same_level(theorem)
        case _:
            # What the verifier decides by itself, in exact arithmetic or with a symbol for every entry.
            return {"bound": {}, "witness": {}}


def _effort(name: str) -> Mapping[str, Any]:
    """The inputs of the experiment that brackets the same gain, if it is one over a range."""
    kind, _, example = name.rpartition("-")[0].rpartition("-")
    wanted = f"{BRACKETS.get(kind)}.{example}"
    return next((experiment.inputs for experiment in EXPERIMENTS if experiment.name == wanted), {})


def _chosen(effort: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: effort[name] for name in names if name in effort}
