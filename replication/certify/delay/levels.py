"""Certificates of observers of systems with delays: levels of Theorem 3 from above, of any observer from below.

Of Theorem 3 a strictly feasible point in floating point is rounded, then changed in a few entries so that every
equality holds: nothing of the solver is trusted.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import cvxpy as cp
import numpy as np
import scipy.sparse as sparse
from flint import fmpq, fmpq_mat
from numpy.polynomial import legendre as classical
from scipy.linalg import block_diag
from scipy.sparse.linalg import lsqr

from replication.certify import (
    as_floats,
    exact,
    floats,
    modelled,
    rational,
    rounded,
    rounded_array,
    rounded_down,
    rounded_up,
    stepwise,
)
from replication.certify.delay import forms
from replication.certify.delay.forms import Basis, Dynamics, Entry, Form, Key, change_of, dynamics_of
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic.program import Program
from replication.estimation.conic.sdpa import SdpaOptions, solve_sdpa
from replication.estimation.delay import DelayPlant, delay_system, minimum_gain
from replication.estimation.delay.exact.smoothing import smoother_bound, smoother_gains
from replication.estimation.delay.exact.terms import plant_terms
from replication.estimation.delay.general.cone import line_form, moment_plant
from replication.estimation.delay.sos import synthesis
from replication.estimation.delay.sos.cone import DegreeRule, cone_blocks
from replication.estimation.delay.spectrum import rightmost_roots
from replication.estimation.delay.units import natural_units
from replication.estimation.validation import Array
from replication.verify.algebra.linear import identity
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


def centred(system: DelayPlant, gamma: float, degree: int, trace: float, rule: str) -> GramPoint:
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
        x = solution.x[2:] + float(solution.linear[0]) * eye
        # To the nearest point that meets the equalities: less of the margin is lost so than where rounding mends all.
        for _ in range(PROJECTIONS):
            x = x - lsqr(base.a, base.a @ x - base.b, atol=0.0, btol=0.0, conlim=0.0)[0]
        blocks = base.matrices(x)
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


def to_legendre(basis: Basis) -> Array:
    """The matrix that takes zeta in powers of t to the same in orthonormal Legendre polynomials."""
    count, functions = basis.block.degree + 1, basis.functions
    powers = _legendre_powers(count)
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


def exact_grams(dynamics: Dynamics, gamma: fmpq, degree: int, point: GramPoint, rule: str) -> dict[str, list[fmpq_mat]]:
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


STEPS = (1.2e-6, 5e-6, 2e-5, 1e-4)
"""Relative distances of a level from the least one, tried in turn until there is room for rounding."""
TRACE, WIDE_TRACE = 30.0, 1e4
"""Bound on the traces of the Gram matrices: small numbers close to the least level; more of it for small levels, and
where the kernels have few powers."""
LEVEL_BITS, FREQUENCY_BITS, ROOT_BITS = 40, 20, 20
BELOW = 1e-8
"""Relative distance of a lower bound from the gain that floating point finds."""


def floating(plant: Mapping[str, Any], change: fmpq_mat | None = None) -> DelayPlant:
    """The plant in floating point, each number rounded once; in the coordinates `change` if they are given."""
    change = identity(len(plant["A0"])) if change is None else change
    dynamics, sensor = dynamics_of(plant, change), floats(exact(plant["C2"]) * change.inv())
    parts = len(dynamics.delays)
    return delay_system(
        floats(dynamics.A0),
        np.split(floats(dynamics.late), parts, axis=1),
        [float(Fraction(str(delay))) for delay in dynamics.delays],
        floats(dynamics.B),
        floats(dynamics.C10),
        sensor,
        np.split(floats(dynamics.late_output), parts, axis=1),
    )


def grams(
    plant: Mapping[str, Any], gamma: str, degree: int, trace: float = TRACE, rule: str = "each"
) -> dict[str, Any]:
    """Witness of Theorem 3 at the level gamma; raises InfeasibleError if there is no room for rounding."""
    change = change_of(plant)
    point = centred(floating(plant, change), float(Fraction(gamma)), degree, trace, rule)
    pairs = exact_grams(dynamics_of(plant, change), rational(gamma), degree, point, rule)
    matrices = {name: [written(gram) for gram in pair] for name, pair in pairs.items()}
    least = min(float(np.linalg.eigvalsh(as_floats(gram))[0]) for pair in matrices.values() for gram in pair)
    if not least > 0.0:
        raise InfeasibleError(f"no room for rounding at the level {gamma}: exact matrices reach {least:.1e}; raise it")
    return {"change": written(change), **matrices}


def grams_in_units(plant: Mapping[str, Any], gamma: str, degree: int) -> dict[str, Any]:
    """`grams`, found in the natural units of the plant and with a level of about one, written in its own units.

    With x' = S x, t' = t/T, w' = sqrt(T) w, v' = sqrt(T) v and z' = sqrt(T) z/g the identity of Theorem 3 is multiplied
    by T/g: V' = V/g and N' = (T/g) N. All units are powers of two, T of four, so that nothing is rounded.
    """
    units, size = natural_units(floating(plant)), round(np.log2(float(Fraction(gamma))))
    time, root, gain = (rational(unit) for unit in (units.time, units.time**0.5, 2.0**size))
    states = exact(np.diag(units.states))
    back = states.inv()
    scaled = {
        "A0": written(states * exact(plant["A0"]) * back * time),
        "A": [written(states * exact(matrix) * back * time) for matrix in plant["A"]],
        "delays": [str(rational(delay) / time) for delay in plant["delays"]],
        "B": written(states * exact(plant["B"]) * root),
        "C10": written(exact(plant["C10"]) * back * (root / gain)),
        "C1": [written(exact(matrix) * back * (root / gain)) for matrix in plant["C1"]],
        "C2": written(exact(plant["C2"]) * back),
    }
    matrices = grams(scaled, str(rational(gamma) / gain), degree, WIDE_TRACE)
    inputs = len(plant["B"][0]) + len(plant["C10"])

    def restored(gram: Any) -> Any:
        unit = identity(len(gram))
        for i in range(inputs):
            unit[i, i] = root
        return written(unit * exact(gram) * unit * (gain / time))

    return {
        "change": written(exact(matrices["change"]) * states),
        "storage": [written(exact(gram) * gain) for gram in matrices["storage"]],
        "dissipation": [restored(gram) for gram in matrices["dissipation"]],
    }


def gain_upper(theorem: Mapping[str, Any], level: str | None = None, rule: str = "each") -> dict[str, Any]:
    """Bound and witness of a level that Theorem 3 reaches at the degree of the theorem: `level`, or near the least.

    rule: of the degrees, where the theorem names no variable in which its kernels are.
    """
    plant, parameters = theorem["plant"], theorem["parameters"]
    degree, rule = parameters["degree"], parameters.get("rule", rule)
    if level is not None:
        gamma = str(Fraction(level))
        return {"bound": {"upper": gamma}, "witness": grams(plant, gamma, degree, WIDE_TRACE)}
    trace = WIDE_TRACE if "rule" in parameters else TRACE
    least = minimum_gain(floating(plant), degree, rule=SOLVED[rule]).gamma
    return stepwise(least, STEPS, LEVEL_BITS, lambda gamma: grams(plant, gamma, degree, trace, rule))


def gain_lower(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Bound and witness of the gain that no observer can go below: of the plant, or of its approximation by Padé
    sections of the order that the theorem names."""
    gamma, witness = hidden_gain(theorem["plant"], theorem["parameters"].get("order"))
    return {"bound": {"lower": gamma}, "witness": witness}


