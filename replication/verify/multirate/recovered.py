"""Section IV-C: what holds for a plant that has the poles stated there, with the off-diagonal entries printed in (41).

Its A, or the diagonal, and what else may differ are parameters, which the list of wanted theorems fixes; they are an
inference, and the theorems say what they imply.
"""

from collections.abc import Mapping
from functools import partial
from typing import Any

from flint import acb, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import characteristic_polynomial, ends, identity, roots
from replication.verify.kernel import decide, holds, within
from replication.verify.multirate.levels import require_theorem_2
from replication.verify.multirate.sensing import TIMES, Sensing, monodromy, schedule, without_noise
from replication.verify.predicate import Says
from replication.verify.reading import (
    known_fields,
    matrices,
    matrix,
    positive,
    rational,
    sequence,
    sized,
    square,
    symmetric,
)
from replication.verify.statement import UPPER, Depends, Table, statement
from replication.verify.theorem import Found, require

Plant = Mapping[str, Any]
RECOVERED: Table = {
    **TIMES,
    "diagonal": Depends(lambda values: sized(sequence, rational, square(values.plant["A"], "plant.A").nrows())),
}
DESIGNED: Table = {
    **TIMES,
    "A": square,
    "B_d": Depends(lambda values: sized(matrix, values.A.nrows())),
    "D": Depends(lambda values: sized(matrix, len(values.plant["C"]))),
}
RECOVERED_A, RECOVERED_PLANT, ANY_A = ("diagonal in steps",), ("plant found by search",), ("any entries of A",)
"""Readings of the paper: which of its matrices are found by search."""


