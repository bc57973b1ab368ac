"""Solvers on programs with known answers; statuses that are not answers are errors; steps of the interior point."""

import os
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
import scipy.sparse as sparse
from sdpap.sdpacall import sdpacall

from replication.errors import InfeasibleError, SolverError
from replication.estimation.conic import interior, sdpa
from replication.estimation.conic.interior import Block, Equations, Unknowns, _positive, scaled_pair, solve
from replication.estimation.conic.program import (
    Inequalities,
    Program,
    Solution,
    SolverReport,
    program_under,
    solve_clarabel,
)
from replication.estimation.conic.sdpa import LEAST, OPTIONS, _accurate, _measured, minimise_refined, solve_sdpa
from replication.estimation.delay import SdpaOptions
from replication.estimation.linear.riccati import symmetric

SDPA_GAP = 1e-6


def least_eigenvalue(matrix: np.ndarray) -> Program:
    """min ⟨matrix, X⟩ subject to trace X = 1: the least eigenvalue."""
    n = matrix.shape[0]
    return Program(sparse.csr_array(np.eye(n).reshape(1, -1)), np.ones(1), matrix.ravel(), 0, (n,))


FORMS = [solve_sdpa, *(partial(solve_clarabel, matrices=matrices) for matrices in (True, False))]


@pytest.mark.parametrize("solve", FORMS)
def test_least_eigenvalue(solve: object) -> None:
    root = np.random.default_rng(2).standard_normal((5, 5))
    matrix = root + root.T
    program = least_eigenvalue(matrix)
    solution = solve(program)  # type: ignore[operator]
    found = solution.residuals()
    assert solution.objective == pytest.approx(np.linalg.eigvalsh(matrix)[0], abs=1e-6)
    assert found["gap"] < 1e-6 and found["equalities"] < 1e-6 and found["least eigenvalue"] > -1e-8
    # Complementarity: X times the slack matrix - λI vanishes.
    slack = matrix - solution.dual_objective * np.eye(5)
    assert np.abs(slack @ solution.blocks[0]).max() < 1e-4
    missed = abs(np.trace(solution.blocks[0]) - 1.0)
    assert solution.slip == pytest.approx(abs(solution.dual_objective) * missed)


@pytest.mark.parametrize("solve", [solve_sdpa, solve_clarabel])
def test_infeasible(solve: object) -> None:
    a = sparse.csr_array(np.eye(2).reshape(1, -1))
    with pytest.raises(InfeasibleError, match="status"):
        solve(Program(a, -np.ones(1), np.eye(2).ravel(), 0, (2,)))  # type: ignore[operator]


