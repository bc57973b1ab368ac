"""Programs by SDPA, which factors a matrix of the order of the multipliers: for large blocks under few equations.

What SDPA says of itself is kept as data and is not believed: a point counts by what is measured on it. There is no
fallback from one solver to the other.
"""

from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from typing import TypeVar, cast

import scipy
from threadpoolctl import ThreadpoolController

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Program, Solution
from replication.estimation.conic.solvers import Options, SolverReport, quiet_stdout
from replication.estimation.validation import Array

T = TypeVar("T")
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
        Relative gap and residuals asked for.
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
    scale: float = 1e2
    iterations: int = 100
    step: float = 0.9
    gap: float = 1e-6
    residual: float = 1e-6
    threads: int = 1

    def as_dict(self) -> Options:
        """The options under SDPA's own names.

        Returns
        -------
        dict
            As its parameters are called.
        """
        return {
            "epsilonStar": float(self.tolerance),
            "epsilonDash": float(self.tolerance),
            "lambdaStar": float(self.scale),
            "maxIteration": int(self.iterations),
            "gammaStar": float(self.step),
        }


def run_sdpa(program: Program, options: Options, threads: int = 1) -> tuple[Array, Array, SolverReport]:
    """The points x and y at which SDPA ended, and what it said, without residuals."""
    from sdpap.param import param  # slow to load
    from sdpap.sdpacall import sdpacall
    from sdpap.symcone import SymCone

    option = param({**options, "print": "no", "numThreads": threads})
    arguments = (
        scipy.sparse.csc_matrix(program.a),
        scipy.sparse.csc_matrix(program.b[:, None]),
        scipy.sparse.csc_matrix(program.c[:, None]),
        SymCone(f=0, l=program.linear, q=(), s=program.blocks),
        option,
    )
    with quiet_stdout(), _libraries().limit(limits=threads):
        x, y, _, info = _apart(lambda: sdpacall.solve_sdpa(*arguments))
    report = SolverReport(
        name="SDPA",
        version=version("sdpa-python"),
        status=str(info["phasevalue"]),
        options=dict(options),
        iterations=int(info["iteration"]),
    )
    return x.toarray().ravel(), y.toarray().ravel(), report


def _apart(call: Callable[[], T]) -> T:
    """What `call` returns, from a process of its own; raises SdpaGaveUp if that process ends without an answer.

    Where a factorisation fails beyond repair, SDPA ends its process, silently and with exit code 0.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            with os.fdopen(writing, "wb") as stream:
                pickle.dump(call(), stream)
        finally:
            os._exit(0)
    os.close(writing)
    try:
        with os.fdopen(reading, "rb") as stream:
            answer = stream.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        os.waitpid(child, 0)
    if not answer:
        raise SdpaGaveUp("SDPA gave up in the middle of a factorisation; rescale the plant, or ask for another level")
    return cast(T, pickle.loads(answer))


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
    x, y, said = run_sdpa(program, settings.as_dict(), settings.threads)
    solution = Solution(program, program.symmetric(x), y, said)
    found = solution.residuals()
    trace = program.least_trace(y)
    if trace > ENDLESS:
        raise InfeasibleError(
            f"SDPA proves that there is no solution (status {said.status}): the matrices would have a trace above "
            f"{trace:.1e}; relax the level or raise the degree"
        )
    gap, residual = found["gap"], max(found["equalities"], *(-found[name] for name in found if "eigenvalue" in name))
    if not (gap <= settings.gap and residual <= settings.residual):
        raise SolverError(
            f"SDPA stopped with status {said.status} after {said.iterations} iterations, gap {gap:.1e}"
            f" and residual {residual:.1e}; whether there is a solution is open, it would have a trace above "
            f"{trace:.1e}; raise the degree, or accept the point by `gap` and `residual` of SdpaOptions"
        )
    return replace(solution, report=said.with_residuals(found))
