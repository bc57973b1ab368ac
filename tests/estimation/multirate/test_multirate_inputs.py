"""Bad input gives its own error before any solver runs; good input is left alone."""

import functools
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import clarabel
import control
import cvxpy
import numpy as np
import pytest
from multirate_examples import CART, PAPER, PUBLISHED, problem

from papers.okajima2023.method import lmi
from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.linear.norms import l2_gain, worst_case_response
from replication.estimation.linear.periodic import PeriodicSystem, Stage, simulate
from replication.estimation.multirate import kalman, optimum
from replication.estimation.multirate.latency import ContinuousPlant
from replication.estimation.multirate.optimum import kalman_design, riccati_design, search_timing
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule

GOOD: dict[str, Any] = {
    "A": [[0.9, 0.2], [0, 1.1]],
    "B_d": [[1.0], [0.5]],
    "C": [[1.0, 0], [0, 1]],
    "D": np.eye(2),
    "W": np.eye(2),
}


@pytest.fixture
def no_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every way to a solver fails loudly."""

    def called(*_: Any, **__: Any) -> None:
        pytest.fail("a solver was called before the input was checked")

    monkeypatch.setattr(cvxpy.Problem, "solve", called)
    monkeypatch.setattr(clarabel, "DefaultSolver", called)
    monkeypatch.setattr(kalman, "stationary", called)
    monkeypatch.setattr(optimum, "stationary_each", called)
    monkeypatch.setattr(kalman, "steady_state", called)


DESIGNS: dict[str, Callable[[MultirateProblem], Any]] = {
    "optimum": optimum.optimum,
    "kalman": kalman_design,
    "riccati": lambda given: riccati_design(given, 10.0),
    "printed": lmi.lmi_design,
    "reduced": lmi.reduced_lmi_design,
}


def solve(design: str, periods: Any = (2, 3), offsets: Any = (), **changes: Any) -> Any:
    plant = MultiratePlant(**{**GOOD, **changes})
    return DESIGNS[design](MultirateProblem(plant, SensingSchedule(periods, offsets)))


BAD: list[tuple[dict[str, Any], str]] = [
    ({"A": np.ones((2, 3))}, "A must have 2 columns"),
    ({"A": np.eye(3)}, "C must have 3 columns|B_d must have 3 rows"),
    ({"A": np.zeros((0, 0))}, "A must have at least one state"),
    ({"A": [[0.9, float("nan")], [0, 1]]}, r"A must be finite, entry \(0, 1\)"),
    ({"B_d": np.zeros((2, 0))}, "B_d needs a column"),
    ({"D": np.eye(3)}, "D must have 2 rows"),
    ({"W": np.ones((1, 3))}, "W must have 2 columns"),
    ({"B_u": np.ones((3, 1))}, "B_u must have 2 rows"),
    ({"B_w": np.ones((2, 1))}, "B_w must have 2 columns"),
    ({"dt": 0}, "dt must be positive"),
    ({"periods": ()}, "at least one sensor"),
    ({"periods": (0, 2)}, r"periods\[0\] must be at least 1"),
    ({"periods": (2, 2.5)}, r"periods\[1\] must be a whole number, got 2.5"),
    ({"periods": "23"}, "periods must be a sequence"),
    ({"periods": (2, 3), "offsets": (0, 1, 0)}, "one entry per sensor"),
    ({"periods": (2, 3), "offsets": 1}, "offsets must be a sequence"),
    ({"periods": (2, 3), "offsets": (0, 3)}, r"offsets\[1\] must be a whole number from 0 to 2, got 3"),
    ({"periods": (2, 3), "offsets": (0, True)}, r"offsets\[1\] must be a whole number"),
    ({"periods": (997, 1009)}, "repeat together only every"),
    ({"A": [[1e80, 0.0], [0.0, 0.95]]}, r"A has an entry of size 1e\+80, whose powers"),
    ({"W": [[1e160, 0.0]]}, r"W has an entry of size 1e\+160"),
    ({"under_way": 5}, "under_way must be at most 1, got 5"),
    ({"periods": (1, 10**9)}, "repeat together only every 10{9} instants, more than 100000"),
    ({"periods": (1, 10**400)}, r"periods\[1\] must be at most 2147483647"),
    ({"periods": (1, 2, 2)}, "the schedule is of 3, the plant of 2 sensors"),
    ({"D": [[1, 0], [0, 0]]}, r"full row rank on the sensors measured together, \(0, 1\)|\(1,\)"),
    ({"D": np.zeros((2, 0))}, "full row rank"),
    (
        {"A": [[1.1, 0.2], [0, 0.9]], "C": [[0, 1], [0, 2]]},
        r"not detectable: the mode with multiplier .* over one period",
    ),
    ({"C": np.zeros((2, 2))}, "not detectable"),
    ({"A": np.diag([1.0, 0.5]), "C": [[0, 1], [0, 2]]}, "not detectable: the mode with multiplier 1"),
]


@pytest.mark.usefixtures("no_solver")
@pytest.mark.parametrize(("changes", "message"), BAD, ids=[message[:40] for _, message in BAD])
def test_each_bad_input_has_its_own_error_before_any_solver(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        solve("optimum", **changes)


ANY: Any = None  # what no checker of types lets pass
SYSTEM = PUBLISHED["table (2, 3)"].error_system(np.zeros((6, 3, 2)))
UNEVEN = PeriodicSystem(tuple(Stage(np.eye(1), np.ones((1, m)), np.eye(1), np.ones((1, m))) for m in (1, 2)))
GAINS: list[Any] = [np.zeros((6, 3)), np.zeros((5, 3, 2)), np.full((6, 3, 2), np.nan), [[1], [2, 3]], "gains", None]
LEVELS: list[Any] = [0, -1.0, float("nan"), float("inf"), True, "a", None]
CONTINUOUS: dict[str, Any] = {"A": [[-1.0]], "C": [[1.0]], "dt": 0.1}


@functools.cache
def kalman_result() -> Any:
    return multirate.design(CART, periods=(1, 3), goal="h2")


def covariances(**given: Any) -> MultiratePlant:
    return MultiratePlant.from_covariances(A=[[0.5]], C=[[1]], Q=[[1]], R=[[1]], **given)


SOLVED: list[Callable[[Any], Any]] = [
    *DESIGNS.values(),
    optimum.noncausal_bound,
    lambda it: lmi.lmi_analysis(it, np.zeros((6, 3, 2))),
]
REFUSED: list[tuple[str, Callable[[], Any]]] = [
    *(("problem must be a MultirateProblem, got .*; build it by", partial(work, PAPER)) for work in SOLVED),
    ("system must be a PeriodicSystem, got", lambda: l2_gain(ANY)),
    *(("gains must", partial(PUBLISHED["table (2, 3)"].error_system, gains)) for gains in GAINS),
    *(("level must be", partial(riccati_design, PUBLISHED["case A"], level)) for level in LEVELS),
    *(("gate must be", lambda gate=gate: kalman_result().filter(gate=gate)) for gate in (0, -1.0, 1e9, "wide", True)),
    *(("lag must be", lambda lag=lag: kalman_result().filter(lag=lag)) for lag in (-1, 1.5, True, 1001)),
    *(("horizon", partial(worst_case_response, SYSTEM, horizon)) for horizon in (0, 2.5, -1)),
    *(("periods", partial(search_timing, PAPER, periods)) for periods in ((2, 0), (2, 1.5), 4)),
    ("leave 1000000 sets of offsets", lambda: search_timing(PAPER, (10,) * 7)),
    ("same number of inputs", lambda: worst_case_response(UNEVEN, 3)),
    ("inputs must have as many columns", lambda: simulate(SYSTEM, np.zeros((5, 2)))),
    ("inputs must be finite", lambda: simulate(SYSTEM, np.full((5, 3), np.nan))),
    ("initial_state must have shape", lambda: simulate(SYSTEM, np.zeros((5, 3)), np.zeros(2))),
    ("give the sensor noise once", lambda: ContinuousPlant(**CONTINUOUS)),
    ("give the sensor noise once", lambda: ContinuousPlant(**CONTINUOUS, D=[[0.1]], R=[[0.01]])),
    ("from_covariances takes Q, R and S", lambda: multirate.design(covariances(), periods=(1,), Q=[[1.0]])),
    (r"plant must be a MultiratePlant, got tuple; .*from_statespace", lambda: MultirateProblem((2, 3), ANY)),
    ("schedule must be a SensingSchedule, got NoneType", lambda: MultirateProblem(PAPER, ANY)),
]


@pytest.mark.parametrize(("message", "work"), REFUSED)
def test_each_bad_request_has_its_own_error(message: str, work: Callable[[], Any]) -> None:
    with pytest.raises(InvalidInputError, match=message):
        work()


def test_the_trap_for_solvers_closes(no_solver: None) -> None:
    for design in DESIGNS:
        with pytest.raises(pytest.fail.Exception, match="a solver was called"):
            solve(design)


def test_a_sensor_that_hides_a_rotation_between_its_instants() -> None:
    """A quarter turn per instant, seen every second one: A^2 = -I, and one coordinate is never seen."""
    turn = MultiratePlant(A=[[0, 1], [-1, 0]], B_d=np.eye(2), C=[[1, 0]], D=[[1]])
    for period, seen in ((1, True), (2, False), (3, True), (4, False), (5, True), (6, False)):
        if seen:
            assert optimum.optimum(problem(turn, (period,))).value > 0
        else:
            with pytest.raises(InvalidInputError, match="not detectable"):
                problem(turn, (period,))
    two = replace(turn, C=np.array([[1.0, 0], [1, 0]]), D=np.eye(2))
    with pytest.raises(InvalidInputError, match="not detectable"):
        problem(two, (4, 4), (0, 2))
    assert problem(two, (4, 4), (0, 1)).schedule.period == 4


def test_noise_is_needed_only_on_sensors_that_measure_together() -> None:
    shared = replace(PAPER, D=np.array([[1.0], [0.5]]))
    assert optimum.optimum(problem(shared, (2, 2), (0, 1))).value > 0
    with pytest.raises(InvalidInputError, match="full row rank"):
        problem(shared, (2, 2))
    quiet = replace(PAPER, D=np.diag([1.0, 1e-11]))
    assert problem(quiet, (2, 3)).schedule.period == 6


class TestFromStateSpace:
    SYSTEM = control.ss(
        [[0.9, 0.2], [0, 1.1]], [[1, 0, 2], [0, 1, 3]], np.eye(2), np.zeros((2, 3)), 0.1,
        inputs=["force", "gust", "drift"],
    )  # fmt: skip

    @pytest.mark.parametrize(
        ("chosen", "columns"),
        [(None, [0, 1, 2]), (["gust", "drift"], [1, 2]), ([np.int64(1), 2], [1, 2]), ((0, "drift"), [0, 2])],
    )
    def test_all_inputs_are_disturbances_unless_some_are_chosen(self, chosen: Any, columns: list[int]) -> None:
        plant = MultiratePlant.from_statespace(self.SYSTEM, np.eye(2), disturbances=chosen)
        np.testing.assert_array_equal(plant.B_d, self.SYSTEM.B[:, columns])
        np.testing.assert_array_equal(plant.B_u, np.delete(self.SYSTEM.B, columns, axis=1))
        np.testing.assert_array_equal(plant.W, np.eye(2))
        unspecified = control.ss([[0.5]], [[1]], [[1]], [[0]], True)
        assert (plant.dt, MultiratePlant.from_statespace(unspecified, [[1]]).dt) == (0.1, 1.0)

    @pytest.mark.parametrize(
        ("system", "options", "message"),
        [
            (np.eye(2), {}, "must be a control.StateSpace, got ndarray"),
            (control.tf([1], [1, 2], 0.1), {}, "got TransferFunction"),
            (control.ss([[-1]], [[1]], [[1]], [[0]]), {}, "must be discrete-time, its dt is 0"),
            (control.ss([[0.5]], [[1]], [[1]], [[0]], None), {}, "must be discrete-time, its dt is None"),
            (control.ss([[0.5]], [[1]], [[1]], [[2]], 1), {}, "no feedthrough"),
            (SYSTEM, {"disturbances": [3]}, "no input 3"),
            (SYSTEM, {"disturbances": [True]}, "no input True"),
            (SYSTEM, {"disturbances": ["gust", 1]}, "each input once"),
            (SYSTEM, {"D": np.eye(3)}, "D must have 2 rows"),
        ],
    )
    def test_what_does_not_fit_is_named(self, system: Any, options: dict[str, Any], message: str) -> None:
        with pytest.raises(InvalidInputError, match=message):
            MultiratePlant.from_statespace(system, **{"D": np.eye(2), **options})


@pytest.mark.parametrize("periods", [(2, 2), (2, 3)])
@pytest.mark.parametrize(("noise", "apart"), [((1e-7, 1e3), "1.0e\\+10"), ((1e-9, 0.5), "5.0e\\+08")])
def test_noises_too_far_apart_for_rounding_are_the_cause(noise: Any, apart: str, periods: tuple[int, int]) -> None:
    """Both states are disturbed, faintly: what rounding loses is told, and not that the plant is unstable.

    Which of them are lost depends on the order in which a processor adds; what is solved must keep its level.
    """
    plant = MultiratePlant(
        A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=np.diag(noise), B_w=1e-3 * np.eye(2)
    )
    try:
        best = multirate.design(plant, periods=periods)
    except InvalidInputError as refusal:
        assert re.search(f"the noise of the sensors differs by a factor of {apart}", str(refusal))
    else:
        noisier = multirate.design(replace(plant, D=np.diag((1e-3, noise[1]))), periods=periods)
        assert best.bracket.lower <= noisier.bracket.upper  # a better sensor costs nothing
