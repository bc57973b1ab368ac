"""SDPA ends its process, with exit code 0, where a factorisation fails: that must be an error, not the end of ours."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from sdpap.sdpacall import sdpacall

from replication.errors import SolverError
from replication.estimation.conic import sdpa
from replication.estimation.conic.program import Inequalities, SolverReport
from replication.estimation.conic.sdpa import LEAST, OPTIONS, _accurate, _measured, minimise_refined

COST = np.array([1.0])
# [[x, 1], [1, 1]] >= 0: the least x is 1.
GROUP = Inequalities(np.array([[[0.0, 1.0], [1.0, 1.0]]]), np.array([[[[1.0, 0.0], [0.0, 0.0]]]]), np.array([[0]]))
solve = sdpacall.solve_sdpa


def giving_up_beyond(iterations: int) -> Any:
    """SDPA as it is, but for the end of the process where it is asked for more iterations than these."""

    def call(*arguments: Any) -> Any:
        if arguments[-1]["maxIteration"] > iterations:
            os._exit(0)
        return solve(*arguments)

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


def test_an_error_within_the_call_is_that_error() -> None:
    def fail() -> None:
        raise SystemExit(3)

    with pytest.raises(sdpa.SdpaGaveUp):
        sdpa._apart(fail)
    assert sdpa._apart(lambda: {"x": np.arange(3.0)})["x"].tolist() == [0.0, 1.0, 2.0]


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
