"""How a few moments of each line and the far ends move: the matrices of the small program, over zeta = (u, psi(-1), w).

u = (e; mu_1,0 .. mu_1,d-1; mu_2,0 ..) holds the error and the first d Legendre moments of each line. Its derivative is
linear in zeta, as tau dmu_c/dt = p_c(0) psi(0) - p_c(-1) psi(-1) - (moments of lower order).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.delay.exact.ladder import FilterModel
from replication.estimation.delay.general.lines import LineForm
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

DEPENDENT = 1e-9
"""Singular values of the noise of y below this share of the largest: some combination of measurements has none."""


@dataclass(frozen=True)
class LineRates:
    """Rows over zeta: what enters the line, psi(0) (m, N); its moments (d, m, N) and their rates; its end psi(-1)."""

    delay: float
    entry: Array
    moments: Array
    slopes: Array
    end: Array


@dataclass(frozen=True)
class Rates:
    """Rows over zeta, N in all: u, its rate, z, w; and zeta in terms of (u, eps, rest).

    Attributes
    ----------
    u, rate : arrays (k, N)
        u and du/dt without injection.
    z, y, w : arrays (p, N), (q, N), (r, N)
        Error of z without L_z, innovation, disturbance.
    lines : tuple of LineRates
        Each line.
    change : array (N, N)
        zeta = change (u, eps / unit, rest).
    unit : array (q, q)
        In these units eps has orthonormal rows in (psi(-1), w).
    """

    u: Array
    rate: Array
    z: Array
    y: Array
    w: Array
    lines: tuple[LineRates, ...]
    change: Array
    unit: Array

    def without_innovation(self) -> Array:
        """zeta as a function of (u, rest), where eps = 0."""
        k, q = len(self.u), len(self.unit)
        return np.hstack([self.change[:, :k], self.change[:, k + q :]])

    def without_state(self) -> Array:
        """zeta as a function of (eps, rest), where u = 0."""
        return np.asarray(self.change[:, len(self.u) :])


def rates(form: LineForm, degree: int) -> Rates:
    """The error dynamics on `degree` moments a line.

    Raises InvalidInputError if the averages need more moments, or a combination of measurements is free of noise.
    """
    if degree < form.moments:
        raise InvalidInputError(
            f"degree must be at least {form.moments} for the averages of this plant, got {degree}; raise it, or give "
            "averages with fewer powers of the age"
        )
    n, p, r, order = form.states, form.outputs, form.inputs, form.states + degree * form.width
    size = order + form.width + r
    zeta = np.eye(size)
    now = np.vstack([zeta[:n], zeta[size - r :]])
    flow = form.now @ now
    slope, first, last = (
        legendre.derivative(degree),
        legendre.evaluate(degree, 0.0)[0],
        legendre.evaluate(degree, -1.0)[0],
    )
    lines, start, far = [], n, order
    for line in form.lines:
        m = line.width
        moments = zeta[start : start + degree * m].reshape(degree, m, size)
        entry, end = line.carry @ now, zeta[far : far + m]
        flow = flow + line.end @ end + np.einsum("cij,cjs->is", line.moments, moments[: len(line.moments)])
        slopes = first[:, None, None] * entry - last[:, None, None] * end - np.einsum("ac,ams->cms", slope, moments)
        lines.append(LineRates(line.delay, entry, moments, slopes / line.delay, end))
        start, far = start + degree * m, far + m
    rate = np.vstack([flow[:n], *(line.slopes.reshape(-1, size) for line in lines)])
    change, unit = _pivoted(flow[n + p :], order)
    return Rates(zeta[:order], rate, flow[n : n + p], flow[n + p :], zeta[size - r :], tuple(lines), change, unit)


def moment_plant(form: LineForm, order: int) -> FilterModel:
    """The plant with each line replaced by its first `order` moments (Legendre-tau method); its states are u.

    Raises InvalidInputError as `rates`.
    """
    over = rates(form, order)
    k, size = over.rate.shape
    # The coefficient of p_order makes psi(0) what enters; psi(-1) follows.
    first, last = legendre.evaluate(order + 1, 0.0)[0], legendre.evaluate(order + 1, -1.0)[0]
    ends = [
        np.tensordot(last[:-1], line.moments, axes=1)
        + last[-1] / first[-1] * (line.entry - np.tensordot(first[:-1], line.moments, axes=1))
        for line in over.lines
    ]
    known = np.vstack([over.u, over.w]).T  # zeta of (u, w), the far ends left out
    basis = known.copy()
    basis[k : size - len(over.w)] = np.vstack([np.zeros((0, size)), *ends]) @ known
    rate, z, y = over.rate @ basis, over.z @ basis, over.y @ basis
    return FilterModel(rate[:, :k], rate[:, k:], z[:, :k], z[:, k:], y[:, :k], y[:, k:])


def _pivoted(y: Array, order: int) -> tuple[Array, Array]:
    """zeta in terms of (u, eps, rest), and the unit of eps."""
    noise = y[:, order:]
    rows, size = noise.shape
    left, values, right = np.linalg.svd(noise)
    if rows > size or values[-1] <= DEPENDENT * np.abs(y).max():
        which = int(np.argmax(np.abs(left[:, -1])))
        raise InvalidInputError(
            f"a combination of measurements with y[{which}] is free of noise: [D_21, delayed part of y] has rank "
            f"below {rows}; add noise to row {which} of d21, or drop that measurement"
        )
    seen = left @ right[:rows]  # orthonormal rows
    unit = np.asarray(scipy.linalg.sqrtm(noise @ noise.T).real)
    change = np.eye(y.shape[1])
    change[order:, :order] = -seen.T @ np.linalg.solve(unit, y[:, :order])
    change[order:, order : order + rows] = seen.T
    change[order:, order + rows :] = right[rows:].T
    return change, unit
