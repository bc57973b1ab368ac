"""Losses in a row, independent and Markov losses: against enumeration, lifting by hand, textbooks, and drawn runs."""

import re
from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from multirate_examples import CART as DIRECT
from multirate_examples import correlated

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation import multirate
from replication.estimation.linear.norms import l2_gain, white_noise_variance
from replication.estimation.multirate import MultiratePlant, losses
from replication.estimation.multirate.kalman import kalman_design
from replication.estimation.multirate.losses import running, worst
from replication.estimation.multirate.losses.models import Automaton, along, automaton
from replication.estimation.multirate.losses.running import mean_square, mean_square_gains
from replication.estimation.multirate.losses.worst import Walks, central_gains, kernel, least_level, proved_level
from replication.estimation.multirate.problem import MultirateProblem, SensingSchedule, closed_loop
from replication.estimation.validation import Array

EQUAL = 1e-9
CART = replace(DIRECT, D_u=None)
LOST = losses.InARow(1)


@pytest.fixture(scope="module")
def best() -> multirate.MultirateResult:
    return multirate.design(CART, periods=(1, 2))


@pytest.fixture(scope="module")
def guaranteed(best: multirate.MultirateResult) -> losses.LossResult:
    return losses.analyse(best, LOST)


@pytest.fixture(scope="module")
def designed(best: multirate.MultirateResult) -> losses.LossResult:
    return losses.design(best, LOST)


@pytest.mark.parametrize("kind", ["guaranteed", "designed"])
def test_no_pattern_exceeds_the_upper_end(kind: str, request: pytest.FixtureRequest) -> None:
    result = request.getfixturevalue(kind)
    levels = [gain_along(result, word) for word in walks(result.automaton, np.random.default_rng(1), 60)]
    assert max(levels) <= result.bracket.upper * (1 + EQUAL)
    assert result.bracket.width < 1e-3
    assert max(levels) > result.fact("level without losses").value


def walks(given: Automaton, rng: np.random.Generator, count: int) -> list[tuple[int, ...]]:
    """Random periodic patterns that the automaton allows."""
    found: list[tuple[int, ...]] = []
    while len(found) < count:
        word, node = list[int](), 0
        for _ in range(4 * int(rng.integers(1, 5))):
            word.append(int(rng.choice(given.out[node])))
            node = given.edges[word[-1]].target
        if node == 0:
            found.append(tuple(word))
    return found


def gain_along(result: losses.LossResult, word: tuple[int, ...]) -> float:
    return l2_gain(along(result.problem, result.gains["L"], word)).upper


def test_more_losses_are_allowed_by_the_automaton_only() -> None:
    """A single sensor: all patterns of at most two losses in a row, and none with three."""
    single = replace(CART, C=CART.C[[1]], D=[[0.1]])
    problem = multirate.design(single, periods=(1,)).problem
    given = automaton(problem, losses.InARow(2))
    for pattern in product([True, False], repeat=6):
        node: int | None = 0
        for came in pattern:
            node = next((given.edges[i].target for i in given.out[node] if given.edges[i].arrived == (came,)), None)
            if node is None:
                break
        runs = "".join("1" if came else "0" for came in pattern)
        assert (node is None) == ("000" in runs)


def test_no_losses_are_the_design_itself(best: multirate.MultirateResult) -> None:
    result = losses.analyse(best, losses.InARow(0))
    assert result.bracket.lower <= best.value * (1 + EQUAL)
    assert result.bracket.upper == pytest.approx(best.value, rel=1e-4)


def test_gains_that_know_the_losses_guarantee_more(
    guaranteed: losses.LossResult, designed: losses.LossResult, best: multirate.MultirateResult
) -> None:
    assert best.value < designed.value < guaranteed.bracket.lower
    found = designed.fact("level of the design without losses, under them, at least").value
    assert designed.value < found <= guaranteed.value


