"""The part of python-flint that the verifier uses, from the standard library alone: a second arithmetic.

Under the names of python-flint: `fmpq`, a Fraction, and its matrices and polynomials are exact; `arb` and `acb` are
numbers enclosed with a radius, rounded outwards to multiples of 2^-BITS. It shares no code with FLINT. What cannot be
enclosed, such as a quotient by what may be zero, is refused; python-flint goes on with a number of which nothing is
known.
"""

from replication.verify.stdlib.balls import acb, arb, ctx, fmpq, fmpz
from replication.verify.stdlib.exact import fmpq_mat, fmpq_poly, fmpz_mat
from replication.verify.stdlib.matrices import acb_mat, acb_poly, arb_mat, arb_poly

__all__ = [
    "acb", "acb_mat", "acb_poly", "arb", "arb_mat", "arb_poly", "ctx", "fmpq",
    "fmpq_mat", "fmpq_poly", "fmpz", "fmpz_mat",
]  # fmt: skip
