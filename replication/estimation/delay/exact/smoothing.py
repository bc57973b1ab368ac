"""What no estimator goes below, not even one that knows the future; mean squares; and the baselines of a level.

Delays are true exponentials. The level is the supremum over w of |G_z null(G_y)|: each frequency gives a lower bound,
so that a peak that was missed makes it weaker only.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeVar

import numpy as np
import scipy

from replication.errors import InfeasibleError, SolverError
from replication.estimation.api.results import Bracket, Evidence, baselines
from replication.estimation.delay.exact.central import FilterModel, central, ladder_model
from replication.estimation.delay.exact.response import error_response, gain_bracket, right_roots
from replication.estimation.delay.exact.terms import Complex, PlantTerms, Terms
from replication.estimation.delay.sos import legendre
from replication.estimation.linear.norms import continuous_norm
from replication.estimation.validation import Array

DECADES, POINTS, TURNS, PER_TURN, PEAKS, ROUNDS = 6, 200, 12, 48, 6, 40
"""The grid: decades and points of its logarithmic part; turns of the longest delay and points a turn; peaks that are
refined, and how often."""
PARALLEL = 1e-10


@dataclass(frozen=True)
class SmootherBound:
    """`level` is attained at `frequency` (rad/s): a lower bound of the level of every estimator."""

    level: float
    frequency: float


def smoother_bound(plant: PlantTerms) -> SmootherBound:
    """The bound over a grid that the delays and the plant set, refined at its peaks."""
    longest = max(plant.terms.delays, default=0.0)
    n = plant.sizes[0]
    rate = max(float(np.linalg.norm(plant.terms.bound()[:n, :n], 2)), 1e-6 / longest if longest else 1e-6)
    grid = [np.array([0.0]), rate * np.logspace(-DECADES, 2, POINTS)]
    if longest:
        grid.append(np.linspace(0.0, 2.0 * np.pi * TURNS / longest, TURNS * PER_TURN))
    omega = np.unique(np.concatenate(grid))
    return SmootherBound(*highest(partial(smoother_gains, plant), omega))


def highest(values: Callable[[Array], Array], omega: Array) -> tuple[float, float]:
    """The largest value of a function on a grid, refined at its highest peaks, and where it is."""
    on_grid = values(omega)
    inner = np.flatnonzero((on_grid[1:-1] >= on_grid[:-2]) & (on_grid[1:-1] >= on_grid[2:])) + 1
    inner = inner[np.argsort(-on_grid[inner])][:PEAKS]
    best, where = float(on_grid.max()), float(omega[int(on_grid.argmax())])
    # Every peak is enclosed by thirds, all at once; the best value so far is kept.
    left, right = omega[inner - 1], omega[inner + 1]
    for _ in range(ROUNDS if inner.size else 0):
        first, second = left + (right - left) / 3.0, right - (right - left) / 3.0
        trials = values(np.concatenate([first, second]))
        if trials.max() > best:
            best, where = float(trials.max()), float(np.concatenate([first, second])[int(trials.argmax())])
        low, high = np.split(trials, 2)
        left, right = np.where(low < high, first, left), np.where(low < high, right, second)
    return best, where


def smoother_gains(plant: PlantTerms, omega: Array) -> Array:
    """|G_z null(G_y)| at each frequency (M,); infinite where a motion without disturbance leaves y at rest."""
    maps, hidden = smoother_maps(plant, omega)
    return np.asarray(np.where(hidden, np.inf, np.linalg.norm(maps, 2, axis=(1, 2))))


def smoother_maps(plant: PlantTerms, omega: Array) -> tuple[Complex, Array]:
    """G_z null(G_y) at each frequency (M, p, k), and where a motion without disturbance leaves y at rest (M,)."""
    n, p, q, r = plant.sizes
    if r <= q:
        return np.zeros((len(omega), p, 1), dtype=complex), np.zeros(len(omega), dtype=bool)
    values = plant.terms.at(1j * omega)
    pencil = plant.pencil(omega, values)
    # Neither the unit of a state nor that of w hides a motion.
    sizes = np.linalg.norm(pencil, axis=1)
    sizes[:, n:] = sizes[:, n:].max(axis=1, keepdims=True)
    sizes = np.where(sizes > 0.0, sizes, 1.0)[:, :, None]
    kernel = np.linalg.svd(pencil / sizes.swapaxes(1, 2))[2][:, n + q :].conj().swapaxes(1, 2) / sizes
    kernel *= sizes[:, -1:]
    output, noise = values[:, plant.rows[1]] @ kernel, kernel[:, n:]
    _, sizes, right = np.linalg.svd(noise, full_matrices=False)
    moved = np.where(sizes > PARALLEL, 1.0 / np.maximum(sizes, PARALLEL), 0.0)
    maps = output @ right.conj().swapaxes(1, 2)
    hidden = np.linalg.norm(maps * (moved == 0.0)[:, None, :], axis=(1, 2)) > PARALLEL
    return maps * moved[:, None, :], hidden


# The mean square of an error under white noise of unit intensity, by its spectrum: delays are true exponentials.
#
# The integral over all frequencies is cut smoothly: below a window by Gauss' rule on panels that are halved until they
# agree with a finer rule, beyond it by what the spectrum times omega^2 tends to. The window is smooth, so that the
# oscillations which delays leave there average out.


FAR, TURNED, FARTHEST = 30.0, 80.0, 1000.0
"""Where the window begins: in units of the frequency beyond which there are no dynamics, at least; phase of the
shortest delay there, rad; in those units at the most."""
LOWEST, PANELS, PER_DELAY, WINDOW = 8, 100, 8.0, 32
"""The first panels: decades and number of the logarithmic ones; phase of the longest delay over one, rad; number in the
window."""
COARSE, FINE, DIGITS = 6, 12, 1e-9
"""Points of both rules on a panel, and by how much of the integral they may differ, all panels together."""
MOST = 2_000_000
"""Frequencies."""

Function = Callable[[Array], Complex | Array]


def error_covariance(plant: PlantTerms, injection: Terms | None = None) -> tuple[Array, float]:
    """Covariance (p, p) of the error of z, with an injection or of z itself; and where its dynamics end, rad/s."""
    response = error_response(plant, injection)
    reach, roots = right_roots(response)
    if roots:
        raise InfeasibleError(f"the mean square is infinite: the error has {roots} roots in the right half-plane")

    def spectrum(omega: Array) -> Complex:
        return _squared(response.part(np.linalg.inv(response.matrix(1j * omega))))

    return integrated(spectrum, reach, response.loop.delays), reach


def smoother_covariance(plant: PlantTerms, reach: float) -> Array:
    """The same for an estimator that knows all measurements, past and future; nan where one frequency has no bound."""

    def spectrum(omega: Array) -> Complex:
        maps, hidden = smoother_maps(plant, omega)
        maps[hidden] = np.nan
        return _squared(maps)

    return integrated(spectrum, reach, plant.terms.delays)


def integrated(spectrum: Function, reach: float, delays: Sequence[float]) -> Array:
    """Integral over all frequencies, by 2 pi, of a spectrum (M, p, p), even and from `reach` on like omega^-2."""
    top = max(FAR, min(TURNED / (reach * min(delays)), FARTHEST)) * reach if delays else FAR * reach
    far = np.linspace(top, 2.0 * top, WINDOW + 1)
    edges = [np.array([0.0]), np.geomspace(reach * 10.0**-LOWEST, top, PANELS), far]
    if delays:
        edges.append(np.arange(0.0, FAR * reach, max(PER_DELAY / max(delays), 40.0 * FAR * reach / MOST)))
    panels = np.unique(np.concatenate(edges))

    def window(omega: Array) -> tuple[Array, Array, Array]:
        """omega over `top`; what rises smoothly from 0 to 1 over the window; a smooth weight inside of it."""
        ratio = omega / top
        along = np.clip(ratio - 1.0, 1e-3, 1.0 - 1e-3)  # from 0 to 1 over the window, ends left out
        beyond = np.where(ratio < 1.0, 0.0, scipy.special.expit(1.0 / (1.0 - along) - 1.0 / along))
        return ratio, beyond, np.exp(4.0 - 1.0 / (along * (1.0 - along)))

    def averaged(omega: Array) -> Complex | Array:
        ratio, _, middle = window(omega)
        return spectrum(omega)[:, None] * np.stack([middle * ratio**k for k in (2, 4)], axis=1)[..., None, None]

    def weights(omega: Array) -> Array:
        ratio, beyond, middle = window(omega)
        return np.stack([middle * ratio**k for k in (-2, 0, 2)] + [beyond * ratio**-k for k in (2, 4)], axis=1)

    near = _quadrature(lambda omega: spectrum(omega) * (1.0 - window(omega)[1])[:, None, None], panels)
    # There the spectrum is m_1 (top/omega)^2 + m_2 (top/omega)^4 on the average: two averages tell m.
    # What is below the digits of the whole is rounding there.
    averages = _quadrature(averaged, far, float(np.abs(near).max()))
    low, mid, high, *rest = _quadrature(weights, far).real
    parts = np.linalg.solve([[mid, low], [high, mid]], averages.reshape(2, -1)).reshape(averages.shape)
    tail = np.add(rest, [top / 2.0, top / 24.0])  # beyond the window
    return np.asarray((near + np.tensordot(tail, parts, axes=1)).real / np.pi)


def _quadrature(function: Function, edges: Array, size: float = 0.0) -> Complex:
    """The integral over all panels, part of a whole of a `size`; those on which both rules differ are halved."""
    left, right = edges[:-1], edges[1:]
    total: Complex = np.zeros(function(edges[:1]).shape[1:], dtype=complex)
    allowed, used = -1.0, 0
    while left.size:
        used += (COARSE + FINE) * left.size
        if used > MOST:
            raise SolverError(
                "the mean square error stays open: its spectrum is too sharp for "
                f"{MOST} frequencies; a root of the error lies next to the imaginary axis"
            )
        coarse, fine = (_on_panels(function, left, right, points) for points in (COARSE, FINE))
        if allowed < 0.0:
            allowed = DIGITS * max(float(np.abs(fine.sum(axis=0)).max()), size) / left.size
        axes = tuple(range(1, fine.ndim))
        mask = np.abs(fine - coarse).max(axis=axes) <= np.maximum(allowed, 1e-13 * np.abs(fine).max(axis=axes))
        mask |= ~np.isfinite(fine).all(axis=axes)
        total = total + fine[mask].sum(axis=0)
        left, right = left[~mask], right[~mask]
        middle = (left + right) / 2.0
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    return total


def _on_panels(function: Function, left: Array, right: Array, points: int) -> Complex:
    """The integral over each panel (M, ..) by Gauss' rule."""
    (nodes, weights), width = legendre.gauss(points), right - left
    values = function((right[:, None] + width[:, None] * nodes).ravel())
    return np.asarray(
        np.einsum("t,m,mt...->m...", weights, width, values.reshape(len(left), points, *values.shape[1:]))
    )


