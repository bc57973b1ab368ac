"""Designs of delay plants for white noise: mean squares with closed forms, the least of any observer, trade-offs."""

import cmath
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import scipy.linalg

from benchmarks.delay_plants import random_plant
from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.delay import DelayObserver, DelayPlant, DelayResult, design, limit
from replication.estimation.delay.exact.central import FilterModel, central
from replication.estimation.delay.exact.limit import filter_level
from replication.estimation.delay.exact.smoothing import error_covariance, integrated
from replication.estimation.delay.exact.terms import Terms, plant_terms
from replication.estimation.validation import Array
from replication.ownplant.files import read_plant
from replication.ownplant.methods import METHODS
from tests.estimation.delay.plants import delayed_output, late, two_late

EXACT = 1e-7
"""Of mean squares by their spectrum."""


def rms(result: DelayResult) -> float:
    return float(result.fact("rms error of z").value)


def mean_square(observer: DelayObserver) -> float:
    return float(np.trace(error_covariance(plant_terms(observer.plant), observer.terms)[0]))


def predicted(rate: float, noise: float, delay: float) -> float:
    """Of `late`: the Kalman filter of x(t - delay), whose estimate the plant carries on."""
    settled = noise**2 * (rate + np.sqrt(rate**2 + 1 / noise**2))
    growth = float(np.exp(2 * rate * delay))
    return growth * settled + (np.expm1(2 * rate * delay) / (2 * rate) if rate else delay)


@pytest.mark.parametrize("rate", [-1.0, 0.0, 0.4])
@pytest.mark.parametrize(("noise", "delay"), [(0.1, 2.5), (2.0, 0.2)])
def test_a_late_measurement_costs_the_prediction(rate: float, noise: float, delay: float) -> None:
    result = design(late(rate, noise, delay), goal="h2")
    assert rms(result) ** 2 == pytest.approx(predicted(rate, noise, delay), rel=EXACT)
    assert result.covariance is not None
    assert np.sqrt(np.trace(result.covariance)) == rms(result)
    assert result.fact("least rms error of any observer").value == pytest.approx(rms(result), rel=EXACT)
    wrong = replace(result.gains_of, l0=result.gains_of.l0 + 0.1 / delay)
    assert mean_square(wrong) > rms(result) ** 2 * (1 + 1e-6)


@pytest.mark.parametrize(("a", "b", "delay"), [(1.0, 0.8, 0.7), (0.2, 1.1, 0.9), (1.0, -0.9, 3.0), (0.0, 1.0, 1.5)])
def test_the_variance_of_a_scalar_delay_equation(a: float, b: float, delay: float) -> None:
    """x' = -a x - b x(t - delay) + w: its covariance function solves U' = -a U - b U(delay - s), U'(0) = -1/2."""
    root = cmath.sqrt(a * a - b * b)
    known = (1 + b * cmath.sinh(root * delay) / root) / (2 * (a + b * cmath.cosh(root * delay)))
    plant = plant_terms(DelayPlant([[-a]], [delay], [[1, 0]], [[1]], [[1]], a=[[[-b]]], d21=[[0, 1]]))
    found, _ = error_covariance(plant, Terms(np.zeros((3, 1))))
    assert found[0, 0] == pytest.approx(known.real, rel=EXACT)


@pytest.mark.parametrize("lag", [0.3, 2.0])
def test_a_delayed_state_is_smoothed_with_a_fixed_lag(lag: float) -> None:
    """z = x(t - lag) of an integrator that is measured at once: 1/2 + e^(-2 lag)/2."""
    plant = DelayPlant([[0]], [lag], [[1, 0]], [[0]], [[1]], c1=[[[1]]], d21=[[0, 1]])
    result = design(plant, goal="h2")
    assert rms(result) ** 2 == pytest.approx((1 + np.exp(-2 * lag)) / 2, rel=EXACT)
    assert result.fact("rms error, limit of any smoother").value ** 2 == pytest.approx(1 / 2, rel=EXACT)


@pytest.mark.parametrize("seed", [6, 11, 12, 14])
def test_random_plants_reach_the_least_mean_square(seed: int) -> None:
    plant = random_plant(np.random.default_rng(seed))
    plant = replace(plant, d11=np.zeros_like(plant.d11))
    result = design(plant, goal="h2")
    least, smoother = (
        float(result.fact(name).value)
        for name in ("least rms error of any observer", "rms error, limit of any smoother")
    )
    assert smoother <= least * (1 + EXACT)
    assert -EXACT <= rms(result) / least - 1 <= 5e-3
    assert rms(result) <= np.sqrt(mean_square(design(plant).gains_of)) * (1 + EXACT)
    assert limit(plant).level <= result.value * (1 + EXACT)


