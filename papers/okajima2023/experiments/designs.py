"""Designs, norms and schedules behind Table 1, Cases A-C, the timing cases and the printed gains."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from papers.okajima2023.method.lmi import LmiDesign, lmi_analysis, lmi_design, reduced_lmi_design, theorem2_size
from replication.audit.judge.printed import Parameters, spread
from replication.errors import InfeasibleError
from replication.estimation.linear.norms import l2_gain, white_noise_variance
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.latency import delivered
from replication.estimation.multirate.optimum import Optimum, optimal_design, optimum, search_timing
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.nonuniform.plant import SampledPlant
from replication.estimation.validation import Array

Json = dict[str, Any]
Matrix = list[list[float]]


def build(plant: dict[str, Matrix], periods: list[int], offsets: list[int], sensors: list[int]) -> MultirateProblem:
    """The problem of `plant` seen by some of its sensors; noise of sensors that are left out is left out too."""
    C, D = np.array(plant["C"])[sensors], np.array(plant["D"])[np.ix_(sensors, sensors)]
    system = MultiratePlant(A=np.array(plant["A"]), B_d=np.array(plant["B_d"]), C=C, D=D)
    return MultirateProblem(system, SensingSchedule(tuple(periods), tuple(offsets)))


def optimum_json(best: Optimum) -> Json:
    """The optimum with its bracket and the non-causal bound."""
    ends = {"lower": best.lower, "upper": best.upper}
    return {"optimum": best.value, **ends, "limited_by": best.limited_by, "noncausal": best.noncausal.value}


INACCURATE = ("optimal", "optimal_inaccurate")
"""Theorem 1 is only a cross-check of the exact norm here: an inaccurate solution is shown with its status."""


def design(plant: dict[str, Matrix], periods: list[int], offsets: list[int], sensors: list[int]) -> Json:
    """Smallest achievable gain by Riccati and non-causal bound, by both LMIs, and the exact norms of all gains.

    filter: the smallest one of filters, which use the newest measurement too.
    """
    problem = build(plant, periods, offsets, sensors)
    central, kalman = (problem.error_system(method(problem).gains) for method in (optimal_design, kalman_design))
    reduced, printed, n = reduced_lmi_design(problem), lmi_design(problem), problem.plant.order
    (variables, rows), (cyclic_variables, cyclic_rows) = (theorem2_size(problem, cyclic) for cyclic in (False, True))
    acting = problem.schedule.period * (n * (n + 1) // 2) + n * int(problem.schedule.mask.sum()) + 1
    size = {"cyclic_variables": cyclic_variables, "cyclic_rows": cyclic_rows}
    return {
        **optimum_json(optimum(problem)),
        "filter": optimum(of_filters(problem)).value,
        "gains": optimal_design(problem).gains.tolist(),
        "norm_central": l2_gain(central).value,
        "reduced_lmi": _lmi(problem, reduced),
        "lmi": _lmi(problem, printed),
        "smallest_eigenvalue_P": float(min(np.linalg.eigvalsh(P)[0] for P in printed.P)),
        "h2_central": float(np.sqrt(white_noise_variance(central))),
        "h2_kalman": float(np.sqrt(white_noise_variance(kalman))),
        "norm_kalman": l2_gain(kalman).value,
        "size": {"variables": variables, "rows": rows, **size},
        "acting_variables": acting,
        "solvers": [reduced.report.to_dict(), printed.report.to_dict()],
    }


def of_filters(problem: MultirateProblem) -> MultirateProblem:
    """The same problem for filters, which use y(k) for the state at k: that of predicting a state kept one instant."""
    plant, n = problem.plant, problem.plant.order
    extension = MultiratePlant(
        A=np.block([[plant.A, np.zeros((n, n))], [np.eye(n), np.zeros((n, n))]]),
        B_d=np.vstack([plant.B_d, np.zeros_like(plant.B_d)]),
        C=np.hstack([plant.C, np.zeros_like(plant.C)]),
        D=plant.D,
        W=np.hstack([np.zeros_like(plant.W), plant.W]),
    )
    return MultirateProblem(extension, problem.schedule)


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
        setting, gains = build(plant, case["periods"], case["offsets"], case["sensors"]), np.array(case["gains"])
        by_instant = lmi_analysis(setting, gains, accept=INACCURATE)
        try:
            single = lmi_analysis(setting, gains, one_matrix=True, accept=INACCURATE)
        except InfeasibleError:
            single = None
        radii = [np.abs(np.linalg.eigvals(stage.A)).max() for stage in setting.error_system(gains).stages]
        analyses[name] = {
            "constant": None if single is None else single.level,
            "periodic": by_instant.level,
            # One P for all instants makes each A_ek alone stable.
            "largest_radius": float(max(radii)),
            "solvers": [analysis.report.to_dict() for analysis in (single, by_instant) if analysis is not None],
        }
    return {
        "constant": constant.level,
        "norm_constant": l2_gain(problem.error_system(constant.gains)).value,
        "periodic": periodic.level,
        "analyses": analyses,
    }


def norm_of_gains(
    plant: dict[str, Matrix], periods: list[int], offsets: list[int], gains: list[Matrix], rounding: float
) -> Json:
    """Exact norm that given gains achieve, what Theorem 1 certifies for them, and how far over the optimum they are.

    rounding: half a unit in the last place of the gains; `rounding_spread` is the linearised effect of all roundings.
    """
    problem, L = build(plant, periods, offsets, list(range(len(plant["C"])))), np.array(gains)
    system, analysis = problem.error_system(L), lmi_analysis(problem, L, accept=INACCURATE)
    exact = l2_gain(system)
    return {
        "norm": {"value": exact.value, "lower": exact.lower, "upper": exact.upper},
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


def period_table(plant: dict[str, Matrix], largest: int) -> list[Json]:
    """Smallest achievable gain for N_1, N_2 = 1 ... largest, sensors at instant 0 and with the best offsets."""
    system, periods = build(plant, [1, 1], [0, 0], [0, 1]).plant, range(1, largest + 1)
    searched = {(first, second): search_timing(system, (first, second)) for first in periods for second in periods}
    return [
        {
            "periods": list(pair),
            "synchronous": optimum_json(search.synchronous),
            "best": optimum_json(search.optima[search.best]),
            "best_offset": search.best[1],
            "by_offset": [search.optima[offsets].value for offsets in sorted(search.optima)],
        }
        for pair, search in searched.items()
    ]


def rounded_levels(plant: Mapping[str, str], designs: list[Json]) -> Json:
    """The optimum of each of `designs` (periods, offsets, sensors, claims) while printed entries of the plant move.

    They move within their rounding, one at a time; returns what `spread` does.
    """

    def compute(parameters: Parameters) -> dict[str, float]:
        optima: dict[str, float] = {}
        for entry in designs:
            problem = build(dict(parameters), entry["periods"], entry["offsets"], entry["sensors"])
            optima |= dict.fromkeys(entry["claims"], optimum(problem).value)
        return optima

    return spread(plant, compute)


def _rounding_spread(problem: MultirateProblem, gains: Array, half_unit: float) -> float:
    """Sum over the measured entries of |d norm / d entry| times half a unit, by central differences."""
    step, total = 1e-6, 0.0
    for entry in np.argwhere(np.broadcast_to(problem.schedule.mask[:, None, :], gains.shape)):
        moved = np.zeros_like(gains)
        moved[tuple(entry)] = step
        above, below = (l2_gain(problem.error_system(gains + sign * moved)).value for sign in (1.0, -1.0))
        total += abs(above - below) / (2 * step) * half_unit
    return total


def _lmi(problem: MultirateProblem, solution: LmiDesign) -> Json:
    return {"level": solution.level, "norm": l2_gain(problem.error_system(solution.gains)).value}


# A slow and a late sensor on the common plant: the optimum over all observers


SLOW = "slow: one measurement every m steps"
LATE = "late, in discrete time: each measurement arrives m − 1 steps late; our extension, by added states"


def on_common_plant(plant: dict[str, Any], multiples: list[int]) -> dict[str, Any]:
    """Brackets of the least l2 gain from force and noise to the position's error, for each multiple m."""
    A, B, C = (np.array(plant[name]) for name in "ABC")
    # The force is held over the base period; the error of the position counts.
    Phi, Gamma = SampledPlant(A, B, C, np.zeros((1, 1)), C).discretise(plant["h"])
    sampled = MultiratePlant(A=Phi, B_d=Gamma, C=C, D=np.array([[plant["noise"]]]), W=C)

    def bracket(model: MultiratePlant, period: int) -> list[float]:
        best = optimum(MultirateProblem(model, SensingSchedule((period,))))
        return [best.lower, best.upper]

    return {
        "slow": [bracket(sampled, period) for period in multiples],
        "late": [bracket(delivered(sampled, [m - 1]), 1) for m in multiples],
    }
