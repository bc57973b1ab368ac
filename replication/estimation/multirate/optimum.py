"""The smallest achievable l2 gain of a multi-rate observer, exactly: non-causal bound and periodic Riccati recursion.

A level is achievable iff the Riccati recursion of `ScaledProblem.maps(level)` has a stabilising periodic solution
X_k >= 0 with I - W X_k W'/level^2 > 0 at every phase (necessary and sufficient, unlike a numerical SDP). No estimator,
not even a smoother, does better than the non-causal bound, so an optimum that meets it is bounded from both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear.norms import GainBracket
from replication.estimation.multirate.kalman import (
    KalmanCentre,
    RiccatiDesign,
    kalman_centre,
    kalman_design,
    largest_weighted,
    semidefinite,
    stabilises,
    stationary,
)
from replication.estimation.multirate.noncausal import noncausal_bound
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array, positive_scalar

__all__ = [
    "Optimum",
    "RiccatiDesign",
    "achievable",
    "kalman_design",
    "noncausal_bound",
    "optimal_design",
    "optimum",
    "riccati_design",
]

LEVEL_TOLERANCE = 1e-12
"""Relative width at which the search over the level ends."""
DESIGN_MARGIN = 1e-8
"""Relative distance above the optimum at which gains are computed: at the optimum the recursion degenerates."""
TOUCHING = (1e-12, 1e-10, DESIGN_MARGIN)
"""Relative distances above the non-causal bound within which the optimum counts as sitting on it."""
MAX_DOUBLINGS = 100
"""From the lower bound the level is doubled until it is achievable; this often only if rounding spoils the problem."""


@dataclass(frozen=True)
class Optimum:
    """Bracket of the smallest achievable gain, to rounding.

    lower: the largest level known to be out of reach, by the non-causal bound or by the Riccati condition.
    upper: the smallest level that passed the Riccati condition. It is an infimum in the making, not the gain of given
    gains: every level above it is reached by those of `riccati_design`, and those of `optimal_design` are computed
    DESIGN_MARGIN above it, for at the optimum itself the recursion degenerates. `l2_gain` of their error system is the
    gain achieved; it is at most (1 + DESIGN_MARGIN) upper, and may exceed upper by that much.
    noncausal: the bound for smoothers. limited_by: "noncausal" if the optimum sits on it, else "causal".
    """

    lower: float
    upper: float
    noncausal: GainBracket
    limited_by: str

    @property
    def value(self) -> float:
        """The optimum, to the relative width of the bracket."""
        return self.lower if self.limited_by == "noncausal" else self.upper


def riccati_design(problem: MultirateProblem, level: float) -> RiccatiDesign:
    """The central observer whose gain is below `level`.

    Raises InfeasibleError if no observer reaches it; otherwise as `kalman_design`.
    """
    return central(kalman_centre(problem), positive_scalar("level", level))


def central(centre: KalmanCentre, level: float) -> RiccatiDesign:
    """`riccati_design` from the Kalman filter of the problem, for many levels."""
    states, slack = _solution(centre, level)
    if states is None or slack <= 0:
        raise InfeasibleError(f"no observer has a gain below {level!r}; ask for a larger level (see `optimum`)")
    scaled = centre.scaled
    return RiccatiDesign(scaled.gains(scaled.corrected(states, scaled.maps(level))), scaled.unscaled(states), level)


def optimal_design(problem: MultirateProblem, *, margin: float = DESIGN_MARGIN) -> RiccatiDesign:
    """The central observer for the level (1 + margin) upper, with the upper end of `optimum`; raises as `optimum`.

    Its gain is below that level (`RiccatiDesign.level`), to rounding, and may exceed upper itself.
    """
    return riccati_design(problem, optimum(problem).upper * (1 + positive_scalar("margin", margin)))


def achievable(problem: MultirateProblem, level: float) -> bool:
    """Whether some observer has a gain below `level` (Riccati condition, necessary and sufficient)."""
    return _solution(kalman_centre(problem), positive_scalar("level", level))[1] > 0


def optimum(problem: MultirateProblem) -> Optimum:
    """The smallest achievable gain: the non-causal bound where it is reached, else the root of the Riccati condition.

    Raises InvalidInputError if nothing disturbs z = W e (the optimum is zero then) or an undisturbed mode is on the
    unit circle (`kalman_design`), SolverError if rounding spoils the recursion.
    """
    centre, noncausal = kalman_centre(problem), noncausal_bound(problem)
    # The square root of rounding in X_k; where disturbances reach z, the non-causal bound is not zero.
    if noncausal.lower == 0.0 and centre.floor <= 1e-7 * float(np.linalg.norm(centre.scaled.W)):
        raise InvalidInputError("the disturbances do not reach z = W e: there is nothing to minimise; check B_d and W")
    low = max(noncausal.lower, centre.floor)
    if noncausal.upper >= centre.floor:
        for distance in TOUCHING:
            touching = noncausal.upper * (1 + distance)
            if _solution(centre, touching)[1] > 0:
                return Optimum(noncausal.lower, touching, noncausal, "noncausal")
            low = touching
    low, high = _root(centre, low)
    return Optimum(low, high, noncausal, "causal")


def _root(centre: KalmanCentre, low: float) -> tuple[float, float]:
    """Largest unachievable and smallest achievable level met on the way to the root of the slack above `low`."""
    from scipy.optimize import brentq  # slow to load

    levels = {"low": low, "high": np.inf}

    def slack(level: float) -> float:
        found = _solution(centre, level)[1]
        end = "high" if found > 0 else "low"
        levels[end] = (min if found > 0 else max)(levels[end], level)
        return found

    for _ in range(MAX_DOUBLINGS):
        if slack(2 * levels["low"]) > 0:
            break
    else:
        raise SolverError(
            f"no level up to {levels['low']:.3g} proved achievable: rounding spoils the recursion; rescale"
        )
    root = brentq(slack, levels["low"], levels["high"], rtol=LEVEL_TOLERANCE / 4, xtol=1e-300)
    distance = LEVEL_TOLERANCE / 2
    while slack(root * (1 + distance)) <= 0:
        distance *= 4
    distance = LEVEL_TOLERANCE / 2
    while levels["low"] < root * (1 - distance) and slack(root * (1 - distance)) > 0:
        distance *= 4
    return levels["low"], levels["high"]


def _solution(centre: KalmanCentre, level: float) -> tuple[Array | None, float]:
    """The stabilising solution at `level` (N, n, n), scaled, and the slack 1 - max_k lambda_max(W X_k W')/level^2.

    The level is achievable iff the slack is positive; without a stabilising solution it is (None, -1).
    """
    if level <= centre.floor:
        return None, -1.0
    maps = centre.scaled.maps(level)
    states = stationary(maps, centre.states)
    if states is None or not semidefinite(states):
        return None, -1.0
    slack = 1 - (np.sqrt(largest_weighted(centre.scaled, states)) / level) ** 2
    if slack > 0 and not stabilises(centre.scaled, states, maps):
        return None, -1.0
    # Below -1 its size has no meaning for the root, and it may be huge where the recursion nearly escapes.
    return states, max(slack, -1.0)
