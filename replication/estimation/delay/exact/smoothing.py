"""The level that no estimator goes below, not even one that knows the future: sup over w of |G_z null(G_y)|.

Delays are true exponentials; each frequency gives a lower bound, so that a peak that was missed makes it weaker only.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeVar

import numpy as np

from replication.errors import InfeasibleError, SolverError
from replication.estimation.api.results import Bracket, Evidence, baselines
from replication.estimation.delay.exact.central import FilterModel, central, ladder_model
from replication.estimation.delay.exact.response import error_response, gain_bracket
from replication.estimation.delay.exact.terms import Complex, PlantTerms, axis
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
    values = plant.terms.at(axis(omega))
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


# Comparisons of the level of a delay observer: the gain without sensors, of a Kalman filter, of a smoother


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
