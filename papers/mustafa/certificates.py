"""Makes the certificates of the wanted theorems of this paper; those of the small-gain condition (8) are its own."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import cvxpy
import numpy as np

from papers._common import Maker, certificate
from papers.mustafa.experiments.declared import EXPERIMENTS
from papers.mustafa.experiments.levels import Json
from papers.mustafa.method import (
    Interval,
    build_grid,
    covered_interval,
    delta_block,
    modal,
    modal_transform,
    passes,
    responses,
    uncertainty_channel,
)
from replication.certify import nonuniform, rounded, rounded_array, rounded_down, rounded_up
from replication.certify.multirate import lyapunov_matrices
from replication.estimation.conic.program import solve_modelled
from replication.estimation.linear.norms import hinf_norm, l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.nonuniform.filters import error_system
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods
from replication.estimation.validation import Array

Theorem = Mapping[str, Any]

BRACKETS = {"range": "bracket", "duration": "bracket-duration"}
"""Experiments whose bracket over a range the theorems of these names prove; with their effort."""
FIRST_MARGIN, GROWTH = 1e-9, 100.0
"""Relative width of the bracket of alpha in the first pass, and its growth: errors of the periods add up."""
SLACK = 1e-3
"""Room in the state block of the bounded real lemma, relative to that width."""
BITS = 44
ROOM, HORIZON = 1.02, 200
"""Level over that of step 2; samples of a sequence."""
ANGLES, SMALL = 400, 1e-7
"""Points of the circle; weights that are left out, relative to the largest."""
PIECES = 32
"""Of the range, each with a storage matrix of its own."""
COARSE_BITS = 20
"""Of vectors, which need not be exact."""


def gain_upper(theorem: Theorem) -> Json:
    """With the effort of the experiment that brackets the same gain."""
    return nonuniform.gain_upper(theorem, **_effort(theorem["name"], "leaves", "cuts"))


def gain_lower(theorem: Theorem) -> Json:
    """The same from below."""
    return nonuniform.gain_lower(theorem, **_effort(theorem["name"], "horizon", "final_horizon"))


def optimum_upper(theorem: Theorem) -> Json:
    """At one constant period, or over a range."""
    constant = theorem["parameters"]["from"] == theorem["parameters"]["to"]
    return nonuniform.nominal_upper(theorem) if constant else nonuniform.robust_upper(theorem)


def _effort(name: str, *keys: str) -> Json:
    """The wanted inputs of the experiment that brackets the same gain, as far as there is one, over a range."""
    kind, _, example = name.rpartition("-")[0].rpartition("-")
    bracket = f"{BRACKETS.get(kind)}.{example}"
    inputs = next((experiment.inputs for experiment in EXPERIMENTS if experiment.name == bracket), {})
    return {key: inputs[key] for key in keys if key in inputs}


def grid(theorem: Theorem) -> Json:
    """Bound and witness of the number of elements: brackets of alpha for each pass of the corrected Algorithm 1."""
    brackets = _passes(*_problem(theorem))
    size = str(sum(map(len, brackets)))
    return {"bound": {"lower": size, "upper": size}, "witness": {"passes": brackets}}


def stall(theorem: Theorem) -> Json:
    """A bracket of alpha in the middle of the range."""
    system, periods = _problem(theorem)
    return {"witness": _bracket(system, periods.middle, FIRST_MARGIN)}


def output_box(theorem: Theorem) -> Json:
    """For each side of the box of the C_f the half-space that cuts it, by a cone program over points of the circle."""
    system, periods = _problem(theorem)
    filter_, level = nonuniform.filter_of(theorem["plant"]["filter"]), float(Fraction(theorem["parameters"]["level"]))
    axes, turns = np.eye(system.order), np.tan(np.linspace(0, np.pi, ANGLES, endpoint=False) / 2)
    points = (1 + 1j * turns) / (1 - 1j * turns)
    F, G = responses(system, periods.middle, filter_, points)
    f, seen_of_plant = F[:, :, 0].T, G[:, 0, 0]

    def half_space(normal: Array) -> list[Json]:
        u = cvxpy.Variable(len(points), complex=True)
        limit = cvxpy.real(u @ seen_of_plant) + level * cvxpy.sum(cvxpy.abs(u))
        solve_modelled(cvxpy.Problem(cvxpy.Minimize(limit), [cvxpy.real(f @ u) == normal]))
        chosen = [(t, w) for t, w in zip(turns, u.value, strict=True) if abs(w) > SMALL * np.max(np.abs(u.value))]
        return [{"turn": rounded(t, BITS), "u": [rounded(w.real, BITS), rounded(w.imag, BITS)]} for t, w in chosen]

    witness = {name: [half_space(sign * axis) for axis in axes] for name, sign in (("above", 1), ("below", -1))}
    return {"witness": witness}


def grid_solution(theorem: Theorem) -> Json:
    """The filter of step 2 on the grid with a level a little above its own, a matrix for it, and a worst sequence."""
    system, periods = _problem(theorem)
    design = design_for_periods(system, list(build_grid(system, periods).periods))
    # In coordinates in which A_f is made of its eigenvalues, products of many steps stay exact.
    T, optimum = modal_transform(design.filter.A), design.filter
    moved = {"A": T @ optimum.A @ np.linalg.inv(T), "B": T @ optimum.B, "C": optimum.C @ np.linalg.inv(T)}
    filter_ = {name: rounded_array(matrix, BITS) for name, matrix in moved.items()}
    level = rounded_up(design.level * ROOM, BITS)
    stages = error_system(system, nonuniform.filter_of(filter_), design.periods).stages
    P = common_storage(stages, float(Fraction(level)))
    over = {"from": "h_l", "to": "h_u", "weight": "samples", "filter": filter_}
    attack = nonuniform.gain_lower({**theorem, "parameters": over}, horizon=HORIZON, final_horizon=HORIZON)
    witness = {"passes": _passes(system, periods), "level": level, "filter": filter_, "P": rounded_array(P, BITS)}
    return {"witness": {**witness, **attack["witness"]}}


def common_storage(stages: Sequence[Stage], level: float) -> Array:
    """One matrix P for which [P - C'C, 0; 0, g^2 I] - M'P M is largest, M = [A, B] of each of the stages."""
    n, m = stages[0].B.shape
    P, least = cvxpy.Variable((n, n), symmetric=True), cvxpy.Variable()
    supplied = np.zeros((n + m, n + m))
    supplied[n:, n:] = level**2 * np.eye(m)
    selector = np.eye(n, n + m)
    constraints = []
    for stage in stages:
        M, output = np.hstack([stage.A, stage.B]), np.hstack([stage.C, np.zeros((len(stage.C), m))])
        room = selector.T @ P @ selector + supplied - output.T @ output - M.T @ P @ M
        constraints.append((room + room.T) / 2 - least * np.eye(n + m) >> 0)
    solve_modelled(cvxpy.Problem(cvxpy.Maximize(least), constraints))
    return np.asarray(P.value)


def one_element(theorem: Theorem) -> Json:
    """A storage matrix for each piece of the range, at the end with the larger norm in (8), for a level below one."""
    system, periods = _problem(theorem)
    matrices = []
    for k in range(PIECES):
        share = (k if 2 * k < PIECES else k + 1) / PIECES
        change = periods.h_l + share * (periods.h_u - periods.h_l) - periods.middle
        channel = uncertainty_channel(system, periods.middle, delta_block(system, change))
        system_of_8 = PeriodicSystem((channel,))
        level = (1 + l2_gain(system_of_8).lower) / 2
        matrices.append(lyapunov_matrices(system_of_8, level, SLACK)[0])
    return {"witness": {"P": [rounded_array(P, BITS) for P in matrices]}}


def same_level(theorem: Theorem) -> Json:
    """The cell with the largest alpha in modal coordinates, and a robust filter with a lower level."""
    system, periods = _problem(theorem)
    system = modal(system)
    count = theorem["parameters"]["cells"]
    half = (periods.h_u - periods.h_l) / (2 * count)
    alphas = [_response(system, periods.h_l + (2 * i + 1) * half) for i in range(count)]
    cell = int(np.argmax([alpha for alpha, _ in alphas]))
    alpha, response = alphas[cell]
    _, values, right = np.linalg.svd(delta_block(system, half))
    design = nonuniform.robust_upper({**theorem, "parameters": {"from": "h_l", "to": "h_u", "weight": "samples"}})
    witness = {
        "cell": cell,
        "alpha": rounded_down(alpha * (1 - FIRST_MARGIN), BITS),
        "response": response,
        "radius": rounded_down(float(values[0]) * (1 - FIRST_MARGIN), BITS),
        "direction": rounded_array(right[:1].T, COARSE_BITS),
    }
    return {"witness": {**witness, "level": design["bound"]["upper"], **design["witness"]}}


def _problem(theorem: Theorem) -> tuple[SampledPlant, PeriodRange]:
    return nonuniform.problem_of(theorem["plant"], {"from": "h_l", "to": "h_u"})


def _passes(system: SampledPlant, periods: PeriodRange) -> list[list[Json]]:
    """The witnesses of each pass of the corrected Algorithm 1."""

    def covered(h: float) -> Interval:
        return covered_interval(system, h, _response(system, h)[0])

    whole = enumerate(passes(covered, periods))
    return [[_bracket(system, h, FIRST_MARGIN * GROWTH**number) for h in new] for number, new in whole]


def _bracket(system: SampledPlant, h: float, margin: float) -> Json:
    """The witness of a bracket of alpha at h, of this relative half-width."""
    alpha, response = _response(system, h)
    channel = PeriodicSystem((uncertainty_channel(system, h),))
    P = lyapunov_matrices(channel, alpha * (1 + margin / 2), margin * SLACK)[0]
    bracket = {"lower": rounded_down(alpha * (1 - margin), BITS), "upper": rounded_up(alpha * (1 + margin), BITS)}
    return {**bracket, "P": rounded_array(P, BITS), **response}


def _response(system: SampledPlant, h: float) -> tuple[float, Json]:
    """alpha at h, and the point of the circle and the direction where it is attained."""
    channel = uncertainty_channel(system, h)
    peak = hinf_norm(*channel)
    _, _, right = np.linalg.svd(frequency_response(channel, peak.angle))
    direction = right[0].conj() / right[0].conj()[np.argmax(np.abs(right[0]))]
    return peak.lower, {
        "turn": rounded(float(np.tan(peak.angle / 2)), BITS),
        "direction": rounded_array(np.stack([direction.real, direction.imag], axis=1), COARSE_BITS),
    }


MAKERS: Mapping[str, Maker] = {
    "gain-upper": gain_upper,
    "keeps-level": gain_upper,
    "gain-lower": gain_lower,
    "breaks-level": gain_lower,
    "optimum-upper": optimum_upper,
    "stamped-gain": partial(nonuniform.least_gain, horizon=HORIZON),
    "optimum-lower": nonuniform.optimum_lower,
    "no-filter-keeps-level": nonuniform.optimum_lower,
    "grid-size": grid,
    "one-interval": lambda theorem: {**grid(theorem), "bound": {}},
    "stalls": stall,
    "output-matrix": output_box,
    "grid-solution-fails": grid_solution,
    "meets-condition-8": one_element,
    "same-level": same_level,
}
make = partial(certificate, "mustafa", MAKERS)
"""The certificate of one entry of theorems.json."""
