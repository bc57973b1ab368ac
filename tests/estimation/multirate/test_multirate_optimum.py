"""The smallest achievable gain: against closed forms, the textbook filter, other methods and its own invariances."""

import sys
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from multirate_examples import PAPER, PUBLISHED, problem, problems

from papers.okajima2023.method.lmi import lmi_design
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation import multirate
from replication.estimation.linear.norms import l2_gain
from replication.estimation.multirate.optimum import (
    DESIGN_MARGIN,
    kalman_design,
    noncausal_bound,
    optimal_design,
    optimum,
    riccati_design,
)
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array
from tests.tolerances import AGREEMENT, BRACKET, GRID, ILL_CONDITIONED, ROUNDING


def scalar(a: float, b: float, r: float = 1.0, period: int = 1) -> MultirateProblem:
    return problem(MultiratePlant(A=[[a]], B_d=[[b]], C=[[1.0]], D=[[r]]), (period,))


def check_bracket(generated: MultirateProblem, tolerance: float) -> None:
    """optimum -> gains -> exact norm: not above the level, and not below the optimum."""
    try:
        best = optimum(generated)
    except InvalidInputError as error:
        # One generated case in many has a weight that sees only what nothing disturbs.
        assert "nothing to minimise" in str(error)
        return
    assert 0 < best.lower <= best.upper <= best.lower * (1 + BRACKET)
    assert best.lower >= best.noncausal.lower
    level = best.upper * (1 + AGREEMENT)
    achieved = l2_gain(generated.error_system(riccati_design(generated, level).gains))
    assert achieved.lower <= level * (1 + tolerance)
    assert achieved.upper >= best.lower * (1 - tolerance)


@settings(max_examples=60)
@given(st.sampled_from((0.0, 4.0)).flatmap(lambda decades: problems(max_period=4, decades=decades)))
def test_generated_problems_in_any_units_are_bracketed(generated: MultirateProblem) -> None:
    check_bracket(generated, ILL_CONDITIONED)


@pytest.mark.parametrize("seed", range(12))
def test_states_that_nearly_cancel_are_bracketed(seed: int) -> None:
    """A plant that a search found: entries near a thousand whose products cancel, so that a covariance is singular."""
    rng = np.random.default_rng(seed)
    plant = MultiratePlant(
        A=[
            [1079.12243505, -636.34583024, 2290.08554773],
            [1505.71899372, -887.90481233, 3195.39766244],
            [-90.47260719, 53.35063424, -191.99861245],
        ],
        B_d=rng.normal(size=(3, rng.integers(1, 4))),
        C=[[0.97221906, -1.65144178, -1.46746289]],
        D=[[rng.uniform(0.1, 2)]],
    )
    check_bracket(problem(plant, (2,)), ILL_CONDITIONED)


@pytest.mark.parametrize(("a", "b", "causal", "noncausal"), [
    (1.5, 0.0, 1.5, 0.0),
    (-3.0, 0.0, 3.0, 0.0),
    (0.0, 2.0, 2.0, 2 / np.sqrt(5)),
    (1.0, 0.1, np.sqrt(1.01), 1.0),
    (1.0, 3.0, np.sqrt(10), 1.0),
])  # fmt: skip
def test_one_state_by_hand(a: float, b: float, causal: float, noncausal: float) -> None:
    """Without disturbance, x+ = a x: X = (a^2 - 1) / (1 - 1/g^2) and X < g^2, so the optimum is |a|.

    With x+ = b d, measured too late, nothing is known of x, and it is b; for a smoother b / sqrt(1 + b^2). Of a random
    walk X = X / (1 + X h) + b^2 with h = 1 - 1/g^2 meets X = g^2 at g^2 = 1 + b^2.
    """
    best = optimum(scalar(a, b))
    assert best.value == pytest.approx(causal, rel=AGREEMENT)
    assert best.noncausal.value == pytest.approx(noncausal, rel=AGREEMENT)


