"""The supremum of a gain over all frequencies and over ranges of delays, and stability over them; neither by sampling.

Cells of frequencies and delays are cut until none can hold more than what is attained (`Response.bounded`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.delay.exact.response import Cells, Response
from replication.estimation.validation import Array

MOST, FIRST, CHUNK = 100_000, 100, 4_000
"""Cells looked at, at the most; in the first grid; that are looked at together."""
DOUBLINGS, DECADES, LOST = 60, 8, 1e6
"""In search of a highest frequency; of the first grid; times the nominal gain, where a range is given up."""


@dataclass(frozen=True)
class GainBracket:
    """lower <= the supremum of the gain <= upper.

    Attributes
    ----------
    lower, upper : float
        Both ends; `upper` is infinite where stability over the whole range stays open.
    frequency : float
        Where the lower end is attained, rad/s.
    delays : tuple of float
        The delays for which it is, s.
    """

    lower: float
    upper: float
    frequency: float
    delays: tuple[float, ...]


def gain_bracket(response: Response, relative: float = 1e-6, most: int = MOST) -> GainBracket:
    """The supremum of the gain, within `relative`; in a wider bracket where `most` cells do not give that.

    Where X is invertible over all cells, and has no roots with Re s >= 0 at the nominal delays, it has none for any.

    Raises InfeasibleError if it has such roots at the nominal delays, SolverError if that stays open.
    """
    reach, roots = right_roots(response)
    if roots:
        raise InfeasibleError(f"the gain is infinite: the error has {roots} roots in the right half-plane")
    grid = first_grid(reach)
    values = response.gains(grid)
    best = GainBracket(float(values.max()), np.inf, float(grid[int(values.argmax())]), response.loop.delays)
    nominal = best.lower
    least, top = response.beyond(np.inf) * (1.0 + relative), reach
    for _ in range(DOUBLINGS):
        if response.beyond(top) <= max(best.lower * (1.0 + relative), least):
            break
        top *= 2.0
    upper, used = response.beyond(top), 0
    cells = response.cells(np.concatenate([grid, np.geomspace(reach, max(top, 1.1 * reach), FIRST)]))
    while cells.omega.size:
        found = [
            response.bounded(Cells(*(part[i : i + CHUNK] for part in cells))) for i in range(0, len(cells.omega), CHUNK)
        ]
        middle, above, widest = (np.concatenate(part) for part in zip(*found, strict=True))
        used += len(middle)
        top_cell = int(np.argmax(middle))
        if middle[top_cell] > best.lower:
            where = tuple(cells.delays[top_cell].tolist())
            best = GainBracket(float(middle[top_cell]), np.inf, float(cells.omega[top_cell]), where)
        done = above <= max(best.lower * (1.0 + relative), upper)
        upper = max(upper, float(above[done].max(initial=0.0)))
        if used + 2 * int(np.sum(~done)) > most or best.lower > LOST * nominal:
            upper = max(upper, float(above[~done].max(initial=0.0)))
            break
        cells = _halved(Cells(*(part[~done] for part in cells)), widest[~done])
    return GainBracket(best.lower, max(upper, best.lower), best.frequency, best.delays)


def right_roots(response: Response) -> tuple[float, int]:
    """A frequency beyond which no roots have Re s >= 0, and how many have; at the nominal delays.

    The argument principle: the phase of det X is carried from the centre to the ends of each cell by the eigenvalues
    1 + l of X_c^-1 X, |l| < 1. Raises SolverError if a root lies on the imaginary axis, or too near for MOST cells.
    """
    reach = 1.0
    while not np.isfinite(response.beyond(reach)):
        reach *= 2.0
    while reach > np.finfo(float).tiny and np.isfinite(response.beyond(reach / 2.0)):
        reach /= 2.0
    n = response.sizes[0]
    corner = response.matrix(np.array([1j * reach]))[0]
    corner[:n] /= 1j * reach
    # From the real point `reach` along the arc, where the loop is small, to j reach; then down the axis to 0.
    phase = n * np.pi / 2.0 + float(np.sum(np.angle(np.linalg.eigvals(corner))))
    cells, used = response.cells(first_grid(reach), nominal=True), 0
    while cells.omega.size:
        used += len(cells.omega)
        if used > MOST:
            raise SolverError(
                f"a root of the error lies on the imaginary axis, or next to it: {cells.omega[0]:.6g} rad/s"
            )
        found = response.around(cells)
        inverse, done = found.inverse, found.room
        for side in (-1.0, 1.0):
            ends = response.matrix(1j * (cells.omega + side * cells.half)[done])
            phase -= side * float(np.sum(np.angle(np.linalg.eigvals(inverse[done] @ ends))))
        cells = _halved(Cells(*(part[~done] for part in cells)), np.zeros(int(np.sum(~done)), dtype=int))
    roots = phase / np.pi
    if abs(roots - round(roots)) > 1e-3:
        raise SolverError(f"the roots of the error were not counted: {roots:.6g} is no whole number; rescale the plant")
    return reach, round(roots)


def first_grid(reach: float) -> Array:
    """Frequencies from 0 to `reach`, some at equal distances and some at equal ratios."""
    return reach * np.unique(np.concatenate([[0.0], np.logspace(-DECADES, 0, FIRST), np.linspace(0.0, 1.0, FIRST)]))


def _halved(cells: Cells, coordinate: Array) -> Cells:
    """Each cell in two, cut across the frequency (coordinate 0) or a delay (1, 2, ..)."""
    along = coordinate == 0
    half = np.where(along, cells.half / 2.0, cells.half)
    cut = coordinate[:, None] == 1 + np.arange(cells.delays.shape[1])
    spread = np.where(cut, cells.spread / 2.0, cells.spread)
    shift, move = np.where(along, half, 0.0), np.where(cut, spread, 0.0)
    return Cells(
        np.concatenate([cells.omega - shift, cells.omega + shift]),
        np.tile(half, 2),
        np.concatenate([cells.delays - move, cells.delays + move]),
        np.tile(spread, (2, 1)),
    )
