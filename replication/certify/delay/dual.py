"""A rational functional that bounds the level of Theorem 3 at one degree from below: the dual of its program.

The functional y weighs each coefficient of the identity that Z cannot cancel. Its matrices on the squares of N and of
dV/dt must be positive semidefinite, and vanish on measured coordinates: linear equations, solved exactly. Near the
optimum the matrices are nearly singular: they are taken in Legendre polynomials, and scaled by their diagonal.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import cvxpy as cp
import numpy as np
from flint import fmpq, fmpq_mat

from replication.certify import (
    as_floats,
    floats,
    modelled,
    rational,
    rounded,
    rounded_down,
)
from replication.certify.delay import forms
from replication.certify.delay.forms import Basis, Dynamics, Entry, Key, change_of, dynamics_of
from replication.certify.delay.levels import SOLVED, to_legendre
from replication.errors import SolverError
from replication.estimation.delay.sos.cone import Blocks, cone_blocks
from replication.estimation.validation import Array
from replication.verify.reading import written

INTERIOR_STEPS = (8e-6, 3e-5, 6e-5, 8e-5, 1e-4, 3e-4, 1e-3, 0.004)
"""Relative distances of the bound from the dual optimum, tried in turn until there is room for rounding."""
INTERIOR_ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the rounding."""
SCALINGS, SEEN = 3, 1e-13
"""How often the coordinates are scaled anew; relative size below which a direction counts as none."""
WEIGHT_BITS, LEVEL_BITS = 60, 40

Row = dict[int, fmpq]


@dataclass(frozen=True)
class Dual:
    """keys: the weights y. matrices: for each entry of each matrix of the functional on squares, its row of weights.

    hidden: the coordinates of each matrix that are not measured. changes: what takes these to Legendre polynomials, in
    which the matrices are well conditioned. Those on N come first.
    """

    keys: tuple[Key, ...]
    matrices: tuple[dict[Entry, Row], ...]
    hidden: tuple[tuple[int, ...], ...]
    changes: tuple[Array, ...]


@dataclass(frozen=True)
class Task:
    """The matrices and the value 2 v'z as affine functions of x, in which y = constant + free (back x)."""

    x: cp.Variable
    back: Array
    grams: list[cp.Expression]
    value: cp.Expression

    def margin(self, least: float) -> float:
        """The largest one with which the matrices are definite at a value; x is left where it is."""
        room = cp.Variable()
        wide = [gram >> room * np.eye(gram.shape[0]) for gram in self.grams]
        return _solved(cp.Problem(cp.Maximize(room), [self.value >= least, *wide]))


def _task(dual: Dual, cost: Array, constant: Array, free: Array, changes: Sequence[Array]) -> Task:
    """The task in these coordinates of the matrices; x of which each entry moves them by as much as any other."""
    maps = [
        np.kron(change, change) @ _map(matrix, hidden, len(dual.keys))
        for matrix, hidden, change in zip(dual.matrices, dual.hidden, changes, strict=True)
    ]
    sizes, directions = np.linalg.svd(np.vstack([form @ free for form in maps]), full_matrices=False)[1:]
    back = (directions.T / sizes)[:, sizes > SEEN * sizes[0]]
    x = cp.Variable(back.shape[1])
    grams = []
    for form, change in zip(maps, changes, strict=True):
        gram = cp.reshape(form @ constant + (form @ free @ back) @ x, change.shape, order="C")
        grams.append((gram + gram.T) / 2)
    return Task(x, back, grams, cost @ constant + (cost @ free @ back) @ x)


def inner_weights(dual: Dual, costs: list[fmpq], constant: list[fmpq], free: fmpq_mat) -> list[fmpq]:
    """Rational y in the interior: the largest value first, then the largest margin a little below it."""
    known = as_floats(written(costs)), as_floats(written(constant)), floats(free)
    tasks = [_task(dual, *known, dual.changes)]
    changes, best = dual.changes, -np.inf
    for _ in range(SCALINGS):
        try:
            best = max(best, _solved(cp.Problem(cp.Maximize(tasks[-1].value), [form >> 0 for form in tasks[-1].grams])))
        except SolverError:
            break
        sizes = [np.sqrt(np.maximum(np.diag(gram.value), SEEN)) for gram in tasks[-1].grams]
        changes = tuple(change / size[:, None] for change, size in zip(changes, sizes, strict=True))
        tasks.append(_task(dual, *known, changes))
    for step, task in product(INTERIOR_STEPS, reversed(tasks)):
        try:
            if task.margin(best * (1.0 - step)) >= INTERIOR_ROOM:
                break
        except SolverError:
            continue
    else:
        raise SolverError(f"no room for rounding up to {INTERIOR_STEPS[-1]:g} below {best!r}; add a larger step")
    chosen = fmpq_mat([[rational(rounded(float(value), WEIGHT_BITS))] for value in task.back @ task.x.value])
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


