"""Replay and fit of logs: known truths, refusals; every form is its running filter; the likelihood by its density."""

import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from benchmarks.recorded_data import LATE, TRUE, stamped
from replication.errors import InvalidInputError, SolverError
from replication.estimation import dualrate, multirate
from replication.estimation.api.running import UnscheduledSampleWarning
from replication.estimation.multirate import ContinuousPlant, MultiratePlant
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.nonuniform.stamped.kalman import Transition
from replication.estimation.recorded import fit, replay
from replication.estimation.recorded.fitting import Likelihood
from replication.estimation.recorded.log import read_log
from replication.estimation.recorded.series import of_plant

CART = NoisyPlant(
    [[0, 1], [0, -1]], [[1, 0], [0, 1]], Q=[[0, 0], [0, 0.5]], R=[0.04, 0.01], B_u=[[0], [1]], sensors=["x", "v"]
)
GIVEN: dict[str, Any] = {"inputs": ("u",)}


def simulated(count: int = 800, seed: int = 1, bias: float = 0.0) -> dict[str, np.ndarray]:
    """A log of CART: every 0.1 s, x at each fourth row; the transition from an Euler chain of its own."""
    rng = np.random.default_rng(seed)
    x, rows, fine = rng.standard_normal(2), [], 50
    for k in range(count):
        u = np.sign(np.sin(0.07 * k))
        noise = rng.standard_normal(2) * np.sqrt(np.diag(CART.R))
        rows.append([0.1 * k, x[0] + noise[0] + bias if k % 4 == 0 else np.nan, x[1] + noise[1], u])
        h = 0.1 / fine
        for w in rng.standard_normal(fine):
            x = x + h * np.array([x[1], u - x[1]]) + np.array([0, np.sqrt(0.5 * h) * w])
    return dict(zip(("t", "x", "v", "u"), np.array(rows).T, strict=True))


def test_the_right_model_is_consistent() -> None:
    log = simulated()
    shown = replay(StampedKalman(CART), log, **GIVEN)
    assert shown.consistent
    assert np.all(shown.white > 0.01)
    assert shown.used.tolist() == [200, 800]
    assert shown.missing.tolist() == [600, 0]
    assert shown.to_csv().count("\n") == 801
    assert len(shown.panels()) == 4


def test_the_plots_show_all_and_have_axes_of_their_own() -> None:
    shown = replay(StampedKalman(CART), simulated(), **GIVEN)
    height, _, innovations, lags = shown.plot().axes
    low, high = innovations.get_ylim()
    assert low < np.nanmin(shown.whitened) and np.nanmax(shown.whitened) < high
    assert lags.get_xlim()[1] < 12 < 80 <= innovations.get_xlim()[1]
    (band,) = height.collections
    lower = band.get_paths()[0].vertices[:, 1].min()
    spread = 1.96 * np.sqrt(shown.covariances[:, 0, 0])
    assert lower == pytest.approx((shown.estimates[:, 0] - spread).min(), rel=1e-3)


def test_a_wrong_model_is_not_consistent() -> None:
    loud = replay(StampedKalman(replace(CART, R=CART.R / 4)), simulated(), **GIVEN)
    assert loud.nis > loud.interval[1]
    assert not loud.consistent
    slow = replay(StampedKalman(replace(CART, Q=CART.Q / 100)), simulated(), **GIVEN)
    assert slow.white.min() < 1e-6


def test_what_the_log_does_not_tell_is_named() -> None:
    twice = NoisyPlant([[-1.0, 0], [0, -1.0]], [[1, 1]], Q=np.eye(2), R=[0.1], sensors=["y"])
    rng, x = np.random.default_rng(2), [0.0]
    for _ in range(199):
        x.append(0.9 * x[-1] + 0.4 * rng.standard_normal())
    log = {"t": np.arange(200) * 0.1, "y": np.array(x) + 0.3 * rng.standard_normal(200)}
    with pytest.raises(InvalidInputError, match=r"Q\[0\]\[0\] and Q\[1\]\[1\] apart"):
        fit(twice, log)


def changed(**columns: Any) -> dict[str, Any]:
    return {name: column for name, column in {**simulated(40), **columns}.items() if column is not None}


