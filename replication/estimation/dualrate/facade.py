"""Dual-rate output feedback for a plant of one's own: `design`, `analyse`, `compare`, `simulate`.

The input changes every period T, the sensor delivers every M T. The observer fills the instants between; which one
does so is a choice (`observer`, one of `OBSERVERS`). u = K x^, and L corrects the observer's differential equation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import EXACT_GAIN, Bracket, Evidence
from replication.estimation.api.shown import frozen
from replication.estimation.api.simulation import Simulation, simulated
from replication.estimation.dualrate.loop import (
    MARGINAL,
    close_loop,
    noise_gain,
    require_stable,
    stability_radius,
)
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, Plant, as_plant, dual_rate_design, signals_of
from replication.estimation.dualrate.response import time_response
from replication.estimation.dualrate.result import DualRateResult, noise_to_output
from replication.estimation.linear.norms import l2_gain
from replication.estimation.validation import Array, as_matrix

if TYPE_CHECKING:
    import control

DEFAULT_OBSERVER = "running_prediction"
"""The repaired predictor: between measurements it carries on from the last one."""
SUBSTEPS = 10
"""Points of a time response per fast period."""
SEMIDEFINITE = 1e-12
"""Negative eigenvalues of a weight up to so much of the largest are rounding."""


def design(
    plant: Plant | control.StateSpace,
    *,
    period: float,
    ratio: int,
    observer: str = DEFAULT_OBSERVER,
    state_weight: Any = None,
    input_weight: Any = None,
    process_noise: Any = None,
    sensor_noise: Any = None,
) -> DualRateResult:
    """A loop with the linear-quadratic K and the stationary Kalman gain L of the continuous-time plant.

    The loop that these gains make at the two rates is analysed exactly.

    Parameters
    ----------
    plant : control.StateSpace or Plant
        Strictly proper and continuous-time, or what `make_plant(A, B, C)` gives; n states, m inputs, p outputs.
    period : float
        Fast period T of the input, s.
    ratio : int
        M; the sensor delivers every M T.
    observer : str
        What fills the instants between, one of `OBSERVERS`.
    state_weight : array (n, n), optional
        Q in the integral of x'Qx + u'Ru that K minimises; C'C unless given.
    input_weight : array (m, m), optional
        R of that integral; the identity unless given.
    process_noise : array (n, n), optional
        Intensity of the process noise for which L is the Kalman gain; BB' unless given.
    sensor_noise : array (p, p), optional
        Intensity of the sensor noise; the identity unless given.

    Returns
    -------
    DualRateResult
        Gains K (m, n) and L (n, p), and the exact gain of their loop.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the rates lose an unstable mode.
    InfeasibleError
        There are no such gains, or the loop is unstable.

    Notes
    -----
    The plant is eq. (1) of Shao et al., the observer's differential equation (3), the feedback (8).

    Examples
    --------
    >>> from replication.estimation.dualrate import make_plant
    >>> servo = make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
    >>> loop = design(servo, period=0.01, ratio=20)
    >>> loop.fact("monodromy radius").value < 1
    True
    """
    model = as_plant(plant)
    A, B, C = model.state, model.input, model.output
    Q = _weight("state_weight", state_weight, C.T @ C)
    R = _weight("input_weight", input_weight, np.eye(B.shape[1]), definite=True)
    W = _weight("process_noise", process_noise, B @ B.T)
    V = _weight("sensor_noise", sensor_noise, np.eye(len(C)), definite=True)
    K = -np.linalg.solve(R, B.T @ _riccati(A, B, Q, R, "state_weight, input_weight"))
    L = np.linalg.solve(V, C @ _riccati(A.T, C.T, W, V, "process_noise, sensor_noise")).T
    return analyse(plant, feedback=K, injection=L, period=period, ratio=ratio, observer=observer)


def analyse(
    plant: Plant | control.StateSpace,
    *,
    feedback: Any,
    injection: Any,
    period: float,
    ratio: int,
    observer: str = DEFAULT_OBSERVER,
    discrete_gain: bool = False,
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
    ratio : int
        As in `design`.
    observer : str
        As in `design`.
    discrete_gain : bool
        Whether L corrects by steps instead of in the observer's differential equation.

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
    problem = dual_rate_design(plant, feedback=feedback, injection=injection, period=period, ratio=ratio)
    loop = close_loop(problem, _builder(observer), discrete_gain=discrete_gain)
    if stability_radius(loop) >= 1.0 - MARGINAL:
        require_stable(loop, _advice(problem, discrete_gain))
    gain = l2_gain(noise_to_output(loop))
    evidence = (
        Evidence("monodromy radius", stability_radius(loop), "largest eigenvalue over one slow period; stable below 1"),
        Evidence("noise to output", noise_gain(loop), "standard deviations, white noise, periodic Lyapunov equation"),
        Evidence("observer", observer, "discrete gain" if discrete_gain else "gain in the differential equation"),
        Evidence("fast period T", problem.period, "as given", "s"),
        Evidence("ratio M", problem.ratio, "as given"),
    )
    return DualRateResult(
        bracket=Bracket(gain.lower, gain.upper, EXACT_GAIN),
        gains=frozen({"K": problem.feedback, "L": problem.injection}),
        evidence=evidence,
        signals=signals_of(plant, problem.period),
        loop=loop,
        observer_name=observer,
        discrete_gain=discrete_gain,
    )


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
    return _radii(result.loop.design, result.discrete_gain)


def simulate(
    result: DualRateResult, start: Any, *, slow_periods: int, estimate: Any = None, output: int = 0
) -> Simulation:
    """The loop from given starts, without noise, between the instants too.

    Parameters
    ----------
    result : DualRateResult
        What `design` or `analyse` gave.
    start : array (n,)
        x(0).
    slow_periods : int
        How many slow periods M T.
    estimate : array (n,), optional
        x^(0); zero unless given.
    output : int
        Which output is shown, from 0.

    Returns
    -------
    Simulation
        Signals "output", "input" and "estimation error", ten points per fast period.

    Raises
    ------
    InvalidInputError
        A start of another length, or no such output.
    """
    DualRateResult.require(result)
    first = np.zeros(result.loop.design.model.size) if estimate is None else estimate
    response = time_response(result.loop, start, first, slow_periods=slow_periods, substeps=SUBSTEPS, output=output)
    held = np.repeat(np.arange(len(response.instants)), SUBSTEPS)
    signals = {
        "output": response.output[:, None],
        "input": response.input[held],
        "estimation error": (response.state - response.estimate)[held],
    }
    return simulated(result.method, response.time, signals, ratio=None, steps=False)


def _radii(problem: DualRateDesign, discrete_gain: bool) -> dict[str, float]:
    loops = {name: close_loop(problem, builder, discrete_gain=discrete_gain) for name, builder in OBSERVERS.items()}
    return {name: stability_radius(loop) for name, loop in loops.items()}


def _advice(problem: DualRateDesign, discrete_gain: bool) -> str:
    """Which observers would do with the same gains, and what else can be changed."""
    stable = [name for name, radius in _radii(problem, discrete_gain).items() if radius < 1.0 - MARGINAL]
    if "state_feedback" not in stable:
        return "so it is with the full state at every instant; choose a shorter period or a weaker feedback K"
    others = ", ".join(name for name in stable if name not in ("state_feedback", "fast_sensor"))
    choice = f"one of the observers {others}" if others else "a smaller ratio"
    return f"with the full state at every instant it would be stable; choose {choice}, or another gain L"


def _builder(observer: str) -> Any:
    if not isinstance(observer, str) or observer not in OBSERVERS or observer == "state_feedback":
        known = ", ".join(name for name in OBSERVERS if name != "state_feedback")
        raise InvalidInputError(f"observer must be one of {known}, got {observer!r}")
    return OBSERVERS[observer]


def _weight(name: str, value: Any, default: Array, *, definite: bool = False) -> Array:
    """The symmetric weight or `default`; InvalidInputError unless it is positive semidefinite, or definite if asked."""
    if value is None:
        return default
    size = len(default)
    matrix = as_matrix(name, value, rows=size, columns=size)
    least, largest = np.linalg.eigvalsh(matrix)[[0, -1]]
    good = least > 0 if definite else least >= -SEMIDEFINITE * max(largest, 0.0)
    if not np.array_equal(matrix, matrix.T) or not good:
        word = "definite" if definite else "semidefinite"
        raise InvalidInputError(f"{name} must be symmetric and positive {word}, got {matrix.tolist()}")
    return matrix


def _riccati(A: Any, B: Any, Q: Any, R: Any, weights: str) -> Any:
    try:
        return scipy.linalg.solve_continuous_are(A, B, Q, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InfeasibleError(
            f"the Riccati equation for {weights} has no stabilising solution ({error}): every unstable mode must be "
            "moved by the input and seen by the sensor, and no mode on the imaginary axis may be left out of the weight"
        ) from None
