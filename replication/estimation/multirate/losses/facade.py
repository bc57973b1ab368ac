"""Multi-rate observers whose samples are lost: what a design guarantees then, and designs for losses.

losses.analyse(best, losses.InARow(2))             worst case over all patterns, with a bracket
losses.analyse(best, losses.Independent(0.1))      mean square error, exact
losses.design(best, losses.Markov(0.05, 0.6))      gains that know which samples came
"""

from __future__ import annotations

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.simulation import Simulation, simulated
from replication.estimation.linear.norms import worst_case_response
from replication.estimation.multirate.losses.automaton import along, automaton, require_detectable
from replication.estimation.multirate.losses.mean import mean_square, mean_square_gains, require_seen
from replication.estimation.multirate.losses.models import InARow, LossModel
from replication.estimation.multirate.losses.result import LossResult, loss_result
from replication.estimation.multirate.losses.simulation import (
    DrawnLosses,
    drawn_errors,
    drawn_nodes,
    drawn_walks,
    kalman_errors,
    mean_and_error,
)
from replication.estimation.multirate.losses.worst import least_gains
from replication.estimation.multirate.problem import disturbances
from replication.estimation.multirate.result import MultirateResult
from replication.estimation.validation import positive_integer

SHARE = 10
"""The covariance of the Kalman filter counts after this part of the steps: it has forgotten its start then."""


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
    _require(result, model)
    return loss_result(result, model)


def design(result: MultirateResult, model: LossModel) -> LossResult:
    """Gains that depend on which samples come, and on what the model remembers of those before.

    Parameters
    ----------
    result : MultirateResult
        A design for the same plant and schedule without losses.
    model : InARow, Independent or Markov
        What may be lost.

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
    _require(result, model)
    problem, given = result.problem, automaton(result.problem, model)
    if isinstance(model, InARow):
        require_detectable(problem, given)
        return loss_result(result, model, least_gains(problem, given, result.value))
    require_seen(problem, given)
    return loss_result(result, model, mean_square_gains(problem, given))


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
    exact = mean_square(problem, result.automaton, gains)
    nodes = drawn_nodes(result.automaton, exact.visited, runs, rng)
    walks = list(drawn_walks(result.automaton, nodes, count, rng))
    start = exact.X[nodes] / exact.visited[nodes][:, None, None]
    whole = count - count % problem.schedule.period or count  # each phase counts alike
    squares = drawn_errors(problem, gains, walks, start, rng)
    known = kalman_errors(problem, result.automaton, walks, start)
    mean, error = mean_and_error(squares[:whole])
    kalman, kalman_error = mean_and_error(known[whole // SHARE :])
    return DrawnLosses(
        mean_square=mean,
        standard_error=error,
        exact=exact.rms**2,
        kalman=kalman,
        kalman_standard_error=kalman_error,
        time=time,
        course=squares.mean(axis=1),
    )


def _require(result: MultirateResult, model: LossModel) -> None:
    MultirateResult.require(result)
    if not isinstance(model, LossModel):
        raise InvalidInputError(f"model must be an InARow, Independent or Markov, got {type(model).__name__}")
