"""Filters of form (4), their error system (5) with the plant, its exact gain for given periods, and the least one.

The nominal optimum gamma*(h), the least H-infinity norm at one constant period h, comes without a solver: by closed
forms for scalar signals, and by the Riccati recursion of the H-infinity predictor. Sources: Nagpal and Khargonekar,
IEEE TAC 36 (1991); Hassibi, Sayed and Kailath, Indefinite-Quadratic Estimation (1999).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.norms import GainBracket, hinf_norm, l2_gain
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.linear.riccati import RiccatiMap, compose, gramians, settled, stacked, symmetric
from replication.estimation.nonuniform.plant import SampledPlant, as_periods, balancing, weights_of
from replication.estimation.validation import Array, StateSpace, as_matrix, positive_scalar


class Estimator(ABC):
    """What the gain of an error is found from, be the filter of form (4) or one that takes time stamps.

    The error follows steps [Phi, Gamma] `entry` of the plant, to which rows that do not depend on the period may be
    added; entry has the shape (n + m, N + m) for an error of N states.
    """

    @abstractmethod
    def error_output(self, plant: SampledPlant) -> Array:
        """The error e as rows of its states; raises InvalidInputError if filter and plant do not fit."""

    @abstractmethod
    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """State and input matrices of the error, for Phi (..., n, n) and Gamma (..., n, m)."""

    @abstractmethod
    def entry(self, plant: SampledPlant) -> Array:
        """What the transition of the plant is multiplied by from the right."""

    def steps_along(self, plant: SampledPlant, periods: Array) -> tuple[Array, Array]:
        """`error_step` for each of a sequence of periods."""
        upper = plant.transitions(periods)[:, : plant.order]
        return self.error_step(plant, upper[..., : plant.order], upper[..., plant.order :])

    @abstractmethod
    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """e_0 ... e_K from rest for a sequence of periods, one after the other."""

    def require_settling(self, plant: SampledPlant) -> None:
        """Raise InvalidInputError if the filter does not fit the plant, InfeasibleError if it settles at no period."""
        self.error_output(plant)

    def in_coordinates(self, T: Array) -> Self:
        """The same for the plant with state T x: itself, unless it knows of that state."""
        return self

    def in_units(self, units: Array) -> Self:
        """The same with its own states divided by units: itself, unless it has some."""
        return self


@dataclass(frozen=True)
class Filter(Estimator):
    """Eq. (4): x^(k+1) = A x^(k) + B y(k), z^(k) = C x^(k).

    Parameters
    ----------
    A : array (nf, nf)
        State transition from sample to sample, whatever the period.
    B : array (nf, r)
        Effect of the measurements.
    C : array (s, nf)
        The estimate.

    Raises
    ------
    InvalidInputError
        The shapes do not fit or an entry is not finite.
    """

    A: Array
    B: Array
    C: Array

    def __post_init__(self) -> None:
        A = as_matrix("A_f", self.A)
        A = as_matrix("A_f", A, rows=A.shape[0], columns=A.shape[0])
        B = as_matrix("B_f", self.B, rows=A.shape[0])
        C = as_matrix("C_f", self.C, columns=A.shape[0])
        for name, matrix in zip("ABC", (A, B, C), strict=True):
            if matrix.size == 0:
                raise InvalidInputError(f"{name}_f must not be empty, got shape {matrix.shape}")
            object.__setattr__(self, name, matrix)

    def to_statespace(self, dt: float | bool = True) -> StateSpace:
        """The filter from y to z^.

        Parameters
        ----------
        dt : float or True
            Sampling period, s; True means an unspecified one.

        Returns
        -------
        control.StateSpace
            Discrete-time and strictly proper.
        """
        import control

        return control.StateSpace(self.A, self.B, self.C, np.zeros((len(self.C), self.B.shape[1])), dt)

    def error_output(self, plant: SampledPlant) -> Array:
        """[L, -C_f] of eq. (5)."""
        if self.B.shape[1] != len(plant.C) or len(self.C) != len(plant.L):
            raise InvalidInputError(
                f"the filter maps {self.B.shape[1]} measurements to {len(self.C)} estimates, but the plant has "
                f"{len(plant.C)} and {len(plant.L)}; check B_f and C_f"
            )
        return np.hstack([plant.L, -self.C])

    def error_step(self, plant: SampledPlant, Phi: Array, Gamma: Array) -> tuple[Array, Array]:
        """The state and input matrices of the error system (5)."""
        n, nf, m = plant.order, len(self.A), plant.B.shape[1]
        state, drive = np.zeros((*Phi.shape[:-2], n + nf, n + nf)), np.zeros((*Phi.shape[:-2], n + nf, m))
        state[..., :n, :n], drive[..., :n, :] = Phi, Gamma
        state[..., n:, :n], drive[..., n:, :] = self.B @ plant.C, self.B @ plant.D
        state[..., n:, n:] = self.A
        return state, drive

    def entry(self, plant: SampledPlant) -> Array:
        """The plant goes on by itself: x and w enter, x^ does not."""
        n, nf, m = plant.order, len(self.A), plant.B.shape[1]
        return np.hstack([np.eye(n + m, n), np.zeros((n + m, nf)), np.eye(n + m, m, -n)])

    def errors(self, plant: SampledPlant, periods: Array, w: Array) -> Array:
        """Plant and filter side by side; periods (.., K) of several sequences, which see the same w, at once."""
        n, output = plant.order, self.error_output(plant)
        distinct, which = np.unique(periods, return_inverse=True)
        transitions = np.moveaxis(plant.transitions(distinct)[which.reshape(periods.shape)], -3, 0)
        drives, noises = transitions[..., :n, n:], plant.D @ w[:, :, None]
        states = np.zeros((len(transitions) + 1, *transitions.shape[1:-2], n + len(self.A), 1))
        for k, (step, drive, noise) in enumerate(zip(transitions[..., :n, :n], drives, noises, strict=True)):
            x, estimate = states[k, ..., :n, :], states[k, ..., n:, :]
            states[k + 1, ..., n:, :] = self.A @ estimate + self.B @ (plant.C @ x + noise)
            states[k + 1, ..., :n, :] = step @ x + drive @ w[k, :, None]
        return np.asarray(np.moveaxis((output @ states)[..., 0], 0, -2))

    def require_settling(self, plant: SampledPlant) -> None:
        """A_f must be Schur stable."""
        super().require_settling(plant)
        radius = self.spectral_radius()
        if radius >= 1:
            raise InfeasibleError(
                f"A_f has spectral radius {radius:.6g} >= 1: the error does not settle; its gain is infinite"
            )

    def in_units(self, units: Array) -> Self:
        """With states x^ / units."""
        return replace(self, A=self.A / units[:, None] * units, B=self.B / units[:, None], C=self.C * units)

    def spectral_radius(self) -> float:
        """Stable for every sampling sequence iff it is below one.

        Returns
        -------
        float
            Largest modulus of the eigenvalues of A_f.
        """
        return float(np.max(np.abs(np.linalg.eigvals(self.A))))


def observer(plant: SampledPlant, h: float, K: Array) -> Filter:
    """The filter x^(k+1) = Phi(h) x^(k) + K (y(k) - C x^(k)), z^ = L x^; K (n, r)."""
    Phi, _ = plant.discretise(h)
    gain = as_matrix("K", K, rows=plant.order, columns=len(plant.C))
    return Filter(Phi - gain @ plant.C, gain, plant.L)


def error_system(plant: SampledPlant, filter_: Estimator, periods: Sequence[float] | Array) -> PeriodicSystem:
    """Eq. (5), state [x; x^], under sampling periods that repeat `periods` for ever: before the first comes the last.

    Where durations count, e is scaled by sqrt(h), w by its inverse.
    """
    h, output = as_periods("periods", periods), filter_.error_output(plant)
    steps, drives = filter_.steps_along(plant, np.array([h[-1], *h]))
    direct = np.zeros((len(output), drives.shape[2]))
    stages = zip(steps[1:], drives[1:], np.sqrt(weights_of(plant, h)), strict=True)
    return PeriodicSystem(tuple(Stage(A, B / root, root * output, direct) for A, B, root in stages))


def gramian(A: Array, B: Array) -> Array:
    """W = A W A' + B B' (n, n) of a Schur stable A (n, n)."""
    reached = gramians([(A, B)])
    if reached is None:
        raise SolverError("the Gramian did not settle; a pole lies too near the unit circle")
    return np.asarray(reached[0])


def periodic_gain(plant: SampledPlant, filter_: Estimator, periods: Sequence[float]) -> GainBracket:
    """Exact l2 gain from w to e when the sampling periods repeat `periods` for ever; one period is the H-infinity norm.

    Raises InfeasibleError if the error system is unstable.
    """
    return l2_gain(error_system(plant, filter_, periods))


def gains_at(plant: SampledPlant, filters: Sequence[Estimator], periods: Sequence[float]) -> Array:
    """The gain of each filter at a constant period of its own."""
    pairs = zip(filters, periods, strict=True)
    return np.array([periodic_gain(plant, filter_, [h]).value for filter_, h in pairs])


START = 1e-9
"""P_0 relative to Gamma Gamma': positive definite, because P = 0 is a fixed point that knows the initial state."""
SETTLED = 1e-13
"""Relative change of P per step at which the recursion has settled."""
MAX_STEPS = 20_000
INDEFINITE = 1e-7
"""Negative eigenvalue of P, relative to its size, that cannot be rounding."""
DEPENDENT = 1e-12
"""Singular value of the rows of [C, D], or of the correlation of the innovation, that counts as zero."""
ATTAINED = 1e-5
"""Relative distance at which the norm of the filter must confirm the level of the recursion."""
CIRCLE = 1e-7
"""Distance of a zero from the unit circle below which the closed form is not trusted: gamma* may jump there."""


