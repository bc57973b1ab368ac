"""What the paper compares with: delays as lossless Padé sections or on Chebyshev points, LMI (3), the open loop's gain.

Padé [N/N] of e^{-s} is (1-t)/(1+t) with t the N-th truncation of tanh(s/2) = 1/(1/x + 1/(3/x + 1/(5/x + ..))), x = s/2.
The continued fraction is a lossless ladder, so the all-pass has a realisation with A + Aᵀ = -BBᵀ and moderate entries
at every order; no polynomial and none of its roots is ever computed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.conic.program import solve_modelled
from replication.estimation.delay.exact.loop import plant_terms
from replication.estimation.delay.exact.terms import Complex
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.spectrum import characteristic, generator, rightmost_roots
from replication.estimation.validation import Array, as_matrix, positive_integer, positive_scalar, undetectable_mode


@dataclass(frozen=True)
class Model:
    """A plant without delays, ẋ = a x + b w, z = c1 x, y = c2 x, with N states."""

    a: Array  # (N, N) 1/s
    b: Array  # (N, r) Effect of the disturbance
    c1: Array  # (p, N) What is estimated
    c2: Array  # (q, N) Measurements


@dataclass(frozen=True)
class AllPass:
    """ẋ = a x + b u, out = c x + d u: one channel of a delay."""

    a: Array
    b: Array
    c: Array
    d: float


def lossless_delay(order: int, delay: float) -> AllPass:
    """Padé approximant [order/order] of e^{-s·delay} with a + aᵀ = -bbᵀ, c = -d bᵀ, d = ±1."""
    order = positive_integer("order", order)
    time = positive_scalar("delay", delay, unit="s")
    odd = order % 2
    # Z strictly proper: t itself for even order, 1/t = 1/x + (rest of the ladder) for odd order.
    elements = 2.0 * np.arange(odd, order) + 1.0
    lossless, port = np.zeros((order, order)), np.zeros(order)
    port[:odd] = np.sqrt(2.0)
    if elements.size:
        link = 1.0 / np.sqrt(elements[:-1] * elements[1:])
        ladder = np.linalg.inv(np.diag(link, 1) - np.diag(link, -1))
        lossless[odd:, odd:] = -(ladder - ladder.T)  # -2K⁻¹, exactly skew
        port[odd:] = np.sqrt(2.0) * ladder[:, 0] / np.sqrt(elements[0])
    b = np.sqrt(2.0) * port[:, None]
    sign = -1.0 if odd else 1.0
    return AllPass((lossless - b @ b.T / 2.0) / time, b / np.sqrt(time), -sign * b.T / np.sqrt(time), sign)


def pade_model(system: DelayPlant, order: int) -> Model:
    """The plant with each delay as its Padé approximant [order/order]; its first n states are those of the plant.

    Only the row space of [A_i; C_1i] is delayed: rank × order states per delay.
    """
    n = system.states
    a, c1 = system.a0.copy(), system.c10.copy()
    tails: list[tuple[Array, ...]] = []
    for matrix, output, delay in zip(system.a, system.c1, system.delays, strict=True):
        _, values, right = np.linalg.svd(np.vstack([matrix, output]))
        rank = int(np.sum(values > 1e-12 * max(1.0, values[0])))
        channels = right[:rank]
        section = lossless_delay(order, delay)
        a += section.d * matrix @ channels.T @ channels
        c1 += section.d * output @ channels.T @ channels
        eye = np.eye(rank)
        tails.append(
            (
                np.kron(eye, section.a).astype(float),
                np.kron(eye, section.b) @ channels,
                matrix @ channels.T @ np.kron(eye, section.c),
                output @ channels.T @ np.kron(eye, section.c),
            )
        )
    size = n + sum(tail[0].shape[0] for tail in tails)
    whole = np.zeros((size, size))
    whole[:n, :n] = a
    outputs = [c1]
    start = n
    for tail_a, tail_b, tail_c, tail_z in tails:
        stop = start + tail_a.shape[0]
        whole[start:stop, start:stop] = tail_a
        whole[start:stop, :n] = tail_b
        whole[:n, start:stop] = tail_c
        outputs.append(tail_z)
        start = stop
    zeros = size - n
    b = np.vstack([system.b, np.zeros((zeros, system.inputs))])
    c2 = np.hstack([system.c2, np.zeros((system.measurements, zeros))])
    return Model(whole, b, np.hstack(outputs), c2)


def chebyshev_model(system: DelayPlant, order: int) -> Model:
    """The plant with its history at order + 1 Chebyshev points; the first n states are those of the plant."""
    a, c1 = generator(system, order)
    zeros = a.shape[0] - system.states
    b = np.vstack([system.b, np.zeros((zeros, system.inputs))])
    return Model(a, b, c1, np.hstack([system.c2, np.zeros((system.measurements, zeros))]))


# LMI (3): the H∞-optimal observer without delays, with Z eliminated, and by a Riccati equation.
#
# With y = C_2x free of noise, part of the state is known; what remains is a filter for the unmeasured part x_u whose
# measurement is the derivative of y: ẋ_u = A_uu x_u + B_u w, ẏ ~ A_mu x_u + B_m w (D = 0 in (3)).


AXIS = 1e-6
"""Eigenvalues this close to the imaginary axis (relative) count as on it: they leave it like √(γ - γ_min)."""

SLOW = 1e-6
"""Rates below this share of the fastest say nothing of the unit of time."""


@dataclass(frozen=True)
class LmiResult:
    """γ, and what Clarabel said."""

    gamma: float
    status: str


def require_detectable_model(model: Model) -> None:
    """Raise InvalidInputError if an unstable mode of the model is not seen by y."""
    mode = undetectable_mode(model.a, model.c2, discrete=False)
    if mode is not None:
        raise InvalidInputError(
            f"the model is not detectable: y does not see the mode {mode:.6g}; measure another state"
        )


def lmi_gain(model: Model, *, tolerance: float = 1e-9) -> LmiResult:
    """Least γ of LMI (3) with Clarabel, Z eliminated by the kernel of C_2.

    The inequalities are not strict, so γ is the infimum over strict observers. It is Clarabel's word: in awkward
    coordinates an optimum by its account can be off by per cents; `riccati_gain` is the check. Raises InvalidInputError
    for a model that is not detectable, SolverError unless Clarabel reports an optimum to the relative `tolerance`.
    """
    import cvxpy as cp

    require_detectable_model(model)
    n, r, p = model.a.shape[0], model.b.shape[1], model.c1.shape[0]
    rate = _natural_rate(model.a)
    model = Model(model.a / rate, model.b / rate**0.5, model.c1 / rate**0.5, model.c2)
    gamma = cp.Variable(nonneg=True)
    storage = cp.Variable((n, n), PSD=True)
    kernel = np.linalg.svd(model.c2)[2][model.c2.shape[0] :].T
    corner = kernel.T @ (storage @ model.a + model.a.T @ storage) @ kernel
    cross, output = -kernel.T @ storage @ model.b, kernel.T @ model.c1.T
    block = cp.bmat(
        [
            [corner, cross, output],
            [cross.T, -gamma * np.eye(r), np.zeros((r, p))],
            [output.T, np.zeros((p, r)), -gamma * np.eye(p)],
        ]
    )
    problem = cp.Problem(cp.Minimize(gamma), [(block + block.T) / 2 << 0])
    options = {"tol_gap_abs": tolerance, "tol_gap_rel": tolerance, "tol_feas": tolerance, "max_iter": 200}
    status = solve_modelled(problem, options)
    if status != cp.OPTIMAL:
        raise SolverError(f"Clarabel stopped with status {status} on LMI (3); loosen the tolerance")
    return LmiResult(float(np.asarray(gamma.value)), status)


def _natural_rate(a: Array) -> float:
    """The geometric mean of the rates of the model, 1/s: in this unit of time the solver's numbers stay moderate."""
    rates = np.abs(np.linalg.eigvals(a))
    rates = rates[rates > SLOW * rates.max(initial=0.0)]
    return float(np.exp(np.mean(np.log(rates)))) if rates.size else 1.0


