"""Certificates of gains under nonuniform sampling: storage matrices from above, periodic disturbances from below."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from math import frexp, log2, pi
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse.linalg
from flint import arb, arb_mat, ctx, fmpq

from replication.certify import (
    as_floats,
    exact,
    rational,
    rationals,
    rounded,
    rounded_array,
    rounded_down,
    rounded_up,
)
from replication.errors import SolverError
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import LiftedResponse, PeriodicSystem
from replication.estimation.linear.riccati import symmetric
from replication.estimation.nonuniform.filters import (
    Filter,
    closed_form,
    deadbeat_filter,
    error_system,
    periodic_gain,
    riccati_filter,
)
from replication.estimation.nonuniform.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import DurationPlant, PeriodRange, SampledPlant, weights_of
from replication.estimation.nonuniform.robust import robust_design
from replication.estimation.nonuniform.stamped.design import StampedFilter, StampedPlant, proved_design
from replication.estimation.nonuniform.worst_case import worst_sequence
from replication.estimation.validation import Array, ComplexArray
from replication.verify.algebra.linear import beside, block, hold, identity, rounded_ends, zeros

PRECISION = 200
SLACK = fmpq(1, 2**40)
"""Room in the state block of the inequality."""
EXACT_BITS = 60
"""Storage matrices are multiples of 2^-EXACT_BITS: much finer than the room."""
SETTLED, MAX_DOUBLINGS = fmpq(1, 2**70), 60
"""Relative change of the recursion at its end, and its length."""

Json = Mapping[str, Any]


def storage_matrix(plant: Json, filter_: Json, period: str, level: fmpq, *, weighted: bool = False) -> list[list[str]]:
    """P = A'(P + PB (w g^2 - B'PB)^-1 B'P) A + w C'C + slack of the error system at `period`, by doubling from P = 0.

    plant, filter_: as certificates write them; w = 1, or the period if `weighted`. In balls, since doubles do not do
    close to an optimum: a relative distance d above it some states need a storage of the order of 1/d times their
    output, while the inequality has room of the order of d. Raises SolverError if there is none: the level g is too
    low.
    """
    with ctx.workprec(PRECISION):
        low, high = (arb(a[0, 0]) + arb(a[0, 1]) * arb.pi() for a in (exact([plant[end]]) for end in ("h_l", "h_u")))
        h = {"h_l": low, "middle": (low + high) / 2, "h_u": high}[period]
        A, B, C = error_stage(plant, filter_, h)
        weight = h if weighted else arb(1)
        supplied = weight * arb(level) ** 2
        unit = arb_mat(identity(A.nrows()))
        G, P = -(B * B.transpose()) / supplied, C.transpose() * C * weight + unit * arb(SLACK)
        for _ in range(MAX_DOUBLINGS):
            through = (unit + G * P).inv()
            added = A.transpose() * P * through * A
            A, G, P = (A * through * A).mid(), (G + A * through * G * A.transpose()).mid(), (P + added).mid()
            if _size(added) < SETTLED * _size(P):
                break
        gap = arb_mat(identity(B.ncols())) * supplied - B.transpose() * P * B
        if not (_positive(gap) and _positive(P) and _size(added) < SETTLED * _size(P)):
            raise SolverError(f"no storage matrix at the level {level}: it is too low; raise it")
        return [
            [str(rounded_ends(entry.mid() / 2, EXACT_BITS)[0]) for entry in row] for row in (P + P.transpose()).tolist()
        ]


def error_stage(plant: Json, filter_: Json, h: arb) -> tuple[arb_mat, arb_mat, arb_mat]:
    """A-bar, B-bar, C-bar of the error system (5) at the period h."""
    A, B, C, D, L = (exact(plant[name]) for name in "ABCDL")
    A_f, B_f, C_f = (exact(filter_[name]) for name in "ABC")
    Phi, Gamma = hold(A, B, h)
    state = beside(Phi, arb_mat(zeros(A.nrows(), A_f.nrows()))).tolist() + arb_mat(block([[B_f * C, A_f]])).tolist()
    return arb_mat(state), arb_mat(Gamma.tolist() + arb_mat(B_f * D).tolist()), arb_mat(block([[L, -C_f]]))


def _positive(M: arb_mat) -> bool:
    """Whether all leading minors are; the least eigenvalue may be far below what doubles tell from zero."""
    rows = M.tolist()
    return all(arb_mat([row[:k] for row in rows[:k]]).det() > 0 for k in range(1, len(rows) + 1))


def _size(M: arb_mat) -> arb:
    """The sum of the moduli of the entries."""
    return sum((abs(entry) for entry in M.entries()), arb(0))


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
    kind = DurationPlant if parameters.get("weight") == "duration" else kind
    system = kind(**{name: as_floats(plant[name]) for name in "ABCDL"})
    whole = PeriodRange(*(float(a + b * pi) for a, b in (as_floats(plant[end]) for end in ("h_l", "h_u"))))
    named = {"h_l": whole.h_l, "middle": whole.middle, "h_u": whole.h_u}
    return system, PeriodRange(named[parameters["from"]], named[parameters["to"]])


def filter_of(values: Mapping[str, Any]) -> Filter:
    """A filter of a certificate in floating point."""
    return Filter(**{name: as_floats(values[name]) for name in "ABC"})


def gain_upper(
    theorem: Mapping[str, Any], filter_: Json | None = None, *, leaves: int = 1, cuts: Sequence[float] | None = None
) -> Made:
    """Bound and at most `leaves` storage matrices for a filter, as certificates write it: that of the theorem unless
    given. Arguments and errors of `guaranteed_level`."""
    plant, parameters = theorem["plant"], theorem["parameters"]
    system, periods = problem_of(plant, parameters)
    filter_ = filter_ or plant.get("filter") or parameters["filter"]
    chosen = filter_of(filter_)
    if periods.h_l == periods.h_u:
        norm = periodic_gain(system, chosen, [periods.h_l]).upper
        level = rounded_up(norm * (1 + NOMINAL_MARGIN), LEVEL_BITS)
        P = storage_matrix(plant, filter_, parameters["from"], rational(level), weighted=system.weighted)
        return {"bound": {"upper": level}, "witness": {"storage": {"cells": ["0", "1"], "before": [[0]], "P": [P]}}}
    bound = guaranteed_level(system, chosen, periods, max_leaves=leaves, cuts=cuts)
    inner = [(edge - periods.h_l) / (periods.h_u - periods.h_l) for edge in bound.edges[1:-1]]
    storage = {
        "cells": ["0", *(rounded(share, SHARE_BITS) for share in inner), "1"],
        "before": bound.before,
        "P": rounded_array(symmetric(bound.storage), STORAGE_BITS),
    }
    upper = rounded_up(bound.level * (1 + RANGE_MARGIN), RANGE_BITS)
    return {"bound": {"upper": upper}, "witness": {"storage": storage}}


def gain_lower(theorem: Mapping[str, Any], *, horizon: int = 0, final_horizon: int | None = None) -> Made:
    """Bound, and a periodic disturbance of the worst pattern that `worst_sequence` finds.

    At one constant period there is nothing to search; `horizon` is then 0.
    """
    system, periods = problem_of(theorem["plant"], theorem["parameters"])
    filter_ = filter_of(theorem["plant"].get("filter") or theorem["parameters"]["filter"])
    runs: Sequence[int] = (1,)
    if horizon:
        runs = worst_sequence(system, filter_, periods, horizon=horizon, final_horizon=final_horizon).runs
    pattern, h = pattern_of(runs, periods)
    stages = error_system(system, filter_, h)
    peak = l2_gain(stages)
    return {
        "bound": {"lower": rounded_down(peak.lower * (1 - ATTAINED_MARGIN), LEVEL_BITS)},
        "witness": disturbance(pattern, stages, peak.angle, np.sqrt(weights_of(system, h))),
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
    made = gain_upper(theorem, written)
    return {**made, "witness": {"filter": written, **made["witness"]}}


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


STAMPED_BITS = 30
"""Bits of a bound."""
LOST = 30
"""Bits of the verifier's balls that may be lost under a pattern, which it goes through twice; longer ones are cut."""
STEPS = 2**8
"""Of the coordinates, in a unit."""
RANGE = {"from": "h_l", "to": "h_u"}


