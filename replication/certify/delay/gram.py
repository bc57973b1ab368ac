"""Rational Gram matrices of Theorem 3: a strictly feasible point in floating point, rounded and corrected exactly.

Nothing of the solver is trusted: matrices are rounded, then changed in a few entries so that every equality holds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import cvxpy as cp
import numpy as np
import scipy.sparse as sparse
from flint import fmpq, fmpq_mat
from numpy.polynomial import legendre as classical
from scipy.sparse.linalg import lsqr

from replication.certify.delay import forms
from replication.certify.delay.forms import Basis, Dynamics, Entry, Form, Key
from replication.certify.rounding import as_floats, exact, floats, modelled, rational, rounded, rounded_array
from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import Program
from replication.estimation.conic.sdpa import SdpaOptions, solve_sdpa
from replication.estimation.delay import DelayPlant
from replication.estimation.delay.sos import synthesis
from replication.estimation.delay.sos.cone import DegreeRule, cone_blocks
from replication.estimation.validation import Array
from replication.verify.reading import written

CENTRE = SdpaOptions(tolerance=1e-9, scale=1e2, gap=1.0, residual=1e-4)
"""For the centre: any point with a margin serves, so that the gap of its objective says nothing."""
CAREFUL = replace(CENTRE, scale=1e1, step=0.7)
"""Shorter steps from nearer by, for levels close to the least, where the long ones leave no room."""
ROOM = 1e-9
"""Least eigenvalue below which the residuals that are left could spoil the rounding."""
PROJECTIONS = 3
"""The first leaves what least squares leave, the others rounding."""
SOLVED = {
    "each": DegreeRule.TENSOR,
    "total": DegreeRule.TOTAL,
    "outer": DegreeRule.OUTER,
    "inner": DegreeRule.INNER,
}
"""The rules of the verifier in words of the solver."""
SPARE_BITS = 10
"""Bits of the rounding beyond the margin of the centre."""


@dataclass(frozen=True)
class GramPoint:
    """Gram matrices of the storage and of the dissipation, for both weights, in powers of t; and their least margin."""

    storage: tuple[Array, Array]
    dissipation: tuple[Array, Array]
    margin: float


def centred(system: DelayPlant, gamma: float, degree: int, trace: float, rule: str = "each") -> GramPoint:
    """The point of Theorem 3 at the level gamma whose Gram matrices, of this trace at most, have the largest margin."""
    base = synthesis.program(synthesis.assemble(system, degree, SOLVED[rule]), 0.0, gamma)
    eye = np.concatenate([np.eye(size).ravel() for size in base.blocks])
    rows = base.a.shape[0]
    # M = margin I + X with X >= 0: maximise the margin; the last row bounds the traces.
    upper = sparse.hstack([sparse.csr_array((base.a @ eye)[:, None]), sparse.csr_array((rows, 1)), base.a])
    lower = sparse.csr_array(np.concatenate([[eye.sum(), 1.0], eye])[None, :])
    program = Program(
        sparse.vstack([upper, lower], format="csr"),
        np.concatenate([base.b, [trace]]),
        np.concatenate([[-1.0, 0.0], 0.0 * eye]),
        2,
        base.blocks,
    )
    for options in (CENTRE, CAREFUL):
        solution = solve_sdpa(program, options)
        blocks = base.matrices(_projected(base, solution.x[2:] + float(solution.linear[0]) * eye))
        margin = min(float(np.linalg.eigvalsh(block)[0]) for block in blocks)
        if margin >= ROOM:
            break
    else:
        raise InfeasibleError(f"no room for rounding at the level {gamma!r}: margin {margin:.1e}; raise the level")
    n, functions = system.states, system.states * system.delay_count
    every = n + functions + system.b.shape[1] + system.c10.shape[0]
    both = (
        basis for points in (n, every) for basis in forms.bases(points, functions, cone_blocks(degree, SOLVED[rule]))
    )
    grams = [change.T @ block @ change for block, change in zip(blocks, map(to_legendre, both), strict=True)]
    least = min(float(np.linalg.eigvalsh(gram)[0]) for gram in grams)
    return GramPoint((grams[0], grams[1]), (grams[2], grams[3]), least)


def _projected(program: Program, x: Array) -> Array:
    """The point of Ax = b that is nearest to x: less of the margin is lost so than where the rounding mends it all."""
    for _ in range(PROJECTIONS):
        x = x - lsqr(program.a, program.a @ x - program.b, atol=0.0, btol=0.0, conlim=0.0)[0]
    return x


def to_legendre(basis: Basis) -> Array:
    """The matrix that takes zeta in powers of t to the same in orthonormal Legendre polynomials."""
    count, functions = basis.degree + 1, basis.functions
    powers = _legendre_powers(basis.degree + 1)
    indices = [a * (count + 1) + b for a, b in basis.kernels]
    points = basis.points
    middle = points + functions * count
    change = np.eye(basis.size)
    change[points:middle, points:middle] = np.kron(powers[:count, :count], np.eye(functions))
    # The powers of a polynomial are no higher than its own, so that those of each rule go among themselves.
    change[middle:, middle:] = np.kron(np.kron(powers, powers)[np.ix_(indices, indices)], np.eye(functions))
    return change


def _legendre_powers(degree: int) -> Array:
    """Rows: the coefficients of the orthonormal Legendre polynomials of [-1, 0] in powers of t."""
    table = np.zeros((degree + 1, degree + 1))
    for a in range(degree + 1):
        powers = np.polynomial.Polynomial(classical.leg2poly(np.eye(degree + 1)[a]))
        table[a, : a + 1] = (np.sqrt(2.0 * a + 1.0) * powers(np.polynomial.Polynomial([1.0, 2.0]))).coef[: a + 1]
    return table


def exact_grams(
    dynamics: Dynamics, gamma: fmpq, degree: int, point: GramPoint, rule: str = "each"
) -> dict[str, list[fmpq_mat]]:
    """Rational Gram matrices near `point` that satisfy the identity of Theorem 3 exactly at the level gamma."""
    bits = max(0, SPARE_BITS - int(np.floor(np.log2(point.margin))))
    n, width = dynamics.states, dynamics.functions
    blocks = cone_blocks(degree, SOLVED[rule])
    v_bases, h_bases = (forms.bases(points, width, blocks) for points in (n, dynamics.points))
    storage, dissipation = (
        [exact(rounded_array((matrix + matrix.T) / 2.0, bits)) for matrix in pair]
        for pair in (point.storage, point.dissipation)
    )
    # The entry (weight, i, j) of N that corrects each coefficient, and the factor with which it enters.
    pivots: dict[Key, tuple[int, Entry, fmpq]] = {}
    for weight, basis in enumerate(h_bases):
        for entry, key, factor in basis.terms():
            pivots.setdefault(key, (weight, entry, factor))
    _meet_storage(dynamics, v_bases, storage, set(pivots))
    value_function = forms.total(map(forms.form_of, v_bases, storage))
    target = forms.total([forms.derivative(dynamics, value_function), forms.supply(dynamics, gamma)])
    # The highest moment against a point variable stands in the weighted matrix and moves the next lower one.
    for last in (True, False):
        now = forms.total(
            [target, *(forms.form_of(basis, gram) for basis, gram in zip(h_bases, dissipation, strict=True))]
        )
        for key, value in now.items():
            if value == 0 or forms.cancellable(dynamics, key):
                continue
            weight, entry, factor = pivots[key]
            if (weight == 1) == last:
                _change(dissipation[weight], entry, -value / factor)
    return {"storage": storage, "dissipation": dissipation}


def _meet_storage(dynamics: Dynamics, bases: Sequence[Basis], grams: list[fmpq_mat], reached: set[Key]) -> None:
    """Change V so that S couples no two delays and dV/dt has no term that neither N nor Z can cancel."""
    rows: dict[Key, dict[int, fmpq]] = {}
    position: dict[tuple[int, Entry], int] = {}
    unmet: dict[Key, Form] = {}
    for weight, basis in enumerate(bases):
        for entry, key, value in basis.terms():
            if key not in unmet:
                fed = forms.contribution(dynamics, key)
                unmet[key] = {target: amount for target, amount in fed.items() if target not in reached}
            for target, per_unit in unmet[key].items():
                column = position.setdefault((weight, entry), len(position))
                forms.add(rows.setdefault(target, {}), column, value * per_unit)
    if not rows:
        return
    columns, last = list(position), len(position)
    now = [grams[weight][entry] for weight, entry in columns]
    missed = [{**row, last: sum((amount * now[k] for k, amount in row.items()), fmpq(0))} for row in rows.values()]
    reduced, pivots = forms.echelon(missed, last + 1)
    for i, column in enumerate(pivots):
        weight, entry = columns[column]
        _change(grams[weight], entry, -reduced[i, last])


def _change(gram: fmpq_mat, entry: Entry, amount: fmpq) -> None:
    i, j = entry
    gram[i, j] += amount
    if i != j:
        gram[j, i] += amount


# Rational weights of a functional in the interior of what a dual program allows: solved, scaled and rounded.
#
# Near the optimum the matrices are nearly singular: they are taken in Legendre polynomials, and scaled by their
# diagonal.


INTERIOR_STEPS = (8e-6, 3e-5, 6e-5, 8e-5, 1e-4, 3e-4, 1e-3, 0.004)
"""Relative distances of the bound from the dual optimum, tried in turn until there is room for rounding."""
INTERIOR_ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the rounding."""
SCALINGS, SEEN = 3, 1e-13
"""How often the coordinates are scaled anew; relative size below which a direction counts as none."""
WEIGHT_BITS = 60

