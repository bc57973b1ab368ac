"""What multi-rate gains guarantee, as a result: observer, state space, plot; made from gains by exact norms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.drawing.panel import Panel
from replication.estimation.api.baselines import baselines
from replication.estimation.api.phase import Phase
from replication.estimation.api.results import EXACT_GAIN, Bracket, Evidence, GainResult
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.api.shown import frozen
from replication.estimation.api.signals import Signals, each_instant
from replication.estimation.api.tradeoff import TradeOff
from replication.estimation.linear.norms import gain_curve, gain_if_finite, l2_gain
from replication.estimation.linear.periodic import lifted_statespace
from replication.estimation.multirate.h2.tradeoff import tradeoff
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.optimum import Optimum, optimum
from replication.estimation.multirate.problem import MultirateProblem, observer_system
from replication.estimation.multirate.simulation import white_noise_variance

if TYPE_CHECKING:
    import control

SIMPLER = "the Kalman filter has the least mean error: goal='h2', or goal='mixed' for something of both"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MultirateResult(GainResult):
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

    def observer(self) -> PeriodicObserver:
        """The observer of eq. (15), x^(k+1) = A x^ + B_u u + L_k S_k (y - C x^ - D_u u), to run in a loop.

        Returns
        -------
        PeriodicObserver
            Its `step` takes y of all q sensors; only those that are due are looked at. It keeps what late samples
            need and gives the estimate of the present state.
        """
        plant, schedule = self.problem.plant, self.problem.schedule
        used = [L * due for L, due in zip(self.gains["L"], schedule.mask, strict=True)]
        shown = np.eye(plant.order - plant.under_way, plant.order)
        phases = [
            Phase(plant.A - L @ plant.C, plant.B_u - L @ plant.D_u, L, shown, due)
            for L, due in zip(used, schedule.mask, strict=True)
        ]
        return PeriodicObserver(phases, [plant.C] * len(phases), plant.D_u).named(self.signals)

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

    def estimator(self) -> control.StateSpace:
        """The observer over one period of its schedule, from the known inputs and y of all instants to x^.

        Returns
        -------
        control.StateSpace
            Sampling period N dt; `@k` is added to the names for instant k if N > 1. It is what `observer()` does.
        """
        return self.observer().to_statespace()

    def panels(self) -> tuple[Panel, ...]:
        """The gain over the frequency, with the guaranteed level."""
        duration = self.problem.plant.dt * self.problem.schedule.period
        frequencies, gains = gain_curve(self.problem.error_system(self.gains["L"]), duration)
        label = "frequency (rad/s, folded at the period of the schedule)"
        return self._panel(frequencies, label, "largest gain to the error", {"gain": gains})

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


def result_of(
    problem: MultirateProblem, signals: Signals, gains: Any, best: Optimum, further: tuple[Evidence, ...] = ()
) -> MultirateResult:
    """The exact gain of `gains` (N, n, q) and what else is known of them, beside the optimum; `further` comes last."""
    error = problem.error_system(gains)
    exact = l2_gain(error)
    bound = "non-causal bound: no smoother does better" if best.limited_by == "noncausal" else "Riccati condition"
    evidence = (
        Evidence("optimum", best.value, f"least gain of any observer; {bound}"),
        Evidence("optimum lies above", best.lower, bound),
        Evidence("spectral radius over one period", error.spectral_radius(), "eigenvalues of the monodromy matrix"),
        Evidence("mean error variance", white_noise_variance(error), "periodic Lyapunov equation, white unit noise"),
        Evidence("schedule", f"periods {problem.schedule.periods}, offsets {problem.schedule.offsets}", "as given"),
        Evidence("base period", problem.plant.dt, "as given", "s"),
        *(
            [Evidence("samples under way", problem.plant.under_way, "states for the latency")]
            * bool(problem.plant.under_way)
        ),
        *baselines(
            exact.upper,
            "exact gain",
            without=gain_if_finite(problem.without_sensors()),
            kalman=l2_gain(problem.error_system(kalman_design(problem).gains)).upper,
            limit=best.noncausal.upper,
            simpler="" if further else SIMPLER,
        ),
        *further,
    )
    return MultirateResult(
        bracket=Bracket(exact.lower, exact.upper, EXACT_GAIN),
        gains=frozen({"L": gains}),
        evidence=evidence,
        signals=signals,
        problem=problem,
    )
