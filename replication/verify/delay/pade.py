"""LMI (3) of Peet and Gu on the Pade approximation of a system with delays: its least level from both sides.

The Pade approximant [N/N] of exp(-s) is q(-s) / q(s), q(s) = sum (2N-k)! / (k! (N-k)!) s^k.
"""

from math import factorial
from typing import Any

from flint import acb, acb_poly, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import (
    above,
    block,
    characteristic_polynomial,
    identity,
    submatrix,
    take_rows,
    zeros,
)
from replication.verify.algebra.work import PLACE, spend
from replication.verify.delay.plant import DelayPlant, Hidden, measured_last, on_plant, read_hidden, require_hidden
from replication.verify.kernel import Equal, Positive, decide
from replication.verify.predicate import Says
from replication.verify.reading import integer, matrix, rational, record, sized, symmetric
from replication.verify.statement import LOWER, UPPER, Depends
from replication.verify.theorem import require

ORDER = sized(integer, 1, 50)
LEAST = Says(quantity="least level of LMI (3)", readings=("pade-square",))
Section = tuple[fmpq_mat, fmpq_mat, fmpq_mat, fmpq]
"""a, b, c, d of x' = a x + b u, out = c x + d u."""


def denominator(order: int) -> fmpq_poly:
    """q of the approximant of this order."""
    terms = (fmpq(factorial(2 * order - k), factorial(k) * factorial(order - k)) for k in range(order + 1))
    return fmpq_poly(list(terms))


def lag(order: int, argument: acb) -> acb:
    """q(-s) / q(s)."""
    q = acb_poly(denominator(order).coeffs())
    return q(-argument) / q(argument)


@on_plant(
    "delay.pade-upper",
    parameters={"order": ORDER},
    bound=UPPER,
    witness={
        "change": Depends(lambda values: sized(matrix, values.plant.states, values.plant.states)),
        "section": Depends(lambda values: sized(read_section, values.order)),
        "P": symmetric,
    },
    says=LEAST,
)
def pade_upper(plant: DelayPlant, order: int, upper: fmpq, change: fmpq_mat, section: Section, P: fmpq_mat) -> None:
    """The plant< {plant.name}|>: <LMI (3)|the bounded real LMI of an observer> on its Pade approximation of order
    {order} is feasible at the level {upper:up}.
    """
    plant = measured_last(plant, change)
    A, B, C = model(plant, section)
    size, n, q = A.nrows(), plant.states, plant.C2.nrows()
    require(P.nrows() == size, f"witness.P must have {size} rows, got {P.nrows()}")
    decide(Positive(P, "witness.P"))
    indices = [*range(n - q), *range(n, size)]
    drift = P * A
    corner = submatrix(drift + drift.transpose(), indices, indices)
    # The sign of w does not matter: -P B of (3) is P B for the disturbance -w.
    drive, output = take_rows(P * B, indices), submatrix(C, range(C.nrows()), indices)
    r, p = B.ncols(), C.nrows()
    inequality = block(
        [
            [corner, drive, output.transpose()],
            [drive.transpose(), identity(r) * -upper, zeros(r, p)],
            [output, zeros(p, r), identity(p) * -upper],
        ]
    )
    decide(Positive(-inequality, f"minus LMI (3) on the kernel of the measurement, level {above(upper)},"))


@on_plant(
    "delay.pade-lower",
    parameters={"order": ORDER},
    bound=LOWER,
    witness=Depends(lambda values: sized(read_hidden, values.plant.states)),
    says=LEAST,
)
def pade_lower(plant: DelayPlant, order: int, lower: fmpq, witness: Hidden) -> None:
    """The plant< {plant.name}|>: <LMI (3)|the bounded real LMI of an observer> on its Pade approximation of order
    {order} is infeasible below {lower:down}: near {witness.frequency:down 6} rad/s a disturbance with y = 0 has that
    gain.
    """
    require_hidden(plant, lower, witness, lambda argument: lag(order, argument))


def read_section(value: Any, path: str, order: int) -> Section:
    """A realisation of the approximant of exp(-s), checked: q is its denominator and q(-s) its numerator."""
    column, row = sized(matrix, order, 1), sized(matrix, 1, order)
    a, b, c, d = record(value, path, {"a": sized(matrix, order, order), "b": column, "c": row, "d": rational}).values()
    q = denominator(order)
    mirrored = fmpq_poly([coefficient * (-1) ** k for k, coefficient in enumerate(q.coeffs())])
    leading = q.coeffs()[-1]
    decide(
        Equal(characteristic_polynomial(a) * leading, q, f"the poles of {path} are not those of the Pade approximant")
    )
    # c (s - a)^-1 b + d = (det(s - a + b c) - det(s - a)) / det(s - a) + d
    numerator = characteristic_polynomial(a - b * c) + characteristic_polynomial(a) * (d - 1)
    decide(Equal(numerator * leading, mirrored, f"the numerator of {path} is not that of the Pade approximant"))
    return a, b, c, d


def model(plant: DelayPlant, section: Section) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
    """A, B, C of the plant in which every delayed state that has an effect passes through the section; x comes first.

    A section for the delay tau is that for 1 with its time divided by tau.
    """
    a, b, c, d = section
    n, order = plant.states, a.nrows()
    effect = block([[plant.late], [plant.late_output]])
    delayed = [j for j in range(effect.ncols()) if any(effect[i, j] != 0 for i in range(effect.nrows()))]
    size = n + order * len(delayed)
    spend(size**2 * PLACE, f"{len(delayed)} delayed states by approximants of order {order}")
    now = block([[plant.A0], [plant.C10]])
    through: list[list[fmpq_mat]] = []
    columns: list[fmpq_mat] = []
    for k, j in enumerate(delayed):
        rate = 1 / plant.delays[j // n]
        gain = submatrix(effect, range(effect.nrows()), [j])
        unit = submatrix(identity(n), [j % n], range(n))
        now += gain * unit * d
        columns.append(gain * c)
        blocks = [a * rate if m == k else zeros(order, order) for m in range(len(delayed))]
        through.append([b * unit * rate, *blocks])
    top = block([[now, *columns]])
    A = block([[take_rows(top, range(n))], *([block([row])] for row in through)])
    return A, block([[plant.B], [zeros(size - n, plant.B.ncols())]]), take_rows(top, range(n, top.nrows()))