def test_a_proof_can_fail(guaranteed: losses.LossResult) -> None:
    problem, given = guaranteed.problem, guaranteed.automaton
    whole = Walks(problem, given, guaranteed.value)
    moved = [whole.moved(i, gain) for i, gain in enumerate(guaranteed.gains["L"])]
    storage = least_level(whole, moved)
    level = proved_level(whole, moved, storage.P)
    assert level >= guaranteed.bracket.lower
    assert proved_level(whole, moved, 0.5 * storage.P) == np.inf
    assert proved_level(whole, moved, -storage.P) == np.inf
    assert proved_level(whole, moved, 2 * storage.P) > 1.2 * level
    other = [whole.moved(i, 0.5 * gain) for i, gain in enumerate(guaranteed.gains["L"])]
    assert proved_level(whole, other, storage.P) > level


def test_the_worst_pattern_hurts_as_it_says(designed: losses.LossResult) -> None:
    found: Any = losses.simulate(designed, 120)
    assert 0.97 * designed.bracket.lower < found.ratio <= designed.bracket.lower * (1 + EQUAL)
    assert found.signals["arrived"].shape == (120, 2)
    assert str(designed.model) in str(designed) and designed.plot() is not None


MODELS = {
    "independent": losses.Independent([0.3, 0.2]),
    "packets": losses.Independent(0.3, together=True),
    "bursts": losses.Markov(0.2, [0.6, 0.5]),
}


@pytest.mark.parametrize("name", ["independent", "packets"])
def test_the_mean_square_is_that_of_all_patterns_of_a_period(name: str, best: multirate.MultirateResult) -> None:
    """One linear equation for the covariance at phase 0, over every pattern, without an automaton."""
    result = losses.analyse(best, MODELS[name])
    p = np.array([0.3, 0.2] if name == "independent" else [0.3, 0.3])
    steps = [one_instant(best.gains["L"][k], best.problem.schedule.mask[k], p, name == "packets") for k in range(2)]
    maps = [sum(q * np.kron(A, A) for q, A, _ in step) for step in steps]
    added = [sum(q * (B @ B.T).ravel() for q, _, B in step) for step in steps]
    start = np.linalg.solve(np.eye(4) - maps[1] @ maps[0], maps[1] @ added[0] + added[1])
    after = maps[0] @ start + added[0]
    traces = [np.trace(X.reshape(2, 2)) for X in (start, after)]
    assert result.value == pytest.approx(np.sqrt(np.mean(traces)), rel=EQUAL)


def one_instant(L: Array, due: Array, p: Array, together: bool) -> list[tuple[float, Array, Array]]:
    found = []
    for came in product([0, 1], repeat=2):
        if together and came[0] != came[1]:
            continue
        chance = np.where(came, 1 - p, p)
        q = float(chance[0] if together else np.prod(chance))
        gain = L * np.array(came) * due
        found.append((q, CART.A - gain @ CART.C, np.hstack([CART.B_d, -gain @ CART.D])))
    return found


SCALAR = MultiratePlant(A=[[1.2]], B_d=[[1.0]], C=[[1.0]], D=[[0.5]])


def test_bursts_are_the_two_coupled_equations_of_the_textbook() -> None:
    """One sensor, one state: X of 'came' and of 'lost' by hand."""
    best = multirate.design(SCALAR, periods=(1,), goal="h2")
    a, b, L = 0.1, 0.5, float(best.gains["L"][0, 0, 0])
    pi = np.array([1 - b, a]) / (1 - b + a)
    come, lose = np.array([1 - a, 1 - b]), np.array([a, b])
    closed, open_ = (1.2 - L) ** 2, 1.2**2
    M = np.array([come * closed, lose * open_])
    added = np.array([(come * pi).sum() * (1 + 0.25 * L**2), (lose * pi).sum()])
    X = np.linalg.solve(np.eye(2) - M, added)
    result = losses.analyse(best, losses.Markov(a, b))
    assert result.value == pytest.approx(np.sqrt(X.sum()), rel=EQUAL)
    radius = np.max(np.abs(np.linalg.eigvals(M)))
    assert result.fact("growth of the mean square over a period").value == pytest.approx(radius, rel=EQUAL)


