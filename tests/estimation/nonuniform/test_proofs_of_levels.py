"""What a storage function proves: never below what is attained, and only if it is one."""

from __future__ import annotations

import numpy as np
import pytest
from sampled_cases import OSCILLATOR

from replication.estimation.nonuniform.filters import periodic_gain
from replication.estimation.nonuniform.guarantee import certify
from replication.estimation.nonuniform.path_lyapunov import Cells, ContextTree, ErrorSystem
from replication.estimation.nonuniform.plant import PeriodRange
from replication.estimation.nonuniform.stamped.design import LOOSE, StampedFilter, StampedPlant, proved_design


@pytest.mark.parametrize("h", [0.1, 0.4])
def test_the_level_of_a_narrow_range_is_hardly_above_that_of_its_period(h: float) -> None:
    design, proof = proved_design(OSCILLATOR, PeriodRange(h, h * (1 + 1e-6)))
    attained = periodic_gain(OSCILLATOR, design.filter.at(h), [h]).lower
    assert attained <= proof.level <= design.level * (1 + LOOSE) * (1 + 1e-6)


def test_a_storage_that_is_negative_proves_nothing() -> None:
    """An error that grows: P = -4 meets the inequality of a level all the same."""
    plant = StampedPlant([[0.5]], [[1, 0]], [[1]], [[0, 1]], [[1]])
    system = ErrorSystem(plant, StampedFilter(np.zeros((1, 3, 1))), np.eye(1), 1.0, False, np.ones(1))
    found = certify(system, Cells((0.9, 1.0)), ContextTree.one_step(1), np.full((1, 1, 1), -4.0), 100.0)
    assert 0.0 < found.needs[0] < 100.0
    assert found.level == np.inf
