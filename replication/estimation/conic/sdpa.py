"""Programs by SDPA, which factors a matrix of the order of the multipliers: for large blocks under few equations.

What SDPA says of itself is kept as data and is not believed: a point counts by what is measured on it. There is no
fallback from one solver to the other.

Clarabel's cost ends its growth at about six states. Where the minimiser is not unique, as with many states, SDPA's
matrix gets as ill-conditioned as the square of the gap, and it stops short; the program is then solved again in the
coordinates of the point where it stopped.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from typing import Any

import numpy as np
import scipy
from threadpoolctl import ThreadpoolController

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Inequalities, Options, Program, Solution, SolverReport, program_under
from replication.estimation.validation import Array

ENDLESS = 1e9
"""A trace, in the units of the program, beyond which no matrix is looked for; those that are found stay far below."""


class SdpaGaveUp(SolverError):
    """SDPA ended without an answer; nothing is known of the program."""


@dataclass(frozen=True)
class SdpaOptions:
    """Stopping rules and start of SDPA.

    Attributes
    ----------
    tolerance : float
        Residuals asked for.
    gap_asked : float, optional
        Relative gap asked for, where another one than `tolerance`.
    scale : float
        The start is scale·I, larger than the solution.
    iterations : int
        Steps at most.
    step : float
        Fraction of the step to the boundary.
    gap : float
        Relative gap that must hold by our own measure, see `solve_sdpa`.
    residual : float
        Residuals that must hold by our own measure.
    threads : int
        Threads of the solver.
    """

    tolerance: float = 1e-9
    gap_asked: float | None = None
    scale: float = 1e2
    iterations: int = 100
    step: float = 0.9
    gap: float = 1e-6
    residual: float = 1e-6
    threads: int = 1


def run_sdpa(program: Program, options: Options, threads: int = 1) -> tuple[Array, Array, SolverReport]:
    """The points x and y at which SDPA ended, and what it said, without residuals."""
    with one_process() as process:
        x, y, info = process.answer(program, options, threads)
    report = SolverReport(
        name="SDPA",
        version=version("sdpa-python"),
        status=str(info["phasevalue"]),
        options=dict(options),
        iterations=int(info["iteration"]),
    )
    return x, y, report


@contextmanager
def one_process() -> Iterator[_Process]:
    """Programs that are solved meanwhile share a process, which is begun when the first one comes.

    To begin and end one takes longer than a small program.
    """
    if (shared := _shared.get()) is not None:
        yield shared
        return
    process = _Process()
    token = _shared.set(process)
    try:
        yield process
    finally:
        _shared.reset(token)
        process.end()


class _Process:
    """Where SDPA is called: where a factorisation fails beyond repair, it ends its process, silently and with exit
    code 0.
    """

    def __init__(self) -> None:
        self.child = 0

    def answer(self, *asked: Any) -> Any:
        """What `_called` gives; raises SdpaGaveUp if the process ends without an answer. The next one gets another."""
        if not self.child:
            self._begin()
        try:
            pickle.dump(asked, self._asked)
            self._asked.flush()
            return pickle.load(self._told)
        except (EOFError, BrokenPipeError):
            self.end()
            raise SdpaGaveUp(
                "SDPA gave up in the middle of a factorisation; rescale the plant, or ask for another level"
            ) from None
        except BaseException:
            os.kill(self.child, signal.SIGKILL)
            self.end()
            raise

    def _begin(self) -> None:
        import sdpap.sdpacall  # slow to load; here, for all processes  # noqa: F401

        _libraries()
        (asked, asking), (telling, tell) = os.pipe(), os.pipe()
        self.child = os.fork()
        if self.child == 0:
            try:
                os.close(asking)
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # SDPA's remarks, which its status says too
                with os.fdopen(asked, "rb") as questions, os.fdopen(tell, "wb") as answers:
                    while True:
                        pickle.dump(_called(*pickle.load(questions)), answers)
                        answers.flush()
            finally:
                os._exit(0)
        os.close(asked)
        os.close(tell)
        self._asked, self._told = os.fdopen(asking, "wb"), os.fdopen(telling, "rb")

    def end(self) -> None:
        """End the process and wait for it, if there is one."""
        if self.child:
            with contextlib.suppress(BrokenPipeError):  # of what it never read
                self._asked.close()
            self._told.close()
            os.waitpid(self.child, 0)
            self.child = 0


_shared: ContextVar[_Process | None] = ContextVar("_shared", default=None)


def _called(program: Program, options: Options, threads: int) -> tuple[Array, Array, dict[str, Any]]:
    """x, y and what SDPA says of them."""
    from sdpap.param import param  # slow to load
    from sdpap.sdpacall import sdpacall
    from sdpap.symcone import SymCone

    option = param({**options, "print": "no", "numThreads": threads})
    matrices = (scipy.sparse.csc_matrix(part) for part in (program.a, program.b[:, None], program.c[:, None]))
    cone = SymCone(f=0, l=program.linear, q=(), s=program.blocks)
    with _libraries().limit(limits=threads):
        x, y, _, info = sdpacall.solve_sdpa(*matrices, cone, option)
    return x.toarray().ravel(), y.toarray().ravel(), info


@cache
def _libraries() -> ThreadpoolController:
    """SDPA's own BLAS is among them, since SDPA is imported; finding them takes longer than a small program."""
    return ThreadpoolController()