def test_without_losses_correlated_noise_has_the_gains_of_the_kalman_filter() -> None:
    plain = MultirateProblem(CART, SensingSchedule((1, 2)))
    problem = correlated(plain, seed=5)
    given = automaton(problem, losses.Independent(0.0))
    gains, kalman = mean_square_gains(problem, given), kalman_design(problem).gains
    assert np.abs(gains - kalman[[edge.phase for edge in given.edges]]).max() < 1e-8 * np.abs(kalman).max()
    rms = np.sqrt(white_noise_variance(problem.error_system(kalman)))
    assert mean_square(problem, given, gains).rms == pytest.approx(rms, rel=EQUAL)
    # The sign of the correlation counts.
    other = MultirateProblem(replace(problem.plant, B_w=-problem.plant.B_w), problem.schedule)
    assert abs(mean_square(other, given, gains).rms - rms) > 1e-2 * rms


@pytest.mark.parametrize("name", MODELS)
def test_no_small_change_of_the_optimal_gains_helps(name: str, best: multirate.MultirateResult) -> None:
    result, rng = losses.design(best, MODELS[name]), np.random.default_rng(4)
    assert result.value < losses.analyse(best, MODELS[name]).value
    arrived = result.gains["arrived"][:, None, :]
    for _ in range(5):
        change = 1e-2 * rng.standard_normal(result.gains["L"].shape) * arrived
        worse = mean_square(result.problem, result.automaton, result.gains["L"] + change).rms
        assert worse > result.value * (1 + 1e-7)


@pytest.mark.parametrize(
    ("kind", "name"), [(losses.analyse, "independent"), (losses.design, "packets"), (losses.design, "bursts")]
)
def test_drawn_runs_agree_within_their_standard_error(kind: Any, name: str, best: multirate.MultirateResult) -> None:
    result = kind(best, MODELS[name])
    drawn: Any = losses.simulate(result, 200, rng=np.random.default_rng(7), runs=1500)
    assert drawn.exact == pytest.approx(result.value**2, rel=EQUAL)
    assert abs(drawn.mean_square - drawn.exact) < 4 * drawn.standard_error
    assert drawn.standard_error < 0.03 * drawn.exact  # small enough to notice fewer losses
    # The filter that knows the whole pattern is no worse than gains that know a part of it.
    assert drawn.kalman < drawn.exact + 4 * drawn.kalman_standard_error
    assert "±" in str(drawn) and drawn.plot() is not None


def test_the_observer_follows_its_cases(designed: losses.LossResult) -> None:
    observer, rng = designed.observer(), np.random.default_rng(5)
    node, state, missed = 0, np.zeros(2), 0
    for k in range(100):
        number = int(rng.choice(designed.automaton.out[node]))
        edge = designed.automaton.edges[number]
        u, y = rng.standard_normal(1), rng.standard_normal(2)
        A, _ = closed_loop(CART, designed.gains["L"][number])
        state = A @ state + CART.B_u @ u + designed.gains["L"][number] @ y
        due = designed.problem.schedule.mask[k % 2]
        missed += int(np.sum(due) - np.sum(edge.arrived))
        assert np.allclose(observer.step(u, np.where(edge.arrived, y, np.nan)), state, rtol=EQUAL, atol=EQUAL)
        node = edge.target
    assert observer.missed == missed > 10 and observer.unforeseen == 0


def test_given_gains_run_as_the_observer_without_losses(
    guaranteed: losses.LossResult, best: multirate.MultirateResult
) -> None:
    one, other, rng = guaranteed.observer(), best.observer(), np.random.default_rng(6)
    for _ in range(200):
        u, y = rng.standard_normal(1), np.where(rng.random(2) < 0.5, np.nan, rng.standard_normal(2))
        assert np.allclose(one.step(u, y), other.step(u, y), rtol=EQUAL, atol=EQUAL)
    assert one.missed == other.missed and one.unforeseen > 0


def test_latency_and_losses_go_together() -> None:
    late = multirate.design(CART, periods=(1, 2), latency=(0, 1))
    in_time = losses.design(multirate.design(CART, periods=(1, 2)), losses.Independent(0.2))
    result = losses.design(late, losses.Independent(0.2))
    assert result.value > in_time.value
    assert result.observer().step([1.0], [0.2, None]).shape == (2,)


