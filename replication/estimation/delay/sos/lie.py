"""The derivative of V along the error dynamics and the supply rate (Theorems 1 and 3), as sparse maps of coefficients.

In scaled histories φ_i(η) = e(t+τ_iη), η ∈ [-1, 0], the error obeys ė = A_0e + ΣA_kφ_k(-1) - Bw and
∂_tφ_i = φ_i'/τ_i with φ_i(0) = e. V is a form on R^n × L2^nK; its derivative is a form on
h = (w, v, e, φ_1(-1), .., φ_K(-1)) ∈ R^{r+p+n(K+1)} and the same histories; a `Drive` may put ω in place of w.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.cone import FormSpace, Index, triangle
from replication.estimation.validation import Array

# Point variables h = (ω, v, e, φ_1(-1), .., φ_K(-1)) of the dissipation, with ω = w or with the rates ẋ in ω.
#
# V moves with ẋ alone: where ẋ is itself a variable, in place of the disturbances that drive it, the matrices A and B
# leave the derivative of V and stand in |w|² only. The form is the same, and its program far sparser.


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


def supply(system: DelayPlant, count: int, drive: Drive | None = None) -> tuple[Array, Array]:
    """Coefficients of 2vᵀC_1e and of -(|w|² + |v|²): the form is the first plus γ times the second (Theorem 1)."""
    space = derivative_space(system, count)
    v, e, _ = point_offsets(system)
    cross, level = np.zeros(space.size), np.zeros(space.size)
    outputs = np.hstack([system.c10, *system.c1])
    rows, columns = np.divmod(np.arange(outputs.size), outputs.shape[1])
    cross[space.pair(v + rows, e + columns)] = 2.0 * outputs.ravel()
    signal = (drive or direct(system)).signal
    weight = signal.T @ signal
    weight[v:e, v:e] += np.eye(system.outputs)
    first, second = triangle(space.points)
    level[space.pair(first, second)] = -np.where(first == second, 1.0, 2.0) * weight[first, second]
    return cross, level


def absorbed(system: DelayPlant, count: int) -> npt.NDArray[np.bool_]:
    """Mask of the coefficients of dV/dt that the free operator 𝒵 can cancel, for a system with C_2 = [0 c].

    𝒵C_2 adds 2⟨e, 𝒵C_2e⟩, so: (e,e), (e,φ), (φ,φ) where either side is measured, (e,φ(-1)) and (φ(-1),φ) where the
    end value φ(-1) is measured.
    """
    space = derivative_space(system, count)
    n, q, k = system.states, system.measurements, system.delay_count
    _, e, late = point_offsets(system)
    hidden = np.arange(n) >= n - q
    measured = np.concatenate([np.zeros(e, dtype=bool), np.tile(hidden, 1 + k + k * count)])
    position = np.arange(space.functionals)
    end = (position >= late) & (position < space.points)
    state = (position >= e) & ~end  # e and the moments
    first, second = triangle(space.functionals)
    inside = state[first] & state[second] & (measured[first] | measured[second])
    ends = (state[first] & (end & measured)[second]) | ((end & measured)[first] & state[second])
    _, left, right = space.multiplier_functions()
    multiplier = (left // n == right // n) & (np.tile(hidden, k)[left] | np.tile(hidden, k)[right])
    mask: npt.NDArray[np.bool_] = np.concatenate([inside | ends, multiplier])
    return mask
