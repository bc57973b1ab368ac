"""The small program of a delay plant: storage by a few moments of each line, dissipation as two matrix inequalities.

V = u'Wu + sum_i integral of psi_i'(S_i + (1 + s) T_i) psi_i is positive if W_+ = W + diag(0, I_d (x) S_i), S_i and T_i
are: a function has at least the energy of its moments (Bessel). Along the errors
  dV/dt <= 2 u'W u' + sum_i (1/tau_i) (psi_i(0)'(S_i + T_i) psi_i(0) - psi_i(-1)'S_i psi_i(-1) - sum_c mu_ic'T_i mu_ic)
           - 2 u'Z eps,
and N = g (|w|^2 + |v|^2) - 2 v'(z - L_z eps) - dV/dt must be positive for all v (a Schur complement). Z and L_z are
free and fill the whole block of N between (u, v) and eps: N can be made positive if and only if it is so for eps = 0
and for (u, v) = 0, two inequalities without them; a Z and L_z between these are found afterwards.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.conic.interior import Block
from replication.estimation.conic.program import symmetric_basis
from replication.estimation.delay.exact.central import FilterModel, shift
from replication.estimation.delay.exact.terms import Kernel, plant_terms
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

# A delay plant as lines: delay i carries psi_i(0, t) = E_i [x; w] and nothing else.
#
# A line of length tau holds psi(s, t) = psi(0, t + s tau) for -1 <= s <= 0. The plant uses the far end psi(-1, t) and
# the Legendre moments mu_c(t), the integrals of p_c(s) psi(s, t) over s:
#
#     [x'; z; y] = now [x; w] + sum_i (end_i psi_i(-1) + sum_c moments_i[c] mu_ic).

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
    """A plant as lines, one for each delay that carries something; without known inputs, which the observer copies."""

    plant: DelayPlant
    lines: tuple[Line, ...]

    @property
    def width(self) -> int:
        """Signals on all lines."""
        return sum(line.width for line in self.lines)

    @property
    def moments(self) -> int:
        """Legendre moments that the plant uses."""
        return max((len(line.moments) for line in self.lines), default=0)


def line_form(plant: DelayPlant) -> LineForm:
    """The plant as lines."""
    lines = (_line(*line) for line in plant_terms(plant).terms.spread)
    return LineForm(plant, tuple(line for line in lines if line.width))


def _line(delay: float, end: Array, kernel: Kernel | None) -> Line:
    moments = np.zeros((0, *end.shape)) if kernel is None else kernel.series
    carry = carried(np.concatenate([end[None], moments]))
    return Line(delay, carry, end @ carry.T, moments @ carry.T)


def carried(matrices: Array) -> Array:
    """E (m, n + r) with orthonormal rows that span those of all `matrices`; single signals where these do: sparse."""
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


# How a few moments of each line and the far ends move: the matrices of the small program, over zeta = (u, psi(-1), w).
#
# u = (e; mu_1,0 .. mu_1,d-1; mu_2,0 ..) holds the error and the first d Legendre moments of each line. Its derivative
# is linear in zeta, as tau dmu_c/dt = p_c(0) psi(0) - p_c(-1) psi(-1) - (moments of lower order).


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
    """Rows over zeta, N in all: u, its rate, z, w; and zeta in terms of (u, eps, rest)."""

    u: Array  # (k, N) u and du/dt without injection
    rate: Array  # (k, N) u and du/dt without injection
    z: Array  # (p, N) Error of z without L_z, innovation, disturbance
    y: Array  # (q, N) Error of z without L_z, innovation, disturbance
    w: Array  # (r, N) Error of z without L_z, innovation, disturbance
    lines: tuple[LineRates, ...]  # Each line

    @cached_property
    def innovation(self) -> tuple[Array, Array]:
        """(N, N) change and (q, q) unit: zeta = change (u, eps / unit, rest), eps / unit of orthonormal rows."""
        order = len(self.u)
        noise = self.y[:, order:]
        rows, size = noise.shape
        left, values, right = np.linalg.svd(noise)
        if rows > size or values[-1] <= DEPENDENT * np.abs(self.y).max():
            which = int(np.argmax(np.abs(left[:, -1])))
            raise InvalidInputError(
                f"a combination of measurements with y[{which}] is free of noise: [D_21, delayed part of y] has rank "
                f"below {rows}; add noise to row {which} of d21, or drop that measurement"
            )
        basis = left @ right[:rows]  # orthonormal rows
        unit = np.asarray(scipy.linalg.sqrtm(noise @ noise.T).real)
        change = np.eye(self.y.shape[1])
        change[order:, :order] = -basis.T @ np.linalg.solve(unit, self.y[:, :order])
        change[order:, order : order + rows] = basis.T
        change[order:, order + rows :] = right[rows:].T
        return change, unit


def rates(form: LineForm, degree: int) -> Rates:
    """The error dynamics on `degree` moments a line; raises InvalidInputError if the averages need more moments."""
    if degree < form.moments:
        raise InvalidInputError(
            f"degree must be at least {form.moments} for the averages of this plant, got {degree}; raise it, or give "
            "averages with fewer powers of the age"
        )
    (n, p, _, r), present = plant_terms(form.plant).sizes, plant_terms(form.plant).terms.constant
    order = n + degree * form.width
    size = order + form.width + r
    zeta = np.eye(size)
    now = np.vstack([zeta[:n], zeta[size - r :]])
    flow = present @ now
    slope, (first, last) = legendre.derivative(degree), legendre.ends(degree)
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
    return Rates(zeta[:order], rate, flow[n : n + p], flow[n + p :], zeta[size - r :], tuple(lines))


def moment_plant(form: LineForm, order: int) -> FilterModel:
    """The plant with each line replaced by its first `order` moments (Legendre-tau method); its states are u.

    From end to end of a line that is Pade's approximant [order/order] of its delay, and lossless. Raises
    InvalidInputError as `rates`.
    """
    over = rates(form, order)
    k, size = over.rate.shape
    _, _, reading, direct = shift(order)
    ends = [np.tensordot(reading, line.moments, axes=1) + direct * line.entry for line in over.lines]
    known = np.vstack([over.u, over.w]).T  # zeta of (u, w), the far ends left out
    basis = known.copy()
    basis[k : size - len(over.w)] = np.vstack([np.zeros((0, size)), *ends]) @ known
    rate, z, y = over.rate @ basis, over.z @ basis, over.y @ basis
    return FilterModel(rate[:, :k], rate[:, k:], z[:, :k], z[:, k:], y[:, :k], y[:, k:])


@dataclass(frozen=True)
class Storage:
    """A storage function and the level that it proves: W_+ (k, k); the triangles of all S_i and T_i, and the level."""

    plus: Array
    scalars: Array


def line_matrices(rates: Rates, storage: Storage) -> tuple[list[Array], list[Array]]:
    """S_i and T_i (m_i, m_i) of each line."""
    units, lines = _line_units(rates), len(rates.lines)
    parts = np.split(storage.scalars, np.cumsum([len(unit) for unit in units], dtype=int))
    matrices = [np.tensordot(part, unit, axes=1) for part, unit in zip(parts, units, strict=False)]
    return matrices[:lines], matrices[lines:]


def positivity(rates: Rates) -> tuple[Block, ...]:
    """W_+, S_i and T_i."""
    units = _line_units(rates)
    count = sum(len(unit) for unit in units) + 1
    order = len(rates.u)
    blocks = [Block(np.zeros((order, order)), np.zeros((count, order, order)), np.eye(order) / 2.0, np.eye(order))]
    start = 0
    for unit in units:
        others = np.zeros((count, *unit.shape[1:]))
        others[start : start + len(unit)] = unit
        blocks.append(Block(np.zeros(unit.shape[1:]), others))
        start += len(unit)
    return tuple(blocks)


def dissipation(rates: Rates, basis: Array, *, outputs: int) -> Block:
    """N over (c, v) with zeta = basis c, without Z and L_z; outputs: p, or 0 for v = 0."""
    columns = basis.shape[1]

    def over(rows: Array) -> Array:
        return np.concatenate([rows @ basis, np.zeros((*rows.shape[:-1], outputs))], axis=-1)

    z, v, w = over(rates.z[:outputs]), np.eye(columns + outputs)[columns:], over(rates.w)
    s_terms, t_terms = [], []
    for line, unit in zip(rates.lines, _line_units(rates), strict=False):
        entry, end, moments, slopes = over(line.entry), over(line.end), over(line.moments), over(line.slopes)
        enters, leaves = _forms(unit, entry, entry), _forms(unit, end, end)
        inside = sum(_forms(unit, a, b) for a, b in zip(moments, slopes, strict=True))
        spread = sum(_forms(unit, a, a) for a in moments)
        s_terms.append(2.0 * inside + (leaves - enters) / line.delay)
        t_terms.append((spread - enters) / line.delay)
    others = np.concatenate([*s_terms, *t_terms, (v.T @ v + w.T @ w)[None]])
    constant = -(v.T @ z + z.T @ v)
    u = over(rates.u)
    return Block(constant, others, u, -over(rates.rate)) if np.any(u) else Block(constant, others)


def _forms(units: Array, left: Array, right: Array) -> Array:
    """(left'X right + right'X left) / 2 for each X of `units`."""
    half = left.T @ units @ right
    return np.asarray((half + np.swapaxes(half, 1, 2)) / 2.0)


def _line_units(rates: Rates) -> list[Array]:
    """The symmetric unit matrices of each S_i, then of each T_i."""
    widths = [len(line.entry) for line in rates.lines]
    return [symmetric_basis(width) for width in (*widths, *widths)]


NODES = 160
"""Gauss points on a line: the kernels are polynomials over S + (1 + s) T."""
NEGLIGIBLE = 1e-11
"""Legendre coefficients of a kernel below this share of its largest are left out."""


def multiplier(rates: Rates, storage: Storage) -> tuple[Array, Array]:
    """Z (k, q) and L_z (p, q), which make N positive: the completion of largest determinant."""
    change, unit = rates.innovation
    k, q, p = len(rates.u), len(unit), len(rates.z)
    whole = dissipation(rates, change, outputs=p).at(storage.plus, storage.scalars)
    free = np.r_[0:k, len(whole) - p : len(whole)]
    eps, rest = np.arange(k, k + q), np.arange(k + q, len(whole) - p)
    target = whole[np.ix_(free, rest)] @ np.linalg.solve(whole[np.ix_(rest, rest)], whole[np.ix_(rest, eps)])
    injected = np.linalg.solve(unit, (target - whole[np.ix_(free, eps)]).T).T
    return injected[:k], injected[k:]


def injection(form: LineForm, rates: Rates, storage: Storage) -> tuple[Array, Array, tuple[Array, ...]]:
    """L_0, L_z and, for each line, the Legendre coefficients of L_i.

    The derivative of V along an injection L eps is 2 u'Z eps if, with m = (L_0, moments of L_i),
    (S_i + (1 + s) T_i) L_i = sum_c p_c (Z - W m)_ic; then (W_+ + diag(0, K_i^-1 - S_i)) m = Z, K_i the moments of
    (S_i + (1 + s) T_i)^-1.
    """
    (z, lz), n = multiplier(rates, storage), form.plant.states
    degree = len(rates.lines[0].moments) if rates.lines else 1
    points, weights = legendre.gauss(NODES)
    basis = legendre.evaluate(degree, points)
    whole, inverses, start = storage.plus.copy(), [], n
    for s, t in zip(*line_matrices(rates, storage), strict=True):
        values = np.linalg.inv(s + (1.0 + points)[:, None, None] * t)
        size = degree * len(s)
        moments = np.einsum("x,xc,xij,xd->cidj", weights, basis, values, basis, optimize=True).reshape(size, size)
        part = slice(start, start + size)
        whole[part, part] += np.linalg.inv(moments) - np.kron(np.eye(degree), s)
        inverses.append((part, values, moments))
        start += size
    m = scipy.linalg.solve((whole + whole.T) / 2.0, z, assume_a="pos")
    kernels = []
    for part, values, moments in inverses:
        inner = np.linalg.solve(moments, m[part]).reshape(degree, -1, z.shape[1])
        kernel = np.einsum("xij,xc,cjq->xiq", values, basis, inner, optimize=True)
        kernels.append(_polynomial(kernel, points, weights))
    return m[:n], lz, tuple(kernels)


def _polynomial(values: Array, points: Array, weights: Array) -> Array:
    """Legendre coefficients (c, m, q) of a function given at the Gauss points."""
    tests = legendre.evaluate(len(points) // 2, points)
    coefficients = np.einsum("x,xc,xiq->ciq", weights, tests, values)
    sizes = np.abs(coefficients).max(axis=(1, 2))
    places = np.flatnonzero(sizes > NEGLIGIBLE * sizes.max(initial=0.0))
    return np.asarray(coefficients[: places[-1] + 1 if places.size else 1])
