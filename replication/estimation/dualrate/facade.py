"""Dual-rate output feedback for a plant of one's own: `design`, `analyse`, `compare`, `simulate`.

The input changes every period T, the sensor delivers every M T. The observer fills the instants between; which one
does so is a choice (`observer`, one of `OBSERVERS`). u = K x^, and L corrects the observer's differential equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from typing import Any

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.design import Solution
from replication.estimation.api.results import LITTLE, Evidence
from replication.estimation.api.shown import Goal, Simulation, aimed, simulated
from replication.estimation.dualrate.loop import MARGINAL, DualRateLoop, close_loop, require_stable, stability_radius
from replication.estimation.dualrate.observers import OBSERVERS, Builder, held
from replication.estimation.dualrate.problem import (
    DualRateDesign,
    Plant,
    Steady,
    as_plant,
    dual_rate_design,
    row_of_output,
    signals_of,
    steady_of,
    wanted,
)
from replication.estimation.dualrate.result import DualRateResult, Weights, checked_weights
from replication.estimation.dualrate.slow.problem import slow_problem
from replication.estimation.dualrate.slow.result import (
    MEASURE,
    SlowRateResult,
    beside,
    gain,
    kalman,
    of_gains,
)
from replication.estimation.validation import StateSpace, finite_vector, one_of, positive_integer

DEFAULT_OBSERVER = "running_prediction"
"""The restarted predictor: between measurements it carries on from the last one."""
SLOW = 'design for the rates as they are: at="slow"'
LONGEST = 2_000
"""Fast instants in a slow period up to which continuous gains have other levels beside theirs: more take minutes."""
SUBSTEPS = 10
"""Points of a time response per fast period."""


class At(StrEnum):
    """Where gains are designed: for the plant in continuous time, or for the plant as it is sampled and held."""

    CONTINUOUS = "continuous"
    SLOW = "slow"


def design(
    plant: Plant | StateSpace,
    *,
    period: float,
    ratio: int | Sequence[int],
    at: str = "continuous",
    goal: str = "h2",
    level: float | None = None,
    hold: int | Sequence[int] = 1,
    observer: str = DEFAULT_OBSERVER,
    state_weight: Any = None,
    input_weight: Any = None,
    process_noise: Any = None,
    sensor_noise: Any = None,
    tracked: int | Sequence[int] | None = None,
) -> DualRateResult | SlowRateResult:
    """A loop with gains for the continuous-time plant, as in the paper, or with a controller for the slow rate.

    `at="continuous"` gives the linear-quadratic K and the stationary Kalman gain L, which know nothing of the rates;
    the loop that they make is analysed exactly. `at="slow"` designs for the plant as it is sampled and held: such a
    controller exists whenever the sensors, at their instants, see every unstable mode and the inputs move it.

    Parameters
    ----------
    plant : control.StateSpace or Plant
        Strictly proper and continuous-time, or what `make_plant(A, B, C)` gives; n states, m inputs, p outputs.
    period : float
        Fast period T, s.
    ratio : int or sequence of int
        M; the sensor delivers every M T. At the slow rate also one number for each sensor.
    at : str
        "continuous" or "slow".
    goal : str
        At the slow rate "h2", the least mean of x'Qx + u'Ru at the fast instants under white noise; "hinf", the least
        worst-case gain; or "mixed", a mean bounded from above at a level.
    level : float, optional
        Gain to keep; of "hinf" one per cent above the least unless given, of "mixed" the one at which gain and root
        mean square exceed the least ones by the same share.
    hold : int or sequence of int
        At the slow rate: an input changes every so many T and is held between. One number, or one for each input.
    observer : str
        What fills the instants between, one of `OBSERVERS`; of the continuous gains.
    state_weight : array (n, n) or (n,), optional
        Q in the integral of x'Qx + u'Ru that K minimises; C'C unless given. A vector is a diagonal, here and below.
    input_weight : array (m, m) or (m,), optional
        R of that integral; the identity unless given.
    process_noise : array (n, n) or (n,), optional
        Intensity W of the process noise; BB' unless given.
    sensor_noise : array (p, p) or (p,), optional
        Intensity of the sensor noise in continuous time, at the slow rate the covariance of one reading; the identity
        unless given.
    tracked : int or sequence of int, optional
        Outputs, from 0, that follow set-points r, at most as many as inputs: u = K x^ + N r. A state that no input
        moves and that is constant but for its process noise is a load; under loads these outputs, or all unless
        `tracked` is given, come to rest without error.

    Returns
    -------
    DualRateResult or SlowRateResult
        Gains K (m, n) and L (n, p), or those of each instant at the slow rate; and the exact gain of their loop.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the rates lose an unstable mode.
    InfeasibleError
        There are no such gains, or the loop is unstable; at the slow rate the message names the mode that proves it.
    SolverError
        At the slow rate rounding spoils the Riccati equations.

    Notes
    -----
    The plant is eq. (1) of Shao et al., the observer's differential equation (3), the feedback (8). The design at the
    slow rate is textbook sampled-data control, and not of the paper.

    Examples
    --------
    >>> from replication.estimation.dualrate import make_plant
    >>> servo = make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
    >>> loop = design(servo, period=0.01, ratio=20)
    >>> loop.fact("monodromy radius").value < 1
    True
    >>> slow = design(servo, period=0.01, ratio=20, at="slow")
    >>> slow.running().step(None, [0.3]).shape  # the next estimate, and the command that belongs to it
    (3,)
    """
    model, where = as_plant(plant), one_of(At, at)
    weights = checked_weights(model, state=state_weight, input=input_weight, process=process_noise, sensor=sensor_noise)
    aim, target = aimed(goal, level)
    _builder(observer)
    if where is At.SLOW:
        problem = slow_problem(model, period=period, ratio=ratio, hold=hold, weights=weights, tracked=tracked)
        solution = SlowRateResult.solve(problem, goal=aim, level=target, observer=observer)
        quantity = SlowRateResult.quantity + ("; x and u less what holds the loads" if problem.loads else "")
        own = {"problem": problem, "quantity": quantity}
        return SlowRateResult.analysed(signals_of(plant, problem.period), solution, **own)
    if np.ndim(ratio) > 0 or np.any(np.asarray(hold) != 1) or aim is not Goal.H2:
        raise InvalidInputError(
            'one ratio for each sensor, hold and goal="hinf" belong to designs at the slow rate: at="slow"'
        )
    gains = DualRateResult.solve(model, weights, steady_of(model, tracked)).gains
    result = analyse(
        plant,
        feedback=gains["K"],
        injection=gains["L"],
        period=period,
        ratio=ratio,  # type: ignore[arg-type]
        observer=observer,
        tracked=tracked,
    )
    return replace(result, evidence=(*result.evidence, *_levels(result, weights)))


def _levels(result: DualRateResult, weights: Weights) -> tuple[Evidence, ...]:
    """What the continuous gains are worth beside a design at the slow rate, for the same noise and weights."""
    loop = result.loop.design
    if loop.ratio > LONGEST or (result.steady is not None and result.steady.loads):
        return ()
    intensities = weights._replace(sensor=weights.sensor / loop.slow_period)
    try:
        problem = slow_problem(loop.model, period=loop.period, ratio=loop.ratio, hold=1, weights=intensities)
        best = kalman(problem)[1].upper
        level = gain(problem, of_gains(problem, result.loop)).upper
    except (InfeasibleError, InvalidInputError, SolverError):
        return ()
    facts = [Evidence("level from process and sensor noise", level, MEASURE)]
    if level > (1 + LITTLE) * best > 0:
        how = f"ratio to the level of the Kalman filter there; {SLOW}"
        facts.append(Evidence("loss against the slow rate", level / best, how))
    return (*facts, *beside(problem, level, best))


def analyse(
    plant: Plant | StateSpace,
    *,
    feedback: Any,
    injection: Any,
    period: float,
    ratio: int,
    observer: str = DEFAULT_OBSERVER,
    discrete_gain: bool = False,
    tracked: int | Sequence[int] | None = None,
) -> DualRateResult:
    """The closed loop with given gains.

    Parameters
    ----------
    plant : control.StateSpace or Plant
        As in `design`.
    feedback : array (m, n)
        K with u = K x^, so that A + B K is the loop with full state.
    injection : array (n, p)
        L of the observer.
    period : float
        As in `design`, s.
    ratio, observer : see there
        As in `design`.
    discrete_gain : bool
        Whether L corrects by steps instead of in the observer's differential equation.
    tracked : see there
        As in `design`; K (m, n) has columns for the loads.

    Returns
    -------
    DualRateResult
        The same gains and the exact gain of their loop.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the rates lose an unstable mode.
    InfeasibleError
        The loop is unstable; the message names observers with which it would be stable.
    """
    steady = steady_of(as_plant(plant), tracked)
    moved = None if steady is None else steady.inner
    problem = dual_rate_design(plant, feedback=feedback, injection=injection, period=period, ratio=ratio, moved=moved)
    loop = _closed(problem, _builder(observer), discrete_gain, steady)
    if stability_radius(loop) >= 1.0 - MARGINAL:
        require_stable(loop, _advice(problem, discrete_gain, steady))
    gains = {"K": problem.feedback, "L": problem.injection}
    if steady is not None and steady.asked:
        gains["N"] = steady.ahead(problem.feedback)
    fields = {"loop": loop, "observer_name": observer, "discrete_gain": discrete_gain, "steady": steady}
    return DualRateResult.analysed(signals_of(plant, problem.period), Solution(gains), **fields)


def compare(result: DualRateResult) -> dict[str, float]:
    """The same gains with each observer.

    Parameters
    ----------
    result : DualRateResult
        What `design` or `analyse` gave.

    Returns
    -------
    dict of str to float
        Spectral radius of the monodromy matrix for each of `OBSERVERS`: the loop is stable iff it is below one.

    Raises
    ------
    InvalidInputError
        `result` is something else.
    """
    DualRateResult.require(result)
    return _radii(result.loop.design, result.discrete_gain, result.steady)


def simulate(
    result: DualRateResult | SlowRateResult,
    start: Any,
    *,
    slow_periods: int,
    estimate: Any = None,
    output: int = 0,
    setpoint: Any = None,
) -> Simulation:
    """The loop from given starts, without noise, between the instants too.

    Parameters
    ----------
    result : DualRateResult or SlowRateResult
        What `design` or `analyse` gave.
    start : array (n,)
        x(0), loads included.
    slow_periods : int
        How many slow periods M T, or periods of all rates together.
    estimate : array (n,), optional
        x^(0); zero unless given.
    output : int
        Which output is shown, from 0.
    setpoint : array (t,), optional
        r of the tracked outputs, from the start on; zero unless given.

    Returns
    -------
    Simulation
        Signals "output", "input" and "estimation error", ten points per fast period.

    Raises
    ------
    InvalidInputError
        A start of another length, or no such output.
    """
    if isinstance(result, SlowRateResult):
        plant, period = result.problem.plant, result.problem.period
    else:
        DualRateResult.require(result)
        plant, period = result.loop.design.model, result.loop.design.period
    n, loop = plant.order, result.driven
    count = positive_integer("number of slow periods", slow_periods) * len(loop)
    row, r = plant.C[row_of_output(plant, output)], wanted(setpoint, loop[0].command.shape[1])
    z = np.zeros(len(loop[0].state))
    z[:n], z[n : 2 * n] = finite_vector("x(0)", start, n), 0 if estimate is None else finite_vector("ζ(0)", estimate, n)
    states, inputs, errors = np.empty((count, n)), np.empty((count, plant.B_u.shape[1])), np.empty((count, n))
    for k in range(count):
        now = loop[k % len(loop)]
        states[k], errors[k] = z[:n], z[:n] - now.estimate_state @ z
        inputs[k] = now.input_state @ z + now.input_command @ r
        z = now.state @ z + now.command @ r
    between = [held(plant.A, plant.B_u, i * period / SUBSTEPS) for i in range(SUBSTEPS)]
    outputs = [states @ part.state.T @ row + inputs @ part.input.T @ row for part in between]
    time, names = period * (np.arange(count)[:, None] + np.arange(SUBSTEPS) / SUBSTEPS), result.signals
    signals = {
        "output": (np.stack(outputs, axis=1).reshape(-1, 1), names.called([names.measurements[output]])),
        "input": (np.repeat(inputs, SUBSTEPS, axis=0), names.called(names.inputs)),
        "estimation error": (np.repeat(errors, SUBSTEPS, axis=0), names.called(names.states)),
    }
    return simulated(result.method, time.ravel(), signals, ratio=None, steps=False)


def _closed(problem: DualRateDesign, builder: Builder, discrete_gain: bool, steady: Steady | None) -> DualRateLoop:
    """The loop of the plant without its loads, which stand still."""
    if steady is None or not steady.loads:
        return close_loop(problem, builder, discrete_gain=discrete_gain)
    if builder is OBSERVERS["state_feedback"]:
        K, L = problem.feedback @ steady.back, steady.kept @ problem.injection
        return close_loop(DualRateDesign(steady.inner, K, L, problem.period, problem.ratio), builder)
    return close_loop(problem, builder, plant=steady.inner, discrete_gain=discrete_gain)


def _radii(problem: DualRateDesign, discrete_gain: bool, steady: Steady | None) -> dict[str, float]:
    loops = {name: _closed(problem, builder, discrete_gain, steady) for name, builder in OBSERVERS.items()}
    return {name: stability_radius(loop) for name, loop in loops.items()}


def _advice(problem: DualRateDesign, discrete_gain: bool, steady: Steady | None) -> str:
    """Which observers would do with the same gains, and what else can be changed."""
    stable = [name for name, radius in _radii(problem, discrete_gain, steady).items() if radius < 1.0 - MARGINAL]
    if "state_feedback" not in stable:
        return f"so it is with the full state at every instant; choose a shorter period, a weaker feedback K, or {SLOW}"
    others = ", ".join(name for name in stable if name not in ("state_feedback", "fast_sensor"))
    choice = f"one of the observers {others}, or " if others else ""
    return f"with the full state at every instant it would be stable; {SLOW}, or choose {choice}another gain L"


def _builder(observer: str) -> Any:
    if not isinstance(observer, str) or observer not in OBSERVERS or observer == "state_feedback":
        known = ", ".join(name for name in OBSERVERS if name != "state_feedback")
        raise InvalidInputError(f"observer must be one of {known}, got {observer!r}")
    return OBSERVERS[observer]
