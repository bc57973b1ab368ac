"""Ball arithmetic: enclosures that hold for certain, and tests on them that answer yes only if every point agrees."""

from __future__ import annotations

from flint import acb, arb, arb_mat, fmpq, fmpq_poly

from replication.verify.theorem import Refused, require


def between(low: fmpq, high: fmpq) -> arb:
    """A ball that holds every number from `low` to `high`."""
    return arb(low).union(arb(high))


def require_positive_definite(M: arb_mat, what: str) -> None:
    """Refuse unless every symmetric matrix in M is positive definite: the pivots of L D L' are certainly positive.

    Only the lower triangle is read. A pivot whose ball holds zero proves nothing, and is refused too.
    """
    size = M.nrows()
    require(size == M.ncols(), f"{what} is not square")
    rest = [[M[i, j] for j in range(i + 1)] for i in range(size)]
    for k in range(size):
        pivot = rest[0][0]
        if not pivot > 0:
            raise Refused(f"{what} is not proved positive definite: pivot {k} is {pivot.str(5)}")
        below = rest[1:]
        # Row i of the lower triangle has i + 1 entries: the rows beyond it are left out.
        rest = [[a - row[0] / pivot * left[0] for a, left in zip(row[1:], below, strict=False)] for row in below]


def roots(polynomial: fmpq_poly) -> list[acb]:
    """Enclosures of all complex roots, each as often as its multiplicity; apart from each other unless equal."""
    found: list[tuple[acb, int]] = polynomial.complex_roots()  # type: ignore[assignment]  # its stubs say otherwise
    return [root for root, multiplicity in found for _ in range(multiplicity)]


def ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Rationals that bound every number of a ball."""
    require(ball.is_finite(), "a ball has no finite ends")
    return ball.lower().fmpq(), ball.upper().fmpq()