Row = dict[int, fmpq]


@dataclass(frozen=True)
class Dual:
    """keys: the weights y. matrices: for each entry of each matrix of the functional on squares, its row of weights.

    hidden: the coordinates of each matrix that are not measured. changes: what takes these to Legendre polynomials, in
    which the matrices are well conditioned. Those on N come first.
    """

    keys: tuple[Key, ...]
    matrices: tuple[dict[Entry, Row], ...]
    hidden: tuple[tuple[int, ...], ...]
    changes: tuple[Array, ...]


@dataclass(frozen=True)
class Task:
    """The matrices and the value 2 v'z as affine functions of x, in which y = constant + free (back x)."""

    x: cp.Variable
    back: Array
    grams: list[cp.Expression]
    value: cp.Expression

    def margin(self, least: float) -> float:
        """The largest one with which the matrices are definite at a value; x is left where it is."""
        room = cp.Variable()
        wide = [gram >> room * np.eye(gram.shape[0]) for gram in self.grams]
        return _solved(cp.Problem(cp.Maximize(room), [self.value >= least, *wide]))


def _task(dual: Dual, cost: Array, constant: Array, free: Array, changes: Sequence[Array]) -> Task:
    """The task in these coordinates of the matrices; x of which each entry moves them by as much as any other."""
    maps = [
        np.kron(change, change) @ _map(matrix, hidden, len(dual.keys))
        for matrix, hidden, change in zip(dual.matrices, dual.hidden, changes, strict=True)
    ]
    sizes, directions = np.linalg.svd(np.vstack([form @ free for form in maps]), full_matrices=False)[1:]
    back = (directions.T / sizes)[:, sizes > SEEN * sizes[0]]
    x = cp.Variable(back.shape[1])
    grams = []
    for form, change in zip(maps, changes, strict=True):
        gram = cp.reshape(form @ constant + (form @ free @ back) @ x, change.shape, order="C")
        grams.append((gram + gram.T) / 2)
    return Task(x, back, grams, cost @ constant + (cost @ free @ back) @ x)


