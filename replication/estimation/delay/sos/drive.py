"""Point variables h = (ω, v, e, φ_1(-1), .., φ_K(-1)) of the dissipation, with ω = w or with the rates ẋ in ω.

V moves with ẋ alone: where ẋ is itself a variable, in place of the disturbances that drive it, the matrices A and B
leave the derivative of V and stand in |w|² only. The form is the same, and its program far sparser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array

PIVOT, WEAK = 0.1, 0.03
"""Where rates replace disturbances: least pivot of B, rows scaled to length one, and least row of B relative to its
largest and to that of [A_0 .. A_K]. The change stays well-conditioned, and the coefficients of |w|² moderate.
"""


@dataclass(frozen=True)
class Drive:
    """ẋ = rate·h and w = signal·h; shapes (n, points) and (r, points)."""

    rate: Array
    signal: Array


def direct(system: DelaySystem) -> Drive:
    """ω = w."""
    rate = np.hstack([-system.b, np.zeros((system.states, system.outputs)), system.a0, *system.a])
    return Drive(rate, np.eye(system.inputs, rate.shape[1]))


def by_rates(system: DelaySystem) -> Drive:
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
