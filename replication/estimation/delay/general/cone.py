"""The small program of a delay plant: storage by a few moments of each line, dissipation as two matrix inequalities.

V = u'Wu + sum_i integral of psi_i'(S_i + (1 + s) T_i) psi_i is positive if W_+ = W + diag(0, I_d (x) S_i), S_i and T_i
are: a function has at least the energy of its moments (Bessel). Along the errors
  dV/dt <= 2 u'W u' + sum_i (1/tau_i) (psi_i(0)'(S_i + T_i) psi_i(0) - psi_i(-1)'S_i psi_i(-1) - sum_c mu_ic'T_i mu_ic)
           - 2 u'Z eps,
and N = g (|w|^2 + |v|^2) - 2 v'(z - L_z eps) - dV/dt must be positive for all v (a Schur complement). Z and L_z are
free and fill the whole block of N between (u, v) and eps: N can be made positive if and only if it is so for eps = 0
and for (u, v) = 0, two inequalities without them; a Z and L_z between these are found afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.conic.interior import Block
from replication.estimation.delay.general.rates import Rates
from replication.estimation.validation import Array


@dataclass(frozen=True)
class Storage:
    """The matrices of a storage function and the level that it proves: W_+ (k, k), S_i and T_i (m_i, m_i)."""

    plus: Array
    s: tuple[Array, ...]
    t: tuple[Array, ...]
    level: float


def storage_of(rates: Rates, w: Array, scalars: Array) -> Storage:
    """W_+, the triangles of S_i and T_i, and the level, as the matrices that they are."""
    matrices = []
    for unit in _line_units(rates):
        matrices.append(np.tensordot(scalars[: len(unit)], unit, axes=1))
        scalars = scalars[len(unit) :]
    lines = len(rates.lines)
    return Storage(w, tuple(matrices[:lines]), tuple(matrices[lines:]), float(scalars[0]))


def scalars_of(storage: Storage) -> Array:
    """The triangles of S_i and T_i, and the level."""
    triangles = [part[np.triu_indices(len(part))] for part in (*storage.s, *storage.t)]
    return np.concatenate([*triangles, [storage.level]])


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
    return [_units(width) for width in (*widths, *widths)]


def _units(order: int) -> Array:
    rows, columns = np.triu_indices(order)
    units = np.zeros((len(rows), order, order))
    units[np.arange(len(rows)), rows, columns] = units[np.arange(len(rows)), columns, rows] = 1.0
    return units