def riccati_gain(model: Model, *, relative: float = 1e-10) -> float:
    """Least γ by bisection, to a `relative` width, on the Riccati equation of the unmeasured part; no code of the LMI.

    Zero if it falls below `relative` times ‖C_1‖‖B‖/‖A‖, as where y reveals w or all that z needs. Raises
    InvalidInputError if w does not reach every derivative of y (B_m without full row rank: the filter problem is then
    singular; use `lmi_gain`) or the model is not detectable, InfeasibleError if there is no finite γ.
    """
    require_detectable_model(model)
    q = model.c2.shape[0]
    right = np.linalg.svd(model.c2)[2]
    hidden, seen = right[q:].T, right[:q].T
    a, sensor = hidden.T @ model.a @ hidden, seen.T @ model.a @ hidden
    b, noise = hidden.T @ model.b, seen.T @ model.b
    output = model.c1 @ hidden
    if np.linalg.matrix_rank(noise) < q:
        raise InvalidInputError(
            "w must reach the derivative of every measurement (C_2 B of full row rank); use lmi_gain"
        )
    weight = np.linalg.inv(noise @ noise.T)
    drift = a - b @ noise.T @ weight @ sensor
    process = b @ (np.eye(b.shape[1]) - noise.T @ weight @ noise) @ b.T
    data = (drift, process, output.T @ output, sensor.T @ weight @ sensor)
    sizes = [float(np.linalg.norm(part)) for part in (model.c1, model.b, model.a)]
    least = relative * sizes[0] * sizes[1] / (sizes[2] or 1.0)
    if not np.any(output) or hidden.shape[1] == 0:
        return 0.0
    high = 1.0
    while not _solvable(*data, high):
        high *= 2.0
        if high > 1e12:
            raise InfeasibleError("no finite H∞ level found below 1e12; check detectability")
    low = 0.0
    while high - low > relative * high:
        middle = (low + high) / 2.0
        low, high = (low, middle) if _solvable(*data, middle) else (middle, high)
        if high <= least:
            return 0.0
    return high