def _squared(maps: Complex) -> Complex:
    return np.asarray(maps @ maps.conj().swapaxes(1, 2))


WIDTH = 1e-4
"""Relative width of the gain without sensors."""
ORDER, STATES = 6, 120
"""Moments of each piece of the past in the model of the Kalman filter, fewer for more states than these."""

Measure = TypeVar("Measure", float, Bracket)
DEPENDENT = 1e-10
"""Least eigenvalue of the correlations of the noise in the measurements, below which one has no noise of its own."""


def worth(plant: PlantTerms, level: float | Bracket) -> tuple[Evidence, ...]:
    """The facts to set beside `level`, with advice where it is hardly below that without sensors."""
    how, gain = "gain from w to the error of z, true exponentials", error_response(plant)
    without = alone(lambda: Bracket((bracket := gain_bracket(gain, WIDTH)).lower, bracket.upper, "attained"))
    return *beside(level, how, without, smoother_bound(plant).level), _kalman(plant)


def alone(measure: Callable[[], Measure]) -> Measure | Literal["open"] | None:
    """A measure of the estimate zero: None if it is infinite, open where a root next to the axis leaves it so."""
    try:
        return measure()
    except InfeasibleError:
        return None
    except (SolverError, np.linalg.LinAlgError):
        return "open"


