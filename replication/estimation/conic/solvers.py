"""What a numerical solver said of itself, kept beside every solution that came from one."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from replication.errors import InfeasibleError, SolverError

Options = dict[str, float | int | bool]

# Tight enough that the level agrees with the Riccati route to ten digits where the problem allows it.
CLARABEL_OPTIONS: Options = {
    "tol_gap_abs": 1e-12,
    "tol_gap_rel": 1e-12,
    "tol_feas": 1e-8,
    "tol_infeas_abs": 1e-8,
    "tol_infeas_rel": 1e-8,
    "max_iter": 200,
}


@dataclass(frozen=True, kw_only=True)
class SolverReport:
    """Name, version, status, options, residuals and iterations of one solver call; `to_dict` gives JSON values."""

    name: str
    version: str
    status: str
    options: Options = field(default_factory=dict)
    residuals: dict[str, float] = field(default_factory=dict)
    iterations: int | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return asdict(self)

    def with_residuals(self, measured: dict[str, float]) -> SolverReport:
        """The same with residuals that were measured on the point, whatever the solver said of it."""
        return replace(self, residuals=measured)


def raise_unless_solved(report: SolverReport, *, accept: tuple[str, ...]) -> None:
    """Raise InfeasibleError or SolverError unless the status is one of `accept`."""
    if report.status in accept:
        return
    if "infeasible" in report.status.lower():
        raise InfeasibleError(
            f"{report.name} finds the problem infeasible or unbounded (status {report.status}); check that the sensors "
            "detect every unstable mode, or ask for a larger level"
        )
    raise SolverError(
        f"{report.name} stopped with status {report.status} after {report.iterations} iterations (residuals "
        f"{report.residuals}); rescale the states of the plant, or use the Riccati route"
    )


def solve_modelled(problem: Any, options: Options = CLARABEL_OPTIONS) -> str:
    """Solve a problem of cvxpy with Clarabel on one thread; the status, which says too whether it is inaccurate.

    Raises SolverError if Clarabel gives no answer at all.
    """
    import cvxpy

    try:
        with warnings.catch_warnings():
            # cvxpy warns of an inaccurate solution; here its status says so, and the caller decides.
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cvxpy.CLARABEL, max_threads=1, **options)
    except cvxpy.error.SolverError as error:
        raise SolverError(
            f"Clarabel through cvxpy failed: {error}; rescale the plant, or use the Riccati route"
        ) from None
    return str(problem.status)


def minimise_modelled(
    objective: Any, matrices: Iterable[Any], accept: tuple[str, ...]
) -> tuple[SolverReport, list[Any]]:
    """Minimise a variable of cvxpy with every matrix positive semidefinite; the report, and the constraints.

    Raises InfeasibleError or SolverError unless the status is one of `accept`.
    """
    import cvxpy

    constraints = [(matrix + matrix.T) / 2 >> 0 for matrix in matrices]
    problem = cvxpy.Problem(cvxpy.Minimize(objective), constraints)
    status = solve_modelled(problem)
    stats = problem.solver_stats
    report = SolverReport(
        name=f"Clarabel {version('clarabel')} through cvxpy",
        version=version("cvxpy"),
        status=status,
        options=dict(CLARABEL_OPTIONS),
        residuals={"largest violation": max(float(np.max(c.violation())) for c in constraints)}
        if objective.value is not None
        else {},
        iterations=int(stats.num_iters) if stats and stats.num_iters is not None else None,
    )
    raise_unless_solved(report, accept=accept)
    return report, constraints


@contextmanager
def quiet_stdout() -> Iterator[None]:
    """Silence the remarks that SDPA's compiled code writes to file descriptor 1; its status says the same."""
    sys.stdout.flush()
    saved, sink = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 1)
        yield
    finally:
        os.dup2(saved, 1)
        os.close(saved)
        os.close(sink)
