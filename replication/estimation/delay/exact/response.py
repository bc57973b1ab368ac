"""The closed loop of a delay plant and an observer as a delay equation; its gain, over ranges of delays too.

X xi = [0; w] with X = diag(s I, I) + L(s), rows of states first, then algebraic ones; L depends on the s tau_i.
A cell is |w - w_c| <= r, |tau_i - t_i| <= d_i. On it X = X_c (I + E), and in some basis |E| <= D entry by entry, by the
derivatives at the centre and a bound of the second ones; then

    |(I + E)^-1| <= (I - D)^-1    where D has a spectral radius below one,

which shows that X is invertible and bounds the second-order remainder of the gain matrix. No unit of any variable
matters.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, wraps
from itertools import product
from typing import NamedTuple, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

from replication.errors import InfeasibleError, SolverError
from replication.estimation.delay.exact.terms import Complex, PlantTerms, Terms, stacked
from replication.estimation.validation import Array

Block = TypeVar("Block", Array, Complex)
Chosen = npt.NDArray[np.bool_]
ROOM, ROUNDING, WORST = 0.9, 1e-11, 1e8
"""Spectral radius up to which X counts as invertible on a cell; a cell too narrow to tell; condition of a basis."""


class Cells(NamedTuple):
    """Cells: centre (M,) and half width (M,) in frequency, centres (M, K) and half widths (M, K) of the delays."""

    omega: Array
    half: Array
    delays: Array
    spread: Array


class Surroundings(NamedTuple):
    """X_c^-1 at the centre of each cell and X_c^-1 X' along half the cell, in frequency and in each delay.

    Then, in the basis T, |T^-1 X_c^-1| and |T|, the sizes of all steps together, a bound of |X_c^-1 X''| over the cell,
    and whether X is known to be invertible there.
    """

    inverse: Complex
    steps: list[Complex]
    left: Array
    right: Array
    change: Array
    bend: Array
    room: Chosen


@dataclass(frozen=True, eq=False)
class Response:
    """The gain matrix from w to z."""

    loop: Terms  # L(s); rows and columns: states, other signals, z, w
    sizes: tuple[int, int, int]  # Number of states, of z and of w
    direct: float  # A bound of what z is of w at frequencies beyond all dynamics
    ranges: tuple[tuple[float, float], ...]  # Shortest and longest delay of each line of `loop`, s

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
        return norms(self.part(np.linalg.inv(self.matrix(1j * omega, delays))))

    def beyond(self, omega: float) -> float:
        """A bound of the gain from `omega` on, for all delays of the ranges; infinite if X may be singular there."""
        near, far = self._small(omega), self._small(np.inf)
        if not radii(near) < 1.0:
            return float(np.inf)
        eye = np.eye(len(near))
        rest = self.part(np.linalg.inv(eye - near) - np.linalg.inv(eye - far))
        return self.direct + float(np.linalg.norm(rest, 2))

    def _small(self, omega: float) -> Array:
        """Bounds of |diag(s I, I)^-1 L(s)| for all |s| >= omega with Re s >= 0."""
        n = self.sizes[0]
        variation = self.loop.variation([least for least, _ in self.ranges])
        signals = sum(np.abs(part) for part in (self.loop.constant, *self.loop.delayed)) + variation / omega
        return np.vstack([self.loop.bound()[:n] / omega, signals[n:]])

    @cached_property
    def aged(self) -> tuple[Terms, Terms]:
        """The loop with each line weighted with its lag, once and twice: its derivatives by the phase."""
        once = self.loop.aged()
        return once, once.aged()

    def around(self, cells: Cells) -> Surroundings:
        """X and its changes over each cell."""
        s = 1j * cells.omega
        inverse = np.linalg.inv(self.matrix(s, cells.delays))
        lines = self.aged[0].lines_at(s, cells.delays)
        states = np.diag((np.arange(len(self.loop.constant)) < self.sizes[0]).astype(float))
        sweep = states - sum(cells.delays[:, i, None, None] * line for i, line in enumerate(lines))
        rates = [1j * cells.half[:, None, None] * sweep]
        rates += [-(s * cells.spread[:, i])[:, None, None] * line for i, line in enumerate(lines)]
        high, longest = cells.omega + cells.half, cells.delays + cells.spread
        turns, moves = cells.half[:, None] * longest, high[:, None] * cells.spread
        low = np.maximum(cells.omega - cells.half, 0.0)[:, None] * (cells.delays - cells.spread)
        first, second = (terms.sizes_beyond(low) for terms in self.aged)
        bend = np.zeros(inverse.shape)
        for i in range(len(lines)):
            bend += ((turns + moves)[:, i] ** 2)[:, None, None] * second[i]
            bend += (2.0 * cells.half * cells.spread[:, i])[:, None, None] * first[i]
        steps: list[Complex] = [inverse @ rate for rate in rates]
        basis = self._basis(steps[0])
        back = np.linalg.inv(basis)
        left, right = np.abs(back @ inverse), np.abs(basis)
        change = sum((np.abs(back @ step @ basis) for step in steps), np.zeros(bend.shape))
        bend = left @ bend @ right
        room = (radii(change + bend / 2.0) < ROOM) & (cells.half > ROUNDING * cells.omega)
        return Surroundings(inverse, steps, left, right, change, bend, room)

    def _basis(self, step: Complex) -> Complex:
        """Eigenvectors of the step in frequency, states and signals alone; the unit matrix where they are near another.

        Sizes are taken in this basis: what cancels in the step, as in loops of high gain, stays cancelled.
        """
        count = step.shape[-1] - sum(self.sizes[1:])
        vectors = np.linalg.eig(step[:, :count, :count])[1]
        usable = np.linalg.cond(vectors) < WORST
        basis = np.tile(np.eye(step.shape[-1], dtype=complex), (len(step), 1, 1))
        basis[usable, :count, :count] = vectors[usable]
        return basis

    def bounded(self, cells: Cells) -> tuple[Array, Array, Array]:
        """The gain at the centres, a bound of it over each cell, and the coordinate to cut."""
        inverse, steps, left, right, change, bend, room = self.around(cells)
        near = np.where(room[:, None, None], change + bend / 2.0, 0.0)
        wide = np.linalg.inv(np.eye(near.shape[-1]) - near)
        first, second = wide @ (change + bend), wide @ bend
        rest = self.part(right @ (2.0 * first @ first + second) @ wide @ left)
        moves = [-self.part(step @ inverse) for step in steps]
        value, unknown = self.part(inverse), [move for move in moves[1:] if np.any(move)]
        corners = [
            value + side * (moves[0] + sum(sign * move for sign, move in zip(signs, unknown, strict=True)))
            for side in (-1.0, 1.0)
            for signs in product((-1.0, 1.0), repeat=len(unknown))
        ]
        above = np.max([norms(corner) for corner in corners], axis=0) + norms(rest) / 2.0
        shares = np.stack([norms(self.part(np.abs(step) @ np.abs(inverse))) for step in steps])
        return norms(value), np.where(room, above, np.inf), np.argmax(shares, axis=0)


def norms(matrices: Complex | Array) -> Array:
    """Largest singular values of a stack."""
    return np.asarray(np.linalg.norm(matrices, 2, axis=(-2, -1)))


def radii(matrices: Array) -> Array:
    """Spectral radii of a stack."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))


