"""Stationary covariances against scipy on the lifted plant and a plain recursion; matrices that are refused."""

from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from multirate_examples import (
    PAPER,
    Recipe,
    by_lifted_equation,
    by_plain_recursion,
    correlated,
    problem,
    with_noise_as_state,
)

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.multirate import kalman
from replication.estimation.multirate.kalman import kalman_design, steady_state
from replication.estimation.multirate.optimum import optimum
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.validation import Array, noise_factors
from tests.tolerances import AGREEMENT, ROUNDING

EQUAL = 1e-9
SINGULAR = MultiratePlant(
    A=[[0, 1, 0], [0, 0, 1], [0, 0, 0]], B_d=[[0], [1], [2]], C=[[1, 0, 1], [0, 1, 0]], D=np.eye(2)
)
UNSTABLE = MultiratePlant(A=[[1.2, 1], [0, 0.7]], B_d=[[0], [1]], C=[[1, 0], [1, 1]], D=[[0.3, 0.1], [0, 0.2]])
OSCILLATOR = MultiratePlant(A=[[0.6, 0.8], [-0.8, 0.6]], B_d=[[1], [0]], C=[[1, 0], [1, 1]], D=np.diag([1.0, 0.1]))
PLANTS = {"paper": PAPER, "singular": SINGULAR, "unstable": UNSTABLE, "oscillator": OSCILLATOR}
SCHEDULES = [((1, 1), ()), ((2, 3), ()), ((2, 4), (1, 2)), ((3, 5), (0, 1))]


def near(found: Array, wanted: Array, tolerance: float = EQUAL) -> None:
    np.testing.assert_allclose(found, wanted, rtol=0, atol=tolerance * np.linalg.norm(wanted))


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize(("periods", "offsets"), SCHEDULES)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_they_solve_the_equation_of_the_lifted_plant(
    name: str, periods: tuple[int, ...], offsets: tuple[int, ...], share: float
) -> None:
    """Semi-definite Q everywhere: there are fewer disturbances than states."""
    given_problem = correlated(problem(PLANTS[name], periods, offsets), 3, share)
    found = kalman_design(given_problem)
    near(found.X[0], by_lifted_equation(given_problem))
    assert steady_state(given_problem) is not None
    N = len(found.X)
    for k, P in enumerate(by_plain_recursion(given_problem, found.X[0], N)):
        near(found.X[k % N], P)


@pytest.mark.parametrize("kind", ["stable", "unstable", "rotation", "singular", "repeated"])
@pytest.mark.parametrize("seed", range(6))
def test_random_plants_solve_it_too(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    periods = tuple(int(period) for period in rng.integers(1, 4, size=2))  # scipy reorders no longer ones
    recipe = Recipe(seed, kind, 4, 2, 4, 1 + seed % 2, seed % 3 == 0, 0.0, periods, (0, periods[1] - 1))
    for share in (0.0, 0.3):
        random = correlated(recipe.build(), seed, share)
        near(kalman_design(random).X[0], by_lifted_equation(random))


@pytest.mark.parametrize("name", PLANTS)
def test_both_ways_to_them_agree(name: str) -> None:
    """The one of all phases at once, and the one by scaled states that takes over where the first gives up."""
    for share in (0.0, 0.5):
        given_problem = correlated(problem(PLANTS[name], (2, 3)), 5, share)
        fast = kalman_design(given_problem)
        with patch.object(kalman, "steady_state", return_value=None):
            careful = kalman_design(given_problem)
        near(fast.X, careful.X)
        near(fast.gains, careful.gains)


@pytest.mark.parametrize("mode", [1.0, -1.0])
def test_a_mode_on_the_circle_that_nothing_disturbs_is_not_settled_at_once(mode: float) -> None:
    """From zero the recursion never learns of it: it would end in gains that do not stabilise."""
    plant = MultiratePlant(A=np.diag([mode, 0.5]), B_d=[[0], [1]], C=[[1, 1]], D=[[1]])
    assert steady_state(problem(plant, (2,))) is None


def test_a_mode_that_only_known_noise_disturbs_never_settles() -> None:
    """The measurement tells all of the noise of the first state: what is left is a mode on the circle, undisturbed."""
    told = MultiratePlant(
        A=np.diag([1.5, 0.5]), B_d=[[0], [1]], C=[[0.5, 0], [0, 1]], D=np.eye(2), B_w=[[1, 0], [0, 0]]
    )
    with pytest.raises(InvalidInputError, match="not disturbed"):
        kalman_design(problem(told, (1, 1)))


@pytest.mark.parametrize("periods", [(1, 1), (2, 3), (2, 2)])
def test_correlated_noise_is_noise_that_is_a_state(periods: tuple[int, ...]) -> None:
    """Optimum, non-causal bound and covariance of both forms of one problem."""
    rng = np.random.default_rng(8)
    own, common = np.diag([0.3, 0.6]), rng.normal(size=(2, 2))
    B_w = np.hstack([rng.normal(size=(2, 2)), np.zeros((2, 2))])
    plant = MultiratePlant(
        A=[[0.9, 0.4], [-0.3, 1.02]], B_d=[[0.2], [1]], C=[[1, 0], [1, -1]], D=np.hstack([common, own]), B_w=B_w
    )
    short = problem(plant, periods)
    long = with_noise_as_state(short, own)
    assert optimum(short).value == pytest.approx(optimum(long).value, rel=AGREEMENT)
    assert optimum(short).noncausal.value == pytest.approx(optimum(long).noncausal.value, rel=AGREEMENT)
    near(kalman_design(short).X, kalman_design(long).X[:, :2, :2])


def test_the_factors_have_the_covariances() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(5, 4))
    joint = root @ root.T + np.diag([0, 0, 0, 0.1, 0.1])
    Q, R, S = joint[:3, :3], joint[3:, 3:], joint[:3, 3:]
    B_d = rng.normal(size=(2, 3))
    plant = MultiratePlant.from_covariances(A=0.5 * np.eye(2), C=np.eye(2), B_d=B_d, Q=Q, R=R, S=S)
    near(plant.B_d @ plant.B_d.T + plant.B_w @ plant.B_w.T, B_d @ Q @ B_d.T, ROUNDING)
    near(plant.D @ plant.D.T, R, ROUNDING)
    near(plant.B_w @ plant.D.T, B_d @ S, ROUNDING)
    plain = MultiratePlant.from_covariances(A=0.5 * np.eye(2), C=np.eye(2), Q=Q[:2, :2], D=2 * np.eye(2))
    near(plain.B_d @ plain.B_d.T, Q[:2, :2], ROUNDING)
    assert not plain.correlated
    vector, matrix = (MultiratePlant.from_covariances(**{**GOOD, "R": R}) for R in ([4.0, 9.0], np.diag([4.0, 9.0])))
    assert np.array_equal(vector.D, matrix.D)


