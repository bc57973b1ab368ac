"""Section IV-C: which A and C may stand behind the poles stated there and the gains of eq. (42), and which B_d and D.

The matrix of eq. (41) repeats that of Sec. IV-A and does not have the stated poles. Two searches on finite grids find
a diagonal of A from the stated open-loop poles, and C from the stated poles of A_e = A_e5 ... A_e0. Both count every
candidate that rounding of the printed digits can explain.

Gains that solve Theorem 2 achieve nearly the smallest possible level, so the excess of their exact norm over the exact
optimum ranks the candidates (B_d, D). The winner is checked by a computation that shares no code with that: how near
the printed gains come to the central path of the matrix inequality, which interior-point solvers follow.
Only the ratio of B_d to D matters and the sign of B_d does not: D[0][0] = 1 is a choice.
Pure functions of JSON values, without random numbers.
"""

import itertools
from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from papers.okajima2023.method.lmi import central_path
from replication.errors import InfeasibleError
from replication.estimation.linear.norms import l2_gain, spectral_norm
from replication.estimation.linear.periodic import Stage, frequency_response, lifted, monodromy
from replication.estimation.linear.riccati import RiccatiMap, recentre, settled_each
from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, ComplexArray

Json = dict[str, Any]
Matrix = list[list[float]]
Poles = Sequence[float | Sequence[float]]
"""Numbers, or [real, imaginary] that stand for a conjugate pair."""

HALF_UNIT_POLE = 0.5e-3  # the poles of A are printed to three decimals
HALF_UNIT_GAIN = 0.5e-3  # so are the gains
HALF_UNIT_ERROR_POLE = 0.5e-4  # the poles of A_e are printed to four
REAL = 1e-9
"""Imaginary part below which a root counts as real."""
DIAGONAL_RANGE = (0.5, 1.5)
"""Diagonal entries of A that are tried; those of eq. (41) lie inside."""
AT_ONCE = 64
"""Matrices C whose misfit is found together."""


def recover_poles(printed_A: Matrix, stated_poles: Poles, step: float) -> Json:
    """Find the diagonals of A on a grid that give the stated poles to the printed digits, off-diagonal as printed.

    step: of the grid over DIAGONAL_RANGE. fits: the diagonals that agree, the nearest first; poles_recovered: those of
    the first. Raises InfeasibleError if no diagonal fits.
    """
    A, stated = np.array(printed_A), complete(stated_poles)
    low, high = DIAGONAL_RANGE
    values = np.round(np.arange(low, high + step / 2, step), 9)
    grid = np.stack([axis.ravel() for axis in np.meshgrid(*[values] * len(A), indexing="ij")], axis=1)
    # The trace is the sum of the poles, so n half-units bound its error; one per thousand more allows for rounding.
    near = grid[np.abs(grid.sum(axis=1) - stated.sum().real) <= 1.001 * len(A) * HALF_UNIT_POLE]
    poles = np.linalg.eigvals(A - np.diag(np.diag(A)) + near[:, :, None] * np.eye(len(A)))
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
        "poles_recovered": upper_half(np.linalg.eigvals(with_diagonal(printed_A, fits[0]))),
    }


def with_diagonal(A: Matrix, diagonal: npt.ArrayLike) -> Matrix:
    """A with another diagonal."""
    changed = np.array(A)
    np.fill_diagonal(changed, diagonal)
    return changed.tolist()  # type: ignore[no-any-return]