@dataclass(frozen=True)
class NominalDesign:
    """level: gamma; filter: of form (4); infeasible: largest level at which the search found none, 0 without one."""

    level: float
    filter: Filter
    infeasible: float = 0.0


def closed_form(plant: SampledPlant, h: float) -> float:
    """gamma*(h) for scalar w, y, z in the two cases that have a formula.

    C = L, D != 0: |D| prod |z_i| over the zeros z_i of w -> y outside the unit circle, 0 if there are none (Nevanlinna-
    Pick interpolation with a Blaschke product). D = 0, C Gamma != 0, all zeros inside: |L Gamma|.
    Raises InvalidInputError in every other case, with the reason.
    """
    Phi, Gamma = plant.discretise(h)
    if max(plant.B.shape[1], len(plant.C), len(plant.L)) != 1:
        raise InvalidInputError("the closed forms need scalar w, y and z; use `riccati_level`")
    D, first = float(plant.D[0, 0]), float((plant.C @ Gamma)[0, 0])
    if D != 0.0 and not np.array_equal(plant.C, plant.L):
        raise InvalidInputError("with D != 0 the closed form needs C = L; use `riccati_level`")
    if D == first == 0.0:
        raise InvalidInputError("with D = 0 the closed form needs C Gamma(h) != 0; use `riccati_level`")
    moduli = np.abs(np.linalg.eigvals(Phi - (Gamma @ plant.C / D if D else Phi @ Gamma @ plant.C / first)))
    if np.any(np.abs(moduli - 1) < CIRCLE):
        raise InvalidInputError(
            f"a zero lies on the unit circle (moduli {moduli}); gamma* jumps there, move h a little"
        )
    outside = moduli[moduli > 1]
    if D:
        return abs(D) * float(np.prod(outside)) if len(outside) else 0.0
    if len(outside):
        raise InvalidInputError("with D = 0 the closed form needs zeros inside the unit circle; use `riccati_level`")
    return abs(float((plant.L @ Gamma)[0, 0]))


