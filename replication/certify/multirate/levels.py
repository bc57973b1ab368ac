"""Certificates of the gain of multi-rate observers: Lyapunov matrices from above, disturbances from below."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from replication.certify.multirate.disturbances import peak_disturbance, unseen_for_long, unseen_forever
from replication.certify.rounding import as_floats, bracket, exact, rational, rounded_array
from replication.errors import SolverError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.linear.riccati import RiccatiMap, settled, stacked
from replication.estimation.multirate.kalman import state_scales
from replication.estimation.multirate.optimum import Optimum, optimum, riccati_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array
from replication.verify.reading import written

MARGIN = 1e-7
"""Relative distances: of the design to the optimum, of the Lyapunov matrices to the gain, of the bounds to those."""
SLACK = 1e-8
"""Added to every eigenvalue of W'W relative to the largest: the inequality then holds with that much room."""
LEVEL_BITS, STATE_BITS = 40, 40


def gain(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for the gains of the plant; raises SolverError if rounding leaves no Lyapunov matrices."""
    system = problem_of(theorem).error_system(as_floats(theorem["plant"]["L"]))
    norm = l2_gain(system)
    turn, v = peak_disturbance(system, norm.angle)
    level = norm.upper * (1 + MARGIN)
    return {
        "bound": bracket(norm.lower, level, MARGIN, LEVEL_BITS),
        "witness": {"P": rounded_array(lyapunov_matrices(system, level), STATE_BITS), "turn": turn, "v": v},
    }


def gain_in_units(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """`gain` by `in_units`."""
    problem = problem_of(theorem)
    return in_units(theorem, l2_gain(problem.error_system(as_floats(theorem["plant"]["L"]))).value, gain)


def in_units(
    theorem: Mapping[str, Any], level: float, maker: Callable[[Mapping[str, Any]], dict[str, Any]]
) -> dict[str, Any]:
    """What `maker` finds with each state in the unit of its estimation error and a gain, of about `level`, near one.

    With x' = S x and z' = z/g the Lyapunov matrices are P = g^2 S P' S and the bounds g times those found; all units
    are powers of two, so that nothing is rounded.
    """
    error = np.linalg.norm(state_scales(problem_of(theorem)), axis=2).max(axis=0)
    size = rational(2.0 ** round(np.log2(level)))
    states = exact(np.diag(np.exp2(-np.round(np.log2(np.where(error > 0, error, 1.0))))))
    back, plant = states.inv(), theorem["plant"]
    scaled = {
        **plant,
        "A": written(states * exact(plant["A"]) * back),
        "B_d": written(states * exact(plant["B_d"])),
        "C": written(exact(plant["C"]) * back),
        "W": written(exact(plant["W"]) * back * (1 / size)),
        "L": [written(states * exact(L)) for L in plant["L"]],
    }
    made = maker({**theorem, "plant": scaled})
    P = [written(states * exact(P_k) * states * size**2) for P_k in made["witness"]["P"]]
    return {
        "bound": {side: str(rational(number) * size) for side, number in made["bound"].items()},
        "witness": {**made["witness"], "P": P},
    }


def optimum_noncausal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for an optimum that sits on the non-causal bound."""
    problem = problem_of(theorem)
    best = optimum(problem)
    turn, d = unseen_forever(problem, best.noncausal.angle)
    upper, witness = design(problem, best)
    return {
        "bound": bracket(best.noncausal.lower, upper, MARGIN, LEVEL_BITS),
        "witness": {**witness, "turn": turn, "d": d},
    }


def optimum_causal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds and witness for an optimum above the non-causal bound."""
    problem = problem_of(theorem)
    best = optimum(problem)
    start, d, lower = unseen_for_long(problem, best.lower)
    upper, witness = design(problem, best)
    return {"bound": bracket(lower, upper, MARGIN, LEVEL_BITS), "witness": {**witness, "start": start, "d": d}}


def feasible_design(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """An upper bound alone: a level of Theorem 2 with P_k and Y_k."""
    problem = problem_of(theorem)
    upper, witness = design(problem, optimum(problem))
    return {"bound": {"upper": bracket(upper, upper, MARGIN, LEVEL_BITS)["upper"]}, "witness": witness}


def design(problem: MultirateProblem, best: Optimum) -> tuple[float, dict[str, Any]]:
    """A level just above the optimum, and P_k, Y_k = P_k L_k that satisfy Theorem 2 there."""
    gains = riccati_design(problem, best.upper * (1 + MARGIN)).gains
    system = problem.error_system(gains)
    level = l2_gain(system).upper * (1 + MARGIN)
    P = lyapunov_matrices(system, level)
    return level, {"P": rounded_array(P, STATE_BITS), "Y": rounded_array(P @ gains, STATE_BITS)}


def problem_of(theorem: Mapping[str, Any]) -> MultirateProblem:
    """The estimation problem of a theorem in floating point; sensors that are not used never measure.

    Their rows are left out, and the columns of their noise stay without effect.
    """
    plant, parameters = theorem["plant"], theorem["parameters"]
    rows = list(parameters["sensors"])
    system = MultiratePlant(
        A=as_floats(plant["A"]),
        B_d=as_floats(plant["B_d"]),
        C=as_floats(plant["C"])[rows],
        D=as_floats(plant["D"])[rows],
        W=as_floats(plant["W"]),
    )
    return MultirateProblem(system, SensingSchedule(tuple(parameters["periods"]), tuple(parameters["offsets"])))


def lyapunov_matrices(system: PeriodicSystem, level: float, slack: float = SLACK) -> Array:
    """P_k (N, n, n) with P_(k-1) = A_k' (I - P_k B_k B_k'/g^2)^-1 P_k A_k + C_k'C_k + slack |C_k|^2, for D_k = 0.

    Raises SolverError if the recursion has no limit at this level g.
    """
    backwards = stacked(
        RiccatiMap(
            stage.A.T,
            -stage.B @ stage.B.T / level**2,
            stage.C.T @ stage.C + slack * np.linalg.norm(stage.C, 2) ** 2 * np.eye(system.order),
        )
        for stage in reversed(system.stages)
    )
    found = settled(backwards)
    if found is None:
        raise SolverError(f"no Lyapunov matrices at the level {level!r}: rounding spoils the recursion; raise it")
    return found[::-1]
