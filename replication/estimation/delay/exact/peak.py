"""The supremum of the gain of a delay equation over all frequencies, and whether it is stable; neither by sampling.

X(s) xi = [0; w] with X(s) = diag(s I, I) + L(s): rows of states first, then algebraic ones. All bounds are entry by
entry, so that no unit of any variable matters. With U bounding |X'|, and for |w - c| <= r,

    |X^-1| <= (I - r |X_c^-1| U)^-1 |X_c^-1|    where r |X_c^-1| U has a spectral radius below one;

this bounds the second derivative of the gain matrix, and shows that X is invertible over the interval.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.delay.exact.terms import Terms
from replication.estimation.validation import Array, ComplexArray

MOST, FIRST, CHUNK = 100_000, 100, 4_000
"""Intervals looked at, at the most; the first ones; those that are looked at together."""
ROOM, DOUBLINGS, DECADES = 0.9, 60, 8
"""Spectral radius up to which an interval counts as invertible; in search of a highest frequency; of the first grid."""


@dataclass(frozen=True)
class GainBracket:
    """lower <= sup over w of the gain <= upper; lower is attained at `frequency` (rad/s)."""

    lower: float
    upper: float
    frequency: float


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
    """

    loop: Terms
    sizes: tuple[int, int, int]
    direct: Terms

    def matrix(self, s: ComplexArray) -> ComplexArray:
        """X at each s (M,)."""
        n, size = self.sizes[0], len(self.loop.constant)
        value = self.loop.at(s)
        value[:, range(n), range(n)] += s[:, None]
        value[:, range(n, size), range(n, size)] += 1.0
        return value

    @cached_property
    def slope(self) -> Terms:
        """X'."""
        states = np.diag((np.arange(len(self.loop.constant)) < self.sizes[0]).astype(float))
        return replace(self.loop.slope(), constant=states)

    @cached_property
    def bends(self) -> tuple[Array, Array]:
        """Bounds of |X'| and |X''| over the imaginary axis."""
        return self.slope.bound(), self.slope.slope().bound()

    def part(self, inverse: Array | ComplexArray) -> ComplexArray:
        """The part of X^-1 from w to z."""
        _, p, r = self.sizes
        return np.asarray(inverse[..., -p - r : -r, -r:], dtype=complex)

    def gains(self, omega: Array) -> Array:
        """The largest singular value at each frequency."""
        return _norms(self.part(np.linalg.inv(self.matrix(1j * omega))))

    def beyond(self, omega: float) -> float:
        """A bound of the gain at all frequencies from `omega` on; infinite if X may be singular for |s| >= omega."""
        near, far = self._small(omega), self._small(np.inf)
        if not _radius(near) < 1.0:
            return float(np.inf)
        eye = np.eye(len(near))
        rest = self.part(np.linalg.inv(eye - near) - np.linalg.inv(eye - far))
        parts = (self.direct.constant, *self.direct.delayed)
        return float(sum(np.linalg.norm(part, 2) for part in parts) + np.linalg.norm(rest, 2))

    def _small(self, omega: float) -> Array:
        """Bounds of |diag(s I, I)^-1 L(s)| for all |s| >= omega with Re s >= 0."""
        n = self.sizes[0]
        signals = self.loop.without_kernels().bound() + self.loop.variation() / omega
        return np.vstack([self.loop.bound()[:n] / omega, signals[n:]])


def gain_bracket(response: Response, relative: float = 1e-6) -> GainBracket:
    """The supremum of the gain, within `relative`; in a wider bracket where MOST intervals do not give that.

    Raises InfeasibleError if X(s) is singular for some s with Re s >= 0, SolverError if that stays open.
    """
    reach, roots = right_roots(response)
    if roots:
        raise InfeasibleError(f"the gain is infinite: the error has {roots} roots in the right half-plane")
    least = response.beyond(np.inf) * (1.0 + relative)
    grid = reach * np.unique(np.concatenate([[0.0], np.logspace(-DECADES, 0, FIRST), np.linspace(0.0, 1.0, FIRST)]))
    values = response.gains(grid)
    lower, where = float(values.max()), float(grid[int(values.argmax())])
    top = reach
    for _ in range(DOUBLINGS):
        if response.beyond(top) <= max(lower * (1.0 + relative), least):
            break
        top *= 2.0
    upper = response.beyond(top)
    centres, halves = _intervals(np.concatenate([grid, np.geomspace(reach, max(top, 1.1 * reach), FIRST)]))
    used = 0
    while centres.size:
        middle, above = (np.concatenate(part) for part in zip(*_pieces(response, centres, halves), strict=True))
        used += centres.size
        best = int(np.argmax(middle))
        if middle[best] > lower:
            lower, where = float(middle[best]), float(centres[best])
        done = above <= max(lower * (1.0 + relative), upper)
        upper = max(upper, float(above[done].max(initial=0.0)))
        centres, halves, above = centres[~done], halves[~done] / 2.0, above[~done]
        if used + 2 * centres.size > MOST:
            upper = max(upper, float(above.max(initial=0.0)))
            break
        centres, halves = np.concatenate([centres - halves, centres + halves]), np.tile(halves, 2)
    return GainBracket(lower, max(upper, lower), where)