# The closed loop of a delay plant and an observer of it. With the innovation eps, the errors follow
# [e'; z; eps] = M(s) [e; w] - I(s) eps, where M is the plant and I what the innovation adds to the observer. With other
# delays than it takes for granted the states of both stay.


def error_response(plant: PlantTerms, injection: Terms | None = None) -> Response:
    """From w to the error of z, for an observer of the plant itself, or the estimate zero; signals e, eps, z, w."""
    n, p, q, r = plant.sizes
    injection = Terms(np.zeros((len(plant.terms.constant), q))) if injection is None else injection
    rows, e, eps, z, w = _places(n, q, p, r)
    # Rows (x', z, y) of the plant go to those of e, z and eps.
    to = np.hstack([rows[e].T, rows[z].T, rows[eps].T])
    loop = stacked(
        [(plant.terms, -to, np.vstack([rows[e], rows[w]])), (injection, to, rows[eps])], np.zeros((n + q + p + r,) * 2)
    )
    ranges = tuple((delay, delay) for delay in loop.delays)
    return Response(loop, (n, p, r), _direct(plant, injection), ranges)


def mismatched_response(
    assumed: PlantTerms, injection: Terms, true: Sequence[float], ranges: Sequence[tuple[float, float]]
) -> Response:
    """From w to the error of z where the delays are not those that are `assumed`; signals x, x^, eps, z, w."""
    n, p, q, r = assumed.sizes
    rows, x, guess, eps, z, w = _places(n, n, q, p, r)
    plant_to = np.hstack([rows[x].T, rows[z].T, rows[eps].T])
    copy_to = np.hstack([rows[guess].T, -rows[z].T, -rows[eps].T])
    nothing = np.zeros((r, plant_to.shape[0]))
    loop = stacked(
        [
            (replace(assumed.terms, delays=tuple(true)), -plant_to, np.vstack([rows[x], rows[w]])),
            (assumed.terms, -copy_to, np.vstack([rows[guess], nothing])),
            (injection, -copy_to, rows[eps]),
        ],
        np.zeros((2 * n + q + p + r,) * 2),
    )
    fixed = ((delay, delay) for delay in loop.delays[len(true) :])
    return Response(loop, (2 * n, p, r), _direct(assumed, injection), (*ranges, *fixed))


