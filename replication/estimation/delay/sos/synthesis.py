"""Theorem 3: the H∞-optimal observer of a system with state delays as one semidefinite program.

Unknown are the matrices of two cones: V = ⟨e, 𝒫e⟩ and the dissipation N. Matching coefficients,
  dV/dt - γ(|w|² + |v|²) + 2vᵀC_1e + ε(|e|² + Σ∫|φ_i|²) + N = 0
on every monomial that 𝒵 cannot cancel; 𝒵 is read off the others afterwards.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from replication.errors import InvalidInputError
from replication.estimation.conic.program import Program
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import cone, legendre
from replication.estimation.delay.sos.cone import Blocks, DegreeRule, FormSpace, Index
from replication.estimation.delay.units import measured_last
from replication.estimation.validation import Array, positive_integer, positive_scalar

# The derivative of V along the error dynamics and the supply rate (Theorems 1 and 3), as sparse maps of coefficients.
#
# In scaled histories φ_i(η) = e(t+τ_iη), η ∈ [-1, 0], the error obeys ė = A_0e + ΣA_kφ_k(-1) - Bw and
# ∂_tφ_i = φ_i'/τ_i with φ_i(0) = e. V is a form on R^n × L2^nK; its derivative is a form on
# h = (ω, v, e, φ_1(-1), .., φ_K(-1)) ∈ R^{r+p+n(K+1)} and the same histories, with ω = w or with the rates ẋ in ω.
#
# V moves with ẋ alone: where ẋ is itself a variable, in place of the disturbances that drive it, the matrices A and B
# leave the derivative of V and stand in |w|² only. The form is the same, and its program far sparser.


Mask = npt.NDArray[np.bool_]
PIVOT, WEAK = 0.1, 0.03
"""Where rates replace disturbances: least pivot of B, rows scaled to length one, and least row of B relative to its
largest and to that of [A_0 .. A_K]. The change stays well-conditioned, and the coefficients of |w|² moderate.
"""


@dataclass(frozen=True)
class Drive:
    """ẋ = rate·h and w = signal·h; shapes (n, points) and (r, points)."""

    rate: Array
    signal: Array


def direct(system: DelayPlant) -> Drive:
    """ω = w."""
    rate = np.hstack([-system.b, np.zeros((system.states, system.outputs)), system.a0, *system.a])
    return Drive(rate, np.eye(system.inputs, rate.shape[1]))


def by_rates(system: DelayPlant) -> Drive:
    """ω_i = ẋ_j/|b_j|, b_j the row of B, for all states j; the other ω_i = w_i. `direct` if w does not reach all states
    well, as PIVOT and WEAK say.
    """
    plain = direct(system)
    n, size = system.states, np.linalg.norm(system.b, axis=1)
    against = np.maximum(np.linalg.norm(np.hstack([system.a0, *system.a]), axis=1), size.max())
    if system.inputs < n or np.any(size < WEAK * against) or not np.any(size):
        return plain
    triangle, order = scipy.linalg.qr(system.b / size[:, None], mode="r", pivoting=True)
    if np.abs(np.diag(triangle)).min() < PIVOT:
        return plain
    chosen = order[:n]
    rate, rest, signal = np.zeros_like(plain.rate), plain.rate.copy(), plain.signal.copy()
    rate[np.arange(n), chosen] = size
    rest[:, chosen] = 0.0
    signal[chosen] = np.linalg.solve(-system.b[:, chosen], rate - rest)
    return Drive(rate, signal)


def state_space(system: DelayPlant, count: int) -> FormSpace:
    """Space of V: n point variables and nK histories with `count` Legendre coefficients."""
    return FormSpace(system.states, system.states, system.delay_count, count)


def derivative_space(system: DelayPlant, count: int) -> FormSpace:
    """Space of the derivative of V: point variables (w, v, e, φ_1(-1), .., φ_K(-1))."""
    points = system.inputs + system.outputs + system.states * (system.delay_count + 1)
    return FormSpace(points, system.states, system.delay_count, count)


def point_offsets(system: DelayPlant) -> tuple[int, int, int]:
    """First index of v, of e and of φ_1(-1) among the point variables of `derivative_space`."""
    v = system.inputs
    e = v + system.outputs
    return v, e, e + system.states


def _rates(system: DelayPlant, source: FormSpace, target: FormSpace, drive: Drive) -> tuple[Index, Array]:
    """Where each functional u of V stands among those of h, and D with du/dt = D h (source, target functionals)."""
    n, width, count = system.states, source.functions, source.count
    _, e, late = point_offsets(system)
    where = np.concatenate([np.arange(e, e + n), np.arange(target.points, target.functionals)])
    per_delay = np.diag(np.repeat(1.0 / np.array(system.delays), n))
    rate = np.zeros((source.functionals, target.functionals))
    now, before = (values[:, None] for values in legendre.ends(count))
    rate[:n, : target.points] = drive.rate
    rate[n:, e:late] = np.kron(now, per_delay @ np.tile(np.eye(n), (system.delay_count, 1)))
    rate[n:, late : late + width] = -np.kron(before, per_delay)
    rate[n:, target.points :] = -np.kron(legendre.derivative(count).T, per_delay)
    return where, rate


def lie_derivative(system: DelayPlant, count: int, drive: Drive | None = None) -> scipy.sparse.csr_array:
    """Map from the coefficients of V, whose S couples no two delays, to those of dV/dt: sparse (derivative, state)."""
    source, target = state_space(system, count), derivative_space(system, count)
    where, rate = _rates(system, source, target, drive or direct(system))
    moving, partners = scipy.sparse.coo_array(rate), np.arange(source.functionals)[:, None]
    # The part of u_p u_q that moves with u_q, for all p; a square moves twice.
    rows, columns = target.pair(where[partners], moving.col), source.pair(partners, moving.row)
    values = np.where(partners == moving.row, 2.0, 1.0) * moving.data
    more = _multiplier_terms(system, source, target)
    row, column, value = (np.concatenate([a.ravel(), b]) for a, b in zip((rows, columns, values), more, strict=True))
    return scipy.sparse.coo_array((value, (row, column)), shape=(target.size, source.size)).tocsr()


def _multiplier_terms(system: DelayPlant, source: FormSpace, target: FormSpace) -> tuple[Index, Index, Array]:
    """Triples (row, column, value) of d/dt ∫p_c φ_ik φ_il = (p_c(0)e_k e_l - p_c(-1)φ_ik(-1)φ_il(-1) - ∫p_c'φφ)/τ_i."""
    n = system.states
    _, e, late = point_offsets(system)
    degree, first, second = source.multiplier_functions()
    same = np.flatnonzero(first // n == second // n)
    degree, first, second, column = degree[same], first[same], second[same], source.pair_count + same
    speed = 1.0 / np.array(system.delays)[first // n]
    (now, before), slope = legendre.ends(source.count), legendre.derivative(source.count)
    lower, at = np.nonzero(slope[:, degree])
    rows = target.pair(e + first % n, e + second % n), target.pair(late + first, late + second)
    values = now[degree] * speed, -before[degree] * speed, -slope[lower, degree[at]] * speed[at]
    return (
        np.concatenate([*rows, target.multiplier(lower, first[at], second[at])]),
        np.concatenate([column, column, column[at]]),
        np.concatenate(values),
    )


def energy(space: FormSpace, e: int = 0) -> Array:
    """Coefficients of |e|² + Σ∫|φ_i|², e from that point variable on: what ε multiplies in Theorem 3."""
    coefficients, points = np.zeros(space.size), np.arange(e, e + space.channels)
    coefficients[space.pair(points, points)] = 1.0
    function = np.arange(space.functions, dtype=np.int64)
    coefficients[space.multiplier(np.int64(0), function, function)] = 1.0  # type: ignore[arg-type]
    return coefficients


def supply(system: DelayPlant, count: int, drive: Drive) -> tuple[Array, Array]:
    """Coefficients of 2vᵀC_1e and of -(|w|² + |v|²): the form is the first plus γ times the second (Theorem 1)."""
    space = derivative_space(system, count)
    v, e, _ = point_offsets(system)
    cross, level = np.zeros(space.size), np.zeros(space.size)
    outputs = np.hstack([system.c10, *system.c1])
    rows, columns = np.divmod(np.arange(outputs.size), outputs.shape[1])
    cross[space.pair(v + rows, e + columns)] = 2.0 * outputs.ravel()
    weight = drive.signal.T @ drive.signal
    weight[v:e, v:e] += np.eye(system.outputs)
    first, second = np.triu_indices(space.points)
    level[space.pair(first, second)] = -np.where(first == second, 1.0, 2.0) * weight[first, second]
    return cross, level


def absorbed(system: DelayPlant, count: int) -> Mask:
    """Mask of the coefficients of dV/dt that the free operator 𝒵 can cancel, for a system with C_2 = [0 c].

    𝒵C_2 adds 2⟨e, 𝒵C_2e⟩, so: (e,e), (e,φ), (φ,φ) where either side is measured, (e,φ(-1)) and (φ(-1),φ) where the
    end value φ(-1) is measured.
    """
    space, (_, e, late) = derivative_space(system, count), point_offsets(system)
    n, k = system.states, system.delay_count
    measured = np.concatenate([np.zeros(e, dtype=bool), np.tile(np.arange(n) >= n - system.measurements, 1 + 2 * k)])
    variable = np.arange(measured.size)
    end = (variable >= late) & (variable < space.points)
    state, shown = (variable >= e) & ~end, end & measured
    first, second = space.variables()
    mask: Mask = state[first] & state[second] & (measured[first] | measured[second])
    mask |= (state[first] & shown[second]) | (shown[first] & state[second])
    _, left, right = space.multiplier_functions()
    mask[space.pair_count :] &= left // n == right // n
    return mask


# The program


DEGREES, MONOMIALS = (3, 2, 1), 2000
"""Degrees of the polynomials unless one is asked for: the first whose program has at most so many monomials to match,
which take SDPA a few seconds; the last for larger plants."""


@dataclass(frozen=True)
class Assembly:
    """The pieces of the program that do not depend on γ and ε.

    storage, dissipation: coefficients of V and of N, linear in the matrices of their cones; derivative: those of dV/dt,
    linear in those of V; supply: those of the supply rate. v_labels, h_labels: for each matrix of the cones of V and of
    N the variable behind each row, points first, then functions. kept: mask of the monomials of dV/dt that must match.
    """

    system: DelayPlant
    change: Array
    degree: int
    rule: DegreeRule
    count: int
    storage: scipy.sparse.csr_array
    derivative: scipy.sparse.csr_array
    dissipation: scipy.sparse.csr_array
    v_labels: tuple[Index, ...]
    h_labels: tuple[Index, ...]
    kept: Mask
    supply: tuple[Array, Array]


def assemble(
    system: DelayPlant,
    degree: int,
    rule: DegreeRule = DegreeRule.TENSOR,
    *,
    rates: bool = False,
    blocks: tuple[Blocks, Blocks] | None = None,
    count: int | None = None,
) -> Assembly:
    """Maps from the cone matrices to the coefficients of V and N, and from V to dV/dt; with `rates`, as in `by_rates`.

    blocks, count: the matrices of the cones of V and of N, and the Legendre coefficients that hold their products, in
    place of those of the rule. Raises InvalidInputError for degree < 1.
    """
    degree = positive_integer("degree", degree)
    inner, change = measured_last(system)
    if blocks is None and rule is not DegreeRule.BESSEL:
        blocks = (cone.cone_blocks(degree, rule),) * 2
    count = cone.required_count(degree, rule) if count is None else count
    spaces = state_space(inner, count), derivative_space(inner, count)
    if blocks:
        (storage, v_labels), (dissipation, h_labels) = map(cone.cone_of, blocks, spaces)
    else:
        # The derivative of the ramp is constant: the dissipation needs none.
        (storage, v_labels), (dissipation, h_labels) = (
            cone.cone(space, degree, ramp=ramp) for space, ramp in zip(spaces, (True, False), strict=True)
        )
    drive = by_rates(inner) if rates else direct(inner)
    derivative, rate = lie_derivative(inner, count, drive), supply(inner, count, drive)
    mask = ~absorbed(inner, count)
    return Assembly(
        inner, change, degree, rule, count, storage, derivative, dissipation, v_labels, h_labels, mask, rate
    )


def monomials(system: DelayPlant, degree: int, rule: DegreeRule) -> int:
    """How many monomials of dV/dt have to match: at least as many as the program has equalities; nothing is built."""
    return int(np.count_nonzero(~absorbed(system, cone.required_count(degree, rule))))


def degree_for(system: DelayPlant, rule: DegreeRule) -> int:
    """The degree that a design takes unless one is asked for, see DEGREES."""
    return next((degree for degree in DEGREES if monomials(system, degree, rule) <= MONOMIALS), DEGREES[-1])


def program(assembly: Assembly, epsilon: float, gamma: float | None = None) -> Program:
    """Minimise γ (`gamma` None), or minimise the trace of the cone matrices at the given level; ε is not negative."""
    if epsilon != 0.0:
        positive_scalar("epsilon", epsilon)
    system, count, (cross, level) = assembly.system, assembly.count, assembly.supply
    v_space, h_space = state_space(system, count), derivative_space(system, count)
    strict = energy(h_space, point_offsets(system)[1]) + assembly.derivative @ energy(v_space)
    constant = cross + epsilon * strict
    _, first, second = v_space.multiplier_functions()
    coupled = v_space.pair_count + np.flatnonzero(first // system.states != second // system.states)
    mask = assembly.kept
    forms = assembly.derivative[mask] @ assembly.storage, assembly.dissipation[mask]
    blocks = [[None, assembly.storage[coupled], None], [scipy.sparse.csr_array(level[mask][:, None]), *forms]]
    if gamma is not None:
        constant, blocks = constant + gamma * level, [row[1:] for row in blocks]
    matrix = scipy.sparse.block_array(blocks, format="csr")
    right = np.concatenate([np.zeros(coupled.size), -constant[mask]])
    used = np.diff(matrix.indptr) > 0
    if np.any(right[~used] != 0.0):
        raise InvalidInputError("the degree is too low: a term of the supply rate is beyond the reach of the cone")
    sizes = tuple(label.size for label in (*assembly.v_labels, *assembly.h_labels))
    cost = np.concatenate([np.eye(size).ravel() for size in sizes])
    cost = cost if gamma is not None else np.concatenate([[1.0], 0.0 * cost])
    return Program(matrix[used], right[used], cost, 0 if gamma is not None else 1, sizes)


# Theorem 3 without what a large 𝒵 makes redundant: a smaller program with the same infimum of γ.
#
# 𝒵 adds any multiple of |e_y|² and ∫|φ_y|² to the dissipation, where y marks the measured states, and V may hold
# σ∫|φ_y|² at no cost, which adds (σ/τ)|φ_y(-1)|². As these grow, e_y, φ_y and φ_y(-1) drop out of N ⪰ 0 and φ_y out of
# V ⪰ 0 (Schur complements), with every equality that names them. An observer of the unmeasured states is left, driven
# by the derivative of y. The infimum over 𝒵 is seldom attained: the full program then ends with a gap, the reduced one
# not.


def reduced(assembly: Assembly) -> Assembly:
    """The program of `assembly` with rows and columns of measured variables left out; its certificates are limits.

    For γ only: a point of it gives a certificate of Theorem 3 for every level above, but not by itself.
    """
    system = assembly.system
    unmeasured, e = np.arange(system.states) < system.states - system.measurements, point_offsets(system)[1]
    of_v = np.concatenate([np.ones(system.states, dtype=bool), np.tile(unmeasured, system.delay_count)])
    of_h = np.concatenate([np.ones(e, dtype=bool), np.tile(unmeasured, 1 + 2 * system.delay_count)])
    storage, v_labels = _restricted(assembly.storage, assembly.v_labels, of_v)
    dissipation, h_labels = _restricted(assembly.dissipation, assembly.h_labels, of_h)
    first, second = derivative_space(system, assembly.count).variables()
    return replace(
        assembly,
        storage=storage,
        dissipation=dissipation,
        v_labels=v_labels,
        h_labels=h_labels,
        kept=assembly.kept & of_h[first] & of_h[second],
    )


def _restricted(
    columns: scipy.sparse.csr_array, labels: tuple[Index, ...], keep: Mask
) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """The map without the rows and columns of its matrices whose variable is not kept; empty matrices are left out."""
    rows = [keep[label] for label in labels]
    mask = np.concatenate([np.outer(row, row).ravel() for row in rows])
    left = tuple(label[row] for label, row in zip(labels, rows, strict=True) if np.any(row))
    return columns[:, np.flatnonzero(mask)], left
