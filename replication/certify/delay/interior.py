"""Rational weights of a functional in the interior of what a dual program allows: solved, scaled and rounded.

Near the optimum the matrices are nearly singular: they are taken in Legendre polynomials, and scaled by their diagonal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import cvxpy as cp
import numpy as np
from flint import fmpq, fmpq_mat

from replication.certify.delay.forms import Entry, Key
from replication.certify.rounding import as_floats, floats, modelled, rational, rounded
from replication.errors import SolverError
from replication.estimation.validation import Array
from replication.verify.reading import written

INTERIOR_STEPS = (8e-6, 3e-5, 6e-5, 8e-5, 1e-4, 3e-4, 1e-3)
"""Relative distances of the bound from the dual optimum, tried in turn until there is room for rounding."""
INTERIOR_ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the rounding."""
SCALINGS, SEEN = 3, 1e-13
"""How often the coordinates are scaled anew; relative size below which a direction counts as none."""
WEIGHT_BITS = 60

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
    sizes, directions = np.linalg.svd(np.vstack([one @ free for one in maps]), full_matrices=False)[1:]
    back = (directions.T / sizes)[:, sizes > SEEN * sizes[0]]
    x = cp.Variable(back.shape[1])
    grams = []
    for one, change in zip(maps, changes, strict=True):
        gram = cp.reshape(one @ constant + (one @ free @ back) @ x, change.shape, order="C")
        grams.append((gram + gram.T) / 2)
    return Task(x, back, grams, cost @ constant + (cost @ free @ back) @ x)


def inner_weights(dual: Dual, costs: list[fmpq], constant: list[fmpq], free: fmpq_mat) -> list[fmpq]:
    """Rational y in the interior: the largest value first, then the largest margin a little below it.

    Where the optimum is nearly singular the coordinates are scaled by its diagonal, and it is sought again.
    Raises SolverError if there is no room for rounding.
    """
    known = as_floats(written(costs)), as_floats(written(constant)), floats(free)
    tasks = [_task(dual, *known, dual.changes)]
    changes, best = dual.changes, -np.inf
    for _ in range(SCALINGS):
        try:
            best = max(best, _solved(cp.Problem(cp.Maximize(tasks[-1].value), [one >> 0 for one in tasks[-1].grams])))
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
