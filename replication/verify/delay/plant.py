"""Linear systems with delayed states in exact numbers, what their sensors do not see, and their Pade approximations.

x'(t) = A0 x(t) + sum A_i x(t - tau_i) + B w(t),  z(t) = C10 x(t) + sum C1_i x(t - tau_i),  y(t) = C2 x(t).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import factorial
from typing import Any

from flint import acb, acb_mat, acb_poly, arb, fmpq, fmpq_mat, fmpq_poly

from replication.verify.algebra.linear import (
    above,
    below,
    block,
    characteristic_polynomial,
    energy,
    identity,
    submatrix,
    take_rows,
    zeros,
)
from replication.verify.algebra.work import PLACE, bits, spend, spend_elimination
from replication.verify.kernel import at_most, decide, definite, equal, less
from replication.verify.predicate import Says
from replication.verify.reading import (
    fields,
    integer,
    matrices,
    matrix,
    positive,
    rational,
    record,
    several,
    sized,
    square,
    symmetric,
    text,
)
from replication.verify.statement import LOWER, UPPER, Depends, Table, statement
from replication.verify.theorem import require


@dataclass(frozen=True, kw_only=True)
class DelayPlant:
    """A0 (n, n); late = [A_1 .. A_K] (n, nK); B (n, r); C10 (p, n); late_output = [C1_1 ..] (p, nK); C2 (q, n)."""

    name: str
    A0: fmpq_mat
    late: fmpq_mat
    delays: tuple[fmpq, ...]
    B: fmpq_mat
    C10: fmpq_mat
    late_output: fmpq_mat
    C2: fmpq_mat

    @property
    def states(self) -> int:
        """Number of states n."""
        return int(self.A0.nrows())

    @property
    def points(self) -> int:
        """Length of (w, v, e, l): disturbance, output, error, and the late errors of all delays."""
        return int(self.B.ncols() + self.C10.nrows() + self.states + self.late.ncols())


def read_plant(value: Any, path: str = "plant") -> DelayPlant:
    """The system in a certificate; refuses shapes that do not fit and delays that do not increase."""
    names = ("name", "A0", "A", "delays", "B", "C10", "C1", "C2")
    name, a0, a, delays, b, c10, c1, c2 = fields(value, path, *names)
    times = several(delays, f"{path}.delays", positive)
    require(all(early < late for early, late in pairwise(times)), f"{path}.delays must increase")
    now = square(a0, f"{path}.A0")
    n = now.nrows()
    output = matrix(c10, f"{path}.C10", columns=n)
    return DelayPlant(
        name=text(name, f"{path}.name"),
        A0=now,
        late=block([matrices(a, f"{path}.A", n, n, len(times))]),
        delays=tuple(times),
        B=matrix(b, f"{path}.B", rows=n),
        C10=output,
        late_output=block([matrices(c1, f"{path}.C1", output.nrows(), n, len(times))]),
        C2=matrix(c2, f"{path}.C2", columns=n),
    )


on_plant = partial(statement, source="peet2019", plant=read_plant)
"""A statement on such a plant; the name of the plant stands in sentences on the plants of the paper only."""


def measured_last(plant: DelayPlant, new: fmpq_mat) -> DelayPlant:
    """The same system for the state `new` x; refuses unless then C2 = [0 c] with an invertible c."""
    n, q = plant.states, plant.C2.nrows()
    # Matrices of this size with a block for every two delays, here and in what follows.
    spend(plant.late.ncols() ** 2 * PLACE, f"a plant with {len(plant.delays)} delays")
    spend_elimination(n, 2 * n, bits(new), "the change of coordinates")
    require(new.det() != 0, "witness.change has no inverse")
    back = new.inv()
    sensor = plant.C2 * back
    require(q <= n, "C2 has more rows than columns")
    decide(equal(submatrix(sensor, range(q), range(n - q)), zeros(q, n - q), "C2 is not [0 c] after the change"))
    require(submatrix(sensor, range(q), range(n - q, n)).det() != 0, "c in C2 = [0 c] has no inverse")
    count = len(plant.delays)
    return replace(
        plant,
        A0=new * plant.A0 * back,
        late=new * plant.late * repeated(back, count),
        B=new * plant.B,
        C10=plant.C10 * back,
        late_output=plant.late_output * repeated(back, count),
        C2=sensor,
    )


def repeated(M: fmpq_mat, count: int) -> fmpq_mat:
    """diag(M, .., M) with `count` blocks."""
    empty = zeros(M.nrows(), M.ncols())
    return block([[M if i == j else empty for j in range(count)] for i in range(count)])


# Disturbances that y does not see: a lower bound of the gain of every observer, at one frequency, in balls.


Lag = Callable[[acb], acb]
"""The transfer function of a delay tau, as a function of s tau."""


def exponential(argument: acb) -> acb:
    """The delay itself."""
    return (-argument).exp()


def hidden(values: Any) -> Table:
    """The readers of a frequency in rad/s, and of the state (n, 1) that moves along it."""
    return {"frequency": rational, "state": sized(matrix, values.plant.states, 1)}


def require_hidden(plant: DelayPlant, gamma: fmpq, frequency: fmpq, state: fmpq_mat, lag: Lag = exponential) -> None:
    """Refuse unless a state x with C2 x = 0 has |C(iw) x| >= gamma |B^-1 M(iw) x| at the frequency w of the witness.

    C(s) = C10 + sum C1_i lag(s tau_i), and B must have an inverse.
    """
    n = plant.states
    decide(equal(plant.C2 * state, zeros(plant.C2.nrows(), 1), "witness.state is seen by y: C2 x is not zero"))
    spend_elimination(n, 2 * n, bits(plant.B), "the inverse of B")
    require(plant.B.ncols() == n and plant.B.det() != 0, "B has no inverse, so that no disturbance is known to fit")
    s, x = acb(0, arb(frequency)), acb_mat(state)
    w = acb_mat(plant.B.inv()) * characteristic(plant, s, lag) * x
    z = (acb_mat(plant.C10) + delayed(plant.late_output, plant, s, lag)) * x
    decide(less(0, energy(z), "witness.state does not move z at this frequency"))
    unreached = f"the gain at this frequency is not proved to reach {below(gamma)}"
    decide(at_most(arb(gamma) ** 2 * energy(w), energy(z), unreached))


def characteristic(plant: DelayPlant, s: acb, lag: Lag = exponential) -> acb_mat:
    """M(s) = s I - A0 - sum A_i lag(s tau_i)."""
    return acb_mat(identity(plant.states)) * s - acb_mat(plant.A0) - delayed(plant.late, plant, s, lag)


def delayed(late: fmpq_mat, plant: DelayPlant, s: acb, lag: Lag) -> acb_mat:
    """The sum of late_i lag(s tau_i) over the delays, late = [late_1 ..]."""
    n, rows = plant.states, range(late.nrows())
    result = acb_mat(late.nrows(), n)
    for i, delay in enumerate(plant.delays):
        result += acb_mat(submatrix(late, rows, range(i * n, (i + 1) * n))) * lag(s * acb(delay))
    return result


# LMI (3) of Peet and Gu on the Pade approximation: its least level from both sides.
#
# The Pade approximant [N/N] of exp(-s) is q(-s) / q(s), q(s) = sum (2N-k)! / (k! (N-k)!) s^k.


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
    decide(definite(P, "witness.P"))
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
    decide(definite(-inequality, f"minus LMI (3) on the kernel of the measurement, level {above(upper)},"))


@on_plant(
    "delay.pade-lower",
    parameters={"order": ORDER},
    bound=LOWER,
    witness=Depends(hidden),
    says=LEAST,
)
def pade_lower(plant: DelayPlant, order: int, lower: fmpq, frequency: fmpq, state: fmpq_mat) -> None:
    """The plant< {plant.name}|>: <LMI (3)|the bounded real LMI of an observer> on its Pade approximation of order
    {order} is infeasible below {lower:down}: near {frequency:down 6} rad/s a disturbance with y = 0 has that
    gain.
    """
    require_hidden(plant, lower, frequency, state, lambda argument: lag(order, argument))


def read_section(value: Any, path: str, order: int) -> Section:
    """A realisation of the approximant of exp(-s), checked: q is its denominator and q(-s) its numerator."""
    column, row = sized(matrix, order, 1), sized(matrix, 1, order)
    a, b, c, d = record(value, path, {"a": sized(matrix, order, order), "b": column, "c": row, "d": rational}).values()
    q = denominator(order)
    mirrored = fmpq_poly([coefficient * (-1) ** k for k, coefficient in enumerate(q.coeffs())])
    leading = q.coeffs()[-1]
    decide(
        equal(characteristic_polynomial(a) * leading, q, f"the poles of {path} are not those of the Pade approximant")
    )
    # c (s - a)^-1 b + d = (det(s - a + b c) - det(s - a)) / det(s - a) + d
    numerator = characteristic_polynomial(a - b * c) + characteristic_polynomial(a) * (d - 1)
    decide(equal(numerator * leading, mirrored, f"the numerator of {path} is not that of the Pade approximant"))
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
