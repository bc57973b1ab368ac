"""What a plant does over a time h, by a polynomial of fixed degree and doubling: the same few lines in Python and in C.

Phi(h) = e^{Ah}, Gamma(h) = int_0^h e^{As} ds B and Q(h) = int_0^h e^{As} Q e^{A's} ds are power series in h whose
coefficients are known beforehand. They are summed at h / 2^j, where they converge fast, and doubled j times:
Q(2h) = Q(h) + Phi(h) Q(h) Phi(h)'. No exponential of -A is formed, so stiff plants do no harm (cf. C. F. Van Loan,
IEEE TAC 23 (1978), who takes all three from one exponential).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

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
    def of(cls, A: Array, B: Array, Q: Array) -> Transition:
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
        n, m = self.order, self.inputs
        doublings = 0
        while self.rate * h > SHORT:
            h, doublings = h / 2, doublings + 1
        whole = (h ** np.arange(DEGREE + 1) @ self.table.reshape(DEGREE + 1, -1)).reshape(n, -1)
        Phi, Gamma, Q = whole[:, :n], whole[:, n : n + m], whole[:, n + m :]
        for _ in range(doublings):
            Q, Gamma, Phi = Q + Phi @ Q @ Phi.T, Gamma + Phi @ Gamma, Phi @ Phi
        return Phi, Gamma, symmetric(Q)
