"""Exact norms, Riccati equations and periodic systems."""

from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.linear import norms, periodic
from replication.estimation.linear.norms import (
    hinf_norm,
    l2_gain,
    white_noise_variance,
)
from replication.estimation.linear.periodic import (
    LiftedResponse,
    PeriodicSystem,
    Stage,
    frequency_response,
    largest_singular_value,
    simulate,
)
from replication.estimation.linear.riccati import (
    RiccatiMap,
    apply,
    circle_angles,
    recentre,
    settled,
    stacked,
)
from replication.estimation.multirate import optimum as optima
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.optimum import noncausal_bound
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule
from replication.estimation.validation import Array, ComplexArray
from tests.tolerances import AGREEMENT, GRID, ROUNDING


def stable_system(seed: int, n: int, N: int, *, radius: float = 0.95, least: int = 1) -> PeriodicSystem:
    """Stages with different numbers of inputs and outputs, at least so many."""
    rng = np.random.default_rng(seed)
    stages = []
    for _ in range(N):
        m, p = rng.integers(least, 4, 2)
        stages.append([rng.normal(size=(n, n)), *(rng.normal(size=s) for s in ((n, m), (p, n), (p, m)))])
    factor = (radius / PeriodicSystem(tuple(Stage(*s) for s in stages)).spectral_radius()) ** (1 / N)
    return PeriodicSystem(tuple(Stage(factor * A, B, C, D) for A, B, C, D in stages))


def on_grid(system: PeriodicSystem, points: int = 2000) -> float:
    lifted = system.lift()
    return max(np.linalg.norm(frequency_response(lifted, t), 2) for t in np.linspace(0, np.pi, points))


KNOWN: dict[str, tuple[tuple[Any, Any, Any, Any], float]] = {
    **{f"lag {a}": (([[a]], [[2.0]], [[3.0]], [[0.0]]), 6 / (1 - abs(a))) for a in (0.0, 0.5, -0.9, 0.999, 1 - 1e-6)},
    "static": (([[0.0]], [[0.0]], [[0.0]], [[3.0]]), 3.0),
    "without an effect": (([[0.5]], [[0.0]], [[1.0]], [[0.0]]), 0.0),
    "without an input": (([[0.5]], np.zeros((1, 0)), [[1.0]], np.zeros((1, 0))), 0.0),
    # The response e^{-jt} - e^{-3jt} vanishes at 0 and pi, where the search starts.
    "peak between the first samples": ((np.eye(3, k=1), [[0], [0], [1]], [[-1, 0, 1]], [[0]]), 2.0),
}


@pytest.mark.parametrize("name", KNOWN)
def test_norms_by_hand(name: str) -> None:
    system, value = KNOWN[name]
    norm = hinf_norm(*system)
    assert norm.value == pytest.approx(value, rel=AGREEMENT)
    assert norm.upper == 0.0 or value > 0.0


def test_lightly_damped_pair() -> None:
    r, t = 1 - 1e-5, 1.1
    A = r * np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
    norm = hinf_norm(A, [[0], [1]], [[1, 0]], [[0]])
    angles = t + np.linspace(-1e-4, 1e-4, 20001)
    brute = max(abs(frequency_response(Stage(A, np.eye(2)[:, 1:], np.eye(2)[:1], np.zeros((1, 1))), s)) for s in angles)
    assert norm.lower <= norm.upper
    assert norm.value == pytest.approx(float(brute[0, 0]), rel=GRID)
    assert norm.upper >= brute[0, 0] * (1 - ROUNDING)


def test_all_pass_system_has_a_flat_response() -> None:
    a = 0.7
    norm = hinf_norm([[a]], [[1 - a**2]], [[1.0]], [[-a]])
    assert norm.value == pytest.approx(1.0, rel=ROUNDING)
    assert norm.upper == pytest.approx(1.0, rel=GRID)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 5))
def test_the_bracket_holds_a_brute_force_grid(seed: int, n: int, N: int) -> None:
    system = stable_system(seed, n, N)
    norm, grid = l2_gain(system), on_grid(system, 500)
    assert norm.lower <= norm.upper <= norm.lower * (1 + 1e-6)
    assert grid <= norm.upper * (1 + ROUNDING)
    attained = np.linalg.norm(frequency_response(system.lift(), norm.angle), 2)
    assert attained == pytest.approx(norm.lower, rel=AGREEMENT)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 4))
