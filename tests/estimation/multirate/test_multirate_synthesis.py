"""Theorems 1 and 2 against the Riccati optimum and the exact norm, on the problems that the paper solves."""

from typing import Any

import cvxpy
import numpy as np
import pytest
from multirate_examples import PAPER, PUBLISHED, drawn_plant
from multirate_examples import problem as problem_of

from papers.okajima2023.method import lmi
from papers.okajima2023.method.lmi import (
    CentralPoint,
    central_path,
    lmi_analysis,
    lmi_design,
    reduced_lmi_design,
    theorem1_matrix,
    theorem2_matrix,
    theorem2_size,
)
from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import SolverReport, raise_unless_solved
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import kalman_design, optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array
from tests.tolerances import ACHIEVED, AGREEMENT


def smallest_eigenvalue(P: Array) -> float:
    return float(np.min(np.linalg.eigvalsh(P)))


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize(("design", "status"), [(lmi_design, "optimal"), (reduced_lmi_design, "Solved")])
def test_theorem_2_reaches_the_optimum(design: Any, status: str, name: str) -> None:
    published, found = PUBLISHED[name], design(PUBLISHED[name])
    best, achieved = optimum(published), l2_gain(published.error_system(found.gains))
    assert found.level == pytest.approx(best.value, rel=AGREEMENT)
    assert best.lower * (1 - AGREEMENT) <= achieved.upper
    assert achieved.lower <= best.value * (1 + ACHIEVED)
    assert smallest_eigenvalue(found.P) > 0
    assert found.report.status == status


@pytest.mark.parametrize("name", ["table (2, 3)", "table (3, 3)", "case A", "case 2"])
def test_theorem_1_certifies_the_exact_norm(name: str) -> None:
    """The inequality is necessary and sufficient, so its optimum is the norm, also of gains that are not optimal."""
    published = PUBLISHED[name]
    gains = kalman_design(published).gains
    # Where the level is flat in P the solver stops a digit early and says so; its level is held to the norm as well.
    analysis = lmi_analysis(published, gains, accept=("optimal", "optimal_inaccurate"))
    exact = l2_gain(published.error_system(gains))
    assert analysis.level == pytest.approx(exact.value, rel=ACHIEVED)
    assert smallest_eigenvalue(analysis.P) > 0
    for k in range(published.schedule.period):
        theta = np.block(theorem1_matrix(published, gains, analysis.P, k, analysis.level**2))
        assert smallest_eigenvalue((theta + theta.T) / 2) > -ACHIEVED


def test_gains_of_sensors_that_are_not_measured_are_zero_and_without_effect() -> None:
    published = PUBLISHED["table (2, 3)"]
    mask = published.schedule.mask[:, None, :]
    for gains in (lmi_design(published).gains, reduced_lmi_design(published).gains, kalman_design(published).gains):
        assert not np.any(gains * ~mask)
    noise = np.random.default_rng(0).normal(size=gains.shape) * ~mask
    disturbed = l2_gain(published.error_system(gains + noise))
    assert disturbed.value == l2_gain(published.error_system(gains)).value


def test_the_size_of_the_printed_problem() -> None:
    """Counted from the blocks themselves: N (n (n + 1) / 2 + n q) + 1 unknowns, matrices of 2 n + m + q rows."""
    published = PUBLISHED["table (2, 3)"]
    N, n, q = published.schedule.period, PAPER.order, PAPER.sensors
    unknowns = N * (sum(range(n + 1)) + n * q) + 1
    P, Y = np.zeros((N, n, n)), np.zeros((N, n, q))
    rows = len(np.block(theorem2_matrix(published, P, Y, 0, 1.0)))
    assert theorem2_size(published) == (unknowns, rows)
    assert theorem2_size(published, cyclic=True) == (sum(range(N * n + 1)) + N * n * N * q + 1, 2 * N * n + N * (1 + q))


@pytest.mark.parametrize("design", [lmi_design, reduced_lmi_design])
def test_a_solver_that_stops_early_gives_no_number(design: object, monkeypatch: pytest.MonkeyPatch) -> None:
    from replication.estimation.conic import program as solvers

    monkeypatch.setitem(solvers.CLARABEL_OPTIONS, "max_iter", 2)
    assert callable(design)
    with pytest.raises(SolverError, match=r"MaxIterations|user_limit"):
        design(PUBLISHED["case A"])


