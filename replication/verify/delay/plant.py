"""Linear systems with delayed states in exact numbers, read from a certificate.

x'(t) = A0 x(t) + sum A_i x(t - tau_i) + B w(t),  z(t) = C10 x(t) + sum C1_i x(t - tau_i),  y(t) = C2 x(t).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, submatrix, zeros
from replication.verify.algebra.work import PLACE, bits, spend, spend_elimination
from replication.verify.kernel import Equal, decide
from replication.verify.reading import fields, matrices, matrix, positive, several, square, text
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
