"""Exact l2-induced norms of discrete-time periodic systems, with a bracket; the H-infinity norm is the case N = 1.

A level g is a singular value of the lifted transfer matrix at the angle t iff e^{jt} is an eigenvalue of a symplectic
pencil (Boyd and Balakrishnan, Syst. Control Lett. 15, 1990; Bruinsma and Steinbuch, ibid. 14, 1990; here for periodic
systems, with the pencil composed stage by stage so that its size stays 2n for every period).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.optimize

from replication.errors import InfeasibleError, SolverError
from replication.estimation.periodic import PeriodicSystem, Stage, frequency_response
from replication.estimation.riccati import RiccatiMap, circle_angles
from replication.estimation.validation import Array

UPPER_MARGIN = 1e-9
"""Relative distance from the attained lower bound to the level at which the pencil is tested for the upper bound."""
CIRCLE_TOLERANCE = 1e-7
"""Eigenvalues nearer than this to the unit circle count as on it: the square root of rounding, for double ones."""
MAX_ROUNDS = 60


@dataclass(frozen=True)
class GainBracket:
    """Bracket of an induced norm. lower: attained at the lifted angle `angle` (radians per period); upper: no crossing.

    `value` is the lower end: a singular value that was evaluated, so only rounding separates it from the norm.
    """

    lower: float
    upper: float
    angle: float

    @property
    def value(self) -> float:
        """The norm, to the relative width of the bracket."""
        return self.lower


def hinf_norm(A: npt.ArrayLike, B: npt.ArrayLike, C: npt.ArrayLike, D: npt.ArrayLike) -> GainBracket:
    """H-infinity norm of the discrete-time system (A, B, C, D); raises InfeasibleError if A is not Schur stable."""
    return l2_gain(PeriodicSystem((Stage(*(np.asarray(M, dtype=float) for M in (A, B, C, D))),)))


def l2_gain(system: PeriodicSystem) -> GainBracket:
    """The l2-induced norm sup ||z|| / ||v|| of a stable periodic system, with bracket.

    Raises InfeasibleError if the system is not stable (the norm is then infinite).
    """
    radius = system.spectral_radius()
    if radius >= 1.0:
        raise InfeasibleError(
            f"the system is not stable (largest characteristic multiplier has modulus {radius:.6g}), so its gain is "
            "infinite; stabilise it first"
        )
    lifted = system.lift()
    if not lifted.B.size or not lifted.C.size:
        return GainBracket(0.0, 0.0, 0.0)

    def largest_singular_value(angle: float) -> float:
        return float(np.linalg.norm(frequency_response(lifted, angle), 2))

    def maps(level: float) -> list[RiccatiMap]:
        return [bounded_real_map(stage, level) for stage in system.stages]

    poles = np.linalg.eigvals(lifted.A)
    return peak_on_circle(largest_singular_value, maps, np.abs(np.angle(poles)))


def bounded_real_map(stage: Stage, level: float) -> RiccatiMap:
    """The Riccati map of the bounded real lemma at `level` for one stage; its period map has a stabilising fixed point
    iff the gain is below the level."""
    A, B, C, D = stage
    inputs = np.eye(B.shape[1]) - D.T @ D / level**2
    outputs = np.eye(C.shape[0]) - D @ D.T / level**2
    return RiccatiMap(
        A + B @ np.linalg.solve(inputs, D.T @ C) / level**2,
        -C.T @ np.linalg.solve(outputs, C) / level**2,
        B @ np.linalg.solve(inputs, B.T),
    )


def peak_on_circle(
    value: Callable[[float], float],
    maps: Callable[[float], Sequence[RiccatiMap]],
    hints: Array,
) -> GainBracket:
    """Supremum over [0, pi] of `value(angle)`, whose crossings of a level are the circle angles of `maps(level)`.

    hints: angles at which to start beside 0 and pi, for example those of lightly damped poles. Raises SolverError if
    the rounds run out (they end after a handful: each at least halves the set of angles above the level).
    """
    angle = max([0.0, np.pi, *hints.tolist()], key=value)
    lower = value(angle)
    if lower == 0.0 and not np.any([value(t) for t in np.linspace(0.1, 3.0, 7)]):
        return GainBracket(0.0, 0.0, 0.0)
    lower = max(lower, np.finfo(float).tiny)
    margin = UPPER_MARGIN
    for _ in range(MAX_ROUNDS):
        crossings = circle_angles(maps(lower * (1 + margin)), CIRCLE_TOLERANCE)
        if not crossings.size:
            return GainBracket(lower, lower * (1 + margin), angle)
        angle_new, lower_new = _climb(value, crossings)
        if lower_new > lower * (1 + 1e-14):
            angle, lower = angle_new, lower_new
        else:
            # Eigenvalues feign a crossing because the peak is flat or the pencil ill-conditioned: test a wider margin.
            margin *= 4
    raise SolverError(
        f"the peak of the gain was not bracketed in {MAX_ROUNDS} rounds; rescale the states of the system"
    )


def _climb(value: Callable[[float], float], crossings: Array) -> tuple[float, float]:
    """The best angle in or between the crossings of a level, polished by a bounded scalar search around it."""
    edges = np.unique(np.concatenate([[0.0], crossings, [np.pi]]))
    candidates = np.concatenate([edges, (edges[:-1] + edges[1:]) / 2])
    values = [value(float(t)) for t in candidates]
    best = float(candidates[int(np.argmax(values))])
    near = edges[np.abs(edges - best) > 0]
    low = float(np.max(near[near < best], initial=0.0))
    high = float(np.min(near[near > best], initial=np.pi))
    if high > low:
        found = scipy.optimize.minimize_scalar(
            lambda t: -value(float(t)), bounds=(low, high), method="bounded", options={"xatol": 1e-10}
        )
        if -found.fun > max(values):
            return float(found.x), float(-found.fun)
    return best, max(values)
