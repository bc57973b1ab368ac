"""The base of methods that run at instants: a design is a problem with gains, and a method adds its mathematics.

`solve` finds gains, `error_system` says what the error does with them, `phases` how the observer runs. All else follows
from these hooks: bracket, table, plot, running observer, state space, exported forms, simulation. `design` is `solve`
and then `analyse`; `analyse` takes any gains.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError
from replication.estimation.api.export import Recursion
from replication.estimation.api.plants import Signals, numbered
from replication.estimation.api.results import EXACT_GAIN, Bracket, Evidence, GainResult, baselines
from replication.estimation.api.running import PeriodicObserver
from replication.estimation.api.shown import Simulation, simulated
from replication.estimation.linear import norms
from replication.estimation.linear.periodic import PeriodicSystem, simulate
from replication.estimation.validation import FrozenArrays, positive_integer

UNKNOWN = Bracket(0.0, np.inf, "not computed yet")


class Solution(NamedTuple):
    """Gains by name, what else came out on the way, and what `facts` needs of it."""

    gains: Mapping[str, Any]
    evidence: tuple[Evidence, ...] = ()
    own: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Design(GainResult):
    """Gains of a periodic observer with the exact gain of their error.

    A subclass has what its plant is made of as fields, defaults for `method`, `quantity` and `axes`, and the hooks.
    """

    repeats: ClassVar[str] = "the period of the schedule"
    """What the frequencies of the plot are folded at."""
    target: ClassVar[str] = "the error"
    """What the gain of the plot is to."""

    @classmethod
    @abstractmethod
    def solve(cls, problem: Any, *given: Any, **aims: Any) -> Solution:
        """Find gains: the mathematics of the method.

        Parameters
        ----------
        problem : object
            Plant and schedule, checked.
        given : object
            What is known already.
        aims : object
            What is wanted of them.

        Returns
        -------
        Solution
            Gains by name, with evidence.
        """

    @abstractmethod
    def error_system(self) -> PeriodicSystem:
        """What disturbances do to the error, instant by instant.

        Returns
        -------
        PeriodicSystem
            Its l2 gain is the level.
        """

    @abstractmethod
    def phases(self) -> Recursion:
        """The observer, instant by instant.

        Returns
        -------
        Recursion
            From known inputs and measurements to the estimate.
        """

    def facts(self, error: PeriodicSystem, solution: Solution) -> tuple[Evidence, ...]:
        """What else is known of the gains, for the table.

        Parameters
        ----------
        error : PeriodicSystem
            `error_system`.
        solution : Solution
            What `solve` gave, or given gains.

        Returns
        -------
        tuple of Evidence
            Stability and mean error; the level without sensors, if the method says what the error is then; and what
            the solution says.
        """
        without = self.without_sensors()
        return (
            Evidence("spectral radius over one period", error.spectral_radius(), "eigenvalues of the monodromy matrix"),
            Evidence(
                "mean error variance", norms.white_noise_variance(error), "periodic Lyapunov equation, white unit noise"
            ),
            *(() if without is None else baselines(self.value, "exact gain", without=norms.gain_if_finite(without))),
            *solution.evidence,
        )

    def without_sensors(self) -> PeriodicSystem | None:
        """The error of the estimate zero, to compare with.

        Returns
        -------
        PeriodicSystem or None
            None where the method does not say.
        """
        return None

    def norm(self, error: PeriodicSystem) -> norms.GainBracket:
        """The gain of the error.

        Parameters
        ----------
        error : PeriodicSystem
            `error_system`.

        Returns
        -------
        GainBracket
            Exact, to rounding.

        Raises
        ------
        InfeasibleError
            The error grows.
        """
        return norms.l2_gain(error)

    @classmethod
    def design(cls, problem: Any, signals: Signals, **aims: Any) -> Self:
        """Gains that `solve` finds, analysed.

        Parameters
        ----------
        problem : object
            The field `problem` of the result.
        signals : Signals
            Names of the plant's signals, and its sampling period.
        aims : object
            Of `solve`.

        Returns
        -------
        Design
            With the exact gain.

        Raises
        ------
        InfeasibleError
            There are no such gains.
        """
        return cls.analysed(signals, cls.solve(problem, **aims), problem=problem)

    @classmethod
    def analysed(cls, signals: Signals, solution: Solution, **own: Any) -> Self:
        """The result for any gains.

        Parameters
        ----------
        signals : Signals
            Names of the plant's signals, and its sampling period.
        solution : Solution
            The gains by name.
        own : object
            Fields of the subclass.

        Returns
        -------
        Design
            With the exact gain and its evidence.

        Raises
        ------
        InfeasibleError
            The error grows.
        """
        bare = cls(bracket=UNKNOWN, gains=FrozenArrays(solution.gains), evidence=(), signals=signals, **own)
        error = bare.error_system()
        exact = bare.norm(error)
        result = replace(bare, bracket=Bracket(exact.lower, exact.upper, EXACT_GAIN))
        return replace(result, evidence=result.facts(error, solution))

    def observer(self) -> PeriodicObserver:
        """The observer, to run in a loop: its `step` takes y of all sensors, and looks at those that are due."""
        run = self.phases()
        return PeriodicObserver(run.phases, run.expected or (), run.direct).named(self.signals)

    def panels(self) -> tuple[Panel, ...]:
        """The gain over the frequency, with the guaranteed level."""
        error, dt = self.error_system(), self.signals.dt
        frequencies, gains = norms.gain_curve(error, error.period * (1.0 if dt is None else dt))
        label = f"frequency (rad/s, folded at {self.repeats})"
        return self._panel(frequencies, label, f"largest gain to {self.target}", {"gain": gains})

    def disturbances(self) -> tuple[str, ...]:
        """Names of the inputs of the error system.

        Returns
        -------
        tuple of str
            w[0], w[1] and so on unless the method says otherwise.
        """
        return numbered("w", self.error_system().stages[0].B.shape[1])

    def simulate(
        self,
        steps: int,
        *,
        disturbance: Any = "none",
        initial_error: Any = None,
        rng: np.random.Generator | None = None,
    ) -> Simulation:
        """The error over some instants.

        Parameters
        ----------
        steps : int
            Number of instants.
        disturbance : array (steps, m), or "none", "white", "worst"
            "white" draws unit white noise from `rng`; "worst" is the one of unit norm that hurts most from rest.
        initial_error : array (n,), optional
            Zero unless given.
        rng : numpy.random.Generator, optional
            Where white noise is drawn from.

        Returns
        -------
        Simulation
            Signals "error" and "disturbance".

        Raises
        ------
        InvalidInputError
            Another shape or word, or "white" without `rng`.
        """
        count, error = positive_integer("steps", steps), self.error_system()
        shape = count, error.stages[0].B.shape[1]
        if not isinstance(disturbance, str):
            inputs = np.asarray(disturbance)
        elif disturbance == "none":
            inputs = np.zeros(shape)
        elif disturbance == "worst":
            inputs = norms.worst_case_response(error, count).inputs
        elif disturbance != "white":
            raise InvalidInputError(f'disturbance must be "none", "white", "worst" or an array, got {disturbance!r}')
        elif isinstance(rng, np.random.Generator):
            inputs = rng.standard_normal(shape)
        else:
            raise InvalidInputError('disturbance="white" needs `rng`, for example numpy.random.default_rng(1)')
        outputs = simulate(error, inputs, initial_error)
        if len(outputs) != count:
            raise InvalidInputError(f"disturbance must have {count} rows, got {len(outputs)}")
        size, names = float(np.linalg.norm(inputs)), self.signals
        return simulated(
            self.method,
            np.arange(count, dtype=float) * (1.0 if names.dt is None else names.dt),
            {"error": (outputs, names.called(names.outputs)), "disturbance": (inputs, self.disturbances())},
            ratio=float(np.linalg.norm(outputs)) / size if size and initial_error is None else None,
        )