def beside(
    measure: float | Bracket,
    how: str,
    without: float | Bracket | Literal["open"] | None,
    limit: float | None = None,
    what: str = "level",
) -> tuple[Evidence, ...]:
    """`baselines` of a measure, with one of the estimate zero as `alone` gives it."""
    if without != "open":
        return baselines(measure, how, what=what, without=without, limit=limit)
    unknown = Evidence(f"{what} without sensors", "open", "a root of the plant on the imaginary axis, or next to it")
    return unknown, *baselines(measure, how, what=what, without=None, limit=limit)[1:]


def _kalman(plant: PlantTerms) -> Evidence:
    what = "level of the Kalman filter"
    for order in range(ORDER, 0, -1):
        model = ladder_model(plant, order)
        if len(model.a) <= STATES:
            break
    how = f"white noise of unit intensity; on a model with {len(model.a)} states"
    try:
        return Evidence(what, kalman_level(model), how)
    except np.linalg.LinAlgError:
        return Evidence(what, "none", "a measurement without noise of its own: its gains would be infinite")
    except (InfeasibleError, SolverError) as error:
        return Evidence(what, "open", f"{how}: {error}")


def kalman_level(model: FilterModel) -> float:
    """The gain from w to the error of z of the Kalman filter for white w; LinAlgError if there is none."""
    R = model.dy @ model.dy.T
    size = np.sqrt(np.diag(R))
    if np.any(size == 0) or np.linalg.eigvalsh(R / np.outer(size, size))[0] < DEPENDENT:
        raise np.linalg.LinAlgError
    L, _ = central(model)
    Lz = np.asarray(np.linalg.solve(R, (model.dz @ model.dy.T).T).T, dtype=float)
    return continuous_norm(*model.error(L, Lz)).upper
