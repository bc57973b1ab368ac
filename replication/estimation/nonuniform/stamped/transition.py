"""The transition over any period by the same few lines in Python and in C; estimators with time stamps in C.

Phi(h) = e^{Ah}, Gamma(h) = int_0^h e^{As} ds B and Q(h) = int_0^h e^{As} Q e^{A's} ds are power series in h whose
coefficients are known beforehand. They are summed at h / 2^j, where they converge fast, and doubled j times:
Q(2h) = Q(h) + Phi(h) Q(h) Phi(h)'. No exponential of -A is formed, so stiff plants do no harm (cf. C. F. Van Loan,
IEEE TAC 23 (1978), who takes all three from one exponential).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy

from replication.estimation.api.export import c_file, source
from replication.estimation.linear.riccati import symmetric
from replication.estimation.validation import Array

DEGREE = 18
"""With norm(A) h at most SHORT the first term left out is below 1e-16 of the sum."""
SHORT = 0.5


@dataclass(frozen=True, eq=False)
class Transition:
    """The power series of one plant.

    table (DEGREE + 1, n, 2n + m): coefficients of h^k in Phi, Gamma and Q; order, inputs: n and m; rate: norm of A in
    balanced units, 1/s.
    """

    table: Array
    order: int
    inputs: int
    rate: float

    @classmethod
    def of(cls, A: Array, B: Array, Q: Array) -> Self:
        """For A (n, n) in 1/s, inputs B (n, m) that are held, and white noise of intensity Q (n, n)."""
        n, m = B.shape
        balanced = scipy.linalg.matrix_balance(A, permute=False)[0]
        table = np.zeros((DEGREE + 1, n, 2 * n + m))
        power, held, spread = np.eye(n), np.array(B), np.array(Q)
        table[0, :, :n] = power
        for k in range(1, DEGREE + 1):
            # The integrals of the terms before are the terms of degree k.
            table[k, :, n:] = np.hstack([held, spread]) / k
            power, held = A @ power / k, A @ held / k
            spread = (A @ spread + spread @ A.T) / k
            table[k, :, :n] = power
        return cls(table, n, m, float(np.linalg.norm(balanced, 1)))

    def at(self, h: float) -> tuple[Array, Array, Array]:
        """Phi (n, n), Gamma (n, m) and Q (n, n) over h >= 0, s."""
        Phi, Gamma, Q = self.over(np.array([h]))
        return Phi[0], Gamma[0], Q[0]

    def over(self, h: Array) -> tuple[Array, Array, Array]:
        """The same over each of several times (U,): Phi (U, n, n), Gamma (U, n, m) and Q (U, n, n)."""
        n, m = self.order, self.inputs
        doublings = np.ceil(np.log2(np.maximum(self.rate * h / SHORT, 1.0)))
        powers = (h / 2.0**doublings)[:, None] ** np.arange(DEGREE + 1)
        whole = (powers @ self.table.reshape(DEGREE + 1, -1)).reshape(len(h), n, -1)
        Phi, Gamma, Q = whole[..., :n], whole[..., n : n + m], whole[..., n + m :]
        for left in range(int(doublings.max(initial=0.0)), 0, -1):
            on = (doublings >= left)[:, None, None]
            Q = np.where(on, Q + Phi @ Q @ Phi.mT, Q)
            Gamma, Phi = np.where(on, Gamma + Phi @ Gamma, Gamma), np.where(on, Phi @ Phi, Phi)
        return Phi, Gamma, symmetric(Q)


USAGE = """\
obs_init(&s, NULL) or, with a start of OBS_ESTIMATES numbers, obs_init(&s, start); then for each sample
   obs_step(&s, t, u, y, estimate): t is its time stamp in seconds, u holds OBS_INPUTS known inputs from t on (NULL:
   as before), y holds OBS_MEASUREMENTS measurements (all of them or, of a Kalman filter, NAN where a sensor did not
   measure; NULL: there is no sample, only the input changes), and estimate receives the estimate of the OBS_ESTIMATES
   states at t. obs_predict(&s, t, estimate) gives that at a later time. Both return 0, or 1 and change nothing if a
   number is not finite, t is not later than the sample before, or it is before the newest input."""


def c_form(
    name: str, comment: str, transition: Transition, output: Array, inputs: int, own: Mapping[str, Array]
) -> str:
    """The C99 source; `name` begins every name in it, `comment` stands at the top.

    output: C; inputs: how many of those of `transition` are known. own: "gain" and "edges", G of a filter by the
    period before; or "noise" and "start", R and P0 of a Kalman filter. Raises InvalidInputError if `name` is no C
    identifier.
    """
    n, drives, fixed = transition.order, transition.inputs, "gain" in own
    phi, gamma, q = np.split(transition.table, [n, n + drives], axis=2)
    tables = {"phi": phi, "gamma": gamma, "q": q, "rate": np.array([transition.rate, SHORT]), "output": output}
    tables |= {"start": np.zeros(1), "origin": np.zeros(n), **own}
    sizes = {"estimates": n, "inputs": inputs, "held": drives - inputs, "drives": drives, "mean": n + drives - inputs}
    sizes |= {"measurements": len(output), "degree": DEGREE, "gaps": int(not fixed)}
    # A filter of fixed gains keeps no covariance.
    sizes |= {"cells": len(own["gain"]) if fixed else 1, "spread": 1 if fixed else n * n}
    body = source("stamped.c", "series.c", *(["fixed.c"] if fixed else ["weighed.c", "linear.c"]))
    return c_file(name, comment, USAGE, body, sizes, tables)
