"""A rational functional that bounds the level of Theorem 3 at one degree from below: the dual of its program.

The functional y gives a weight to each coefficient of the identity that Z cannot cancel. Its matrices on the squares of
N and of dV/dt must be positive semidefinite. On measured coordinates the program has directions that cost nothing
(int y^2 in V, |l|^2 in N, ..), where these matrices must vanish: linear equations, solved exactly. On the other
coordinates there is room for rounding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sparse
from flint import fmpq, fmpq_mat

from replication.certify.delay.forms import (
    Basis,
    Dynamics,
    Entry,
    Key,
    add,
    cancellable,
    contribution,
    echelon,
    supply,
)
from replication.certify.delay.levels import change_of, dynamics_of
from replication.certify.rounding import as_floats, floats, modelled, rational, rounded
from replication.errors import SolverError
from replication.estimation.validation import Array
from replication.verify.reading import written

STEP = 8e-6
"""Relative distance of the bound from the dual optimum: leaves room for rounding."""
ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the rounding."""
LEVEL_BITS, WEIGHT_BITS = 40, 40

Row = dict[int, fmpq]


@dataclass(frozen=True)
class Dual:
    """keys: the weights y. matrices: for each entry of each matrix of the functional on squares, its row of weights.

    hidden: the coordinates of each matrix that are not measured. Those on N come first.
    """

    keys: tuple[Key, ...]
    matrices: tuple[dict[Entry, Row], ...]
    hidden: tuple[tuple[int, ...], ...]


def dual_of(dynamics: Dynamics, degree: int) -> Dual:
    """The functional on the squares of N and of dV/dt, for both weights, at one degree."""
    position: dict[Key, int] = {}
    matrices: list[dict[Entry, Row]] = []
    hidden: list[tuple[int, ...]] = []
    n, width = dynamics.states, dynamics.functions
    for points, moving in ((dynamics.points, False), (n, True)):
        for weight in (0, 1):
            basis = Basis(points, width, degree - weight, weight)
            rows: dict[Entry, Row] = {}
            for entry, key, factor in basis.terms():
                row = rows.setdefault(entry, {})
                half = factor / (1 if entry[0] == entry[1] else 2)
                fed = {} if cancellable(dynamics, key) else {key: fmpq(1)}
                for target, amount in (contribution(dynamics, key) if moving else fed).items():
                    add(row, position.setdefault(target, len(position)), half * amount)
            matrices.append(rows)
            hidden.append(tuple(i for i in range(basis.size) if not _measured(dynamics, basis, i, moving)))
    return Dual(tuple(position), tuple(matrices), tuple(hidden))


def _measured(dynamics: Dynamics, basis: Basis, i: int, moving: bool) -> bool:
    """Whether a coordinate of a basis belongs to a measured state: to its value, its end value or its history."""
    n = dynamics.states
    start = 0 if moving else dynamics.first
    return i >= start and (i - start) % n >= n - dynamics.measured


