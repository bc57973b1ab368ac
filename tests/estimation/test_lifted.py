"""The operator form of long periods against the dense lift: same response, same norms, same bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replication.errors import SolverError
from replication.estimation.linear import norms, periodic
from replication.estimation.linear.norms import l2_gain
from replication.estimation.linear.periodic import (
    LiftedResponse,
    PeriodicSystem,
    Stage,
    frequency_response,
    largest_singular_value,
)
from replication.estimation.multirate import optimum as optima
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.optimum import noncausal_bound
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import ComplexArray
from tests.tolerances import ROUNDING

RANDOM = MultiratePlant(
    A=[[0.95, 0.5, 0.2], [-0.1, 1.1, -0.2], [0, 0.1, 0.85]],
    B_d=[[0.1], [0.3], [0.2]],
    C=[[1, 0.5, 0], [1, 2.5, 0.2]],
    D=[[1, 0], [0.3, 0.5]],
)


def shrinking_system(seed: int, n: int, N: int) -> PeriodicSystem:
    """A stable system whose inputs and outputs change in number from stage to stage, down to none."""
    rng = np.random.default_rng(seed)
    stages = []
    for _ in range(N):
        m, p = rng.integers(0, 4, 2)
        A = rng.normal(size=(n, n))
        A *= 0.9 / np.linalg.norm(A, 2)
        stages.append(Stage(A, *(rng.normal(size=shape) for shape in ((n, m), (p, n), (p, m)))))
    return PeriodicSystem(tuple(stages))


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 60), st.floats(0, np.pi))
def test_the_operator_and_its_adjoint_are_the_lifted_matrix(seed: int, n: int, N: int, angle: float) -> None:
    system, rng = shrinking_system(seed, n, N), np.random.default_rng(seed)
    matrix = frequency_response(system.lift(), angle)
    response = LiftedResponse(system)
    assert response.inputs == matrix.shape[1]
    forward, adjoint = response.at(angle)
    u, v = rng.normal(size=(2, matrix.shape[1])) + 1j * rng.normal(size=(2, matrix.shape[1]))
    gram = matrix.conj().T @ matrix
    scale = max(1.0, float(np.linalg.norm(gram))) * (1 + float(np.linalg.norm(v)))
    np.testing.assert_allclose(adjoint(forward(v)), gram @ v, atol=ROUNDING * scale)
    # The outputs are turned: their inner products are kept.
    assert abs(np.vdot(forward(u), forward(v)) - np.vdot(u, gram @ v)) <= ROUNDING * scale * (1 + np.linalg.norm(u))
    expected = np.linalg.norm(matrix, 2) if matrix.size else 0.0
    found = largest_singular_value(lambda x: adjoint(forward(x)), response.inputs)
    assert found == pytest.approx(expected, rel=ROUNDING)


def as_operators(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(norms, "DENSE_INPUTS", 0)
    monkeypatch.setattr(optima, "DENSE_INPUTS", 0)


@pytest.mark.parametrize("periods", [(1, 1), (2, 3), (3, 3), (5, 7), (8, 9)])
def test_short_periods_have_the_same_norms_either_way(
    periods: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = MultirateProblem(RANDOM, SensingSchedule(periods))
    system = problem.error_system(kalman_design(problem).gains)
    gain, bound = l2_gain(system), noncausal_bound(problem)
    as_operators(monkeypatch)
    assert l2_gain(system).value == pytest.approx(gain.value, rel=ROUNDING)
    assert noncausal_bound(problem).value == pytest.approx(bound.value, rel=ROUNDING)


def test_what_no_disturbance_reaches_is_zero_either_way(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = MultiratePlant(A=np.diag([0.5, 0.8]), B_d=[[1], [0]], C=np.eye(2), D=np.eye(2), W=[[0, 1]])
    problem = MultirateProblem(plant, SensingSchedule((2, 3)))
    assert noncausal_bound(problem).upper == 0.0
    as_operators(monkeypatch)
    assert noncausal_bound(problem).upper == 0.0


def test_a_long_period_forms_no_lifted_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stages that repeat have the norm of one, whatever the period they are given in."""
    stage = shrinking_system(3, 4, 1).stages[0]
    one = l2_gain(PeriodicSystem((stage,)))
    longest: list[int] = []
    lift = PeriodicSystem.lift

    def recorded(system: PeriodicSystem) -> Stage:
        longest.append(system.period)
        return lift(system)

    monkeypatch.setattr(PeriodicSystem, "lift", recorded)
    assert l2_gain(PeriodicSystem((stage,) * 500)).value == pytest.approx(one.value, rel=ROUNDING)
    assert max(longest) <= periodic.CHUNK


def test_lanczos_says_when_it_does_not_settle(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(periodic, "MAX_STEPS", 3)
    spread = np.arange(50.0)

    def gram(v: ComplexArray) -> ComplexArray:
        return spread * v

    with pytest.raises(SolverError, match="no largest singular value in 3 steps"):
        largest_singular_value(gram, 50)
    monkeypatch.undo()
    assert largest_singular_value(gram, 50) == pytest.approx(7.0, rel=ROUNDING)


def test_only_a_value_below_the_floor_is_rounding() -> None:
    """The floor is one of the singular value, the operator has its square."""
    gram = np.full(3, 0.01)
    assert largest_singular_value(lambda v: gram * v, 3, floor=0.05) == pytest.approx(0.1, rel=ROUNDING)
    assert largest_singular_value(lambda v: gram * v, 3, floor=0.2) == 0.0