def test_the_word_of_the_solver_is_no_proof_of_infeasibility() -> None:
    """X_12 = 1e4 and X_22 = 1 need X_11 >= 1e8: a solution far beyond the start, which SDPA calls infeasible."""
    rows = np.array([[[0.0, 1.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]]).reshape(2, -1)
    program = Program(sparse.csr_array(rows), np.array([2e4, 1.0]), np.zeros(4), 0, (2,))
    with pytest.raises(SolverError, match=r"status pdINF.*is open"):
        solve_sdpa(program, SdpaOptions(scale=1.0))


def test_too_few_iterations_are_an_error() -> None:
    program = least_eigenvalue(np.diag([1.0, 2.0, 3.0]))
    with pytest.raises(SolverError, match="SDPA stopped"):
        solve_sdpa(program, SdpaOptions(iterations=2))
    with pytest.raises(SolverError, match="Clarabel stopped"):
        solve_clarabel(program, max_iter=2)


def test_linear_part() -> None:
    """min l + tr X subject to l + X_11 = 1: any split costs 1."""
    a = sparse.csr_array(np.array([[1.0, 1.0, 0.0, 0.0, 0.0]]))
    program = Program(a, np.ones(1), np.concatenate([[1.0], np.eye(2).ravel()]), 1, (2,))
    for solver in (solve_sdpa, solve_clarabel):
        assert solver(program).objective == pytest.approx(1.0, abs=SDPA_GAP)


def test_multipliers_bound_the_trace() -> None:
    """tr X = 2 has the bound 2 from y = 1; tr X = -1 has no solution; X_11 = -1 is not refuted by the wrong sign."""
    eye = np.eye(2).ravel()
    trace = sparse.csr_array(eye[None, :])
    assert Program(trace, np.array([2.0]), eye, 0, (2,)).least_trace(np.ones(1)) == pytest.approx(2.0)
    negative = Program(trace, -np.ones(1), eye, 0, (2,))
    assert negative.least_trace(-np.ones(1)) == np.inf and negative.least_trace(np.ones(1)) == 0.0


@pytest.mark.parametrize("solve", [solve_sdpa, solve_clarabel])
def test_inequalities_of_different_sizes_under_one_cost(solve: object) -> None:
    """min t + s subject to [[t, 1], [1, t]] >= 0, where t is named twice, and s >= 2: three, and the multipliers."""
    half = np.diag([0.5, 0.5])
    pair = Inequalities(np.array([[[0.0, 1.0], [1.0, 0.0]]]), np.array([[half, half]]), np.array([[0, 0]]))
    single = Inequalities(np.array([[[-2.0]]]), np.ones((1, 1, 1, 1)), np.array([[1]]))
    program = program_under(np.ones(2), pair, single)
    assert program.blocks == (2, 1)
    solution = solve(program)  # type: ignore[operator]
    np.testing.assert_allclose(solution.multipliers, [1.0, 2.0], atol=1e-5)
    np.testing.assert_allclose(solution.blocks[0], [[0.5, -0.5], [-0.5, 0.5]], atol=1e-5)
    np.testing.assert_allclose(solution.blocks[1], [[1.0]], atol=1e-5)
    assert -solution.dual_objective == pytest.approx(3.0, abs=1e-5)


def test_what_is_missed_is_a_size_and_a_proof_of_the_trace_divides_by_what_is_reached_at_most() -> None:
    """x = 1 where 3 is asked for: 2 is missed, whatever its sign. From 4 tr X = 3: the trace is 3/4 of y for any y."""
    program = Program(sparse.csr_array(4.0 * np.eye(2).reshape(1, -1)), 3.0 * np.ones(1), np.zeros(4), 0, (2,))
    report = solve_clarabel(least_eigenvalue(np.eye(2))).report
    for x, missed in ((0.0, 3.0), (1.0, 5.0)):
        point = Solution(program, (x * np.eye(2)).ravel(), -np.ones(1), report)
        assert point.missed == pytest.approx([missed]) and point.slip == pytest.approx(missed)
    for multiplier in (0.5, 1.0, 2.0):
        assert program.least_trace(np.array([multiplier])) == pytest.approx(0.75)


COST = np.array([1.0])
# [[x, 1], [1, 1]] >= 0: the least x is 1.
GROUP = Inequalities(np.array([[[0.0, 1.0], [1.0, 1.0]]]), np.array([[[[1.0, 0.0], [0.0, 0.0]]]]), np.array([[0]]))
real_solve = sdpacall.solve_sdpa


def giving_up_beyond(iterations: int) -> Any:
    """SDPA as it is, but for the end of the process where it is asked for more iterations than these."""

    def call(*arguments: Any) -> Any:
        if arguments[-1]["maxIteration"] > iterations:
            os._exit(0)
        return real_solve(*arguments)

    return call


def test_the_end_of_its_process_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sdpacall, "solve_sdpa", giving_up_beyond(LEAST - 1))
    with pytest.raises(SolverError, match="SDPA gave up in the middle of a factorisation; rescale the plant"):
        minimise_refined(COST, GROUP)


def test_it_is_asked_again_for_fewer_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sdpacall, "solve_sdpa", giving_up_beyond(30))
    point, _, report = minimise_refined(COST, GROUP)
    assert point == pytest.approx([1.0], abs=1e-6)
    assert LEAST <= report.options["maxIteration"] <= 30 < OPTIONS["maxIteration"]


def test_programs_meanwhile_share_a_process_until_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    program = program_under(COST, GROUP)
    alone = sdpa.run_sdpa(program, OPTIONS)
    monkeypatch.setattr(sdpacall, "solve_sdpa", giving_up_beyond(30))
    with sdpa.one_process() as process:
        few = sdpa.run_sdpa(program, {**OPTIONS, "maxIteration": 30})
        first = process.child
        with sdpa.one_process() as inner:
            assert inner is process
            assert sdpa.run_sdpa(program, {**OPTIONS, "maxIteration": 30})[0].tolist() == few[0].tolist()
        assert process.child == first > 0
        with pytest.raises(sdpa.SdpaGaveUp):
            sdpa.run_sdpa(program, OPTIONS)
        with pytest.raises(ChildProcessError):
            os.waitpid(first, 0)
        monkeypatch.setattr(sdpacall, "solve_sdpa", real_solve)
        again = sdpa.run_sdpa(program, OPTIONS)
        second = process.child
        assert second not in (0, first)
    assert process.child == 0
    with pytest.raises(ChildProcessError):
        os.waitpid(second, 0)
    assert [part.tolist() for part in again[:2]] == [part.tolist() for part in alone[:2]]


