"""Section IV-C: what holds for a plant that has the poles stated there, with the off-diagonal entries printed in (41).

The diagonal, the sensors and the disturbance of that plant come with the certificate; they are an inference, and the
theorems say what they imply.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flint import fmpq_mat

from replication.verify.balls import ends, roots
from replication.verify.linear import identity, is_schur
from replication.verify.multirate.bounds import monodromy
from replication.verify.multirate.levels import require_theorem_2
from replication.verify.multirate.sensing import schedule, select
from replication.verify.printed import above
from replication.verify.reading import fields, matrices, matrix, positive, rational, sequence
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def poles(certificate: Certificate) -> Theorem:
    """The poles of A with the diagonal of the witness, real ones first, and one of them outside the unit circle."""
    A = _plant(certificate, "diagonal")
    upper_half = [root for root in roots(A.charpoly()) if not root.imag < 0]
    upper_half.sort(key=lambda root: (root.imag > 0, float(root.real.mid())))
    largest = max(upper_half, key=lambda root: float(abs(root).mid()))
    require(abs(largest) > 1, "no pole of A is proved to be outside the unit circle")
    parts = [part for root in upper_half for part in ((root.real, root.imag) if root.imag > 0 else (root.real,))]
    return Theorem(
        sentence=f"With the diagonal {', '.join(str(A[i, i]) for i in range(A.nrows()))}, all else as printed, "
        f"A has the stated poles; one of them has the modulus {abs(largest).str(9)}.",
        items=tuple(ends(part) for part in parts),
        holds=True,
    )


def same_setting(certificate: Certificate) -> Theorem:
    """Whether the printed gains stabilise the error system of that A with the sensors of Sec. IV-A."""
    A = _plant(certificate, "diagonal")
    transition = _transition(certificate, A, matrix(certificate["plant"]["C"], "plant.C"))
    largest = max((abs(root) for root in roots(transition.charpoly())), key=lambda size: float(size.mid()))
    require(largest > 1, "the printed gains stabilise the plant of the witness")
    return Theorem(
        sentence=f"With the A that has the stated poles and the C of Sec. IV-A, the gains (42) leave a multiplier of "
        f"modulus {largest.str(9)}.",
        holds=False,
    )


def error_poles(certificate: Certificate) -> Theorem:
    """The poles of A_e for the A and C of the witness and the printed gains, in the order in which they are stated."""
    A = _plant(certificate, "diagonal", "C")
    transition = _transition(certificate, A, matrix(certificate["witness"]["C"], "witness.C"))
    real = [root.real for root in roots(transition.charpoly()) if root.imag == 0]
    require(len(real) == A.nrows(), "the poles of A_e are not all real")
    # As stated, by size: each computed pole beside the stated one of the same rank.
    stated = [abs(value) for value in sequence(certificate["plant"]["error_poles"], "plant.error_poles", rational)]
    ranked = sorted(real, key=lambda root: -abs(float(root.mid())))
    order = sorted(range(len(stated)), key=lambda i: -stated[i])
    return Theorem(
        sentence="For the A and C of the certificate the gains (42) give A_e the poles "
        f"{', '.join(root.str(9) for root in ranked)}.",
        items=tuple(ends(ranked[order.index(i)]) for i in range(len(stated))),
        holds=is_schur(transition.charpoly()),
    )


def design(certificate: Certificate) -> Theorem:
    """Theorem 2 for the recovered plant: feasible at the stated level."""
    A = _plant(certificate, "diagonal", "C", "B_d", "D", "P", "Y")
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


def _plant(certificate: Certificate, *witness: str) -> fmpq_mat:
    """A with the printed off-diagonal entries and the diagonal of the witness, if it has the stated poles.

    witness: the fields that it must have.
    """
    fields(certificate["parameters"], "parameters", "periods", "offsets")
    given = dict(zip(witness, fields(certificate["witness"], "witness", *witness), strict=True))
    A = matrix(certificate["plant"]["A"], "plant.A")
    for i, entry in enumerate(sequence(given["diagonal"], "witness.diagonal", rational, A.nrows())):
        A[i, i] = entry
    half = positive(certificate["plant"]["half_unit"], "plant.half_unit")
    stated = matrix(certificate["plant"]["poles"], "plant.poles", columns=2).tolist()
    wanted = [*stated, *([re, -im] for re, im in stated if im != 0)]
    found = roots(A.charpoly())
    for re, im in wanted:
        near = [root for root in found if abs(root.real - re) <= half and abs(root.imag - im) <= half]
        require(len(near) == 1, f"A has not the stated pole {re} + {im}i")
    require(len(wanted) == len(found), f"{len(wanted)} poles are stated, A has {len(found)}")
    return A


def _transition(certificate: Certificate, A: fmpq_mat, C: fmpq_mat) -> fmpq_mat:
    """The transition of the error over one period with the printed gains."""
    measured = schedule(certificate["parameters"])
    L = matrices(certificate["plant"]["L"], "plant.L", A.nrows(), C.nrows(), len(measured))
    nothing = fmpq_mat(A.nrows(), 1)
    system = select(A, nothing, nothing, C, fmpq_mat(C.nrows(), 1), measured)
    return monodromy(system.error_system(L))


STATEMENTS: Mapping[str, Callable[[Certificate], Theorem]] = {
    "multirate.recovered-poles": poles,
    "multirate.same-setting": same_setting,
    "multirate.recovered-error-poles": error_poles,
    "multirate.recovered-design": design,
}
