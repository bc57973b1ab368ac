"""The file of an observer that switches with losses, takes time stamps, or sets the inputs at the slow rate."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from replication.estimation import dualrate, load
from replication.estimation.api.results import Bracket
from replication.estimation.multirate import losses
from tests.estimation.api.api_plants import SERVO, result_of
from tests.estimation.nonuniform.test_stamped_c import observer_of

FEW = 40


def again(observer: Any, folder: Path) -> Any:
    (folder / "observer.json").write_text(observer.to_json(), encoding="utf-8")
    return load(folder / "observer.json")


def test_an_observer_that_switches_with_losses(tmp_path: Path) -> None:
    result = losses.design(result_of("multirate"), losses.InARow(1))
    observer, rng = result.observer(), np.random.default_rng(2)
    loaded = again(observer, tmp_path)
    for k in range(FEW):
        u, y = rng.standard_normal(), rng.standard_normal(2)
        camera = None if k % 8 == 2 else y[1]
        named = {"force": u, "encoder": y[0], "camera": camera}
        assert np.array_equal(observer.step(u, [y[0], camera]), loaded.step(named))
    assert observer.missed == loaded.missed > 0


def test_a_filter_with_time_stamps(tmp_path: Path) -> None:
    observer, rng = observer_of("filter"), np.random.default_rng(2)
    loaded = again(observer, tmp_path)
    for t in np.cumsum(rng.uniform(0.02, 0.4, FEW)):
        y = rng.standard_normal(2)
        one, other = (run.step(y, t=t, u=[0.5]) for run in (observer, loaded))
        assert np.array_equal(one, other)


def test_a_controller_at_the_slow_rate(tmp_path: Path) -> None:
    result = dualrate.design(SERVO, period=0.02, ratio=10, at="slow")
    controller, rng = result.running(), np.random.default_rng(2)
    loaded = again(controller, tmp_path)
    for _ in range(FEW):
        y = rng.standard_normal()
        assert np.array_equal(controller.step(None, [y]), loaded.step({"camera": y}))
        assert np.array_equal(controller.command, loaded.command)
    assert result.estimator().noutputs == len(controller.phases) * 2


def test_the_width_of_a_bracket_is_a_share_of_its_upper_end() -> None:
    assert Bracket(1.0, 4.0, "m").width == 0.75
    assert Bracket(0.0, 0.0, "m").width == 0.0