@pytest.mark.parametrize("name", PUBLISHED)
def test_no_level_below_is_achievable_and_every_one_above_is(name: str) -> None:
    best = optimum(PUBLISHED[name])
    for factor in (0.5, 0.99, 1 - ILL_CONDITIONED):
        with pytest.raises(InfeasibleError, match="ask for a larger level"):
            riccati_design(PUBLISHED[name], factor * best.lower)
    for factor in (1 + ILL_CONDITIONED, 1.5, 100.0, 1e12):
        riccati_design(PUBLISHED[name], factor * best.upper)


def brute_noncausal(generated: MultirateProblem, points: int = 4001) -> float:
    """sqrt(max over the grid of lambda_max(T_x* T_x, I + T_y* T_y)) on the lifted plant, whitened by D D' itself."""
    plant, N = generated.plant, generated.schedule.period
    n, m = plant.B_d.shape
    power = [np.linalg.matrix_power(plant.A, k) for k in range(N + 1)]
    drive = np.hstack([power[N - 1 - j] @ plant.B_d for j in range(N)])

    def rows(k: int, output: Array) -> tuple[Array, Array]:
        direct = [output @ power[k - 1 - j] @ plant.B_d if j < k else np.zeros((len(output), m)) for j in range(N)]
        return output @ power[k], np.hstack(direct)

    whitened = []
    for k, measured in enumerate(generated.measured_rows()):
        covariance = plant.D[measured] @ plant.D[measured].T
        whitened.append(rows(k, np.linalg.solve(np.linalg.cholesky(covariance), plant.C[measured])))
    weighted = [rows(k, plant.W) for k in range(N)]
    C_x, D_x, C_y, D_y = (np.vstack([pair[i] for pair in list_]) for list_ in (weighted, whitened) for i in (0, 1))
    best = 0.0
    for t in np.linspace(0, np.pi, points):
        state = np.linalg.solve(np.exp(1j * t) * np.eye(n) - power[N], drive)
        T_x, T_y = C_x @ state + D_x, C_y @ state + D_y
        gram = np.eye(N * m) + T_y.conj().T @ T_y
        best = max(best, scipy.linalg.eigh(T_x.conj().T @ T_x, gram, eigvals_only=True)[-1])
    return float(np.sqrt(best))


@pytest.mark.parametrize("name", ["table (1, 1)", "table (2, 3)", "case A", "case 2"])
def test_the_noncausal_bound_is_that_of_the_generalised_eigenvalue(name: str) -> None:
    bound = noncausal_bound(PUBLISHED[name])
    brute = brute_noncausal(PUBLISHED[name])
    assert brute <= bound.upper * (1 + ROUNDING)
    assert brute == pytest.approx(bound.value, rel=GRID)


@pytest.mark.parametrize("factor", [1e-100, 1e-4, 7.0, 1e100])
def test_louder_noise_scales_the_optimum_and_leaves_the_gains(factor: float) -> None:
    original = problem(PAPER, (2, 3))
    louder = problem(replace(PAPER, B_d=factor * PAPER.B_d, D=factor * PAPER.D), (2, 3))
    best = optimum(original)
    for scaled in (louder, problem(replace(PAPER, W=factor * PAPER.W), (2, 3))):
        assert optimum(scaled).value == pytest.approx(factor * best.value, rel=AGREEMENT)
    np.testing.assert_allclose(
        riccati_design(louder, factor * 1.5 * best.value).gains, riccati_design(original, 1.5 * best.value).gains,
        rtol=1e-7, atol=AGREEMENT,
    )  # fmt: skip


def test_extreme_levels_are_answered() -> None:
    paper = problem(PAPER, (2, 3))
    for level in (5e-324, 1e-300, 1e-30):
        with pytest.raises(InfeasibleError, match="no observer"):
            riccati_design(paper, level)
    far = [l2_gain(paper.error_system(riccati_design(paper, level).gains)).value for level in (1e30, 1e300)]
    assert far[0] == pytest.approx(far[1], rel=ROUNDING)


