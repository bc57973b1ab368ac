"""What multi-rate gains are worth when samples are lost, as a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import Bracket, Evidence, GainResult, baselines
from replication.estimation.api.shown import as_text
from replication.estimation.linear.norms import gain_curve, gain_if_finite, l2_gain
from replication.estimation.multirate.h2.tradeoff import rms_error
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.losses.automaton import (
    Automaton,
    Word,
    along,
    automaton,
    gains_by_edge,
    patterns,
    require_detectable,
)
from replication.estimation.multirate.losses.mean import mean_square, require_seen
from replication.estimation.multirate.losses.models import InARow, LossModel
from replication.estimation.multirate.losses.running import LossObserver
from replication.estimation.multirate.losses.worst import bracket, found_level
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.result import MultirateResult
from replication.estimation.validation import Array, frozen

if TYPE_CHECKING:
    import control

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

    def to_statespace(self) -> control.StateSpace:
        """There is none: the observer switches with the losses.

        Raises
        ------
        InvalidInputError
            Always; it says what to use instead.
        """
        raise InvalidInputError("an observer that switches with the losses is no StateSpace; run it by observer()")

    def rows(self) -> list[tuple[str, str, str]]:
        """The value, the gains, and what else is known."""
        level, bracket, *others = super().rows()
        if not self.random:
            return [level, bracket, *others]
        return [("rms error", as_text(self.value), self.quantity), *others]

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


def loss_result(base: MultirateResult, model: LossModel, gains: Array | None = None) -> LossResult:
    """What `gains` (cases, n, q), or those of `base`, are worth under losses."""
    problem, given = base.problem, automaton(base.problem, model)
    fixed = gains_by_edge(given, base.gains["L"])
    used = fixed if gains is None else gains
    judged = _worst_case if isinstance(model, InARow) else _mean_error
    worth = judged(problem, given, model, used, base)
    table = {
        "L": used,
        "phase": [edge.phase for edge in given.edges],
        "before": [edge.source for edge in given.edges],
        "after": [edge.target for edge in given.edges],
        "arrived": [edge.arrived for edge in given.edges],
    }
    return LossResult(
        quantity=worth.quantity,
        bracket=worth.bracket,
        gains=frozen(table),
        evidence=(Evidence("losses", str(model), "as given"), *worth.evidence),
        signals=base.signals,
        problem=problem,
        model=model,
        automaton=given,
        worst=worth.worst,
    )


def _kalman(problem: MultirateProblem) -> tuple[float, str]:
    return rms_error(problem, kalman_design(problem).gains), "periodic Lyapunov equation"


def _unaware(problem: MultirateProblem, given: Automaton, gains: Array, fixed: Array) -> tuple[Evidence, ...]:
    """What gains that do not know of losses are worth under them, unless they are the ones in question."""
    if np.array_equal(gains, fixed):
        return ()
    try:
        rms: float | str = mean_square(problem, given, fixed).rms
    except InfeasibleError:
        rms = "infinite"
    return (Evidence("rms error of the design without losses, under them", rms, "covariances of all cases"),)


class Worth(NamedTuple):
    """A measure of gains under losses, its bracket, what else is known, and the worst pattern if there is one."""

    quantity: str
    bracket: Bracket
    evidence: tuple[Evidence, ...]
    worst: Word = ()


def _worst_case(
    problem: MultirateProblem, given: Automaton, model: LossModel, gains: Array, base: MultirateResult
) -> Worth:
    words = require_detectable(problem, given)
    worst = bracket(problem, given, gains, words)
    shown = patterns(given.edges, worst.word)
    without = gain_if_finite(problem.without_sensors())
    evidence = (
        Evidence("worst pattern found", shown, "samples that come, instant by instant, sensor by sensor; it repeats"),
        Evidence("level without losses", l2_gain(along(problem, gains, given.without_losses())).upper, "exact gain"),
        Evidence("cases of the proof", len(worst.tree.edges), "instants with what came before, one inequality each"),
        *_unaware_level(problem, given, gains, gains_by_edge(given, base.gains["L"]), words),
        *baselines(worst.upper, "exact gain", without=without),
    )
    how = "exact gain of the worst pattern found; storage functions of all patterns, checked by their eigenvalues"
    limits = Bracket(worst.lower, worst.upper, how)
    return Worth(f"{base.quantity}, {model}, in any pattern", limits, evidence, worst.word)


def _unaware_level(
    problem: MultirateProblem, given: Automaton, gains: Array, fixed: Array, words: list[Word]
) -> tuple[Evidence, ...]:
    if np.array_equal(gains, fixed):
        return ()
    try:
        level: float | str = found_level(problem, given, fixed, words)
    except InfeasibleError:
        level = "infinite"
    return (Evidence("level of the design without losses, under them, at least", level, "some patterns, exact gains"),)


def _mean_error(
    problem: MultirateProblem, given: Automaton, model: LossModel, gains: Array, base: MultirateResult
) -> Worth:
    require_seen(problem, given)
    mean = mean_square(problem, given, gains)
    how = "covariances of all cases, by linear equations"
    evidence = (
        Evidence("growth of the mean square over a period", mean.radius, "largest eigenvalue; below 1 is stable"),
        Evidence("rms error of the Kalman filter without losses", *_kalman(problem)),
        *_unaware(problem, given, gains, gains_by_edge(given, base.gains["L"])),
    )
    quantity = f"root of the mean square of W e, white noise of unit intensity; {model}"
    return Worth(quantity, Bracket(mean.rms, mean.rms, how), evidence)
