"""Designs, norms and schedules behind Table 1, Cases A-C, the timing cases and the printed gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from papers.okajima2023.method.lmi import (
    LmiDesign,
    cyclic_size,
    lmi_analysis,
    lmi_design,
    reduced_lmi_design,
    theorem2_size,
)
from replication.audit.judge.printed import Parameters, spread
from replication.errors import InfeasibleError
from replication.estimation.linear.norms import GainBracket, l2_gain, white_noise_variance
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.optimum import Optimum, optimal_design, optimum, search_timing
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.nonuniform.plant import SampledPlant

Json = dict[str, Any]
Matrix = list[list[float]]


def build(plant: dict[str, Matrix], periods: list[int], offsets: list[int], sensors: list[int]) -> MultirateProblem:
    """The problem of `plant` seen by some of its sensors; noise of sensors that are left out is left out too."""
    C, D = np.array(plant["C"])[sensors], np.array(plant["D"])[np.ix_(sensors, sensors)]
    system = MultiratePlant(A=np.array(plant["A"]), B_d=np.array(plant["B_d"]), C=C, D=D)
    return MultirateProblem(system, SensingSchedule(tuple(periods), tuple(offsets)))


def optimum_json(best: Optimum) -> Json:
    """The optimum with its bracket and the non-causal bound."""
    return {
        "optimum": best.value,
        "lower": best.lower,
        "upper": best.upper,
        "limited_by": best.limited_by,
        "noncausal": bracket_json(best.noncausal),
    }


def bracket_json(gain: GainBracket) -> Json:
    """A gain with its bracket and the angle of the peak."""
    return {"value": gain.value, "lower": gain.lower, "upper": gain.upper, "angle": gain.angle}


INACCURATE = ("optimal", "optimal_inaccurate")
"""Theorem 1 is only a cross-check of the exact norm here: an inaccurate solution is shown with its status."""


def design(plant: dict[str, Matrix], periods: list[int], offsets: list[int], sensors: list[int]) -> Json:
    """Smallest achievable gain by Riccati and non-causal bound, by both LMIs, and the exact norms of all gains.

    filter: the smallest one of filters, which use the newest measurement too.
    """
    problem = build(plant, periods, offsets, sensors)
    best = optimum(problem)
    central, reduced, printed = optimal_design(problem), reduced_lmi_design(problem), lmi_design(problem)
    variables, rows = theorem2_size(problem)
    cyclic_variables, cyclic_rows = cyclic_size(problem)
    return {
        **optimum_json(best),
        "filter": optimum(of_filters(problem)).value,
        "gains": central.gains.tolist(),
        "norm_central": bracket_json(l2_gain(problem.error_system(central.gains))),
        "reduced_lmi": _lmi(problem, reduced),
        "lmi": _lmi(problem, printed),
        "smallest_eigenvalue_P": float(min(np.linalg.eigvalsh(P)[0] for P in printed.P)),
        "h2_central": float(np.sqrt(white_noise_variance(problem.error_system(central.gains)))),
        "h2_kalman": float(np.sqrt(white_noise_variance(problem.error_system(kalman_design(problem).gains)))),
        "norm_kalman": l2_gain(problem.error_system(kalman_design(problem).gains)).value,
        "size": {
            "variables": variables,
            "rows": rows,
            "cyclic_variables": cyclic_variables,
            "cyclic_rows": cyclic_rows,
        },
        "acting_variables": problem.schedule.period * (problem.plant.order * (problem.plant.order + 1) // 2)
        + problem.plant.order * int(problem.schedule.mask.sum())
        + 1,
        "solvers": [reduced.report.to_dict(), printed.report.to_dict()],
    }


def of_filters(problem: MultirateProblem) -> MultirateProblem:
    """The same problem for filters, which use y(k) for the state at k: that of predicting a state kept one instant."""
    plant, n = problem.plant, problem.plant.order
    kept = MultiratePlant(
        A=np.block([[plant.A, np.zeros((n, n))], [np.eye(n), np.zeros((n, n))]]),
        B_d=np.vstack([plant.B_d, np.zeros_like(plant.B_d)]),
        C=np.hstack([plant.C, np.zeros_like(plant.C)]),
        D=plant.D,
        W=np.hstack([np.zeros_like(plant.W), plant.W]),
    )
    return MultirateProblem(kept, problem.schedule)


def constant_matrix(
    plant: dict[str, Matrix], periods: list[int], offsets: list[int], analysed: Mapping[str, Json]
) -> Json:
    """Levels if all P_k must be one matrix, beside those with P_k of their own.

    Theorem 1 for the gains of each entry of `analysed` (periods, offsets, sensors, gains), None where one P does not
    exist, with the largest spectral radius of any A_ek alone; and one design by Theorem 2.
    """
    problem = build(plant, periods, offsets, list(range(len(plant["C"]))))
    constant, periodic = lmi_design(problem, one_matrix=True), lmi_design(problem)
    analyses: Json = {}
    for name, case in analysed.items():
        seen, gains = build(plant, case["periods"], case["offsets"], case["sensors"]), np.array(case["gains"])
        own = lmi_analysis(seen, gains, accept=INACCURATE)
        try:
            one = lmi_analysis(seen, gains, one_matrix=True, accept=INACCURATE)
        except InfeasibleError:
            one = None
        system = seen.error_system(gains)
        analyses[name] = {
            "constant": None if one is None else one.level,
            "periodic": own.level,
            # One P for all instants makes each A_ek alone stable.
            "largest_radius": float(max(np.abs(np.linalg.eigvals(stage.A)).max() for stage in system.stages)),
            "solvers": [found.report.to_dict() for found in (one, own) if found is not None],
        }
    return {
        "constant": constant.level,
        "norm_constant": l2_gain(problem.error_system(constant.gains)).value,
        "periodic": periodic.level,
        "analyses": analyses,
        "solvers": [constant.report.to_dict(), periodic.report.to_dict()],
    }


def norm_of_gains(
    plant: dict[str, Matrix], periods: list[int], offsets: list[int], gains: list[Matrix], rounding: float
) -> Json:
    """Exact norm that given gains achieve, what Theorem 1 certifies for them, and how far over the optimum they are.

    rounding: half a unit in the last place of the gains; `rounding_spread` is the linearised effect of all roundings.
    """
    problem = build(plant, periods, offsets, list(range(len(plant["C"]))))
    L = np.array(gains)
    system = problem.error_system(L)
    exact = l2_gain(system)
    analysis = lmi_analysis(problem, L, accept=INACCURATE)
    return {
        "norm": bracket_json(exact),
        "optimum": optimum(problem).value,
        "theorem1": analysis.level,
        "spectral_radius": system.spectral_radius(),
        "rounding_spread": _rounding_spread(problem, L, rounding),
        "solvers": [analysis.report.to_dict()],
    }


def selections(periods: list[int], offsets: list[int]) -> Json:
    """The diagonals of S_0 ... S_{N-1}, eq. (4), one row per phase: sensor i measures every N_i instants."""
    schedule = SensingSchedule(tuple(periods), tuple(offsets))
    return {"period": schedule.period, "diagonals": schedule.mask.astype(float).tolist()}


def period_row(plant: dict[str, Matrix], first: int, largest: int) -> Json:
    """Smallest achievable gain for N_1 = first, N_2 = 1 ... largest, sensors at instant 0 and with the best offsets."""
    system = build(plant, [1, 1], [0, 0], [0, 1]).plant
    cells = []
    for second in range(1, largest + 1):
        search = search_timing(system, (first, second))
        best = search.optima[search.best]
        cells.append(
            {
                "periods": [first, second],
                "synchronous": optimum_json(search.synchronous),
                "best": optimum_json(best),
                "best_offset": search.best[1],
                "by_offset": [search.optima[offsets].value for offsets in sorted(search.optima)],
            }
        )
    return {"cells": cells}


def rounded_levels(plant: Mapping[str, str], designs: list[Json]) -> Json:
    """The optimum of each of `designs` (periods, offsets, sensors, claims) while printed entries of the plant move.

    They move within their rounding, one at a time; returns what `spread` does.
    """

    def compute(parameters: Parameters) -> dict[str, float]:
        found: dict[str, float] = {}
        for entry in designs:
            problem = build(dict(parameters), entry["periods"], entry["offsets"], entry["sensors"])
            found |= dict.fromkeys(entry["claims"], optimum(problem).value)
        return found

    return spread(plant, compute)


def _rounding_spread(problem: MultirateProblem, gains: np.ndarray[Any, Any], half_unit: float) -> float:
    """Sum over the measured entries of |d norm / d entry| times half a unit, by central differences."""
    step = 1e-6
    total = 0.0
    for k, rows in enumerate(problem.measured_rows()):
        for i in range(problem.plant.order):
            for j in rows:
                shifted = []
                for sign in (1.0, -1.0):
                    moved = gains.copy()
                    moved[k, i, j] += sign * step
                    shifted.append(l2_gain(problem.error_system(moved)).value)
                total += abs(shifted[0] - shifted[1]) / (2 * step) * half_unit
    return float(total)


def _lmi(problem: MultirateProblem, solution: LmiDesign) -> Json:
    return {"level": solution.level, "norm": l2_gain(problem.error_system(solution.gains)).value}


# A slow and a late sensor on the common plant: the optimum over all observers


SLOW = "slow: one measurement every m steps"
LATE = "late, in discrete time: each measurement arrives m − 1 steps late; our extension, by added states"


def on_common_plant(plant: dict[str, Any], multiples: list[int]) -> dict[str, Any]:
    """Brackets of the least l2 gain from force and noise to the position's error, for each multiple m."""
    sampled = _sampled(plant)
    return {
        "slow": [_bracket(sampled, period) for period in multiples],
        "late": [_bracket(_delayed(sampled, m - 1), 1) for m in multiples],
    }