def test_a_level_at_which_a_stage_is_singular_is_not_a_crash() -> None:
    """Unmeasured stage of x+ = a x + d: I + H G = 1 - 1/g^2 vanishes at g = 1, below the optimum."""
    with pytest.raises(InfeasibleError, match="no observer"):
        riccati_design(scalar(0.5, 1.0, period=2), 1.0)
    assert optimum(scalar(0.0, 1.0, period=2)).value == pytest.approx(1.0, rel=AGREEMENT)


@pytest.mark.parametrize("share", [1e-6, 1e-3, 1e3, 1e6, 1e10])
def test_sensors_from_almost_silent_to_useless(share: float) -> None:
    check_bracket(problem(replace(PAPER, D=share * PAPER.D), (2, 3)), ILL_CONDITIONED)


def test_useless_sensors_leave_the_gain_of_the_plant() -> None:
    plant = replace(PAPER, D=1e8 * PAPER.D)
    open_loop = problem(plant, (2, 3)).error_system(np.zeros((6, 3, 2)))
    assert optimum(problem(plant, (2, 3))).value == pytest.approx(l2_gain(open_loop).value, rel=GRID)


def test_what_rounding_spoils_is_refused() -> None:
    with pytest.raises(SolverError, match="lost in rounding"):
        optimum(problem(replace(PAPER, D=1e-12 * PAPER.D), (2, 3)))


BIAS = MultiratePlant(A=[[1, 0.1, 0], [0, 0.9, 0.1], [0, 0, 1]], B_d=[[0], [1], [0]], C=[[1, 0, 0]], D=[[1]])
"""Its third state is a constant that nothing disturbs."""


MARGINAL = {
    "bias": BIAS,
    "diagonal": MultiratePlant(A=np.diag([1.0, 0.5]), B_d=[[0], [1]], C=[[1, 1]], D=[[1]]),
    "rotation": MultiratePlant(A=[[0, 1], [-1, 0]], B_d=[[0], [0]], C=[[1, 0]], D=[[1]]),
    "ramp": MultiratePlant(A=[[1, 1], [0, 1]], B_d=[[0], [0]], C=[[1, 0]], D=[[1]]),
    "ramp of the input": MultiratePlant(
        A=[[0.9, 1, 0], [0, 1, 1], [0, 0, 1]], B_d=[[1], [0], [0]], C=[[1, 1, 1]], D=[[1]]
    ),
}


@pytest.mark.parametrize("name", MARGINAL)
def test_an_undisturbed_mode_on_the_circle_is_named(name: str) -> None:
    plant = MARGINAL[name]
    marginal = problem(plant, (3,))
    for design in (optimum, optimal_design, kalman_design, lambda it: riccati_design(it, 100.0)):
        with pytest.raises(InvalidInputError, match=r"the mode .* on the unit circle is not disturbed"):
            design(marginal)
    louder = problem(replace(plant, B_d=np.hstack([plant.B_d, 0.1 * np.eye(plant.order)])), (3,))
    assert kalman_design(louder).gains.shape == (3, plant.order, 1)


