"""Linear systems with delayed states in exact numbers, read from a certificate.

x'(t) = A0 x(t) + sum A_i x(t - tau_i) + B w(t),  z(t) = C10 x(t) + sum C1_i x(t - tau_i),  y(t) = C2 x(t).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from flint import fmpq, fmpq_mat

from replication.verify.algebra.linear import block, submatrix, zeros
from replication.verify.reading import fields, matrices, matrix, positive, sequence
from replication.verify.theorem import require


@dataclass(frozen=True, kw_only=True)
class DelayPlant:
    """A0 (n, n); late = [A_1 .. A_K] (n, nK); B (n, r); C10 (p, n); late_output = [C1_1 ..] (p, nK); C2 (q, n)."""

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


def read_plant(value: Mapping[str, Any]) -> DelayPlant:
    """The system in a certificate; refuses shapes that do not fit and delays that do not increase."""
    _, a0, a, delays, b, c10, c1, c2 = fields(value, "plant", "name", "A0", "A", "delays", "B", "C10", "C1", "C2")
    times = sequence(delays, "plant.delays", positive)
    require(bool(times), "plant.delays is empty")
    require(all(early < late for early, late in pairwise(times)), "plant.delays must increase")
    now = matrix(a0, "plant.A0")
    n = now.nrows()
    require(now.ncols() == n, "plant.A0 must be square")
    output = matrix(c10, "plant.C10", columns=n)
    return DelayPlant(
        A0=now,
        late=block([matrices(a, "plant.A", n, n, len(times))]),
        delays=tuple(times),
        B=matrix(b, "plant.B", rows=n),
        C10=output,
        late_output=block([matrices(c1, "plant.C1", output.nrows(), n, len(times))]),
        C2=matrix(c2, "plant.C2", columns=n),
    )


def measured_last(plant: DelayPlant, change: Any) -> DelayPlant:
    """The same system for the state `change` x; refuses unless then C2 = [0 c] with an invertible c."""
    n, q = plant.states, plant.C2.nrows()
    new = matrix(change, "witness.change", n, n)
    require(new.det() != 0, "witness.change has no inverse")
    back = new.inv()
    sensor = plant.C2 * back
    require(q <= n, "C2 has more rows than columns")
    require(submatrix(sensor, range(q), range(n - q)) == zeros(q, n - q), "C2 is not [0 c] after the change")
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