BAD = {
    "no column of times": changed(t=None),
    "not sorted": changed(t=np.arange(40)[::-1]),
    "repeated": changed(t=np.r_[0, np.arange(39)]),
    "no sensor or input has the name 'w'": changed(w=np.zeros(40)),
    "no column 'x'": changed(x=None),
    "too few": changed(v=np.r_[1.0, np.full(39, np.nan)]),
    "'u' has an entry": changed(u=np.full(40, np.nan)),
    "one length": changed(v=np.zeros(39)),
    "named columns of numbers": changed(v=["a"] * 40),
}


@pytest.mark.parametrize("message", BAD)
def test_bad_logs_have_their_own_message(message: str) -> None:
    log = {**BAD[message]}
    if message not in ("too few", "no column 'x'"):
        log["x"] = log["v"] if message == "one length" else np.zeros(40)
    with pytest.raises(InvalidInputError, match=message):
        replay(StampedKalman(CART), log, **GIVEN)


def test_units_are_a_suspicion_and_stop_a_fit() -> None:
    log = simulated()
    log["v"] = log["v"] * 1e9
    assert "units" in str(replay(StampedKalman(CART), log, **GIVEN))
    with pytest.raises(InvalidInputError, match="units"):
        fit(CART, log, **GIVEN)


def test_a_csv_file_is_the_same_log(tmp_path: Path) -> None:
    log = simulated(100)
    path = tmp_path / "log.csv"
    rows = [",".join("" if np.isnan(v) else repr(float(v)) for v in row) for row in zip(*log.values(), strict=True)]
    path.write_text("\n".join([",".join(log), *rows]), encoding="utf-8")
    assert replay(StampedKalman(CART), path, **GIVEN).nis == replay(StampedKalman(CART), log, **GIVEN).nis


# Every form along a log, and the likelihood with its derivatives

A, C = [[0.0, 1.0], [-1.0, -0.5]], np.eye(2)
STAMPED = NoisyPlant(A, C, Q=np.diag([0.1, 0.5]), R=[0.04, 0.01], B_u=[[0], [1]], sensors=["x", "v"])
GRID = MultiratePlant(
    A=[[1, 0.1], [-0.1, 0.95]], B_d=[[0.1, 0], [0, 0.2]], C=C, D=np.diag([0.2, 0.1]), B_u=[[0], [0.1]],
    D_u=[[0], [0.3]], dt=0.1,
)  # fmt: skip
HELD = ContinuousPlant(A=A, C=C, dt=0.1, Q=[0.0, 0.7], R=[0.04, 0.01], B_u=[[0], [1]])


def log_of(rows: int, seed: int = 0, jitter: float = 0.0) -> dict[str, np.ndarray]:
    """Noise and gaps: to compare filters no truth is needed."""
    rng = np.random.default_rng(seed)
    y = rng.standard_normal((rows, 2))
    y[rng.random((rows, 2)) < 0.3] = np.nan
    t = 0.1 * np.arange(rows) + jitter * rng.random(rows)
    return {"t": t, "x": y[:, 0], "v": y[:, 1], "u": rng.standard_normal(rows)}


def dense(log: Any, plant: NoisyPlant, bias: float, late: float) -> float:
    """-ln of the joint density of all numbers, from the covariance of states at the times of all samples."""
    entries = [(t - (late if j == 0 else 0.0), j, row[j]) for t, row in zip(log.t, log.y, strict=True) for j in (0, 1)]
    entries = sorted((one for one in entries if not np.isnan(one[2])), key=lambda one: one[0])
    times = np.unique([*log.t, *(one[0] for one in entries)])
    move = Transition.of(plant.A, plant.B_u, plant.Q)
    mean, spread = [np.zeros(2)], [plant.P0]
    steps = []
    for before, after in pairwise(times):
        Phi, Gamma, Q = move.at(after - before)
        held = log.u[max(np.searchsorted(log.t, before, side="right") - 1, 0)]
        steps.append(Phi)
        mean.append(Phi @ mean[-1] + Gamma @ held)
        spread.append(Phi @ spread[-1] @ Phi.T + Q)
    at = [int(np.searchsorted(times, one[0])) for one in entries]
    V = np.zeros((len(entries), len(entries)))
    for a, (i, (_, row, _)) in enumerate(zip(at, entries, strict=True)):
        whole = spread[i]
        place = i
        for b in range(a, len(entries)):
            for step in steps[place : at[b]]:
                whole = step @ whole
            place = at[b]
            V[a, b] = V[b, a] = plant.C[entries[b][1]] @ whole @ plant.C[row]
    V += np.diag([plant.R[one[1], one[1]] for one in entries])
    expected = [plant.C[one[1]] @ mean[i] + (bias if one[1] == 0 else 0.0) for i, one in zip(at, entries, strict=True)]
    return -float(stats.multivariate_normal(expected, V).logpdf([one[2] for one in entries]))


