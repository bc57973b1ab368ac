"""Nominal optimum, small-gain grids, true worst case, robust designs, draws of Figs. 2 and 3. JSON in, JSON out."""

from collections.abc import Callable, Mapping
from itertools import chain, pairwise
from typing import Any

import numpy as np

from papers.mustafa import method
from replication.audit.judge.printed import Parameters, spread
from replication.estimation import nonuniform
from replication.estimation.nonuniform.filters import Filter, closed_form, periodic_gain, riccati_filter, riccati_level
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.plant import DurationPlant, PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import design_for_periods, robust_design
from replication.estimation.nonuniform.worst_case import error_ratio, worst_case_gain
from replication.estimation.validation import Array

Json = dict[str, Any]
Matrices = dict[str, list[list[float]]]

ABOVE = 1e-8
"""Relative distance from gamma* at which the nominal filter of Example 1 is taken; gamma* itself is a limit."""
DIRECTIONS = 48
"""Half-planes in place of a disc."""


def problem(plant: Matrices, periods: list[float]) -> tuple[SampledPlant, PeriodRange]:
    """Plant and range from JSON values."""
    return SampledPlant(**{name: np.array(value) for name, value in plant.items()}), PeriodRange(*periods)


def subject(plant: SampledPlant, periods: PeriodRange, printed: Matrices | None) -> Filter:
    """The printed filter, or where none is printed the nominally optimal one at the middle of the range."""
    if printed is not None:
        return Filter(np.array(printed["A"]), np.array(printed["B"]), np.array(printed["C"]))
    design = riccati_filter(plant, periods.middle, closed_form(plant, periods.middle) * (1 + ABOVE))
    assert design is not None
    return design.filter


def nominal(plant: Matrices, periods: list[float]) -> Json:
    """gamma* at the middle of the range by formula, Riccati and LMI (two modellers); exact norms of their filters."""
    system, span = problem(plant, periods)
    h = span.middle
    riccati = riccati_level(system, h)
    direct, printed = design_for_periods(system, [h]), method.printed_design(system, [h])
    return {
        "formula": closed_form(system, h),
        "riccati": riccati.level,
        "lmi": {
            "level": direct.level,
            "norm": periodic_gain(system, direct.filter, [h]).value,
            "status": direct.report.status,
        },
        "printed_lmi": printed.level,
        "Phi": system.discretise(h)[0].tolist(),
        "solvers": [direct.report.to_dict(), printed.report.to_dict()],
    }


def output_matrix(plant: Matrices, periods: list[float], printed: Matrices, level: float, angles: int) -> Json:
    """The C_f that keep `level` at the middle of the range with the printed A_f and B_f: a box that holds them all.

    With F the response of the filter's state at a point of the circle, |L G - C_f F| <= level there. Each such disc is
    relaxed to as many half-planes as there are points, so the box is an outer one. best: the C_f of the least level of
    the relaxed problem.
    """
    from scipy.optimize import linprog  # slow to load

    system, span = problem(plant, periods)
    points = np.exp(1j * np.linspace(0, np.pi, angles))
    F, G = method.responses(system, span.middle, subject(system, span, printed), points)
    axes, turns = np.eye(F.shape[1]), np.exp(2j * np.pi * np.arange(DIRECTIONS) / DIRECTIONS)
    half_planes = -(turns[:, None] * F.mT).real.reshape(-1, len(axes))
    offsets = -(turns * G[:, 0]).real.ravel()
    free = {"bounds": (None, None), "method": "highs"}
    box = [
        sign * linprog(sign * row, A_ub=half_planes, b_ub=level + offsets, **free).fun
        for sign in (1, -1)
        for row in axes
    ]
    bordered = np.hstack([half_planes, -np.ones((len(offsets), 1))])
    best = linprog([*np.zeros(len(axes)), 1.0], A_ub=bordered, b_ub=offsets, **free).x
    return {"lower": box[: len(axes)], "upper": box[len(axes) :], "best": best[:-1].tolist(), "least": float(best[-1])}


def grids(plant: Matrices, periods: list[float], limit: int) -> Json:
    """alpha, the intervals (9) around the middle for alpha and its root and both readings of U3, and Algorithm 1."""
    system, span = problem(plant, periods)
    alpha = method.small_gain_alpha(system, span.middle)
    intervals = {}
    for upper in method.UpperEnd:
        for name, gain in (("alpha", alpha), ("root", float(np.sqrt(alpha)))):
            interval = method.covered_interval(system, span.middle, gain, upper)
            covers = interval.lower < span.h_l and span.h_u < interval.upper
            intervals[f"{upper}, {name}"] = {**interval._asdict(), "covers": covers}
    forms = (*chain.from_iterable(method.AS_PRINTED.values()), method.CORRECT)
    runs = {form.name: method.build_grid(system, span, form, limit=limit) for form in forms}
    return {
        "alpha": alpha,
        "mu": method.logarithmic_norm(system.A),
        "mu_minus": method.logarithmic_norm(-system.A),
        "intervals": intervals,
        "algorithm": {
            name: {"end": grid.end, "size": len(grid.periods), "rounds": grid.rounds} for name, grid in runs.items()
        },
    }


