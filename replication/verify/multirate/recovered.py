"""Section IV-C: what holds for a plant that has the poles stated there, with the off-diagonal entries printed in (41).

The diagonal, the sensors and the disturbance of that plant come with the certificate; they are an inference, and the
theorems say what they imply.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import acb, fmpq_mat, fmpq_poly

from replication.verify.balls import ends, roots
from replication.verify.linear import identity, is_schur
from replication.verify.multirate.bounds import monodromy
from replication.verify.multirate.levels import require_theorem_2
from replication.verify.multirate.sensing import schedule, select, without_noise
from replication.verify.printed import above
from replication.verify.reading import fields, matrices, matrix, positive, rational, sequence
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def poles(certificate: Certificate) -> Theorem:
    """The poles of A with the diagonal of the witness, in the order in which they are stated; one is unstable."""
    A, found = _plant(certificate, "diagonal")
    require(any(abs(root) > 1 for root in found), "no pole of A is proved to be outside the unit circle")
    parts = [part for root in found for part in ((root.real,) if root.imag == 0 else (root.real, root.imag))]
    return Theorem(
        sentence=f"With the diagonal {', '.join(str(A[i, i]) for i in range(A.nrows()))}, all else as printed, "
        "A has the stated poles, and is unstable.",
        items=tuple(ends(part) for part in parts),
        holds=True,
    )


def same_setting(certificate: Certificate) -> Theorem:
    """Whether the printed gains stabilise the error system of that A with the sensors of Sec. IV-A: they do not."""
    A, _ = _plant(certificate, "diagonal")
    found = roots(_error_polynomial(certificate, A, matrix(certificate["plant"]["C"], "plant.C")))
    outside = [abs(root) for root in found if abs(root) > 1]
    require(len(outside) > 0, "no pole of A_e is proved to be outside the unit circle")
    return Theorem(
        sentence="With the A that has the stated poles and the C of Sec. IV-A, the gains (42) leave poles of A_e of "
        f"modulus {', '.join(size.str(9) for size in outside)}.",
        holds=False,
    )


def error_poles(certificate: Certificate) -> Theorem:
    """The poles of A_e for the A and C of the witness and the printed gains, in the order in which they are stated."""
    A, _ = _plant(certificate, "diagonal", "C")
    polynomial = _error_polynomial(certificate, A, matrix(certificate["witness"]["C"], "witness.C"))
    real = [root.real for root in roots(polynomial) if root.imag == 0]
    stated = sequence(certificate["plant"]["error_poles"], "plant.error_poles", rational, A.nrows())
    require(len(real) == len(stated), "the poles of A_e are not all real")
    # Computed and stated poles are matched by size.
    by_size = iter(sorted(real, key=lambda root: abs(float(root.mid()))))
    matched = {i: next(by_size) for i in sorted(range(len(stated)), key=lambda i: abs(stated[i]))}
    return Theorem(
        sentence="For the A and C of the certificate the gains (42) give A_e the poles "
        f"{', '.join(matched[i].str(9) for i in range(len(stated)))}.",
        items=tuple(ends(matched[i]) for i in range(len(stated))),
        holds=is_schur(polynomial),
    )


def design(certificate: Certificate) -> Theorem:
    """Theorem 2 for the recovered plant: feasible at the stated level."""
    A, _ = _plant(certificate, "diagonal", "C", "B_d", "D", "P", "Y")
    witness, n = certificate["witness"], A.nrows()
    (stated,) = fields(certificate["bound"], "bound", "upper")
    level = positive(stated, "bound.upper")
    C = matrix(witness["C"], "witness.C", columns=n)
    B_d, D = matrix(witness["B_d"], "witness.B_d", rows=n), matrix(witness["D"], "witness.D", rows=C.nrows())
    system = select(A, B_d, identity(n), C, D, schedule(certificate["parameters"]))
    require_theorem_2(system, witness["P"], witness["Y"], level)
    return Theorem(
        sentence="For the unstable plant of the certificate, which has the stated poles, Theorem 2 gives an observer "
        f"with a gain of at most {above(level)}.",
        upper=level,
        holds=True,
    )


def _plant(certificate: Certificate, *witness: str) -> tuple[fmpq_mat, list[acb]]:
    """A with the printed off-diagonal entries and the diagonal of the witness, and its poles: refused unless as stated.

    witness: the fields that it must have. Of a pair of poles, the one with positive imaginary part stands for both.
    """
    fields(certificate["parameters"], "parameters", "periods", "offsets")
    given = dict(zip(witness, fields(certificate["witness"], "witness", *witness), strict=True))
    A = matrix(certificate["plant"]["A"], "plant.A")
    for i, entry in enumerate(sequence(given["diagonal"], "witness.diagonal", rational, A.nrows())):
        A[i, i] = entry
    half = positive(certificate["plant"]["half_unit"], "plant.half_unit")
    upper = [root for root in roots(A.charpoly()) if not root.imag < 0]
    stated = matrix(certificate["plant"]["poles"], "plant.poles", columns=2).tolist()
    require(len(stated) == len(upper), f"{len(stated)} poles are stated, A has {len(upper)}, counting pairs once")
    found = []
    for re, im in stated:
        near = [root for root in upper if all(abs(part) <= half for part in (root.real - re, root.imag - im))]
        require(len(near) == 1, f"A has not the stated pole {re} + {im}i")
        found.extend(near)
        upper = [root for root in upper if root is not near[-1]]
    return A, found


def _error_polynomial(certificate: Certificate, A: fmpq_mat, C: fmpq_mat) -> fmpq_poly:
    """The characteristic polynomial of A_e with the printed gains."""
    measured = schedule(certificate["parameters"])
    L = matrices(certificate["plant"]["L"], "plant.L", A.nrows(), C.nrows(), len(measured))
    return monodromy(without_noise(A, C, measured).error_system(L)).charpoly()


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "multirate.recovered-poles": poles,
    "multirate.same-setting": same_setting,
    "multirate.recovered-error-poles": error_poles,
    "multirate.recovered-design": design,
}
