"""A multi-rate estimation problem: plant and schedule together, checked once, before any solver is called."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.schedule import SensingSchedule
from replication.estimation.periodic import PeriodicSystem, Stage
from replication.estimation.riccati import RiccatiMap, apply
from replication.estimation.validation import Array, undetectable_mode

RANK_TOLERANCE = 1e-10


@dataclass(frozen=True)
class MultirateProblem:
    """Design gains L_k for `plant` under `schedule` so that the gain from (d, w) to z = W e is small.

    Raises InvalidInputError if the schedule has another number of sensors than the plant, D has no full row rank on the
    rows that are measured together (a sensor without noise), or an unstable mode is never seen.
    """

    plant: MultiratePlant
    schedule: SensingSchedule

    def __post_init__(self) -> None:
        """Check that the plant and the schedule make a well-posed problem."""
        plant, schedule = self.plant, self.schedule
        if schedule.sensors != plant.sensors:
            raise InvalidInputError(f"the schedule has {schedule.sensors} sensors, the plant has {plant.sensors}")
        for rows in sorted({schedule.measured(k) for k in range(schedule.period)}):
            D = plant.D[list(rows)]
            values = np.linalg.svd(D, compute_uv=False) if D.size else np.zeros(0)
            if rows and (len(values) < len(rows) or values[-1] <= RANK_TOLERANCE * max(values[0], 1e-300)):
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

    def stages(self, level: float = np.inf) -> list[RiccatiMap]:
        """Riccati maps of the filter at `level`: G_k = C_k'(D_k D_k')^-1 C_k - W'W/level^2, H = B_d B_d'.

        At an infinite level they are those of the steady-state Kalman filter.
        """
        plant = self.plant
        base = -plant.W.T @ plant.W / level**2
        H = plant.B_d @ plant.B_d.T
        return [RiccatiMap(plant.A, base + self._information(rows), H) for rows in self.measured_rows()]

    def _information(self, rows: list[int]) -> Array:
        C, D = self.plant.C[rows], self.plant.D[rows]
        return np.asarray(C.T @ np.linalg.solve(D @ D.T, C)) if rows else np.zeros_like(self.plant.A)

    def error_system(self, gains: Array) -> PeriodicSystem:
        """Eqs. (16), (18): e+ = (A - L_k S_k C) e + B_d d - L_k S_k D w, z = W e; gains of shape (N, n, q).

        Columns of L_k of sensors that are not measured at k have no effect. Raises InvalidInputError for another shape.
        """
        gains = np.asarray(gains, dtype=float)
        shape = (self.schedule.period, self.plant.order, self.plant.sensors)
        if gains.shape != shape or not np.all(np.isfinite(gains)):
            raise InvalidInputError(f"gains must be finite with shape (N, n, q) = {shape}, got shape {gains.shape}")
        plant = self.plant
        stages = []
        for rows, L in zip(self.measured_rows(), gains, strict=True):
            gain = L[:, rows]
            B = np.hstack([plant.B_d, -gain @ plant.D[rows]])
            stages.append(Stage(plant.A - gain @ plant.C[rows], B, plant.W, np.zeros((plant.W.shape[0], B.shape[1]))))
        return PeriodicSystem(tuple(stages))

    def gains_at(self, stages: list[RiccatiMap], X: Array) -> tuple[Array, list[Array]]:
        """Gains L_k = A (I + X_k G_k)^-1 X_k C_k'(D_k D_k')^-1 along the Riccati recursion from X, and X_0 ... X_{N-1}.

        Shapes: gains (N, n, q) with zeros for sensors that are not measured.
        """
        plant = self.plant
        gains = np.zeros((self.schedule.period, plant.order, plant.sensors))
        states = []
        for k, (rows, stage) in enumerate(zip(self.measured_rows(), stages, strict=True)):
            states.append(X)
            if rows:
                C, D = plant.C[rows], plant.D[rows]
                predicted = plant.A @ np.linalg.solve(np.eye(plant.order) + X @ stage.G, X)
                gains[k][:, rows] = predicted @ np.linalg.solve(D @ D.T, C).T
            X = apply(stage, X)
        return gains, states
