"""The small program of a delay plant: storage by a few moments of each line, dissipation as two matrix inequalities.

V = u'Wu + sum_i integral of psi_i'(S_i + (1 + s) T_i) psi_i is positive if W_+ = W + diag(0, I_d (x) S_i), S_i and T_i
are: a function has at least the energy of its moments (Bessel). Along the errors
  dV/dt <= 2 u'W u' + sum_i (1/tau_i) (psi_i(0)'(S_i + T_i) psi_i(0) - psi_i(-1)'S_i psi_i(-1) - sum_c mu_ic'T_i mu_ic)
           - 2 u'Z eps,
and N = g (|w|^2 + |v|^2) - 2 v'z - dV/dt must be positive for all v (Schur complement of |z|^2 / g). Z is free and fills
the whole block of N between u and eps: N can be made positive if and only if it is so for eps = 0 and for u = 0, two
inequalities without Z; any Z between is found afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sparse

from replication.estimation.conic.program import Program
from replication.estimation.delay.general.rates import Rates
from replication.estimation.validation import Array


@dataclass(frozen=True)
class Storage:
    """The matrices of a storage function and the level: W_+ (k, k), S_i and T_i (m_i, m_i)."""

    plus: Array
    s: tuple[Array, ...]
    t: tuple[Array, ...]
    level: float


@dataclass(frozen=True)
class Inequality:
    """constant + level * size + sum over the matrices X of maps[X] vec X, as vec of a symmetric matrix."""

    order: int
    constant: Array
    size: Array
    maps: tuple[sparse.csr_array, ...]

    def at(self, storage: Storage) -> Array:
        """The matrix at a point."""
        parts = [storage.plus, *storage.s, *storage.t]
        value = self.constant + storage.level * self.size
        value = value + sum(m @ part.ravel() for m, part in zip(self.maps, parts, strict=True))
        matrix = value.reshape(self.order, self.order)
        return np.asarray((matrix + matrix.T) / 2.0)


def dissipation(rates: Rates, basis: Array) -> Inequality:
    """N over (c, v) with zeta = basis c and without Z."""
    columns, outputs = basis.shape[1], len(rates.z)
    order = columns + outputs

    def over(rows: Array) -> Array:
        return np.hstack([rows @ basis, np.zeros((len(rows), outputs))])

    z, v, w = over(rates.z), np.eye(order)[columns:], over(rates.w)
    maps = [-2.0 * _product(over(rates.u), over(rates.rate))]
    s_maps, t_maps = [], []
    for line in rates.lines:
        entry, end = over(line.entry), over(line.end)
        moments, slopes = [over(part) for part in line.moments], [over(part) for part in line.slopes]
        inside = sum(_product(a, b) for a, b in zip(moments, slopes, strict=True))
        enters = _product(entry, entry)
        s_maps.append(2.0 * inside + (_product(end, end) - enters) / line.delay)
        t_maps.append((sum(_product(part, part) for part in moments) - enters) / line.delay)
    constant = -(v.T @ z + z.T @ v)
    return Inequality(
        order, constant.ravel(), (v.T @ v + w.T @ w).ravel(), tuple(sparse.csr_array(m) for m in (*maps, *s_maps, *t_maps))
    )


def _product(left: Array, right: Array) -> sparse.csr_array:
    """vec X -> vec (left'X right + right'X left) / 2, for symmetric X."""
    a, b = sparse.csr_array(left.T), sparse.csr_array(right.T)
    return sparse.csr_array((sparse.kron(a, b) + sparse.kron(b, a)) / 2.0)


@dataclass(frozen=True)
class Unknowns:
    """The upper triangles of W_+, S_i and T_i, and the level behind them, as one vector."""

    orders: tuple[int, ...]

    @property
    def count(self) -> int:
        """How many scalars."""
        return sum(k * (k + 1) // 2 for k in self.orders) + 1

    def storage(self, values: Array) -> Storage:
        """The matrices in a vector of unknowns."""
        matrices, start = [], 0
        for k in self.orders:
            stop = start + k * (k + 1) // 2
            matrices.append((_whole(k) @ values[start:stop]).reshape(k, k))
            start = stop
        lines = (len(self.orders) - 1) // 2
        return Storage(matrices[0], tuple(matrices[1 : 1 + lines]), tuple(matrices[1 + lines :]), float(values[-1]))


def unknowns(rates: Rates) -> Unknowns:
    """Those of a plant."""
    widths = tuple(len(line.entry) for line in rates.lines)
    return Unknowns((len(rates.u), *widths, *widths))


def _whole(order: int) -> sparse.csr_array:
    """Upper triangle -> all entries of the symmetric matrix."""
    rows, columns = np.triu_indices(order)
    index, off = np.arange(len(rows)), rows != columns
    place = np.concatenate([rows * order + columns, (columns * order + rows)[off]])
    source = np.concatenate([index, index[off]])
    return sparse.csr_array((np.ones(len(place)), (place, source)), shape=(order**2, len(rows)))


def least_level(names: Unknowns, inequalities: tuple[Inequality, ...], margin: float) -> Program:
    """Minimise the level with W_+, S_i, T_i and all inequalities at least `margin` times the unit matrix."""
    triangles = sparse.block_diag([_whole(k) for k in names.orders])
    blocks = [sparse.hstack([sparse.hstack(part.maps) @ triangles, part.size[:, None]]) for part in inequalities]
    own = sparse.hstack([triangles, sparse.csr_array((triangles.shape[0], 1))])
    slack = sparse.vstack([own, *blocks])
    orders = (*names.orders, *(part.order for part in inequalities))
    constant = np.concatenate([np.zeros(triangles.shape[0]), *(part.constant for part in inequalities)])
    constant = constant - margin * np.concatenate([np.eye(k).ravel() for k in orders])
    cost = np.zeros(names.count)
    cost[-1] = -1.0
    return Program(sparse.csr_array(-slack.T), cost, constant, 0, orders)