def stamped_gain(theorem: Mapping[str, Any], filter_: StampedFilter, proof: Guarantee, runs: Sequence[int]) -> Made:
    """Both bounds and the witness for a filter with the floats that it has; runs: of the pattern, see `pattern_of`."""
    plant = theorem["plant"]
    system, periods = problem_of(plant, RANGE, StampedPlant)
    T = coordinates(proof)
    back = np.linalg.inv(T)
    pattern, h = pattern_of(runs, periods)
    # In these coordinates floating point is accurate, too.
    moved, chosen = system.in_coordinates(T), filter_.in_coordinates(T)
    while lost_bits(stages := error_system(moved, chosen, h)) > LOST and len(h) > len(pattern):
        runs = [(count + 1) // 2 for count in runs]
        pattern, h = pattern_of(runs, periods)
    peak = l2_gain(stages)
    lower, upper = peak.lower * (1 - ATTAINED_MARGIN), proof.level * (1 + RANGE_MARGIN)
    return {
        "bound": {
            "lower": rounded_down(lower, STAMPED_BITS - frexp(lower)[1]),
            "upper": rounded_up(upper, STAMPED_BITS - frexp(upper)[1]),
        },
        "witness": {
            "filter": {"cells": shares(plant, filter_.edges), "G": rationals(filter_.G)},
            "T": rationals(T),
            "storage": {
                "cells": shares(plant, proof.edges[1:-1]),
                "before": proof.before,
                "P": rationals(symmetric(back.T @ proof.storage @ back)),
            },
            **disturbance(pattern, stages, peak.angle, np.ones_like(h)),
        },
    }


def coordinates(proof: Guarantee) -> Array:
    """T for which the storage of T x is about a multiple of the identity: upper triangular and of few bits, with powers
    of two on its diagonal, so that its inverse has few bits, too."""
    root = np.linalg.cholesky(np.mean(proof.storage, axis=0) / proof.level**2).T
    units = np.diag(root)
    return np.asarray(np.exp2(np.round(np.log2(units)))[:, None] * np.round(root / units[:, None] * STEPS) / STEPS)


def lost_bits(stages: PeriodicSystem) -> float:
    """Bits by which balls widen over a pattern: each step multiplies their radii by its moduli."""
    total, bits = np.eye(stages.order), 0.0
    for stage in stages.stages:
        total = np.abs(stage.A) @ total
        size = float(np.max(total)) or 1.0
        total, bits = total / size, bits + log2(size)
    return bits


def least_gain(theorem: Mapping[str, Any], *, horizon: int) -> Made:
    """The same for the filter of least level, and the worst pattern that `worst_sequence` finds."""
    system, periods = problem_of(theorem["plant"], RANGE, StampedPlant)
    design, proof = proved_design(system, periods)
    attack = worst_sequence(system, design.filter, periods, horizon=horizon)
    return stamped_gain(theorem, design.filter, proof, attack.runs)


def shares(plant: Mapping[str, Any], edges: Sequence[float]) -> list[str]:
    """0, where the inner edges (s) divide the range, and 1: exactly if its ends are rational."""
    (low, low_pi), (high, high_pi) = ([Fraction(part) for part in plant[end]] for end in ("h_l", "h_u"))
    if low_pi or high_pi:
        h_l, h_u = (float(a) + float(b) * pi for a, b in ((low, low_pi), (high, high_pi)))
        return ["0", *(rounded((edge - h_l) / (h_u - h_l), SHARE_BITS) for edge in edges), "1"]
    return ["0", *(str((Fraction(edge) - low) / (high - low)) for edge in edges), "1"]