def exact_diagonals(printed_A: Matrix, poles: Poles) -> list[list[float]]:
    """All real diagonals (three entries) with which A has exactly these poles, the largest first entry first.

    The coefficients of the characteristic polynomial give the sum of the entries, the sum of their products in pairs,
    and their product up to linear terms. The last one gives the third entry from the first, which is then a root of a
    polynomial of degree six.
    """
    A = np.array(printed_A)
    minors = [A[i, j] * A[j, i] for i, j in ((1, 2), (0, 2), (0, 1))]
    coefficients = np.poly(complete(poles)).real
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
    divided by what rounding of the gains and of the poles explains (linearised); a candidate fits up to 1. Exhaustive,
    by branch and bound: the misfit of the trace alone is a lower bound of the misfit.
    """
    state, gains, target = np.array(A), np.array(printed_gains), _target(complete(stated_error_poles))
    shape = (2 * bound + 1,) * gains[0].size
    tried = int(np.prod(shape))

    def candidates(places: Any) -> Array:
        return np.stack(np.unravel_index(places, shape), axis=-1).reshape(-1, *gains[0].T.shape) - float(bound)

    lowest = _trace_misfits(state, gains, bound, target)
    order = np.argsort(lowest)
    best: list[tuple[float, int, Array]] = []
    fits = start = 0
    while start < tried and (len(best) < 2 or lowest[order[start]] <= max(1.0, best[1][0])):
        places = order[start : start + AT_ONCE]
        C = candidates(places)
        misfits = _misfit(state, gains, C, target)
        fits += int(np.count_nonzero(misfits <= 1))
        best = sorted([*best, *zip(misfits.tolist(), places.tolist(), C, strict=True)], key=lambda item: item[:2])[:2]
        start += AT_ONCE
    return {
        "bound": bound,
        "tried": tried,
        "fits": fits,
        "best_misfit": best[0][0],
        "second_misfit": best[1][0],
        "C": best[0][2].tolist(),
    }


def error_monodromy(A: npt.ArrayLike, gains: npt.ArrayLike, C: npt.ArrayLike) -> Array:
    """A_e(N-1) ... A_e0 of A_ek = A - L_k C, for stacks (..., N, n, q) of gains or (..., q, n) of C.

    The gains have zeros where nothing is measured.
    """
    factors = np.asarray(A) - np.asarray(gains) @ np.asarray(C)[..., None, :, :]
    return monodromy(np.moveaxis(factors, -3, 0))


def error_poles(A: npt.ArrayLike, gains: npt.ArrayLike, C: npt.ArrayLike) -> list[list[float]]:
    """Poles of A_e as [real, imaginary] by decreasing modulus."""
    poles = np.linalg.eigvals(error_monodromy(A, gains, C)).astype(complex)
    return [[float(p.real), float(p.imag)] for p in sorted(poles, key=lambda p: (-abs(p), -p.imag))]


def _trace_misfits(A: Array, gains: Array, bound: int, target: tuple[Array, Array]) -> Array:
    """Misfit of the trace of A_e for every C, the last row the fastest: for given other rows, trace and gradient are
    polynomials in the last one, of a degree for each step that measures it, and are interpolated.
    """
    n, q = gains.shape[1:]
    degree = int(_measured(gains)[:, -1].sum())
    powers = np.array([power for power in np.ndindex(*(degree + 1,) * n) if sum(power) <= degree])
    rows = np.array([*np.ndindex(*(2 * bound + 1,) * n)]) - float(bound)
    nodes, at = (np.prod(points[:, None] ** powers, axis=2) for points in (powers.astype(float), rows))
    weights = np.linalg.solve(nodes.T, at.T).T
    others = rows[np.array([*np.ndindex(*(len(rows),) * (q - 1))], dtype=int)]
    last = np.broadcast_to(powers[:, None], (len(others), len(powers), 1, n))
    C = np.concatenate([np.repeat(others[:, None], len(powers), axis=1), last], axis=2)
    trace, *gradients = (part.reshape(*C.shape[:2], -1) for part in _trace(A, gains, C.reshape(-1, q, n)))
    reach = target[1][0] + HALF_UNIT_GAIN * sum(np.abs(weights @ gradient).sum(axis=2) for gradient in gradients)
    return np.asarray(np.abs(-(weights @ trace)[..., 0] - target[0][0]) / reach).ravel()


def _trace(A: Array, gains: Array, C: Array) -> list[Array]:
    """The trace of A_e for each C (m, q, n), and its exact gradient by each column of a gain that is not zero."""
    factors, N = A - gains @ C[:, None], len(gains)
    before, after = [np.eye(len(A))], [np.eye(len(A))]
    for k in range(N - 1):
        before.append(factors[:, k] @ before[-1])
        after.append(after[-1] @ factors[:, N - 1 - k])
    # d tr(A_e) = -tr(C (A_e(k-1) ... A_e0) (A_e(N-1) ... A_e(k+1)) dL_k)
    gradients = [(C @ before[k] @ after[N - 1 - k])[:, i] for k, i in np.argwhere(_measured(gains))]
    return [np.trace(factors[:, -1] @ before[-1], axis1=1, axis2=2), *gradients]


def _misfit(A: Array, gains: Array, C: Array, target: tuple[Array, Array]) -> Array:
    """Misfit of all coefficients for each C (m, q, n)."""
    entries = np.argwhere(np.broadcast_to(_measured(gains)[:, None, :], gains.shape))
    shifted = np.repeat(gains[None], 1 + len(entries), axis=0)
    for number, entry in enumerate(entries, start=1):
        shifted[(number, *entry)] += HALF_UNIT_GAIN
    coefficients = _characteristic(error_monodromy(A, shifted, C[:, None]))
    # A coefficient is affine in every single entry of a gain, so one difference is the whole effect of its rounding.
    reach = np.abs(coefficients[:, 1:] - coefficients[:, :1]).sum(axis=1) + target[1]
    return np.asarray(np.max(np.abs(coefficients[:, 0] - target[0]) / reach, axis=1))


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


def _target(poles: ComplexArray) -> tuple[Array, Array]:
    """Coefficients 1 ... n of the stated characteristic polynomial, and how far rounding of the poles moves them.

    A complex pole moves by half a unit in both of its parts.
    """
    half = HALF_UNIT_ERROR_POLE * np.where(poles.imag == 0, 1.0, np.sqrt(2.0))
    reach = np.zeros(len(poles))
    for i, moved in enumerate(half):
        reach += moved * np.poly(-np.delete(np.abs(poles) + half, i))
    return np.asarray(np.poly(poles)[1:].real), reach


def _measured(gains: Array) -> Array:
    """Shape (N, q): 1 where a column of the gains is not zero, that is, where a sensor is measured."""
    return np.asarray(np.any(gains != 0, axis=1), dtype=float)


def complete(poles: Poles) -> ComplexArray:
    """All poles: a number is a real one, [real, imaginary] with positive imaginary part is a conjugate pair."""
    numbers = [complex(*np.atleast_1d(pole)) for pole in poles]
    upper = [pole for pole in numbers if pole.imag >= 0]
    return np.array(upper + [pole.conjugate() for pole in upper if pole.imag > 0])


def upper_half(poles: npt.NDArray[np.inexact[Any]]) -> list[list[float]]:
    """Poles as [real, imaginary], real ones first, of each pair the one with positive imaginary part."""
    upper = sorted((p for p in poles.astype(complex) if p.imag >= 0), key=lambda p: (p.imag > 0, p.real, p.imag))
    return [[float(p.real), float(p.imag)] for p in upper]


STEP = 0.5
"""Step of the entries of B_d that are tried."""
RATIOS = (0.5, 1.0, 2.0)
"""Noise of each further sensor relative to the first that is tried."""
ANGLES = (0.0, 1.0, np.pi)
"""Lifted frequencies, radians per period, of the cheap lower bound of the norm of the printed gains."""
FIRST_CUT, ROUNDING = 0.01, 1e-9
PATH_FACTOR = 1.05
PATH_END = 1e-4
"""Gap at the end of the central path, relative to the square of the optimum."""


def recover_inputs(
    A: Matrix, C: Matrix, printed_gains: list[Matrix], schedule: SensingSchedule, bound: float = 3.0
) -> Json:
    """Find the (B_d, D) for which the printed gains (N, n, q) exceed the optimum least, and the centre nearest to them.

    Tried: B_d (n, 1) with entries in halves up to `bound`, one of each +-B_d, and diagonal D with D[0][0] = 1 and
    RATIOS for the others. Excesses are relative (norm / optimum - 1). largest_gain_difference: that of an entry of the
    printed gains from those of the centre where it is least.
    """
    gains = np.array(printed_gains)
    values = STEP * np.arange(-round(bound / STEP), round(bound / STEP) + 1)
    directions = [b for b in itertools.product(values, repeat=len(A)) if b > (0.0,) * len(A)]
    noises = [(1.0, *ratios) for ratios in itertools.product(RATIOS, repeat=len(C) - 1)]
    B_d, D = (np.array(entries) for entries in zip(*itertools.product(directions, noises), strict=True))
    (best, problem), (second, _) = _least_excess(np.array(A), np.array(C), schedule, gains, B_d, D)
    points = central_path(problem, gains, gap=PATH_END * optimum(problem).value ** 2, factor=PATH_FACTOR)
    return {
        "tried": len(B_d),
        "best_excess": best,
        "second_excess": second,
        "B_d": problem.plant.B_d.tolist(),
        "D": problem.plant.D.tolist(),
        "largest_gain_difference": min(float(np.max(np.abs(point.gains - gains))) for point in points),
    }


def _least_excess(
    A: Array, C: Array, schedule: SensingSchedule, gains: Array, B_d: Array, D: Array
) -> list[tuple[float, MultirateProblem]]:
    """The two candidates with the smallest excess, of B_d (m, n) and diagonals of D (m, q).

    A candidate is dropped without its exact optimum if a level below the attained norm by more than a cut is
    achievable. The cut grows until it is above the second excess found, so no candidate below that was dropped.
    """
    attained, cut = _attained(A, C, gains, B_d, D), FIRST_CUT
    while True:
        candidates = []
        for i in np.flatnonzero(~_achievable(A, C, schedule, B_d, D, attained / (1 + cut))):
            plant = MultiratePlant(A=A, B_d=B_d[i][:, None], C=C, D=np.diag(D[i]))
            problem = MultirateProblem(plant, schedule)
            candidates.append((l2_gain(problem.error_system(gains)).value / optimum(problem).value - 1, problem))
        candidates.sort(key=itemgetter(0))
        if len(candidates) > 1 and candidates[1][0] <= cut:
            return candidates[:2]
        cut *= 4


def _attained(A: Array, C: Array, gains: Array, B_d: Array, D: Array) -> Array:
    """Lower bounds (m,) of the norms of the printed gains: largest singular values at ANGLES."""
    n, level = len(A), np.zeros(len(B_d))
    # The error system of unit disturbances of every state and sensor, which each candidate weights.
    units = lifted([Stage(A - L @ C, np.hstack([np.eye(n), -L]), np.eye(n), np.zeros((n, n + len(C)))) for L in gains])
    for angle in ANGLES:
        responses = frequency_response(units, angle).reshape(n * len(gains), len(gains), -1)
        by_disturbance, by_noise = np.moveaxis(responses[..., :n] @ B_d.T, 2, 0), responses[..., n:] * D[:, None, None]
        weighted = np.concatenate([by_disturbance, by_noise.reshape(len(D), n * len(gains), -1)], axis=2)
        level = np.maximum(level, spectral_norm(weighted))
    return level


def _achievable(
    A: Array, C: Array, schedule: SensingSchedule, B_d: Array, D: Array, level: Array
) -> npt.NDArray[np.bool_]:
    """Whether a stabilising X_k >= 0 with X_k < level^2 I was found (W = I), per candidate; False may be in doubt."""
    information = np.einsum("kq,qi,mq,qj->kmij", schedule.mask, C, D**-2.0, C)
    G = information - np.eye(len(A)) / level[:, None, None] ** 2
    H = np.broadcast_to(B_d[:, :, None] * B_d[:, None, :], G.shape)
    maps = RiccatiMap(np.broadcast_to(A, G.shape), G, H)
    states = settled_each(maps)
    good = np.asarray(np.isfinite(states).all(axis=(0, 2, 3)))
    spectrum = np.linalg.eigvalsh(states[:, good])
    least, largest = spectrum[..., 0], spectrum[..., -1]
    closed = monodromy(recentre(maps.at(np.s_[:, good]), states[:, good]).A)
    stable = np.abs(np.linalg.eigvals(closed)).max(axis=1) < 1
    good[good] = stable & np.all((least > -ROUNDING * largest) & (largest < level[good] ** 2), axis=0)
    return good
