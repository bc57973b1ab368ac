"""A delay plant as lines: delay i carries psi_i(0, t) = E_i [x; w] and nothing else.

A line of length tau holds psi(s, t) = psi(0, t + s tau) for -1 <= s <= 0. The plant uses the far end psi(-1, t) and the
Legendre moments mu_c(t), the integrals of p_c(s) psi(s, t) over s:

    [x'; z; y] = now [x; w] + sum_i (end_i psi_i(-1) + sum_c moments_i[c] mu_ic).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.delay.plant import DelayPlant, averages, late, present
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

RANK = 1e-12
"""Singular values below this share of the largest carry nothing."""


@dataclass(frozen=True)
class Line:
    """One delay: what it carries, m signals, and what the plant does with them."""

    delay: float  # tau, s
    carry: Array  # (m, n + r) E = [E_x E_w]
    end: Array  # (n + p + q, m) Effect of psi(-1) on (x', z, y)
    moments: Array  # (c, n + p + q, m) Effect of the moments mu_0 .. mu_{c-1}; c = 0 without averages

    @property
    def width(self) -> int:
        """Number of signals m."""
        return int(self.carry.shape[0])


@dataclass(frozen=True)
class LineForm:
    """A plant as lines; n states, r disturbances, p outputs to estimate, q measurements."""

    states: int  # n
    outputs: int  # p
    now: Array  # (n + p + q, n + r) [[A_0, B], [C_10, D_11], [C_2, D_21]]
    lines: tuple[Line, ...]  # One for each delay that carries something

    @property
    def inputs(self) -> int:
        """Number of disturbances r."""
        return int(self.now.shape[1]) - self.states

    @property
    def measurements(self) -> int:
        """Number of measurements q."""
        return int(self.now.shape[0]) - self.states - self.outputs

    @property
    def width(self) -> int:
        """Signals on all lines."""
        return sum(line.width for line in self.lines)

    @property
    def moments(self) -> int:
        """Legendre moments that the plant uses."""
        return max((len(line.moments) for line in self.lines), default=0)


def line_form(plant: DelayPlant) -> LineForm:
    """The plant as lines; known inputs are left out: the observer copies them."""
    lines = (_line(plant, i) for i in range(plant.delay_count))
    return LineForm(plant.states, plant.outputs, present(plant), tuple(line for line in lines if line.width))


def _line(plant: DelayPlant, i: int) -> Line:
    end, moments = late(plant, i), _legendre(averages(plant, i))
    carry = carried(np.concatenate([end[None], moments]))
    return Line(plant.delays[i], carry, end @ carry.T, moments @ carry.T)


def carried(matrices: Array) -> Array:
    """E (m, n + r) with orthonormal rows that span the rows of all `matrices` (k, rows, n + r).

    Single states and disturbances where these will do: they keep the zeros, and with them the program sparse.
    """
    stacked = matrices.reshape(-1, matrices.shape[-1])
    used = np.flatnonzero(np.any(stacked, axis=0))
    norms = np.linalg.norm(stacked[:, used], axis=0)
    # Columns of equal length: the rank does not hang on the units of the states.
    _, values, right = np.linalg.svd(stacked[:, used] / norms, full_matrices=False)
    rank = int(np.sum(values > RANK * values[0])) if used.size else 0
    if rank == used.size:
        return np.asarray(np.eye(stacked.shape[1])[used])
    rows = np.zeros((rank, stacked.shape[1]))
    rows[:, used] = np.linalg.qr((right[:rank] * norms).T)[0].T
    return rows


def _legendre(weights: Array) -> Array:
    """Legendre coefficients over s in [-1, 0] of sum_k weights[k] (-s)^k; none if all are zero."""
    if not np.any(weights):
        return np.zeros((0, *weights.shape[1:]))
    count = len(weights)
    points, quadrature = legendre.gauss(count + 1)
    powers = (-points[:, None]) ** np.arange(count)
    return np.asarray(np.einsum("t,tc,tk,kij->cij", quadrature, legendre.evaluate(count, points), powers, weights))
