"""The programs of `sdp` by SDPA: few unknowns, large inequalities, as those of (10) for plants of many states.

SDPA factors a matrix of the order of the unknowns, Clarabel one of the order of all entries of the inequalities, which
ends its growth at about six states. Where the minimiser is not unique, as with many states, that matrix gets as
ill-conditioned as the square of the gap, and SDPA stops short; the program is then solved again in the coordinates of
the point where it stopped. What SDPA says of itself is not believed: the point counts by the measures below.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version

import numpy as np
import scipy.sparse
from sdpap.param import param
from sdpap.sdpacall import sdpacall
from sdpap.symcone import SymCone
from threadpoolctl import ThreadpoolController

from replication.errors import SolverError
from replication.estimation.conic.clarabel_blocks import Inequalities
from replication.estimation.conic.solvers import SolverReport, quiet_stdout
from replication.estimation.validation import Array

Options = dict[str, float | int | bool]

OPTIONS: Options = {
    "epsilonStar": 1e-12,
    # Out of reach on purpose: once SDPA holds a point for feasible it takes steps that end short of 1e-6.
    "epsilonDash": 1e-20,
    "lambdaStar": 1e4,
    "betaStar": 0.05,
    "betaBar": 0.1,
    "gammaStar": 0.9,
    "maxIteration": 60,
}
LOCAL_OPTIONS: Options = {**OPTIONS, "lambdaStar": 1e2, "epsilonStar": 1e-10, "epsilonDash": 1e-8}
"""In local coordinates the solution lies near the start, and SDPA may end by its own measure: its gap there is
relative to the one that the first solution left."""
REFINEMENTS = 2
"""Times that a program is solved again in the coordinates of the last point; one was enough for all that was met."""
FLAT = 1e-14
"""Smallest eigenvalue of a slack, relative to its largest, that the local coordinates tell from zero."""
GAP = 1e-6
"""Largest distance of both objectives, relative to one plus their size, with which a point counts as a solution."""
RESIDUAL = 1e-7
"""Largest violation of the inequalities with which a point counts as a solution."""
VERSION = version("sdpa-python")


def minimise_dense(cost: Array, group: Inequalities) -> tuple[Array, Array, SolverReport]:
    """Minimise cost'x subject to the inequalities of `group`, each of which has all unknowns in their order.

    Returns the minimiser, the duals (K, q, q) and a report with what the solver said and the gap and residuals as
    measured here, in the units of the program. A feasible point with too large a gap is refined. Raises SolverError if
    the gap exceeds GAP or an inequality is violated by more than RESIDUAL all the same.
    """
    point, duals, said = _solve(cost, group, OPTIONS)
    report = _measured(cost, group, point, duals, said)
    for refinement in range(1, REFINEMENTS + 1):
        if _accurate(report) or report.residuals["primal"] > RESIDUAL:
            break
        local = _local(cost, group, point)
        step, duals, said = _solve(local.cost, local.group, LOCAL_OPTIONS)
        point = point + np.linalg.solve(local.unknowns, step)
        duals = local.size * np.swapaxes(local.slacks, 1, 2) @ duals @ local.slacks
        said = replace(said, options={**LOCAL_OPTIONS, "refinement": refinement})
        report = _measured(cost, group, point, duals, said)
    if not _accurate(report):
        told = f"(status {report.status}, residuals {report.residuals})"
        raise SolverError(
            f"SDPA stopped after {report.iterations} iterations short of the accuracy asked for {told}; rescale the "
            "plant, or narrow the range of periods"
        )
    return point, duals, report


def _accurate(report: SolverReport) -> bool:
    return report.residuals["gap"] <= GAP and report.residuals["primal"] <= RESIDUAL


@dataclass(frozen=True)
class _Local:
    """A program in the coordinates of a point x0: x = x0 + unknowns^-1 step, slacks S become slacks S slacks'.

    The slacks at x0 are then the identity and the coefficients orthonormal: the steps of length one fill the ellipsoid
    within which every x is feasible. The cost is of length one, `size` times smaller than in the original units.
    """

    cost: Array
    group: Inequalities
    unknowns: Array
    slacks: Array
    size: float


def _local(cost: Array, group: Inequalities, x0: Array) -> _Local:
    count, unknowns, order, _ = group.coefficients.shape
    values, vectors = np.linalg.eigh(group.constant + np.tensordot(x0, group.coefficients, axes=(0, 1)))
    floor = np.maximum(values, FLAT * values[:, -1:])
    slacks = np.swapaxes(vectors / np.sqrt(floor)[:, None, :], 1, 2)
    moved = slacks[:, None] @ group.coefficients @ np.swapaxes(slacks, 1, 2)[:, None]
    # Orthonormal by reflections, not by the Gram matrix, whose condition is the square.
    basis, triangle = np.linalg.qr(moved.transpose(0, 2, 3, 1).reshape(-1, unknowns))
    coefficients = basis.reshape(count, order, order, unknowns).transpose(0, 3, 1, 2)
    coefficients = (coefficients + np.swapaxes(coefficients, 2, 3)) / 2
    constant = (values / floor)[:, :, None] * np.eye(order)
    cost = np.linalg.solve(triangle.T, cost)
    size = float(np.linalg.norm(cost))
    return _Local(cost / size, Inequalities(constant, coefficients, group.variables), triangle, slacks, size)


@dataclass(frozen=True)
class _Said:
    """What SDPA said of a solution, and with which options it ran."""

    status: str
    iterations: int
    options: Options


def _solve(cost: Array, group: Inequalities, options: Options) -> tuple[Array, Array, _Said]:
    """The point and the duals (K, q, q) at which SDPA ended."""
    count, unknowns, size, _ = group.coefficients.shape
    rows = scipy.sparse.csc_matrix(-group.coefficients.transpose(1, 0, 2, 3).reshape(unknowns, -1))
    cones = SymCone(f=0, l=0, q=(), s=(size,) * count)
    option = param({**options, "print": "no", "numThreads": 1})
    with quiet_stdout(), _libraries().limit(limits=1):
        dual, x, _, info = sdpacall.solve_sdpa(
            rows,
            scipy.sparse.csc_matrix(-cost[:, None]),
            scipy.sparse.csc_matrix(group.constant.reshape(-1, 1)),
            cones,
            option,
        )
    duals = dual.toarray().reshape(count, size, size)
    said = _Said(str(info["phasevalue"]), int(info["iteration"]), options)
    return x.toarray().ravel(), (duals + np.swapaxes(duals, 1, 2)) / 2, said


@cache
def _libraries() -> ThreadpoolController:
    """SDPA's own BLAS is among them, since SDPA is imported; finding them takes longer than a small program."""
    return ThreadpoolController()


def _measured(cost: Array, group: Inequalities, x: Array, duals: Array, said: _Said) -> SolverReport:
    """What SDPA said, with residuals computed from the data of the program.

    The gap counts what the dual point lacks: its equations times the unknowns, its eigenvalues times the slack.
    """
    slack = group.constant + np.tensordot(x, group.coefficients, axes=(0, 1))
    objective, bound = float(cost @ x), -float(np.sum(group.constant * duals))
    equations = np.abs(np.einsum("kpab,kab->p", group.coefficients, duals) - cost)
    below = np.maximum(0.0, -np.linalg.eigvalsh(duals)[:, 0])
    lacking = float(equations @ np.abs(x) + below @ np.trace(slack, axis1=1, axis2=2))
    return SolverReport(
        name="SDPA",
        version=VERSION,
        status=said.status,
        options=dict(said.options),
        residuals={
            "primal": max(0.0, -float(np.linalg.eigvalsh(slack)[:, 0].min())),
            "dual": float(equations.max()),
            "gap": (abs(objective - bound) + lacking) / (1 + abs(objective)),
        },
        iterations=said.iterations,
    )
