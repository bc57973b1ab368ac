"""Plants in awkward units of time and of the states: the same levels, and gains in the units of the plant."""

from __future__ import annotations

import numpy as np
import pytest

from replication.errors import InvalidInputError
from replication.estimation.delay import DegreeRule, DelayPlant, delay_system, minimum_gain
from replication.estimation.delay.observer import error_system, hinf_norm
from replication.estimation.delay.operators import observer_gains
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.spectrum import rightmost_roots
from replication.estimation.delay.system import STEP, natural_units, reach, time_scaled, transformed
from tests.estimation.delay.plants import one_delay, three_delays, two_delays, unstable_pair

SAME = 1e-6
SIZES = np.diag([3e5, 2e-4])


@pytest.mark.parametrize("system", [one_delay(), two_delays(), three_delays(), unstable_pair()])
def test_moderate_plants_keep_their_units(system: DelayPlant) -> None:
    units = natural_units(system)
    assert units.system is system and units.time == 1.0 and np.array_equal(units.change, np.eye(2))


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_are_found_again(factor: float) -> None:
    awkward = transformed(time_scaled(two_delays(), factor), SIZES)
    units = natural_units(awkward)
    assert 1 / STEP < reach(units.system) < STEP and 1 / STEP < units.time * factor < STEP
    assert np.all(np.abs(np.log(np.diag(units.change @ SIZES) / units.change[0, 0] / SIZES[0, 0])) < np.log(STEP))
    back = transformed(time_scaled(units.system, 1 / units.time), np.linalg.inv(units.change))
    assert np.allclose(back.a0, awkward.a0, rtol=1e-14) and back.delays == pytest.approx(awkward.delays)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_level_and_observer_do_not_depend_on_the_units(factor: float) -> None:
    awkward = transformed(time_scaled(one_delay(), factor), SIZES)
    least = minimum_gain(one_delay(), 2, DegreeRule.BESSEL).gamma
    assert minimum_gain(awkward, 2, DegreeRule.BESSEL).gamma == pytest.approx(least, rel=SAME)
    gains = observer_gains(certificate_at(awkward, 1.1 * least, 2, DegreeRule.BESSEL))
    error = error_system(awkward, gains, 20)
    assert hinf_norm(error).upper <= 1.1 * least
    root = rightmost_roots(one_delay(), 1)[0]
    assert rightmost_roots(awkward, 1)[0] == pytest.approx(root * factor, rel=SAME)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_what_y_does_not_see_is_found_in_any_unit(factor: float) -> None:
    hidden = delay_system(np.diag([0.3, -1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), np.eye(2), [[0.0, 1.0]])
    with pytest.raises(InvalidInputError, match="does not see the root"):
        minimum_gain(transformed(time_scaled(hidden, factor), SIZES), 1, DegreeRule.BESSEL)
    seen = delay_system(np.diag([-0.01, 1.0]), [np.zeros((2, 2))], [1.0], np.eye(2), np.eye(2), [[0.0, 1.0]])
    slow = transformed(time_scaled(seen, factor), SIZES)
    assert minimum_gain(slow, 1, DegreeRule.BESSEL).gamma == pytest.approx(100.0, rel=1e-4)
