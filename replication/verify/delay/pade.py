"""LMI (3) of Peet and Gu on the Pade approximation of a system with delays: its least level from both sides.

The Pade approximant [N/N] of exp(-s) is q(-s) / q(s), q(s) = sum (2N-k)! / (k! (N-k)!) s^k.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import factorial
from typing import Any

from flint import acb, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.decimals import above, below
from replication.verify.algebra.linear import block, identity, require_positive_definite, submatrix, take_rows, zeros
from replication.verify.delay.hidden import require_hidden
from replication.verify.delay.plant import DelayPlant, measured_last, read_plant
from replication.verify.reading import fields, integer, matrix, positive, rational, symmetric
from replication.verify.theorem import Theorem, require

LARGEST_ORDER = 50
Section = tuple[fmpq_mat, fmpq_mat, fmpq_mat, fmpq]
"""a, b, c, d of x' = a x + b u, out = c x + d u."""


def denominator(order: int) -> fmpq_poly:
    """q of the approximant of this order."""
    terms = (fmpq(factorial(2 * order - k), factorial(k) * factorial(order - k)) for k in range(order + 1))
    return fmpq_poly(list(terms))


def lag(order: int, argument: acb) -> acb:
    """q(-s) / q(s)."""
    coefficients = denominator(order).coeffs()
    top = sum((acb(c) * (-argument) ** k for k, c in enumerate(coefficients)), acb(0))
    return top / sum((acb(c) * argument**k for k, c in enumerate(coefficients)), acb(0))


def pade_upper(certificate: Mapping[str, Any]) -> Theorem:
    """delay.pade-upper: LMI (3) on the Pade model of the given order is feasible at the bound."""
    order = _order(certificate)
    (upper,) = fields(certificate["bound"], "bound", "upper")
    gamma = positive(upper, "bound.upper")
    change, section_value, storage = fields(certificate["witness"], "witness", "change", "section", "P")
    plant = measured_last(read_plant(certificate["plant"]), change)
    A, B, C = _model(plant, _section(section_value, order))
    size, n, q = A.nrows(), plant.states, plant.C2.nrows()
    P = symmetric(storage, "witness.P", size)
    require_positive_definite(P, "witness.P")
    kept = [*range(n - q), *range(n, size)]
    drift = P * A
    corner = submatrix(drift + drift.transpose(), kept, kept)
    # The sign of w does not matter: -P B of (3) is P B for the disturbance -w.
    drive, output = take_rows(P * B, kept), submatrix(C, range(C.nrows()), kept)
    r, p = B.ncols(), C.nrows()
    inequality = block(
        [
            [corner, drive, output.transpose()],
            [drive.transpose(), identity(r) * -gamma, zeros(r, p)],
            [output, zeros(p, r), identity(p) * -gamma],
        ]
    )
    require_positive_definite(-inequality, f"minus LMI (3) on the kernel of the measurement, level {above(gamma)},")
    return Theorem(
        sentence=f"The plant {certificate['plant']['name']}: LMI (3) on its Pade approximation of order {order} is "
        f"feasible at the level {above(gamma)}.",
        upper=gamma,
    )


def pade_lower(certificate: Mapping[str, Any]) -> Theorem:
    """delay.pade-lower: no observer of the Pade model has a gain below the bound; LMI (3) is infeasible there."""
    order = _order(certificate)
    (lower,) = fields(certificate["bound"], "bound", "lower")
    gamma = positive(lower, "bound.lower")
    plant = read_plant(certificate["plant"])
    frequency = require_hidden(plant, gamma, certificate["witness"], lambda argument: lag(order, argument))
    return Theorem(
        sentence=f"The plant {certificate['plant']['name']}: LMI (3) on its Pade approximation of order {order} is "
        f"infeasible below {below(gamma)}: near {below(frequency, 6)} rad/s a disturbance with y = 0 has that gain.",
        lower=gamma,
    )


def _order(certificate: Mapping[str, Any]) -> int:
    (value,) = fields(certificate["parameters"], "parameters", "order")
    order = integer(value, "parameters.order", 1)
    require(order <= LARGEST_ORDER, f"parameters.order must be at most {LARGEST_ORDER}, got {order}")
    return order


def _section(value: Any, order: int) -> Section:
    """A realisation of the approximant of exp(-s), checked: q is its denominator and q(-s) its numerator."""
    a_value, b_value, c_value, d_value = fields(value, "witness.section", "a", "b", "c", "d")
    a = matrix(a_value, "witness.section.a", order, order)
    b = matrix(b_value, "witness.section.b", order, 1)
    c = matrix(c_value, "witness.section.c", 1, order)
    d = rational(d_value, "witness.section.d")
    q = denominator(order)
    mirrored = fmpq_poly([coefficient * (-1) ** k for k, coefficient in enumerate(q.coeffs())])
    leading = q.coeffs()[-1]
    require(a.charpoly() * leading == q, "the poles of witness.section are not those of the Pade approximant")
    # c (s - a)^-1 b + d = (det(s - a + b c) - det(s - a)) / det(s - a) + d
    numerator = (a - b * c).charpoly() + a.charpoly() * (d - 1)
    require(numerator * leading == mirrored, "the numerator of witness.section is not that of the Pade approximant")
    return a, b, c, d


def _model(plant: DelayPlant, section: Section) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
    """A, B, C of the plant in which every delayed state that has an effect passes through the section; x comes first.

    A section for the delay tau is that for 1 with its time divided by tau.
    """
    a, b, c, d = section
    n, order = plant.states, a.nrows()
    effect = block([[plant.late], [plant.late_output]])
    delayed = [j for j in range(effect.ncols()) if any(effect[i, j] != 0 for i in range(effect.nrows()))]
    size = n + order * len(delayed)
    now = block([[plant.A0], [plant.C10]])
    through: list[list[fmpq_mat]] = []
    columns: list[fmpq_mat] = []
    for k, j in enumerate(delayed):
        rate = 1 / plant.delays[j // n]
        gain = submatrix(effect, range(effect.nrows()), [j])
        unit = submatrix(identity(n), [j % n], range(n))
        now += gain * unit * d
        columns.append(gain * c)
        own = [a * rate if m == k else zeros(order, order) for m in range(len(delayed))]
        through.append([b * unit * rate, *own])
    top = block([[now, *columns]])
    A = block([[take_rows(top, range(n))], *([block([row])] for row in through)])
    return A, block([[plant.B], [zeros(size - n, plant.B.ncols())]]), take_rows(top, range(n, top.nrows()))


STATEMENTS: Mapping[str, Callable[[Mapping[str, Any]], Theorem]] = {
    "delay.pade-upper": pade_upper,
    "delay.pade-lower": pade_lower,
}
