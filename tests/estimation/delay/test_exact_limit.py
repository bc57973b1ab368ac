"""The least level: against published ones, hand-made formulas, other models of the delay, and invariances."""

from dataclasses import replace
from math import factorial
from typing import Any
from unittest.mock import patch

import control
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from papers.peet2019.method import chebyshev_model, open_loop_gain, riccati_gain
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import Evidence
from replication.estimation.delay import DelayPlant, delay_system
from replication.estimation.delay.exact import limit as filtering
from replication.estimation.delay.exact.central import FilterModel, hamiltonian, ladder_model, shift
from replication.estimation.delay.exact.limit import _angle, filter_level, limit
from replication.estimation.delay.exact.smoothing import kalman_level, smoother_bound, smoother_gains, worth
from replication.estimation.delay.exact.terms import plant_terms
from tests.estimation.delay import plants
from tests.estimation.delay.plants import averaged, delayed_output, late, two_late


def predicted(rate: float, noise: float, delay: float) -> float:
    """The level of `late`: filter up to t - delay, then a prediction whose Riccati equation must not escape.

    Y = (a + sqrt(a^2 + k)) / k with k = 1/noise^2 - 1/g^2; then P' = 1 + 2 a P + P^2/g^2 from Y escapes after
    the integral of dP / (1 + 2 a P + P^2/g^2): at the least level, after exactly the delay.
    """

    def spare(level: float) -> float:
        k = noise**-2 - level**-2
        root = np.sqrt(rate**2 + k)
        if not root > rate:
            return -delay
        crossings = np.roots([1.0, 2.0 * rate, level**-2])
        if any(abs(c.imag) < 1e-13 and 0.0 <= c.real <= root - rate for c in crossings):
            return 1.0  # P comes to rest before it escapes
        return quad(lambda u: 1.0 / (u * u + 2.0 * rate * u + level**-2), 0.0, root - rate, epsabs=1e-13)[0] - delay

    least = noise / np.sqrt(1.0 + (rate * noise) ** 2)
    levels = least * np.geomspace(1.0 + 1e-6, 1e3, 4000)
    refused = [i for i, level in enumerate(levels) if spare(level) < 0.0]
    return float(brentq(spare, levels[refused[-1]], levels[refused[-1] + 1], xtol=1e-14))


@pytest.mark.parametrize(
    ("rate", "noise", "delay"), [(-1.0, 0.5, 1.0), (0.5, 1.0, 1.0), (1.0, 0.1, 0.3), (0.0, 1.0, 0.5)]
)
def test_a_late_measurement_costs_a_prediction(rate: float, noise: float, delay: float) -> None:
    found = limit(late(rate, noise, delay))
    assert found.settled
    assert found.level == pytest.approx(predicted(rate, noise, delay), rel=1e-9)
    assert found.smoother == pytest.approx(noise / np.sqrt(1.0 + (rate * noise) ** 2), rel=1e-9)
    assert found.causality > 0.05 * found.level
    assert abs(limit(late(rate, noise, 1.01 * delay)).level - found.level) > 1e-4 * found.level


def test_a_late_measurement_without_noise() -> None:
    """Only the last second of w is unknown: the norm of 1/(s+1) over one second, at w = -tan w."""
    plant = DelayPlant([[-1.0]], [1.0], [[1.0]], [[1.0]], [[0.0]], c2_delayed=[[[1.0]]])  # type: ignore[arg-type]
    found = limit(plant)
    omega = brentq(lambda w: np.tan(w) + w, np.pi / 2 + 1e-9, np.pi)
    assert found.level == pytest.approx(1.0 / np.hypot(1.0, omega), rel=1e-8)
    assert found.smoother == 0.0


def test_the_public_examples() -> None:
    first, second = limit(delayed_output()), limit(two_late())
    assert f"{first.level:.3f}" == "1.808"
    # The published level is an upper bound from a program: near the least one, and above it.
    assert second.level < 1.0448 < second.level * 1.001
    for found in (first, second):
        assert found.settled and found.moving < 1e-8
        assert found.level == pytest.approx(found.smoother, rel=1e-9)  # neither is limited by causality


