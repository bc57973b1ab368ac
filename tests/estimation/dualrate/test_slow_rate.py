"""Designs at the slow rate against loops by hand, scipy's Riccati equations, a search, and the exact analysis."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import minimize
from slow_loops import LEVITATION, RATES, TWO, WEIGHTS, ByHand, largest

from replication.errors import InfeasibleError
from replication.estimation import dualrate
from replication.estimation.dualrate.slow.problem import Controller, Equations, _margin, in_natural_units, slow_problem
from replication.estimation.dualrate.slow.result import closed, limit, of_gains, root_mean_square
from replication.estimation.linear.norms import l2_gain

BALL = dualrate.make_plant(*LEVITATION)
FAST: dict[str, Any] = {"period": 1e-3, "at": "slow"}
SAME = 1e-7


def designed(goal: str = "h2", **changed: Any) -> Any:
    return dualrate.design(dualrate.make_plant(*TWO), at="slow", goal=goal, **{**RATES, **WEIGHTS, **changed})


def kalman_gains(ratio: int, sensor: float, period: float = 1e-3) -> tuple[Any, Any]:
    """Continuous-time K, and the Kalman gain at the slow rate, from scipy alone."""
    A, B, C = (np.asarray(matrix) for matrix in LEVITATION)
    K = -B.T @ scipy.linalg.solve_continuous_are(A, B, C.T @ C, np.eye(1))
    block = scipy.linalg.expm(np.block([[-A, B @ B.T], [np.zeros((2, 2)), A.T]]) * ratio * period)
    slow = block[2:, 2:].T
    S = scipy.linalg.solve_discrete_are(slow.T, C.T, slow @ block[:2, 2:], [[sensor]])
    return K, scipy.linalg.expm(A * period) @ S @ C.T / (C @ S @ C.T + sensor)


@pytest.mark.parametrize("goal", ["h2", "hinf"])
def test_gain_and_mean_square_are_those_of_the_loop_by_hand(goal: str) -> None:
    result = designed(goal)
    A, B, C, D = ByHand(result, TWO, WEIGHTS, 6).lifted()
    assert np.abs(np.linalg.eigvals(A)).max() == pytest.approx(result.fact("monodromy radius").value, rel=SAME)
    assert result.bracket.lower * (1 - SAME) <= largest(A, B, C, D) <= result.bracket.upper * (1 + SAME)
    covariance = scipy.linalg.solve_discrete_lyapunov(A, B @ B.T)
    square = np.trace(C @ covariance @ C.T + D @ D.T) / (6 * RATES["period"])
    assert result.fact("root mean square").value == pytest.approx(np.sqrt(square), rel=SAME)


def test_a_loop_with_another_noise_is_told_apart() -> None:
    loud = {**WEIGHTS, "process_noise": 1.01 * WEIGHTS["process_noise"]}
    result = designed()
    assert largest(*ByHand(result, TWO, loud, 6).lifted()) > result.bracket.upper * 1.0001


def test_no_change_of_the_gains_lowers_what_they_minimise() -> None:
    for goal, of in (("h2", root_mean_square), ("hinf", lambda problem, loop: l2_gain(loop).upper)):
        result = designed(goal)
        best = result.controller
        least = of(result.problem, closed(result.problem, best)) / (1.0 if goal == "h2" else 1.0101)
        rng = np.random.default_rng(3)
        for size in (1e-1, 1e-2, 1e-3):
            changed = [M + size * np.abs(M).max() * rng.normal(size=M.shape) * (M != 0) for M in vars(best).values()]
            loop = closed(result.problem, Controller(*changed))
            assert loop.spectral_radius() >= 1 or of(result.problem, loop) >= least


@pytest.mark.parametrize("margin", [1e-4, 1e-2, 1.0])
def test_every_level_above_the_least_is_kept_and_none_below_is_granted(margin: float) -> None:
    result = designed("hinf")
    low, high = (float(result.fact(name).value) for name in ("optimum lies above", "optimum"))
    assert low < high < low * 1.00001
    kept = l2_gain(closed(result.problem, Equations(*in_natural_units(result.problem)).at(high * (1 + margin))))
    assert kept.upper < high * (1 + margin)
    if margin < 1e-3:
        assert kept.lower > low
    with pytest.raises(InfeasibleError, match=r"no controller at these rates keeps the level .*: the least is from"):
        designed("hinf", level=low * 0.999)
    assert designed("hinf", level=2 * high).value < 2 * high


def test_the_least_level_is_that_of_a_search_over_all_controllers_of_first_order() -> None:
    """A scalar plant at one rate: its controllers of order one, o+ = a o + l y, u = k o, tried one by one."""
    problem = slow_problem(
        dualrate.make_plant([[1.0]], [[1.0]], [[1.0]]), period=0.3, ratio=1, hold=1, weights=(np.eye(1),) * 4
    )
    result = dualrate.design(problem.plant, period=0.3, ratio=1, at="slow", goal="hinf")
    step = problem.sampled.input[0, 0]

    def gain(p: Any) -> float:
        tried = Controller(*(np.array([[[value]]]) for value in (p[0], p[1])), np.array([[[p[2], 0.0]]]))
        loop = closed(problem, tried)
        return l2_gain(loop).lower if loop.spectral_radius() < 1 else 1e3 * loop.spectral_radius()

    best = result.controller
    start = [best.A[0, 0, 0], best.L[0, 0, 0], best.K[0, 0, 0]]
    assert step > 0 and gain(start) == pytest.approx(result.value, rel=1e-6)
    found = min(
        float(minimize(gain, np.multiply(start, scale), method="Nelder-Mead", options={"maxiter": 4000}).fun)
        for scale in ([1, 1, 1], [0.8, 1, 1], [1, 1.1, 0.9])
    )
    low, high = (float(result.fact(name).value) for name in ("optimum lies above", "optimum"))
    assert low * (1 - 1e-6) <= found <= high * 1.002


def test_one_slow_sensor_is_what_scipy_and_the_exact_analysis_give() -> None:
    C = np.asarray(LEVITATION[2])
    result = dualrate.design(BALL, period=1e-3, ratio=50, at="slow", sensor_noise=[[0.3]])
    L = kalman_gains(50, 0.3)[1]
    assert np.allclose(result.gains["L"][0], L, rtol=SAME)
    assert not result.gains["L"][1:].any()
    step = result.problem.sampled
    cost = scipy.linalg.solve_discrete_are(step.state, step.input, 1e-3 * C.T @ C, 1e-3 * np.eye(1))
    K = -np.linalg.solve(1e-3 * np.eye(1) + step.input.T @ cost @ step.input, step.input.T @ cost @ step.state)
    assert np.allclose(result.gains["K"][:, :, :2], K, rtol=SAME) and np.allclose(result.gains["K"][:, :, 2], 0)
    loop = dualrate.analyse(
        BALL, feedback=K, injection=L, period=1e-3, ratio=50, observer="single_correction", discrete_gain=True
    )
    assert loop.fact("monodromy radius").value == pytest.approx(result.fact("monodromy radius").value, rel=SAME)
    assert loop.value == pytest.approx(result.fact("gain from sensor noise to output").value, rel=SAME)
    assert root_mean_square(result.problem, of_gains(result.problem, loop.loop)) == pytest.approx(
        result.fact("root mean square").value, rel=SAME
    )


def test_where_continuous_gains_fail_there_is_a_stable_loop_with_its_exact_gain() -> None:
    with pytest.raises(InfeasibleError, match=r'unstable .* design for the rates as they are: at="slow"'):
        dualrate.design(BALL, period=1e-3, ratio=400)
    result = dualrate.design(BALL, ratio=400, **FAST)
    assert result.fact("monodromy radius").value < 1 and result.bracket.width < 1e-6
    assert result.fact("level of the continuous gains").value == "infinite: unstable"
    assert result.fact("level without sensors").value == "infinite"
    shown = dualrate.simulate(result, [1.0, 0.0], slow_periods=12)
    y, tail = shown.signals["output"][:, 0], 400 * 10
    assert np.abs(y[-tail:]).max() < 1e-3 * np.abs(y).max()


def test_the_non_causal_limit_lies_below_every_controller_and_meets_one_where_control_is_dear() -> None:
    """Where moving the input costs much, the best that a stable plant can have is to be left alone."""
    stable = dualrate.make_plant([[-1.0]], [[1.0]], [[1.0]])
    dear = dualrate.design(stable, period=0.1, ratio=3, at="slow", goal="hinf", input_weight=[[1e6]])
    bound, left = (dear.fact(name).value for name in ("limit of any smoother", "level without sensors"))
    assert bound <= dear.fact("optimum").value * (1 + SAME) and bound == pytest.approx(left, rel=1e-3)
    assert "not below" in str(dear.fact("advice").value) or "only" in str(dear.fact("advice").value)
    assert limit(designed().problem) <= designed("hinf").fact("optimum lies above").value


def test_the_continuous_design_shows_what_it_loses() -> None:
    result = dualrate.design(BALL, period=0.01, ratio=20)
    own = float(result.fact("level from process and sensor noise").value)
    slow = dualrate.design(BALL, period=0.01, ratio=20, at="slow", sensor_noise=[[1 / 0.2]])
    assert result.fact("level of the Kalman filter").value == pytest.approx(slow.value, rel=SAME)
    assert slow.fact("level of the continuous gains").value == pytest.approx(own, rel=SAME)
    assert result.fact("loss against the slow rate").value == pytest.approx(own / slow.value, rel=SAME)
    assert "loss against the slow rate" not in {
        fact.what for fact in dualrate.design(BALL, period=0.01, ratio=1).evidence
    }


@pytest.mark.parametrize("goal", ["h2", "hinf"])
def test_units_of_the_states_change_no_level(goal: str) -> None:
    units = np.array([1e-4, 1.0, 1e6])
    A, B, C = TWO
    plant = dualrate.make_plant(A * units / units[:, None], B / units[:, None], C * units)
    weights = {
        **WEIGHTS,
        "state_weight": WEIGHTS["state_weight"] * np.outer(units, units),
        "process_noise": WEIGHTS["process_noise"] / np.outer(units, units),
    }
    moved = dualrate.design(plant, at="slow", goal=goal, **RATES, **weights)
    assert moved.value == pytest.approx(designed(goal).value, rel=1e-5)


def test_held_inputs_are_held_and_the_observer_alone_agrees_with_the_controller() -> None:
    result, rng = designed("hinf"), np.random.default_rng(5)
    controller, observer = result.running(), result.observer()
    before = np.zeros(2)
    for k in range(40):
        u, y = controller.command, rng.normal(size=2)
        if k % 2:
            assert u[1] == before[1]
        assert np.allclose(controller.step(None, y)[:3], observer.step(u, y), rtol=1e-9, atol=1e-9)
        before = u


def test_the_state_space_is_the_running_controller_over_a_period() -> None:
    result, rng = designed(), np.random.default_rng(6)
    system, controller = result.to_statespace(), result.running()
    y, state = rng.normal(size=(2, 6, 2)), np.zeros(5)
    for period in y:
        commands = []
        for reading in period:
            commands.append(controller.command)
            controller.step(None, reading)
        assert np.allclose(system.C @ state + system.D @ period.ravel(), np.ravel(commands), atol=1e-12)
        state = system.A @ state + system.B @ period.ravel()


def test_the_limit_is_that_of_parrott_at_every_frequency() -> None:
    """One rate and a stable plant: z = T11 v + T12 u, y = T21 v by frequency, and the projections by their factors."""
    A, B, C = TWO[0] - np.eye(3), TWO[1], TWO[2]
    result = dualrate.design(dualrate.make_plant(A, B, C), period=0.1, ratio=1, at="slow", **WEIGHTS)
    problem = result.problem
    step, n = problem.sampled, 3
    Q, R, V = (np.linalg.cholesky(WEIGHTS[name]) for name in ("state_weight", "input_weight", "sensor_noise"))
    drive = np.linalg.cholesky(problem.noise @ problem.noise.T)

    def bound(angle: float) -> float:
        response = np.linalg.inv(np.exp(1j * angle) * np.eye(n) - step.state)
        T11 = np.sqrt(0.1) * np.vstack([Q.T @ response @ drive, np.zeros((2, n))])
        T12 = np.sqrt(0.1) * np.vstack([Q.T @ response @ step.input, R.T])
        T21 = np.hstack([C @ response @ drive, V])
        free = T11 - T12 @ np.linalg.pinv(T12) @ T11
        wide = np.hstack([T11, np.zeros((len(T11), 2))])
        unseen = wide - wide @ np.linalg.pinv(T21) @ T21
        return max(np.linalg.norm(free, 2), np.linalg.norm(unseen, 2))

    highest = max(bound(angle) for angle in np.linspace(0, np.pi, 4001))
    found = float(result.fact("limit of any smoother").value)
    assert highest * (1 - SAME) <= found <= highest * 1.0001
    assert found < result.value


def test_the_errors_of_a_simulation_are_state_minus_estimate() -> None:
    x, guess = [1.0, -0.5, 0.25], [0.25, 0.5, -1.0]
    right = dualrate.simulate(designed(), x, slow_periods=2, estimate=x)
    assert np.abs(right.signals["estimation error"]).max() < SAME
    wrong = dualrate.simulate(designed(), x, slow_periods=2, estimate=guess)
    np.testing.assert_array_equal(wrong.signals["estimation error"][0], np.subtract(x, guess))


def test_a_state_that_only_noise_drives_has_its_natural_unit() -> None:
    """Whatever unit the second state is given in, it is found again, as the balance of a matrix finds it: roughly."""
    size, weights = 2.0**40, (np.eye(2), np.eye(1), np.eye(2), np.eye(1))
    units = np.array([1.0, size])
    plant = dualrate.make_plant([[-1.0, 0.0], [0.0, -2.0]], [[1.0], [0.0]], [[1.0, 1.0]])
    moved = dualrate.make_plant(plant.A, plant.B_u, plant.C / units)
    given = slow_problem(plant, period=0.1, ratio=2, hold=1, weights=weights)
    scaled = (np.diag(1 / units**2), np.eye(1), np.diag(units**2), np.eye(1))
    other = slow_problem(moved, period=0.1, ratio=2, hold=1, weights=scaled)
    beside = [t[1] / t[0] for _, t, _ in (in_natural_units(given), in_natural_units(other))]
    assert 1 / 16 < beside[1] / beside[0] / size < 16


def test_between_the_instants_the_plant_moves_by_itself() -> None:
    result = designed()
    shown = dualrate.simulate(result, [1.0, 0.0, -0.5], slow_periods=2, output=1)
    step = np.diff(shown.time)
    assert step == pytest.approx(np.full(len(step), step[0]))
    # Halfway to the next sample the matrix exponential says the same.
    errors = shown.signals["output"][:, 0]
    A, B, C = (np.asarray(matrix) for matrix in TWO)
    x, u = np.array([1.0, 0.0, -0.5]), shown.signals["input"][0]
    for k in range(round(RATES["period"] / step[0])):
        block = scipy.linalg.expm(np.block([[A, B], [np.zeros((2, 5))]]) * k * step[0])
        assert errors[k] == pytest.approx(C[1] @ (block[:3, :3] @ x + block[:3, 3:] @ u), rel=SAME)
    assert round(RATES["period"] / step[0]) > 1


def test_at_a_level_that_the_estimate_alone_takes_up_there_is_no_controller() -> None:
    """Sigma Q = level^2 to the last bit: I - Sigma Q / level^2 has no inverse, and none is asked for."""
    one = [[1.0]]
    problem = slow_problem(
        dualrate.make_plant([[-1.0]], one, one), period=1.0, ratio=1, hold=1, weights=tuple(np.ones((4, 1, 1)))
    )
    for sigma, positive in ((4.0, False), (5.0, False), (0.1, True)):
        found = _margin(problem, np.full((1, 1, 1), sigma), np.zeros((1, 2, 2)), 2.0)
        assert found <= 1.0 - sigma / 4.0
        assert (found > 0.0) == positive