def inner_weights(dual: Dual, costs: list[fmpq], constant: list[fmpq], free: fmpq_mat) -> list[fmpq]:
    """Rational y in the interior: the largest value first, then the largest margin a little below it."""
    known = as_floats(written(costs)), as_floats(written(constant)), floats(free)
    tasks = [_task(dual, *known, dual.changes)]
    changes, best = dual.changes, -np.inf
    for _ in range(SCALINGS):
        try:
            best = max(best, _solved(cp.Problem(cp.Maximize(tasks[-1].value), [form >> 0 for form in tasks[-1].grams])))
        except SolverError:
            break
        sizes = [np.sqrt(np.maximum(np.diag(gram.value), SEEN)) for gram in tasks[-1].grams]
        changes = tuple(change / size[:, None] for change, size in zip(changes, sizes, strict=True))
        tasks.append(_task(dual, *known, changes))
    for step, task in product(INTERIOR_STEPS, reversed(tasks)):
        try:
            if task.margin(best * (1.0 - step)) >= INTERIOR_ROOM:
                break
        except SolverError:
            continue
    else:
        raise SolverError(f"no room for rounding up to {INTERIOR_STEPS[-1]:g} below {best!r}; add a larger step")
    chosen = fmpq_mat([[rational(rounded(float(value), WEIGHT_BITS))] for value in task.back @ task.x.value])
    moved = free * chosen
    return [value + moved[i, 0] for i, value in enumerate(constant)]


def _map(matrix: dict[Entry, Row], hidden: tuple[int, ...], count: int) -> Array:
    """The map from y to the entries of the matrix on the hidden coordinates, row by row."""
    place = {i: k for k, i in enumerate(hidden)}
    size = len(hidden)
    result = np.zeros((size, size, count))
    for (i, j), row in matrix.items():
        if i in place and j in place:
            for column, amount in row.items():
                result[place[i], place[j], column] = result[place[j], place[i], column] = as_floats(str(amount))
    return result.reshape(size * size, count)


def _solved(problem: cp.Problem) -> float:
    """The optimum; raises SolverError without one."""
    modelled(problem)
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise SolverError(f"Clarabel found no functional: status {problem.status}")
    return float(np.asarray(problem.value))
