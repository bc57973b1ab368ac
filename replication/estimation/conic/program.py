"""Semidefinite programs: one form for all, what a point misses, what multipliers prove; and Clarabel.

    minimise c'x  subject to  A x = b,  x = (l, vec X_1, .., vec X_k),  l >= 0,  X_j positive semidefinite,
    maximise b'y  subject to  c - A'y = (s, vec S_1, .., vec S_k),  s >= 0,  S_j positive semidefinite,

are dual to each other. A program in a few matrices under equations is written by the first, one in scalar unknowns
under matrix inequalities by the second (`program_under`).
"""

import warnings
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any

import clarabel
import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InfeasibleError, SolverError
from replication.estimation.validation import Array

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


def minimise_modelled(objective: Any, matrices: Iterable[Any], accept: tuple[str, ...]) -> SolverReport:
    """Minimise a variable of cvxpy with every matrix positive semidefinite; what the solver said.

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
    return report


Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Program:
    """Data of a program: `a` (m, l + ΣN_j²), symmetric in each block; `b` (m,); `c` (l + ΣN_j²,).

    linear: the number l of scalars x; blocks: the orders N_j. Entries of `a` that stand twice count as their sum.
    """

    a: scipy.sparse.csr_array | scipy.sparse.coo_array
    b: Array
    c: Array
    linear: int
    blocks: tuple[int, ...]

    def matrices(self, vector: Array) -> list[Array]:
        """The symmetric blocks of a vector in the layout of x."""
        blocks, position = [], self.linear
        for size in self.blocks:
            block = vector[position : position + size * size].reshape(size, size)
            blocks.append((block + block.T) / 2.0)
            position += size * size
        return blocks

    def symmetric(self, vector: Array) -> Array:
        """The vector with symmetric blocks."""
        return np.concatenate([vector[: self.linear], *[block.ravel() for block in self.matrices(vector)]])

    def least(self, vector: Array) -> float:
        """The smallest scalar or eigenvalue of a vector in the layout of x."""
        eigenvalues = (float(np.linalg.eigvalsh(block)[0]) for block in self.matrices(vector))
        return min([float(vector[: self.linear].min(initial=np.inf)), *eigenvalues])

    def least_trace(self, multipliers: Array) -> float:
        """What y proves of the trace of every feasible x: bᵀy = xᵀAᵀy <= max(0, λ_max(Aᵀy)) tr x.

        Infinite by Farkas' lemma: there is no feasible x then.
        """
        reached = float(self.b @ multipliers)
        most = max(0.0, -self.least(-(self.a.T @ multipliers)))
        if reached <= 0.0:
            return 0.0
        return reached / most if most > 0.0 else np.inf


@dataclass(frozen=True)
class Inequalities:
    """K matrix inequalities constant[k] + sum_p x[variables[k, p]] coefficients[k, p] >= 0 (positive semidefinite).

    Shapes: constant (K, q, q), coefficients (K, p, q, q), all symmetric; variables (K, p), positions in x.
    """

    constant: Array
    coefficients: Array
    variables: Indices


def program_under(cost: Array, *groups: Inequalities) -> Program:
    """Minimise cost'x under all `groups`: the unknowns are the multipliers of the program, the duals its matrices."""
    data, unknowns, entries, constants, blocks, start = [], [], [], [], [], 0
    for group in groups:
        count, terms, size, _ = group.coefficients.shape
        used = np.flatnonzero(group.coefficients)
        inequality, term, entry = np.unravel_index(used, (count, terms, size * size))
        data.append(-group.coefficients.ravel()[used])
        unknowns.append(group.variables[inequality, term])
        entries.append(start + inequality * size * size + entry)
        constants.append(group.constant.ravel())
        blocks += [size] * count
        start += count * size * size
    position = np.concatenate(unknowns), np.concatenate(entries)
    a = scipy.sparse.coo_array((np.concatenate(data), position), shape=(len(cost), start))
    return Program(a, -cost, np.concatenate(constants), 0, tuple(blocks))


