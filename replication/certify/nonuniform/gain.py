"""Certificates of gains under nonuniform sampling: storage matrices from above, periodic disturbances from below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import pi
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from replication.certify.nonuniform.constant import storage_matrix
from replication.certify.rounding import as_floats, rational, rounded, rounded_array, rounded_down, rounded_up
from replication.errors import SolverError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import LiftedResponse, PeriodicSystem
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.filters import Filter, error_system, periodic_gain
from replication.estimation.nonuniform.guarantee import guaranteed_level
from replication.estimation.nonuniform.nominal import closed_form, deadbeat_filter, riccati_filter
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant
from replication.estimation.nonuniform.robust import robust_design
from replication.estimation.nonuniform.worst_case import worst_sequence
from replication.estimation.validation import Array, ComplexArray

Made = dict[str, Any]

NOMINAL_MARGIN = 2e-7
"""Relative distances at a constant period: of the design to the optimum, of the bounds to the gains."""
RANGE_MARGIN = 5e-6
"""The same for the bound over a range of periods: room for its pieces, that need not be small then."""
ATTAINED_MARGIN = 1e-8
"""Relative distance of a lower bound to what a disturbance attains before it is rounded."""
LEVEL_BITS, RANGE_BITS, FILTER_BITS, STORAGE_BITS, SHARE_BITS, ANGLE_BITS = 40, 24, 40, 44, 40, 40
FEW = 2
"""Inputs of a pattern that are too few for Lanczos' method."""
DISTURBANCE = 2**20
"""The largest entry of a disturbance, of which integers are kept."""


def problem_of(
    plant: Mapping[str, Any], parameters: Mapping[str, Any], kind: type[SampledPlant] = SampledPlant
) -> tuple[SampledPlant, PeriodRange]:
    """The sampled plant of a certificate, and the range from the period `from` to the period `to`."""
    system = kind(**{name: as_floats(plant[name]) for name in "ABCDL"})
    whole = PeriodRange(*(float(a + b * pi) for a, b in (as_floats(plant[end]) for end in ("h_l", "h_u"))))
    named = {"h_l": whole.h_l, "middle": whole.middle, "h_u": whole.h_u}
    return system, PeriodRange(named[parameters["from"]], named[parameters["to"]])


def filter_of(values: Mapping[str, Any]) -> Filter:
    """A filter of a certificate in floating point."""
    return Filter(**{name: as_floats(values[name]) for name in "ABC"})


def gain_upper(theorem: Mapping[str, Any], *, leaves: int = 1, cuts: Sequence[float] | None = None) -> Made:
    """Bound and at most `leaves` storage matrices for the given filter; arguments and errors of `guaranteed_level`."""
    chosen = theorem["plant"].get("filter") or theorem["parameters"]["filter"]
    bound, storage = storage_certificate(theorem, chosen, leaves, cuts)
    return {"bound": bound, "witness": {"storage": storage}}


def storage_certificate(
    theorem: Mapping[str, Any], filter_: Mapping[str, Any], leaves: int = 1, cuts: Sequence[float] | None = None
) -> tuple[Made, Made]:
    """An upper bound of the gain of a filter, as certificates write it, and the storage matrices that prove it."""
    plant, parameters = theorem["plant"], theorem["parameters"]
    system, periods = problem_of(plant, parameters)
    chosen, duration = filter_of(filter_), parameters["weight"] == "duration"
    if periods.h_l == periods.h_u:
        norm = periodic_gain(system, chosen, [periods.h_l], per_duration=duration).upper
        level = rounded_up(norm * (1 + NOMINAL_MARGIN), LEVEL_BITS)
        P = storage_matrix(plant, filter_, parameters["from"], rational(level), per_duration=duration)
        return {"upper": level}, {"cells": ["0", "1"], "before": [[0]], "P": [P]}
    found = guaranteed_level(system, chosen, periods, max_leaves=leaves, cuts=cuts, per_duration=duration)
    inner = [(edge - periods.h_l) / (periods.h_u - periods.h_l) for edge in found.cells.edges[1:-1]]
    storage = {
        "cells": ["0", *(rounded(share, SHARE_BITS) for share in inner), "1"],
        "before": found.tree.before(),
        "P": rounded_array(symmetric(found.system.storage(found.P)), STORAGE_BITS),
    }
    return {"upper": rounded_up(found.level * (1 + RANGE_MARGIN), RANGE_BITS)}, storage


def gain_lower(theorem: Mapping[str, Any], *, horizon: int = 0, final_horizon: int | None = None) -> Made:
    """Bound, and a periodic disturbance of the worst pattern that `worst_sequence` finds.

    At one constant period there is nothing to search; `horizon` is then 0.
    """
    system, periods = problem_of(theorem["plant"], theorem["parameters"])
    chosen = theorem["plant"].get("filter") or theorem["parameters"]["filter"]
    filter_, duration = filter_of(chosen), theorem["parameters"]["weight"] == "duration"
    runs: Sequence[int] = (1,)
    if horizon:
        found = worst_sequence(
            system, filter_, periods, horizon=horizon, final_horizon=final_horizon, per_duration=duration
        )
        runs = found.runs
    pattern, h = pattern_of(runs, periods)
    stages = PeriodicSystem(tuple(error_system(system, filter_, float(t), per_duration=duration) for t in h))
    peak = l2_gain(stages)
    return {
        "bound": {"lower": rounded_down(peak.lower * (1 - ATTAINED_MARGIN), LEVEL_BITS)},
        "witness": disturbance(pattern, stages, peak.angle, np.sqrt(h) if duration else np.ones_like(h)),
    }


