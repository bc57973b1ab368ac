"""Exact time response of a dual-rate loop from a given start, between the samples too, in the lifted form.

The slow instants obey z(n+1) = Φ z(n) + Im(Γ e^{sMTn}); everything inside a slow period is a fixed linear map of its
start, so all periods are filled in at once. Works for unstable loops.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from replication.estimation.dualrate.loop import DualRateLoop, monodromy
from replication.estimation.dualrate.problem import row_of_output
from replication.estimation.dualrate.tracking import command, output_rows, period_response
from replication.estimation.validation import Array, finite_vector, positive_integer


@dataclass(frozen=True, eq=False)
class Response:
    """time (N,) in s, output and reference (N,) on the fine grid; instants (Nf,) in s, state and estimate (Nf, n),
    input (Nf, m) at the fast instants, where the estimate and the input are formed."""

    time: Array
    output: Array
    reference: Array
    instants: Array
    state: Array
    estimate: Array
    input: Array

    @property
    def error(self) -> Array:
        """y − y_d on the fine grid."""
        return self.output - self.reference


def time_response(
    loop: DualRateLoop, start: Any, estimate: Any, *, slow_periods: int, substeps: int, output: int = 0
) -> Response:
    """Response from x(0) = start, ζ(0) = estimate to the reference of the loop, `substeps` points per fast period.

    A loop without a reference is left to itself, and the reference of its response is zero. output: which output of
    the plant, from 0. Raises InvalidInputError if there is no such output, a start has the wrong length or is not
    finite, or a count is not a positive integer.
    """
    harmonic, design, n = command(loop), loop.design, loop.plant.order
    positive_integer("number of slow periods", slow_periods)
    rows = output_rows(loop, substeps, row_of_output(loop.plant, output))
    starts = slow_states(loop, start_state(loop, start, estimate)[None, :], slow_periods)[:, 0]
    fast = design.period * np.arange(slow_periods * design.ratio, dtype=float).reshape(slow_periods, design.ratio)
    phasor = np.exp(harmonic.exponent * fast)
    states, estimates, inputs = [], [], []
    z = starts
    for phase, step in enumerate(loop.steps):
        w = phasor[:, phase, None]
        r = np.imag(w * harmonic.amplitude) * (not harmonic.continuous)
        states.append(z[:, :n])
        estimates.append(z @ step.estimate_state.T)
        inputs.append(z @ step.input_state.T + r @ step.input_command.T)
        z = z @ step.state.T + r @ step.command.T + np.imag(w * step.forcing)
    x, xhat, u = (np.stack(part, axis=1) for part in (states, estimates, inputs))
    outputs = x @ rows.state.T + u @ rows.input.T + np.imag(phasor[..., None] * rows.forcing)
    time = fast[..., None] + rows.offsets
    return Response(
        time=time.ravel(),
        output=outputs.ravel(),
        reference=np.sin(harmonic.frequency * time).ravel(),
        instants=fast.ravel(),
        state=x.reshape(-1, n),
        estimate=xhat.reshape(fast.size, -1),
        input=u.reshape(fast.size, -1),
    )


def start_state(loop: DualRateLoop, start: Any, estimate: Any) -> Array:
    """z(0) of the loop from x(0) and ζ(0), of the orders of the plant and of the model; raises InvalidInputError."""
    n, order = loop.plant.order, loop.design.model.order
    z = np.zeros(loop.size)
    has_observer = loop.size > n + loop.plant.B_u.shape[1]
    z[:n] = finite_vector("x(0)", start, n)
    zeta = finite_vector("ζ(0)", estimate, order)
    if has_observer:
        z[n : n + order] = zeta
    return z


def slow_states(loop: DualRateLoop, starts: Array, periods: int) -> Array:
    """Loop states at the slow instants 0 … periods−1 from each row of starts; shape (periods, rows, nz)."""
    harmonic, transition = command(loop), monodromy(loop)
    gain = period_response(loop, np.zeros(loop.size, complex)).states[-1]
    turn = harmonic.exponent * loop.design.slow_period
    states = np.empty((periods, *starts.shape))
    states[0] = starts
    for k in range(1, periods):
        states[k] = states[k - 1] @ transition.T + np.imag(gain * np.exp(turn * (k - 1)))
    return states
