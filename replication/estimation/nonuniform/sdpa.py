"""The programs of `sdp` by SDPA: few unknowns, large inequalities, as those of (10) for plants of many states.

SDPA factors a matrix of the order of the unknowns, Clarabel one of the order of all entries of the inequalities, which
ends its growth at about six states. What SDPA says of itself is not believed: the point counts by the measures below.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import version

import numpy as np
import scipy.sparse
from sdpap.param import param
from sdpap.sdpacall import sdpacall
from sdpap.symcone import SymCone
from threadpoolctl import ThreadpoolController

from replication.errors import SolverError
from replication.estimation.nonuniform.sdp import Inequalities
from replication.estimation.solvers import SolverReport, quiet_stdout
from replication.estimation.validation import Array

OPTIONS: dict[str, float | int | bool] = {
    "epsilonStar": 1e-12,
    # Out of reach on purpose: once SDPA holds a point for feasible it takes steps that end short of 1e-6.
    "epsilonDash": 1e-20,
    "lambdaStar": 1e4,
    "betaStar": 0.05,
    "betaBar": 0.1,
    "gammaStar": 0.9,
    "maxIteration": 60,
}
GAP = 1e-6
"""Largest distance of both objectives, relative to one plus their size, with which a point counts as a solution."""
RESIDUAL = 1e-7
"""Largest violation of the inequalities with which a point counts as a solution."""
VERSION = version("sdpa-python")


def minimise_dense(cost: Array, group: Inequalities) -> tuple[Array, Array, SolverReport]:
    """Minimise cost'x subject to the inequalities of `group`, each of which has all unknowns in their order.

    Returns the minimiser, the duals (K, q, q) and a report with what the solver said and the gap and residuals as
    measured here. Raises SolverError if the gap exceeds GAP or an inequality is violated by more than RESIDUAL.
    """
    count, unknowns, size, _ = group.coefficients.shape
    rows = scipy.sparse.csc_matrix(-group.coefficients.transpose(1, 0, 2, 3).reshape(unknowns, -1))
    cones = SymCone(f=0, l=0, q=(), s=(size,) * count)
    option = param({**OPTIONS, "print": "no", "numThreads": 1})
    with quiet_stdout(), _libraries().limit(limits=1):
        dual, x, _, info = sdpacall.solve_sdpa(
            rows,
            scipy.sparse.csc_matrix(-cost[:, None]),
            scipy.sparse.csc_matrix(group.constant.reshape(-1, 1)),
            cones,
            option,
        )
    point = x.toarray().ravel()
    duals = dual.toarray().reshape(count, size, size)
    duals = (duals + np.swapaxes(duals, 1, 2)) / 2
    report = _measured(cost, group, point, duals, str(info["phasevalue"]), int(info["iteration"]))
    if not (report.residuals["gap"] <= GAP and report.residuals["primal"] <= RESIDUAL):
        told = f"(status {report.status}, residuals {report.residuals})"
        raise SolverError(
            f"SDPA stopped after {report.iterations} iterations short of the accuracy asked for {told}; rescale the "
            "plant, or narrow the range of periods"
        )
    return point, duals, report


@cache
def _libraries() -> ThreadpoolController:
    """SDPA's own BLAS is among them, since SDPA is imported; finding them takes longer than a small program."""
    return ThreadpoolController()


def _measured(cost: Array, group: Inequalities, x: Array, duals: Array, status: str, iterations: int) -> SolverReport:
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
        status=status,
        options=dict(OPTIONS),
        residuals={
            "primal": max(0.0, -float(np.linalg.eigvalsh(slack)[:, 0].min())),
            "dual": float(equations.max()),
            "gap": (abs(objective - bound) + lacking) / (1 + abs(objective)),
        },
        iterations=iterations,
    )
