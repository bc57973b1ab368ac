"""A multi-rate problem: plant and schedule together, checked once, before any solver is called; and scaled for solvers.

Designs depend on the units of the states only by rounding. In coordinates e(k) = T_k s(k) where the error covariance is
about the identity at every phase that rounding is harmless, whatever the units of the plant.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import lcm, prod
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.plants import Signals, numbered
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.linear.riccati import RiccatiMap, following, identity
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.validation import Array, as_array, positive_integer, undetectable_mode

MAX_PERIOD = 100_000
"""Instants after which a schedule must repeat: all methods keep matrices for each of them."""
MAX_OFFSETS = 100_000
"""Sets of offsets that are listed; to compute the optimum of more would take days."""


@dataclass(frozen=True)
class SensingSchedule:
    """Sensor i measures at the instants k with (k - offsets[i]) mod periods[i] == 0.

    periods: N_i >= 1, in base periods. offsets: 0 <= theta_i < N_i, zeros unless given. Raises InvalidInputError for a
    period that is not a whole positive number, an offset out of range, lengths that do not match, or periods whose
    least common multiple exceeds MAX_PERIOD.
    """

    periods: tuple[int, ...]
    offsets: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        entries = _as_tuple("periods", self.periods)
        periods = tuple(positive_integer(f"periods[{i}]", N) for i, N in enumerate(entries))
        if not periods:
            raise InvalidInputError("periods must name at least one sensor")
        if lcm(*periods) > MAX_PERIOD:
            raise InvalidInputError(
                f"periods {periods} repeat together only every {lcm(*periods)} instants, more than {MAX_PERIOD}; "
                "choose periods with common factors, or a longer base period"
            )
        offsets = _as_tuple("offsets", self.offsets) or (0,) * len(periods)
        if len(offsets) != len(periods):
            raise InvalidInputError(f"offsets must have one entry per sensor ({len(periods)}), got {len(offsets)}")
        for i, (N, theta) in enumerate(zip(periods, offsets, strict=True)):
            if isinstance(theta, bool) or not isinstance(theta, (int, np.integer)) or not 0 <= theta < N:
                raise InvalidInputError(f"offsets[{i}] must be a whole number from 0 to {N - 1}, got {theta!r}")
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "offsets", tuple(int(theta) for theta in offsets))

    @property
    def sensors(self) -> int:
        """q, the number of sensors."""
        return len(self.periods)

    @property
    def period(self) -> int:
        """N, the least common multiple of the sensing periods."""
        return lcm(*self.periods)

    @cached_property
    def mask(self) -> npt.NDArray[np.bool_]:
        """Shape (N, q): whether sensor i measures at instant k."""
        instants = np.arange(self.period)[:, None]
        mask: npt.NDArray[np.bool_] = (instants - np.array(self.offsets)) % np.array(self.periods) == 0
        mask.flags.writeable = False
        return mask

    def measured(self, k: int) -> tuple[int, ...]:
        """The sensors that measure at instant k, in order."""
        return self.rows[k % self.period]

    @cached_property
    def rows(self) -> tuple[tuple[int, ...], ...]:
        """The sensors that measure at each instant of the period."""
        return tuple(tuple(np.flatnonzero(row).tolist()) for row in self.mask)

    @cached_property
    def kinds(self) -> tuple[tuple[int, ...], list[int]]:
        """The first instant of each set of sensors that measure together, and the number of the set at each instant."""
        numbers: dict[tuple[int, ...], int] = {}
        which = [numbers.setdefault(rows, len(numbers)) for rows in self.rows]
        return tuple(which.index(kind) for kind in range(len(numbers))), which

    def selection(self, k: int) -> Array:
        """S_k of eq. (4), shape (q, q)."""
        return np.diag(self.mask[k % self.period].astype(float))


def _as_tuple(name: str, value: Any) -> tuple[Any, ...]:
    if not isinstance(value, (Sequence, np.ndarray)) or isinstance(value, str) or np.ndim(value) != 1:
        raise InvalidInputError(f"{name} must be a sequence with one entry per sensor, got {value!r}")
    return tuple(value)


def distinct_offsets(periods: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Offsets with theta_1 = 0, one for each schedule that differs by more than a shift of the origin.

    For two sensors these are theta_2 = 0 ... gcd(N_1, N_2) - 1. Raises InvalidInputError for a period not whole, or
    periods with more than MAX_OFFSETS sets of offsets.
    """
    reference = SensingSchedule(_as_tuple("periods", periods))
    count = prod(reference.periods[1:])
    if count > MAX_OFFSETS:
        raise InvalidInputError(
            f"periods {reference.periods} leave {count} sets of offsets, more than {MAX_OFFSETS}; fix some of the "
            "offsets yourself and compare the optima of the others"
        )
    for tail in product(*(range(N) for N in reference.periods[1:])):
        offsets = (0, *tail)
        # A shift of the origin by a multiple of N_1 keeps theta_1 = 0; the least of the shifted offsets stands for all.
        shifted = (
            tuple((theta + s) % N for theta, N in zip(offsets, reference.periods, strict=True))
            for s in range(0, reference.period, reference.periods[0])
        )
        if offsets == min(shifted):
            yield offsets


