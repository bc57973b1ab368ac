"""The gain over every sampling sequence: from below by one bad sequence, and with the proved level from both sides.

The bound is ||e|| / ||w|| of the worst disturbance of one sequence, so it is attained. Sequences are searched by their
run lengths: how many samples at h_u, at h_l, at h_u, and so on make the worst repeated pattern. Two lengths are
searched from several starts; then runs are interrupted by one sample of the other kind and all lengths are searched
again, as long as that pays. What a level is worth is told by that of no sensor over all sequences, and by other
estimators at constant periods.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.results import LITTLE, Bracket, Evidence, baselines
from replication.estimation.nonuniform.filters import Estimator, gains_at, periodic_gain, riccati_filter
from replication.estimation.nonuniform.guarantee import Guarantee, guaranteed_level
from replication.estimation.nonuniform.plant import PeriodRange, SampledPlant, as_periods, weights_of
from replication.estimation.nonuniform.stamped.design import StampedFilter, kalman_filters
from replication.estimation.validation import Array, as_array, positive_integer

SEARCH_TOLERANCE = 1e-4
FINAL_TOLERANCE = 1e-10
"""Of Lanczos; the error of the singular value is about its square."""
DENSE, RESTARTS = 2000, 200
"""Disturbances of at most so many numbers come from a singular value decomposition if Lanczos restarts more often."""
BLOCK = 32
"""Samples, a power of two, whose map is one matrix."""


def sequence_gain(
    plant: SampledPlant, filter_: Estimator, periods: Array, *, tolerance: float = FINAL_TOLERANCE
) -> tuple[float, Array]:
    """The gain of one finite sequence and its worst disturbance w (K, m) of unit norm, by Lanczos to `tolerance`.

    It is the largest singular value of the map from w_0 ... w_{K-1} to e_1 ... e_K. Where durations count, those of e_k
    and w_k are h_k (of the last error the last period). Raises InvalidInputError for fewer than two periods, periods
    that are not positive, or a filter that does not fit, SolverError if Lanczos' method does not settle.
    """
    periods = as_periods("periods", periods)
    if len(periods) < 2:
        raise InvalidInputError(f"periods must have at least two entries, got {len(periods)}; repeat the period")
    root = np.sqrt(weights_of(plant, periods))[:, None]
    blocks = _blocks(plant, filter_, periods, root)
    count, numbers = root.size * plant.B.shape[1], blocks.inner[:, 0].size
    operator = scipy.sparse.linalg.LinearOperator((numbers, numbers), matvec=blocks.normal, dtype=float)
    # A fixed first guess, and fixed ones after a restart, make the result reproducible.
    rng = np.random.default_rng(0)
    guess = np.zeros(numbers)
    guess[:count] = rng.standard_normal(count)
    try:
        most = RESTARTS if count <= DENSE else None
        _, largest = scipy.sparse.linalg.eigsh(operator, 1, which="LM", v0=guess, tol=tolerance, rng=rng, maxiter=most)
    except scipy.sparse.linalg.ArpackNoConvergence as error:
        # The largest values lie too close together for Lanczos.
        if count > DENSE:
            raise SolverError(
                f"no worst disturbance over {len(periods)} samples was found ({error}): many hurt alike; change "
                "`horizon`, or widen the range of sampling periods"
            ) from error
        largest = np.linalg.svd(np.array([blocks.forward(unit).ravel() for unit in np.eye(numbers)])).U
    w = largest[:, 0] / np.linalg.norm(largest[:, 0])
    return float(np.linalg.norm(blocks.forward(w))), np.asarray(w[:count].reshape(len(periods), -1) / root)


@dataclass(frozen=True)
class _Blocks:
    """The map of a sequence by J blocks of L samples, each one matrix, and a banded system in the states between them.

    band: the system that gives the states after each block, for LAPACK; inner (J, N, L m): what the disturbances of a
    block add to the state after it; errors (J, L s, N + L m): its errors.
    """

    band: Array
    inner: Array
    errors: Array

    def solved(self, right: Array, trans: str = "N") -> Array:
        """States, or costates, from what is added to them."""
        x, _ = scipy.linalg.lapack.dtbtrs(self.band, right.reshape(-1, 1), uplo="L", trans=trans, diag="U")
        return np.asarray(x).reshape(self.inner.shape[:2])

    def forward(self, w: Array) -> Array:
        """The errors (J, L s, 1)."""
        count, size, width = self.inner.shape
        known = np.zeros((count, size + width, 1))
        known[:, size:, 0] = w.reshape(count, width)
        known[1:, :size, 0] = self.solved(self.inner @ known[:, size:])[:-1]
        return np.asarray(self.errors @ known)

    def normal(self, w: Array) -> Array:
        """The map and its adjoint, one after the other."""
        size = self.inner.shape[1]
        pulled = np.swapaxes(self.errors, 1, 2) @ self.forward(w)
        costs = np.zeros((len(pulled), size))
        costs[:-1] = pulled[1:, :size, 0]
        return np.asarray((pulled[:, size:, 0] + (self.solved(costs, "T")[:, None] @ self.inner)[:, 0]).ravel())


def _blocks(plant: SampledPlant, filter_: Estimator, periods: Array, root: Array) -> _Blocks:
    """The map of a sequence; root (K, 1): of its weights."""
    output = filter_.error_output(plant)
    steps, drives = filter_.steps_along(plant, periods)
    moves = np.concatenate([steps, drives / root[:, :, None]], axis=2)
    errors = output * np.vstack([root[1:], root[-1:]])[:, :, None] @ moves
    missing = ((0, -len(periods) % BLOCK), (0, 0), (0, 0))
    moves, errors, size = np.pad(moves, missing), np.pad(errors, missing), steps.shape[1]
    for _ in range(BLOCK.bit_length() - 1):  # twice as many samples at a time
        before, after, early, late = moves[::2], moves[1::2], errors[::2], errors[1::2]
        fresh = np.zeros((*early.shape[:2], late.shape[2] - size))
        moves = np.concatenate([after[..., :size] @ before, after[..., size:]], axis=2)
        late = np.concatenate([late[..., :size] @ before, late[..., size:]], axis=2)
        errors = np.concatenate([np.concatenate([early, fresh], axis=2), late], axis=1)
    # The lower band of the matrix that takes x_1 ... x_J to x_{j+1} - A_j x_j, whose diagonal is one.
    band = np.zeros((2 * size, len(moves), size))
    row, column = np.indices((size, size))
    band[size + row - column, :-1, column] = -np.moveaxis(moves[1:, :, :size], 0, -1)
    return _Blocks(band.reshape(2 * size, -1), moves[:, :, size:], errors)


Runs = tuple[int, ...]

IMPROVEMENT = 1e-6
"""Relative gain below which a change of one length does not count."""
WORTH = 1e-4
"""Relative gain below which two more runs are not worth having."""
MAX_RUNS = 8


@dataclass(frozen=True)
class BadSequence:
    """A sampling sequence and its worst disturbance. level: ||e|| / ||w||; periods (K,) in seconds; w (K, m); e (K +
    1, s).

    runs: the pattern that was repeated to make the sequence: samples at h_u, at h_l, at h_u, and so on.
    """

    level: float
    periods: Array
    w: Array
    e: Array
    runs: tuple[int, ...]


def simulate_error(plant: SampledPlant, filter_: Estimator, periods: Array, w: Array) -> Array:
    """e_0 ... e_K of eq. (5) from rest for the periods (K,) and disturbances w (K, m), of shape (K + 1, s).

    Raises InvalidInputError for periods that are not positive, another length of w, or a filter that does not fit.
    """
    periods = as_periods("periods", periods)
    w = as_array("w", w, (len(periods), plant.B.shape[1]), axes="(K, m)")
    return filter_.errors(plant, periods, w)


def repeated(periods: PeriodRange, runs: Sequence[int], horizon: int) -> Array:
    """`horizon` periods that repeat: runs[0] samples at h_u, runs[1] at h_l, runs[2] at h_u, and so on."""
    if positive_integer("horizon", horizon) < 2 or not runs or min(runs) < 0 or sum(runs) < 1:
        raise InvalidInputError(f"need a horizon of at least 2 and non-negative runs, got {horizon} and {tuple(runs)}")
    pattern = np.concatenate([np.full(n, periods.h_u if i % 2 == 0 else periods.h_l) for i, n in enumerate(runs)])
    return np.tile(pattern, horizon // len(pattern) + 1)[:horizon]


def worst_sequence(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    horizon: int,
    final_horizon: int | None = None,
) -> BadSequence:
    """Search bursts of h_u between runs of h_l, see `best_runs`.

    The level is that of the best pattern over `final_horizon` samples (by default `horizon`), for which the run lengths
    are adjusted, a lower bound of the gain over all sequences. Raises InvalidInputError if the filter does not fit,
    InfeasibleError if A_f is not Schur stable (the gain is infinite).
    """
    filter_.require_settling(plant)

    @cache
    def gain(sequence: bytes) -> float:
        return sequence_gain(plant, filter_, np.frombuffer(sequence), tolerance=SEARCH_TOLERANCE)[0]

    last = positive_integer("final_horizon", horizon if final_horizon is None else final_horizon)
    best = best_runs(Search(gain, periods, horizon))
    if last != horizon:
        best = adjusted(best, Search(gain, periods, last))
    sequence = repeated(periods, best, last)
    _, w = sequence_gain(plant, filter_, sequence)
    e = simulate_error(plant, filter_, sequence, w)
    return BadSequence(error_ratio(plant, sequence, w, e), sequence, w, e, best)


def error_ratio(plant: SampledPlant, periods: Array, w: Array, e: Array) -> float:
    """||e|| / ||w|| of a simulation: e (K + 1, s), w (K, m)."""
    weights = weights_of(plant, periods)
    last = np.append(weights[1:], weights[-1])
    return float(np.sqrt(np.sum(last[:, None] * e[1:] ** 2) / np.sum(weights[:, None] * w**2)))


@dataclass(frozen=True)
class Search:
    """The gains of runs that are repeated over `horizon` samples; gain: that of the bytes of a sequence."""

    gain: Callable[[bytes], float]
    periods: PeriodRange
    horizon: int

    def best(self, tried: Iterable[Runs]) -> tuple[float, Runs]:
        """The largest gain, and the first runs that have it."""
        values = {runs: self.gain(repeated(self.periods, runs, self.horizon).tobytes()) for runs in tried}
        best = max(values, key=values.__getitem__)
        return values[best], best


def best_runs(search: Search) -> Runs:
    """The runs of the largest gain that the search finds; its horizon is as long as a run may usefully be.

    Constant sequences, short, medium and endless runs of h_l are among the starts.
    """
    horizon = search.horizon
    families: list[list[Runs]] = [[(0, 1)], [(1, 0)]]
    families += [[(burst, rest) for burst in (1, 4, 16)] for rest in (1, horizon // 16, horizon)]
    value, best = search.best([adjusted(search.best(family)[1], search) for family in families])
    while len(best) < MAX_RUNS:
        finer = adjusted(search.best(_interrupted(best))[1], search)
        more, _ = search.best([finer])
        if more <= value * (1 + WORTH):
            return best
        value, best = more, finer
    return best


def adjusted(runs: Runs, search: Search) -> Runs:
    """Steepest ascent over the run lengths with steps of one and of a quarter of the length."""
    value, _ = search.best([runs])
    while True:
        steps = [(i, sign * size) for i, n in enumerate(runs) for sign in (-1, 1) for size in {1, max(1, n // 4)}]
        moves = {(*runs[:i], max(0, runs[i] + step), *runs[i + 1 :]) for i, step in steps}
        more, best = search.best(sorted(move for move in moves if any(move)))
        if more <= value * (1 + IMPROVEMENT):
            return runs
        value, runs = more, best


def _interrupted(runs: Runs) -> list[Runs]:
    """The runs with a few samples of the other kind put into one of them: near its ends, at its quarters or middle."""
    longer = []
    for i, n in enumerate(runs):
        for before in sorted({1, n // 16, n // 4, n // 2, 3 * n // 4, n - n // 16, n - 1} & set(range(n + 1))):
            longer += [(*runs[:i], before, size, n - before, *runs[i + 1 :]) for size in (1, 4, 16)]
    return longer


@dataclass(frozen=True)
class WorstCaseGain:
    """lower: attained by `attack`; upper: proved by `guarantee` for the continuum of periods."""

    attack: BadSequence
    guarantee: Guarantee

    @property
    def lower(self) -> float:
        """||e|| / ||w|| of a sequence and disturbance that are at hand."""
        return self.attack.level

    @property
    def upper(self) -> float:
        """A level that no sequence in the range exceeds."""
        return self.guarantee.level


def worst_case_gain(
    plant: SampledPlant,
    filter_: Estimator,
    periods: PeriodRange,
    *,
    horizon: int,
    final_horizon: int,
    max_leaves: int,
    cuts: Sequence[float] | None = None,
) -> WorstCaseGain:
    """Both ends; see `guaranteed_level` and `worst_sequence` for the effort each argument buys and the errors
    raised."""
    guarantee = guaranteed_level(plant, filter_, periods, max_leaves=max_leaves, cuts=cuts)
    attack = worst_sequence(plant, filter_, periods, horizon=horizon, final_horizon=final_horizon)
    return WorstCaseGain(attack, guarantee)


LEAVES = 4
"""Lyapunov matrices for the level without sensors, whose guarantee gains little by more."""
COMPARED = 9
"""Constant periods at which other estimators are compared."""
FLOOR = 1e-4
"""Relative distance at which the search for the level of no filter ends."""
ANGLES = 181
"""Frequencies between standing still and half the sampling frequency at which a smoother is looked at."""
KNOWN = 1.5
"""Where knowing the period is worth such a factor at constant periods, that is told."""
UNMOVED = 1e-9
"""Share of the disturbance in a pair of state and disturbance below which it belongs to a mode that is not seen."""
SETTLED = 1 - 1e-9
"""Spectral radius from which on a plant counts as one whose state does not decay."""


def beside(
    plant: SampledPlant, filter_: Estimator, periods: PeriodRange, ends: tuple[float, float], *, horizon: int
) -> tuple[float, tuple[Evidence, ...]]:
    """What a level over all sequences is worth: without sensors by the same measure, others at constant periods.

    ends: what a sequence attains, and what none exceeds. The lower one comes back first: a constant period is a
    sequence, too, so that it is at least what the filter has there.
    """
    nodes = periods.nodes(COMPARED if periods.h_l < periods.h_u else 1).tolist()
    gain, filters = float(max(gains_at(plant, [filter_] * len(nodes), nodes))), kalman_filters(plant, nodes)
    kalman = float(max(gains_at(plant, filters, nodes))) if filters else None
    how = f"largest of {len(nodes)} constant periods"
    level = Bracket(min(max(ends[0], gain), ends[1]), ends[1], "")
    facts = [Evidence("level at constant periods", gain, f"this filter; {how}")]
    limit = max(smoother_limit(plant, h) for h in nodes)
    without = without_sensors(plant, periods, level.upper, horizon)
    facts += baselines(level, "all sampling sequences", without=without, kalman=kalman, limit=limit, others=how)
    if not isinstance(filter_, StampedFilter) and kalman is not None and kalman < gain / KNOWN:
        advice = f"Kalman filters that know the period have {kalman / gain:.2g} times this level"
        facts.append(
            Evidence("advice", advice, "if each sample has a time stamp, use `design_stamped`, which takes it")
        )
    return level.lower, tuple(facts)


def without_sensors(plant: SampledPlant, periods: PeriodRange, level: float, horizon: int) -> Bracket | None:
    """The gain of the estimate zero over all sequences; None if it is infinite.

    level: one that it is compared with. Constant periods give the lower end, a bad sequence of `horizon` samples where
    that does not tell them apart.
    """
    lower = zero_at_constant_periods(plant, periods.nodes(COMPARED if periods.h_l < periods.h_u else 1).tolist())
    if lower is None:
        return None
    zero = zero_filter(plant)
    if periods.h_l == periods.h_u:
        return Bracket(lower, periodic_gain(plant, zero, [periods.h_l]).upper, "the exact gain")
    try:
        upper = max(guaranteed_level(plant, zero, periods, max_leaves=LEAVES).level, lower)
    except SolverError:
        upper = np.inf
    if level <= (1 - LITTLE) * lower:
        return Bracket(lower, upper, "constant periods")
    attack = worst_sequence(plant, zero, periods, horizon=horizon).level
    return Bracket(min(max(lower, attack), upper), upper, "a bad sequence")


def zero_filter(plant: SampledPlant) -> StampedFilter:
    """The estimate zero, of error x."""
    return StampedFilter(np.zeros((1, plant.order + plant.B.shape[1], len(plant.C))))


def zero_at_constant_periods(plant: SampledPlant, periods: Sequence[float]) -> float | None:
    """The largest gain of the estimate zero at constant periods; None if it is infinite."""
    if np.max(np.abs(np.linalg.eigvals(plant.discretise(max(periods))[0]))) >= SETTLED:
        return None
    return float(max(gains_at(plant, [zero_filter(plant)] * len(periods), periods)))


def smoother_limit(plant: SampledPlant, h: float) -> float:
    """The gain from disturbances that the sensors do not see to z, at the worst of ANGLES frequencies: what no
    estimator beats at the constant period h, even if it knows all samples, past and future."""
    Phi, Gamma = plant.discretise(h)
    n, (r, m) = plant.order, plant.D.shape
    if m <= r:
        # The sensors tell apart all disturbances.
        return 0.0
    circle = np.exp(1j * np.linspace(0.0, np.pi, ANGLES))[:, None, None]
    state = np.concatenate([circle * np.eye(n) - Phi, np.broadcast_to(plant.C, (ANGLES, r, n))], axis=1)
    drive = np.broadcast_to(np.vstack([-Gamma, plant.D]), (ANGLES, n + r, m))
    # Pairs [x; w] that go on for ever at a frequency while y stays zero.
    unseen = np.linalg.svd(np.concatenate([state, drive], axis=2)).Vh[:, n + r :].conj().mT
    x, w = unseen[:, :n], unseen[:, n:]
    moved = np.linalg.svd(w, compute_uv=False)[:, -1] > UNMOVED
    gains = np.linalg.norm(plant.L @ x[moved] @ np.linalg.pinv(w[moved]), 2, axis=(1, 2))
    return float(np.max(gains, initial=0.0))


def floor_of_any_filter(plant: SampledPlant, periods: PeriodRange, level: float) -> float | None:
    """A level below `level` that no filter has, whatever it knows: the period may be constant, at either end or in the
    middle. None where the Riccati recursion does not tell."""
    floors = []
    for h in sorted(set(periods.nodes(3).tolist())):
        low, high = 0.0, level
        try:
            while high - low > FLOOR * level:
                middle = (low + high) / 2
                low, high = (middle, high) if riccati_filter(plant, h, middle) is None else (low, middle)
        except (InvalidInputError, SolverError):
            continue
        floors.append(low)
    return max(floors, default=None)
