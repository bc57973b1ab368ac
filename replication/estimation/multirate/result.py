"""Multi-rate observers: gains for a problem, what they guarantee, and how they run; made by exact norms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from replication.errors import InfeasibleError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.api.running import statespace
from replication.estimation.api.shown import Goal, Measures, Traded, balanced
from replication.estimation.linear.norms import gain_if_finite, l2_gain, rms_if_finite, white_noise_variance
from replication.estimation.linear.periodic import PeriodicSystem
from replication.estimation.multirate.kalman import (
    RiccatiDesign,
    filter_gains,
    kalman_centre,
    kalman_design,
    smoothing_limit,
)
from replication.estimation.multirate.optimum import DESIGN_MARGIN, Optimum, central, optimum
from replication.estimation.multirate.problem import MultirateProblem, disturbances
from replication.estimation.multirate.running import KalmanFilter, StartingFilter
from replication.estimation.validation import Array, StateSpace, at_most, positive_integer


def rms_error(problem: MultirateProblem, gains: Array) -> float:
    """Root of the mean square of W e over a period, for white noise of unit intensity; gains (N, n, q)."""
    return float(np.sqrt(white_noise_variance(problem.error_system(gains))))


def _designs(problem: MultirateProblem) -> tuple[Callable[[float], RiccatiDesign], Callable[[float], Measures]]:
    """The central gains at a level, and their exact gain and rms error."""
    centre = kalman_centre(problem)

    def design(level: float) -> RiccatiDesign:
        return central(centre, level) if np.isfinite(level) else kalman_design(problem)

    def measures(level: float) -> Measures:
        gains = design(level).gains
        return l2_gain(problem.error_system(gains)).upper, rms_error(problem, gains)

    return design, measures


SIMPLER = "the Kalman filter has the least mean error: goal='h2', or goal='mixed' for something of both"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MultirateResult(Design, Traded):
    """A multi-rate observer: gains L of shape (phase, state, sensor).

    Attributes
    ----------
    problem : MultirateProblem
        Plant and schedule for which the level holds.
    """

    method: str = "multirate"
    quantity: str = "l2 gain from process and sensor noise (d, w) to the weighted estimation error W e"
    axes: Mapping[str, str] = field(default_factory=lambda: {"L": "(phase, state, sensor)"})
    problem: MultirateProblem

    @classmethod
    def solve(
        cls, problem: MultirateProblem, *, best: Optimum, goal: Goal = Goal.HINF, level: float | None = None
    ) -> Solution:
        """The central gains: at `level`, just above the least one, or at the level that balances gain and mean error.

        Raises InfeasibleError if `level` is not above the optimum `best`.
        """
        if level is not None and level <= best.lower:
            raise InfeasibleError(
                f"no observer has a gain below {level!r}: the least is {best.value:.6g}; ask for more"
            )
        design, measures = _designs(problem)
        aim = best.upper * (1 + DESIGN_MARGIN) if level is None else level
        if goal is Goal.HINF:
            return Solution({"L": design(aim).gains}, own={"best": best})
        if level is None:
            aim = balanced(aim, best.value, measures)
        fact = Evidence("level of the design", aim if np.isfinite(aim) else "infinite", "least entropy")
        gains = design(aim).gains
        return Solution({"L": gains}, (fact, *mean_error_facts(problem, gains)), {"best": best})

    def error_system(self) -> PeriodicSystem:
        """Eqs. (16), (18)."""
        return self.problem.error_system(self.gains["L"])

    def facts(self, error: PeriodicSystem, solution: Solution) -> tuple[Evidence, ...]:
        """Beside the optimum, which the solution holds as "best"."""
        problem, plant, best = self.problem, self.problem.plant, solution.own["best"]
        bound = "non-causal bound: no smoother does better" if best.limited_by == "noncausal" else "Riccati condition"
        late = (Evidence("samples under way", plant.under_way, "states for the latency"),) if plant.under_way else ()
        return (
            Evidence("optimum", best.value, f"least gain of any observer; {bound}"),
            Evidence("optimum lies above", best.lower, bound),
            *super().facts(error, solution._replace(evidence=())),
            Evidence("schedule", f"periods {problem.schedule.periods}, offsets {problem.schedule.offsets}", "as given"),
            Evidence("base period", plant.dt, "as given", "s"),
            *late,
            *baselines(
                self.value,
                "exact gain",
                without=gain_if_finite(problem.without_sensors()),
                kalman=l2_gain(problem.error_system(kalman_design(problem).gains)).upper,
                limit=best.noncausal.upper,
                simpler="" if solution.evidence else SIMPLER,
            ),
            *solution.evidence,
        )

    def phases(self) -> Recursion:
        """Eq. (15), x^(k+1) = A x^ + B_u u + L_k S_k (y - C x^ - D_u u).

        It keeps what late samples need and gives the estimate of the present state.
        """
        plant, mask = self.problem.plant, self.problem.schedule.mask
        present = plant.order - plant.under_way
        shown, used = np.eye(present, plant.order), self.gains["L"] * mask[:, None, :]
        phases = [
            Phase(plant.A - L @ plant.C, plant.B_u - L @ plant.D_u, L, shown, due)
            for L, due in zip(used, mask, strict=True)
        ]
        return Recursion(phases, present, [plant.C] * len(phases), plant.D_u)

    def disturbances(self) -> tuple[str, ...]:
        """Of the process, then of the sensors."""
        return disturbances(self.problem.plant, self.signals)

    def to_statespace(self) -> StateSpace:
        """The observer over one period N of the schedule, from (u, y) of all instants to W x^.

        Its sampling period is N dt; `@k` is added to the names for instant k unless N = 1.
        """
        phases = [replace(phase, readout=self.problem.plant.W) for phase in self.phases().phases]
        lifted = statespace(phases, replace(self.signals, states=self.signals.outputs))
        lifted.set_states(list(self.signals.states))
        return lifted

    def designs(self) -> tuple[float, Callable[[float], Measures]]:
        """Central gains, from the least level on."""
        return optimum(self.problem).upper * (1 + DESIGN_MARGIN), _designs(self.problem)[1]


def mean_error_facts(problem: MultirateProblem, gains: Array) -> tuple[Evidence, ...]:
    """The root-mean-square error of gains (N, n, q), beside those without sensors, of the filter and of a smoother."""
    kalman = kalman_design(problem)
    error, least = rms_error(problem, gains), rms_error(problem, kalman.gains)
    W = problem.plant.W
    limit = float(np.sqrt(np.mean(np.trace(W @ smoothing_limit(problem, kalman.X) @ W.T, axis1=1, axis2=2))))
    how = "periodic Lyapunov equation"
    without = rms_if_finite(problem.without_sensors())
    return (
        Evidence("rms error", error, f"white noise of unit intensity; {how}"),
        *baselines(error, how, what="rms error", without=without, kalman=least, limit=limit),
    )


LONGEST_LAG = 1000
AXES = {
    "L": "(phase, state, sensor)",
    "K": "(phase, state, sensor)",
    "P": "(phase, state, state)",
    "F": "(phase, state, state)",
    "V": "(phase, sensor, sensor)",
}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class KalmanResult(MultirateResult):
    """A periodic Kalman filter.

    Its gains are L of the prediction x^(k+1|k) = A x^(k|k-1) + B_u u + L v with the innovation v, and K of the filtered
    estimate x^(k|k) = x^(k|k-1) + K v; P and F are the covariances of the errors of both, x^(k|k-1) and x^(k|k), and V
    is that of v (zero for sensors that do not measure).

    Attributes
    ----------
    start : array (n, n) or None
        Covariance P0 of the error of the start, if it was given.
    """

    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    start: Array | None = None

    @classmethod
    def solve(cls, problem: MultirateProblem, *, best: Optimum, **aims: Any) -> Solution:
        """The steady state of the filter, with its covariances."""
        kalman = kalman_design(problem)
        gains = filter_gains(problem, kalman.X)
        arrays = {
            "L": kalman.gains,
            "K": gains.K[:, 0],
            "P": gains.predicted,
            "F": gains.filtered,
            "V": gains.innovation,
        }
        return Solution(arrays, mean_error_facts(problem, kalman.gains), {"best": best})

    def filter(self, *, lag: int = 0, P0: Any = None, gate: float | None = None) -> KalmanFilter | StartingFilter:
        """The filter to run in a loop; its `step` gives x^(k|k), x^(k+1|k), their covariances and the innovation.

        Parameters
        ----------
        lag : int
            It also looks back: x^(k-lag|k).
        P0 : array (n, n), optional
            Covariance of the error of the start; that of the design unless given.
        gate : float, optional
            Beyond which a measurement is left out, and counted by `gated`: below 1 the probability with which a good
            one passes, from 1 on standard deviations of its innovation.

        Returns
        -------
        KalmanFilter or StartingFilter
            With the gains of the steady state, or with those that begin at P0.

        Raises
        ------
        InvalidInputError
            P0 is no covariance, the lag is no whole number from 0 to 1000, or the gate neither of the two.
        """
        count = 0 if type(lag) is int and lag == 0 else at_most("lag", lag, LONGEST_LAG)
        start = self.start if P0 is None else P0
        if start is not None:
            return StartingFilter(self.problem, start, count, gate).named(self.signals)
        gains = filter_gains(self.problem, self.gains["P"], count)
        return KalmanFilter(self.problem, gains, gate).named(self.signals)

    def covariances(self, steps: int, *, P0: Any = None) -> tuple[Array, Array]:
        """Covariances of the errors over time, from the start on.

        Parameters
        ----------
        steps : int
            Number of instants.
        P0 : array (n, n), optional
            Covariance of the error of the start; that of the design, or the steady state, unless given.

        Returns
        -------
        predicted, filtered : array (steps, n, n)
            Of x^(k|k-1) and x^(k|k), k = 0, 1, ...

        Raises
        ------
        InvalidInputError
            P0 is no covariance, or `steps` no whole positive number.
        """
        count = positive_integer("steps", steps)
        start = self.start if P0 is None else P0
        run = StartingFilter(self.problem, self.gains["P"][0] if start is None else start)
        known, mask = np.zeros(self.problem.plant.B_u.shape[1]), self.problem.schedule.mask
        records = [run.step(known, np.where(mask[k % len(mask)], 0.0, np.nan)) for k in range(count)]
        predicted = [run.start, *(step.predicted_covariance for step in records[:-1])]
        return np.stack(predicted), np.stack([step.covariance for step in records])