def degree_lower(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of a level that Theorem 3 cannot go below at the degree of the theorem."""
    plant, degree = theorem["plant"], theorem["parameters"]["degree"]
    change = change_of(plant)
    dynamics = dynamics_of(plant, change)
    dual = dual_of(dynamics, degree)
    # The coefficients of 2 v'z at the keys of the dual.
    plain = supply(dynamics, fmpq(0))
    costs = [plain.get(key, fmpq(0)) for key in dual.keys]
    weights = _weights(dual, costs, *_equalities(dynamics, dual, costs))
    value = sum((weight * cost for weight, cost in zip(weights, costs, strict=True)), fmpq(0))
    gamma = str(fmpq((value * 2**LEVEL_BITS).floor(), 2**LEVEL_BITS))
    functional = _as_matrices(dynamics, 2 * degree + 1, dict(zip(dual.keys, weights, strict=True)))
    return {"bound": {"lower": gamma}, "witness": {"change": written(change), "functional": functional}}


def _equalities(dynamics: Dynamics, dual: Dual, costs: list[fmpq]) -> tuple[list[fmpq], fmpq_mat]:
    """y = constant + free t: the solutions of all equations, with the value on |w|^2 + |v|^2 equal to one."""
    count = len(dual.keys)
    rows: list[Row] = []
    for matrix, hidden in zip(dual.matrices, dual.hidden, strict=True):
        kept = set(hidden)
        rows += [row for (i, j), row in matrix.items() if row and not (i in kept and j in kept)]
    unique = {tuple(sorted((k, str(v)) for k, v in row.items())): row for row in rows}
    level = supply(dynamics, fmpq(-1))
    scale = {k: level.get(key, fmpq(0)) - cost for k, (key, cost) in enumerate(zip(dual.keys, costs, strict=True))}
    reduced, pivots = echelon([*unique.values(), {**scale, count: fmpq(1)}], count + 1)
    if count in pivots:
        raise SolverError("the equations of the dual have no solution; the degree is too low")
    others = [k for k in range(count) if k not in set(pivots)]
    constant = [fmpq(0)] * count
    free = fmpq_mat(count, len(others))
    for i, pivot in enumerate(pivots):
        constant[pivot] = reduced[i, count]
        for j, other in enumerate(others):
            free[pivot, j] = -reduced[i, other]
    for j, other in enumerate(others):
        free[other, j] = fmpq(1)
    return constant, free


def _weights(dual: Dual, costs: list[fmpq], constant: list[fmpq], free: fmpq_mat) -> list[fmpq]:
    """Rational y in the interior: the largest value first, then the largest margin a little below it.

    Raises SolverError if there is no room for rounding.
    """
    cost = as_floats(written(costs))
    t, margin = cp.Variable(free.ncols()), cp.Variable()
    y = as_floats(written(constant)) + floats(free) @ t
    grams = []
    for matrix, hidden in zip(dual.matrices, dual.hidden, strict=True):
        entries = sparse.csr_array(_map(matrix, hidden, len(dual.keys))) @ y
        gram = cp.reshape(entries, (len(hidden), len(hidden)), order="C")
        grams.append((gram + gram.T) / 2)
    best = _solved(cp.Problem(cp.Maximize(cost @ y), [gram >> 0 for gram in grams]))
    room = [gram >> margin * np.eye(gram.shape[0]) for gram in grams]
    _solved(cp.Problem(cp.Maximize(margin), [cost @ y >= best * (1.0 - STEP), *room]))
    least = min(float(np.linalg.eigvalsh(gram.value)[0]) for gram in grams)
    if not least >= ROOM:
        raise SolverError(f"no room for rounding: margin {least:.1e} at {STEP:g} below {best!r}; raise the distance")
    chosen = fmpq_mat([[rational(rounded(float(value), WEIGHT_BITS))] for value in np.asarray(t.value)])
    moved = free * chosen
    return [value + moved[i, 0] for i, value in enumerate(constant)]


def _map(matrix: dict[Entry, Row], hidden: tuple[int, ...], count: int) -> Array:
    """The map from y to the entries of the matrix on the hidden coordinates, row by row."""
    place = {i: k for k, i in enumerate(hidden)}
    size = len(hidden)
    result = np.zeros((size, size, count))
    for (i, j), row in matrix.items():
        if i in place and j in place:
            for column, amount in row.items():
                result[place[i], place[j], column] = result[place[j], place[i], column] = as_floats(str(amount))
    return result.reshape(size * size, count)


def _solved(problem: cp.Problem) -> float:
    """The optimum; raises SolverError without one."""
    modelled(problem)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise SolverError(f"Clarabel found no functional: status {problem.status}")
    return float(np.asarray(problem.value))


def _as_matrices(dynamics: Dynamics, powers: int, weights: Mapping[Key, fmpq]) -> dict[str, Any]:
    """The weights as those of the coefficients of P, Q, S and R, each entry of a symmetric pair on its own."""
    points, width, zero = dynamics.points, dynamics.functions, fmpq(0)

    def of(i: int, j: int) -> fmpq:
        return weights.get(("pair", min(i, j), max(i, j)), zero)

    def moment(power: int, function: int) -> int:
        return points + power * width + function

    def table(rows: int, entry: Any, columns: int) -> list[list[str]]:
        return [[str(entry(i, j)) for j in range(columns)] for i in range(rows)]

    def local(kind: str, power: int) -> list[list[str]]:
        prefix = ("coupling", "local") if kind == "coupling" else ("local",)
        return table(width, lambda k, m: weights.get((*prefix, power, min(k, m), max(k, m)), zero), width)

    each = range(powers)
    return {
        "P": table(points, of, points),
        "Q": [table(points, lambda p, k, c=c: 2 * of(p, moment(c, k)), width) for c in each],
        "S": [local("local", c) for c in each],
        "R": [[table(width, lambda k, m, a=a, b=b: of(moment(a, k), moment(b, m)), width) for b in each] for a in each],
        "coupling": [local("coupling", c) for c in each],
    }
