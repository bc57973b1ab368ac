"""Certificates of the gain of multi-rate observers: Lyapunov matrices P_k of Theorem 1 from above."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from replication.errors import SolverError
from replication.estimation.certificates.rounding import as_floats, rounded_array, rounded_up
from replication.estimation.multirate.optimum import optimum, riccati_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.schedule import SensingSchedule
from replication.estimation.norms import l2_gain
from replication.estimation.periodic import PeriodicSystem
from replication.estimation.riccati import RiccatiMap, along_period, fixed_point
from replication.estimation.validation import Array

MARGIN = 1e-7
"""Relative distances: of the design to the optimum, of the Lyapunov matrices to the gain, of the bound to those."""
SLACK = 1e-8
"""Added to every eigenvalue of W'W relative to the largest: the inequality then holds with that much room."""
LEVEL_BITS, GAIN_BITS, STATE_BITS = 40, 30, 40


def problem_of(plant: Mapping[str, Any], parameters: Mapping[str, Any]) -> MultirateProblem:
    """The estimation problem of a certificate: its plant seen by some of the sensors, in floating point."""
    rows = list(parameters["sensors"])
    C, D = as_floats(plant["C"])[rows], as_floats(plant["D"])[rows]
    system = MultiratePlant(A=as_floats(plant["A"]), B_d=as_floats(plant["B_d"]), C=C, D=D, W=as_floats(plant["W"]))
    return MultirateProblem(system, SensingSchedule(tuple(parameters["periods"]), tuple(parameters["offsets"])))


def gain_upper(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness for the gains of the plant; raises SolverError if rounding leaves no Lyapunov matrices."""
    problem = problem_of(theorem["plant"], theorem["parameters"])
    return _upper(problem.error_system(as_floats(theorem["plant"]["L"])))


def optimum_upper(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness for designed gains close to the optimum, rounded to short rationals first."""
    problem = problem_of(theorem["plant"], theorem["parameters"])
    gains = rounded_array(riccati_design(problem, optimum(problem).upper * (1 + MARGIN)).gains, GAIN_BITS)
    made = _upper(problem.error_system(as_floats(gains)))
    return {"bound": made["bound"], "witness": {"L": gains, **made["witness"]}}


def _upper(system: PeriodicSystem) -> dict[str, Any]:
    level = l2_gain(system).upper * (1 + MARGIN)
    return {
        "bound": {"upper": rounded_up(level * (1 + MARGIN), LEVEL_BITS)},
        "witness": {"P": rounded_array(lyapunov_matrices(system, level), STATE_BITS)},
    }


def lyapunov_matrices(system: PeriodicSystem, level: float) -> Array:
    """P_k (N, n, n) with P_k = A_k' (I - P_(k+1) B_k B_k'/g^2)^-1 P_(k+1) A_k + C_k'C_k + slack, for D_k = 0.

    Raises SolverError if the recursion has no limit at this level g.
    """
    backwards = [
        RiccatiMap(
            stage.A.T,
            -stage.B @ stage.B.T / level**2,
            stage.C.T @ stage.C + SLACK * np.linalg.norm(stage.C, 2) ** 2 * np.eye(system.order),
        )
        for stage in reversed(system.stages)
    ]
    last = fixed_point(backwards)
    if last is None:
        raise SolverError(f"no Lyapunov matrices at the level {level!r}: rounding spoils the recursion; raise it")
    states = along_period(backwards, last)
    return np.stack([states[0], *states[:0:-1]])