def designed(plant: Any, latency: tuple[float, ...] = (), offsets: tuple[int, ...] = ()) -> Any:
    return multirate.design(plant, periods=(3, 1), goal="h2", latency=latency, offsets=offsets)


def likelihood(plant: Any, rows: int, *, late: bool = False) -> Likelihood:
    """With all variances, a bias and perhaps a latency free, at the plant's own noise."""
    form, data = of_plant(plant), read_log(log_of(rows), ("x", "v"), ("u",), least=1)
    guess = np.concatenate([np.log(form.v), np.log(np.diag(form.R)), [0.3], [0.037] if late else []])
    tardy = (0,) if late else ()
    return Likelihood(form, data, guess, np.ones(len(guess), bool), (0,), tardy, None)


def test_the_likelihood_is_that_of_the_joint_density() -> None:
    for late in (False, True):
        cost = likelihood(STAMPED, 25, late=late)
        expected = dense(cost.log, STAMPED, 0.3, 0.037 if late else 0.0)
        assert cost(cost.guess)[0] == pytest.approx(expected, rel=1e-10)
        assert cost(cost.guess + 0.01)[0] != pytest.approx(expected, rel=1e-6)


CASES = {
    "time stamps": lambda: likelihood(STAMPED, 60),
    "late": lambda: likelihood(STAMPED, 60, late=True),
    "multi-rate": lambda: likelihood(designed(GRID), 60),
    "multi-rate, late": lambda: likelihood(designed(GRID, (3, 0)), 60),
    "continuous, late": lambda: likelihood(designed(HELD, (1.4, 0)), 60),
    "one factor": lambda: likelihood(replace(STAMPED, Q=[[0.2, 0.1], [0.1, 0.3]]), 60),
}


@pytest.mark.parametrize("name", CASES)
def test_the_gradient_is_that_of_the_likelihood(name: str) -> None:
    cost = CASES[name]()
    gradient = cost(cost.guess)[1]
    for i, direction in enumerate(np.eye(len(cost.guess)) * 1e-5):
        slope = (cost(cost.guess + direction)[0] - cost(cost.guess - direction)[0]) / 2e-5
        assert gradient[i] == pytest.approx(slope, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("gate", [None, 2.0])
def test_replay_with_time_stamps_is_the_running_filter(gate: float | None) -> None:
    log, observer = log_of(80, jitter=0.05), StampedKalman(STAMPED, gate=gate)
    shown = replay(observer, log, inputs=("u",))
    for i in range(80):
        estimate = observer.step(sample(log, i), t=log["t"][i], u=[log["u"][i]])
        np.testing.assert_allclose(shown.estimates[i], estimate, rtol=0, atol=1e-12)
        np.testing.assert_allclose(shown.covariances[i], observer.covariance, rtol=0, atol=1e-12)
    assert shown.gated == observer.gated
    assert (shown.gated > 0) == (gate is not None)


def sample(log: dict[str, np.ndarray], i: int) -> dict[str, float]:
    return {name: log[name][i] for name in ("x", "v") if not np.isnan(log[name][i])}


@pytest.mark.parametrize(("start", "latency"), [(None, ()), (np.eye(2), ()), (None, (2, 0))])
def test_replay_of_a_multirate_filter_is_the_running_one(start: Any, latency: tuple[int, ...]) -> None:
    best = multirate.design(GRID, periods=(3, 1), offsets=(2, 0), goal="h2", latency=latency, P0=start)
    log = log_of(90)
    observer, named = best.filter(), {"t": log["t"], "y[0]": log["x"], "y[1]": log["v"], "u[0]": log["u"]}
    shown = replay(observer, named)
    for i in range(90):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnscheduledSampleWarning)
            step = observer.step([log["u"][i]], [log["x"][i], log["v"][i]])
        np.testing.assert_allclose(shown.estimates[i], step.filtered[:2], rtol=0, atol=1e-12)
    assert (shown.unscheduled, int(shown.missing.sum())) == (observer.unscheduled, observer.missed)
    assert shown.unscheduled > 0 and shown.missing.sum() > 0


