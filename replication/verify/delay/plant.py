"""Linear systems with delayed states in exact numbers, read from a certificate.

x'(t) = A0 x(t) + sum A_i x(t - tau_i) + B w(t),  z(t) = C10 x(t) + sum C1_i x(t - tau_i),  y(t) = C2 x(t).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

from flint import acb, acb_mat, arb, fmpq, fmpq_mat

from replication.verify.algebra.linear import below, block, energy, identity, submatrix, zeros
from replication.verify.algebra.work import PLACE, bits, spend, spend_elimination
from replication.verify.kernel import AtMost, Below, Equal, decide
from replication.verify.reading import fields, matrices, matrix, positive, rational, several, square, text
from replication.verify.statement import statement
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
    decide(Equal(submatrix(sensor, range(q), range(n - q)), zeros(q, n - q), "C2 is not [0 c] after the change"))
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


@dataclass(frozen=True)
class Hidden:
    """A frequency in rad/s, and the state (n, 1) that moves along it."""

    frequency: fmpq
    state: fmpq_mat


def read_hidden(value: Any, path: str, n: int) -> Hidden:
    """{frequency, state} of a plant with n states."""
    frequency, state = fields(value, path, "frequency", "state")
    return Hidden(rational(frequency, f"{path}.frequency"), matrix(state, f"{path}.state", n, 1))


def require_hidden(plant: DelayPlant, gamma: fmpq, hidden: Hidden, lag: Lag = exponential) -> None:
    """Refuse unless a state x with C2 x = 0 has |C(iw) x| >= gamma |B^-1 M(iw) x| at the frequency w of the witness.

    C(s) = C10 + sum C1_i lag(s tau_i), and B must have an inverse.
    """
    n, x = plant.states, hidden.state
    decide(Equal(plant.C2 * x, zeros(plant.C2.nrows(), 1), "witness.state is seen by y: C2 x is not zero"))
    spend_elimination(n, 2 * n, bits(plant.B), "the inverse of B")
    require(plant.B.ncols() == n and plant.B.det() != 0, "B has no inverse, so that no disturbance is known to fit")
    s, state = acb(0, arb(hidden.frequency)), acb_mat(x)
    w = acb_mat(plant.B.inv()) * characteristic(plant, s, lag) * state
    z = (acb_mat(plant.C10) + delayed(plant.late_output, plant, s, lag)) * state
    decide(Below(0, energy(z), "witness.state does not move z at this frequency"))
    unreached = f"the gain at this frequency is not proved to reach {below(gamma)}"
    decide(AtMost(arb(gamma) ** 2 * energy(w), energy(z), unreached))


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