def pattern_of(runs: Sequence[int], periods: PeriodRange) -> tuple[list[tuple[int, int]], Array]:
    """Samples at h_u, at h_l, at h_u, and so on: as shares with their numbers, and the period of each, s."""
    pattern = [(1 if i % 2 == 0 else 0, count) for i, count in enumerate(runs) if count]
    ends = [periods.h_u if share else periods.h_l for share, _ in pattern]
    return pattern, np.repeat(ends, [count for _, count in pattern])


def disturbance(pattern: Sequence[tuple[int, int]], stages: PeriodicSystem, angle: float, roots: Array) -> Made:
    """The pattern, as shares with numbers of samples, and its worst disturbance at an angle; roots (p,): of its
    weights."""
    w = worst_disturbance(stages, angle) / roots[:, None]
    whole = np.rint(w / np.max(np.abs(w)) * DISTURBANCE)
    return {
        "pattern": [[str(share), count] for share, count in pattern],
        "turn": rounded(float(np.tan(angle / 2)), ANGLE_BITS),
        "w": [[[str(int(z.real)), str(int(z.imag))] for z in row] for row in whole],
    }


def worst_disturbance(stages: PeriodicSystem, angle: float) -> ComplexArray:
    """The unit input (p, m) of one pattern that the lifted response amplifies most at this angle."""
    response = LiftedResponse(stages)
    (forward, adjoint), size = response.at(angle), response.inputs
    if size > FEW:
        operator = scipy.sparse.linalg.LinearOperator((size, size), matvec=lambda v: adjoint(forward(v)), dtype=complex)
        rng = np.random.default_rng(0)
        start = rng.standard_normal(size).astype(complex)
        # Where the largest values lie too close together for Lanczos, all are found.
        with suppress(scipy.sparse.linalg.ArpackNoConvergence):
            _, vectors = scipy.sparse.linalg.eigsh(operator, k=1, which="LM", v0=start, rng=rng)
            return np.asarray(vectors[:, 0].reshape(stages.period, -1))
    gram = np.array([adjoint(forward(unit)) for unit in np.eye(size, dtype=complex)]).T
    return np.asarray(np.linalg.eigh(gram).eigenvectors[:, -1].reshape(stages.period, -1))


def nominal_upper(theorem: Mapping[str, Any]) -> Made:
    """Bound, filter and storage matrix close to the nominal optimum at the constant period `from` = `to`.

    The filter is deadbeat if D = 0, else that of the Riccati recursion; SolverError if the recursion finds none.
    """
    system, periods = problem_of(theorem["plant"], theorem["parameters"])
    h = periods.h_l
    if not np.any(system.D):
        return _with_filter(theorem, deadbeat_filter(system, h))
    design = riccati_filter(system, h, closed_form(system, h) * (1 + NOMINAL_MARGIN))
    if design is None:
        raise SolverError(f"the Riccati recursion finds no filter just above the optimum at h = {h:.6g} s")
    return _with_filter(theorem, design.filter)


def robust_upper(theorem: Mapping[str, Any]) -> Made:
    """Bound, filter and storage matrix of the robust design with one Lyapunov function."""
    system, periods = problem_of(theorem["plant"], theorem["parameters"])
    return _with_filter(theorem, robust_design(system, periods).design.filter)


def _with_filter(theorem: Mapping[str, Any], filter_: Filter) -> Made:
    """Bound and witness for the filter in short rationals."""
    written = {name: rounded_array(getattr(filter_, name), FILTER_BITS) for name in "ABC"}
    bound, storage = storage_certificate(theorem, written)
    return {"bound": bound, "witness": {"filter": written, "storage": storage}}


def optimum_lower(theorem: Mapping[str, Any]) -> Made:
    """Bound and the hidden disturbance for every filter at the constant period `period`; see the verifier."""
    name = theorem["parameters"]["period"]
    system, periods = problem_of(theorem["plant"], {"from": name, "to": name})
    Phi, Gamma = system.discretise(periods.h_l)
    if not np.any(system.D):
        gain, start = np.linalg.norm(system.L @ Gamma, 2), np.linalg.svd(system.L @ Gamma)[2][0]
    else:
        back = np.linalg.inv(Phi - Gamma @ np.linalg.solve(system.D, system.C))
        ratio = np.linalg.solve(system.D, system.C)
        supplied = scipy.linalg.solve_discrete_lyapunov(back.T, ratio.T @ ratio)
        hidden = scipy.linalg.solve_discrete_lyapunov(back.T, system.L.T @ system.L)
        ahead = np.linalg.inv(back)
        values, vectors = scipy.linalg.eigh(ahead.T @ hidden @ ahead, supplied)
        gain, start = np.sqrt(values[-1]), vectors[:, -1]
    return {
        "bound": {"lower": rounded_down(float(gain) * (1 - NOMINAL_MARGIN), LEVEL_BITS)},
        "witness": {"start": rounded_array(start / np.max(np.abs(start)), FILTER_BITS)},
    }