def test_losses_that_hide_a_mode_have_a_message() -> None:
    turning = MultiratePlant(A=[[0, -1.05], [1.05, 0]], B_d=[[1], [0]], C=[[1.0, 0.0]], D=[[0.1]])
    best = multirate.design(turning, periods=(1,))
    for work in (losses.analyse, losses.design):
        with pytest.raises(InvalidInputError, match="not detectable under losses"):
            work(best, losses.InARow(1))
        with pytest.raises(InvalidInputError, match="not detectable under losses"):
            work(best, losses.Independent(1.0))


def test_a_pattern_that_grows_is_named_even_if_no_short_one_does() -> None:
    """Each short pattern settles, and two of them by turns do not; the pattern in the message is multiplied out."""
    cart = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=[[0.5, 0], [0, 0.1]])
    best = multirate.design(cart, periods=(1, 4))
    with pytest.raises(InfeasibleError, match="the error grows by") as told:
        losses.analyse(best, losses.InARow(4))
    came = re.search(r"come as ([01 ]+) \(1: comes\)", str(told.value))
    assert came is not None
    total = np.eye(2)
    for k, samples in enumerate(came[1].split()):
        total = (cart.A - best.gains["L"][k % 4] @ np.diag([float(bit) for bit in samples]) @ cart.C) @ total
    assert max(abs(np.linalg.eigvals(total))) > 1
    assert losses.analyse(best, losses.InARow(3)).value < np.inf


def test_too_many_losses_have_a_message() -> None:
    """The mean square error of a scalar plant is finite iff the probability of a loss is below 1/A^2."""
    best = multirate.design(SCALAR, periods=(1,))
    critical = 1 / 1.2**2
    assert losses.design(best, losses.Independent(0.98 * critical)).value < np.inf
    with pytest.raises(InfeasibleError, match="too many samples are lost"):
        losses.design(best, losses.Independent(1.02 * critical))
    with pytest.raises(InfeasibleError, match="no stationary value"):
        losses.analyse(best, losses.Independent(1.02 * critical))
    weak = replace(best, gains={"L": np.array([[[0.25]]])})
    with pytest.raises(InfeasibleError, match="no level is guaranteed") as told:
        losses.analyse(weak, losses.InARow(1))
    # A sample and a loss by turns: (1.2 - 0.25) 1.2 over two instants.
    growth = re.search(r"grows by ([0-9.]+) an instant", str(told.value))
    assert growth is not None
    assert float(growth[1]) ** 2 == pytest.approx((1.2 - 0.25) * 1.2, rel=1e-5)