@pytest.mark.parametrize(
    ("status", "error"),
    [
        ("PrimalInfeasible", InfeasibleError),
        ("DualInfeasible", InfeasibleError),
        ("AlmostPrimalInfeasible", InfeasibleError),
        ("infeasible_inaccurate", InfeasibleError),
        ("AlmostSolved", SolverError),
        ("optimal_inaccurate", SolverError),
        ("NumericalError", SolverError),
    ],
)
def test_every_status_but_solved_is_an_error(status: str, error: type[Exception]) -> None:
    report = SolverReport(name="Clarabel", version="0", status=status)
    for accept in (lmi.ACCEPTED, lmi.SOLVED):
        with pytest.raises(error, match=status):
            raise_unless_solved(report, accept=accept)
    raise_unless_solved(report, accept=(status,))


def random_problem(seed: int, n: int, periods: tuple[int, ...]) -> MultirateProblem:
    return problem_of(drawn_plant(np.random.default_rng(seed), n, len(periods), 2), periods)


def kalman_gains(problem: MultirateProblem) -> Array:
    return kalman_design(problem).gains


def path(problem: MultirateProblem, relative_gap: float, factor: float = 3.0) -> list[CentralPoint]:
    gap = relative_gap * optimum(problem).value ** 2
    return list(central_path(problem, kalman_gains(problem), gap=gap, factor=factor))


PROBLEMS = [(1, 2, (1,)), (2, 2, (2,)), (3, 3, (2, 3)), (4, 3, (2, 2)), (5, 1, (3,))]


@pytest.mark.parametrize(("seed", "n", "periods"), PROBLEMS)
def test_each_point_brackets_the_optimum_and_its_gains_keep_their_level(
    seed: int, n: int, periods: tuple[int, ...]
) -> None:
    problem = random_problem(seed, n, periods)
    best = optimum(problem).value
    points = path(problem, 1e-6)
    assert len(points) > 5
    for point in points:
        assert l2_gain(problem.error_system(point.gains)).lower < point.level
        # Rounding of the optimum itself, relative to a bracket of width gap.
        assert point.level**2 - point.gap <= best**2 * (1 + 1e-9)
        assert best <= point.level
        due = np.swapaxes(point.gains, 1, 2)
        assert np.all(due[~problem.schedule.mask] == 0) and np.all(due[problem.schedule.mask].any(axis=-1))
    assert points[-1].level / best - 1 < 1e-6


def test_the_centre_of_the_printed_inequality_is_the_same_by_a_general_solver() -> None:
    """At the level of a point, the reduced and the full inequality share their centre: they differ by a constant."""
    problem = random_problem(7, 2, (2, 1))
    point = path(problem, 0.3)[-1]
    P = [cvxpy.Variable((2, 2), symmetric=True) for _ in range(2)]
    Y = [cvxpy.Variable((2, 2)) for _ in range(2)]
    matrices = [cvxpy.bmat(theorem2_matrix(problem, P, Y, k, point.level**2)) for k in range(2)]
    task = cvxpy.Problem(cvxpy.Maximize(sum(cvxpy.log_det((F + F.T) / 2) for F in matrices)))
    task.solve(solver=cvxpy.CLARABEL)
    assert task.status == "optimal"
    gains = np.array([np.linalg.solve(P_k.value, Y_k.value) for P_k, Y_k in zip(P, Y, strict=True)])
    measured = np.swapaxes(np.broadcast_to(problem.schedule.mask[:, :, None], (2, 2, 2)), 1, 2)
    # A general solver stops at 1e-8 in the objective, which is flat at the centre: about its root, 1e-4, in the gains.
    np.testing.assert_allclose(gains[measured], point.gains[measured], atol=1e-4)


def test_a_path_that_cannot_be_followed_says_what_to_change() -> None:
    problem = random_problem(3, 3, (2, 3))
    gains = kalman_gains(problem)
    undisturbed = MultiratePlant(A=np.diag([0.5, 0.9]), B_d=[[0], [1]], C=[[0, 1]], D=[[1]])
    for work in (
        lambda: list(central_path(problem, 50 + 0 * gains, gap=1)),
        lambda: lmi_analysis(problem, 50 + 0 * gains),
    ):
        with pytest.raises(InfeasibleError, match="do not stabilise"):
            work()
    with pytest.raises(SolverError, match="wider gap"):
        list(central_path(problem, gains, gap=1e-30, factor=10.0))
    with pytest.raises(SolverError, match="disturb every state"):
        list(central_path(problem_of(undisturbed, (2,)), np.zeros((2, 2, 1)), gap=1.0))
