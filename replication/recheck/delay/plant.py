"""Systems with delayed states: x' = A0 x + sum A_i x(t - tau_i) + B w, z = C10 x + sum C1_i x(t - tau_i), y = C2 x."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from replication.recheck.exact import determinant, inverse, times
from replication.recheck.reading import Matrix, matrix, need, positive, several, small, square, take

MOST_STATES = 6


@dataclass(frozen=True)
class Delayed:
    """A system with delays in exact numbers."""

    A0: Matrix
    A: list[Matrix]
    delays: list[Fraction]
    B: Matrix
    C10: Matrix
    C1: list[Matrix]
    C2: Matrix

    @property
    def n(self) -> int:
        """Its number of states."""
        return len(self.A0)

    @property
    def unmeasured(self) -> int:
        """In coordinates where C2 = [0 c]: how many states come first, which y does not see."""
        return self.n - len(self.C2)


def read_plant(plant: Mapping[str, Any]) -> Delayed:
    """The system of a certificate."""
    _, a0, a, delays, b, c10, c1, c2 = take(plant, "plant", "name", "A0", "A", "delays", "B", "C10", "C1", "C2")
    state = square(a0, "A0")
    n, times_ = len(state), several(delays, "delays", positive)
    need(bool(times_), "no delay")
    small(max(n, len(times_)) <= MOST_STATES, f"more than {MOST_STATES} states or delays")
    out = matrix(c10, "C10", None, n)
    return Delayed(
        state,
        several(a, "A", lambda one, at: matrix(one, at, n, n), len(times_)),
        times_,
        matrix(b, "B", n),
        out,
        several(c1, "C1", lambda one, at: matrix(one, at, len(out), n), len(times_)),
        matrix(c2, "C2", None, n),
    )


def changed(plant: Delayed, change: Any) -> Delayed:
    """The system in coordinates (new x) = T x in which y sees the last of them, by an invertible c."""
    back = square(change, "change", plant.n)
    t = inverse(back)
    c2, first = times(plant.C2, t), plant.unmeasured
    need(first >= 0 and not any(any(row[:first]) for row in c2), "y sees more than the last coordinates")
    need(determinant([row[first:] for row in c2]) != 0, "y does not see all of the last coordinates")
    return Delayed(
        times(back, plant.A0, t),
        [times(back, one, t) for one in plant.A],
        plant.delays,
        times(back, plant.B),
        times(plant.C10, t),
        [times(one, t) for one in plant.C1],
        c2,
    )
