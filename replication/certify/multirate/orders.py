"""Certificates of levels that are compared: of two schedules, and of Theorem 1 with one matrix for all instants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cvxpy as cp
import numpy as np

from replication.certify.multirate.disturbances import unseen_for_long
from replication.certify.multirate.levels import LEVEL_BITS, MARGIN, design, problem_of
from replication.certify.rounding import as_floats, modelled, rounded_array, rounded_down, rounded_up
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import optimum

DUAL_BITS = 20
WORSE = 2.0
"""The level that one matrix does not reach, relative to the gain: any above one tells the two apart."""


def shorter_periods(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """A design for the longer periods, and a disturbance that the sensors with the shorter ones see too late."""
    shorter, longer = (_together(theorem, theorem["parameters"][name]) for name in ("shorter", "longer"))
    level, witness = design(longer, optimum(longer))
    start, d, _ = unseen_for_long(shorter, optimum(shorter).lower)
    return {"bound": {}, "witness": {"level": rounded_up(level, LEVEL_BITS), **witness, "start": start, "d": d}}


def _together(theorem: Mapping[str, Any], periods: list[int]) -> Any:
    parameters = {"sensors": theorem["parameters"]["sensors"], "periods": periods, "offsets": [0] * len(periods)}
    return problem_of({**theorem, "parameters": parameters})


def one_matrix(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Multipliers of Theorem 1 with one matrix, as far inside their cone as a level above the gain leaves room for.

    Raises SolverError if the solver finds none.
    """
    system = problem_of(theorem).error_system(as_floats(theorem["plant"]["L"]))
    n, level = system.order, WORSE * l2_gain(system).upper
    steps = [np.hstack([stage.A, stage.B]) for stage in system.stages]
    Z = [cp.Variable((step.shape[1],) * 2, symmetric=True) for step in steps]
    room = cp.Variable()
    gained = sum(step @ Z_k @ step.T - Z_k[:n, :n] for step, Z_k in zip(steps, Z, strict=True))
    states = sum(cp.trace(s.C @ Z_k[:n, :n] @ s.C.T) for s, Z_k in zip(system.stages, Z, strict=True))
    inside = [part - room * np.eye(part.shape[0]) >> 0 for part in (*Z, gained)]
    noises = sum(cp.trace(Z_k[n:, n:]) for Z_k in Z)
    modelled(cp.Problem(cp.Maximize(room), [*inside, noises == 1, states >= level**2]))
    witness = [rounded_array(Z_k.value, DUAL_BITS) for Z_k in Z]
    values = [as_floats(Z_k) for Z_k in witness]
    ratio = sum(np.trace(s.C @ Z_k[:n, :n] @ s.C.T) for s, Z_k in zip(system.stages, values, strict=True))
    reached = np.sqrt(ratio / sum(np.trace(Z_k[n:, n:]) for Z_k in values))
    return {"bound": {"lower": rounded_down(reached * (1 - MARGIN), LEVEL_BITS)}, "witness": {"Z": witness}}
