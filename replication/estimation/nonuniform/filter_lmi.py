"""Theorem 3: the LMI (10) over a grid of sampling periods, the recovery (11) of the filter, given directly to a
solver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from replication.errors import SolverError
from replication.estimation.conic.clarabel import ALMOST, solve_clarabel
from replication.estimation.conic.program import Inequalities, program_under, symmetric_basis
from replication.estimation.conic.refined import minimise_refined
from replication.estimation.conic.solvers import SolverReport
from replication.estimation.linear.norms import hinf_norm
from replication.estimation.nonuniform.filters import Filter, gramian
from replication.estimation.nonuniform.plant import SampledPlant, as_periods
from replication.estimation.validation import Array


class Solver(StrEnum):
    """Which solver (10) is given to; there is no fallback from one to the other."""

    CLARABEL = "few states, one period: converges where the optimum is not attained"
    SDPA = "many states, several periods: cost grows with the unknowns, not with the entries of (10)"


@dataclass(frozen=True)
class LmiVariables:
    """The unknowns of (10): Z, Y symmetric (n, n), F (n, r), G (s, n), Q (n, n), delta = gamma^2 (scalar).

    Every array may carry leading axes: the inequality is then formed for each entry of the stack.
    """

    Z: Array
    Y: Array
    F: Array
    G: Array
    Q: Array
    delta: Array


@dataclass(frozen=True)
class LmiSolution:
    """level: gamma of the LMI; variables: in the normalised coordinates of `Normalised`.

    periods: the grid; weights: trace of the dual of each period's inequality, 0 if it could be left out;
    report: what the solver said.
    """

    level: float
    variables: LmiVariables
    periods: tuple[float, ...]
    weights: tuple[float, ...]
    report: SolverReport


@dataclass(frozen=True)
class FilterDesign(LmiSolution):
    """A solution of the LMI with the filter that (11) recovers from it."""

    filter: Filter


@dataclass(frozen=True)
class Normalised:
    """`plant` with state T x, outputs y / sensor (r,) and z / scale: its unknowns are of the order of one."""

    plant: SampledPlant
    T: Array
    scale: float
    sensor: Array

    def restore(self, filter_: Filter) -> Filter:
        """The filter for the original plant; its state estimates the original state."""
        inverse = np.linalg.inv(self.T)
        return Filter(inverse @ filter_.A @ self.T, inverse @ filter_.B / self.sensor, self.scale * filter_.C @ self.T)


def normalise(plant: SampledPlant, h: float) -> Normalised:
    """Coordinates in which the controllability Gramian at period h is about the identity, z in units of its own
    gain."""
    Phi, Gamma = plant.discretise(h)
    reached = gramian(Phi, Gamma)
    reached += 1e-6 * np.trace(reached) / plant.order * np.eye(plant.order)
    T = np.linalg.inv(np.linalg.cholesky(reached))
    moved = plant.in_coordinates(T)
    scale = hinf_norm(Phi, Gamma, plant.L, np.zeros((len(plant.L), Gamma.shape[1]))).value or 1.0
    # Powers of two change no digit.
    sensor = np.exp2(np.round(np.log2(np.linalg.norm(np.hstack([moved.C, moved.D]), axis=1))))
    C, D = (matrix / sensor[:, None] for matrix in (moved.C, moved.D))
    return Normalised(SampledPlant(moved.A, moved.B, C, D, moved.L / scale), T, scale, sensor)


def lmi10(plant: SampledPlant, Phi: Array, Gamma: Array, v: LmiVariables) -> Array:
    """The matrix of (10), order 4n + s + m, blocks (Z, Y | e | Z, Y | w); negative definite iff (6) is solvable.

    Phi (n, n) and Gamma (n, m) belong to one period h; either they or `v` may be a stack.
    """
    C, D, L = plant.C, plant.D, plant.L
    n, m, s = plant.order, Gamma.shape[-1], len(L)
    corner = _blocks(
        [
            [v.Z @ Phi, v.Z @ Phi, v.Z @ Gamma],
            [v.Y @ Phi + v.F @ C + v.Q, v.Y @ Phi + v.F @ C, v.Y @ Gamma + v.F @ D],
            [L - v.G, L, np.zeros((s, m))],
        ]
    )
    # [[Z, Z], [Z, Y]] is the congruence J1' P J1 of the paper's proof.
    pair, level = _blocks([[v.Z, v.Z], [v.Z, v.Y]]), np.asarray(v.delta)[..., None, None] * np.eye(m)
    left = _blocks([[pair, np.zeros((2 * n, s))], [np.zeros((s, 2 * n)), np.eye(s)]])
    right = _blocks([[pair, np.zeros((2 * n, m))], [np.zeros((m, 2 * n)), level]])
    return _blocks([[-left, corner], [np.swapaxes(corner, -1, -2), -right]])


def _blocks(rows: Sequence[Sequence[Array]]) -> Array:
    """The matrices made of these blocks, some of which are stacks of matrices."""
    stack = np.broadcast_shapes(*(part.shape[:-2] for row in rows for part in row))
    whole = [[np.broadcast_to(part, (*stack, *part.shape[-2:])) for part in row] for row in rows]
    return np.concatenate([np.concatenate(row, axis=-1) for row in whole], axis=-2)


def variable_basis(plant: SampledPlant) -> LmiVariables:
    """The unit directions of all unknowns as a stack, preceded by the zero point; the order is delta, Z, Y, F, G, Q."""
    n, r, s = plant.order, len(plant.C), len(plant.L)
    symmetric = symmetric_basis(n)
    blocks = [("delta", np.ones(1)), ("Z", symmetric), ("Y", symmetric)]
    blocks += [(name, np.eye(a * b).reshape(-1, a, b)) for name, a, b in (("F", n, r), ("G", s, n), ("Q", n, n))]
    total = 1 + sum(len(block) for _, block in blocks)
    fields, start = {}, 1
    for name, block in blocks:
        stack = np.zeros((total, *block.shape[1:]))
        stack[start : start + len(block)] = block
        fields[name] = stack
        start += len(block)
    return LmiVariables(**fields)


def combine(basis: LmiVariables, x: Array) -> LmiVariables:
    """The unknowns with coordinates x in `basis`."""
    parts = {name: np.tensordot(x, getattr(basis, name)[1:], axes=1) for name in ("Z", "Y", "F", "G", "Q", "delta")}
    return LmiVariables(**parts)


def inequalities(plant: SampledPlant, periods: Sequence[float], basis: LmiVariables) -> Inequalities:
    """-(10) >= 0 for every period, as affine functions of the coordinates in `basis`."""
    stacks = np.array([-lmi10(plant, *plant.discretise(h), basis) for h in periods])
    constant = stacks[:, 0]
    count, unknowns = len(periods), stacks.shape[1] - 1
    variables = np.broadcast_to(np.arange(unknowns), (count, unknowns))
    return Inequalities(constant, stacks[:, 1:] - constant[:, None], variables)


def recover(v: LmiVariables) -> Filter:
    """Eq. (11): A_f = -Y^-1 Q (I - Y^-1 Z)^-1, B_f = -Y^-1 F, C_f = G (I - Y^-1 Z)^-1.

    Raises SolverError if Y or Y - Z is numerically singular, as at an optimum that no filter attains.
    """
    gap = v.Y - v.Z
    if np.linalg.cond(v.Y) > 1e14 or np.linalg.cond(gap) > 1e14:
        raise SolverError(
            "Y or Y - Z is singular at the solution of (10): the optimum is not attained; use a larger level"
        )
    # (I - Y^-1 Z)^-1 = (Y - Z)^-1 Y.
    factor = np.linalg.solve(gap, v.Y)
    return Filter(-np.linalg.solve(v.Y, v.Q) @ factor, np.asarray(-np.linalg.solve(v.Y, v.F)), v.G @ factor)


def design_for_periods(
    plant: SampledPlant,
    periods: Sequence[float],
    *,
    at: Normalised | None = None,
    solver: Solver = Solver.CLARABEL,
) -> FilterDesign:
    """Step 2 of Algorithm 1: minimise delta = gamma^2 subject to (10) at all `periods` (seconds).

    The guarantee of the LMI is for these periods only. The status is in the report; evaluate the filter with
    `periodic_gain`, which shares nothing with this design. Raises InvalidInputError for periods that are not positive,
    InfeasibleError or SolverError by the solver's status.
    """
    grid = as_periods("periods", periods).tolist()
    normalised = at or normalise(plant, float(np.mean(grid)))
    return with_filter(normalised, solve_for_periods(normalised, grid, solver=solver))


def with_filter(normalised: Normalised, solution: LmiSolution) -> FilterDesign:
    """The solution with its filter for the original plant; raises SolverError as `recover` does."""
    return FilterDesign(**vars(solution), filter=normalised.restore(recover(solution.variables)))


def solve_for_periods(normalised: Normalised, grid: Sequence[float], *, solver: Solver) -> LmiSolution:
    """The same without the filter, which a solution on the way to another one need not have."""
    basis = variable_basis(normalised.plant)
    group = inequalities(normalised.plant, grid, basis)
    cost = np.zeros(group.coefficients.shape[1])
    cost[0] = 1.0
    if solver is Solver.SDPA:
        x, duals, report = minimise_refined(cost, group)
    else:
        solution = solve_clarabel(program_under(cost, group), accept=ALMOST)
        x, duals, report = solution.multipliers, np.array(solution.blocks), solution.report
    variables = combine(basis, x)
    level = normalised.scale * float(np.sqrt(max(float(variables.delta), 0.0)))
    weights = np.trace(duals, axis1=1, axis2=2)
    return LmiSolution(level, variables, tuple(grid), tuple(weights.tolist()), report)