def deadbeat_filter(plant: SampledPlant, h: float) -> Filter:
    """The filter with K = Phi Gamma (C Gamma)^-1 that attains |L Gamma| when D = 0 (second case of `closed_form`)."""
    Phi, Gamma = plant.discretise(h)
    return observer(plant, h, Phi @ Gamma @ np.linalg.inv(plant.C @ Gamma))


def riccati_filter(plant: SampledPlant, h: float, level: float) -> NominalDesign | None:
    """The central filter with norm below `level` at period h, or None if there is none.

    P(k+1) = Phi P Phi' + Gamma Gamma' - S R^-1 S', R = [C; L] P [C; L]' + diag(DD', -level^2 I),
    S = Phi P [C; L]' + [Gamma D', 0], from a small P(0) > 0; a filter exists iff P settles with L P L' < level^2.
    Raises InvalidInputError if the measurements reveal w so that R_11 = C P C' + DD' tends to a singular matrix (more
    measurements than disturbances, for example), SolverError if the recursion neither settles nor fails.
    """
    gamma, T = positive_scalar("level", level), balancing(plant)
    original, (plant, rows) = plant, _independent(plant.in_coordinates(T))
    Phi, Gamma = plant.discretise(h)
    start = START * np.linalg.norm(Gamma @ Gamma.T, 2) * np.eye(plant.order)
    full_rank = np.linalg.matrix_rank(plant.D) == len(plant.D)
    P = _doubled(plant, Phi, Gamma, gamma, start) if full_rank else _stepped(plant, Phi, Gamma, gamma, start)
    # P itself may tend to zero: then the measurements reveal w, and every level is achievable.
    if P is None or np.linalg.eigvalsh(P)[0] < -INDEFINITE * max(np.linalg.norm(P), np.linalg.norm(start)):
        return None
    if np.linalg.eigvalsh(plant.L @ P @ plant.L.T)[-1] >= gamma**2:
        return None
    # The a-priori H-infinity filter: K = (Phi Q C' + Gamma D')(C Q C' + D D')^-1 with Q = (P^-1 - L'L/gamma^2)^-1.
    C, D, L = plant.C, plant.D, plant.L
    Q = P + P @ L.T @ np.linalg.solve(gamma**2 * np.eye(len(L)) - L @ P @ L.T, L @ P)
    gain = np.linalg.solve(C @ Q @ C.T + D @ D.T, (Phi @ Q @ C.T + Gamma @ D.T).T).T
    filter_ = observer(original, h, np.linalg.solve(T, gain) @ rows)
    return NominalDesign(gamma, filter_) if filter_.spectral_radius() < 1 else None