def _solvable(drift: Array, process: Array, output: Array, sensor: Array, gamma: float) -> bool:
    """Whether the Riccati equation at level γ has a stabilising solution Y >= 0."""
    n = drift.shape[0]
    hamiltonian = np.block([[drift.T, output / gamma**2 - sensor], [-process, -drift]])
    eigenvalues = np.linalg.eigvals(hamiltonian)
    if np.any(np.abs(eigenvalues.real) <= AXIS * (1.0 + np.abs(eigenvalues))):
        return False
    _, vectors, stable = scipy.linalg.schur(hamiltonian, output="real", sort="lhp")
    if stable != n:
        return False
    top, bottom = vectors[:n, :n], vectors[n:, :n]
    if np.linalg.cond(top) > 1e14:
        return False
    solution = bottom @ np.linalg.inv(top)
    least = float(np.linalg.eigvalsh((solution + solution.T) / 2.0)[0])
    return least >= -1e-9 * (1.0 + float(np.abs(solution).max()))


# The exact frequency response and H∞ gain of the open loop: C(s)M(s)⁻¹B, with C(s) = C_10 + ΣC_1i e^{-sτ_i}


def frequency_response(system: DelayPlant, omega: Array | float) -> Complex:
    """The exact response from w to z, complex (M, p, r), at finite frequencies (M,) in rad/s."""
    s = 1j * as_matrix("omega", np.atleast_2d(omega), rows=1)[0]
    inner = np.linalg.solve(
        characteristic(plant_terms(system), s), np.broadcast_to(system.b, (s.size, *system.b.shape))
    )
    return np.asarray(_output(system, s) @ inner, dtype=complex)


def _output(system: DelayPlant, s: Complex, power: int = 0) -> Complex:
    """d^power C/ds^power at s, shape (len(s), p, n)."""
    value = np.zeros((s.size, *system.c10.shape), dtype=complex)
    if power == 0:
        value = value + system.c10
    for delay, c in zip(system.delays, system.c1, strict=True):
        value = value + (-delay) ** power * np.exp(-s * delay)[:, None, None] * c
    return value


@dataclass(frozen=True)
class GainBracket:
    """lower <= sup_ω ‖G(jω)‖ <= upper, with the frequency [rad/s] of the lower bound; bounds in floating point."""

    lower: float
    upper: float
    frequency: float


