"""A periodic observer as a recursion: its phases, and what stands for a measurement that is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from replication.estimation.validation import Array


@dataclass(frozen=True, eq=False)
class Phase:
    """One instant of a periodic observer: o+ = transition o + input u + injection y, x^ = readout o.

    Attributes
    ----------
    transition : array (N, N)
        Of the observer's own state o.
    input : array (N, m)
        Effect of the known inputs u.
    injection : array (N, q)
        Effect of the measurements y.
    readout : array (n, N)
        The estimate in the state.
    due : array of bool (q,)
        Which sensors measure.
    """

    transition: Array
    input: Array
    injection: Array
    readout: Array
    due: Array


@dataclass(frozen=True, eq=False)
class Recursion:
    """o+ = transition o + input u + injection y, x^ = readout o, phase after phase.

    Attributes
    ----------
    phases : sequence of Phase
        One for each instant of the period.
    starts : int
        Length of the start; the other entries of o begin at zero.
    expected : sequence of array (q, N), optional
        At each instant, what a missing measurement is replaced by: expected o + direct u; without it the observer waits
        for the next sample.
    direct : array (q, m), optional
        Effect of the known inputs on the measurements; none unless given.
    limits : array (count, q), optional
        At each instant, how far a measurement may be from the expected one, which replaces it if it is farther.
    """

    phases: Sequence[Phase]
    starts: int
    expected: Sequence[Array] | None = None
    direct: Array | None = None
    limits: Array | None = None

    def stacked(self, field: str) -> Array:
        """One field of all phases."""
        return np.stack([getattr(phase, field) for phase in self.phases])

    @property
    def through(self) -> Array | None:
        """`direct`, if any of it is not zero."""
        return self.direct if self.direct is not None and np.any(self.direct) else None