def test_the_norm_is_free_of_the_units_of_the_states(seed: int, n: int, N: int) -> None:
    system, rng = stable_system(seed, n, N), np.random.default_rng(seed)
    units = 10.0 ** rng.uniform(-4, 4, n)
    other = PeriodicSystem(
        tuple(Stage(units[:, None] * A / units, units[:, None] * B, C / units, D) for A, B, C, D in system.stages)
    )
    assert l2_gain(other).value == pytest.approx(l2_gain(system).value, rel=AGREEMENT)


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_the_variance_is_that_of_the_lyapunov_equation_in_any_units(unit: float) -> None:
    """Of a slow and a fast mode that is seen at once; and of stages that differ, by the lifted system."""
    A, B, C = np.diag([0.9999, 0.1]), np.array([[1e-2, 1e-3], [0.0, 1.0]]), np.array([[1.0, 1.0]])
    same = PeriodicSystem((Stage(A, B, C, np.array([[0.0, 2.0]])),) * 3)
    for system in (same, stable_system(5, 2, 4)):
        lifted, units = system.lift(), np.array([1.0, unit])
        P = scipy.linalg.solve_discrete_lyapunov(lifted.A, lifted.B @ lifted.B.T)
        total = np.trace(lifted.C @ P @ lifted.C.T + lifted.D @ lifted.D.T)
        moved = (Stage(units[:, None] * A / units, units[:, None] * B, C / units, D) for A, B, C, D in system.stages)
        assert white_noise_variance(PeriodicSystem(tuple(moved))) == pytest.approx(total / system.period, rel=1e-9)


@pytest.mark.parametrize("a", [1.0, -1.0, 1.5])
def test_an_unstable_system_has_no_finite_gain(a: float) -> None:
    system = PeriodicSystem((Stage(*(np.array([[entry]]) for entry in (a, 1.0, 1.0, 0.0))),))
    for measure in (l2_gain, white_noise_variance):
        with pytest.raises(InfeasibleError, match="not stable"):
            measure(system)


@pytest.mark.parametrize("bad", [[["a"]], [[1, 2]], [1.0], [[float("nan")]], [[1j]]])
def test_bad_matrices_are_named(bad: Any) -> None:
    with pytest.raises(InvalidInputError, match="A"):
        hinf_norm(bad, [[1.0]], [[1.0]], [[0.0]])


def random_map(rng: np.random.Generator, n: int) -> RiccatiMap:
    C, B = rng.normal(size=(2, n)), rng.normal(size=(n, 2))
    return RiccatiMap(rng.normal(size=(n, n)), C.T @ C, B @ B.T)


def states_along(stages: list[RiccatiMap], X: Array) -> list[Array]:
    """One stage after the other, X first: slow, and nothing that can go wrong."""
    states = [X]
    for stage in stages[:-1]:
        states.append(apply(stage, states[-1]))
    return states


def random_state(rng: np.random.Generator, n: int) -> Array:
    root = rng.normal(size=(n, n))
    return root @ root.T


@pytest.mark.parametrize("N", [1, 2, 3, 4, 5, 7, 8, 13])
def test_the_settled_states_are_those_of_one_stage_after_the_other(N: int) -> None:
    rng = np.random.default_rng(N)
    stages = [random_map(rng, 3) for _ in range(N)]
    found = settled(stacked(stages))
    assert found is not None
    for together, alone in zip(found, states_along(stages, found[0]), strict=True):
        np.testing.assert_allclose(together, alone, rtol=0, atol=1e-9 * np.linalg.norm(alone))
    # After one period it is the same again.
    last = apply(stages[-1], found[-1])
    np.testing.assert_allclose(last, found[0], rtol=0, atol=ROUNDING * np.linalg.norm(last))


def test_a_recursion_without_limit_has_no_fixed_point() -> None:
    one = np.eye(1)
    assert settled(stacked([RiccatiMap(2 * one, 0 * one, one)])) is None
    # The first composition of this one is singular: the recursion escapes to infinity.
    assert settled(stacked([RiccatiMap(one, -one, one)] * 2)) is None


@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(1, 5))
def test_the_reference_changes_the_coordinates_only(seed: int, n: int, N: int) -> None:
    rng = np.random.default_rng(seed)
    stages, reference = [random_map(rng, n) for _ in range(N)], [random_state(rng, n) for _ in range(N)]
    X = random_state(rng, n)
    moved = [RiccatiMap(*parts) for parts in zip(*recentre(stacked(stages), np.stack(reference)), strict=True)]
    for k, (direct, deviation) in enumerate(
        zip(states_along(stages, X), states_along(moved, X - reference[0]), strict=True)
    ):
        size = np.linalg.norm(direct) + np.linalg.norm(reference[k])
        np.testing.assert_allclose(deviation + reference[k], direct, rtol=0, atol=1e-8 * size)


