"""The periodic Kalman filter against peers: control.dlqe on the lifted plant, and filterpy step by step.

Both do the same work to the same accuracy, which is asserted; ratios hold within a run. filterpy is no dependency: its
row is there where it is installed.
"""

from typing import Any

import control
import numpy as np
import pytest
import scipy.linalg

from benchmarks.clock import median_times
from papers.okajima2023.printed import PLANT as PRINTED
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.multirate.kalman import filter_gains, kalman_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.multirate.running import KalmanFilter, StartingFilter

PLANT = MultiratePlant(**PRINTED)
ROUNDS, STEPS = 60, 2000
EQUAL = 1e-9


def lifted(problem: MultirateProblem) -> Stage:
    """From all noise (d, w) of a period to the measurements of a period."""
    plant, stages = problem.plant, []
    drive = np.hstack([plant.B_d, plant.B_w])
    for rows in problem.measured_rows():
        noise = np.hstack([np.zeros((len(rows), plant.B_d.shape[1])), plant.D[rows]])
        stages.append(Stage(plant.A, drive, plant.C[rows], noise))
    return PeriodicSystem(tuple(stages)).lift()


def uncorrelated(plant: Stage) -> tuple[np.ndarray, ...]:
    """The same equation without a cross-covariance, which dlqe has no place for."""
    A, B, C, D = plant
    R = D @ D.T
    S = np.linalg.solve(R, D @ B.T).T
    rest = B - S @ D
    return A - S @ C, np.eye(len(A)), C, rest @ rest.T, R


@pytest.mark.parametrize("periods", [(1, 1), (2, 3), (2, 5), (4, 5), (8, 9)], ids=str)
def test_periodic_kalman_against_dlqe(benchmark: Any, periods: tuple[int, int]) -> None:
    """All covariances and gains of the period, against the covariance at its start on the plant lifted beforehand."""
    problem = MultirateProblem(PLANT, SensingSchedule(periods))
    stage = lifted(problem)
    given = uncorrelated(stage)
    A, B, C, D = stage
    ours, ready, whole, riccati = median_times(
        lambda: kalman_design(problem),
        lambda: control.dlqe(*given),
        lambda: control.dlqe(*uncorrelated(lifted(problem))),
        lambda: scipy.linalg.solve_discrete_are(A.T, C.T, B @ B.T, D @ D.T, s=B @ D.T),
        rounds=ROUNDS,
    )
    X = benchmark.pedantic(kalman_design, args=(problem,), rounds=ROUNDS).X[0]
    P = control.dlqe(*given)[1]
    benchmark.extra_info.update(
        N=problem.schedule.period,
        of_dlqe_on_a_lifted_plant=ours / ready,
        of_lifting_and_dlqe=ours / whole,
        of_scipys_equation=ours / riccati,
        difference=float(np.abs(X - P).max() / np.abs(P).max()),
    )
    np.testing.assert_allclose(X, P, atol=EQUAL * np.abs(P).max())
    assert ours <= ready
    assert ours <= 0.7 * whole


@pytest.mark.parametrize("kind", ["steady", "starting"])
def test_a_step_against_filterpy(benchmark: Any, kind: str) -> None:
    peer = pytest.importorskip("filterpy.kalman")
    problem = MultirateProblem(PLANT, SensingSchedule((1, 1)))
    X = kalman_design(problem).X
    own = KalmanFilter(problem, filter_gains(problem, X)) if kind == "steady" else StartingFilter(problem, np.eye(3))
    other = peer.KalmanFilter(dim_x=3, dim_z=2)
    other.F, other.Q, other.H, other.R = PLANT.A, PLANT.B_d @ PLANT.B_d.T, PLANT.C, PLANT.D @ PLANT.D.T
    other.x, other.P = np.zeros(3), X[0].copy() if kind == "steady" else np.eye(3)
    measurements = np.random.default_rng(1).normal(size=(STEPS, 2))
    for y in measurements[:50]:
        other.update(y)
        step = own.step(None, y)
        np.testing.assert_allclose(step.filtered, np.ravel(other.x), atol=EQUAL)
        np.testing.assert_allclose(step.covariance, other.P, atol=EQUAL)
        other.predict()

    def ours() -> None:
        own.reset()
        for y in measurements:
            own.step(None, y)

    def theirs() -> None:
        other.P = np.eye(3)
        for y in measurements:
            other.update(y)
            other.predict()

    benchmark.pedantic(ours, rounds=5)
    mine, its = median_times(ours, theirs, rounds=7)
    benchmark.extra_info.update(steps=STEPS, of_filterpy=mine / its)
    if kind == "steady":
        assert mine < its