def test_duals_that_are_no_proof_open_the_gap() -> None:
    """x = 3 has the slack diag(4, 1) turned; duals of the right cost with an eigenvalue -1 lack their trace."""
    said = SolverReport(name="SDPA", version="7", status="pdOPT")
    x, good, bad = np.array([3.0]), np.array([[[1.0, 0.0], [0.0, 0.0]]]), np.array([[[1.0, 0.0], [0.0, -1.0]]])
    slack = np.array([[3.0, 1.0], [1.0, 1.0]])
    for duals, lacking in ((good, 0.0), (bad, np.trace(slack))):
        bound = -np.sum(GROUP.constant * duals)
        expected = (abs(3.0 - bound) + lacking) / (1 + 3.0)
        assert _measured(COST, GROUP, x, duals, said).residuals["gap"] == pytest.approx(expected)


@pytest.mark.parametrize(("gap", "primal", "accurate"), [(0.0, 0.0, True), (1e-3, 0.0, False), (0.0, 1e-3, False)])
def test_a_solution_has_no_gap_and_violates_nothing(gap: float, primal: float, accurate: bool) -> None:
    said = SolverReport(name="SDPA", version="7", status="pdOPT", residuals={"gap": gap, "primal": primal})
    assert _accurate(said) is accurate


# A step of the interior-point method solves its equations; what counts as positive


def test_a_step_takes_away_what_was_missed_and_keeps_the_duals_balanced() -> None:
    """Slack and block move together but for what they were apart; the duals meet what was lacking."""
    rng = np.random.default_rng(3)
    n, k = 4, 3
    blocks = tuple(
        Block(symmetric(rng.normal(size=(n, n))), others, rng.normal(size=(k, n)), rng.normal(size=(k, n)))
        for others in np.stack([[symmetric(rng.normal(size=(n, n))) for _ in range(2)] for _ in range(2)])
    )
    positive = [part @ part.T + np.eye(n) for part in rng.normal(size=(4, n, n))]
    pairs = [scaled_pair(positive[0], positive[1]), scaled_pair(positive[2], positive[3])]
    missed = [symmetric(rng.normal(size=(n, n))) for _ in blocks]
    unknowns = Unknowns(k)
    lacking = rng.normal(size=unknowns.triangle + 2)
    wanted = [symmetric(rng.normal(size=(n, n))) for _ in blocks]
    dy, slacks, duals = Equations(unknowns, blocks, pairs, missed, lacking).direction(wanted)
    for block, pair, miss, slack, dual, want in zip(blocks, pairs, missed, slacks, duals, wanted, strict=True):
        moved = block.linear(*unknowns.split(dy)) + miss
        assert pair.forward @ slack @ pair.forward.T == pytest.approx(moved, abs=1e-9)
        assert slack + dual == pytest.approx(want, abs=1e-12)
    plain = [pair.inverse.T @ dual @ pair.inverse for pair, dual in zip(pairs, duals, strict=True)]
    assert unknowns.adjoint(blocks, plain) == pytest.approx(lacking, abs=1e-9)


def test_a_point_whose_blocks_are_not_positive_is_none() -> None:
    """The largest y with 1 - y - w >= 0 and w >= 0."""
    one = np.ones((1, 1))
    blocks = (Block(one, -one[None], one, -one / 2), Block(0.0 * one, 0.0 * one[None], one, one / 2))
    assert solve(blocks, 1, np.ones(1)).value == pytest.approx(1.0, abs=1e-6)
    with patch.object(interior, "_positive", return_value=False), pytest.raises(SolverError, match="no point"):
        solve(blocks, 1, np.ones(1))


def test_a_block_on_the_edge_is_not_positive() -> None:
    """The block is the slack and what it misses, beyond rounding."""
    eye = np.eye(2)
    assert _positive(eye, 0.0 * eye)
    assert not _positive(np.diag([1.0, 0.0]), 0.0 * eye)
    assert not _positive(np.diag([1.0, 1e-17]), 0.0 * eye)
    assert not _positive(eye, np.diag([0.0, -1.0]))
