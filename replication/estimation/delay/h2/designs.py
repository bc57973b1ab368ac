"""Central gains of a delay plant at any level up to infinity, the Kalman filter, with both measures of each, exact."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.shown import Measures, TradeOff, balanced
from replication.estimation.api.shown import tradeoff as curve
from replication.estimation.delay.exact.central import central
from replication.estimation.delay.exact.forms import injection_terms, plant_terms
from replication.estimation.delay.exact.limit import Limit, limit, require_seen
from replication.estimation.delay.exact.loop import exact_gain
from replication.estimation.delay.exact.peak import GainBracket
from replication.estimation.delay.general.lines import line_form
from replication.estimation.delay.general.noise import require_noise
from replication.estimation.delay.general.observer import DelayObserver
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.general.rates import moment_plant
from replication.estimation.delay.general.scaling import scaling_of
from replication.estimation.delay.h2.variance import error_covariance

WIDTH, KEPT = 1e-6, 1e-3
"""Relative width of the exact gain, and excess over the level of the model that is left to it."""
MARGIN = 0.01
"""Relative distance above the least level at which gains are computed: nearer to it they grow without bound."""
DEGREE, STATES = 12, 120
"""Moments of each delay unless a degree is asked for, and states of the model for which there are fewer."""
OF = "rms error of z"


class Designs:
    """The central gains of a plant at any level.

    Raises InvalidInputError if z holds white noise, y none at some frequency, or y does not see an unstable mode.
    """

    def __init__(self, plant: DelayPlant, degree: int | None) -> None:
        if np.any(plant.d11):
            raise InvalidInputError(
                "z holds w itself (d11), and white noise has an infinite mean square; leave d11 out, or estimate a "
                "filtered signal"
            )
        require_noise(plant)
        self.plant, self.scaling = plant, scaling_of(plant)
        require_seen(plant_terms(self.scaling.plant(plant)), self.scaling.time)
        self.form = line_form(self.scaling.plant(plant))
        most = (STATES - plant.states) // max(self.form.width, 1)
        self.degree = max(min(DEGREE, most), self.form.moments, 1) if degree is None else degree
        self.model = moment_plant(self.form, self.degree)

    def exact(self, level: float) -> tuple[DelayObserver, GainBracket]:
        """The observer and its exact gain; raises SolverError if it does not keep the level."""
        observer = self.at(level)
        try:
            gain = exact_gain(observer, WIDTH)
        except InfeasibleError as error:
            raise SolverError(f"{self._few()} do not stabilise the error{self._why()}; set `degree`") from error
        except SolverError as error:
            raise SolverError(f"{self._few()} are of no use: {error}; raise the level, or set `degree`") from error
        if gain.upper > level * (1 + KEPT):
            raise SolverError(
                f"{self._few()} found for the level {level:.6g} have the gain {gain.upper:.6g}; raise the level, "
                "or set `degree`"
            )
        return observer, gain

    def _few(self) -> str:
        return f"the gains of {self.degree} moments of each delay"

    def _why(self) -> str:
        return " (a disturbance that y has shown acts again later, where they jump)" if returns(self.plant) else ""

    def at(self, level: float) -> DelayObserver:
        """The observer, in the units of the plant."""
        try:
            gains, _ = central(self.model, level)
        except (InfeasibleError, np.linalg.LinAlgError) as error:
            what = f"for the level {level:.6g}" if np.isfinite(level) else "of the Kalman filter"
            raise SolverError(
                f"the gains {what} are not found with {self.degree} moments of each delay ({error}); "
                "raise the level, or set `degree`"
            ) from error
        n, q, kernels = self.form.states, self.form.measurements, []
        start, rate = n, self.scaling.sensors / self.scaling.time
        for line in self.form.lines:
            stop = start + self.degree * line.width
            kernels.append(gains[start:stop].reshape(self.degree, line.width, q) * rate)
            start = stop
        l0 = gains[:n] / self.scaling.states[:, None] * rate
        return DelayObserver(
            self.plant, self.scaling.back(self.form), l0, np.zeros((self.form.outputs, q)), tuple(kernels)
        )

    def measures(self, level: float) -> Measures:
        """The exact gain and root mean square of the design at a level."""
        observer, gain = self.exact(level)
        covariance, _ = error_covariance(plant_terms(self.plant), injection_terms(observer))
        return gain.upper, float(np.sqrt(np.trace(covariance)))

    @cached_property
    def limit(self) -> Limit:
        """The least level of any observer."""
        if returns(self.plant):
            raise InvalidInputError(
                "a disturbance that y has shown acts again later (b_delayed or d21_delayed): the gains between both "
                "goals jump there, and are not found; take the goal hinf or h2, or let that noise pass a state"
            )
        found = limit(self.plant)
        if found.level <= 0.0:
            raise InfeasibleError("the least level cannot be told from zero: there is nothing to trade; take goal h2")
        return found

    def least(self) -> float:
        """The smallest level of a design."""
        found = self.limit
        return (1 + MARGIN) * (found.level + found.moving)

    def above_least(self, level: float) -> float:
        """The level if some observer keeps it."""
        found = self.limit
        if level <= found.level - found.moving:
            raise InfeasibleError(
                f"no observer has a gain below {level!r}: the least is {found.level:.6g}; ask for more"
            )
        return level

    def balance(self) -> float:
        """The level whose design loses the same share of both measures."""
        return balanced(self.least(), self.limit.level, self.measures)


def returns(plant: DelayPlant) -> bool:
    """Whether a disturbance reaches y and, with a longer delay, x or y once more."""
    shown = [plant.d21, *plant.d21_delayed]
    later = [np.vstack(pair) for pair in zip(plant.b_delayed, plant.d21_delayed, strict=True)]
    return any(np.any(seen @ again.T) for i, seen in enumerate(shown) for again in later[i:])


def tradeoff(plant: DelayPlant, points: int) -> TradeOff:
    """Designs from just above the least level to the Kalman filter; raises as `Designs` and its methods."""
    designs = Designs(plant, None)
    return curve("delay", OF, points, designs.least(), designs.measures)
