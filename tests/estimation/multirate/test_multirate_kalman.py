"""The steady-state Kalman filter, white-noise performance, time responses and worst cases."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from multirate_examples import PAPER, PUBLISHED, problem, problems

from papers.okajima2023.method.lmi import cyclic
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.linear.norms import l2_gain, white_noise_variance, worst_case_response
from replication.estimation.linear.periodic import PeriodicSystem, Stage, simulate
from replication.estimation.multirate import optimum
from replication.estimation.multirate.kalman import kalman_centre, kalman_design, semidefinite, stabilises, state_units
from replication.estimation.multirate.optimum import optimal_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array
from tests.tolerances import AGREEMENT, ILL_CONDITIONED, ROUNDING, SEEDED


def test_the_single_rate_filter_solves_the_algebraic_riccati_equation() -> None:
    single = problem(PAPER, (1, 1))
    A, B, C, R = PAPER.A, PAPER.B_d, PAPER.C, PAPER.D @ PAPER.D.T
    P = scipy.linalg.solve_discrete_are(A.T, C.T, B @ B.T, R)
    design = kalman_design(single)
    np.testing.assert_allclose(design.X[0], P, rtol=AGREEMENT)
    np.testing.assert_allclose(design.gains[0], A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + R), rtol=AGREEMENT)


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_filter_is_the_limit_of_the_plain_recursion(name: str) -> None:
    published = PUBLISHED[name]
    plant, N = published.plant, published.schedule.period
    X = np.eye(3)
    for k in range(400 * N):
        X = plain_step(published, k, X)
    design = kalman_design(published)
    for k in range(N):
        np.testing.assert_allclose(design.X[k], X, rtol=1e-7, atol=1e-12)
        X = plain_step(published, k, X)
    assert design.level == np.inf
    assert design.gains.shape == (N, 3, plant.sensors)


def plain_step(given_problem: MultirateProblem, k: int, X: Array) -> Array:
    """Measurement and time update with covariance matrices, without inverses of X."""
    plant, rows = given_problem.plant, list(given_problem.schedule.measured(k))
    C, D = plant.C[rows], plant.D[rows]
    gain = X @ C.T @ np.linalg.inv(C @ X @ C.T + D @ D.T) if rows else np.zeros((len(X), 0))
    return plant.A @ (X - gain @ C @ X) @ plant.A.T + plant.B_d @ plant.B_d.T


def test_only_gains_that_stabilise_pass_for_it() -> None:
    growing = problem(replace(PAPER, A=PAPER.A / np.max(np.abs(np.linalg.eigvals(PAPER.A))) * 1.2), (1, 1))
    centre = kalman_centre(growing)
    maps = centre.scaled.maps()
    assert stabilises(centre.scaled, centre.states, maps)
    assert not stabilises(centre.scaled, 0 * centre.states, maps)


@settings(max_examples=25)
@given(problems(max_n=4, max_period=4))
def test_the_covariance_of_a_generated_problem_repeats_after_one_period(generated: MultirateProblem) -> None:
    try:
        design = kalman_design(generated)
    except InvalidInputError as error:
        assert "not disturbed" in str(error)
        return
    X = design.X[0]
    for k in range(generated.schedule.period):
        X = plain_step(generated, k, X)
    np.testing.assert_allclose(X, design.X[0], rtol=0, atol=ILL_CONDITIONED * max(1.0, np.linalg.norm(design.X[0])))
    assert generated.error_system(design.gains).spectral_radius() < 1


def test_no_other_gains_have_a_smaller_variance() -> None:
    paper, rng = problem(PAPER, (2, 3)), np.random.default_rng(4)
    gains = kalman_design(paper).gains
    best = white_noise_variance(paper.error_system(gains))
    assert best < white_noise_variance(paper.error_system(optimal_design(paper).gains))
    for _ in range(20):
        assert white_noise_variance(paper.error_system(gains + 1e-3 * rng.normal(size=gains.shape))) > best


def test_extra_noise_is_noise_on_every_state() -> None:
    paper = problem(PAPER, (2, 3))
    louder = problem(replace(PAPER, B_d=np.hstack([PAPER.B_d, np.sqrt(0.3) * np.eye(3)])), (2, 3))
    np.testing.assert_allclose(kalman_design(paper, extra_noise=0.3).gains, kalman_design(louder).gains, atol=AGREEMENT)
    for bad in (-1.0, float("nan"), "a"):
        with pytest.raises(InvalidInputError, match="extra_noise"):
            kalman_design(paper, extra_noise=bad)  # type: ignore[arg-type]


def test_a_sensor_bias_needs_a_little_noise_to_be_tracked() -> None:
    bias = problem(MultiratePlant(A=np.diag([1.0, 0.5]), B_d=[[0], [1]], C=[[1, 1]], D=[[1]]), (2,))
    with pytest.raises(InvalidInputError, match="extra_noise"):
        kalman_design(bias)
    gains = kalman_design(bias, extra_noise=1e-6).gains
    assert bias.error_system(gains).spectral_radius() < 1


def test_the_units_of_the_states_scale_with_them() -> None:
    change = np.array([1e-4, 1.0, 1e4])
    scaled = replace(PAPER, A=change[:, None] * PAPER.A / change, B_d=change[:, None] * PAPER.B_d, C=PAPER.C / change)
    np.testing.assert_allclose(
        state_units(problem(scaled, (2, 3))), change * state_units(problem(PAPER, (2, 3))), rtol=AGREEMENT
    )
    unseen = problem(MultiratePlant(A=0.5 * np.eye(2), B_d=[[0], [1]], C=[[0, 1]], D=[[1]]), (1,))
    assert np.all(state_units(unseen) > 0)


def test_white_noise_variance_is_that_of_the_lyapunov_equation() -> None:
    """Against the covariance of the lifted and of the cyclic system by scipy."""
    paper = problem(PAPER, (2, 3))
    system = paper.error_system(optimal_design(paper).gains)
    for form in (system.lift(), cyclic(system)):
        P = scipy.linalg.solve_discrete_lyapunov(form.A, form.B @ form.B.T)
        total = np.trace(form.C @ P @ form.C.T + form.D @ form.D.T)
        assert white_noise_variance(system) == pytest.approx(total / system.period, rel=AGREEMENT)


def test_white_noise_variance_is_that_of_a_simulation() -> None:
    paper, rng = problem(replace(PAPER, C=PAPER.C[:1], D=PAPER.D[:1]), (1,)), np.random.default_rng(5)
    system = paper.error_system(kalman_design(paper).gains)
    outputs = simulate(system, rng.normal(size=(60_000, 3)))
    assert np.mean(np.sum(outputs**2, axis=1)) == pytest.approx(white_noise_variance(system), rel=SEEDED)


def test_an_unstable_system_has_no_variance() -> None:
    one = np.eye(1)
    with pytest.raises(InfeasibleError, match="not stable"):
        white_noise_variance(PeriodicSystem((Stage(one, one, one, one),)))


def test_a_simulated_observer_follows_the_error_system() -> None:
    """Plant and observer in their own loops, inputs and all, against the error system."""
    paper, rng, T = problem(PAPER, (2, 3)), np.random.default_rng(6), 40
    B_u, gains = rng.normal(size=(3, 2)), optimal_design(paper).gains
    d, w, u = rng.normal(size=(T, 1)), rng.normal(size=(T, 2)), rng.normal(size=(T, 2))
    x, x_ob = rng.normal(size=3), np.zeros(3)
    start, errors = x - x_ob, []
    for k in range(T):
        errors.append(x - x_ob)
        S = paper.schedule.selection(k)
        innovation = S @ (PAPER.C @ x + PAPER.D @ w[k]) - S @ PAPER.C @ x_ob
        x_ob = PAPER.A @ x_ob + B_u @ u[k] + gains[k % 6] @ innovation
        x = PAPER.A @ x + B_u @ u[k] + PAPER.B_d @ d[k]
    outputs = simulate(paper.error_system(gains), np.hstack([d, w]), start)
    np.testing.assert_allclose(outputs, errors, atol=ROUNDING)


def test_the_worst_case_stays_below_the_norm_and_tends_to_it() -> None:
    paper = problem(PAPER, (2, 3))
    system = paper.error_system(optimal_design(paper).gains)
    norm = l2_gain(system)
    ratios = [worst_case_response(system, horizon).ratio for horizon in (1, 6, 24, 96, 288)]
    assert ratios == sorted(ratios)
    assert ratios[-1] <= norm.upper
    assert ratios[-1] >= 0.995 * norm.lower


def test_the_worst_case_is_the_response_to_its_own_input() -> None:
    paper = problem(PAPER, (3, 1))
    system = paper.error_system(kalman_design(paper).gains)
    worst = worst_case_response(system, 30)
    np.testing.assert_allclose(simulate(system, worst.inputs), worst.outputs, atol=ROUNDING)
    assert np.linalg.norm(worst.inputs) == pytest.approx(1.0)
    rng = np.random.default_rng(7)
    for _ in range(50):
        v = rng.normal(size=worst.inputs.shape)
        assert np.linalg.norm(simulate(system, v)) <= worst.ratio * np.linalg.norm(v)


def test_bad_simulations_are_named() -> None:
    system = problem(PAPER, (2, 3)).error_system(np.zeros((6, 3, 2)))
    with pytest.raises(InvalidInputError, match="inputs must have as many columns"):
        simulate(system, np.zeros((5, 2)))
    with pytest.raises(InvalidInputError, match="inputs must be finite"):
        simulate(system, np.full((5, 3), np.nan))
    with pytest.raises(InvalidInputError, match="initial_state must have shape"):
        simulate(system, np.zeros((5, 3)), np.zeros(2))
    for horizon in (0, 2.5, -1):
        with pytest.raises(InvalidInputError, match="horizon"):
            worst_case_response(system, horizon)  # type: ignore[arg-type]
    uneven = PeriodicSystem(tuple(Stage(np.eye(1), np.ones((1, m)), np.eye(1), np.ones((1, m))) for m in (1, 2)))
    with pytest.raises(InvalidInputError, match="same number of inputs"):
        worst_case_response(uneven, 3)


@pytest.mark.parametrize(("push", "noise"), [(10.0, 0.01), (0.01, 10.0)])
def test_the_unit_of_a_state_is_the_smaller_of_what_pushes_it_and_what_hides_it(push: float, noise: float) -> None:
    plant = MultiratePlant(A=[[0.5]], B_d=[[push]], C=[[1.0]], D=[[noise]])
    (unit,) = state_units(problem(plant, (1,)))
    assert unit < 0.1


def test_a_solution_that_does_not_stabilise_is_none() -> None:
    centre = kalman_centre(problem(PAPER, (2, 3)))
    states, slack = optimum._solution(centre, 2 * centre.floor + 10.0)
    assert states is not None and slack > 0
    with patch.object(optimum, "stabilises", return_value=False):
        assert optimum._solution(centre, 2 * centre.floor + 10.0) == (None, -1.0)


def test_one_negative_direction_is_not_semidefinite() -> None:
    assert semidefinite(np.stack([np.eye(2), np.diag([1.0, 0.0])]))
    assert not semidefinite(np.stack([np.eye(2), np.diag([1.0, -0.5])]))


@pytest.mark.parametrize("periods", [(1,), (1, 2, 2)])
def test_a_schedule_has_the_sensors_of_the_plant(periods: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInputError, match="sensors, the plant has 2"):
        problem(PAPER, periods)


def test_the_value_of_an_optimum_is_the_end_that_is_attained() -> None:
    found = optimum.optimum(problem(PAPER, (2, 3)))
    wide = replace(found, lower=1.0, upper=2.0)
    assert replace(wide, limited_by="noncausal").value == 1.0
    assert replace(wide, limited_by="causal").value == 2.0


def test_noise_that_reaches_the_output_at_once_counts() -> None:
    one = Stage(*(np.array([[entry]]) for entry in (0.5, 1.0, 1.0, 2.0)))
    assert white_noise_variance(PeriodicSystem((one,))) == pytest.approx(1 / (1 - 0.25) + 4, rel=ROUNDING)
