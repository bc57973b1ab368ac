"""Condition (8) evaluated directly, the ends of (9) by quadrature, and the filter of the corrected algorithm's grid."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from papers.mustafa import method
from papers.mustafa.experiments.levels import Json, Matrices, crossing, problem
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.nonuniform.filters import periodic_gain, riccati_filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods
from replication.estimation.nonuniform.worst_case import worst_case_gain

LeftSide = Callable[[float, float], float]
"""The left side of (8) for an element h_0, at a period."""


def condition(plant: Matrices, periods: list[float], nodes: int, centres: int) -> Json:
    """The left side of (8) with the middle of the range for h_0, largest over `nodes` periods of the range.

    constant: for each change held constant, in the coordinates of the plant. modal: for every sequence of changes, in
    modal coordinates; no coordinates have less for constant changes. Each with a bound between the nodes.
    best: the least value of modal over `centres` other h_0. elements: of a grid whose elements cover what
    (8) covers, for constant changes; modal_elements: for every sequence, in modal coordinates. ends: those of (9), with
    what their proof bounds there.
    """
    system, span = problem(plant, periods)
    h, h_0, half = span.nodes(nodes), span.middle, (span.h_u - span.h_l) / (nodes - 1) / 2
    constant = [_left_side(system, h_0, float(t)) for t in h]
    # d/dh Delta = e^{theta A}, so (8) grows by at most alpha |e^{theta A}| <= alpha e^{mu(-A)|theta|} a second.
    steepest = np.exp(
        max(method.logarithmic_norm(system.A), method.logarithmic_norm(-system.A)) * (span.h_u - span.h_l) / 2
    )
    rates = np.linalg.eigvals(system.A)
    modal = _modal(rates, np.array([h_0]), h)[0]
    steep = np.abs(rates) * np.exp(rates.real * span.h_l) / (1 - np.exp(rates.real * h_0))
    return {
        "constant": max(constant),
        "constant_at": float(h[int(np.argmax(constant))]),
        "constant_bound": max(constant) + method.small_gain_alpha(system, h_0) * float(steepest) * half,
        "modal": float(np.max(modal)),
        "modal_bound": float(np.max(modal) + np.max(steep) * half),
        "best": float(np.min(np.max(_modal(rates, span.nodes(centres), h), axis=1))),
        "elements": _elements(partial(_left_side, system), span),
        "modal_elements": _elements(lambda h_0, t: float(_modal(rates, np.array([h_0]), np.array([t]))[0, 0]), span),
        "ends": _ends(system, h_0),
    }


def _left_side(plant: SampledPlant, h_0: float, h: float) -> float:
    """||Sigma_11 Delta(h - h_0)||_inf for a change that is held constant."""
    return hinf_norm(*method.uncertainty_channel(plant, h_0, method.delta_block(plant, h - h_0))).value


def _modal(rates: Any, centres: Any, h: Any) -> Any:
    """max_i |e^{a_i h} - e^{a_i h_0}| / (1 - |e^{a_i h_0}|) over eigenvalues a_i of A, of shape (centres, periods).

    In modal coordinates Sigma_11 and Delta are diagonal, so the gain of their product is that of its largest entry.
    """
    start, stop = np.exp(np.outer(centres, rates)), np.exp(np.outer(h, rates))
    return np.max(np.abs(stop[None] - start[:, None]) / (1 - np.abs(start[:, None])), axis=2)


def _elements(left_side: LeftSide, span: PeriodRange) -> int:
    """Elements of Algorithm 1 if each covers the periods around it at which the left side of (8) is below one."""
    return sum(map(len, method.passes(partial(_around, left_side, span), span)))


def _around(left_side: LeftSide, span: PeriodRange, h_0: float) -> method.Interval:
    """Where (8) holds around h_0, seen at 33 periods of each side; just beyond the range if on all of it."""
    beyond, of_h = 1e-9, partial(left_side, h_0)
    ends = (np.linspace(h_0, end, 33).tolist() for end in (span.h_l - beyond, span.h_u + beyond))
    return method.Interval(*(crossing(of_h, outward, 1.0) for outward in ends))


def _ends(plant: SampledPlant, h_0: float) -> Json:
    """For each end of (9): alpha times what Lemma 3 bounds |Delta| by there.

    The bound is the integral of e^{mu t} by quadrature; size: alpha |Delta| itself, from the matrix exponential.
    """
    from scipy.integrate import quad  # slow to load

    alpha, ends = method.small_gain_alpha(plant, h_0), {}
    for name, sign, reading in (
        ("lower", -1, method.UpperEnd.CORRECTED),
        ("upper, printed", 1, method.UpperEnd.PRINTED),
        ("upper, corrected", 1, method.UpperEnd.CORRECTED),
    ):
        interval = method.covered_interval(plant, h_0, alpha, reading)
        reach = h_0 - interval.lower if sign < 0 else interval.upper - h_0
        mu = method.logarithmic_norm(sign * plant.A)
        ends[name] = {
            "bound": alpha * float(quad(lambda t, mu=mu: np.exp(mu * t), 0.0, reach, epsabs=0.0, epsrel=1e-13)[0]),
            "size": alpha * float(np.linalg.norm(method.delta_block(plant, sign * reach), 2)),
        }
    return ends


def loosest(plant: Matrices, periods: list[float], level: float, leaves: int, **effort: Any) -> Json:
    """The gain over all sequences of the central filter at a level for the middle of the range: a bracket.

    effort: as in `worst_case_gain`.
    """
    system, span = problem(plant, periods)
    design = riccati_filter(system, span.middle, level)
    assert design is not None
    bracket = worst_case_gain(system, design.filter, span, max_leaves=leaves, **effort)
    return {"lower": bracket.lower, "upper": bracket.upper}


def own_grid(plant: Matrices, periods: list[float], nodes: int, leaves: int, **effort: Any) -> Json:
    """The corrected algorithm: its grid, the level of step 2 on it, what its filter has at constant periods and over
    all sequences.

    largest: the gain at the worst of `nodes` constant periods. lower, upper: a bracket of the gain over all sequences.
    """
    system, span = problem(plant, periods)
    grid = list(method.build_grid(system, span).periods)
    design, again = design_for_periods(system, grid), method.printed_design(system, grid)
    gains = {h: periodic_gain(system, design.filter, [h]).value for h in (*grid, *span.nodes(nodes).tolist())}
    worst = max(span.nodes(nodes).tolist(), key=gains.__getitem__)
    bracket = worst_case_gain(system, design.filter, span, max_leaves=leaves, **effort)
    return {
        "periods": grid,
        "level": design.level,
        "level_again": again.level,
        "at_elements": max(gains[h] for h in grid),
        "largest": gains[worst],
        "largest_at": worst,
        "lower": bracket.lower,
        "upper": bracket.upper,
        "solvers": [design.report.to_dict(), again.report.to_dict()],
    }
