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
from replication.estimation.delay.sos import cone, lie
from replication.estimation.delay.sos.cone import Blocks, DegreeRule, FormSpace, Index
from replication.estimation.delay.sos.lie import Drive, by_rates
from replication.estimation.delay.units import measured_last
from replication.estimation.validation import Array, positive_integer, positive_scalar

DEGREES, MONOMIALS = (3, 2, 1), 2000
"""Degrees of the polynomials unless one is asked for: the first whose program has at most so many monomials to match,
which take SDPA a few seconds; the last for larger plants."""


@dataclass(frozen=True)
class Assembly:
    """The pieces of the program that do not depend on γ and ε.

    storage, dissipation: coefficients of V and of N, linear in the matrices of their cones; derivative: those of dV/dt,
    linear in those of V. v_labels, h_labels: for each matrix of the cones of V and of N the variable behind each row,
    points first, then functions. kept: mask of the monomials of dV/dt that must match. drive: the variables of dV/dt,
    `direct` if None.
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
    kept: npt.NDArray[np.bool_]
    drive: Drive | None = None


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
    spaces = lie.state_space(inner, count), lie.derivative_space(inner, count)
    if blocks:
        (storage, v_labels), (dissipation, h_labels) = map(cone.cone_of, blocks, spaces)
    else:
        # The derivative of the ramp is constant: the dissipation needs none.
        (storage, v_labels), (dissipation, h_labels) = (
            cone.cone(space, degree, ramp=ramp) for space, ramp in zip(spaces, (True, False), strict=True)
        )
    drive = by_rates(inner) if rates else None
    derivative = lie.lie_derivative(inner, count, drive)
    mask = ~lie.absorbed(inner, count)
    return Assembly(
        inner, change, degree, rule, count, storage, derivative, dissipation, v_labels, h_labels, mask, drive
    )


def monomials(system: DelayPlant, degree: int, rule: DegreeRule) -> int:
    """How many monomials of dV/dt have to match: at least as many as the program has equalities; nothing is built."""
    return int(np.count_nonzero(~lie.absorbed(system, cone.required_count(degree, rule))))


def degree_for(system: DelayPlant, rule: DegreeRule) -> int:
    """The degree that a design takes unless one is asked for, see DEGREES."""
    return next((degree for degree in DEGREES if monomials(system, degree, rule) <= MONOMIALS), DEGREES[-1])


def program(assembly: Assembly, epsilon: float, gamma: float | None = None) -> Program:
    """Minimise γ (`gamma` None), or minimise the trace of the cone matrices at the given level; ε is not negative."""
    if epsilon != 0.0:
        positive_scalar("epsilon", epsilon)
    system, count, drive = assembly.system, assembly.count, assembly.drive
    v_space, h_space = lie.state_space(system, count), lie.derivative_space(system, count)
    cross, level = lie.supply(system, count, drive)
    strict = lie.energy(h_space, lie.point_offsets(system)[1]) + assembly.derivative @ lie.energy(v_space)
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


Mask = npt.NDArray[np.bool_]


def reduced(assembly: Assembly) -> Assembly:
    """The program of `assembly` with rows and columns of measured variables left out; its certificates are limits.

    For γ only: a point of it gives a certificate of Theorem 3 for every level above, but not by itself.
    """
    system, count = assembly.system, assembly.count
    source, target = lie.state_space(system, count), lie.derivative_space(system, count)
    _, e, late = lie.point_offsets(system)
    unmeasured = np.arange(system.states) < system.states - system.measurements
    functions = np.tile(unmeasured, system.delay_count)
    points = np.ones(target.points, dtype=bool)
    points[e:late], points[late:] = unmeasured, functions
    everything = np.ones(source.points, dtype=bool)
    storage, v_labels = _restricted(assembly.storage, assembly.v_labels, np.concatenate([everything, functions]))
    dissipation, h_labels = _restricted(assembly.dissipation, assembly.h_labels, np.concatenate([points, functions]))
    return replace(
        assembly,
        storage=storage,
        dissipation=dissipation,
        v_labels=v_labels,
        h_labels=h_labels,
        kept=assembly.kept & _named(target, points, functions),
    )


def _restricted(
    columns: scipy.sparse.csr_array, labels: tuple[Index, ...], keep: Mask
) -> tuple[scipy.sparse.csr_array, tuple[Index, ...]]:
    """The map without the rows and columns of its matrices whose variable is not kept; empty matrices are left out."""
    rows = [keep[label] for label in labels]
    mask = np.concatenate([np.outer(row, row).ravel() for row in rows])
    left = tuple(label[row] for label, row in zip(labels, rows, strict=True) if np.any(row))
    return columns[:, np.flatnonzero(mask)], left


def _named(space: FormSpace, points: Mask, functions: Mask) -> Mask:
    """Mask of the monomials that name kept variables only."""
    functionals = np.concatenate([points, np.tile(functions, space.count)])
    first, second = cone.triangle(space.functionals)
    _, left, right = space.multiplier_functions()
    named: Mask = np.concatenate([functionals[first] & functionals[second], functions[left] & functions[right]])
    return named
