"""Plants on the border of what floating point can tell: undamped modes, faint noise, entries without measure."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from replication.errors import InvalidInputError
from replication.estimation import multirate
from replication.estimation.multirate import MultiratePlant


def oscillator(frequency: float) -> MultiratePlant:
    A = scipy.linalg.expm(0.05 * np.array([[0.0, 1.0], [-(frequency**2), 0.0]]))
    return MultiratePlant(A=A, B_d=0.05 * np.eye(2), C=[[1.0, 0.0]], D=[[0.1]], dt=0.05)


@pytest.mark.parametrize("goal", ["hinf", "h2"])
def test_an_undamped_plant_has_no_finite_level_without_sensors_however_its_modes_round(goal: str) -> None:
    plants = [oscillator(frequency) for frequency in np.linspace(0.5, 20.0, 12)]
    # Rounding puts some of them within the circle: the error would be said to die out by itself.
    assert any(np.max(np.abs(np.linalg.eigvals(plant.A))) < 1.0 for plant in plants)
    for plant in plants:
        found = multirate.design(plant, periods=(3,), goal=goal)
        assert found.fact("level without sensors").value == "infinite"
        assert np.isfinite(found.value)


def test_a_plant_that_settles_slowly_has_a_level_without_sensors() -> None:
    plant = MultiratePlant(A=[[1 - 1e-3]], B_d=[[1.0]], C=[[1.0]], D=[[0.1]])
    assert multirate.design(plant, periods=(2,)).fact("level without sensors").value == pytest.approx(1e3, rel=1e-6)
    slower = MultiratePlant(A=[[1 - 1e-9]], B_d=[[1.0]], C=[[1.0]], D=[[0.1]])
    without = multirate.design(slower, periods=(2,)).fact("level without sensors").value
    assert without == "infinite" or (isinstance(without, float) and without >= 1e9 * (1 - 1e-6))


def faint(noise: float) -> MultiratePlant:
    return MultiratePlant(A=[[0.9, 1.0], [0.0, 0.95]], B_d=[[0.0], [1.0]], C=[[1, 0]], D=[[noise]], W=[[0.0, 1.0]])


@pytest.mark.parametrize("noise", [1e-3, 1e-5, 3e-7])
def test_the_optimum_is_reached_as_long_as_rounding_lets_the_noise_be_seen(noise: float) -> None:
    found = multirate.design(faint(noise), periods=(2,))
    optimum = found.fact("optimum").value
    assert isinstance(optimum, float)
    assert optimum * (1 - 1e-9) <= found.value <= optimum * (1 + 1e-3)


@pytest.mark.parametrize("noise", [1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize("level", [None, 4.0])
def test_noise_that_rounding_hides_is_refused_before_a_false_optimum_is_told(noise: float, level: float | None) -> None:
    with pytest.raises(InvalidInputError, match="too little for floating point; give the sensor more noise by D"):
        multirate.design(faint(noise), periods=(2,), level=level)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"A": [[1e80, 0.0], [0.0, 0.95]]}, "A has an entry of size 1e\\+80, whose powers"),
        ({"D": [[1e160]]}, "D has an entry of size 1e\\+160"),
        ({"W": [[1e160, 0.0]]}, "W has an entry of size 1e\\+160"),
        ({"under_way": 5}, "under_way must be at most 1, got 5"),
        ({"under_way": "two"}, "under_way must be a whole number"),
    ],
)
def test_what_leaves_the_range_of_numbers_is_named(change: dict[str, object], told: str) -> None:
    given = {"A": [[0.9, 1.0], [0.0, 0.95]], "B_d": np.eye(2), "C": [[1.0, 0.0]], "D": [[0.1]], **change}
    with pytest.raises(InvalidInputError, match=told):
        MultiratePlant(**given)  # type: ignore[arg-type]
