"""Ball arithmetic: enclosures that hold for certain, and tests on them that answer yes only if every point agrees."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat

from replication.verify.algebra.linear import block, zeros
from replication.verify.theorem import require


def between(low: fmpq, high: fmpq) -> arb:
    """A ball that holds every number from `low` to `high`."""
    return arb(low).union(arb(high))


def ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Rationals that bound every number of a ball."""
    require(ball.is_finite(), "a ball has no finite ends")
    return ball.lower().fmpq(), ball.upper().fmpq()


def largest(values: Sequence[arb]) -> arb:
    """The maximum of balls."""
    return reduce(arb.max, values)


def energy(vector: acb_mat | arb_mat) -> arb:
    """The sum of the squared moduli of all entries."""
    return sum((entry.real**2 + entry.imag**2 for entry in acb_mat(vector).entries()), arb(0))


def complex_of(pair: Sequence[fmpq]) -> acb:
    """The number with this real and imaginary part."""
    real, imaginary = pair
    return acb(arb(real), arb(imaginary))


def circle_point(t: fmpq) -> acb:
    """(1 + it) / (1 - it) = (1 - t^2 + 2it) / (1 + t^2), a point of the unit circle."""
    return acb(arb((1 - t * t) / (1 + t * t)), arb(2 * t / (1 + t * t)))


def beside(left: arb_mat, right: arb_mat) -> arb_mat:
    """[left, right]."""
    return arb_mat([[*a, *b] for a, b in zip(left.tolist(), right.tolist(), strict=True)])


def generator(A: fmpq_mat, B: fmpq_mat) -> arb_mat:
    """N = [[A, B], [0, 0]]: the upper rows of its exponential at t are those of `hold`."""
    return arb_mat(block([[A, B], [zeros(B.ncols(), A.ncols()), zeros(B.ncols(), B.ncols())]]))


def hold(A: fmpq_mat, B: fmpq_mat, time: fmpq | arb) -> tuple[arb_mat, arb_mat]:
    """e^{A t} and ∫₀^t e^{A τ} dτ · B, which take state and held input to the next state, for all t in a ball."""
    n = A.nrows()
    upper = (generator(A, B) * arb(time)).exp().tolist()[:n]
    return arb_mat([row[:n] for row in upper]), arb_mat([row[n:] for row in upper])