def _places(*sizes: int) -> tuple[Array, ...]:
    """The identity and, for each signal, its rows."""
    eye = np.eye(sum(sizes))
    stops = np.cumsum(sizes)
    return eye, *(np.arange(stop - size, stop) for size, stop in zip(sizes, stops, strict=True))


def _direct(plant: PlantTerms, injection: Terms) -> float:
    """A bound of D_z w - L_z D_y w at frequencies beyond all dynamics, L_z what the innovation adds to z at once."""
    _, z, y = plant.rows
    parts = (part[:, plant.sizes[0] :] for part in (plant.terms.constant, *plant.terms.delayed))
    return float(sum(np.linalg.norm(part[z] - injection.constant[z] @ part[y], 2) for part in parts))


# The supremum of a gain over all frequencies and over ranges of delays, and stability over them; neither by sampling.
#
# Cells of frequencies and delays are cut until none can hold more than what is attained (`Response.bounded`).


NEAREST, SLOWEST = 1e-18, 1e-12
"""Frequencies that count as zero: in highest ones, of a cell that does not settle; in rates of the longest delay."""
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


def gain_bracket(response: Response, relative: float = 1e-6) -> GainBracket:
    """The supremum of the gain, within `relative`; in a wider bracket where MOST cells do not give that."""
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
        bounds = [
            response.bounded(Cells(*(part[i : i + CHUNK] for part in cells))) for i in range(0, len(cells.omega), CHUNK)
        ]
        middle, above, widest = (np.concatenate(part) for part in zip(*bounds, strict=True))
        used += len(middle)
        top_cell = int(np.argmax(middle))
        if middle[top_cell] > best.lower:
            where = tuple(cells.delays[top_cell].tolist())
            best = GainBracket(float(middle[top_cell]), np.inf, float(cells.omega[top_cell]), where)
        mask = above <= max(best.lower * (1.0 + relative), upper)
        upper = max(upper, float(above[mask].max(initial=0.0)))
        if used + 2 * int(np.sum(~mask)) > MOST or best.lower > LOST * nominal:
            upper = max(upper, float(above[~mask].max(initial=0.0)))
            break
        cells = _halved(Cells(*(part[~mask] for part in cells)), widest[~mask])
    return GainBracket(best.lower, max(upper, best.lower), best.frequency, best.delays)


def right_roots(response: Response) -> tuple[float, int]:
    """A frequency beyond which no roots have Re s >= 0, and how many have; at the nominal delays.

    The argument principle: the phase of det X is carried from the centre to the ends of each cell by the eigenvalues
    1 + l of X_c^-1 X, |l| < 1. Raises SolverError if a root lies on the imaginary axis, or too near for MOST cells.
    """
    # Of integrators alone every frequency is beyond all dynamics.
    reach, slowest = 1.0, SLOWEST / max(response.loop.delays, default=1.0)
    while not np.isfinite(response.beyond(reach)):
        reach *= 2.0
    while reach > slowest and np.isfinite(response.beyond(reach / 2.0)):
        reach /= 2.0
    n = response.sizes[0]
    corner = response.matrix(np.array([1j * reach]))[0]
    corner[:n] /= 1j * reach
    # From the real point `reach` along the arc, where the loop is small, to j reach; then down the axis to 0.
    phase = n * np.pi / 2.0 + float(np.sum(np.angle(np.linalg.eigvals(corner))))
    cells, used = response.cells(first_grid(reach), nominal=True), 0
    while cells.omega.size:
        used += len(cells.omega)
        if used > MOST or cells.omega[0] < NEAREST * reach:
            raise SolverError(
                f"a root of the error lies on the imaginary axis, or next to it: {cells.omega[0]:.6g} rad/s"
            )
        around = response.around(cells)
        inverse, room = around.inverse, around.room
        for side in (-1.0, 1.0):
            ends = response.matrix(1j * (cells.omega + side * cells.half)[room])
            phase -= side * float(np.sum(np.angle(np.linalg.eigvals(inverse[room] @ ends))))
        cells = _halved(Cells(*(part[~room] for part in cells)), np.zeros(int(np.sum(~room)), dtype=int))
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


P = ParamSpec("P")
T = TypeVar("T")


def decided(door: Callable[P, T]) -> Callable[P, T]:
    """`door`, with SolverError where a matrix in it is singular to rounding: no number comes of that."""

    @wraps(door)
    def refusing(*args: P.args, **named: P.kwargs) -> T:
        try:
            return door(*args, **named)
        except np.linalg.LinAlgError as error:
            raise SolverError(
                f"rounding decides ({error}): a root of the plant lies on the imaginary axis where nothing moves it or "
                "shows it, or its numbers lie too far apart; disturb and measure that mode, or choose other units"
            ) from None

    return refusing