def test_the_units_of_the_noise_do_not_matter() -> None:
    units = np.diag([1e-6, 1e5])
    Q, R, S = np.array([[2.0, 1], [1, 3]]), np.array([[1.0, 0.2], [0.2, 1]]), np.array([[0.3, 0], [0.1, -0.2]])
    plain = noise_factors(Q, R, S, disturbances=2, sensors=2)
    scaled = noise_factors(units @ Q @ units, units @ R @ units, units @ S @ units, disturbances=2, sensors=2)
    for before, after in zip(plain, scaled, strict=True):
        np.testing.assert_allclose(after @ after.T, units @ before @ before.T @ units, rtol=EQUAL)


GOOD: dict[str, Any] = {"A": 0.5 * np.eye(2), "C": np.eye(2), "Q": np.eye(2), "R": np.eye(2)}
BAD: list[tuple[dict[str, Any], str]] = [
    ({"Q": [[1, 2], [2, 1]]}, "Q must be positive semidefinite"),
    ({"Q": [[0, 1], [1, 1]]}, "Q must be positive semidefinite"),
    ({"Q": [[1, 0], [0, -1]]}, r"Q\[1\]\[1\] is a variance and must not be negative, got -1"),
    ({"Q": [[1, 0.5], [0, 1]]}, "Q must be symmetric"),
    ({"Q": np.eye(3)}, "Q must have 2 rows"),
    ({"Q": [[np.nan, 0], [0, 1]]}, "Q must be finite"),
    ({"R": [[1, 2], [2, 1]]}, "R must be positive semidefinite"),
    ({"R": [[1, 1], [1, 1]]}, "R must be positive definite, but noises of several sensors determine each other"),
    ({"R": np.diag([1, 0])}, r"R must be positive definite, R\[1\]\[1\] is 0"),
    ({"R": np.eye(1)}, "R must have 2 rows"),
    ({"R": [1.0]}, "R must have 2 rows"),
    ({"S": np.diag([1.1, 0])}, "S does not fit Q and R"),
    ({"S": np.eye(3)}, "S must have 2 rows"),
    ({"Q": None}, "give the process noise"),
    ({"R": None}, "give the sensor noise once"),
    ({"D": np.eye(2)}, "give the sensor noise once"),
]


@pytest.mark.parametrize(("changes", "message"), BAD, ids=[message[:30] for _, message in BAD])
def test_each_bad_covariance_has_its_own_error(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        MultiratePlant.from_covariances(**{**GOOD, **changes})


def test_noise_that_drives_the_state_meets_its_own_correction() -> None:
    """One unit of w at an instant, plant and observer at zero: e^+ = B_w w - L (y - 0), with y = D w."""
    found = correlated(problem(UNSTABLE, (1, 2)), 3)
    gains = np.random.default_rng(4).normal(size=(2, 2, 2))
    for k, stage in enumerate(found.error_system(gains).stages):
        due = found.schedule.mask[k]
        for i, w in enumerate(np.eye(2)):
            error = found.plant.B_w @ w - gains[k] @ (due * (found.plant.D @ w))
            near(stage.B[:, 1 + i], error, ROUNDING)


def test_what_the_sensors_read_of_a_known_input_is_taken_off() -> None:
    """With y = D_u u and both states at zero the innovation is zero: x^+ = B_u u."""
    plant = replace(UNSTABLE, B_u=np.array([[0.3], [-0.2]]), D_u=np.array([[0.5], [2.0]]))
    for phase in multirate.design(plant, periods=(1, 2)).phases().phases:
        near(phase.input + phase.injection @ plant.D_u, plant.B_u, ROUNDING)


@pytest.mark.parametrize("share", [1e-8, 1e-9])
def test_a_mode_that_is_hardly_disturbed_is_not_taken_for_settled(share: float) -> None:
    """From zero its variance rises so slowly, beside that of the other mode, that it seems to stand still."""
    V = np.array([[1.0, 1.0], [1.0, -1.0]])
    back = np.linalg.inv(V)
    plant = MultiratePlant(A=V @ np.diag([1 - 1e-9, 0.5]) @ back, B_d=V @ [[share], [1]], C=[[1, 1]] @ back, D=[[1]])
    at_once = kalman.kalman_centre(problem(plant, (2,)))
    with patch.object(kalman, "_in_scales", return_value=None):
        careful = kalman.kalman_centre(problem(plant, (2,)))
    found, wanted = (back @ way.design(way.states, np.inf).X[0] @ back.T for way in (at_once, careful))
    assert found[0, 0] == pytest.approx(wanted[0, 0], rel=1e-6)
