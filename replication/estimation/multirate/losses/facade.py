"""Multi-rate observers whose samples are lost: what a design guarantees then, and designs for losses.

losses.analyse(best, losses.InARow(2))             worst case over all patterns, with a bracket
losses.analyse(best, losses.Independent(0.1))      mean square error, exact
losses.design(best, losses.Markov(0.05, 0.6))      gains that know which samples came
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import Bracket, Evidence, GainResult, baselines
from replication.estimation.api.shown import Simulation, as_text, simulated
from replication.estimation.linear.norms import gain_curve, gain_if_finite, l2_gain, rms_if_finite, worst_case_response
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.losses.models import (
    Automaton,
    InARow,
    LossModel,
    Word,
    along,
    automaton,
    gains_by_edge,
    patterns,
    require_detectable,
)
from replication.estimation.multirate.losses.running import (
    DrawnLosses,
    LossObserver,
    drawn_losses,
    mean_square,
    mean_square_gains,
    require_seen,
)
from replication.estimation.multirate.losses.worst import bracket, found_level, least_gains
from replication.estimation.multirate.problem import MultirateProblem, disturbances
from replication.estimation.multirate.result import MultirateResult, rms_error
from replication.estimation.validation import Array, FrozenArrays, StateSpace, positive_integer

AXES = {
    "L": "(case, state, sensor)",
    "phase": "(case)",
    "before": "(case), node",
    "after": "(case), node",
    "arrived": "(case, sensor)",
}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class LossResult(GainResult):
    """A multi-rate observer under losses: a gain for each case, that is, for what came and for what came before.

    `gains` hold the cases as a table: at `phase` of the schedule and node `before`, the samples `arrived` lead to the
    node `after`; the observer begins at node 0 and corrects by L.

    Attributes
    ----------
    problem : MultirateProblem
        Plant and schedule.
    model : LossModel
        What is lost.
    automaton : Automaton
        All that may happen.
    worst : tuple of int
        Under `InARow`, the worst pattern found, case by case; it repeats. Empty otherwise.
    """

    method: str = "multirate"
    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    problem: MultirateProblem
    model: LossModel
    automaton: Automaton
    worst: Word

    @property
    def random(self) -> bool:
        """Whether losses have a probability, and the value is a mean error."""
        return not isinstance(self.model, InARow)

    def observer(self) -> LossObserver:
        """The observer, to run in a loop; its `step` takes None or NaN where a sample did not come."""
        return LossObserver(self.problem, self.automaton, self.gains["L"]).named(self.signals)

    def to_statespace(self) -> StateSpace:
        """There is none, as the observer switches with the losses; raises InvalidInputError."""
        raise InvalidInputError("an observer that switches with the losses is no StateSpace; run it by observer()")

    def rows(self) -> list[tuple[str, str, str]]:
        """The value, the gains, and what else is known."""
        level, bracket, *others = super().rows()
        shown = [("rms error", as_text(self.value), self.quantity)] if self.random else [level, bracket]
        return [*shown, *others]

    def panels(self) -> tuple[Panel, ...]:
        """The gain over the frequency for the worst pattern; of a mean error its size over the period."""
        plant = self.problem.plant
        if not self.random:
            duration = plant.dt * len(self.worst)
            frequencies, gains = gain_curve(along(self.problem, self.gains["L"], self.worst), duration)
            label = "frequency (rad/s, folded at the worst pattern)"
            return self._panel(frequencies, label, "largest gain to the error", {"worst pattern": gains})
        X = mean_square(self.problem, self.automaton, self.gains["L"]).X
        phases = np.array(self.automaton.phases)
        of_phase = [
            np.trace(plant.W @ X[phases == k].sum(axis=0) @ plant.W.T) for k in range(self.problem.schedule.period)
        ]
        time = np.arange(self.problem.schedule.period) * plant.dt
        curves, levels = {"rms error": np.sqrt(of_phase)}, {"over the period": self.value}
        return (Panel(time, "time in the schedule (s)", "rms error", curves, levels, steps=True),)


def _cases(result: MultirateResult, model: LossModel) -> tuple[Automaton, list[Word]]:
    """All that may happen, and under `InARow` its periodic patterns; InvalidInputError where a mode stays hidden."""
    MultirateResult.require(result)
    if not isinstance(model, LossModel):
        raise InvalidInputError(f"model must be an InARow, Independent or Markov, got {type(model).__name__}")
    cases = automaton(result.problem, model)
    if isinstance(model, InARow):
        return cases, require_detectable(result.problem, cases)
    require_seen(result.problem, cases)
    return cases, []


def _loss_result(
    base: MultirateResult, model: LossModel, cases: Automaton, words: list[Word], gains: Array | None = None
) -> LossResult:
    """What `gains` (cases, n, q), or those of `base`, are worth under losses."""
    problem, fixed = base.problem, gains_by_edge(cases, base.gains["L"])
    used = fixed if gains is None else gains
    if isinstance(model, InARow):
        limits, evidence, worst = _worst_case(problem, cases, words, used, fixed)
        quantity = f"{base.quantity}, {model}, in any pattern"
    else:
        limits, evidence = _mean_error(problem, cases, used, fixed)
        quantity, worst = f"root of the mean square of W e, white noise of unit intensity; {model}", ()
    table = {
        "L": used,
        "phase": [edge.phase for edge in cases.edges],
        "before": [edge.source for edge in cases.edges],
        "after": [edge.target for edge in cases.edges],
        "arrived": [edge.arrived for edge in cases.edges],
    }
    return LossResult(
        quantity=quantity,
        bracket=limits,
        gains=FrozenArrays(table),
        evidence=(Evidence("losses", str(model), "as given"), *evidence),
        signals=base.signals,
        problem=problem,
        model=model,
        automaton=cases,
        worst=worst,
    )


def _unaware(
    what: str, how: str, gains: Array, fixed: Array, measure: Callable[[Array], float]
) -> tuple[Evidence, ...]:
    """What gains that do not know of losses are worth under them, unless they are the ones in question."""
    if np.array_equal(gains, fixed):
        return ()
    try:
        worth: float | str = measure(fixed)
    except InfeasibleError:
        worth = "infinite"
    return (Evidence(what, worth, how),)


def _worst_case(
    problem: MultirateProblem, cases: Automaton, words: list[Word], gains: Array, fixed: Array
) -> tuple[Bracket, tuple[Evidence, ...], Word]:
    """The gain in any pattern, what else is known, and the worst pattern found."""
    worst = bracket(problem, cases, gains, words)
    shown = patterns(cases.edges, worst.word)
    without = gain_if_finite(problem.without_sensors())
    evidence = (
        Evidence("worst pattern found", shown, "samples that come, instant by instant, sensor by sensor; it repeats"),
        Evidence("level without losses", l2_gain(along(problem, gains, cases.without_losses())).upper, "exact gain"),
        Evidence("cases of the proof", len(worst.tree.edges), "instants with what came before, one inequality each"),
        *_unaware(
            "level of the design without losses, under them, at least",
            "some patterns, exact gains",
            gains,
            fixed,
            lambda fixed: found_level(problem, cases, fixed, words),
        ),
        *baselines(Bracket(worst.lower, worst.upper, ""), "exact gain; in any pattern", without=without),
    )
    how = "exact gain of the worst pattern found; storage functions of all patterns, checked by their eigenvalues"
    return Bracket(worst.lower, worst.upper, how), evidence, worst.word


def _mean_error(
    problem: MultirateProblem, cases: Automaton, gains: Array, fixed: Array
) -> tuple[Bracket, tuple[Evidence, ...]]:
    """The rms error, and what else is known."""
    mean = mean_square(problem, cases, gains)
    how = "covariances of all cases, by linear equations"
    kalman, without = rms_error(problem, kalman_design(problem).gains), rms_if_finite(problem.without_sensors())
    evidence = (
        Evidence("growth of the mean square over a period", mean.radius, "largest eigenvalue; below 1 is stable"),
        Evidence("rms error of the Kalman filter without losses", kalman, "periodic Lyapunov equation"),
        *baselines(mean.rms, how, what="rms error", without=without),
        *_unaware(
            "rms error of the design without losses, under them",
            "covariances of all cases",
            gains,
            fixed,
            lambda fixed: mean_square(problem, cases, fixed).rms,
        ),
    )
    return Bracket(mean.rms, mean.rms, how), evidence


def analyse(result: MultirateResult, model: LossModel) -> LossResult:
    """What a multi-rate observer is worth when samples are lost; a sample that is lost corrects nothing.

    Parameters
    ----------
    result : MultirateResult
        What `multirate.design` or `multirate.analyse` gave.
    model : InARow, Independent or Markov
        What may be lost.

    Returns
    -------
    LossResult
        Under `InARow` the worst-case gain over all patterns, bracketed from both sides; otherwise the root-mean-square
        error, exact.

    Raises
    ------
    InvalidInputError
        The model does not fit the sensors, has too many cases, or hides an unstable mode.
    InfeasibleError
        The error grows under some pattern, or in mean square.
    SolverError
        No level was proved.

    Notes
    -----
    The worst case is bounded by storage functions of what came before (Essick, Lee and Dullerud, IEEE Trans. Autom.
    Control 59, 2014), and attained by a periodic pattern with its exact gain. Mean squares are those of Markov jump
    linear systems (Costa, Fragoso and Marques, 2005).

    Examples
    --------
    >>> from replication.estimation import multirate
    >>> cart = multirate.MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[1, 0]], D=[[0.1]])
    >>> best = multirate.design(cart, periods=(2,))
    >>> best.value < analyse(best, InARow(1)).value
    True
    """
    return _loss_result(result, model, *_cases(result, model))


def design(result: MultirateResult, model: LossModel) -> LossResult:
    """Gains that depend on which samples come, and on what the model remembers of those before.

    Parameters
    ----------
    result, model : see there
        As in `analyse`; the plant and the schedule are those of the result.

    Returns
    -------
    LossResult
        Under `InARow` the gains with the least level that storage functions of the losses in a row prove;
        otherwise those with the least mean square error of all that know as much.

    Raises
    ------
    InvalidInputError
        As `analyse`.
    InfeasibleError
        Too much is lost: no gains keep the mean square error finite.
    SolverError
        Nothing was proved.
    """
    cases, words = _cases(result, model)
    if isinstance(model, InARow):
        gains = least_gains(result.problem, cases, result.value)
    else:
        gains = mean_square_gains(result.problem, cases)
    return _loss_result(result, model, cases, words, gains)


def simulate(
    result: LossResult, steps: int, *, rng: np.random.Generator | None = None, runs: int = 200
) -> Simulation | DrawnLosses:
    """The worst pattern with the noise that hurts most, or means over runs with drawn losses and noise.

    Parameters
    ----------
    result : LossResult
        What `design` or `analyse` gave.
    steps : int
        Number of instants.
    rng : numpy.random.Generator, optional
        Where losses and noise are drawn from; not for `InARow`.
    runs : int
        Number of runs, at least 2; not for `InARow`.

    Returns
    -------
    Simulation or DrawnLosses
        Under `InARow` the error along the worst pattern found, whose ratio tends to the lower end of the bracket;
        otherwise mean squares with their standard errors, beside the exact one.

    Raises
    ------
    InvalidInputError
        No `rng` where one is needed, or a number is not whole and positive.
    """
    LossResult.require(result)
    count, problem, gains = positive_integer("steps", steps), result.problem, result.gains["L"]
    time = np.arange(count, dtype=float) * problem.plant.dt
    if not result.random:
        response = worst_case_response(along(problem, gains, result.worst), count)
        arrived = np.array([result.automaton.edges[i].arrived for i in result.worst], dtype=float)
        came = arrived[np.arange(count) % len(arrived)]
        names = result.signals
        signals = {
            "error": (response.outputs, names.called(names.outputs)),
            "disturbance": (response.inputs, disturbances(problem.plant, names)),
            "arrived": (came, names.measurements),
        }
        return simulated(result.method, time, signals, ratio=response.ratio)
    if not isinstance(rng, np.random.Generator):
        raise InvalidInputError("drawn losses need `rng`, for example numpy.random.default_rng(1)")
    if positive_integer("runs", runs) < 2:
        raise InvalidInputError("runs must be at least 2: one run has no standard error")
    return drawn_losses(problem, result.automaton, gains, time, runs, rng)