def _bracket(plant: MultiratePlant, period: int) -> list[float]:
    best = optimum(MultirateProblem(plant, SensingSchedule((period,))))
    return [best.lower, best.upper]


def _sampled(plant: dict[str, Any]) -> MultiratePlant:
    """The plant at the base period, the force held in between; the error of the position counts."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    held = SampledPlant(A, B, C, np.zeros((1, 1)), C)
    Phi, Gamma = held.discretise(plant["h"])
    return MultiratePlant(A=Phi, B_d=Gamma, C=C, D=np.array([[plant["noise"]]]), W=C)


def _delayed(plant: MultiratePlant, instants: int) -> MultiratePlant:
    """`plant` with a chain of states that hands each position over to the sensor after `instants`."""
    if instants == 0:
        return plant
    n = plant.order
    A = np.zeros((n + instants, n + instants))
    A[:n, :n] = plant.A
    A[n : n + 1, :n] = plant.C
    A[n + 1 :, n:-1] = np.eye(instants - 1)
    B_d = np.vstack([plant.B_d, np.zeros((instants, 1))])
    C = np.zeros((1, n + instants))
    C[0, -1] = 1.0
    W = np.hstack([plant.W, np.zeros((1, instants))])
    return MultiratePlant(A=A, B_d=B_d, C=C, D=plant.D, W=W)