def right_roots(response: Response) -> tuple[float, int]:
    """A frequency beyond which there are no roots with Re s >= 0, and how many there are; by the argument principle.

    The phase of det X is carried from centre to end of each interval by the eigenvalues 1 + l of X_c^-1 X, |l| < 1.
    Raises SolverError if a root lies on the imaginary axis or too near for MOST intervals.
    """
    reach = 1.0
    while not np.isfinite(response.beyond(reach)):
        reach *= 2.0
    while np.isfinite(response.beyond(reach / 2.0)) and reach > np.finfo(float).tiny:
        reach /= 2.0
    n, size = response.sizes[0], len(response.loop.constant)
    corner = response.matrix(np.array([1j * reach]))[0]
    corner[:n] /= 1j * reach
    # From the real point `reach` along the arc, where the loop is small, to j reach; then down the axis to 0.
    phase = n * np.pi / 2.0 + float(np.sum(np.angle(np.linalg.eigvals(corner))))
    edges = reach * np.unique(np.concatenate([[0.0], np.logspace(-DECADES, 0, FIRST), np.linspace(0.0, 1.0, FIRST)]))
    centres, halves = _intervals(edges)
    used = 0
    while centres.size:
        used += centres.size
        if used > MOST:
            raise SolverError(
                f"a root of the error lies on the imaginary axis or next to it, near {centres.min():.6g} rad/s"
            )
        inverse = np.linalg.inv(response.matrix(1j * centres))
        done = _radii(halves[:, None, None] * np.abs(inverse) @ response.bends[0]) < ROOM
        for side in (-1.0, 1.0):
            ends = response.matrix(1j * (centres[done] + side * halves[done]))
            phase -= side * float(np.sum(np.angle(np.linalg.eigvals(inverse[done] @ ends))))
        centres, halves = centres[~done], halves[~done] / 2.0
        centres, halves = np.concatenate([centres - halves, centres + halves]), np.tile(halves, 2)
    roots = phase / np.pi
    if abs(roots - round(roots)) > 1e-3:
        raise SolverError(f"the roots of an error system of {size} signals were not counted: {roots:.6g} is no number")
    return reach, round(roots)


def _pieces(response: Response, centres: Array, halves: Array) -> list[tuple[Array, Array]]:
    """The gain at the centres, and a bound over each interval; a part of them at a time."""
    first, second = response.bends
    found = []
    for start in range(0, len(centres), CHUNK):
        half = halves[start : start + CHUNK, None, None]
        s = 1j * centres[start : start + CHUNK]
        inverse = np.linalg.inv(response.matrix(s))
        value = response.part(inverse)
        near = half * np.abs(inverse) @ first
        room = _radii(near) < ROOM
        near[~room] = 0.0
        wide = np.linalg.solve(np.eye(near.shape[-1]) - near, np.abs(inverse))
        bend = response.part(wide @ (2.0 * first @ wide @ first + second) @ wide)
        slope = half * response.part(inverse @ response.slope.at(s) @ inverse)
        ends = np.maximum(_norms(value + slope), _norms(value - slope))
        above = ends + half[:, 0, 0] ** 2 / 2.0 * _norms(bend)
        found.append((_norms(value), np.where(room, above, np.inf)))
    return found


def _intervals(edges: Array) -> tuple[Array, Array]:
    """Centres and half widths between sorted edges."""
    edges = np.unique(edges)
    return (edges[1:] + edges[:-1]) / 2.0, np.diff(edges) / 2.0


def _norms(matrices: ComplexArray) -> Array:
    return np.asarray(np.linalg.norm(matrices, 2, axis=(-2, -1)))


def _radii(matrices: Array) -> Array:
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))


def _radius(matrix: Array) -> float:
    return float(_radii(matrix[None])[0])
