"""Condition (18) of the stability result, α₄ λ_max(P) T < 1 whatever the ratio M, the inequality (15) that it rests on,
and the true slow rates.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from replication.errors import InfeasibleError
from replication.estimation.dualrate.loop import close_loop, monodromy
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign
from replication.estimation.validation import Array, ComplexArray


@dataclass(frozen=True, eq=False)
class TheoremConstants:
    """P (2n, 2n) of ÃᵀP + P Ã = −I, its smallest eigenvalue, α₁ … α₄, and α₄ λ_max(P) T of (18), to be below one."""

    P: Array
    smallest: float
    alpha: tuple[float, float, float, float]
    condition: float


def hurwitz_margins(design: DualRateDesign) -> tuple[float, float]:
    """Largest real parts of the eigenvalues of A + B K and of A − L C, 1/s; negative means Hurwitz."""
    model = design.model
    return _growth(model.A + model.B_u @ design.feedback), _growth(model.A - design.injection @ model.C)


def theorem_constants(design: DualRateDesign) -> TheoremConstants:
    """Evaluate (12) to (18) with spectral norms; raises InfeasibleError unless A + B K and A − L C are Hurwitz."""
    margins = hurwitz_margins(design)
    if max(margins) >= 0.0:
        raise InfeasibleError(
            f"Sec. IV needs A + B K and A − L C Hurwitz; largest real parts are {margins[0]:g} and {margins[1]:g}"
        )
    A, B, C = design.model.A, design.model.B_u, design.model.C
    K, L = design.feedback, design.injection
    guided = A - L @ C
    joint = np.block([[A + B @ K, -B @ K], [np.zeros_like(A), guided]])
    P = scipy.linalg.solve_continuous_lyapunov(joint.T, -np.eye(2 * len(A)))
    P = (P + P.T) / 2
    smallest, *_, largest = map(float, np.linalg.eigvalsh(P))
    root = float(np.sqrt(smallest))
    alpha1 = (norm(C @ A) + 2 * norm(C @ B @ K)) / root
    alpha2 = (2 * norm(K @ guided) + 2 * norm(K @ B @ K) + norm(K @ L @ C)) / root
    alpha3 = norm(C @ A) / root
    total = alpha2 * norm(B) + norm(L) * alpha1 + norm(B) * alpha3 * norm(K @ L) + alpha3 * norm(L)
    alpha4 = 2 * total * largest / root
    return TheoremConstants(P, smallest, (alpha1, alpha2, alpha3, alpha4), float(alpha4 * largest * design.period))


def prediction_gap(design: DualRateDesign, *, restarted: bool = False) -> tuple[float, float]:
    """Both sides of (15) at the first instant after a measurement: the worst |y_p(t_k) − y(t_k)|, and α₃ T.

    By (5) and (6), y_p(t_k) − y(t_k) = −C e^{AT} ξ(t_{k−1}) exactly, so that the left side tends to
    (C [P⁻¹]_ξξ Cᵀ)^½ as T → 0 and not to zero. restarted: with the predictor that starts at the measurement the error
    is −C (e^{AT} − I) ξ(t_{k−1}). Here V(χ(t_{k−1})) = 1, and ξ is the worst one.
    """
    constants = theorem_constants(design)
    change = scipy.linalg.expm(design.model.A * design.period) - np.eye(design.model.order) * restarted
    predicted = design.model.C @ change
    row = np.hstack([np.zeros_like(predicted), predicted])
    worst = np.sqrt(np.max(np.diag(row @ np.linalg.solve(constants.P, row.T))))
    return float(worst), float(constants.alpha[2] * design.period)


def rate_gap(design: DualRateDesign, *, predicted: bool = False) -> float:
    """By how much the change of (6) from C ζ(t_{k−1}) departs over a period from the integral of C A ζ + C B u, over T.

    At the worst, for unit (ζ(t_{k−1}), u, ȳ(t_{k−1})). predicted: with the state ζ_p of (6) in the place of ζ by (3).
    """
    A, B, C, L = design.model.A, design.model.B_u, design.model.C, design.injection
    (n, m), p, T = B.shape, len(C), design.period
    # Over one period: ζ by (3), the model's ζ_p by (6), and the integral of C A ζ + C B u, from held u and ȳ.
    flow = np.zeros((2 * n + p + m + p,) * 2)
    flow[:n, :n], flow[:n, 2 * n + p :] = A - L @ C, np.hstack([B, L])
    flow[n : 2 * n, n : 2 * n], flow[n : 2 * n, 2 * n + p : 2 * n + p + m] = A, B
    state = slice(n, 2 * n) if predicted else slice(0, n)
    flow[2 * n : 2 * n + p, state], flow[2 * n : 2 * n + p, 2 * n + p : 2 * n + p + m] = C @ A, C @ B
    starts = np.zeros((len(flow), n + m + p))
    starts[:n, :n] = starts[n : 2 * n, :n] = np.eye(n)
    starts[2 * n + p :, n:] = np.eye(m + p)
    change = np.asarray((scipy.linalg.expm(flow * T) - np.eye(len(flow))) @ starts)
    return norm(C @ change[n : 2 * n] - change[2 * n : 2 * n + p]) / T


def slow_eigenvalues(design: DualRateDesign, observer: str) -> ComplexArray:
    """The 2n largest eigenvalues of the monodromy matrix, of plant and observer; moduli decrease."""
    eigenvalues = np.linalg.eigvals(monodromy(close_loop(design, OBSERVERS[observer]))).astype(complex)
    return np.asarray(eigenvalues[np.argsort(-np.abs(eigenvalues), kind="stable")[: 2 * design.model.order]])


def slow_rates(design: DualRateDesign, observer: str) -> ComplexArray:
    """ln(λ)/(M T) of the slow eigenvalues λ, 1/s: the continuous rates that the loop stands for."""
    return np.asarray(np.log(slow_eigenvalues(design, observer)) / design.slow_period)


def slow_rate_gap(design: DualRateDesign, observer: str, *, period: float, share: float) -> float:
    """Largest distance from `slow_rates` at the given period to eig(A + B K) ∪ eig(A − share · L C), matched, 1/s.

    As T → 0 it vanishes like T: for share = 1/M under (6), for share = 1 with the running prediction or a fast sensor.
    """
    from scipy.optimize import linear_sum_assignment  # slow to load

    model, rates = design.model, slow_rates(replace(design, period=period), observer)
    joint = model.A + model.B_u @ design.feedback, model.A - share * design.injection @ model.C
    limits = np.concatenate([np.linalg.eigvals(matrix) for matrix in joint])
    distances = np.abs(rates[:, None] - limits)
    return float(np.max(distances[linear_sum_assignment(distances)]))


def _growth(matrix: Array) -> float:
    return float(np.max(np.linalg.eigvals(matrix).real))


def norm(matrix: Array) -> float:
    """The spectral norm."""
    return float(np.linalg.norm(matrix, 2))