def hidden_gain(plant: Mapping[str, Any], order: int | None = None) -> tuple[str, dict[str, Any]]:
    """The largest gain of a disturbance that leaves y at zero, and the frequency and the state that show it.

    order: that of Padé's approximants of the delays; true delays if None. For plants with one unmeasured state, so that
    C_2x = 0 leaves one direction; raises InvalidInputError for others.
    """
    sensor = exact(plant["C2"])
    q, n = sensor.nrows(), sensor.ncols()
    if n - q != 1:
        raise InvalidInputError(f"exactly one state may be unmeasured, got {n - q}")
    back, system = change_of(plant).inv(), floating(plant)
    terms = plant_terms(system) if order is None else moment_plant(line_form(system), order).terms
    frequency = rounded(smoother_bound(terms).frequency, FREQUENCY_BITS)
    lower = float(smoother_gains(terms, np.array([float(Fraction(frequency))]))[0]) * (1.0 - BELOW)
    return rounded_down(lower, LEVEL_BITS), {"frequency": frequency, "state": [[str(back[i, 0])] for i in range(n)]}


def near_optimal(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Witness of a level of Theorem 3 within a factor of what any observer reaches; nine tenths of the way."""
    plant, parameters = theorem["plant"], theorem["parameters"]
    lower, hidden = hidden_gain(plant)
    factor = 1.0 + 0.9 * float(Fraction(parameters["factor"]) - 1)
    gamma = rounded_up(float(Fraction(lower)) * factor, LEVEL_BITS)
    return {
        "bound": {},
        "witness": {"level": gamma, "hidden": hidden, "sos": grams(plant, gamma, parameters["degree"])},
    }


def unstable(theorem: Mapping[str, Any]) -> dict[str, Any]:
    """Witness of a positive real root: two points close to it. Raises InvalidInputError if the root is not one."""
    root = complex(rightmost_roots(floating(theorem["plant"]), 1)[0])
    if root.real <= 0.0 or abs(root.imag) > 1e-9:
        raise InvalidInputError(f"the rightmost root {root:.6g} is not real and positive")
    width = 2.0**-ROOT_BITS
    left, right = rounded_down(root.real - width, ROOT_BITS), rounded_up(root.real + width, ROOT_BITS)
    return {"bound": {}, "witness": {"left": left, "right": right}}


PADE_STEPS = (1e-6, 5e-6, 2e-5)
"""Relative distances of the level from the least one, tried in turn until there is room for rounding."""
PADE_ROOM = 1e-8
"""Least eigenvalue below which the residuals of the solver could spoil the inequality."""
STATE_BITS = 40
LARGEST = 30.0
"""Bound on P: small numbers leave the solver the digits that the margin needs."""


@dataclass(frozen=True)
class Section:
    """x' = a x + b u, out = c x + d u: Pade's approximant of a delay of 1 s, exact.

    With the continued fraction tanh(x) = 1/(1/x + 1/(3/x + ..)), x = s / 2, cut off after N terms, it is (1 - t)/(1 +
    t); its ladder has a realisation in rationals of moderate size, for even N.
    """

    a: fmpq_mat
    b: fmpq_mat
    c: fmpq_mat
    d: fmpq


def section(order: int) -> Section:
    """The ladder of even order; raises InvalidInputError for an odd one, where a state would be lost."""
    if order % 2:
        raise InvalidInputError(f"the order must be even, got {order}")
    steps = fmpq_mat(order, order, [(i == j + 1) - (j == i + 1) for i in range(order) for j in range(order)])
    elements = fmpq_mat(order, order, [(2 * i + 1) * (i == j) for i in range(order) for j in range(order)])
    first = fmpq_mat(order, 1, [int(i == 0) for i in range(order)])
    unit, back = identity(order), steps.inv()
    ladder = back * elements * 2
    port = back * first
    return Section(ladder * (unit + port * first.transpose()), -(ladder * port), first.transpose() * -2, fmpq(1))


def pade_upper(theorem: Mapping[str, Any], least: Callable[[DelayPlant, int], float]) -> dict[str, Any]:
    """Bound and witness of a level close to the `least` of the plant with Padé sections of an order."""
    plant, order = theorem["plant"], theorem["parameters"]["order"]
    change = change_of(plant)
    system, part = floating(plant, change), section(order)

    def witness(gamma: str) -> dict[str, Any]:
        return {
            "change": written(change),
            "section": written(vars(part)),
            "P": rounded_array(_storage(system, part, float(Fraction(gamma))), STATE_BITS),
        }

    return stepwise(least(system, order), PADE_STEPS, LEVEL_BITS, witness)


def _storage(system: DelayPlant, part: Section, gamma: float) -> Array:
    """P of LMI (3) with the largest margin of P > 0 and of the inequality on the kernel of C_2."""
    n, q = system.states, system.measurements
    A, B, C = _model(system, part)
    size, r, p = A.shape[0], B.shape[1], C.shape[0]
    kernel = np.delete(np.eye(size), np.arange(n - q, n), axis=1)
    storage, margin = cp.Variable((size, size), symmetric=True), cp.Variable()
    corner = kernel.T @ (storage @ A + A.T @ storage) @ kernel
    cross, output = -kernel.T @ storage @ B, kernel.T @ C.T
    inequality = cp.bmat(
        [
            [corner, cross, output],
            [cross.T, -gamma * np.eye(r), np.zeros((r, p))],
            [output.T, np.zeros((p, r)), -gamma * np.eye(p)],
        ]
    )
    constraints = [
        storage >> margin * np.eye(size),
        storage << LARGEST * np.eye(size),
        (inequality + inequality.T) / 2 << -margin * np.eye(size - q + r + p),
    ]
    problem = cp.Problem(cp.Maximize(margin), constraints)
    status = modelled(problem)
    if storage.value is None:
        raise SolverError(f"Clarabel found no storage at the level {gamma!r}: status {status}; raise the level")
    # The eigenvalues of what it returned decide.
    eigenvalues = np.linalg.eigvalsh(storage.value), -np.linalg.eigvalsh((inequality.value + inequality.value.T) / 2)
    if not min(values.min() for values in eigenvalues) >= PADE_ROOM:
        raise InfeasibleError(f"no room for rounding at the level {gamma!r}; raise it")
    return np.asarray(storage.value)


def _model(system: DelayPlant, part: Section) -> tuple[Array, Array, Array]:
    """The approximation, one section for each delayed state that has an effect."""
    (a, b, c), d = (floats(matrix) for matrix in (part.a, part.b, part.c)), float(Fraction(str(part.d)))
    n, unit = system.states, np.eye(system.states)
    now, through, entries, sections = np.vstack([system.a0, system.c10]), [], [], []
    for delay, late, output in zip(system.delays, system.a, system.c1, strict=True):
        effect = np.vstack([late, output])
        for i in np.flatnonzero(np.any(effect, axis=0)):
            now = now + d * np.outer(effect[:, i], unit[i])
            through.append(effect[:, [i]] @ c)
            entries.append(b @ unit[[i]] / delay)
            sections.append(a / delay)
    top = np.hstack([now, *through])
    A = np.vstack([top[:n], np.hstack([np.vstack([np.zeros((0, n)), *entries]), block_diag(*sections)])])
    return A, np.vstack([system.b, np.zeros((len(A) - n, system.inputs))]), top[n:]
