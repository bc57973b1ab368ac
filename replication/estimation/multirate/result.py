"""Multi-rate observers: gains for a problem, what they guarantee, and how they run; made by exact norms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from replication.errors import InfeasibleError
from replication.estimation.api.design import Design, Solution
from replication.estimation.api.phase import Phase, Recursion
from replication.estimation.api.results import Evidence, baselines
from replication.estimation.api.signals import each_instant
from replication.estimation.api.tradeoff import Goal, TradeOff
from replication.estimation.linear.norms import gain_if_finite, l2_gain, settles, white_noise_variance
from replication.estimation.linear.periodic import PeriodicSystem, lifted_statespace
from replication.estimation.multirate.h2.filtering import smoothing_limit
from replication.estimation.multirate.h2.tradeoff import balanced, rms_error, tradeoff
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.optimum import DESIGN_MARGIN, Optimum, optimum, riccati_design
from replication.estimation.multirate.problem import MultirateProblem, disturbances, observer_system
from replication.estimation.validation import Array

if TYPE_CHECKING:
    import control

SIMPLER = "the Kalman filter has the least mean error: goal='h2', or goal='mixed' for something of both"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MultirateResult(Design):
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
        if goal is Goal.HINF:
            aim = best.upper * (1 + DESIGN_MARGIN) if level is None else level
            return Solution({"L": riccati_design(problem, aim).gains})
        central = balanced(problem, best) if level is None else riccati_design(problem, level)
        aimed = central.level if np.isfinite(central.level) else "infinite"
        asked = Evidence("level of the design", aimed, "least entropy")
        return Solution({"L": central.gains}, (asked, *mean_error_facts(problem, central.gains)))

    def error_system(self) -> PeriodicSystem:
        """Eqs. (16), (18)."""
        return self.problem.error_system(self.gains["L"])

    def phases(self) -> Recursion:
        """Eq. (15), x^(k+1) = A x^ + B_u u + L_k S_k (y - C x^ - D_u u).

        It keeps what late samples need and gives the estimate of the present state.
        """
        plant, mask = self.problem.plant, self.problem.schedule.mask
        present = plant.order - plant.under_way
        shown, phases = np.eye(present, plant.order), []
        for gain, due in zip(self.gains["L"], mask, strict=True):
            L = gain * due
            phases.append(Phase(plant.A - L @ plant.C, plant.B_u - L @ plant.D_u, L, shown, due))
        return Recursion(phases, present, [plant.C] * len(phases), plant.D_u)

    def disturbances(self) -> tuple[str, ...]:
        """Of the process, then of the sensors."""
        return disturbances(self.problem.plant, self.signals)

    def to_statespace(self) -> control.StateSpace:
        """The observer over one period N of the schedule.

        Returns
        -------
        control.StateSpace
            Inputs (u, y) of all N instants, outputs W x^; sampling period N dt. With N = 1 it has the names of the
            plant; with N > 1 `@k` is added for instant k.
        """
        system = observer_system(self.problem, self.gains["L"])
        lifted = lifted_statespace(system, dt=self.problem.plant.dt)
        inputs = [*self.signals.inputs, *self.signals.measurements]
        outputs = [f"estimate of {name}" for name in self.signals.outputs]
        several = system.period > 1
        lifted.set_inputs(each_instant(inputs, system.period) if several else inputs)
        lifted.set_outputs(each_instant(outputs, system.period) if several else outputs)
        lifted.set_states(list(self.signals.states))
        return lifted

    def tradeoff(self, points: int = 12) -> TradeOff:
        """What a smaller guaranteed gain costs in mean error, for this plant and schedule.

        Parameters
        ----------
        points : int
            Number of designs, from the least level to the Kalman filter; at least 2.

        Returns
        -------
        TradeOff
            Level, exact gain and exact rms error of each; it prints and plots itself.

        Raises
        ------
        InvalidInputError
            `points` is no whole number from 2 to 1000.
        """
        return tradeoff(self.problem, optimum(self.problem), points)


def facts(result: MultirateResult, error: PeriodicSystem, best: Optimum, *, alone: bool) -> tuple[Evidence, ...]:
    """What is known of gains beside the optimum; alone: nothing else is told of their mean error."""
    problem, plant = result.problem, result.problem.plant
    bound = "non-causal bound: no smoother does better" if best.limited_by == "noncausal" else "Riccati condition"
    late = (Evidence("samples under way", plant.under_way, "states for the latency"),) if plant.under_way else ()
    return (
        Evidence("optimum", best.value, f"least gain of any observer; {bound}"),
        Evidence("optimum lies above", best.lower, bound),
        Evidence("spectral radius over one period", error.spectral_radius(), "eigenvalues of the monodromy matrix"),
        Evidence("mean error variance", white_noise_variance(error), "periodic Lyapunov equation, white unit noise"),
        Evidence("schedule", f"periods {problem.schedule.periods}, offsets {problem.schedule.offsets}", "as given"),
        Evidence("base period", plant.dt, "as given", "s"),
        *late,
        *baselines(
            result.value,
            "exact gain",
            without=gain_if_finite(problem.without_sensors()),
            kalman=l2_gain(problem.error_system(kalman_design(problem).gains)).upper,
            limit=best.noncausal.upper,
            simpler=SIMPLER if alone else "",
        ),
    )


def mean_error_facts(problem: MultirateProblem, gains: Array) -> tuple[Evidence, ...]:
    """The root-mean-square error of gains (N, n, q), beside those without sensors, of the filter and of a smoother."""
    kalman = kalman_design(problem)
    own, least = rms_error(problem, gains), rms_error(problem, kalman.gains)
    W = problem.plant.W
    limit = float(np.sqrt(np.mean(np.trace(W @ smoothing_limit(problem, kalman.X) @ W.T, axis1=1, axis2=2))))
    alone = problem.without_sensors()
    without = float(np.sqrt(white_noise_variance(alone))) if settles(alone) else None
    how = "periodic Lyapunov equation"
    return (
        Evidence("rms error", own, f"white noise of unit intensity; {how}"),
        *baselines(own, how, what="rms error", without=without, kalman=least, limit=limit),
    )
