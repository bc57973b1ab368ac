"""Semidefinite programs in equality form, and the named solvers that take them: SDPA, with Clarabel as cross-check.

minimise cᵀx subject to A x = b, x = (l, vec X_1, .., vec X_k) with l >= 0 and X_j ⪰ 0. These programs have few
equalities and large blocks; SDPA factors a matrix of the order of the equalities, Clarabel one of the order of all
the entries of the blocks. There is no fallback from one to the other.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.metadata import version

import clarabel
import numpy as np
import scipy.sparse as sparse
from sdpap.param import param
from sdpap.sdpacall import sdpacall
from sdpap.symcone import SymCone
from threadpoolctl import threadpool_limits

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.solvers import quiet_stdout
from replication.estimation.validation import Array


@dataclass(frozen=True)
class Program:
    """Data of a program: `a` (m, l + ΣN_j²), symmetric in each block; `b` (m,); `c` (l + ΣN_j²,)."""

    a: sparse.csr_array
    b: Array
    c: Array
    linear: int
    blocks: tuple[int, ...]


@dataclass(frozen=True)
class Solution:
    """A point with what the solver says of it and what we measure ourselves.

    equality: ‖Ax-b‖∞/(1+‖b‖∞). least_eigenvalue, dual_eigenvalue: the smallest over the blocks of x and of the slack
    c - Aᵀy = s. gap: (|cᵀx-bᵀy| + max(0, -λ_min(s))·tr x)/(1+|cᵀx|), so that a slightly indefinite s cannot hide one.
    slip: |y|ᵀ|Ax-b|, by which, to first order, meeting the equalities may raise the objective.
    """

    linear: Array
    blocks: tuple[Array, ...]
    objective: float
    dual_objective: float
    solver: str
    version: str
    status: str
    iterations: int
    seconds: float
    options: dict[str, float | int]
    equality: float
    least_eigenvalue: float
    dual_eigenvalue: float
    gap: float
    slip: float


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

    def as_dict(self) -> dict[str, float | int]:
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


ENDLESS = 1e9
"""A trace, in the units of the program, beyond which no matrix is looked for; those that are found stay far below."""


def solve_sdpa(program: Program, options: SdpaOptions | None = None) -> Solution:
    """Solve with SDPA (one thread).

    The status is kept as data and is not believed: too small a start makes SDPA call a feasible program infeasible, and
    rounding often stops it just short of the tolerance that it was asked for. Raises InfeasibleError if its multipliers
    prove that every x has a trace beyond ENDLESS (`least_trace`). A point counts if its gap, its residual and its
    eigenvalues, as we measure them, are within the options; else SolverError.
    """
    settings = options or SdpaOptions()
    start = time.perf_counter()
    option = param({**settings.as_dict(), "print": "no", "numThreads": settings.threads})
    with (
        quiet_stdout(),
        threadpool_limits(settings.threads),
    ):  # SDPA's own BLAS may be loaded after other limits were set
        x, y, _, info = sdpacall.solve_sdpa(
            sparse.csc_matrix(program.a),
            sparse.csc_matrix(program.b[:, None]),
            sparse.csc_matrix(program.c[:, None]),
            SymCone(f=0, l=program.linear, q=(), s=program.blocks),
            option,
        )
    vector, multipliers = x.toarray().ravel(), y.toarray().ravel()
    solution = _measured(
        program,
        vector,
        multipliers,
        "SDPA",
        version("sdpa-python"),
        str(info["phasevalue"]),
        int(info["iteration"]),
        time.perf_counter() - start,
        settings.as_dict(),
    )
    trace = least_trace(program, multipliers)
    if trace > ENDLESS:
        raise InfeasibleError(
            f"SDPA proves that there is no solution (status {solution.status}): the matrices would have a trace above "
            f"{trace:.1e}; relax the level or raise the degree"
        )
    residual = max(solution.equality, -solution.least_eigenvalue, -solution.dual_eigenvalue)
    if not (solution.gap <= settings.gap and residual <= settings.residual):
        raise SolverError(
            f"SDPA stopped with status {solution.status} after {solution.iterations} iterations, gap {solution.gap:.1e}"
            f" and residual {residual:.1e}; whether there is a solution is open, it would have a trace above "
            f"{trace:.1e}; raise the degree, or accept the point by `gap` and `residual` of SdpaOptions"
        )
    return solution


def least_trace(program: Program, multipliers: Array) -> float:
    """What y proves of the trace of every feasible x: bᵀy = xᵀAᵀy <= max(0, λ_max(Aᵀy)) tr x; infinite by Farkas."""
    reached = float(program.b @ multipliers)
    against = -(program.a.T @ multipliers)
    most = max(0.0, -_least(against[: program.linear], _blocks(program, against)))
    if reached <= 0.0:
        return 0.0
    return reached / most if most > 0.0 else np.inf


def solve_clarabel(program: Program, tolerance: float = 1e-9, iterations: int = 200) -> Solution:
    """Solve the same program with Clarabel. Raises InfeasibleError or SolverError; only its status Solved counts."""
    start = time.perf_counter()
    select = _triangle_columns(program)
    rows = program.a.shape[0]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.max_iter = iterations
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    unknowns = select.shape[1]
    cones = [
        clarabel.ZeroConeT(rows),
        *([clarabel.NonnegativeConeT(program.linear)] if program.linear else []),
        *[clarabel.PSDTriangleConeT(size) for size in program.blocks],
    ]
    constraint = sparse.vstack([sparse.csc_matrix(program.a @ select), -sparse.identity(unknowns)], format="csc")
    right = np.concatenate([program.b, np.zeros(unknowns)])
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((unknowns, unknowns)), select.T @ program.c, constraint, right, cones, settings
    )
    answer = solver.solve()
    status = str(answer.status)
    if "Infeasible" in status:
        raise InfeasibleError(f"Clarabel found no solution (status {status}); relax the level or raise the degree")
    if status != "Solved":
        raise SolverError(f"Clarabel stopped with status {status} after {answer.iterations} iterations")
    return _measured(
        program,
        select @ np.array(answer.x),
        -np.array(answer.z[:rows]),
        "Clarabel",
        version("clarabel"),
        status,
        int(answer.iterations),
        time.perf_counter() - start,
        {"tolerance": tolerance, "iterations": iterations},
    )


def _triangle_columns(program: Program) -> sparse.csc_array:
    """Map from scaled upper triangles (column-major, off-diagonals times √2) to full vectors."""
    parts: list[sparse.sparray] = [sparse.eye_array(program.linear)]
    for size in program.blocks:
        column, row = np.tril_indices(size)
        index = np.arange(row.size)
        weight = np.where(row == column, 1.0, 1.0 / np.sqrt(2.0))
        first = sparse.coo_array((weight, (row * size + column, index)), shape=(size * size, row.size))
        off = row != column
        second = sparse.coo_array(
            (weight[off], ((column * size + row)[off], index[off])), shape=(size * size, row.size)
        )
        parts.append((first + second).tocsc())
    return sparse.block_diag(parts, format="csc")


def _measured(
    program: Program,
    vector: Array,
    multipliers: Array,
    solver: str,
    release: str,
    status: str,
    iterations: int,
    seconds: float,
    options: dict[str, float | int],
) -> Solution:
    """The solution with its residuals computed from the data of the program, whatever the solver reported."""
    blocks = _blocks(program, vector)
    symmetric = np.concatenate([vector[: program.linear], *[block.ravel() for block in blocks]])
    slack = program.c - program.a.T @ multipliers
    objective, dual = float(program.c @ symmetric), float(program.b @ multipliers)
    missed = np.abs(program.a @ symmetric - program.b)
    below = max(0.0, -_least(slack[: program.linear], _blocks(program, slack)))
    trace = float(np.abs(vector[: program.linear]).sum() + sum(np.trace(block) for block in blocks))
    return Solution(
        linear=vector[: program.linear],
        blocks=tuple(blocks),
        objective=objective,
        dual_objective=dual,
        solver=solver,
        version=release,
        status=status,
        iterations=iterations,
        seconds=seconds,
        options=options,
        equality=float(missed.max(initial=0.0) / (1.0 + np.abs(program.b).max(initial=0.0))),
        least_eigenvalue=_least(vector[: program.linear], blocks),
        dual_eigenvalue=_least(slack[: program.linear], _blocks(program, slack)),
        gap=(abs(objective - dual) + below * trace) / (1.0 + abs(objective)),
        slip=float(np.abs(multipliers) @ missed),
    )


def _blocks(program: Program, vector: Array) -> list[Array]:
    """The symmetric blocks of a vector in the layout of x."""
    blocks, position = [], program.linear
    for size in program.blocks:
        block = vector[position : position + size * size].reshape(size, size)
        blocks.append((block + block.T) / 2.0)
        position += size * size
    return blocks


def _least(linear: Array, blocks: list[Array]) -> float:
    """The smallest entry or eigenvalue."""
    return min([float(linear.min(initial=np.inf)), *(float(np.linalg.eigvalsh(block)[0]) for block in blocks)])