def test_an_undisturbed_unstable_mode_is_found_from_a_reference_and_not_from_zero() -> None:
    stage = RiccatiMap(np.array([[2.0]]), np.array([[1.0]]), np.zeros((1, 1)))
    assert settled(stacked([stage])) == pytest.approx(0.0)
    deviation = settled(recentre(stacked([stage]), np.ones((1, 1, 1))))
    assert deviation is not None
    # X = 4 X / (1 + X) has the solutions 0 and 3; 3 is the stabilising one.
    assert 1 + deviation[0, 0, 0] == pytest.approx(3.0, rel=ROUNDING)


def test_circle_angles_are_the_crossings_of_a_level_whatever_the_reference() -> None:
    """1 / (z - a) has modulus g where 1 + a^2 - 2 a cos t = 1 / g^2; here by the map of the bounded real lemma."""
    a, g, one = 0.8, 2.0, np.eye(1)
    stages = stacked([RiccatiMap(a * one, -one / g**2, one)])
    crossing = np.arccos((1 + a**2 - 1 / g**2) / (2 * a))
    for reference in (0.0, 0.3, 5.0):
        angles = circle_angles(recentre(stages, reference * one[None]), 1e-7)
        np.testing.assert_allclose(angles, [crossing, crossing], rtol=ROUNDING)


def test_the_frequency_response_solves_its_equation() -> None:
    stage = stable_system(4, 3, 4, radius=0.5, least=0).lift()
    z = np.exp(0.7j)
    impulse = [stage.D] + [stage.C @ np.linalg.matrix_power(stage.A, k) @ stage.B for k in range(300)]
    series = sum(h * z**-k for k, h in enumerate(impulse))
    np.testing.assert_allclose(frequency_response(stage, 0.7), series, atol=1e-9)


ONE = np.eye(1)


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        ((), "at least one stage"),
        (((ONE, ONE, ONE),), "four matrices"),
        ((7,), "four matrices"),
        (((np.zeros((0, 0)), ONE, ONE, ONE),), "at least one state"),
        (((np.ones((2, 1)), ONE, ONE, ONE),), "A_0 must have 2 columns"),
        (((ONE, np.ones((2, 1)), ONE, ONE),), "B_0 must have 1 rows"),
        (((ONE, ONE, np.ones((1, 2)), ONE),), "C_0 must have 1 columns"),
        (((ONE, ONE, ONE, np.ones((2, 1))),), "D_0 must have 1 rows"),
        (((ONE, ONE, ONE, ONE), (np.eye(2), ONE, ONE, ONE)), "A_1 must have 1 rows"),
        (((ONE, ONE, ONE, ONE * np.nan),), "D_0 must be finite"),
    ],
)
def test_stages_that_do_not_fit_are_named(stages: Any, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        PeriodicSystem(stages)


def test_a_simulation_of_one_period_is_the_lifted_system() -> None:
    rng = np.random.default_rng(7)
    system = PeriodicSystem(
        tuple(Stage(*(rng.normal(size=shape) for shape in ((2, 2), (2, 3), (1, 2), (1, 3)))) for _ in range(4))
    )
    inputs, start, lifted = rng.normal(size=(4, 3)), rng.normal(size=2), system.lift()
    expected = lifted.C @ start + lifted.D @ inputs.ravel()
    assert np.abs(simulate(system, inputs, start).ravel() - expected).max() < ROUNDING * np.abs(expected).max()


RANDOM = MultiratePlant(
    A=[[0.95, 0.5, 0.2], [-0.1, 1.1, -0.2], [0, 0.1, 0.85]],
    B_d=[[0.1], [0.3], [0.2]],
    C=[[1, 0.5, 0], [1, 2.5, 0.2]],
    D=[[1, 0], [0.3, 0.5]],
)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(1, 60), st.floats(0, np.pi))
def test_the_operator_and_its_adjoint_are_the_lifted_matrix(seed: int, n: int, N: int, angle: float) -> None:
    system, rng = stable_system(seed, n, N, least=0), np.random.default_rng(seed)
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
    stage = stable_system(3, 4, 1).stages[0]
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


def test_a_level_whose_pencil_overflows_is_lost_in_rounding_and_no_error_of_scipy() -> None:
    """A gain that is zero but for rounding: its level squared is below the least number, on some processors."""
    stages = RiccatiMap(np.zeros((1, 1, 1)), np.zeros((1, 1, 1)), np.full((1, 1, 1), -np.inf))
    with pytest.raises(np.linalg.LinAlgError, match="overflows"):
        circle_angles(stages, 1e-7)