@dataclass(frozen=True)
class Solution:
    """A pair of points with what the solver said of it; x has symmetric blocks, multipliers is y."""

    program: Program
    x: Array
    multipliers: Array
    report: SolverReport

    @property
    def linear(self) -> Array:
        """The part l of x."""
        return self.x[: self.program.linear]

    @property
    def blocks(self) -> tuple[Array, ...]:
        """The parts X_j of x."""
        return tuple(self.program.matrices(self.x))

    @property
    def objective(self) -> float:
        """cᵀx."""
        return float(self.program.c @ self.x)

    @property
    def dual_objective(self) -> float:
        """bᵀy."""
        return float(self.program.b @ self.multipliers)

    @property
    def missed(self) -> Array:
        """|Ax-b|."""
        return np.asarray(np.abs(self.program.a @ self.x - self.program.b))

    @property
    def slip(self) -> float:
        """|y|ᵀ|Ax-b|, by which, to first order, meeting the equalities may raise the objective."""
        return float(np.abs(self.multipliers) @ self.missed)

    def residuals(self) -> dict[str, float]:
        """What the points miss, computed from the data of the program, whatever the solver reported.

        equalities: ‖Ax-b‖∞/(1+‖b‖∞). The least eigenvalues of x and of the slack s = c - Aᵀy. gap: (|cᵀx-bᵀy| +
        max(0, -λ_min(s))·tr x)/(1+|cᵀx|), so that a slightly indefinite s cannot hide one.
        """
        program, objective = self.program, self.objective
        least = program.least(program.c - program.a.T @ self.multipliers)
        trace = float(np.abs(self.linear).sum() + sum(np.trace(block) for block in self.blocks))
        return {
            "equalities": float(self.missed.max(initial=0.0) / (1.0 + np.abs(program.b).max(initial=0.0))),
            "least eigenvalue": program.least(self.x),
            "least eigenvalue of the dual": least,
            "gap": (abs(objective - self.dual_objective) + max(0.0, -least) * trace) / (1.0 + abs(objective)),
        }


def symmetric_basis(size: int) -> Array:
    """The symmetric unit matrices E_l, stacked (size (size + 1) / 2, size, size), in the order of the upper
    triangle."""
    rows, columns = np.triu_indices(size)
    basis = np.zeros((len(rows), size, size))
    basis[np.arange(len(rows)), rows, columns] = 1.0
    basis[np.arange(len(rows)), columns, rows] = 1.0
    return basis


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
    point = clarabel.DefaultSolver(scipy.sparse.csc_matrix((len(q), len(q))), q, matrix, right, cones, settings).solve()
    report = SolverReport(
        name="Clarabel",
        version=version("clarabel"),
        status=str(point.status),
        options=chosen,
        residuals={
            "primal": float(point.r_prim),
            "dual": float(point.r_dual),
            "gap": abs(float(point.obj_val) - float(point.obj_val_dual)),
        },
        iterations=int(point.iterations),
    )
    raise_unless_solved(report, accept=accept)
    triangles, y = (point.x, -np.array(point.z[: len(program.b)])) if matrices else (point.z, np.array(point.x))
    x = np.zeros(program.a.shape[1])
    x[place] = x[mirrored] = np.array(triangles) / weights
    return Solution(program, x, y, report)


def _packed(program: Program, place: Indices, weights: Array) -> scipy.sparse.csc_matrix:
    """Aᵀ on the scaled triangles."""
    entries = scipy.sparse.coo_array(program.a)
    row = np.full(program.a.shape[1], -1)
    row[place] = np.arange(len(place))
    row = row[entries.col]
    mask = row >= 0
    data = entries.data[mask] * weights[row[mask]]
    return scipy.sparse.csc_matrix((data, (row[mask], entries.row[mask])), shape=(len(place), len(program.b)))


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
