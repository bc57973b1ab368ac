"""One instant of a periodic observer."""

from __future__ import annotations

from dataclasses import dataclass

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