def reading_of(parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Of the two diagonals with the stated poles, one has two decimals, and the other one has not."""
    short = all((rational(entry, "diagonal") * 100).denominator == 1 for entry in parameters["diagonal"])
    return RECOVERED_A if short else ("the other real diagonal",)


def read_stated(value: Any, path: str) -> Plant:
    """What the paper states of its plant, for the statements to read."""
    known_fields(value, path, "name", "A", "C", "L", "half_unit", "poles", "error_poles")
    return dict(value)


on_recovered = partial(statement, source="okajima2023", plant=read_stated, parameters=RECOVERED)


@on_recovered(
    "multirate.recovered-poles",
    holds=True,
    says=tuple(
        Says(quantity=name, setting=lambda parameters: {"diagonal": parameters["diagonal"]}, readings=RECOVERED_A)
        for name in ("poles", "unstable plant")
    ),
)
def poles(plant: Plant, diagonal: list[fmpq], **_: Any) -> Found:
    """With the diagonal {shown} of A, its other entries as printed, A has poles that are those of Sec. IV-C within
    {half} in each part, and one of them is proved to lie outside the unit circle.

    Another diagonal may have these poles too.
    """
    A, eigenvalues = _recovered(plant, diagonal)
    require_unstable(eigenvalues)
    parts = [part for root in eigenvalues for part in ((root.real,) if root.imag == 0 else (root.real, root.imag))]
    words = {"shown": _diagonal(A), "half": rational(plant["half_unit"], "plant.half_unit")}
    return Found(words=words, items=tuple(ends(part) for part in parts))


@on_recovered("multirate.same-setting", holds=False, says=Says(quantity="stable error system", readings=reading_of))
def same_setting(plant: Plant, periods: list[int], offsets: list[int], diagonal: list[fmpq]) -> Found:
    """With the diagonal {shown} of A, one for which A has the poles stated in Sec. IV-C, and C = {sensors}, the gains
    (42) leave poles of A_e of modulus {outside:ball 9}, outside the unit circle.
    """
    A, _ = _recovered(plant, diagonal)
    C = matrix(plant["C"], "plant.C")
    eigenvalues = roots(_error_polynomial(plant, schedule(periods, offsets), A, C))
    outside = [abs(root) for root in eigenvalues if abs(root) > 1]
    require(len(outside) > 0, "no pole of A_e is proved to be outside the unit circle")
    return Found(words={"shown": _diagonal(A), "sensors": _rows(C), "outside": outside})


@on_recovered(
    "multirate.free-setting",
    parameters={**TIMES, "A": square},
    holds=True,
    says=Says(quantity="stable error system", readings=ANY_A),
)
def free_setting(plant: Plant, periods: list[int], offsets: list[int], A: fmpq_mat) -> Found:
    """With A = {shown}, which has the poles stated in Sec. IV-C, and C = {sensors} the gains (42) leave all poles of
    A_e inside the unit circle.

    Other entries of A than those on its diagonal differ from the print; it is one of many.
    """
    _stated_poles(plant, A)
    C = matrix(plant["C"], "plant.C")
    decide(within(_error_polynomial(plant, schedule(periods, offsets), A, C), "the poles of A_e"))
    return Found(words={"shown": _rows(A), "sensors": _rows(C)})


@on_recovered(
    "multirate.recovered-error-poles",
    parameters={**RECOVERED, "C": matrix},
    says=tuple(Says(quantity=name, readings=RECOVERED_PLANT) for name in ("error poles", "stable error system")),
)
def error_poles(plant: Plant, periods: list[int], offsets: list[int], diagonal: list[fmpq], C: fmpq_mat) -> Found:
    """With the diagonal {shown} of A, one for which A has the poles stated in Sec. IV-C, and C = {sensors} the gains
    (42) give A_e the poles {matched:ball 9}.
    """
    A, _ = _recovered(plant, diagonal)
    polynomial = _error_polynomial(plant, schedule(periods, offsets), A, C)
    real = [root.real for root in roots(polynomial) if root.imag == 0]
    stated = sequence(plant["error_poles"], "plant.error_poles", rational, A.nrows())
    require(len(real) == len(stated), "the poles of A_e are not all real")
    # Computed and stated poles are matched by size.
    by_size = iter(sorted(real, key=lambda root: abs(float(root.mid()))))
    places = {i: next(by_size) for i in sorted(range(len(stated)), key=lambda i: abs(stated[i]))}
    matched = [places[i] for i in range(len(stated))]
    words = {"shown": _diagonal(A), "sensors": _rows(C), "matched": matched}
    stable = holds(within(polynomial, "the poles of A_e"))
    return Found(words=words, items=tuple(ends(pole) for pole in matched), holds=stable)


@on_recovered(
    "multirate.stated-design",
    parameters=DESIGNED,
    bound=UPPER,
    witness={
        "P": Depends(lambda values: sized(sequence, sized(symmetric, values.A.nrows()), _phases(values))),
        "Y": Depends(lambda values: sized(matrices, values.A.nrows(), len(values.plant["C"]), _phases(values))),
    },
    holds=True,
    says=(
        Says(quantity="design by Theorem 2", readings=ANY_A),
        Says(quantity="unstable plant", setting=lambda parameters: {"A": parameters["A"]}, readings=ANY_A),
    ),
)
def design(plant: Plant, A: fmpq_mat, B_d: fmpq_mat, D: fmpq_mat, upper: fmpq, **fields: Any) -> Found:
    """For the plant with A = {shown}, C = {sensors}, B_d = {disturbance} and D = {noise}, of which A has the poles
    stated in Sec. IV-C, one proved to lie outside the unit circle, Theorem 2 gives an observer that predicts one step
    with a gain of at most {upper:up}.
    """
    require_unstable(_stated_poles(plant, A))
    C = matrix(plant["C"], "plant.C")
    system = Sensing(A, B_d, identity(A.nrows()), C, D, schedule(fields["periods"], fields["offsets"]))
    require_theorem_2(system, fields["P"], fields["Y"], upper)
    return Found(words={"shown": _rows(A), "sensors": _rows(C), "disturbance": _rows(B_d), "noise": _rows(D)})


def require_unstable(poles: list[acb]) -> None:
    """Refuse unless one of the poles certainly lies outside the unit circle."""
    require(any(abs(pole) > 1 for pole in poles), "no pole of A is proved to be outside the unit circle")


def _phases(values: Any) -> int:
    return len(schedule(values.periods, values.offsets))


def _diagonal(A: fmpq_mat) -> str:
    return ", ".join(str(A[i, i]) for i in range(A.nrows()))


def _rows(M: fmpq_mat) -> str:
    return f"[{'; '.join(' '.join(str(entry) for entry in row) for row in M.tolist())}]"


def _recovered(plant: Plant, diagonal: list[fmpq]) -> tuple[fmpq_mat, list[acb]]:
    """A with the printed off-diagonal entries and the recovered diagonal, and its poles: refused unless as stated."""
    A = square(plant["A"], "plant.A")
    for i, entry in enumerate(diagonal):
        A[i, i] = entry
    return A, _stated_poles(plant, A)


def _stated_poles(plant: Plant, A: fmpq_mat) -> list[acb]:
    """The poles of A: refused unless they are as stated.

    Of a pair of poles, the one with positive imaginary part stands for both.
    """
    half = positive(plant["half_unit"], "plant.half_unit")
    upper = [root for root in roots(characteristic_polynomial(A)) if not root.imag < 0]
    stated = matrix(plant["poles"], "plant.poles", columns=2).tolist()
    require(len(stated) == len(upper), f"{len(stated)} poles are stated, A has {len(upper)}, counting pairs once")
    matches = []
    for re, im in stated:
        near = [root for root in upper if all(abs(part) <= half for part in (root.real - re, root.imag - im))]
        require(len(near) == 1, f"A has not the stated pole {re} + {im}i")
        matches.extend(near)
        upper = [root for root in upper if root is not near[-1]]
    return matches


def _error_polynomial(plant: Plant, measured: list[list[int]], A: fmpq_mat, C: fmpq_mat) -> fmpq_poly:
    """The characteristic polynomial of A_e with the printed gains."""
    L = matrices(plant["L"], "plant.L", A.nrows(), C.nrows(), len(measured))
    return characteristic_polynomial(monodromy(without_noise(A, C, measured).error_system(L)))  # type: ignore[no-any-return]
