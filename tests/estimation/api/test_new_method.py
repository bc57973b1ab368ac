"""A method is its mathematics: an observer with a constant gain, given by plant, `solve`, `error_system`, `phases`."""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import control
import numpy as np
import pytest
import scipy

from replication.estimation.api.design import Design, Solution
from replication.estimation.api.export import Phase, Recursion
from replication.estimation.api.plants import Signals, numbered
from replication.estimation.api.portable import load
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from tests.estimation.compiled import Compiled

MOST_LINES = 150


class Plant(NamedTuple):
    """x+ = A x + B d, y = C x + w."""

    A: Any
    B: Any
    C: Any


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ConstantGain(Design):
    """x^+ = A x^ + L (y - C x^)."""

    method: str = "constant gain"
    quantity: str = "l2 gain from (d, w) to the estimation error"
    axes: Mapping[str, str] = field(default_factory=lambda: {"L": "(state, sensor)"})
    problem: Plant

    @classmethod
    def solve(cls, problem: Plant, *, noise: float = 1.0) -> Solution:
        """The stationary Kalman gain for sensor noise of this variance."""
        A, B, C = problem.A, problem.B, problem.C
        P = scipy.linalg.solve_discrete_are(A.T, C.T, B @ B.T, noise * np.eye(len(C)))
        return Solution({"L": A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + noise * np.eye(len(C)))})

    def error_system(self) -> PeriodicSystem:
        A, B, C, L, n = self.problem.A, self.problem.B, self.problem.C, self.gains["L"], len(self.problem.A)
        drive = np.hstack([B, -L])
        return PeriodicSystem((Stage(A - L @ C, drive, np.eye(n), np.zeros((n, drive.shape[1]))),))

    def phases(self) -> Recursion:
        A, C, L, n = self.problem.A, self.problem.C, self.gains["L"], len(self.problem.A)
        due = np.ones(len(C), dtype=bool)
        return Recursion([Phase(A - L @ C, np.zeros((n, 0)), L, np.eye(n), due)], n, [C])

    def without_sensors(self) -> PeriodicSystem:
        n, m = self.problem.B.shape
        return PeriodicSystem((Stage(self.problem.A, self.problem.B, np.eye(n), np.zeros((n, m))),))


def design(plant: Plant, **aims: Any) -> ConstantGain:
    return ConstantGain.design(plant, signals_of(plant), **aims)


def signals_of(plant: Plant) -> Signals:
    states = numbered("x", len(plant.A))
    return Signals(states, (), numbered("y", len(plant.C)), states, 0.1)


PLANT = Plant(*map(np.array, ([[0.9, 0.1], [0.0, 0.8]], [[0.0], [1.0]], [[1.0, 0.0]])))


def test_a_method_is_short() -> None:
    whole = [Plant, ConstantGain, design, signals_of]
    assert sum(len(inspect.getsource(part).splitlines()) for part in whole) <= MOST_LINES


def test_the_level_is_the_norm_of_the_error() -> None:
    result = design(PLANT)
    error = result.error_system().stages[0]
    curve = control.singular_values_response(control.ss(*error, 0.1), np.linspace(0.01, np.pi / 0.1, 4000))
    assert curve.magnitude.max() <= result.value
    assert result.bracket.lower == pytest.approx(curve.magnitude.max(), rel=1e-5)
    assert result.bracket.width < 1e-6
    assert result.value < result.fact("level without sensors").value  # type: ignore[operator]


def test_it_runs_in_python_in_c_and_from_a_file(tmp_path: Path) -> None:
    observer = design(PLANT).observer()
    (tmp_path / "own.json").write_text(observer.to_json(), encoding="utf-8")
    compiled, loaded = Compiled(observer, tmp_path), load(tmp_path / "own.json")
    compiled.reset([0.0, 0.0])
    for y in np.random.default_rng(2).standard_normal((50, 1)):
        estimate = observer.step(None, y)
        assert np.allclose(compiled.step([0.0], y)[1], estimate, rtol=1e-13, atol=1e-13)
        assert np.array_equal(loaded.step(None, y), estimate)
