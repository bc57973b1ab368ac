"""Semidefinite programs in the form: minimise c'x subject to affine matrix inequalities, given directly to Clarabel."""

from __future__ import annotations

from dataclasses import dataclass

import clarabel
import numpy as np
import numpy.typing as npt
import scipy.sparse

from replication.estimation.conic.solvers import SolverReport, clarabel_report, clarabel_settings, raise_unless_solved
from replication.estimation.validation import Array

Indices = npt.NDArray[np.intp]

SOLVED = ("Solved",)
ALMOST = ("Solved", "AlmostSolved")
"""For callers that re-evaluate what they get without trusting the solver."""


@dataclass(frozen=True)
class Inequalities:
    """K matrix inequalities constant[k] + sum_p x[variables[k, p]] coefficients[k, p] >= 0 (positive semidefinite).

    Shapes: constant (K, q, q), coefficients (K, p, q, q), all symmetric; variables (K, p), positions in x.
    """

    constant: Array
    coefficients: Array
    variables: Indices


@dataclass(frozen=True)
class SdpSolution:
    """x: the minimiser; duals: one array (K, q, q) per group of inequalities; report: what the solver said."""

    x: Array
    duals: tuple[Array, ...]
    report: SolverReport


def minimise(
    cost: Array, groups: tuple[Inequalities, ...], *, accept: tuple[str, ...] = SOLVED, gap: float | None = None
) -> SdpSolution:
    """Minimise cost'x under all `groups`, to a relative duality `gap` if given, else to that of `CLARABEL_OPTIONS`.

    Raises InfeasibleError or SolverError unless the status is in `accept`.
    """
    settings = clarabel_settings()
    if gap is not None:
        settings.tol_gap_rel = settings.tol_gap_abs = gap
    rows, bounds, cones = [], [], []
    for group in groups:
        count, size = group.constant.shape[:2]
        bounds.append(_pack(group.constant).ravel())
        rows.append(_constraint_rows(group, len(cost)))
        cones.extend([clarabel.PSDTriangleConeT(size)] * count)
    matrix = scipy.sparse.vstack(rows, format="csc")
    quadratic = scipy.sparse.csc_matrix((len(cost), len(cost)))
    solver = clarabel.DefaultSolver(quadratic, cost, matrix, np.concatenate(bounds), cones, settings)
    solution = solver.solve()
    report = clarabel_report(solution)
    raise_unless_solved(report, accept=accept)
    return SdpSolution(np.array(solution.x), _duals(np.array(solution.z), groups), report)


def symmetric_basis(size: int) -> Array:
    """The symmetric unit matrices E_l, stacked (size (size + 1) / 2, size, size), in the order of the upper
    triangle."""
    rows, columns = np.triu_indices(size)
    basis = np.zeros((len(rows), size, size))
    basis[np.arange(len(rows)), rows, columns] = 1.0
    basis[np.arange(len(rows)), columns, rows] = 1.0
    return basis


def _triangle(size: int) -> tuple[Indices, Indices, Array]:
    """Rows, columns and weights of Clarabel's scaled upper triangle, stacked column by column."""
    columns, rows = np.tril_indices(size)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def _pack(matrices: Array) -> Array:
    rows, columns, weights = _triangle(matrices.shape[-1])
    return np.asarray(matrices[..., rows, columns] * weights)


def _constraint_rows(group: Inequalities, unknowns: int) -> scipy.sparse.csc_matrix:
    """Rows of A in Clarabel's A x + s = b, s in the cone: minus the packed coefficients."""
    packed = -_pack(group.coefficients)
    count, _, length = packed.shape
    row = np.arange(count)[:, None, None] * length + np.arange(length)[None, None, :]
    row = np.broadcast_to(row, packed.shape)
    column = np.broadcast_to(group.variables[:, :, None], packed.shape)
    used = packed != 0
    return scipy.sparse.csc_matrix((packed[used], (row[used], column[used])), shape=(count * length, unknowns))


def _duals(z: Array, groups: tuple[Inequalities, ...]) -> tuple[Array, ...]:
    duals, start = [], 0
    for group in groups:
        count, size = group.constant.shape[:2]
        rows, columns, weights = _triangle(size)
        packed = z[start : start + count * len(rows)].reshape(count, -1) / weights
        start += packed.size
        matrices = np.zeros((count, size, size))
        matrices[:, rows, columns] = packed
        matrices[:, columns, rows] = packed
        duals.append(matrices)
    return tuple(duals)