class Whitened(NamedTuple):
    """At each phase A (N, n, n), B (N, n, m) and the whitened measurements C (N, q, n), zero where a sensor has none.

    Whitening: with the triangular `roots` R_k (N, q, q), D_k D_k' = R_k' R_k, the rows are R_k'^-1 C_k, their noise is
    white with unit intensity, and their gain is R_k'-fold that of the measurements.

    Of correlated noise, what the measurements tell is taken out of the plant first: A and B are those of the rest, and
    `injected` (N, n, q) are the gains of the measurements that do it. rows: the sensors that measure.
    """

    A: Array
    B: Array
    C: Array
    roots: Array
    injected: Array
    rows: tuple[tuple[int, ...], ...]


RANK_TOLERANCE = 1e-10
DYING = 1e-6
"""Distance of all multipliers from the unit circle from which on none counts as unstable for rounding."""


@dataclass(frozen=True)
class MultirateProblem:
    """Design gains L_k for `plant` under `schedule` so that the gain from (d, w) to z = W e is small.

    Raises InvalidInputError if plant or schedule are of another type, they have different numbers of sensors, D has no
    full row rank on the rows that are measured together (a sensor without noise), or an unstable mode is never seen.
    """

    plant: MultiratePlant
    schedule: SensingSchedule

    def __post_init__(self) -> None:
        plant, schedule = self.plant, self.schedule
        _of_type("plant", plant, MultiratePlant, "MultiratePlant(...) or MultiratePlant.from_statespace(...)")
        _of_type("schedule", schedule, SensingSchedule, "SensingSchedule(periods, offsets)")
        if schedule.sensors != plant.sensors:
            raise InvalidInputError(f"the schedule is of {schedule.sensors}, the plant of {plant.sensors} sensors")
        for rows in sorted(set(schedule.rows)):
            if rows and not _full_row_rank(plant.D[list(rows)]):
                raise InvalidInputError(
                    f"D must have full row rank on the sensors measured together, {rows}: give each its own noise"
                )
        if (mode := unseen_mode(plant, schedule.rows)) is not None:
            raise InvalidInputError(
                f"the pair is not detectable: the mode with multiplier {mode:.6g} over one period is never seen; "
                "measure it or change the periods and offsets"
            )

    def measured_rows(self) -> list[list[int]]:
        """For each phase, the sensors that are measured."""
        return [list(rows) for rows in self.schedule.rows]

    @cached_property
    def whitened(self) -> Whitened:
        """What does not depend on the coordinates of the states."""
        plant, (first, which) = self.plant, self.schedule.kinds
        due = self.schedule.mask[list(first), :, None]
        # A sensor that does not measure has a noise of its own in the place of its rows, and tells nothing.
        C, D = due * plant.C, np.concatenate([due * plant.D, ~due * np.eye(plant.sensors)], axis=-1)
        # The triangular factor of D_k' avoids forming D_k D_k', which would square its condition number.
        factor = np.linalg.qr(D.mT)
        roots = np.where(due == due.mT, factor.R, 0.0)
        A, B, J = (np.broadcast_to(part, (len(first), *part.shape)) for part in (plant.A, plant.B_d, 0.0 * plant.C.T))
        if plant.correlated:
            # What the measurements tell of the noise, J = B_w D_k'(D_k D_k')^-1, is taken out of the plant.
            J = np.linalg.solve(roots, (plant.B_w @ factor.Q[:, : plant.B_w.shape[1]]).mT).mT * due.mT
            A, B = plant.A - J @ C, np.concatenate([B, plant.B_w - J @ plant.D], axis=-1)
        rows = np.asarray(np.linalg.solve(roots.mT, C), dtype=float)
        return Whitened(A[which], B[which], rows[which], roots[which], J[which], self.schedule.rows)

    def checked(self, gains: npt.ArrayLike) -> Array:
        """Gains as an array (N, n, q); raises InvalidInputError for another shape."""
        shape = (self.schedule.period, self.plant.order, self.plant.sensors)
        return as_array("gains", gains, shape, axes="(N, n, q)")

    def without_sensors(self) -> PeriodicSystem:
        """The plant alone, from (d, w) to W x: the error of the estimate zero."""
        return error_under(self.plant, [0.0 * self.plant.C.T])

    def error_system(self, gains: Array) -> PeriodicSystem:
        """Eqs. (16), (18): e+ = (A - L_k S_k C) e + B_d d + (B_w - L_k S_k D) w, z = W e; gains (N, n, q).

        Columns of L_k of sensors that are not measured at k have no effect. Raises InvalidInputError for another shape.
        """
        return error_under(self.plant, self.checked(gains) * self.schedule.mask[:, None, :])