@pytest.mark.parametrize("plant", [delayed_output, two_late])
def test_the_spectrum_agrees_with_a_model_that_knows_many_moments(plant) -> None:  # type: ignore[no-untyped-def]
    result = design(plant(), goal="h2", degree=6)
    A, B, C, _ = result.gains_of.error_model(60)
    P = scipy.linalg.solve_continuous_lyapunov(A, -B @ B.T)
    assert np.trace(C @ P @ C.T) == pytest.approx(rms(result) ** 2, rel=1e-4)


def test_between_both_goals() -> None:
    plant = late(0.0, 1.0, 1.0)
    kalman, least = design(plant, goal="h2"), limit(plant).level
    curve = kalman.tradeoff(6)
    assert np.all(np.diff(curve.rms) < 0)
    assert np.all(np.diff(curve.gain) > 0)
    assert np.all(curve.gain <= curve.level * (1 + EXACT))
    assert (curve.gain[-1], curve.rms[-1]) == pytest.approx((kalman.value, rms(kalman)), rel=EXACT)
    assert least < curve.gain[0] < 1.02 * least
    middle = design(plant, goal="mixed")
    assert rms(middle) / rms(kalman) == pytest.approx(1.15, rel=1e-3) and middle.value / least > 1.15
    near = late(-0.5, 1.0, 0.3)
    share = design(near, goal="mixed").value / limit(near).level
    assert rms(design(near, goal="mixed")) / rms(design(near, goal="h2")) == pytest.approx(share, rel=1e-3)
    asked = design(plant, goal="mixed", level=1.2 * least)
    assert asked.value <= 1.2 * least
    assert rms(kalman) < rms(asked) < curve.rms[0]
    with pytest.raises(InfeasibleError, match="the least is"):
        design(plant, goal="mixed", level=0.99 * least)
    lost = np.linalg.LinAlgError("failed to find a finite solution")
    with (
        patch("replication.estimation.delay.general.synthesis.central", side_effect=lost),
        pytest.raises(SolverError, match=r"12 moments.*finite solution.*raise the level"),
    ):
        design(plant, goal="mixed", level=1.2 * least)


@pytest.mark.parametrize("noise", [0.3, 3.0])
def test_a_mixed_design_is_no_worse_than_the_worse_of_the_others(noise: float) -> None:
    """With poor sensors little is to be won in the mean, and at most half of that is given away."""
    plant = late(-0.5, 1.0, noise)
    pure, middle = [design(plant, goal=goal) for goal in ("hinf", "h2")], design(plant, goal="mixed")
    assert middle.value <= max(result.value for result in pure)
    assert rms(middle) <= max(map(rms, pure))
    least, alone = rms(pure[1]), float(middle.fact("rms error without sensors").value)
    assert rms(middle) <= (least + alone) / 2 * (1 + 1e-3)
    assert rms(middle) <= 1.15 * least * (1 + 1e-3)


def echoing(size: float) -> DelayPlant:
    """The noise that y shows drives the state again 0.7 s later."""
    return DelayPlant([[-1]], [0.7], [[0, 0]], [[1]], [[1]], b_delayed=[[[size, 0]]], d21=[[0.4, 1]])


def test_noise_that_acts_again_later() -> None:
    result = design(echoing(1.0), goal="h2")
    least = float(result.fact("least rms error of any observer").value)
    assert 1e-3 < rms(result) / least - 1 < 2e-2
    assert "jump" in result.fact("above the least").method
    with pytest.raises(KeyError):
        design(echoing(0.0), goal="h2").fact("above the least")
    for refused in (result.tradeoff, lambda: design(echoing(1.0), goal="mixed", level=1.0)):
        with pytest.raises(InvalidInputError, match="acts again later"):
            refused()
    found = random_plant(np.random.default_rng(105))
    twice = replace(found, d11=np.zeros_like(found.d11))
    with pytest.raises(SolverError, match=r"do not stabilise the error \(a disturbance"):
        design(twice, goal="h2")


def test_gains_that_do_not_keep_the_level_are_not_given() -> None:
    plant = late(0.0, 1.0, 1.0)
    kalman = design(plant, goal="h2")
    with (
        patch("replication.estimation.delay.general.synthesis.Designs.at", return_value=kalman.gains_of),
        pytest.raises(SolverError, match="have the gain"),
    ):
        design(plant, goal="mixed", level=0.9 * kalman.value)


