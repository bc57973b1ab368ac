"""Certificates of LMI (3) on the Pade approximation of a system with delays: its least level from both sides.

With the continued fraction tanh(x) = 1/(1/x + 1/(3/x + ..)), x = s tau / 2, cut off after N terms, the approximant is
(1 - t)/(1 + t); its ladder has a realisation in rationals of moderate size, for even N.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import cvxpy as cp
import numpy as np
from flint import fmpq, fmpq_mat

from replication.certify.delay.levels import LEVEL_BITS, change_of, floating, hidden_gain
from replication.certify.rounding import floats, modelled, rounded_array, stepwise
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.delay import DelaySystem, lmi_gain, pade_model
from replication.estimation.validation import Array
from replication.verify.algebra.linear import identity
from replication.verify.reading import written

PADE_STEPS = (1e-6, 5e-6, 2e-5)
"""Relative distances of the level from the least one, tried in turn until there is room for rounding."""
PADE_ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the inequality."""
STATE_BITS = 40
LARGEST = 30.0
"""Bound on P: small numbers leave the solver the digits that the margin needs."""


@dataclass(frozen=True)
class Section:
    """x' = a x + b u, out = c x + d u: the approximant of a delay of 1 s, exact."""

    a: fmpq_mat
    b: fmpq_mat
    c: fmpq_mat
    d: fmpq


def section(order: int) -> Section:
    """The ladder of even order; raises InvalidInputError for an odd one, where a state would be lost."""
    if order % 2:
        raise InvalidInputError(f"the order must be even, got {order}")
    steps = fmpq_mat(order, order, [(i == j + 1) - (j == i + 1) for i in range(order) for j in range(order)])
    elements = fmpq_mat(order, order, [(2 * i + 1) * (i == j) for i in range(order) for j in range(order)])
    first = fmpq_mat(order, 1, [int(i == 0) for i in range(order)])
    one, back = identity(order), steps.inv()
    ladder = back * elements * 2
    port = back * first
    return Section(ladder * (one + port * first.transpose()), -(ladder * port), first.transpose() * -2, fmpq(1))


def pade_upper(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of a level close to the least; raises InfeasibleError if none that is tried leaves room."""
    plant, order = theorem["plant"], theorem["parameters"]["order"]
    change = change_of(plant)
    system, part = floating(plant, change), section(order)
    least = lmi_gain(pade_model(system, order)).gamma

    def witness(gamma: str) -> dict[str, Any]:
        return {
            "change": written(change),
            "section": written(vars(part)),
            "P": rounded_array(_storage(system, part, float(Fraction(gamma))), STATE_BITS),
        }

    return stepwise(least, PADE_STEPS, LEVEL_BITS, witness)


def pade_lower(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of the gain that no observer of the approximation can go below."""
    gamma, witness = hidden_gain(theorem["plant"], lambda s: _lag(theorem["parameters"]["order"], s))
    return {"bound": {"lower": gamma}, "witness": witness}


def _lag(order: int, argument: complex) -> complex:
    value = 0.0 + 0.0j
    for k in range(order, 0, -1):
        value = 1.0 / ((2 * k - 1) * 2.0 / argument + value) if argument != 0.0 else 0.0j
    return (1.0 - value) / (1.0 + value)


def _storage(system: DelaySystem, part: Section, gamma: float) -> Array:
    """P of LMI (3) with the largest margin of P > 0 and of the inequality on the kernel of C_2.

    Raises SolverError if there is none, InfeasibleError if the margin is below PADE_ROOM.
    """
    n, q = system.states, system.measurements
    A, B, C = _model(system, part)
    size, r, p = A.shape[0], B.shape[1], C.shape[0]
    kept = np.delete(np.eye(size), np.arange(n - q, n), axis=1)
    storage, margin = cp.Variable((size, size), symmetric=True), cp.Variable()
    corner = kept.T @ (storage @ A + A.T @ storage) @ kept
    cross, output = -kept.T @ storage @ B, kept.T @ C.T
    inequality = cp.bmat(
        [
            [corner, cross, output],
            [cross.T, -gamma * np.eye(r), np.zeros((r, p))],
            [output.T, np.zeros((p, r)), -gamma * np.eye(p)],
        ]
    )
    constraints = [
        storage >> margin * np.eye(size),
        storage << LARGEST * np.eye(size),
        (inequality + inequality.T) / 2 << -margin * np.eye(size - q + r + p),
    ]
    problem = cp.Problem(cp.Maximize(margin), constraints)
    status = modelled(problem)
    if storage.value is None:
        raise SolverError(f"Clarabel found no storage at the level {gamma!r}: status {status}; raise the level")
    # The eigenvalues of what it returned decide.
    eigenvalues = np.linalg.eigvalsh(storage.value), -np.linalg.eigvalsh((inequality.value + inequality.value.T) / 2)
    if not min(values.min() for values in eigenvalues) >= PADE_ROOM:
        raise InfeasibleError(f"no room for rounding at the level {gamma!r}; raise it")
    return np.asarray(storage.value)


def _model(system: DelaySystem, part: Section) -> tuple[Array, Array, Array]:
    """The approximation, one section for each delayed state that has an effect."""
    n = system.states
    a, b, c = (floats(matrix) for matrix in (part.a, part.b, part.c))
    d = float(Fraction(str(part.d)))
    order = a.shape[0]
    A, C = system.a0.copy(), system.c10.copy()
    sections = [
        (delay, i, late[:, [i]], output[:, [i]])
        for delay, late, output in zip(system.delays, system.a, system.c1, strict=True)
        for i in range(n)
        if np.any(late[:, i]) or np.any(output[:, i])
    ]
    size = n + order * len(sections)
    wide, seen = np.zeros((size, size)), np.zeros((C.shape[0], size))
    for k, (delay, i, late, output) in enumerate(sections):
        own = slice(n + k * order, n + (k + 1) * order)
        A[:, [i]] += d * late
        C[:, [i]] += d * output
        wide[:n, own], seen[:, own] = late @ c, output @ c
        wide[own, own], wide[own, [i]] = a / delay, b / delay
    wide[:n, :n], seen[:, :n] = A, C
    return wide, np.vstack([system.b, np.zeros((size - n, system.inputs))]), seen
