"""Between the least mean and the least worst case at the slow rate: both ends, the way between, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation import dualrate
from replication.estimation.dualrate.slow.controller import MARGIN
from replication.estimation.dualrate.slow.result import SlowRateResult

SERVO = dualrate.make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
GIVEN = {"period": 0.05, "ratio": 10, "at": "slow", "sensor_noise": [[1e-3]]}


def design(**given: object) -> SlowRateResult:
    result = dualrate.design(SERVO, **{**GIVEN, **given})  # type: ignore[arg-type]
    assert isinstance(result, SlowRateResult)
    return result


def rms(result: SlowRateResult) -> float:
    return float(result.fact("root mean square").value)


def test_the_curve_joins_both_goals_and_keeps_every_level() -> None:
    mean, worst = design(), design(goal="hinf")
    curve = worst.tradeoff(7)
    assert (curve.gain[0], curve.rms[0]) == pytest.approx((worst.value, rms(worst)), rel=1e-5)
    assert (curve.gain[-1], curve.rms[-1]) == pytest.approx((mean.value, rms(mean)), rel=1e-9)
    assert curve.level[0] == pytest.approx((1 + MARGIN) * float(worst.fact("optimum").value), rel=1e-5)
    assert np.all(np.diff(curve.gain) > 0) and np.all(np.diff(curve.rms) < 0)
    assert np.all(curve.gain <= curve.level * (1 + 1e-9))
    again = design(goal="mixed", level=float(curve.level[3]))
    assert (again.value, rms(again)) == pytest.approx((curve.gain[3], curve.rms[3]), rel=1e-9)
    np.testing.assert_allclose(mean.tradeoff(3).gain[-1], curve.gain[-1], rtol=1e-12)
    (panel,) = curve.panels()
    assert panel.y_label.startswith("rms of (x, u)") and "designed for level infinite" in str(curve)
    assert curve.to_dict()["method"] == "dualrate"


def test_mixed_loses_the_same_share_of_both() -> None:
    mean, both, worst = design(), design(goal="mixed"), design(goal="hinf")
    least = float(worst.fact("optimum").value)
    assert both.value / least == pytest.approx(rms(both) / rms(mean), rel=1e-5)
    assert worst.value < both.value < mean.value
    assert rms(mean) < rms(both) < rms(worst)
    # A level that is not that of the balance would show: the shares part on either side.
    off = design(goal="mixed", level=1.05 * float(both.fact("level of the design").value))
    assert off.value / least - rms(off) / rms(mean) > 1e-3


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InvalidInputError, match='belongs to goal="hinf" or "mixed"'):
        design(level=1.0)
    with pytest.raises(InfeasibleError, match="no controller at these rates keeps the level"):
        design(goal="mixed", level=1e-3)
    with pytest.raises(InvalidInputError, match="points must be at least 2"):
        design().tradeoff(1)
    with pytest.raises(InvalidInputError, match="belong to designs at the slow rate"):
        dualrate.design(SERVO, period=0.05, ratio=10, goal="mixed")
