"""Disturbances that y does not see: a lower bound of the gain of every observer, at one frequency, in balls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, fmpq, fmpq_mat

from replication.verify.algebra.balls import energy
from replication.verify.algebra.decimals import below
from replication.verify.algebra.linear import identity, submatrix, zeros
from replication.verify.algebra.work import bits, spend_elimination
from replication.verify.delay.plant import DelayPlant
from replication.verify.kernel import AtMost, Below, Equal, decide
from replication.verify.reading import fields, matrix, rational
from replication.verify.theorem import require

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
