"""Theorems 1 and 2 against the Riccati optimum and the exact norm, on the problems that the paper solves."""

from __future__ import annotations

import numpy as np
import pytest
from multirate_examples import PAPER, PUBLISHED, only_sensor, problem

from papers.okajima2023.method import lmi, reduced_lmi
from papers.okajima2023.method.lmi import (
    cyclic_lmi_design,
    cyclic_size,
    lmi_analysis,
    lmi_design,
    theorem1_matrix,
    theorem2_matrix,
    theorem2_size,
)
from papers.okajima2023.method.reduced_lmi import LmiDesign, reduced_lmi_design
from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic.program import SolverReport, raise_unless_solved
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import kalman_design, optimal_design, optimum
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array
from tests.tolerances import ACHIEVED, AGREEMENT, BRACKET


def smallest_eigenvalue(P: Array) -> float:
    return float(np.min(np.linalg.eigvalsh(P)))


def check(published: MultirateProblem, design: LmiDesign) -> None:
    best = optimum(published)
    assert design.level == pytest.approx(best.value, rel=AGREEMENT)
    achieved = l2_gain(published.error_system(design.gains))
    assert best.lower * (1 - AGREEMENT) <= achieved.upper
    assert achieved.lower <= best.value * (1 + ACHIEVED)
    assert smallest_eigenvalue(design.P) > 0


@pytest.mark.parametrize("name", PUBLISHED)
def test_theorem_2_as_printed_reaches_the_optimum(name: str) -> None:
    design = lmi_design(PUBLISHED[name])
    check(PUBLISHED[name], design)
    assert design.report.status == "optimal"


@pytest.mark.parametrize("name", PUBLISHED)
def test_theorem_2_reduced_reaches_the_optimum(name: str) -> None:
    design = reduced_lmi_design(PUBLISHED[name])
    check(PUBLISHED[name], design)
    assert design.report.status == "Solved"


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_central_observer_achieves_the_optimum(name: str) -> None:
    best, design = optimum(PUBLISHED[name]), optimal_design(PUBLISHED[name])
    assert best.lower <= best.upper <= best.lower * (1 + BRACKET)
    achieved = l2_gain(PUBLISHED[name].error_system(design.gains))
    assert achieved.lower <= design.level
    assert achieved.upper >= best.lower
    assert achieved.lower <= best.value * (1 + ACHIEVED)


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


def test_the_printed_inequality_holds_at_what_the_solver_returned() -> None:
    published = PUBLISHED["table (2, 3)"]
    design = lmi_design(published)
    Y = [P_k @ L_k for P_k, L_k in zip(design.P, design.gains, strict=True)]
    for k in range(published.schedule.period):
        theta = np.block(theorem2_matrix(published, design.P, Y, k, design.level**2))
        assert smallest_eigenvalue((theta + theta.T) / 2) > -ACHIEVED


@pytest.mark.parametrize("name", ["table (1, 2)", "table (3, 1)", "case A", "case 2"])
def test_the_cyclic_inequality_has_the_same_optimum(name: str) -> None:
    published = PUBLISHED[name]
    design, best = cyclic_lmi_design(published, accept=("optimal", "optimal_inaccurate")), optimum(published)
    assert design.level == pytest.approx(best.value, rel=ACHIEVED)
    achieved = l2_gain(published.error_system(design.gains))
    assert achieved.value == pytest.approx(best.value, rel=ACHIEVED)


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
    assert cyclic_size(published) == (sum(range(N * n + 1)) + N * n * N * q + 1, 2 * N * n + N * (1 + q))


def test_analysis_refuses_gains_that_do_not_stabilise() -> None:
    unstable = problem(only_sensor(PAPER, 0), (2,))
    with pytest.raises(InfeasibleError, match="do not stabilise"):
        lmi_analysis(unstable, np.full((2, 3, 1), 50.0))


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
    for accept in (lmi.ACCEPTED, reduced_lmi.SOLVED):
        with pytest.raises(error, match=status):
            raise_unless_solved(report, accept=accept)
    raise_unless_solved(report, accept=(status,))
