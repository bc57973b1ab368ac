"""Multi-rate observers for a plant of one's own: `design`, `analyse`, `simulate` (Okajima et al., 2023).

The plant is sampled at a base period; sensor i measures every periods[i] of them, offsets[i] later. A design gives the
periodic gains with the smallest worst-case gain from process and sensor noise to the weighted estimation error
(`hinf`), with the smallest mean square error for white noise (`h2`, the Kalman filter), or between both (`mixed`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.design import Solution
from replication.estimation.api.plants import ADDED, Signals, is_statespace, numbered, parts_of, read_plant
from replication.estimation.api.shown import Goal, Simulation, aimed
from replication.estimation.multirate.kalman import require_noise_near
from replication.estimation.multirate.latency import ContinuousPlant, delivered, sampled_statespace
from replication.estimation.multirate.optimum import DESIGN_MARGIN, MISSED, least_error_offsets, optimum, search_timing
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.multirate.result import KalmanResult, MultirateResult
from replication.estimation.validation import Array, StateSpace, as_array, covariance, positive_scalar


def _of_statespace(
    system: Any, *, noise: Any, disturbances: Any, weight: Any, Q: Any, R: Any, S: Any
) -> tuple[MultiratePlant, Signals]:
    """The plant in a `control.StateSpace`, with the noise of the sensors, and the inputs that are process noise."""
    if (noise is None) == (R is None):
        raise InvalidInputError(
            "give the sensor noise: noise=D, or one number for each sensor; or R, its covariance, but not both"
        )
    if np.ndim(weight) == 1:
        raise InvalidInputError(
            f"weight must have a row for each weighted error and a column for each of the {system.nstates} states; "
            f"write a row as [{weight}]"
        )
    if np.ndim(noise) == 1 and any(isinstance(number, (int, float, np.integer)) and number < 0 for number in noise):
        raise InvalidInputError(f"noise must be the size of each sensor's noise, not negative, got {noise}")
    # A list of numbers stands for a diagonal matrix: each sensor with noise of its own.
    D = np.diag(noise) if np.ndim(noise) == 1 else noise
    plant = MultiratePlant.from_statespace(system, D, disturbances=disturbances, W=weight, Q=Q, R=R, S=S)
    read = parts_of(system, continuous=False, disturbances=disturbances).signals
    names = {"states": read.states, "inputs": read.inputs, "measurements": read.measurements, "outputs": None}
    # A covariance mixes the inputs, whose names then say nothing of the noise that counts.
    return plant, replace(plant.signals.named(names, None), disturbances=read.disturbances if Q is None else ())


def _read(plant: Any, **options: Any) -> tuple[MultiratePlant, Signals]:
    """A discrete-time plant with process and sensor noise, and its names; raises InvalidInputError."""
    return read_plant(
        plant,
        MultiratePlant,
        _of_statespace,
        options,
        arrays="MultiratePlant",
        advice="; arrays make one: MultiratePlant(A=.., B_d=.., C=.., D=..)",
        refusal="noise, disturbances, weight, Q, R and S belong to a control.StateSpace; a MultiratePlant has D, B_d "
        "and W (MultiratePlant.from_covariances takes Q, R and S)",
    )


def design(
    plant: MultiratePlant | ContinuousPlant | StateSpace,
    *,
    periods: Sequence[int],
    offsets: Sequence[int] | Literal["best"] = (),
    level: float | None = None,
    goal: Goal | str = Goal.HINF,
    noise: Any = None,
    disturbances: Sequence[int | str] | None = None,
    weight: Any = None,
    Q: Any = None,
    R: Any = None,
    S: Any = None,
    P0: Any = None,
    latency: Sequence[float] = (),
    dt: float | None = None,
) -> MultirateResult:
    """The observer with the smallest worst-case gain, with a gain below `level`, or with the smallest mean error.

    Parameters
    ----------
    plant : MultiratePlant, ContinuousPlant or control.StateSpace
        Plant of arrays, or a system, in discrete time or with `dt`; `noise`, `disturbances`, `weight`, `Q`, `R` and `S`
        belong to the latter.
    periods : sequence of int, one per sensor
        Sensing periods N_i, in base periods.
    offsets : sequence of int, one per sensor, or "best"
        First instants 0 <= theta_i < N_i of the sensors, in base periods; zeros unless given. "best" searches all, one
        after the other (`search_timing` takes a way to use every core).
    level : float, optional
        Gain to stay below; the least one unless given. With "mixed" the gain between least and Kalman filter's whose
        design loses the same share of both unless given.
    goal : "hinf", "h2" or "mixed"
        Least gain; least mean square error for white noise (the Kalman filter); or a gain below `level` with the least
        entropy, a bound of the mean square error.
    noise : array (q, q_w), or (q,)
        Sensor noise matrix D, or one number for each sensor; or `R`.
    disturbances : sequence of int or str, optional
        Inputs that are process noise, by index or name; all unless given. The others are known inputs u.
    weight : array (n_z, n), optional
        W of z = W e; the identity unless given.
    Q : array (m_d, m_d), optional
        Covariance of the disturbances; the identity unless given.
    R : array (q, q) or (q,), optional
        Covariance of the sensor noise, or variances, in place of `noise`.
    S : array (m_d, q), optional
        Covariance of disturbances and sensor noise; zero unless given.
    P0 : array (n, n), optional
        With "h2": covariance of the error of the start, for the running filter; the steady state unless given.
    latency : sequence of float, one per sensor, optional
        How old a sample is at the instant at which it is used, in base periods; zeros unless given. Periods and offsets
        say when samples are used. A latency that is not whole needs a plant in continuous time.
    dt : float, optional
        Base period in s, at which a `control.StateSpace` in continuous time is sampled; inputs are held.

    Returns
    -------
    MultirateResult
        Gains L (N, n, q) with the exact gain of their error system; the evidence holds the optimum. With "h2" a
        `KalmanResult`, which has the covariances and the filtered and smoothed estimates, too.

    Raises
    ------
    InvalidInputError
        An argument does not fit, see `MultiratePlant`, `SensingSchedule` and `MultirateProblem`.
    InfeasibleError
        No observer reaches the level; the message names the least one.
    SolverError
        Rounding hides the limit of the Riccati recursion, or spoils the gains.

    Notes
    -----
    Plant, schedule and error system are those of eqs. (2)-(4), (16) and (18). The least gain comes from a periodic
    Riccati recursion in place of the matrix inequalities of the paper.

    Examples
    --------
    >>> cart = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=np.diag([0.5, 0.1]))
    >>> best = design(cart, periods=(1, 4), offsets=(0, 2))
    >>> best.gains["L"].shape
    (4, 2, 2)
    >>> best.bracket.lower <= best.value <= 1.000001 * best.fact("optimum").value
    True
    """
    goal, target = aimed(goal, level)
    if goal is not Goal.H2 and P0 is not None:
        raise InvalidInputError("P0 belongs to the goal h2; the level of hinf and mixed is that from rest")
    arguments = {"noise": noise, "disturbances": disturbances, "weight": weight, "Q": Q, "R": R, "S": S}
    problem, signals = _problem(plant, periods, offsets, goal, latency, dt, **arguments)
    if P0 is not None and problem.plant.under_way:
        raise InvalidInputError("P0 and latency do not go together: it does not say what is known of samples under way")
    start = None if P0 is None else covariance("P0", P0, problem.plant.order)
    try:
        best = optimum(problem)
        if goal is Goal.H2:
            return KalmanResult.analysed(signals, KalmanResult.solve(problem, best=best), problem=problem, start=start)
        result = MultirateResult.design(problem, signals, best=best, goal=goal, level=target)
    except (InfeasibleError, SolverError):  # unless more than the least was asked for: lost in rounding
        if target is None:
            require_noise_near(problem)
        raise
    aim = best.upper * (1 + DESIGN_MARGIN) if target is None else target
    if goal is Goal.HINF and result.bracket.lower > aim * (1 + MISSED):
        require_noise_near(problem)
        raise SolverError(
            f"gains for the level {aim:.6g} have the gain {result.bracket.lower:.6g}: they were lost in rounding; "
            "measure more often, or ask for a larger level"
        )
    return result


def analyse(
    plant: MultiratePlant | ContinuousPlant | StateSpace,
    gains: Any,
    *,
    periods: Sequence[int],
    offsets: Sequence[int] = (),
    noise: Any = None,
    disturbances: Sequence[int | str] | None = None,
    weight: Any = None,
    Q: Any = None,
    R: Any = None,
    S: Any = None,
    latency: Sequence[float] = (),
    dt: float | None = None,
) -> MultirateResult:
    """What given gains guarantee.

    Parameters
    ----------
    plant : MultiratePlant, ContinuousPlant or control.StateSpace
        As in `design`.
    gains : array (N, n, q)
        L_k for each instant of the schedule; columns of sensors that do not measure then have no effect.
    periods : sequence of int, one per sensor
        As in `design`, in base periods.
    offsets, noise, disturbances, weight, Q, R, S, latency, dt : see there
        As in `design`.

    Returns
    -------
    MultirateResult
        The same gains with the exact gain of their error system, beside the optimum.

    Raises
    ------
    InvalidInputError
        An argument does not fit, or the gains have another shape.
    InfeasibleError
        The gains do not stabilise the error.
    """
    arguments = {"noise": noise, "disturbances": disturbances, "weight": weight, "Q": Q, "R": R, "S": S}
    problem, signals = _problem(plant, periods, offsets, Goal.HINF, latency, dt, **arguments)
    solution = Solution({"L": problem.checked(gains)}, own={"best": optimum(problem)})
    return MultirateResult.analysed(signals, solution, problem=problem)


def simulate(
    result: MultirateResult,
    steps: int,
    *,
    disturbance: Literal["none", "white", "worst"] | Array = "none",
    initial_error: Any = None,
    rng: np.random.Generator | None = None,
) -> Simulation:
    """The weighted error W e over some instants.

    Parameters
    ----------
    result : MultirateResult
        What `design` or `analyse` gave.
    steps, disturbance : see there
        As in `MultirateResult.simulate`, with the disturbance (d, w): process noise, then that of the sensors.
    initial_error : array (n,), optional
        e(0), in the units of the states; zero unless given. Late samples that are under way then tell the truth.
    rng : numpy.random.Generator, optional
        Where white noise is drawn from.

    Returns
    -------
    Simulation
        Signals "error" (steps, n_z) and "disturbance".

    Raises
    ------
    InvalidInputError
        Another shape or word, or "white" without `rng`.
    """
    MultirateResult.require(result)
    late, start = result.problem.plant.under_way, initial_error
    if late and start is not None:
        start = np.append(as_array("initial_error", start, (result.problem.plant.order - late,)), np.zeros(late))
    return result.simulate(steps, disturbance=disturbance, initial_error=start, rng=rng)


def _problem(
    plant: Any, periods: Any, offsets: Any, goal: Goal, latency: Any, dt: Any, **arguments: Any
) -> tuple[MultirateProblem, Signals]:
    """The plant at its base period under its schedule, samples that are under way being states; and its names."""
    between, whole = None, plant
    if isinstance(plant, ContinuousPlant):
        between, whole = plant.after, plant.after(plant.dt)
    if dt is not None:
        if not is_statespace(plant) or plant.isdtime(strict=True):
            raise InvalidInputError(
                "dt belongs to a control.StateSpace in continuous time; other plants have their own"
            )
        step = positive_scalar("dt", dt, unit="seconds")
        whole = sampled_statespace(plant, step, step)

        def between(time: float) -> MultiratePlant:
            return _read(sampled_statespace(plant, time, step), **arguments)[0]

    checked, signals = _read(whole, **arguments)
    if np.size(latency):
        checked = delivered(checked, latency, between)
        signals = replace(signals, states=(*signals.states, *numbered(ADDED, checked.under_way)))
    if isinstance(offsets, str) and offsets == "best":
        offsets = least_error_offsets(checked, periods) if goal is Goal.H2 else search_timing(checked, periods).best
    return MultirateProblem(checked, SensingSchedule(periods, offsets)), signals
