"""Section IV-C: what holds for a plant that has the poles stated there, with the off-diagonal entries printed in (41).

The diagonal, the sensors and the disturbance of that plant are parameters, which the list of wanted theorems fixes;
they are an inference, and the theorems say what they imply.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from flint import acb, fmpq_mat, fmpq_poly

from replication.verify.algebra.balls import ends, roots
from replication.verify.algebra.decimals import above
from replication.verify.algebra.linear import identity, is_schur
from replication.verify.multirate.bounds import monodromy
from replication.verify.multirate.levels import require_theorem_2
from replication.verify.multirate.sensing import schedule, select, without_noise
from replication.verify.reading import fields, matrices, matrix, positive, rational, sequence
from replication.verify.theorem import Theorem, require

Certificate = Mapping[str, Any]


def poles(certificate: Certificate) -> Theorem:
    """The poles of A with the recovered diagonal, in the order in which they are stated; one is unstable."""
    A, found = _plant(certificate, "diagonal")
    require(any(abs(root) > 1 for root in found), "no pole of A is proved to be outside the unit circle")
    parts = [part for root in found for part in ((root.real,) if root.imag == 0 else (root.real, root.imag))]
    return Theorem(
        sentence=f"With the diagonal {_diagonal(A)}, all else as printed, A has the stated poles, and is unstable.",
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
    """The poles of A_e for the recovered A and C and the printed gains, in the order in which they are stated."""
    A, _ = _plant(certificate, "diagonal", "C")
    C = matrix(certificate["parameters"]["C"], "parameters.C")
    polynomial = _error_polynomial(certificate, A, C)
    real = [root.real for root in roots(polynomial) if root.imag == 0]
    stated = sequence(certificate["plant"]["error_poles"], "plant.error_poles", rational, A.nrows())
    require(len(real) == len(stated), "the poles of A_e are not all real")
    # Computed and stated poles are matched by size.
    by_size = iter(sorted(real, key=lambda root: abs(float(root.mid()))))
    matched = {i: next(by_size) for i in sorted(range(len(stated)), key=lambda i: abs(stated[i]))}
    return Theorem(
        sentence=f"With the diagonal {_diagonal(A)} of A and C = {_rows(C)} the gains (42) give A_e the poles "
        f"{', '.join(matched[i].str(9) for i in range(len(stated)))}.",
        items=tuple(ends(matched[i]) for i in range(len(stated))),
        holds=is_schur(polynomial),
    )


def design(certificate: Certificate) -> Theorem:
    """Theorem 2 for the recovered plant: feasible at the stated level."""
    A, _ = _plant(certificate, "diagonal", "C", "B_d", "D", witness=("P", "Y"))
    witness, given, n = certificate["witness"], certificate["parameters"], A.nrows()
    (stated,) = fields(certificate["bound"], "bound", "upper")
    level = positive(stated, "bound.upper")
    C = matrix(given["C"], "parameters.C", columns=n)
    B_d, D = matrix(given["B_d"], "parameters.B_d", rows=n), matrix(given["D"], "parameters.D", rows=C.nrows())
    system = select(A, B_d, identity(n), C, D, schedule(given))
    require_theorem_2(system, witness["P"], witness["Y"], level)
    return Theorem(
        sentence=f"For the unstable plant with the diagonal {_diagonal(A)} of A, C = {_rows(C)}, B_d = {_rows(B_d)} "
        f"and D = {_rows(D)}, which has the stated poles, Theorem 2 gives an observer with a gain of at most "
        f"{above(level)}.",
        upper=level,
        holds=True,
    )


def _diagonal(A: fmpq_mat) -> str:
    return ", ".join(str(A[i, i]) for i in range(A.nrows()))


def _rows(M: fmpq_mat) -> str:
    return f"[{'; '.join(' '.join(str(entry) for entry in row) for row in M.tolist())}]"


def _plant(certificate: Certificate, *recovered: str, witness: Sequence[str] = ()) -> tuple[fmpq_mat, list[acb]]:
    """A with the printed off-diagonal entries and the recovered diagonal, and its poles: refused unless as stated.

    recovered, witness: the fields that the parameters, beside the schedule, and the witness must have. Of a pair of
    poles, the one with positive imaginary part stands for both.
    """
    fields(certificate["parameters"], "parameters", "periods", "offsets", *recovered)
    fields(certificate["witness"], "witness", *witness)
    A = matrix(certificate["plant"]["A"], "plant.A")
    diagonal = sequence(certificate["parameters"]["diagonal"], "parameters.diagonal", rational, A.nrows())
    for i, entry in enumerate(diagonal):
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