@pytest.mark.parametrize("make", [plants.one_delay, plants.two_delays, plants.unstable_pair, plants.blind_pair])
def test_the_plant_of_the_paper(make: Any) -> None:
    system: DelayPlant = make()
    assert limit(system).level == pytest.approx(riccati_gain(chebyshev_model(system, 14)), rel=1e-7)


def test_the_ladder_is_the_lossless_approximant() -> None:
    for order in (1, 4, 7):
        drift, source, reading, direct = shift(order)
        s = 2.3j
        assert abs(drift + drift.T + np.outer(source, source)).max() < 1e-12
        value = reading @ np.linalg.solve(s * np.eye(order) - drift, source) + direct
        assert abs(abs(value) - 1.0) < 1e-12
        error = factorial(order) ** 2 / (factorial(2 * order) * factorial(2 * order + 1)) * abs(s) ** (2 * order + 1)
        assert error / 30.0 < abs(value - np.exp(-s)) < 30.0 * error


@pytest.mark.parametrize("seed", range(4))
def test_a_static_plant(seed: int) -> None:
    """z = D_11 w, y = D_21 w: what remains of D_11 on the kernel of D_21."""
    rng = np.random.default_rng(seed)
    d11, d21 = rng.standard_normal((2, 4)), rng.standard_normal((2, 4))
    model = FilterModel(-np.eye(1), rng.standard_normal((1, 4)), np.zeros((2, 1)), d11, np.zeros((2, 1)), d21)
    wanted = np.linalg.norm(d11 @ np.linalg.svd(d21)[2][2:].T, 2)
    assert filter_level(model) == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("make", [averaged, delayed_output, two_late, plants.three_delays])
def test_no_frequency_has_more_than_the_smoother(make: Any) -> None:
    plant = make()
    found = limit(plant)
    assert found.settled and found.smoother <= found.level * (1 + 1e-9)
    assert smoother_gains(plant_terms(plant), np.linspace(0.0, 30.0, 4001)).max() <= found.smoother * (1 + 1e-9)


def test_what_still_moves_is_said() -> None:
    exact = limit(two_late())
    with patch.object(filtering, "ORDERS", (2, 3, 4)):
        rough = limit(two_late())
    assert not rough.settled
    assert abs(rough.level - exact.level) <= rough.moving


def test_a_level_of_zero() -> None:
    """One disturbance, measured at once without noise: y reveals all."""
    plant = DelayPlant([[-1.0]], [0.5], [[1.0]], [[1.0]], [[1.0]], a=[[[0.3]]])  # type: ignore[arg-type]
    found = limit(plant)
    assert (found.level, found.smoother) == (0.0, 0.0)


def test_what_has_no_level() -> None:
    unseen = DelayPlant([[0.5, 0], [0, -1]], [0.3], np.eye(2, 3), [[1, 0]], [[0, 1]], d21=[[0, 0, 1]])  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"does not see the root 0\.5;"):
        limit(unseen)
    with pytest.raises(InvalidInputError, match="tolerance"):
        limit(two_late(), 0.0)
    # At a model without detectability the equation itself refuses.
    model = ladder_model(plant_terms(unseen), 3)
    with pytest.raises(InfeasibleError, match="no finite level"):
        filter_level(model)


def test_the_price_of_causality_is_what_the_future_would_save() -> None:
    found = limit(late(-0.5, 0.3, 1.0), 1e-4)
    assert 0 < found.causality == found.level - found.smoother < found.level
    assert replace(found, smoother=2 * found.level).causality == 0.0


