"""The scalar loop A = B = C = 1, L = 2 for all periods at once: with h = e^T − 1 its matrices are rational in h.

Ā = 1 + h, B̄ = h, F = 1/(1 + h), G = h/(1 + h) and H = 2h/(1 + h), so (1 + h)^{2M} det(I − Φ) is a polynomial in h.
"""

from __future__ import annotations

from flint import arb, fmpq, fmpq_poly

from replication.verify.algebra.work import spend_on_products
from replication.verify.dualrate.loop import Loop
from replication.verify.kernel import Below, decide
from replication.verify.theorem import require

H = fmpq_poly([0, 1])
GROWTH = 1 + H
"""e^T."""


def determinant(loop: Loop, ratio: int) -> fmpq_poly:
    """(1 + h)^{2M} det(I − Φ) of the alternating predictive observer, Φ over z = (x, ζ).

    x and ζ at phase k, and what stands for the measurement then, are carried times (1 + h)^k.
    """
    one, L = fmpq(1), loop.L[0, 0]
    shapes = [M.nrows() for M in (loop.A, loop.B, loop.C)]
    unit = shapes == [1, 1, 1] and (loop.A[0, 0], loop.B[0, 0], loop.C[0, 0]) == (one, one, one)
    require(unit and L == 2, "the argument needs A = B = C = 1 and L = 2")
    columns = []
    for x, zeta in ((fmpq_poly([1]), fmpq_poly([0])), (fmpq_poly([0]), fmpq_poly([1]))):
        measured = x
        for k in range(ratio):
            spend_on_products(k + 1, (k + 1) * (loop.K[0, 0].height_bits() + 2), "det(I − Φ)")
            u = loop.K[0, 0] * zeta
            predicted = GROWTH * (GROWTH * zeta + H * u)
            x, zeta = GROWTH * (GROWTH * x + H * u), zeta + H * u + L * H * measured
            measured = predicted
        columns.append((x, zeta))
    (a, c), (b, d) = columns
    scale = GROWTH**ratio
    return (scale - a) * (scale - d) - b * c


def require_negative(polynomial: fmpq_poly, longest: fmpq) -> None:
    """Refuse unless the polynomial in h is negative for all 0 < T ≤ longest.

    With k its lowest power: the positive ones of the other coefficients, at the largest h, do not outweigh the lowest.
    """
    coefficients = polynomial.coeffs()
    lowest = next((k for k, c in enumerate(coefficients) if c != 0), None)
    require(lowest is not None, "det(I − Φ) vanishes for every period")
    reach, low = arb(longest).exp() - 1, lowest or 0
    rest = sum((arb(c).max(arb(0)) * reach**k for k, c in enumerate(coefficients[low + 1 :], 1)), arb(0))
    decide(Below(rest, -coefficients[low], f"det(I − Φ) is not proved negative for all periods up to {longest} s"))