def test_replay_of_a_dual_rate_controller_is_the_running_one() -> None:
    plant = dualrate.make_plant(A, [[0], [1]], [[1, 0]])
    weights = {
        "state_weight": np.eye(2),
        "input_weight": [[1]],
        "process_noise": 0.2 * np.eye(2),
        "sensor_noise": [[0.1]],
    }
    best = dualrate.design(plant, period=0.1, ratio=4, at="slow", **weights)
    running, rows, log = best.running(), [], log_of(100)
    for k in range(100):
        due = k % 4 == 0 and k != 8
        rows.append([0.1 * k, log["u"][k] if due else np.nan, running.command[0], *running.estimate[:2]])
        running.step(None, [rows[-1][1]])
    t, y, u, *estimates = np.array(rows).T
    table = {"t": t, "y[0]": y, "u[0]": u}
    shown = replay(best.running(), table, inputs=("u[0]",))
    Phi, Gamma, _ = Transition.of(plant.A, plant.B_u, np.zeros((2, 2))).at(0.1)
    predicted = shown.estimates[:-1] @ Phi.T + u[:-1, None] * Gamma.T
    np.testing.assert_allclose(predicted, np.array(estimates).T[1:], rtol=0, atol=1e-11)
    assert shown.missing.tolist() == [1]
    told = fit(best, table, inputs=("u[0]",), fixed=("Q[0][0]", "Q[1][1]"))
    assert isinstance(told.plant, NoisyPlant) and told.names == ("R[y[0]]",)
    with pytest.raises(InvalidInputError, match=r"likeliest with Q\[0\]\[0\] near zero"):
        fit(best, table, inputs=("u[0]",))
    other = dualrate.design(plant, period=0.1, ratio=4, at="slow", goal="hinf", **weights)
    with pytest.raises(InvalidInputError, match="only innovations of a Kalman filter"):
        replay(other.running(), table, inputs=("u[0]",))


def driven(plant: MultiratePlant, rows: int, late: int, seed: int) -> dict[str, np.ndarray]:
    rng, x, y, inputs = np.random.default_rng(seed), np.zeros(2), [], np.sign(np.sin(0.05 * np.arange(rows)))
    for u in inputs:
        y.append(plant.C @ x + plant.D_u @ [u] + plant.D @ rng.standard_normal(2))
        x = plant.A @ x + plant.B_u @ [u] + plant.B_d @ rng.standard_normal(plant.B_d.shape[1])
    slow = np.full(rows, np.nan)
    slow[late::3] = np.array(y)[: rows - late : 3, 0]
    return {"t": plant.dt * np.arange(rows), "y[0]": slow, "y[1]": np.array(y)[:, 1], "u[0]": inputs}


