"""Certificates of filters with time stamps: the storage of the design, and a periodic disturbance of a bad pattern."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import frexp, log2, pi
from typing import Any

import numpy as np

from replication.certify.nonuniform.gain import (
    ATTAINED_MARGIN,
    RANGE_MARGIN,
    SHARE_BITS,
    Made,
    disturbance,
    pattern_of,
    problem_of,
)
from replication.certify.rounding import rationals, rounded, rounded_down, rounded_up
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.nonuniform.stamped.design import StampedFilter, StampedPlant, StampedProof, proved_design
from replication.estimation.nonuniform.worst_case import worst_sequence
from replication.estimation.validation import Array

LEVEL_BITS = 30
"""Bits of a bound."""
LOST = 30
"""Bits of the verifier's balls that may be lost under a pattern, which it goes through twice; longer ones are cut."""
STEPS = 2**8
"""Of the coordinates, in a unit."""
RANGE = {"from": "h_l", "to": "h_u"}


def stamped_gain(theorem: Mapping[str, Any], filter_: StampedFilter, proof: StampedProof, runs: Sequence[int]) -> Made:
    """Both bounds and the witness for a filter with the floats that it has; runs: of the pattern, see `pattern_of`."""
    plant = theorem["plant"]
    system, periods = problem_of(plant, RANGE, StampedPlant)
    T = coordinates(proof)
    back = np.linalg.inv(T)
    pattern, h = pattern_of(runs, periods)
    # In these coordinates floating point is accurate, too.
    moved, chosen = system.in_coordinates(T), filter_.in_coordinates(T)
    while lost_bits(stages := along_pattern(moved, chosen, h)) > LOST and len(h) > len(pattern):
        runs = [(count + 1) // 2 for count in runs]
        pattern, h = pattern_of(runs, periods)
    peak = l2_gain(stages)
    lower, upper = peak.lower * (1 - ATTAINED_MARGIN), proof.level * (1 + RANGE_MARGIN)
    return {
        "bound": {
            "lower": rounded_down(lower, LEVEL_BITS - frexp(lower)[1]),
            "upper": rounded_up(upper, LEVEL_BITS - frexp(upper)[1]),
        },
        "witness": {
            "filter": {"cells": shares(plant, filter_.edges), "G": rationals(filter_.G)},
            "T": rationals(T),
            "storage": {
                "cells": shares(plant, proof.edges[1:-1]),
                "before": [list(row) for row in proof.before],
                "P": rationals(symmetric(back.T @ proof.storage @ back)),
            },
            **disturbance(pattern, stages, peak.angle, np.ones_like(h)),
        },
    }


def coordinates(proof: StampedProof) -> Array:
    """T for which the storage of T x is about a multiple of the identity: upper triangular and of few bits, with powers
    of two on its diagonal, so that its inverse has few bits, too."""
    root = np.linalg.cholesky(np.mean(proof.storage, axis=0) / proof.level**2).T
    units = np.diag(root)
    return np.asarray(np.exp2(np.round(np.log2(units)))[:, None] * np.round(root / units[:, None] * STEPS) / STEPS)


def lost_bits(stages: PeriodicSystem) -> float:
    """Bits by which balls widen over a pattern: each step multiplies their radii by its moduli."""
    total, bits = np.eye(stages.order), 0.0
    for stage in stages.stages:
        total = np.abs(stage.A) @ total
        size = float(np.max(total)) or 1.0
        total, bits = total / size, bits + log2(size)
    return bits


def least_gain(theorem: Mapping[str, Any], *, horizon: int) -> Made:
    """The same for the filter of least level, and the worst pattern that `worst_sequence` finds."""
    system, periods = problem_of(theorem["plant"], RANGE, StampedPlant)
    design, proof = proved_design(system, periods)
    attack = worst_sequence(system, design.filter, periods, horizon=horizon)
    return stamped_gain(theorem, design.filter, proof, attack.runs)


def along_pattern(plant: SampledPlant, filter_: StampedFilter, h: Array) -> PeriodicSystem:
    """The error under periods h (p,) that repeat: before the first comes the last."""
    upper = plant.transitions(np.array([h[-1], *h]))[:, : plant.order]
    steps, drives = filter_.steps_along(plant, np.array([h[-1], *h]), upper)
    direct = np.zeros((len(plant.L), drives.shape[2]))
    return PeriodicSystem(tuple(Stage(A, B, plant.L, direct) for A, B in zip(steps[1:], drives[1:], strict=True)))


def shares(plant: Mapping[str, Any], edges: Sequence[float]) -> list[str]:
    """0, where the inner edges (s) divide the range, and 1: exactly if its ends are rational."""
    (low, low_pi), (high, high_pi) = ([Fraction(part) for part in plant[end]] for end in ("h_l", "h_u"))
    if low_pi or high_pi:
        h_l, h_u = (float(a) + float(b) * pi for a, b in ((low, low_pi), (high, high_pi)))
        return ["0", *(rounded((edge - h_l) / (h_u - h_l), SHARE_BITS) for edge in edges), "1"]
    return ["0", *(str((Fraction(edge) - low) / (high - low)) for edge in edges), "1"]