BAD: dict[str, Any] = {
    "misses must be a whole number": lambda: losses.InARow(1.5),  # type: ignore[arg-type]
    "misses must be at most": lambda: losses.InARow(1000),
    "probabilities from 0 to 1": lambda: losses.Independent(1.5),
    "probability must be probabilities": lambda: losses.Independent("a"),  # type: ignore[arg-type]
    "after_loss must be below 1": lambda: losses.Markov(0.1, 1.0),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_models_have_messages(message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        BAD[message]()


def test_bad_requests_have_messages(best: multirate.MultirateResult) -> None:
    with pytest.raises(InvalidInputError, match="one for each of 2 sensors"):
        losses.analyse(best, losses.InARow([1, 1, 1]))
    with pytest.raises(InvalidInputError, match="model must be"):
        losses.analyse(best, 0.1)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="more than"):
        losses.analyse(best, losses.InARow(50))
    result = losses.analyse(best, losses.Independent(0.1))
    with pytest.raises(InvalidInputError, match="rng"):
        losses.simulate(result, 10)
    with pytest.raises(InvalidInputError, match="runs must be at least 2"):
        losses.simulate(result, 10, rng=np.random.default_rng(1), runs=1)
    with pytest.raises(InvalidInputError, match="run it by observer"):
        result.to_statespace()


def test_a_plant_of_five_states_is_bracketed() -> None:
    rng = np.random.default_rng(0)
    A = rng.standard_normal((5, 5))
    A *= 0.98 / np.max(np.abs(np.linalg.eigvals(A)))
    drawn = {"B_d": rng.standard_normal((5, 2)), "C": rng.standard_normal((2, 5))}
    best = multirate.design(MultiratePlant(A=A, D=np.diag([0.5, 0.3]), **drawn), periods=(1, 3))
    result = losses.design(best, losses.InARow(1))
    assert best.value < result.bracket.lower <= result.value < 1.01 * result.bracket.lower


@pytest.mark.parametrize("factor", [1.5, 12.0])
def test_central_gains_keep_every_level_above_the_least(factor: float) -> None:
    """With the storage functions that they are made from, and whatever unit the levels are counted in."""
    problem = MultirateProblem(CART, SensingSchedule((1, 2)))
    given = automaton(problem, LOST)
    walks = Walks(problem, given, 1.0)
    opened = [walks.open_loop(i) for i in range(len(given.edges))]
    kernels = [kernel(seen) for _, seen in opened]
    storage = least_level(walks, [moved for moved, _ in opened], kernels)
    squared = factor**2 * storage.delta
    gains = central_gains(walks, storage, squared)
    closed = [walks.moved(i, gain) for i, gain in enumerate(gains)]
    assert proved_level(walks, closed, storage.P) <= np.sqrt(squared) * (1 + EQUAL)


def test_covariances_with_too_many_entries_are_refused(best: multirate.MultirateResult) -> None:
    with patch.object(running, "MOST_UNKNOWNS", 2), pytest.raises(InvalidInputError, match="entries, more than 2;"):
        losses.analyse(best, losses.Independent(0.1))


def test_a_known_input_that_the_sensors_read_at_once_is_no_innovation() -> None:
    """With and without losses: an observer that starts at the state follows it without an error."""
    design_ = multirate.design(DIRECT, periods=(1, 2))
    for observer in (design_.observer(), losses.design(design_, LOST).observer()):
        rng, x = np.random.default_rng(8), np.array([0.4, -0.3])
        observer.reset(x)
        for k in range(12):
            u = rng.normal(size=1)
            y = DIRECT.C @ x + DIRECT.D_u @ u
            observer.step(u, [None if k == 4 else y[0], None if k % 2 else y[1]])
            x = DIRECT.A @ x + DIRECT.B_u @ u
            assert np.abs(observer.estimate - x).max() < EQUAL
            # What is not due is not missed.
            assert observer.missed == (k >= 4)


def test_the_worst_pattern_is_the_one_with_the_largest_gain(guaranteed: losses.LossResult) -> None:
    problem, given, gains = guaranteed.problem, guaranteed.automaton, guaranteed.gains["L"]
    words = given.cycles()[: worst.MEASURED]
    levels = [l2_gain(along(problem, gains, word)).lower for word in words]
    assert min(levels) < max(levels) * (1 - 1e-3)
    assert worst.worst_pattern(problem, given, gains, words) == (max(levels), words[int(np.argmax(levels))])


def test_storage_functions_and_proved_levels_are_told_in_the_units_of_plant_and_level(
    guaranteed: losses.LossResult,
) -> None:
    given, P = guaranteed.automaton, np.stack([np.eye(2)] * len(guaranteed.automaton.phases))
    one, two = (Walks(guaranteed.problem, given, unit) for unit in (1.0, 2.0))
    assert two.storage(P) == pytest.approx(4 * one.storage(P))
    moved = [[whole.moved(i, gain) for i, gain in enumerate(guaranteed.gains["L"])] for whole in (one, two)]
    levels = [proved_level(w, m, least_level(w, m).P) for w, m in zip((one, two), moved, strict=True)]
    assert levels[1] == pytest.approx(levels[0], rel=1e-4)


def test_a_negative_storage_function_of_an_error_that_grows_proves_nothing() -> None:
    """With e^+ = 2 e + v the inequality holds for P = -1: that P is positive must be asked for."""
    edge = SimpleNamespace(source=0, target=0, phase=0)
    walks: Any = SimpleNamespace(
        problem=SimpleNamespace(plant=SimpleNamespace(order=1)),
        automaton=SimpleNamespace(edges=[edge]),
        W=np.array([[[0.1]]]),
        unit=1.0,
    )
    assert proved_level(walks, [np.array([[2.0, 1.0]])], np.array([[[-1.0]]])) == np.inf
    assert proved_level(walks, [np.array([[0.5, 1.0]])], np.array([[[1.0]]])) < np.inf