def hinf_gain(system: DelayPlant, relative: float = 1e-9, most: int = 200_000) -> GainBracket:
    """Supremum of ‖G(jω)‖ over ω by subdivision with an upper bound on every interval, `most` at most.

    On |ω-c| <= r, with x = ω-c: ‖G‖ <= max‖G_c ± rG_c'‖ + r²/2 sup‖G''‖, the last from ‖M⁻¹‖ <= μ/(1-rℓμ). Intervals
    that cannot hold the maximum are dropped. Raises InfeasibleError for an unstable plant, SolverError if `most` do not
    suffice.
    """
    positive_scalar("relative", relative)
    rightmost = rightmost_roots(system, 1)[0]
    if rightmost.real >= 0.0:
        raise InfeasibleError(f"the gain is infinite: the plant has the root {rightmost:.6g}; it must be stable")
    bound = _IntervalBound(system)
    radius = bound.far(float(np.linalg.norm(frequency_response(system, 0.0)[0], 2)))
    edges = np.linspace(0.0, radius, 201)
    centers, halves = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0
    lower, where, settled, used = 0.0, 0.0, 0.0, 0
    while centers.size:
        used += centers.size
        if used > most:
            raise SolverError(f"more than {most} intervals are needed for a gain within {relative:g}; ask for less")
        middle, upper = bound(centers, halves)
        best = int(np.argmax(middle))
        if middle[best] > lower:
            lower, where = float(middle[best]), float(centers[best])
        done = upper <= lower * (1.0 + relative)
        settled = max(settled, float(upper[done].max(initial=0.0)))
        centers, halves = centers[~done], halves[~done] / 2.0
        centers, halves = np.concatenate([centers - halves, centers + halves]), np.concatenate([halves, halves])
    origin = float(np.linalg.norm(frequency_response(system, 0.0)[0], 2))
    if origin > lower:
        lower, where = origin, 0.0
    return GainBracket(lower, max(lower, settled), where)


class _IntervalBound:
    """Bounds of ‖G‖ at the centre and over the whole of intervals of ω."""

    def __init__(self, system: DelayPlant) -> None:
        """Norms that do not depend on the interval."""
        self.system, self.plant = system, plant_terms(system)
        norms = [float(np.linalg.norm(a, 2)) for a in system.a]
        late = [float(np.linalg.norm(c, 2)) for c in system.c1]
        delays = system.delays
        self.size = float(np.linalg.norm(system.a0, 2)) + sum(norms)
        self.slope = 1.0 + sum(d * a for d, a in zip(delays, norms, strict=True))
        self.curve = sum(d * d * a for d, a in zip(delays, norms, strict=True))
        self.outputs = (
            float(np.linalg.norm(system.c10, 2)) + sum(late),
            sum(d * c for d, c in zip(delays, late, strict=True)),
            sum(d * d * c for d, c in zip(delays, late, strict=True)),
        )
        self.input = float(np.linalg.norm(system.b, 2))

    def far(self, level: float) -> float:
        """A frequency beyond which ‖G‖ is below `level`: ‖M⁻¹‖ <= 1/(ω - Σ‖A‖)."""
        reach = self.outputs[0] * self.input
        return self.size + reach / level if level > 0.0 else 1e3 * (1.0 + self.size)

    def __call__(self, centers: Array, halves: Array) -> tuple[Array, Array]:
        """Lower bounds (the value at the centre) and upper bounds over the intervals."""
        system = self.system
        s = 1j * centers
        inverse = np.linalg.inv(characteristic(self.plant, s))
        output = _output(system, s)
        state = inverse @ system.b
        slope = np.zeros_like(inverse) + np.eye(system.states)
        for delay, a in zip(system.delays, system.a, strict=True):
            slope = slope + delay * np.exp(-s * delay)[:, None, None] * a
        value = output @ state
        rate = 1j * (_output(system, s, 1) @ state - output @ inverse @ slope @ state)
        middle = np.linalg.norm(value, 2, axis=(1, 2))
        step = halves[:, None, None] * rate
        ends = np.maximum(np.linalg.norm(value + step, 2, axis=(1, 2)), np.linalg.norm(value - step, 2, axis=(1, 2)))
        mu = np.linalg.norm(inverse, 2, axis=(1, 2))
        room = 1.0 - halves * self.slope * mu
        wide = np.where(room > 0.0, mu / np.where(room > 0.0, room, 1.0), np.inf)
        c0, c1, c2 = self.outputs
        second = c2 * wide + 2.0 * c1 * self.slope * wide**2
        second = second + c0 * (2.0 * self.slope**2 * wide**3 + self.curve * wide**2)
        return middle, ends + halves**2 / 2.0 * second * self.input