@pytest.mark.parametrize("share", [1.0, 0.7])
def test_where_a_filter_leaves_only_a_sign_the_least_level_is_found_by_halving(share: float) -> None:
    """Below a share of the least level no equation has a solution, and above it a filter is told by how much."""
    rng = np.random.default_rng(1)
    model = FilterModel(-np.eye(2), rng.normal(size=(2, 3)), np.eye(2), np.zeros((2, 3)), np.eye(1, 2), np.eye(3)[[2]])
    least = 5.0 * smoother_bound(model.terms).level

    def angle(model: FilterModel, level: float) -> float:
        return -1.0 if level < share * least else float(np.arctan(level / least - 1.0)) + 0.1 * (share == 1.0)

    with patch.object(filtering, "_angle", angle):
        assert filtering._filter_level(model, 0.0) == pytest.approx(least, rel=1e-10)


# The levels beside that of a delay observer: by other code where there is some, and where all is known


TANKS: dict[str, Any] = {
    "a0": [[-1, 0.2], [0.5, -2]], "a": [[[0, 0], [0.5, 0.2]]], "delays": [0.4], "b": np.eye(2, 3), "c10": np.eye(2),
    "c2": [[1, 0]],
}  # fmt: skip


def noisy(size: float, **changes: Any) -> DelayPlant:
    return DelayPlant(**{**TANKS, "d21": [[0, 0, size]], **changes})


def facts(plant: Any, level: float) -> dict[str, Evidence]:
    return {fact.what: fact for fact in worth(plant_terms(plant), level)}


def test_without_sensors_it_is_the_gain_of_the_plant() -> None:
    silent = delay_system(**{**TANKS, "b": np.eye(2)})
    found = facts(silent, 1.0)
    assert found["level without sensors"].value == pytest.approx(open_loop_gain(silent).upper, rel=1e-4)
    assert found["level of the Kalman filter"].value == "none"
    unstable = noisy(0.3, a0=[[0.5, 0.2], [0.5, -2]])
    assert facts(unstable, 1.0)["level without sensors"].value == "infinite"
    integrator = noisy(0.3, a0=[[0, 0.2], [0, -2]], a=[[[0, 0], [0, 0.2]]])
    assert facts(integrator, 1.0)["level without sensors"].value in ("open", "infinite")


def test_poor_sensors_are_told_of() -> None:
    found = facts(noisy(1e3), 1.36)
    assert "without sensors" in str(found["advice"].value)
    kalman, without = found["level of the Kalman filter"].value, found["level without sensors"].value
    assert kalman == pytest.approx(without, rel=1e-3)


def test_without_delays_it_is_the_filter_of_control() -> None:
    model = ladder_model(plant_terms(noisy(0.3)), 3)
    direct = replace(model, dz=0.2 * np.ones_like(model.dz))
    for each in (model, direct):
        L, _, _ = control.lqe(each.a, each.b, each.cy, np.eye(3), each.dy @ each.dy.T)
        Lz = each.dz @ each.dy.T / (each.dy @ each.dy.T)
        closed = each.a - L @ each.cy, each.b - L @ each.dy, each.cz - Lz @ each.cy, each.dz - Lz @ each.dy
        omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 4000)])
        resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(len(each.a)) - closed[0])
        gains = np.linalg.norm(closed[3] + closed[2] @ resolvent @ closed[1], 2, axis=(1, 2))
        assert kalman_level(each) == pytest.approx(gains.max(), rel=1e-5)


# The equation of one model


def model(seed: int, direct: float = 0.0) -> FilterModel:
    rng = np.random.default_rng(seed)
    a, b, cz, cy = (rng.standard_normal(shape) for shape in ((4, 4), (4, 3), (2, 4), (1, 4)))
    return FilterModel(a, b, cz, direct * np.eye(2, 3), cy, np.eye(3)[[2]])


def test_no_filter_has_a_level_below_what_passes_at_once() -> None:
    """D_z w of size 1, which y does not show: below it R has another inertia."""
    plant = model(0, direct=1.0)
    assert hamiltonian(plant, 0.9) is None
    assert hamiltonian(plant, 1.1) is not None
    assert _angle(plant, 0.9) == -1.0
    assert filter_level(plant) >= 1.0
    plain = model(0)  # with eigenvalues on the axis there is no stabilising solution either
    assert _angle(plain, 0.98 * smoother_bound(plain.terms).level) == -1.0