def _independent(plant: SampledPlant) -> tuple[SampledPlant, Array]:
    """The plant with measurements rows @ y whose rows of [C, D] are independent: copies of others tell nothing new."""
    joint = np.hstack([plant.C, plant.D])
    sizes = np.linalg.norm(joint, axis=1, keepdims=True)
    # Rows of equal length first, so that a small unit of measurement is not taken for a copy.
    unit = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0)
    left, values, _ = np.linalg.svd(joint * unit, full_matrices=False)
    mask = values > DEPENDENT * values[0]
    if len(mask) == len(joint) and np.all(mask):
        return plant, np.eye(len(joint))
    rows = left[:, mask].T * unit.T
    return type(plant)(plant.A, plant.B, rows @ plant.C, rows @ plant.D, plant.L), rows


def _require_innovation(innovation: Array) -> None:
    """Raise InvalidInputError if a combination of the measurements tells nothing that the past does not."""
    sizes = np.sqrt(np.maximum(np.diag(innovation), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = innovation / np.outer(sizes, sizes)
    if not np.all(np.isfinite(correlation)) or np.linalg.eigvalsh(correlation)[0] <= DEPENDENT:
        raise InvalidInputError(
            f"the {len(innovation)} measurements reveal the disturbance: C P C' + D D' becomes singular, the Riccati "
            "recursion has no limit to trust; use `design_for_periods`, or give every sensor noise of its own in D"
        )


def _doubled(plant: SampledPlant, Phi: Array, Gamma: Array, gamma: float, start: Array) -> Array | None:
    """The limit of the recursion from `start` by doubling; needs D D' > 0, which removes the cross term S."""
    C, D, L = plant.C, plant.D, plant.L
    noise = np.linalg.inv(D @ D.T)
    step = RiccatiMap(
        Phi - Gamma @ D.T @ noise @ C,
        symmetric(C.T @ noise @ C - L.T @ L / gamma**2),
        symmetric(Gamma @ (np.eye(D.shape[1]) - D.T @ noise @ D) @ Gamma.T),
    )
    # Doubling starts at zero: measure P from `start`.
    identity, zero = np.eye(plant.order), np.zeros_like(start)
    shifted = compose(compose(RiccatiMap(identity, zero, start), step), RiccatiMap(identity, zero, -start))
    limit = settled(stacked([shifted]))
    return None if limit is None else start + limit[0]


def _stepped(plant: SampledPlant, Phi: Array, Gamma: Array, gamma: float, start: Array) -> Array | None:
    """The same step by step, for D without full row rank; None as soon as R loses its inertia."""
    r, s = len(plant.C), len(plant.L)
    stacked = np.vstack([plant.C, plant.L])
    cross = np.hstack([Gamma @ plant.D.T, np.zeros((plant.order, s))])
    direct = scipy.linalg.block_diag(plant.D @ plant.D.T, -(gamma**2) * np.eye(s))
    P = start
    for _ in range(MAX_STEPS):
        R = stacked @ P @ stacked.T + direct
        S = Phi @ P @ stacked.T + cross
        _require_innovation(R[:r, :r])
        if np.linalg.eigvalsh(R[r:, r:])[-1] >= 0:
            return None
        following = symmetric(Phi @ P @ Phi.T + Gamma @ Gamma.T - S @ np.linalg.solve(R, S.T))
        change = float(np.linalg.norm(following - P))
        P = following
        if change <= SETTLED * float(np.linalg.norm(P)):
            return P
    raise SolverError(f"the Riccati recursion did not settle in {MAX_STEPS} steps at level {gamma:.6g}")


def riccati_level(plant: SampledPlant, h: float, *, tolerance: float = 1e-10) -> NominalDesign:
    """gamma*(h) to a relative `tolerance` by bisection on the Riccati recursion, with the filter at its upper end.

    Raises InfeasibleError if levels near zero are achievable (then the infimum is 0 and is not attained),
    InvalidInputError as `riccati_filter`, SolverError if the norm of the filter does not confirm the level.
    """
    positive_scalar("tolerance", tolerance)
    Phi, Gamma = plant.discretise(h)
    high = hinf_norm(Phi, Gamma, plant.L, np.zeros((len(plant.L), Gamma.shape[1]))).upper * (1 + 1e-6)
    low = high * 1e-6
    design = riccati_filter(plant, h, high)
    if design is None:
        raise SolverError(
            f"the Riccati recursion rejects the level {high:.6g} that the zero filter attains at h = {h:.6g}"
        )
    if riccati_filter(plant, h, low) is not None:
        raise InfeasibleError(f"gamma*({h:.6g}) is below {low:.3g}: the infimum is 0 and no filter attains it")
    while high - low > tolerance * high:
        middle = (low + high) / 2
        better = riccati_filter(plant, h, middle)
        if better is None:
            low = middle
        else:
            high, design = middle, better
    norm = periodic_gain(plant, design.filter, [h])
    if norm.upper > high * (1 + ATTAINED) or norm.lower < low * (1 - ATTAINED):
        raise SolverError(
            f"the Riccati recursion claims the level {high:.9g} at h = {h:.6g}, but its filter has the norm "
            f"{norm.value:.9g}; use `design_for_periods`"
        )
    return replace(design, infeasible=low)