def test_intensities_stand_for_factors() -> None:
    Q, R, S = [[4.0, 1.0], [1.0, 2.0]], [[0.5]], [[0.3], [-0.4]]
    given = {"a0": [[-1, 0.2], [0, -0.5]], "delays": [0.6], "c10": [[1, 0]], "c2": [[1, 1]]}
    plant = DelayPlant.from_covariances(Q=Q, R=R, S=S, a=[[[-0.3, 0], [0.4, 0]]], **given)
    assert plant.b @ plant.b.T == pytest.approx(np.array(Q))
    assert plant.b @ plant.d21.T == pytest.approx(np.array(S))
    assert plant.d21 @ plant.d21.T == pytest.approx(np.array(R))
    factor = np.linalg.cholesky(np.block([[np.array(Q), np.array(S)], [np.array(S).T, np.array(R)]]))
    other = DelayPlant(b=factor[:2], d21=factor[2:], a=[[[-0.3, 0], [0.4, 0]]], **given)
    assert rms(design(plant, goal="h2")) == pytest.approx(rms(design(other, goal="h2")), rel=EXACT)
    late_drive = DelayPlant.from_covariances(Q=[[4]], R=R, b=[[0], [0]], b_delayed=[[[1], [2]]], **given)
    assert late_drive.b_delayed[0] @ late_drive.b_delayed[0].T == pytest.approx(np.array([[4, 8], [8, 16]]))
    for wrong, says in (
        ({"Q": [[-1, 0], [0, 1]]}, "must not be negative"),
        ({"R": [[0.0]]}, "positive definite"),
        ({"S": [[9.0], [0.0]]}, "S does not fit"),
        ({"d21": [[1.0]]}, "d21 does not go with Q and R"),
        ({"c2": None}, "c2 is missing"),
    ):
        with pytest.raises(InvalidInputError, match=says):
            DelayPlant.from_covariances(**{"Q": Q, "R": R, "S": S, **given, **wrong})


def test_the_estimate_zero_and_errors_that_grow() -> None:
    stable = design(late(-1.0, 1.0, 0.5), goal="h2")
    assert stable.fact("rms error without sensors").value == pytest.approx(np.sqrt(1 / 2), rel=EXACT)
    assert design(late(0.3, 1.0, 0.5), goal="h2").fact("rms error without sensors").value == "infinite"
    with pytest.raises(InfeasibleError, match="mean square is infinite"):
        mean_square(replace(stable.gains_of, l0=stable.gains_of.l0 - 40.0))


def test_integrals_of_sharp_and_oscillating_spectra() -> None:
    """1/(1 + w^2) has the integral 1/2, times cos(5 w) e^-5/2; a resonance of damping z has 1/(4 z)."""

    def first(omega: Array) -> Array:
        return np.asarray((1 + np.cos(5.0 * omega)) / (1 + omega**2))[:, None, None]

    assert integrated(first, 1.0, [5.0])[0, 0] == pytest.approx((1 + np.exp(-5.0)) / 2, rel=EXACT)

    def sharp(omega: Array) -> Array:
        return np.asarray(1 / ((1 - omega**2) ** 2 + (2e-5 * omega) ** 2))[:, None, None]

    assert integrated(sharp, 2.0, [])[0, 0] == pytest.approx(1 / 4e-5, rel=EXACT)
    with pytest.raises(SolverError, match="stays open"):
        integrated(lambda omega: np.cos(1e6 * omega)[:, None, None], 1.0, [])


def random_model(seed: int) -> FilterModel:
    rng = np.random.default_rng(seed)
    a, b, cz, cy = (rng.standard_normal(shape) for shape in ((4, 4), (4, 3), (2, 4), (1, 4)))
    return FilterModel(a, b, cz, np.zeros((2, 3)), cy, rng.standard_normal((1, 3)))


@pytest.mark.parametrize("seed", range(4))
def test_central_gains_exist_from_the_least_level_on(seed: int) -> None:
    model = random_model(seed)
    least = filter_level(model)
    with pytest.raises((InfeasibleError, np.linalg.LinAlgError)):
        central(model, 0.98 * least)
    R, entropies = model.dy @ model.dy.T, []
    for level in (1.02 * least, 3 * least, np.inf):
        L, P = central(model, level)
        rest = model.a @ P + P @ model.a.T + model.b @ model.b.T + P @ model.cz.T @ model.cz @ P / level**2
        assert rest == pytest.approx(L @ R @ L.T, abs=1e-8 * np.abs(rest).max())
        assert np.linalg.eigvals(model.a - L @ model.cy).real.max() < 0
        entropies.append(np.trace(model.cz @ P @ model.cz.T))
    assert entropies == sorted(entropies, reverse=True)


def test_plant_files_have_a_goal_and_intensities(tmp_path: Path) -> None:
    text = "A0 = [[0.0]]\nA = [[[0.0]]]\ndelays = [1.0]\nB = [[1.0]]\n"
    text += "C10 = [[1.0]]\nC2 = [[0.0]]\nC2_delayed = [[[1.0]]]\n"
    file = tmp_path / "cart.toml"
    file.write_text(text + 'Q = [[1.0]]\nR = [[1.0]]\ngoal = "h2"\n')
    values = read_plant(file, "delay").values
    assert rms(METHODS["delay"].design(values)) ** 2 == pytest.approx(2.0, rel=EXACT)
    assert METHODS["delay"].design(values, goal="hinf").covariance is None
    file.write_text(text + "R = [[1.0]]\n")
    with pytest.raises(InvalidInputError, match="Q is missing"):
        METHODS["delay"].design(read_plant(file, "delay").values)
