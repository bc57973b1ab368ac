"""The smallest achievable l2 gain of a multi-rate observer, exactly: non-causal bound and periodic Riccati recursion.

A level is achievable iff the Riccati recursion of `MultirateProblem.stages(level)` has a stabilising periodic solution
X_k >= 0 with I - W X_k W'/level^2 > 0 at every phase (necessary and sufficient, unlike a numerical SDP). No estimator,
not even a smoother, does better than the non-causal bound, so an optimum that meets it is bounded from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.norms import GainBracket, peak_on_circle
from replication.estimation.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.riccati import RiccatiMap, fixed_point
from replication.estimation.validation import Array, positive_scalar

LEVEL_TOLERANCE = 1e-12
"""Relative width at which the bisection over the level ends."""
DESIGN_MARGIN = 1e-8
"""Relative distance above the optimum at which gains are computed: at the optimum the recursion degenerates."""


@dataclass(frozen=True, eq=False)
class RiccatiDesign:
    """Gains (N, n, q) for one guaranteed `level`; X: the stabilising solution at each phase (N, n, n)."""

    gains: Array
    X: Array
    level: float


@dataclass(frozen=True)
class Optimum:
    """Bracket of the smallest achievable gain: no observer is below `lower`, and `upper` is achieved.

    noncausal: the bound for smoothers. `limited_by` is "noncausal" if the optimum sits on it, else "causal".
    """

    lower: float
    upper: float
    noncausal: GainBracket
    limited_by: str

    @property
    def value(self) -> float:
        """The optimum, to the relative width of the bracket."""
        return self.lower if self.limited_by == "noncausal" else self.upper


def kalman_design(problem: MultirateProblem, *, extra_noise: float = 0.0) -> RiccatiDesign:
    """The steady-state periodic Kalman filter (white d, w of unit intensity): the infinite level.

    extra_noise: intensity of process noise added on every state. Raises InfeasibleError if the recursion does not
    settle on stabilising gains: with detectable sensors, an undisturbed mode on the unit circle. Add noise to it then.
    """
    stages = [RiccatiMap(s.A, s.G, s.H + extra_noise * np.eye(len(s.H))) for s in problem.stages()]
    design = _design(problem, stages, np.inf)
    if design is None:
        raise InfeasibleError(
            "the Kalman recursion has no stabilising limit: a mode on or outside the unit circle is not disturbed; "
            "pass extra_noise, or give it process noise in B_d"
        )
    return design


def riccati_design(problem: MultirateProblem, level: float) -> RiccatiDesign:
    """The central observer whose gain is below `level`; raises InfeasibleError if no observer reaches it."""
    level = positive_scalar("level", level)
    design = _design(problem, problem.stages(level), level)
    if design is None:
        raise InfeasibleError(f"no observer has a gain below {level!r}; ask for a larger level (see `optimum`)")
    return design


def optimal_design(problem: MultirateProblem, *, margin: float = DESIGN_MARGIN) -> RiccatiDesign:
    """The central observer at (1 + margin) times the optimum."""
    return riccati_design(problem, optimum(problem).upper * (1 + positive_scalar("margin", margin)))


def optimum(problem: MultirateProblem) -> Optimum:
    """The smallest achievable gain, by bisection on the Riccati condition above the non-causal bound."""
    noncausal = noncausal_bound(problem)
    low, high = noncausal.lower, max(noncausal.upper, np.finfo(float).tiny)
    if noncausal.lower == 0.0:
        raise InvalidInputError("the disturbances do not reach z = W e: there is nothing to minimise; check B_d and W")
    # Bisection would creep below the non-causal bound by rounding, so it never starts under it.
    touching = high * (1 + LEVEL_TOLERANCE)
    for _ in range(8):
        if achievable(problem, touching):
            return Optimum(low, touching, noncausal, "noncausal")
        if touching > high * (1 + 1e-8):
            break
        touching = high * (1 + 10 * (touching / high - 1))
    low = high = touching
    while not achievable(problem, high):
        low, high = high, 2 * high
    while high - low > LEVEL_TOLERANCE * high:
        middle = (low + high) / 2
        low, high = (low, middle) if achievable(problem, middle) else (middle, high)
    return Optimum(low, high, noncausal, "causal")


def achievable(problem: MultirateProblem, level: float) -> bool:
    """Whether some observer has a gain below `level` (Riccati condition, necessary and sufficient)."""
    return _design(problem, problem.stages(level), level) is not None


def _design(problem: MultirateProblem, stages: list[RiccatiMap], level: float) -> RiccatiDesign | None:
    """Gains at a stabilising solution with X_k >= 0 and I - W X_k W'/level^2 > 0, or None if there is none."""
    X = fixed_point(stages)
    if X is None:
        return None
    gains, states = problem.gains_at(stages, X)
    size = max(float(np.linalg.norm(X_k, 2)) for X_k in states)
    W = problem.plant.W
    for X_k in states:
        if np.linalg.eigvalsh(X_k)[0] < -1e-9 * size:
            return None
        if np.linalg.eigvalsh(W @ X_k @ W.T)[-1] >= level**2:
            return None
    if problem.error_system(gains).spectral_radius() >= 1.0:
        return None
    return RiccatiDesign(gains, np.array(states), level)


def noncausal_bound(problem: MultirateProblem) -> GainBracket:
    """sup over frequency of the best gain of any estimator that knows all measurements, past and future.

    With T_x from d to W x and T_y from d to the whitened measurements it is sqrt(lambda_max(T_x*T_x, I + T_y*T_y)).
    Evaluated on a stabilised error system instead, so that unstable plants and poles on the circle do no harm: with
    E from (d, w) to W e and V to the innovations, it is the norm of E on the kernel of V.
    """
    gains = kalman_design(problem, extra_noise=noise_scale(problem)).gains
    lifted = _innovation_system(problem, gains).lift()
    outputs = problem.plant.W.shape[0] + np.array([len(rows) for rows in problem.measured_rows()])
    error_rows = np.concatenate([np.arange(count) < problem.plant.W.shape[0] for count in outputs])

    def value(angle: float) -> float:
        response = frequency_response(lifted, angle)
        kernel = scipy.linalg.null_space(response[~error_rows]) if not np.all(error_rows) else np.eye(response.shape[1])
        return float(np.linalg.norm(response[error_rows] @ kernel, 2)) if kernel.size else 0.0

    return peak_on_circle(value, problem.stages, np.abs(np.angle(np.linalg.eigvals(lifted.A))))


def noise_scale(problem: MultirateProblem) -> float:
    """Process noise that makes every mode disturbed, of the size of the given noise."""
    return max(float(np.linalg.norm(problem.plant.B_d, 2)) ** 2, 1e-6)


def _innovation_system(problem: MultirateProblem, gains: Array) -> PeriodicSystem:
    """The error system with outputs (W e; C_k e + D_k w) and inputs (d, w)."""
    plant = problem.plant
    stages = []
    for rows, L in zip(problem.measured_rows(), gains, strict=True):
        C, D, gain = plant.C[rows], plant.D[rows], L[:, rows]
        B = np.hstack([plant.B_d, -gain @ D])
        direct = np.vstack(
            [np.zeros((plant.W.shape[0], B.shape[1])), np.hstack([np.zeros((len(rows), plant.B_d.shape[1])), D])]
        )
        stages.append(Stage(plant.A - gain @ C, B, np.vstack([plant.W, C]), direct))
    return PeriodicSystem(tuple(stages))