def bracket(
    plant: Matrices, periods: list[float], printed: Matrices | None, leaves: int, *, per_duration: bool, **effort: Any
) -> Json:
    """The worst-case gain of the printed filter, or of ours, from both sides, its stability, its norm at the middle.

    per_duration: norms over time. effort: as in `worst_case_gain`.
    """
    system, span = problem(plant, periods)
    filter_ = subject(system, span, printed)
    measured = DurationPlant(**vars(system)) if per_duration else system
    gain = worst_case_gain(measured, filter_, span, max_leaves=leaves, **effort)
    guarantee, attack = gain.guarantee, gain.attack
    return {
        "nominal": periodic_gain(system, filter_, [span.middle]).value,
        "plant_abscissa": float(np.max(np.linalg.eigvals(system.A).real)),
        "filter_radius": filter_.spectral_radius(),
        "lower": gain.lower,
        "upper": gain.upper,
        "periods": attack.periods.tolist(),
        "w": attack.w[:, 0].tolist(),
        "e": attack.e[:, 0].tolist(),
        "leaves": guarantee.leaves,
        "common": guaranteed_level(measured, filter_, span, max_leaves=1).level,
        "solvers": [guarantee.report.to_dict()],
    }


def level_curve(plant: Matrices, periods: list[float], printed: Matrices | None, nodes: int, level: float) -> Json:
    """gamma*(h) by formula where there is one, the norm of the printed filter, or of ours, at h, the constant periods
    around the middle at which that norm is at most `level`, and the floor for any filter."""
    system, span = problem(plant, periods)
    filter_ = subject(system, span, printed)
    h = span.nodes(nodes)
    # The infeasible end of the search for gamma*(h) at a constant period bounds the level of every filter from below.
    upper_half = PeriodRange(span.middle, span.h_u).nodes(3).tolist()
    floor, where = max((riccati_level(system, node, tolerance=1e-8).infeasible, node) for node in upper_half)

    def norm(period: float) -> float:
        return periodic_gain(system, filter_, [period]).value

    return {
        "h": h.tolist(),
        "optimum": [closed_form(system, float(t)) for t in h],
        "filter": [norm(float(t)) for t in h],
        "holds_from": crossing(norm, [span.middle, *h[h < span.middle][::-1].tolist()], level),
        "holds_to": crossing(norm, [span.middle, *h[h > span.middle].tolist()], level),
        "middle": span.middle,
        "floor": floor,
        "floor_at": where,
    }


def crossing(norm: Callable[[float], float], outward: list[float], level: float) -> float:
    """The period at which the norm first exceeds `level` on the way outward, seen at those nodes; else the last."""
    from scipy.optimize import brentq  # slow to load

    for near, far in pairwise(outward):
        if norm(far) > level:
            return float(brentq(lambda h: norm(h) - level, near, far, xtol=1e-9))
    return outward[-1]


def robust(plant: Matrices, periods: list[float], cells: int) -> Json:
    """Robust designs: one Lyapunov function, and the reconstructed LMI (13)."""
    system, span = problem(plant, periods)
    exchanged, restored = robust_design(system, span), method.robust_lmi_design(system, span, cells)
    modal = method.modal(system)
    alpha = max(method.small_gain_alpha(modal, h) for h in restored.periods)
    cell, whole = (method.delta_radius(modal.A, (span.h_u - span.h_l) / count / 2) for count in (cells, 1))
    common = guaranteed_level(system, exchanged.design.filter, span, max_leaves=1)
    return {
        "guaranteed": common.level,
        "lmi13": restored.level,
        "lmi13_alpha": alpha,
        "lmi13_small_gain": alpha * cell,
        "one_cell_small_gain": method.small_gain_alpha(modal, span.middle) * whole,
        "solvers": [exchanged.design.report.to_dict(), restored.report.to_dict()],
    }


def against_range(plant: Matrices, h_l: float, ends: list[float], horizon: int, leaves: int) -> Json:
    """The bracket for [h_l, h_u] with the filter that is nominally optimal at the middle of the last range."""
    system, whole = problem(plant, [h_l, ends[-1]])
    filter_ = subject(system, whole, None)
    rows = []
    for end in ends:
        gain = worst_case_gain(
            system, filter_, PeriodRange(h_l, end), horizon=horizon, final_horizon=2 * horizon, max_leaves=leaves
        )
        rows.append([end, gain.lower, gain.upper])
    return {"rows": rows}


# The common plant under irregular sampling


IRREGULAR = (
    "irregular, not optimal: gaps of 1 to m steps between measurements; a cautious design of ours by (10), with one "
    "Lyapunov function for all gaps"
)


