"""The gain matrix of a delay equation, and bounds of it over cells of frequencies and delays.

X xi = [0; w] with X = diag(s I, I) + L(s), rows of states first, then algebraic ones; L depends on the s tau_i.
A cell is |w - w_c| <= r, |tau_i - t_i| <= d_i. On it |X - X_c| <= D, entry by entry, where line i contributes at most
(r tau_i + w d_i) times its size; and

    |X^-1| <= (I - |X_c^-1| D)^-1 |X_c^-1|    where |X_c^-1| D has a spectral radius below one,

which shows that X is invertible and bounds the second-order remainder of the gain matrix. No unit of any variable
matters.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from replication.estimation.delay.exact.kernel import Complex
from replication.estimation.delay.exact.terms import Terms, axis
from replication.estimation.validation import Array

Block = TypeVar("Block", Array, Complex)
Chosen = npt.NDArray[np.bool_]
ROOM = 0.9
"""Spectral radius up to which a cell counts as one on which X is invertible."""


class Cells(NamedTuple):
    """Cells: centre (M,) and half width (M,) in frequency, centres (M, K) and half widths (M, K) of the delays."""

    omega: Array
    half: Array
    delays: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Response:
    """The gain matrix from w to z.

    Attributes
    ----------
    loop : Terms
        L(s); rows and columns: states, other signals, z, w.
    sizes : tuple of int
        Number of states, of z and of w.
    direct : Terms
        What z is of w at frequencies beyond all dynamics; no kernels.
    ranges : tuple of pairs of floats
        Shortest and longest delay of each line of `loop`, s.
    """

    loop: Terms
    sizes: tuple[int, int, int]
    direct: Terms
    ranges: tuple[tuple[float, float], ...]

    def cells(self, edges: Array, *, nominal: bool = False) -> Cells:
        """Cells between sorted edges of the frequency, over the whole ranges of the delays or at the nominal ones."""
        edges = np.unique(edges)
        omega, half = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0
        ends = np.array([(t, t) for t in self.loop.delays] if nominal else self.ranges).reshape(-1, 2)
        shape = (len(omega), 1)
        return Cells(omega, half, np.tile(ends.mean(axis=1), shape), np.tile(np.diff(ends)[:, 0] / 2.0, shape))

    def matrix(self, s: Complex, delays: Array | None = None) -> Complex:
        """X at each s (M,), for the nominal delays or those of (M, K)."""
        n, size = self.sizes[0], len(self.loop.constant)
        value = self.loop.at(s, delays)
        value[:, range(n), range(n)] += s[:, None]
        value[:, range(n, size), range(n, size)] += 1.0
        return value

    def part(self, inverse: Block) -> Block:
        """The part of X^-1 from w to z."""
        _, p, r = self.sizes
        return inverse[..., -p - r : -r, -r:]

    def gains(self, omega: Array, delays: Array | None = None) -> Array:
        """The largest singular value at each frequency."""
        return norms(self.part(np.linalg.inv(self.matrix(axis(omega), delays))))

    def beyond(self, omega: float) -> float:
        """A bound of the gain at all frequencies from `omega` on, for all delays of the ranges.

        Infinite if X may be singular for |s| >= omega, Re s >= 0.
        """
        near, far = self._small(omega), self._small(np.inf)
        if not radii(near) < 1.0:
            return float(np.inf)
        eye = np.eye(len(near))
        rest = self.part(np.linalg.inv(eye - near) - np.linalg.inv(eye - far))
        parts = (self.direct.constant, *self.direct.delayed)
        return float(sum(np.linalg.norm(part, 2) for part in parts) + np.linalg.norm(rest, 2))

    def _small(self, omega: float) -> Array:
        """Bounds of |diag(s I, I)^-1 L(s)| for all |s| >= omega with Re s >= 0."""
        n = self.sizes[0]
        variation = self.loop.variation([least for least, _ in self.ranges])
        signals = self.loop.without_kernels().bound() + variation / omega
        return np.vstack([self.loop.bound()[:n] / omega, signals[n:]])

    def near(self, cells: Cells) -> tuple[Complex, Array, Chosen]:
        """X_c^-1, a bound of |X - X_c|, and whether X is known to be invertible, for each cell."""
        inverse = np.linalg.inv(self.matrix(axis(cells.omega), cells.delays))
        change = sum(self._changes(cells), np.zeros(inverse.shape))
        return inverse, change, radii(np.abs(inverse) @ change) < ROOM

    def _changes(self, cells: Cells) -> list[Array]:
        """What frequency, and each delay, contribute to the bound of |X - X_c|."""
        states = np.diag((np.arange(len(self.loop.constant)) < self.sizes[0]).astype(float))
        sizes, longest = self.loop.sizes(), cells.delays + cells.spread
        sweep = states + sum(longest[:, i, None, None] * size for i, size in enumerate(sizes))
        phases = (cells.omega + cells.half)[:, None] * cells.spread
        return [
            cells.half[:, None, None] * sweep,
            *(phases[:, i, None, None] * size for i, size in enumerate(sizes)),
        ]

    def bounded(self, cells: Cells) -> tuple[Array, Array, Array]:
        """The gain at the centres, a bound of it over each cell, and the coordinate that contributes most to it."""
        inverse, change, room = self.near(cells)
        size = np.abs(inverse)
        wide = np.linalg.solve(np.eye(size.shape[-1]) - np.where(room[:, None, None], size @ change, 0.0), size)
        bend = self.part(wide @ (2.0 * change @ wide @ change + self._bend(cells)) @ wide)
        value, (along, *across) = self.part(inverse), self._tangents(cells, inverse)
        corners = [
            value + side * (along + sum(sign * other for sign, other in zip(signs, across, strict=True)))
            for side in (-1.0, 1.0)
            for signs in product((-1.0, 1.0), repeat=len(across))
        ]
        above = np.max([norms(corner) for corner in corners], axis=0) + norms(bend) / 2.0
        shares = np.stack([norms(self.part(size @ part @ size)) for part in self._changes(cells)])
        return norms(value), np.where(room, above, np.inf), np.argmax(shares, axis=0)

    def _tangents(self, cells: Cells, inverse: Complex) -> list[Complex]:
        """The change of the gain matrix, to first order, along half a cell: in frequency, and in each unknown delay."""
        s = axis(cells.omega)
        lines = self.loop.aged().lines_at(s, cells.delays)
        states = np.diag((np.arange(len(self.loop.constant)) < self.sizes[0]).astype(complex))
        sweep = states - sum(cells.delays[:, i, None, None] * line for i, line in enumerate(lines))
        rates = [1j * cells.half[:, None, None] * sweep]
        for i, line in enumerate(lines):
            if np.any(cells.spread[:, i]):
                rates.append(-(s * cells.spread[:, i])[:, None, None] * line)
        return [-self.part(inverse @ rate @ inverse) for rate in rates]

    def _bend(self, cells: Cells) -> Array:
        """A bound of the second derivative of X along half a diagonal of the cell."""
        high, longest = cells.omega + cells.half, cells.delays + cells.spread
        phase = cells.half[:, None] * longest + high[:, None] * cells.spread
        rates = phase**2 + 2.0 * cells.half[:, None] * cells.spread
        return np.asarray(sum(rates[:, i, None, None] * size for i, size in enumerate(self.loop.sizes())))


def norms(matrices: Complex | Array) -> Array:
    """Largest singular values of a stack."""
    return np.asarray(np.linalg.norm(matrices, 2, axis=(-2, -1)))


def radii(matrices: Array) -> Array:
    """Spectral radii of a stack."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))