def dual_of(dynamics: Dynamics, squares: Blocks) -> Dual:
    """The functional on the squares of N and of dV/dt, for both weights, on bases with so many points."""
    position: dict[Key, int] = {}
    matrices: list[dict[Entry, Row]] = []
    hidden: list[tuple[int, ...]] = []
    changes: list[Array] = []
    n = dynamics.states
    for points, moving in ((dynamics.points, False), (n, True)):
        for basis in forms.bases(points, dynamics.functions, squares):
            rows: dict[Entry, Row] = {}
            for entry, key, factor in basis.terms():
                row = rows.setdefault(entry, {})
                half = factor / (1 if entry[0] == entry[1] else 2)
                fed = {} if forms.cancellable(dynamics, key) else {key: fmpq(1)}
                for target, amount in (forms.contribution(dynamics, key) if moving else fed).items():
                    forms.add(row, position.setdefault(target, len(position)), half * amount)
            matrices.append(rows)
            hidden.append(tuple(i for i in range(basis.size) if not _measured(dynamics, basis, i, moving)))
            changes.append(to_legendre(basis)[np.ix_(hidden[-1], hidden[-1])])
    return Dual(tuple(position), tuple(matrices), tuple(hidden), tuple(changes))


def _measured(dynamics: Dynamics, basis: Basis, i: int, moving: bool) -> bool:
    """Whether a coordinate of a basis belongs to a measured state: to its value, its end value or its history."""
    n = dynamics.states
    start = 0 if moving else dynamics.first
    return i >= start and (i - start) % n >= n - dynamics.measured


def degree_lower(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of a level that Theorem 3 cannot go below at the degree of the theorem.

    With kernels in one variable, where the theorem names it, both weights have the same degree.
    """
    plant, parameters = theorem["plant"], theorem["parameters"]
    degree, narrow = parameters["degree"], "rule" in parameters
    squares, powers = cone_blocks(degree, SOLVED[parameters.get("rule", "each")]), 2 * degree + (3 if narrow else 1)
    if narrow:
        squares = (squares[0], replace(squares[0], weighted=True))
    change = change_of(plant)
    dynamics = dynamics_of(plant, change)
    dual = dual_of(dynamics, squares)
    # The coefficients of 2 v'z at the keys of the dual.
    plain = forms.supply(dynamics, fmpq(0))
    costs = [plain.get(key, fmpq(0)) for key in dual.keys]
    weights = inner_weights(dual, costs, *_equalities(dynamics, dual, costs))
    value = sum((weight * cost for weight, cost in zip(weights, costs, strict=True)), fmpq(0))
    functional = _as_matrices(dynamics, powers, dict(zip(dual.keys, weights, strict=True)))
    return {
        "bound": {"lower": rounded_down(value, LEVEL_BITS)},
        "witness": {"change": written(change), "functional": functional},
    }


def _equalities(dynamics: Dynamics, dual: Dual, costs: list[fmpq]) -> tuple[list[fmpq], fmpq_mat]:
    """y = constant + free t: the solutions of all equations, with the value on |w|^2 + |v|^2 equal to one."""
    count = len(dual.keys)
    rows: list[Row] = []
    for matrix, hidden in zip(dual.matrices, dual.hidden, strict=True):
        indices = set(hidden)
        rows += [row for (i, j), row in matrix.items() if row and not (i in indices and j in indices)]
    unique = {tuple(sorted((k, str(v)) for k, v in row.items())): row for row in rows}
    level = forms.supply(dynamics, fmpq(-1))
    scale = {k: level.get(key, fmpq(0)) - cost for k, (key, cost) in enumerate(zip(dual.keys, costs, strict=True))}
    reduced, pivots = forms.echelon([*unique.values(), {**scale, count: fmpq(1)}], count + 1)
    if count in pivots:
        raise SolverError("the equations of the dual have no solution; the degree is too low")
    columns = [k for k in range(count) if k not in set(pivots)]
    constant = [fmpq(0)] * count
    free = fmpq_mat(count, len(columns))
    for i, pivot in enumerate(pivots):
        constant[pivot] = reduced[i, count]
        for j, column in enumerate(columns):
            free[pivot, j] = -reduced[i, column]
    for j, column in enumerate(columns):
        free[column, j] = fmpq(1)
    return constant, free


def _as_matrices(dynamics: Dynamics, powers: int, weights: Mapping[Key, fmpq]) -> dict[str, Any]:
    """The weights as those of the coefficients of P, Q, S and R, each entry of a symmetric pair on its own."""
    points, functions, each = range(dynamics.points), range(dynamics.functions), range(powers)

    def of(*key: Any, factor: int = 1) -> str:
        *kind, i, j = key
        return str(factor * weights.get((*kind, min(i, j), max(i, j)), fmpq(0)))

    def history(power: int) -> range:
        return range(first := dynamics.points + power * dynamics.functions, first + dynamics.functions)

    def local(*kind: str) -> list[list[list[str]]]:
        return [[[of(*kind, power, k, m) for m in functions] for k in functions] for power in each]

    return {
        "P": [[of("pair", i, j) for j in points] for i in points],
        "Q": [[[of("pair", i, j, factor=2) for j in history(c)] for i in points] for c in each],
        "S": local("local"),
        "R": [[[[of("pair", i, j) for j in history(b)] for i in history(a)] for b in each] for a in each],
        "coupling": local("coupling", "local"),
    }
