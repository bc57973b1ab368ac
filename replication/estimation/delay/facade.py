"""Observers for systems with state delays, for a plant of one's own: `design`, `analyse`, `simulate` (Peet and Gu).

x'(t) = A_0 x(t) + sum_i A_i x(t - tau_i) + B w(t); z is to be estimated from y = C_2 x, which is free of noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.plants import Signals, numbered, parts_of, read_plant
from replication.estimation.api.results import Evidence
from replication.estimation.api.shown import Goal, Simulation, aimed, simulated
from replication.estimation.delay.exact.response import decided
from replication.estimation.delay.general.design import design_general, left_alone, mean_design
from replication.estimation.delay.plant import DelayPlant, delay_system, require_independent
from replication.estimation.delay.result import ORDER, DelayAnalysis, DelayResult, result_of
from replication.estimation.delay.sos.certificate import LeastGain, certificate_at, minimum_gain
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.observer import simulate as over_time
from replication.estimation.delay.sos.synthesis import degree_for
from replication.estimation.validation import StateSpace, at_most, one_of, positive_scalar

HIGHEST, FINEST = 12, 200
"""Degree and order beyond which programs and closed loops do not end, or rounding decides them."""
MARGIN = 0.05
"""Relative distance from the optimum, whose gains have no bound."""


def _read(plant: Any, **split: Any) -> tuple[DelayPlant, Signals]:
    """A plant whose outputs are measured, y, or estimated, z, and its names."""

    def read(system: Any, *, measured: Any, delayed: Any, delays: Any) -> tuple[DelayPlant, Signals]:
        if measured is None or delayed is None or delays is None:
            raise InvalidInputError("a control.StateSpace needs delayed=[A_1, ..], delays=[tau_1, ..] and measured=..")
        parts = parts_of(system, continuous=True, measured=measured)
        if np.any(parts.D_d):
            raise InvalidInputError(f"the plant must be without feedthrough, got D = {system.D.tolist()}")
        return delay_system(parts.A, delayed, delays, parts.B_d, parts.W, parts.C), parts.signals

    refusal = "delayed, delays and measured belong to a control.StateSpace"
    return read_plant(plant, DelayPlant, read, split, arrays="delay_system(...)", refusal=refusal)


@decided
def design(
    plant: DelayPlant | StateSpace,
    *,
    goal: Goal | str = Goal.HINF,
    degree: int | None = None,
    rule: DegreeRule | str = DegreeRule.BESSEL,
    margin: float = MARGIN,
    level: float | None = None,
    order: int = ORDER,
    delayed: Sequence[Any] | None = None,
    delays: Sequence[float] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> DelayResult:
    """An observer whose level is `margin` above the least that polynomials of `degree` prove, or is `level`.

    Parameters
    ----------
    plant : DelayPlant or control.StateSpace
        A `DelayPlant(...)`, one without noise of a `delay_system(...)`, or the delay-free part as a continuous-time
        system with inputs w and outputs y and z.
    goal : "hinf", "h2" or "mixed"
        Least gain; for a plant with noise also the least mean square error for white w of unit intensity (the Kalman
        filter), or a gain below `level` with the least entropy, a bound of the mean square error.
    degree : int, optional
        Degree of the polynomials; 3 unless given, or less for a large plant, whose cost grows steeply with it; up to 6
        for a plant with noise. The evidence names it. With "h2" and "mixed" up to 12 moments of each delay.
    rule : DegreeRule or str
        Which monomials the degree stands for; a plant with noise has one rule only.
    margin : float
        Relative distance from the least level, whose gains have no bound; of the goal hinf.
    level : float, optional
        Level to prove, in place of the margin. With "mixed" the level of the design; unless given that at which gain
        and mean error exceed the least ones by the same share, the mean by 15 % and half of what sensors win at most.
    order : int
        How finely `to_statespace` and `simulate` resolve each delay: order + 1 points, or so many moments for a plant
        with noise.
    delayed : sequence of array (n, n)
        A_1 ... A_K that belong to a `control.StateSpace`.
    delays : sequence of float
        tau_1 < ... < tau_K that belong to it, s.
    measured : int, or sequence of int or str
        How many of its first outputs are y, or which ones, by index or name.

    Returns
    -------
    DelayResult
        The gains of eq. (9), the level that they prove and the certificate; for a plant with noise,
        gains on the present innovation. With "h2" and "mixed" the exact gain, which nothing certifies, and the
        covariance of the error of z.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the plant is not detectable.
    InfeasibleError
        No level is found, or the least one cannot be told from zero.
    SolverError
        The solver does not settle, or the gains do not keep what was proved.

    Notes
    -----
    Theorem 3 of Peet and Gu as a sum-of-squares program; the gains follow from its solution by Lemma 5. With noise, the
    program of `replication.estimation.delay.general`, whose observer keeps no history of y. The mean-square gains are
    those of the filter Riccati equation with each delay by its moments; both measures are taken without them.

    Examples
    --------
    >>> from replication.estimation.delay import delay_system
    >>> eye = [[1, 0], [0, 1]]
    >>> tanks = delay_system([[-1, 0.2], [0.5, -2]], [[[0, 0], [0.5, 0.2]]], [0.4], eye, eye, [[1, 0]])
    >>> best = design(tanks)
    >>> 0 < best.bracket.lower <= best.value
    True
    """
    rule, (goal, level) = one_of(DegreeRule, rule), aimed(goal, level)
    system, signals = _read(plant, delayed=delayed, delays=delays, measured=measured)
    degree = None if degree is None else at_most("degree", degree, HIGHEST)
    order, margin = at_most("order", order, FINEST), positive_scalar("margin", margin)
    if goal is not Goal.HINF:
        if system.noiseless:
            raise InvalidInputError(
                f"the goal {goal} needs a plant with noise in y: without it the gains are infinite; give a "
                "DelayPlant(..., d21=..)"
            )
        if rule is not DegreeRule.BESSEL or margin != MARGIN:
            raise InvalidInputError("rule and margin belong to the goal hinf")
        return mean_design(system, goal=goal, degree=degree, level=level, signals=signals, order=order)
    if not system.noiseless:
        if rule is not DegreeRule.BESSEL:
            raise InvalidInputError(
                f"rule must be bessel for a plant with noise, got {rule}; the others need y = C_2 x"
            )
        return design_general(system, degree=degree, margin=margin, level=level, signals=signals, order=order)
    require_independent(system.c2)
    degree = degree_for(system, rule) if degree is None else degree
    if level is None:
        least = _minimum(system, degree, rule)
        target = least.gamma * (1 + margin)
        how = f"degree {degree} of the {rule} rule, {least.solution.report.name} {least.solution.report.version}"
        facts: tuple[Evidence, ...] = (Evidence("least level", least.gamma, how),)
    else:
        target, facts = level, ()
    return result_of(system, certificate_at(system, target, degree, rule), facts, signals=signals, order=order)


@decided
def analyse(
    plant: DelayPlant | StateSpace,
    *,
    delayed: Sequence[Any] | None = None,
    delays: Sequence[float] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> DelayAnalysis:
    """The plant without an observer.

    Parameters
    ----------
    plant : DelayPlant or control.StateSpace
        As in `design`.
    delayed, delays, measured : see there
        As in `design`.

    Returns
    -------
    DelayAnalysis
        The rightmost root (1/s), the number of unstable roots, how much w moves z, and what is known of the least level
        of any observer.

    Raises
    ------
    InvalidInputError
        An argument does not fit.
    SolverError
        Rounding decides.
    """
    system, _ = _read(plant, delayed=delayed, delays=delays, measured=measured)
    return DelayAnalysis(plant=system, evidence=left_alone(system))


def simulate(result: DelayResult, times: Any, disturbance: Any) -> Simulation:
    """The estimation error from rest, by the model of `to_statespace`.

    Parameters
    ----------
    result : DelayResult
        What `design` gave.
    times : array (M,)
        Equidistant instants, s.
    disturbance : array (M, r)
        w at these instants, linear between them.

    Returns
    -------
    Simulation
        Signals "error of z" (M, p), "error of x" (M, n) and "disturbance".

    Raises
    ------
    InvalidInputError
        Another shape, unequal steps or a disturbance that is zero.
    """
    DelayResult.require(result)
    error = result.gains_of.error_model(result.order)
    trajectory = over_time(error, times, disturbance, result.plant.states)
    names = result.signals
    signals = {
        "error of z": (trajectory.output, names.called(names.outputs)),
        "error of x": (trajectory.state, names.called(names.states)),
        "disturbance": (trajectory.disturbance, names.disturbances or numbered("w", trajectory.disturbance.shape[1])),
    }
    return simulated(result.method, trajectory.times, signals, ratio=trajectory.gain, steps=False)


def _minimum(system: DelayPlant, degree: int, rule: DegreeRule) -> LeastGain:
    """`minimum_gain`, refused where the optimum may be zero: measurements without noise may reveal w."""
    rank = np.linalg.matrix_rank(system.c2 @ system.b)
    advice = (
        f"y has no noise and may reveal w here ({system.inputs} disturbances, {system.measurements} measurements, "
        f"C_2 B of rank {rank}); let more disturbances act on the measured states, or ask for a `level`"
    )
    try:
        least = minimum_gain(system, degree, rule)
    except (InfeasibleError, SolverError) as error:
        if system.inputs > rank == system.measurements:
            raise
        raise type(error)(f"{error}; {advice}") from error
    if least.lower <= 0.0:
        raise InfeasibleError(f"the least level cannot be told from zero (found {least.gamma:.3g}): {advice}")
    return least
