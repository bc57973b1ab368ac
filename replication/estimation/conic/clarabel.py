"""Programs by Clarabel, which factors a matrix of the order of all entries of the blocks: for few or small blocks."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import clarabel
import numpy as np
import scipy

from replication.estimation.conic.program import Indices, Program, Solution
from replication.estimation.conic.solvers import CLARABEL_OPTIONS, SolverReport, raise_unless_solved
from replication.estimation.validation import Array

SOLVED = ("Solved",)
ALMOST = ("Solved", "AlmostSolved")
"""For callers that re-evaluate what they get without trusting the solver, and then owe the reader that word."""


def solve_clarabel(
    program: Program, *, accept: tuple[str, ...] = SOLVED, matrices: bool = False, **options: float | int
) -> Solution:
    """Solve with Clarabel on one thread: same input, same output.

    matrices: Clarabel's unknowns are x under the equations, which then hold as accurately as asked for, instead of y
    under the inequalities. options: in place of those of CLARABEL_OPTIONS. Raises InfeasibleError or SolverError unless
    the status is in `accept`.
    """
    chosen = {**CLARABEL_OPTIONS, **options}
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    for name, value in chosen.items():
        setattr(settings, name, value)
    place, mirrored, weights = _triangles(program)
    # An unknown off the diagonal stands for two entries of x, each of them 1/sqrt(2) times it.
    factors = np.where(place == mirrored, 1.0, 2.0 / weights) if matrices else weights
    packed, cost = _packed(program, place, factors), program.c[place] * factors
    cones: list[Any] = [clarabel.NonnegativeConeT(program.linear)] if program.linear else []
    cones += [clarabel.PSDTriangleConeT(size) for size in program.blocks]
    # Clarabel's own form: minimise q'u subject to M u + s = h with s in the cones.
    q, matrix, right = -program.b, packed, cost
    if matrices:
        cones.insert(0, clarabel.ZeroConeT(len(program.b)))
        q, right = cost, np.concatenate([program.b, np.zeros(len(place))])
        matrix = scipy.sparse.vstack([packed.T, -scipy.sparse.identity(len(place))], format="csc")
    said = clarabel.DefaultSolver(scipy.sparse.csc_matrix((len(q), len(q))), q, matrix, right, cones, settings).solve()
    report = SolverReport(
        name="Clarabel",
        version=version("clarabel"),
        status=str(said.status),
        options=chosen,
        residuals={
            "primal": float(said.r_prim),
            "dual": float(said.r_dual),
            "gap": abs(float(said.obj_val) - float(said.obj_val_dual)),
        },
        iterations=int(said.iterations),
    )
    raise_unless_solved(report, accept=accept)
    triangles, y = (said.x, -np.array(said.z[: len(program.b)])) if matrices else (said.z, np.array(said.x))
    x = np.zeros(program.a.shape[1])
    x[place] = x[mirrored] = np.array(triangles) / weights
    return Solution(program, x, y, report)


def _packed(program: Program, place: Indices, weights: Array) -> scipy.sparse.csc_matrix:
    """Aᵀ on the scaled triangles."""
    entries = scipy.sparse.coo_array(program.a)
    row = np.full(program.a.shape[1], -1)
    row[place] = np.arange(len(place))
    row = row[entries.col]
    kept = row >= 0
    data = entries.data[kept] * weights[row[kept]]
    return scipy.sparse.csc_matrix((data, (row[kept], entries.row[kept])), shape=(len(place), len(program.b)))


def _triangles(program: Program) -> tuple[Indices, Indices, Array]:
    """Where the entries of Clarabel's scaled upper triangles, stacked column by column, stand in x, above and below the
    diagonal, and their weights."""
    scalars = np.arange(program.linear)
    above, below, weights, start = [scalars], [scalars], [np.ones(program.linear)], program.linear
    indices = {size: np.tril_indices(size) for size in set(program.blocks)}
    for size in program.blocks:
        column, row = indices[size]
        above.append(start + row * size + column)
        below.append(start + column * size + row)
        weights.append(np.where(row == column, 1.0, np.sqrt(2.0)))
        start += size * size
    return np.concatenate(above), np.concatenate(below), np.concatenate(weights)
