"""A multi-rate estimation problem: plant and schedule together, checked once, before any solver is called."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from replication.errors import InvalidInputError
from replication.estimation.api.signals import numbered
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.schedule import SensingSchedule
from replication.estimation.validation import Array, as_array, undetectable_mode

RANK_TOLERANCE = 1e-10


@dataclass(frozen=True)
class MultirateProblem:
    """Design gains L_k for `plant` under `schedule` so that the gain from (d, w) to z = W e is small.

    Raises InvalidInputError if plant or schedule are of another type, they have different numbers of sensors, D has no
    full row rank on the rows that are measured together (a sensor without noise), or an unstable mode is never seen.
    """

    plant: MultiratePlant
    schedule: SensingSchedule

    def __post_init__(self) -> None:
        """Check that the plant and the schedule make a well-posed problem."""
        plant, schedule = self.plant, self.schedule
        _of_type("plant", plant, MultiratePlant, "MultiratePlant(...) or MultiratePlant.from_statespace(...)")
        _of_type("schedule", schedule, SensingSchedule, "SensingSchedule(periods, offsets)")
        if schedule.sensors != plant.sensors:
            raise InvalidInputError(f"the schedule has {schedule.sensors} sensors, the plant has {plant.sensors}")
        for rows in sorted({schedule.measured(k) for k in range(schedule.period)}):
            if rows and not _full_row_rank(plant.D[list(rows)]):
                raise InvalidInputError(
                    f"D must have full row rank on the sensors measured together, {rows}: give each its own noise"
                )
        mode = undetectable_mode(*self._lifted_pair(), discrete=True)
        if mode is not None:
            raise InvalidInputError(
                f"the pair is not detectable: the mode with multiplier {mode:.6g} over one period is never seen; "
                "measure it or change the periods and offsets"
            )

    def _lifted_pair(self) -> tuple[Array, Array]:
        """(A^N, the outputs of one period stacked): detectable iff the periodic pair is."""
        transition, outputs = np.eye(self.plant.order), []
        for rows in self.measured_rows():
            outputs.append(self.plant.C[rows] @ transition)
            transition = self.plant.A @ transition
        return transition, np.vstack(outputs)

    def measured_rows(self) -> list[list[int]]:
        """For each phase, the sensors that are measured."""
        return [list(self.schedule.measured(k)) for k in range(self.schedule.period)]

    def checked(self, gains: npt.ArrayLike) -> Array:
        """Gains as an array (N, n, q); raises InvalidInputError for another shape."""
        shape = (self.schedule.period, self.plant.order, self.plant.sensors)
        return as_array("gains", gains, shape, axes="(N, n, q)")

    def disturbances(self) -> tuple[str, ...]:
        """What the columns of the disturbance (d, w) are called."""
        return (*numbered("d", self.plant.B_d.shape[1]), *numbered("w", self.plant.D.shape[1]))

    def without_sensors(self) -> PeriodicSystem:
        """The plant alone, from (d, w) to W x: the error of the estimate zero."""
        plant = self.plant
        drive = plant.drive
        return PeriodicSystem((Stage(plant.A, drive, plant.W, np.zeros((len(plant.W), drive.shape[1]))),))

    def error_system(self, gains: Array) -> PeriodicSystem:
        """Eqs. (16), (18): e+ = (A - L_k S_k C) e + B_d d + (B_w - L_k S_k D) w, z = W e; gains (N, n, q).

        Columns of L_k of sensors that are not measured at k have no effect. Raises InvalidInputError for another shape.
        """
        gains, plant = self.checked(gains), self.plant
        stages = []
        for rows, L in zip(self.measured_rows(), gains, strict=True):
            gain = L[:, rows]
            noise = -gain @ plant.D[rows]
            B = np.hstack([plant.B_d, noise + plant.B_w if plant.correlated else noise])
            stages.append(Stage(plant.A - gain @ plant.C[rows], B, plant.W, np.zeros((plant.W.shape[0], B.shape[1]))))
        return PeriodicSystem(tuple(stages))


def require_problem(problem: Any) -> None:
    """Raise InvalidInputError unless `problem` is a MultirateProblem."""
    _of_type("problem", problem, MultirateProblem, "MultirateProblem(plant, schedule)")


def observer_system(problem: MultirateProblem, gains: npt.ArrayLike) -> PeriodicSystem:
    """The observer, eq. (15): x^+ = A x^ + B_u u + L_k S_k (y - C x^ - D_u u), from (u, y) to z^ = W x^.

    gains (N, n, q).
    y has all q sensors at every instant; entries of those that do not measure have no effect. Raises InvalidInputError
    for what is not a problem, or gains of another shape.
    """
    require_problem(problem)
    plant = problem.plant
    stages = []
    for k, L in enumerate(problem.checked(gains)):
        used = L @ problem.schedule.selection(k)
        inputs = np.hstack([plant.B_u - used @ plant.D_u, used])
        stages.append(Stage(plant.A - used @ plant.C, inputs, plant.W, np.zeros((len(plant.W), inputs.shape[1]))))
    return PeriodicSystem(tuple(stages))


def _of_type(name: str, value: Any, wanted: type, how: str) -> None:
    if not isinstance(value, wanted):
        raise InvalidInputError(f"{name} must be a {wanted.__name__}, got {type(value).__name__}; build it by {how}")


def _full_row_rank(D: Array) -> bool:
    """Whether the rows of D are linearly independent; each row is normalised, for the unit of a sensor is arbitrary."""
    norms = np.linalg.norm(D, axis=1, keepdims=True)
    if D.shape[1] < len(D) or not np.all(norms > 0):
        return False
    return bool(np.linalg.svd(D / norms, compute_uv=False)[-1] > RANK_TOLERANCE)
