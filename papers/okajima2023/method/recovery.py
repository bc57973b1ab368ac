"""Section IV-C: which A and C may stand behind the poles stated there and the gains printed in eq. (42).

The matrix of eq. (41) repeats that of Sec. IV-A and does not have the stated poles. Two searches on finite grids find
a diagonal of A from the stated open-loop poles, and C from the stated poles of A_e = A_e5 ... A_e0. Both count every
candidate that rounding of the printed digits can explain. Pure functions of JSON values, without random numbers.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.validation import Array, ComplexArray, as_matrix, positive_integer, positive_scalar

Json = dict[str, Any]
Matrix = list[list[float]]
Poles = Sequence[float | Sequence[float]]

HALF_UNIT_POLE = 0.5e-3  # the poles of A are printed to three decimals
HALF_UNIT_GAIN = 0.5e-3  # so are the gains
HALF_UNIT_ERROR_POLE = 0.5e-4  # the poles of A_e are printed to four
REAL = 1e-9
"""Imaginary part below which a root counts as real."""
DIAGONAL_RANGE = (0.5, 1.5)
"""Diagonal entries of A that are tried; those of eq. (41) lie inside."""
TOGETHER, AT_ONCE = 4096, 64
"""Matrices C whose traces are found together; those whose misfit is."""


def recover_poles(printed_A: Matrix, stated_poles: Poles, step: float) -> Json:
    """Find the diagonals of A on a grid that give the stated poles to the printed digits, off-diagonal as printed.

    stated_poles: numbers, or [real, imaginary] that stand for a conjugate pair. step: of the grid over DIAGONAL_RANGE.
    fits: the diagonals that agree, the nearest first; poles_recovered: those of the first. Poles are [real, imaginary],
    real ones first, of each pair the one with positive imaginary part. Raises InvalidInputError for a number of poles
    other than the order of A, InfeasibleError if no diagonal fits.
    """
    A, step = as_matrix("printed_A", printed_A), positive_scalar("step", step)
    n = len(A)
    stated = _stated("stated_poles", stated_poles, n)
    low, high = DIAGONAL_RANGE
    values = np.round(np.arange(low, high + step / 2, step), 9)
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*[values] * n, indexing="ij")], axis=1)
    # The trace is the sum of the poles, so n half-units bound its error; one per thousand more allows for rounding.
    near = grid[np.abs(grid.sum(axis=1) - stated.sum().real) <= 1.001 * n * HALF_UNIT_POLE]
    poles = np.linalg.eigvals(A - np.diag(np.diag(A)) + near[:, :, None] * np.eye(n))
    # Sorting by imaginary part first pairs the poles even where real parts nearly agree.
    difference = np.sort_complex(-1j * poles) - np.sort_complex(-1j * stated)
    error = np.maximum(np.abs(difference.real), np.abs(difference.imag)).max(axis=1)
    order = np.argsort(error, kind="stable")
    fits = near[order[error[order] <= HALF_UNIT_POLE]]
    if not len(fits):
        raise InfeasibleError(f"none of the {len(grid)} diagonals tried gives the stated poles; try a smaller step")
    return {
        "step": step,
        "tried": len(grid),
        "fits": fits.tolist(),
        "poles_printed": upper_half(np.linalg.eigvals(A)),
        "poles_recovered": upper_half(np.linalg.eigvals(A - np.diag(np.diag(A)) + np.diag(fits[0]))),
    }


def exact_diagonals(printed_A: Matrix, poles: Poles) -> list[list[float]]:
    """All real diagonals (three entries) with which A has exactly these poles, the largest first entry first.

    The coefficients of the characteristic polynomial give the sum of the entries, the sum of their products in pairs,
    and their product up to linear terms. The last one gives the third entry from the first, which is then a root of a
    polynomial of degree six. Raises InvalidInputError unless A is 3 by 3 and its third-entry terms differ.
    """
    A = as_matrix("printed_A", printed_A, rows=3, columns=3)
    minors = [A[i, j] * A[j, i] for i, j in ((1, 2), (0, 2), (0, 1))]
    if minors[1] == minors[2]:
        raise InvalidInputError(
            "printed_A has A(1,3) A(3,1) = A(1,2) A(2,1), so the entries 2 and 3 cannot be told apart; exchange states"
        )
    coefficients = np.poly(_stated("poles", poles, 3)).real
    total, pairs = -coefficients[1], coefficients[2] + sum(minors)
    cyclic = A[0, 1] * A[1, 2] * A[2, 0] + A[0, 2] * A[1, 0] * A[2, 1]
    first = np.polynomial.Polynomial([0.0, 1.0])
    # The entries a, b, c have b + c = total - a and b c = pairs - a (total - a).
    rest = total - first
    product = pairs - first * rest
    determinant = -coefficients[3] - cyclic
    third = (determinant - first * product + minors[0] * first + minors[1] * rest) / (minors[1] - minors[2])
    second = rest - third
    roots = (second * third - product).roots()
    real = sorted((float(root.real) for root in roots if abs(root.imag) < REAL), reverse=True)
    return [[a, float(second(a)), float(third(a))] for a in real]


def recover_outputs(A: Matrix, printed_gains: list[Matrix], stated_error_poles: Poles, bound: int) -> Json:
    """Find the integer C, entries up to `bound`, for which the printed gains (N, n, q) give the stated poles of A_e.

    misfit: the largest distance of a coefficient of the characteristic polynomial of A_e from that of the stated poles,
    divided by what rounding of the gains and of the poles explains (linearised); a candidate fits up to 1. The search
    with the gains reversed, which reverses the product, answers whether it could be meant in the other order. Raises
    InvalidInputError if the shapes do not fit.
    """
    state, bound = as_matrix("A", A, rows=len(A), columns=len(A)), positive_integer("bound", bound)
    gains = gains_array(printed_gains, len(state))
    target = _target(_stated("stated_error_poles", stated_error_poles, len(state)))
    found = _search(state, gains, target, bound)
    return {
        "bound": bound,
        "tried": found.tried,
        "fits": found.fits,
        "best_misfit": found.best,
        "second_misfit": found.second,
        "C": found.C.tolist(),
    }


def error_poles(A: Matrix, gains: list[Matrix], C: Matrix) -> list[list[float]]:
    """Poles of A_e as [real, imaginary] by decreasing modulus."""
    return by_modulus(np.linalg.eigvals(_monodromy(_factors(np.array(A), np.array(gains), np.array(C)))))


class _Target(NamedTuple):
    """Coefficients 1 ... n of the stated characteristic polynomial, and how far rounding of the poles moves them."""

    coefficients: Array
    reach: Array


class _Found(NamedTuple):
    """Outcome of a search over C: how many were tried and fit, the two smallest misfits, and the best C."""

    tried: int
    fits: int
    best: float
    second: float
    C: Array


def _search(A: Array, gains: Array, target: _Target, bound: int) -> _Found:
    """Exhaustive search by branch and bound: the misfit of the trace alone is a lower bound of the misfit."""
    q = gains.shape[2]
    rows = np.array(list(itertools.product(range(-bound, bound + 1), repeat=len(A))), dtype=float)
    heads = np.array(list(itertools.product(rows, repeat=q - 1))).reshape(-1, q - 1, len(A))
    size = max(1, TOGETHER // len(rows))
    lowest = np.concatenate(
        [_trace_misfit(A, gains, heads[i : i + size], rows, target).ravel() for i in range(0, len(heads), size)]
    )
    order = np.argsort(lowest)
    best: list[tuple[float, int, Array]] = []
    fits = start = 0
    while start < len(order) and (len(best) < 2 or lowest[order[start]] <= max(1.0, best[1][0])):
        places = order[start : start + AT_ONCE]
        C = np.concatenate([heads[places // len(rows)], rows[places % len(rows), None]], axis=1)
        misfits = _misfit(A, gains, C, target)
        fits += int(np.count_nonzero(misfits <= 1))
        best = sorted([*best, *zip(misfits.tolist(), places.tolist(), C, strict=True)], key=lambda item: item[:2])[:2]
        start += AT_ONCE
    return _Found(lowest.size, fits, best[0][0], best[1][0], best[0][2])


def _factors(A: Array, gains: Array, C: Array) -> Array:
    """A_ek = A - L_k C, shape (..., N, n, n); gains (..., N, n, q) have zeros where nothing is measured."""
    return np.asarray(A - gains @ C[..., None, :, :])


def _monodromy(factors: Array) -> Array:
    """The product A_e(N-1) ... A_e0 over the axis of phases, shape (..., n, n)."""
    total = factors[..., 0, :, :]
    for k in range(1, factors.shape[-3]):
        total = factors[..., k, :, :] @ total
    return total


def _trace_misfit(A: Array, gains: Array, heads: Array, rows: Array, target: _Target) -> Array:
    """Misfit of the trace of A_e, from its exact gradient, for each C of a head (h, q - 1, n) and a last row (m, n).

    Of shape (h, m).
    """
    N, n, q = gains.shape
    # Candidates last, where they are multiplied at once.
    measured, stack = _measured(gains), np.empty((q, n, len(heads), len(rows)))
    stack[:-1], stack[-1] = heads.transpose(1, 2, 0)[..., None], rows.T[:, None]
    # Where the last sensor is not measured, there is one factor for all rows.
    factors = [
        A[:, :, None, None] - _product(gain[:, :, None, None], stack if last else stack[..., :1])
        for gain, last in zip(gains, measured[:, -1], strict=True)
    ]
    before, after = [np.eye(n)[:, :, None, None]], [np.eye(n)[:, :, None, None]]
    for k in range(N - 1):
        before.append(_product(factors[k], before[-1]))
        after.append(_product(after[-1], factors[N - 1 - k]))
    reach = np.full(stack.shape[2:], target.reach[0])
    for k, sensor in np.argwhere(measured).tolist():
        # d tr(A_e) = -tr(C (A_e(k-1) ... A_e0) (A_e(N-1) ... A_e(k+1)) dL_k)
        gradient = _product(_product(stack[sensor : sensor + 1], before[k]), after[N - 1 - k])
        reach += HALF_UNIT_GAIN * np.abs(gradient).sum(axis=(0, 1))
    trace = np.sum(factors[-1] * before[-1].swapaxes(0, 1), axis=(0, 1))
    return np.asarray(np.abs(-trace - target.coefficients[0]) / reach)


def _product(left: Array, right: Array) -> Array:
    """Of matrices (p, q, ..) and (q, r, ..), those with the same last indices multiplied."""
    return np.asarray(sum(left[:, j, None] * right[None, j] for j in range(len(right))))


def _misfit(A: Array, gains: Array, C: Array, target: _Target) -> Array:
    """Misfit of all coefficients for each C (m, q, n)."""
    entries = np.argwhere(np.broadcast_to(_measured(gains)[:, None, :], gains.shape))
    shifted = np.repeat(gains[None], 1 + len(entries), axis=0)
    for number, entry in enumerate(entries, start=1):
        shifted[(number, *entry)] += HALF_UNIT_GAIN
    coefficients = _characteristic(_monodromy(_factors(A, shifted, C[:, None])))
    # A coefficient is affine in every single entry of a gain, so one difference is the whole effect of its rounding.
    reach = np.abs(coefficients[:, 1:] - coefficients[:, :1]).sum(axis=1) + target.reach
    return np.asarray(np.max(np.abs(coefficients[:, 0] - target.coefficients) / reach, axis=1))


def _characteristic(matrices: Array) -> Array:
    """Coefficients 1 ... n of det(s I - M) by the Faddeev-LeVerrier recursion; unlike the poles, smooth in M."""
    n = matrices.shape[-1]
    work, coefficients = np.zeros_like(matrices), []
    last = np.ones(matrices.shape[:-2])
    for k in range(1, n + 1):
        work = matrices @ (work + last[..., None, None] * np.eye(n))
        last = -np.trace(work, axis1=-2, axis2=-1) / k
        coefficients.append(last)
    return np.stack(coefficients, axis=-1)


def _target(poles: ComplexArray) -> _Target:
    """The stated polynomial; a complex pole moves by half a unit in both of its parts."""
    half = HALF_UNIT_ERROR_POLE * np.where(poles.imag == 0, 1.0, np.sqrt(2.0))
    reach = np.zeros(len(poles))
    for i, moved in enumerate(half):
        reach += moved * np.poly(-np.delete(np.abs(poles) + half, i))
    return _Target(np.asarray(np.poly(poles)[1:].real), reach)


def _measured(gains: Array) -> Array:
    """Shape (N, q): 1 where a column of the gains is not zero, that is, where a sensor is measured."""
    return np.asarray(np.any(gains != 0, axis=1), dtype=float)


def gains_array(printed_gains: list[Matrix], n: int) -> Array:
    """Printed gains as an array (N, n, q); raises InvalidInputError if their shapes do not fit."""
    if len({np.shape(L) for L in printed_gains}) != 1:
        raise InvalidInputError(
            f"printed_gains must be N matrices of one shape, got {[np.shape(L) for L in printed_gains]}"
        )
    return np.stack([as_matrix(f"printed_gains[{k}]", L, rows=n) for k, L in enumerate(printed_gains)])


def _stated(name: str, poles: Poles, n: int) -> ComplexArray:
    """All n poles: a number is a real pole, [real, imaginary] with positive imaginary part is a conjugate pair."""
    given = [complex(*np.atleast_1d(np.asarray(pole, dtype=float))) for pole in poles]
    upper = [pole for pole in given if pole.imag >= 0]
    complete = np.array(upper + [pole.conjugate() for pole in upper if pole.imag > 0])
    if len(complete) != n or not np.all(np.isfinite(complete)):
        raise InvalidInputError(f"{name} must be {n} finite poles (a conjugate pair counts twice), got {poles!r}")
    return complete


def upper_half(poles: npt.NDArray[np.inexact[Any]]) -> list[list[float]]:
    """Poles as [real, imaginary], real ones first, of each pair the one with positive imaginary part."""
    kept = sorted((p for p in poles.astype(complex) if p.imag >= 0), key=lambda p: (p.imag > 0, p.real, p.imag))
    return [[float(p.real), float(p.imag)] for p in kept]


def by_modulus(poles: npt.NDArray[np.inexact[Any]]) -> list[list[float]]:
    """Poles as [real, imaginary] by decreasing modulus."""
    ordered = sorted(poles.astype(complex), key=lambda p: (-abs(p), -p.imag))
    return [[float(p.real), float(p.imag)] for p in ordered]