def on_common_plant(plant: dict[str, Any], multiples: list[int], leaves: int, horizon: int) -> list[list[float]]:
    """Bracket of the gain of the robust design over all sequences of periods in [h, m h], for each multiple m."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    system = SampledPlant(A, np.hstack([B, 0 * B]), C, np.array([[0.0, plant["noise"]]]), C)
    h, brackets = plant["h"], []
    for m in multiples:
        if m == 1:
            brackets.append([riccati_level(system, h).level] * 2)
        else:
            gain = nonuniform.design(system, periods=(h, m * h), leaves=leaves, horizon=horizon).bracket
            brackets.append([gain.lower, gain.upper])
    return brackets


# How far the nominal levels move with printed parameters within their rounding


def nominal_level(prints: Mapping[str, str], h_u: float, claim: str) -> dict[str, Any]:
    """The nominal optimum at the middle of [h_l, h_u]; prints: A, B, C, D, L and h_l."""

    def compute(numbers: Parameters) -> dict[str, float]:
        plant = SampledPlant(*(np.atleast_2d(numbers[name]) for name in "ABCDL"))
        return {claim: closed_form(plant, (numbers["h_l"] + h_u) / 2)}

    return spread(prints, compute)


def filter_norm(prints: Mapping[str, str], plant: dict[str, Any], claim: str) -> dict[str, Any]:
    """The norm of the printed filter at the printed period; prints: A_f, B_f, C_f and h."""
    sampled = SampledPlant(*(np.array(plant[name]) for name in "ABCDL"))

    def compute(numbers: Parameters) -> dict[str, float]:
        printed = Filter(*(np.array(numbers[name]) for name in ("A_f", "B_f", "C_f")))
        return {claim: periodic_gain(sampled, printed, [numbers["h"]]).value}

    return spread(prints, compute)


HELD = 25
"""Samples for which a period is held under the last law."""
LAWS = {
    "uniform": "independent and uniform",
    "at the ends": "independent, and each one of both ends with equal probability",
    "held": f"uniform, and each draw is held for {HELD} samples",
}
"""Laws of the sampling periods in words; the text states none."""


def draws(seeds: int, seed: int, **setting: Any) -> Json:
    """||e|| / ||w|| of the printed filter for the disturbance of the text over `seeds` sequences of uniform random
    periods, the band of their errors, and the first of them; setting: what `_setting` takes."""
    system, span, filter_, w = _setting(**setting)
    steps = len(w)
    sequences = np.random.default_rng(seed).uniform(span.h_l, span.h_u, (seeds, steps))
    errors = filter_.errors(system, sequences, w)[..., 0]
    return {
        "k": list(range(steps)),
        "w": w[:, 0].tolist(),
        "e": errors[0, :steps].tolist(),
        "periods": sequences[0].tolist(),
        "band_low": errors.min(axis=0)[:steps].tolist(),
        "band_high": errors.max(axis=0)[:steps].tolist(),
        "ratios": [error_ratio(system, h, w, e[:, None]) for h, e in zip(sequences, errors, strict=True)],
    }


def laws(seeds: int, seed: int, **setting: Any) -> Json:
    """||e|| / ||w|| of the printed filter for `seeds` sequences under each law, and ||z|| / ||w||, which the error has
    with no filter; setting: what `_setting` takes."""
    system, span, filter_, w = _setting(**setting)
    # One simulation gives both: the error of the estimate, and that of the estimate zero.
    both = SampledPlant(system.A, system.B, system.C, system.D, np.vstack([system.L, system.L]))
    beside = Filter(filter_.A, filter_.B, np.vstack([filter_.C, 0 * filter_.C]))
    rng = np.random.default_rng(seed)
    ratios: Json = {}
    for law in LAWS:
        sequences = np.array([_sequence(law, span, len(w), rng) for _ in range(seeds)])
        halves = np.split(beside.errors(both, sequences, w), 2, axis=-1)
        ratios[law] = {
            name: [error_ratio(system, h, w, e) for h, e in zip(sequences, errors, strict=True)]
            for name, errors in zip(("filter", "none"), halves, strict=True)
        }
    return ratios


def _setting(
    plant: Matrices, periods: list[float], printed: Matrices, steps: int, size: float, decay: float, frequency: float
) -> tuple[SampledPlant, PeriodRange, Filter, Array]:
    """Plant, range, printed filter, and w_k = size exp(-decay k) sin(frequency pi k) as a column."""
    system, span = problem(plant, periods)
    k = np.arange(steps)
    w = np.asarray((size * np.exp(-decay * k) * np.sin(frequency * np.pi * k))[:, None])
    return system, span, subject(system, span, printed), w


def _sequence(law: str, span: PeriodRange, steps: int, rng: np.random.Generator) -> Array:
    if law == "at the ends":
        return rng.choice([span.h_l, span.h_u], steps)
    if law == "held":
        return np.repeat(rng.uniform(span.h_l, span.h_u, -(-steps // HELD)), HELD)[:steps]
    return rng.uniform(span.h_l, span.h_u, steps)