def solve_sdpa(program: Program, options: SdpaOptions | None = None) -> Solution:
    """Solve with SDPA, on one thread unless the options say otherwise; the residuals are those of `Solution.residuals`.

    The status is not believed: too small a start makes SDPA call a feasible program infeasible, and rounding often
    stops it just short of the tolerance that it was asked for. Raises InfeasibleError if its multipliers prove that
    every x has a trace beyond ENDLESS. A point counts if its gap, its residual and its eigenvalues, as measured, are
    within the options; else SolverError.
    """
    settings = options or SdpaOptions()
    named: Options = {
        "epsilonStar": float(settings.tolerance if settings.gap_asked is None else settings.gap_asked),
        "epsilonDash": float(settings.tolerance),
        "lambdaStar": float(settings.scale),
        "maxIteration": int(settings.iterations),
        "gammaStar": float(settings.step),
    }
    x, y, said = run_sdpa(program, named, settings.threads)
    solution = Solution(program, program.symmetric(x), y, said)
    residuals = solution.residuals()
    trace = program.least_trace(y)
    if trace > ENDLESS:
        raise InfeasibleError(
            f"SDPA proves that there is no solution (status {said.status}): the matrices would have a trace above "
            f"{trace:.1e}; relax the level or raise the degree"
        )
    negative = [-least for name, least in residuals.items() if "eigenvalue" in name]
    gap, residual = residuals["gap"], max(residuals["equalities"], *negative)
    if not (gap <= settings.gap and residual <= settings.residual):
        raise SolverError(
            f"SDPA stopped with status {said.status} after {said.iterations} iterations, gap {gap:.1e}"
            f" and residual {residual:.1e}; whether there is a solution is open, it would have a trace above "
            f"{trace:.1e}; raise the degree, or accept the point by `gap` and `residual` of SdpaOptions"
        )
    return replace(solution, report=replace(said, residuals=residuals))


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
FEWER, LEAST = 0.75, 8
"""Where SDPA gives up it is asked for this share of the iterations, and for no fewer than that: its last points, which
are out of reach on purpose, are those whose matrices rounding spoils."""
FLAT = 1e-14
"""Smallest eigenvalue of a slack, relative to its largest, that the local coordinates tell from zero."""
GAP = 1e-6
"""Largest distance of both objectives, relative to one plus their size, with which a point counts as a solution."""
RESIDUAL = 1e-7
"""Largest violation of the inequalities with which a point counts as a solution."""


@one_process()
def minimise_refined(cost: Array, group: Inequalities) -> tuple[Array, Array, SolverReport]:
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
        what = f"(status {report.status}, residuals {report.residuals})"
        raise SolverError(
            f"SDPA stopped after {report.iterations} iterations short of the accuracy asked for {what}; rescale the "
            "plant, or narrow the range of periods"
        )
    return point, duals, report


def _solve(cost: Array, group: Inequalities, options: Options) -> tuple[Array, Array, SolverReport]:
    """The point and the duals (K, q, q) where SDPA ended; after fewer iterations where it gives up in a later one."""
    program = program_under(cost, group)
    try:
        duals, point, said = run_sdpa(program, options)
    except SdpaGaveUp:
        fewer = int(options["maxIteration"] * FEWER)
        if fewer < LEAST:
            raise
        return _solve(cost, group, {**options, "maxIteration": fewer})
    return point, np.array(program.matrices(duals)), said


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


def _measured(cost: Array, group: Inequalities, x: Array, duals: Array, said: SolverReport) -> SolverReport:
    """What SDPA said, with residuals computed from the data of the program.

    The gap counts what the dual point lacks: its equations times the unknowns, its eigenvalues times the slack.
    """
    slack = group.constant + np.tensordot(x, group.coefficients, axes=(0, 1))
    objective, bound = float(cost @ x), -float(np.sum(group.constant * duals))
    equations = np.abs(np.einsum("kpab,kab->p", group.coefficients, duals) - cost)
    below = np.maximum(0.0, -np.linalg.eigvalsh(duals)[:, 0])
    lacking = float(equations @ np.abs(x) + below @ np.trace(slack, axis1=1, axis2=2))
    residuals = {
        "primal": max(0.0, -float(np.linalg.eigvalsh(slack)[:, 0].min())),
        "dual": float(equations.max()),
        "gap": (abs(objective - bound) + lacking) / (1 + abs(objective)),
    }
    return replace(said, residuals=residuals)