@pytest.mark.parametrize("size", [2, 3])
def test_an_undisturbed_chain_on_the_circle_is_named_in_any_coordinates(size: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        V = np.linalg.qr(rng.normal(size=(size, size))).Q * rng.uniform(0.3, 3.0, size)
        A = V @ (np.eye(size) + np.eye(size, k=1)) @ np.linalg.inv(V)
        C = np.eye(1, size) @ np.linalg.inv(V)
        for period in (1, 3):
            with pytest.raises(InvalidInputError, match="is not disturbed"):
                optimum(problem(MultiratePlant(A=A, B_d=np.zeros((size, 1)), C=C, D=[[1]]), (period,)))


def test_a_weakly_disturbed_integrator_is_answered_in_any_unit() -> None:
    for unit in (1.0, 1e-8, 1e8):
        plant = MultiratePlant(
            A=np.diag([1.0, 0.5]), B_d=[[0.1 * unit], [1]], C=[[1 / unit, 1]], D=[[1]], W=np.diag([1 / unit, 1])
        )
        reference = replace(plant, B_d=np.array([[0.1], [1]]), C=np.ones((1, 2)), W=np.eye(2))
        expected = optimum(problem(reference, (2,))).value
        assert optimum(problem(plant, (2,))).value == pytest.approx(expected, rel=AGREEMENT)


def test_the_advice_for_an_undisturbed_mode_holds() -> None:
    """Gains for a plant with one more disturbance achieve no more in the plant without it."""
    disturbed = replace(BIAS, B_d=np.array([[0.0, 0], [1, 0], [0, 1e-3]]))
    design = optimal_design(problem(disturbed, (3,)))
    achieved = l2_gain(problem(BIAS, (3,)).error_system(design.gains))
    assert achieved.upper <= design.level * (1 + BRACKET)
    printed = lmi_design(problem(BIAS, (3,)), accept=("optimal", "optimal_inaccurate"))
    assert achieved.value == pytest.approx(printed.level, rel=ILL_CONDITIONED)


@pytest.mark.parametrize("period", [20, 27, 28, 30, 40, 60])
def test_a_mode_that_outgrows_rounding_between_measurements_is_no_undisturbed_one(period: int) -> None:
    """What is lost in rounding is refused by that name, and what is not is 4/3 2^N up to a share of 4^-N."""
    try:
        value = optimum(scalar(2.0, 1.0, period=period)).value
    except SolverError as lost:
        assert "lost in rounding" in str(lost) and period > 27
    else:
        assert value == pytest.approx(4 / 3 * 2.0**period, rel=1e-7) and period < 60


QUIET = {
    "no disturbance": replace(PAPER, B_d=0 * PAPER.B_d),
    "no weight": replace(PAPER, W=0 * PAPER.W),
    "none of two": MultiratePlant(A=[[0.9, 0.2], [0, 0.8]], B_d=[[0], [0]], C=np.eye(2), D=np.eye(2)),
    **{
        f"weight on the quiet one beside {a}": MultiratePlant(
            A=np.diag([a, 0.8]), B_d=[[b], [0]], C=np.eye(2), D=np.eye(2), W=[[0, 1]]
        )
        for a, b in ((0.5, 1), (1.5, 0))
    },
}


@pytest.mark.parametrize("name", QUIET)
def test_nothing_to_minimise_is_said(name: str) -> None:
    with pytest.raises(InvalidInputError, match="nothing to minimise"):
        optimum(problem(QUIET[name], (2, 3)))


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_gain_of_the_optimal_design_lies_between_the_optimum_and_its_level(name: str) -> None:
    best, design = optimum(PUBLISHED[name]), optimal_design(PUBLISHED[name])
    assert design.level == pytest.approx((1 + DESIGN_MARGIN) * best.upper, rel=ROUNDING)
    achieved = l2_gain(PUBLISHED[name].error_system(design.gains))
    assert best.lower * (1 - ROUNDING) <= achieved.value <= design.level * (1 + ROUNDING)


ROOM = str(Path(multirate.__file__).parents[2])
MOST = 14


def files_of(run: Any) -> set[str]:
    """The files of the library in which `run` calls a function."""
    entered: set[str] = set()

    def enter(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(ROOM):
            entered.add(frame.f_code.co_filename)

    before = sys.getprofile()
    sys.setprofile(enter)
    try:
        run()
    finally:
        sys.setprofile(before)
    return entered


def design() -> Any:
    cart = multirate.MultiratePlant(
        A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=[[0.5, 0], [0, 0.1]]
    )
    return multirate.design(cart, periods=(1, 4))


def test_an_own_plant_enters_few_files() -> None:
    design()  # modules load when they are first used
    assert 5 < len(files_of(design)) <= MOST
