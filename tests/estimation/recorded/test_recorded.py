"""Replay and fit on simulated logs of known truth, and logs that are refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.nonuniform import NoisyPlant, StampedKalman
from replication.estimation.recorded import fit, replay

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