def closed_loop(plant: MultiratePlant, gain: Array) -> tuple[Array, Array]:
    """A - L C and [B_d, B_w - L D] of one instant; L (n, q) is zero for samples that do not come."""
    noise = -gain @ plant.D
    return plant.A - gain @ plant.C, np.hstack([plant.B_d, noise + plant.B_w if plant.correlated else noise])


def error_under(plant: MultiratePlant, gains: Iterable[Array]) -> PeriodicSystem:
    """From (d, w) to W e under one gain (n, q) after the other, zero for samples that do not come."""
    loops = [closed_loop(plant, gain) for gain in gains]
    direct = np.zeros((len(plant.W), loops[0][1].shape[1]))
    return PeriodicSystem(tuple(Stage(A, B, plant.W, direct) for A, B in loops))


def unseen_mode(plant: MultiratePlant, measured: Iterable[Sequence[int]]) -> complex | None:
    """An unstable mode over some instants that the sensors measured at each never see, or None."""
    transition, outputs = np.eye(plant.order), []
    for rows in measured:
        outputs.append(plant.C[list(rows)] @ transition)
        transition = plant.A @ transition
    if np.abs(np.linalg.eigvals(transition)).max() < 1 - DYING:
        return None  # whatever is not seen dies out
    return undetectable_mode(transition, np.vstack(outputs), discrete=True)


def require_problem(problem: Any) -> None:
    """Raise InvalidInputError unless `problem` is a MultirateProblem."""
    _of_type("problem", problem, MultirateProblem, "MultirateProblem(plant, schedule)")


def disturbances(plant: MultiratePlant, names: Signals) -> tuple[str, ...]:
    """Names of the columns of (d, w): of inputs where they are known, of sensors where each has noise of its own."""
    processes, (sensors, noises) = plant.B_d.shape[1], plant.D.shape
    d = names.disturbances if len(names.disturbances) == processes else numbered("d", processes)
    diagonal = sensors == noises and not np.any(plant.D - np.diag(np.diag(plant.D)))
    return (*d, *(tuple(f"noise of {name}" for name in names.measurements) if diagonal else numbered("w", noises)))


