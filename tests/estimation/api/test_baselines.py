"""The levels beside a guaranteed one, by other packages, and the advice that follows from them."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from replication.estimation import multirate, nonuniform
from replication.estimation.api.results import LITTLE, Bracket, baselines
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.nonuniform.plant import SampledPlant

A, B_D, C, D = np.array([[0.9, 0.1], [0.0, 0.8]]), np.array([[0.0], [0.1]]), np.eye(2), np.diag([0.5, 0.1])
LEVELS = 1e-7


def gain(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> float:
    """The largest singular value on the unit circle, by a scan that is refined around its maximum."""

    def at(angle: float) -> float:
        response = C @ np.linalg.solve(np.exp(1j * angle) * np.eye(len(A)) - A, B)
        return float(np.linalg.norm(response, 2))

    angles = np.linspace(0, np.pi, 400)
    best = angles[int(np.argmax([at(angle) for angle in angles]))]
    near = (max(best - angles[1], 0), min(best + angles[1], np.pi))
    return max(at(0.0), -minimize_scalar(lambda angle: -at(angle), bounds=near, options={"xatol": 1e-10}).fun)


def test_multirate_levels_are_those_of_other_packages() -> None:
    result = multirate.design(MultiratePlant(A=A, B_d=B_D, C=C, D=D), periods=(1, 1))
    L = control.dlqe(A, np.eye(2), C, B_D @ B_D.T, D @ D.T)[0]
    kalman = gain(A - L @ C, np.hstack([B_D, -L @ D]), np.eye(2))
    assert result.fact("level without sensors").value == pytest.approx(gain(A, B_D, np.eye(2)), rel=LEVELS)
    assert result.fact("level of the Kalman filter").value == pytest.approx(kalman, rel=LEVELS)
    limit = result.fact("limit of any smoother").value
    assert isinstance(limit, float) and limit <= result.value <= kalman * (1 + LEVELS)


def test_a_plant_that_is_not_stable_has_no_level_without_sensors() -> None:
    cart = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=C, D=D)
    assert multirate.design(cart, periods=(1, 1)).fact("level without sensors").value == "infinite"


@pytest.mark.parametrize(("noise", "told"), [(0.1, False), (50.0, True)])
def test_sensors_that_gain_little_are_told(noise: float, told: bool) -> None:
    result = multirate.design(MultiratePlant(A=A, B_d=B_D, C=C, D=noise * np.eye(2)), periods=(1, 3))
    assert ("advice" in {fact.what for fact in result.evidence}) is told


def test_advice_begins_where_it_is_said_to() -> None:
    def words(level: float | Bracket, without: float | Bracket = 1.0) -> list[str]:
        return [str(fact.value) for fact in baselines(level, "", without=without) if fact.what == "advice"]

    assert words(1 - LITTLE - 1e-9) == []
    assert words(0.95) == ["only 5 % below the level without sensors"]
    assert words(1.0) == words(2.0) == ["not below the level without sensors"]
    wide = Bracket(1.0, 1.2, "")
    assert words(Bracket(0.5, 0.89, ""), wide) == []
    assert words(Bracket(0.9, 0.99, ""), wide) == []
    for low, high in ((0.5, 1.0), (1.1, 1.3)):
        [told] = words(Bracket(low, high, ""), wide)
        assert told == f"open whether below the level without sensors: [{low:g}, {high:g}] against [1, 1.2]"
    assert words(Bracket(1.2, 1.3, ""), wide) == ["not below the level without sensors"]
    assert words(Bracket(0.95, 0.98, ""), Bracket(1.0, 1.01, "")) == ["only 5.9 % below the level without sensors"]


def test_nonuniform_levels_are_those_of_other_packages() -> None:
    tank = SampledPlant([[-1, 0], [1, -0.5]], [[1, 0], [0, 0]], [[0, 1]], [[0, 0.1]], [[1, 0]])
    result = nonuniform.design(tank, periods=(0.2, 0.2), leaves=1, horizon=30)
    Phi, Gamma = tank.discretise(0.2)
    L = control.dlqe(Phi, np.eye(2), tank.C, Gamma @ Gamma.T, tank.D @ tank.D.T)[0]
    kalman = gain(Phi - L @ tank.C, Gamma - L @ tank.D, tank.L)
    assert result.fact("level of the Kalman filter").value == pytest.approx(kalman, rel=LEVELS)
    assert result.fact("level without sensors").value == pytest.approx(gain(Phi, Gamma, tank.L), rel=LEVELS)
    own = result.fact("level at constant periods").value
    assert isinstance(own, float) and result.bracket.lower == pytest.approx(own, rel=0.1) and own <= result.value


def test_a_filter_that_would_gain_by_time_stamps_says_so() -> None:
    swing = SampledPlant([[0, 1], [-25, -0.5]], [[0, 0], [25, 0]], [[1, 0]], [[0, 0.1]], [[1, 0]])
    result = nonuniform.design(swing, periods=(0.05, 0.1), leaves=2, horizon=50)
    assert "know the period" in str(result.fact("advice").value)
    steady = nonuniform.design(swing, periods=(0.1, 0.1), leaves=1, horizon=50)
    assert "advice" not in {fact.what for fact in steady.evidence}