@pytest.mark.parametrize("late", [0, 2])
def test_fit_of_a_multirate_design_recovers_the_truth_and_designs_again(late: int) -> None:
    guess, log = replace(GRID, B_d=GRID.B_d * [3, 0.3], D=GRID.D * 2), driven(GRID, 2500, late, 3)
    best = fit(designed(guess, (late, 0)), log)
    truth = np.array([1 / 9, 1 / 0.09, 0.04, 0.01])
    assert np.all(np.abs(np.log(best.values / truth)) < 3 * best.errors)
    assert best.names == ("variance of d[0]", "variance of d[1]", "R[y[0]]", "R[y[1]]")
    np.testing.assert_allclose(best.plant.B_d[:2], guess.B_d * np.sqrt(best.values[:2]))
    np.testing.assert_allclose(best.plant.D @ best.plant.D.T, np.diag(best.values[2:]))
    assert best.replay.estimates.shape == (2500, 2)
    again = designed(best.plant, offsets=(late, 0))
    assert replay(again.filter(), log).nis == pytest.approx(best.replay.nis, abs=0.01)
    if late:
        with pytest.raises(InvalidInputError, match=r"0 of 833 samples of 'y\[0\]' are used.*offset"):
            replay(designed(best.plant).filter(), log)
        assert fit(designed(guess), log).log_likelihood < best.log_likelihood - 10


def test_a_latency_is_found_and_can_be_held() -> None:
    given: dict[str, Any] = {"latencies": {"x": 0.02}, "biases": ("x",)}
    log = stamped(8, LATE)
    best = fit(TRUE, log, **given)
    assert best.names[-1] == "latency[x]"
    assert abs(best.values[-1] - LATE) < 3 * best.errors[-1] < 0.2
    held = fit(TRUE, log, **given, fixed=("latency[x]", "R[v]"))
    assert held.names == ("Q[1][1]", "R[x]", "bias[x]")
    assert held.plant.R[1, 1] == pytest.approx(TRUE.R[1, 1], rel=1e-14)
    assert held.log_likelihood < best.log_likelihood - 5


def table(**columns: Any) -> dict[str, Any]:
    return {**log_of(60), **columns}


def on_grid(times: Any) -> dict[str, Any]:
    return {"t": times, **{new: log_of(60)[old] for new, old in (("y[0]", "x"), ("y[1]", "v"), ("u[0]", "u"))}}


MULTI = designed(GRID)
MISFITS: dict[str, tuple[Any, dict[str, Any], dict[str, Any]]] = {
    "lies 0.37 base periods": (MULTI, on_grid(np.r_[0, 0.137, 0.1 * np.arange(2, 60)]), {}),
    "lie in one base period": (MULTI, on_grid(np.r_[0, 0.002, 0.1 * np.arange(2, 60)]), {}),
    "check dt and the unit of time": (MULTI, on_grid(100.0 * np.arange(60)), {}),
    "latencies belong to filters with time stamps": (
        MULTI, on_grid(0.1 * np.arange(60)), {"latencies": {"y[0]": 0.1}},
    ),
    "B_w makes noise": (designed(replace(GRID, B_w=[[0.1, 0], [0, 0]])), table(), {}),
    "fixed names no parameter 'R": (STAMPED, table(), {"fixed": ("R[z]",), **GIVEN}),
    "latencies must be finite numbers": (STAMPED, table(), {"latencies": {"z": 0.1}, **GIVEN}),
    "latencies must name sensors": (STAMPED, table(), {"latencies": {"x": "late"}, **GIVEN}),
    "biases must be different names": (STAMPED, table(), {"biases": ("x", "x"), **GIVEN}),
    "there are 1 known inputs": (STAMPED, table(), {}),
    "diagonal R": (replace(STAMPED, R=[[0.04, 0.01], [0.01, 0.01]]), table(), GIVEN),
    "process noise is zero": (replace(STAMPED, Q=np.zeros((2, 2))), table(), GIVEN),
    "start must have shape": (STAMPED, table(), {"start": [1.0], **GIVEN}),
    "plant must be a NoisyPlant": ("plant", table(), {}),
}  # fmt: skip


@pytest.mark.parametrize("message", MISFITS)
def test_what_does_not_fit_has_its_own_message(message: str) -> None:
    plant, log, given = MISFITS[message]
    with pytest.raises(InvalidInputError, match=message):
        fit(plant, log, **given)


def test_rounding_has_its_own_message() -> None:
    twice = NoisyPlant([[0.0]], [[1], [1]], Q=[[1.0]], R=[1e-18, 1e-18], P0=[[1e9]], sensors=["x", "v"])
    log = {name: column for name, column in log_of(60).items() if name != "u"}
    with pytest.raises(SolverError, match="lost in rounding"):
        replay(StampedKalman(twice), log)
