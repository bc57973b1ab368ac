"""What the observer of a general delay plant guarantees, as a result: running observer, error system, plot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from replication.estimation.api.plants import Signals, numbered
from replication.estimation.api.shown import TradeOff
from replication.estimation.delay.exact.loop import error_response, injection_terms, plant_terms
from replication.estimation.delay.general.cone import moment_plant
from replication.estimation.delay.general.lines import DelayObserver
from replication.estimation.delay.general.mean_square import tradeoff
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.synthesis import GeneralLevel
from replication.estimation.delay.observer import ErrorSystem, Trajectory
from replication.estimation.delay.result import DelayDesign
from replication.estimation.delay.sampled import InnovationsObserver, running, simulate_error
from replication.estimation.validation import Array, positive_integer


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class InnovationsResult(DelayDesign):
    """The gains L_0, L_z and, for each delay i, the Legendre coefficients L_i and what the delay carries, E_i.

    Attributes
    ----------
    gains_of : DelayObserver
        The gains with the plant.
    proof : GeneralLevel or None
        The storage function that proves the level; None for gains of a Riccati equation, whose gain is that of the
        exact closed loop.
    covariance : array (p, p) or None
        Of the error of z for white w of unit intensity; None with the goal hinf.
    """

    gains_of: DelayObserver
    proof: GeneralLevel | None = None
    covariance: Array | None = None

    @property
    def plant(self) -> DelayPlant:
        """The plant for which the level holds."""
        return self.gains_of.plant

    def observer(self, dt: float) -> InnovationsObserver:
        """The observer on measurements sampled every `dt` (s); `step(u, y)` gives the estimate at the same instant."""
        return running(self.gains_of, dt).named(self.signals)

    def error_model(self) -> tuple[ErrorSystem, Array]:
        """Each delay by `order` Legendre moments."""
        return moment_model(self.gains_of, self.order)

    def gain_at(self, omega: Array) -> Array:
        """With true exponentials."""
        return error_response(plant_terms(self.plant), injection_terms(self.gains_of)).gains(omega)

    def trajectory(self, times: Any, disturbance: Any) -> Trajectory:
        """By the recursion that runs; of second order in the step."""
        return simulate_error(self.gains_of, times, disturbance)

    @property
    def rate(self) -> float:
        """The rate of the longest delay, 1/s."""
        return 1.0 / self.plant.delays[-1]

    def tradeoff(self, points: int = 12) -> TradeOff:
        """What a smaller guaranteed gain costs in mean error of z, for this plant.

        Parameters
        ----------
        points : int
            Number of designs, from one per cent above the least level of any observer to the Kalman filter; at least 2.

        Returns
        -------
        TradeOff
            Level, exact gain and exact rms error of each; it prints and plots itself.

        Raises
        ------
        InvalidInputError
            `points` is no whole number from 2 to 1000, or z holds w itself.
        InfeasibleError
            The least level is zero.
        SolverError
            The gains at a level, or their measures, are not found.
        """
        return tradeoff(self.plant, points)


def signals_of(plant: DelayPlant) -> Signals:
    """x[0], u[0], y[0], z[0] and so on."""
    return Signals(
        numbered("x", plant.states),
        numbered("u", plant.known_inputs),
        numbered("y", plant.measurements),
        numbered("z", plant.outputs),
    )


def arrays_of(observer: DelayObserver) -> tuple[dict[str, Array], dict[str, str]]:
    """The gains by name, and what their axes are; a line that carries nothing has none."""
    gains, axes = {"L0": observer.l0, "Lz": observer.lz}, {"L0": "(state, measurement)", "Lz": "(output, measurement)"}
    for i, (line, kernel) in enumerate(zip(observer.form.lines, observer.kernels, strict=True), start=1):
        gains |= {f"L{i}": kernel, f"E{i}": line.carry}
        axes |= {f"L{i}": "(Legendre coefficient, line, measurement)", f"E{i}": "(line, state and disturbance)"}
    return gains, axes


def moment_model(observer: DelayObserver, order: int) -> tuple[ErrorSystem, Array]:
    """The error with each line replaced by `order` moments (Legendre-tau method), and its direct part (p, r).

    Its first n states are the error of x. Raises InvalidInputError where `order` is below what the averages need.
    """
    plant = moment_plant(observer.form, positive_integer("order", order))
    injection = np.vstack([observer.l0, *(_moments(kernel, order) for kernel in observer.kernels)])
    a, b = plant.a - injection @ plant.cy, plant.b - injection @ plant.dy
    return ErrorSystem(a, b, plant.cz - observer.lz @ plant.cy), plant.dz - observer.lz @ plant.dy


def _moments(kernel: Array, order: int) -> Array:
    padded = np.zeros((order, *kernel.shape[1:]))
    padded[: len(kernel)] = kernel[:order]
    return padded.reshape(-1, kernel.shape[2])