def _of_type(name: str, value: Any, kind: type, how: str) -> None:
    if not isinstance(value, kind):
        raise InvalidInputError(f"{name} must be a {kind.__name__}, got {type(value).__name__}; build it by {how}")


def _full_row_rank(D: Array) -> bool:
    """Whether the rows of D are linearly independent; each row is normalised, for the unit of a sensor is arbitrary."""
    norms = np.linalg.norm(D, axis=1, keepdims=True)
    return bool(np.all(norms > 0)) and np.linalg.matrix_rank(D / norms, tol=RANK_TOLERANCE) == len(D)


@dataclass(frozen=True, eq=False)
class ScaledProblem:
    """A problem in coordinates s(k) = T_k^-1 e(k): T, A (N, n, n), B (N, n, m), W (N, n_z, n), C and the rest as
    `Whitened`; information C_k'C_k (N, n, n)."""

    T: Array
    A: Array
    B: Array
    W: Array
    C: Array
    information: Array
    whitened: Whitened

    def maps(self, level: float | Array = np.inf) -> RiccatiMap:
        """Riccati maps of the filter at `level`: G_k = C_k'(D_k D_k')^-1 C_k - W'W/level^2, H = B_d B_d'.

        At an infinite level they are those of the Kalman filter. Of several levels, side by side, the fields have the
        shape (N, levels, n, n).
        """
        each = np.s_[:, None] if np.ndim(level) else np.s_[:]
        W = self.W[each] / np.asarray(level)[..., None, None]
        G = self.information[each] - W.mT @ W
        A, H = (np.broadcast_to(part[each], G.shape) for part in (self.A, self.B @ self.B.mT))
        return RiccatiMap(A, G, H)

    def corrected(self, states: Array, maps: RiccatiMap) -> Array:
        """(I + X_k G_k)^-1 X_k for each phase, shape (N, n, n)."""
        return np.asarray(np.linalg.solve(identity(self.A.shape[-1]) + states @ maps.G, states))

    def closed_loop(self, corrected: Array) -> Array:
        """A_k - L_k C_k for each phase, shape (N, n, n), all gains included; of several cases (N, cases, n, n)."""
        A, information = (_beside(part, corrected) for part in (self.A, self.information))
        return np.asarray(A - A @ corrected @ information)

    def largest_weighted(self, states: Array) -> Any:
        """max_k lambda_max(W X_k W'); of states (N, cases, n, n) one for each case."""
        W = _beside(self.W, states)
        return np.maximum(0.0, np.linalg.eigvalsh(W @ states @ W.mT)[..., -1].max(axis=0))

    def whitened_gains(self, corrected: Array) -> Array:
        """Gains on the whitened rows, A_k (I + X_k G_k)^-1 X_k C_k' (N, n, q)."""
        return np.asarray(self.A @ corrected @ self.C.mT)

    def gains(self, corrected: Array) -> Array:
        """Gains L_k in the coordinates of the plant (N, n, q), zero for sensors that are not measured."""
        gains = following(self.T) @ self.whitened_gains(corrected)
        return np.asarray(np.linalg.solve(self.whitened.roots, gains.mT).mT + self.whitened.injected)


def _beside(part: Array, states: Array) -> Array:
    """One matrix per phase, to go with the states of one case or of several."""
    return part if states.ndim == part.ndim else part[:, None]


def scaled_problem(problem: MultirateProblem, T: Array) -> ScaledProblem:
    """`problem` in the coordinates s(k) = T_k^-1 e(k); T of shape (N, n, n)."""
    whitened, n = problem.whitened, problem.plant.order
    moved = np.linalg.solve(following(T), np.concatenate([whitened.A @ T, whitened.B], axis=-1))
    C = whitened.C @ T
    return ScaledProblem(T, moved[..., :n], moved[..., n:], problem.plant.W @ T, C, C.mT @ C, whitened)
