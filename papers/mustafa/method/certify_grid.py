"""Certificates of the small-gain condition (8): the grid of Algorithm 1, its stall, one level for both channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from papers.mustafa.method.algorithm1 import gaps
from papers.mustafa.method.stability import covered_interval, delta_block
from replication.certify.multirate.levels import lyapunov_matrices
from replication.certify.nonuniform.gain import problem_of, robust_upper
from replication.certify.rounding import rounded, rounded_array, rounded_down, rounded_up
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant

Made = dict[str, Any]
FIRST_MARGIN, GROWTH = 1e-9, 100.0
"""Relative width of the bracket of alpha in the first pass, and its growth: errors of the periods add up."""
SLACK = 1e-3
"""Room in the state block of the bounded real lemma, relative to that width."""
BITS = 44
COARSE_BITS = 20
"""Of vectors, which need not be exact."""


def grid(theorem: Mapping[str, Any]) -> Made:
    """Bound and witness of the number of elements: brackets of alpha for each pass of the corrected Algorithm 1."""
    size, passes = _passes(*_problem(theorem))
    return {"bound": {"lower": str(size), "upper": str(size)}, "witness": {"passes": passes}}


def one_interval(theorem: Mapping[str, Any]) -> Made:
    """The same witness, without a bound."""
    return {**grid(theorem), "bound": {}}


def stall(theorem: Mapping[str, Any]) -> Made:
    """A bracket of alpha in the middle of the range."""
    system, periods = _problem(theorem)
    return {"bound": {}, "witness": _bracket(system, periods.middle, FIRST_MARGIN)[1]}


def same_level(theorem: Mapping[str, Any]) -> Made:
    """The cell with the largest alpha in the coordinates of the plant, and a robust filter with a lower level."""
    system, periods = _problem(theorem)
    count = theorem["parameters"]["cells"]
    half = (periods.h_u - periods.h_l) / (2 * count)
    alphas = [_response(system, periods.h_l + (2 * i + 1) * half) for i in range(count)]
    cell = int(np.argmax([alpha for alpha, _ in alphas]))
    alpha, response = alphas[cell]
    _, values, right = np.linalg.svd(delta_block(system, half))
    made = robust_upper({**theorem, "parameters": {"from": "h_l", "to": "h_u", "weight": "samples"}})
    witness = {
        "cell": cell,
        "alpha": rounded_down(alpha * (1 - FIRST_MARGIN), BITS),
        "response": response,
        "radius": rounded_down(float(values[0]) * (1 - FIRST_MARGIN), BITS),
        "direction": rounded_array(right[:1].T, COARSE_BITS),
    }
    return {"bound": {}, "witness": {**witness, "level": made["bound"]["upper"], **made["witness"]}}


def _problem(theorem: Mapping[str, Any]) -> tuple[SampledPlant, PeriodRange]:
    return problem_of(theorem["plant"], {"from": "h_l", "to": "h_u"})


def _passes(system: SampledPlant, periods: PeriodRange) -> tuple[int, list[list[Made]]]:
    """Elements, and the witnesses of each pass."""
    new, margin = [periods.middle], FIRST_MARGIN
    intervals, passes = [], []
    while new:
        brackets = [_bracket(system, h, margin) for h in new]
        passes.append([witness for _, witness in brackets])
        intervals += [covered_interval(system, h, alpha) for h, (alpha, _) in zip(new, brackets, strict=True)]
        new = [(a + b) / 2 for a, b in gaps(intervals, periods)]
        margin *= GROWTH
    return len(intervals), passes


def _bracket(system: SampledPlant, h: float, margin: float) -> tuple[float, Made]:
    """alpha at h, and the witness of a bracket of this relative half-width."""
    stage = _small_gain_stage(system, h)
    alpha, response = _response(system, h)
    P = lyapunov_matrices(PeriodicSystem((stage,)), alpha * (1 + margin / 2), margin * SLACK)[0]
    bracket = {"lower": rounded_down(alpha * (1 - margin), BITS), "upper": rounded_up(alpha * (1 + margin), BITS)}
    return alpha, {**bracket, "P": rounded_array(P, BITS), **response}


def _response(system: SampledPlant, h: float) -> tuple[float, Made]:
    """alpha at h, and the point of the circle and the direction where it is attained."""
    stage = _small_gain_stage(system, h)
    peak = l2_gain(PeriodicSystem((stage,)))
    _, _, right = np.linalg.svd(frequency_response(stage, peak.angle))
    direction = right[0].conj() / right[0].conj()[np.argmax(np.abs(right[0]))]
    return peak.lower, {
        "turn": rounded(float(np.tan(peak.angle / 2)), BITS),
        "direction": rounded_array(np.stack([direction.real, direction.imag], axis=1), COARSE_BITS),
    }


def _small_gain_stage(system: SampledPlant, h: float) -> Stage:
    """Sigma_11 at the constant period h."""
    Phi, _ = system.discretise(h)
    one = np.eye(system.order)
    return Stage(Phi, one, system.A @ Phi, np.zeros_like(one))
