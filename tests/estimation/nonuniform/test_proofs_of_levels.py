"""What a storage function proves: never below what is attained, and only if it is one."""

from __future__ import annotations

from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest
from sampled_cases import OSCILLATOR

from replication.estimation.nonuniform.filters import periodic_gain
from replication.estimation.nonuniform.guarantee import certificate
from replication.estimation.nonuniform.plant import PeriodRange
from replication.estimation.nonuniform.stamped.proof import LOOSE, proved_design


@pytest.mark.parametrize("h", [0.1, 0.4])
def test_the_level_of_a_narrow_range_is_hardly_above_that_of_its_period(h: float) -> None:
    design, proof = proved_design(OSCILLATOR, PeriodRange(h, h * (1 + 1e-6)))
    attained = periodic_gain(OSCILLATOR, design.filter.at(h), [h]).lower
    assert attained <= proof.level <= design.level * (1 + LOOSE) * (1 + 1e-6)


def test_a_storage_that_is_not_positive_proves_nothing() -> None:
    """Though the inequalities may hold, as for a mode that grows and that z does not show."""
    tree = SimpleNamespace(transitions=lambda: [(0, 0, 0)])
    system, cells = SimpleNamespace(level=2.0), SimpleNamespace(edges=(0.1, 0.2))
    eye = np.eye(2)
    with patch.object(certificate, "cell_needs", return_value=(np.array([0.25]), np.array([0.1]))):
        for P, proved in ((eye, 1.0), (np.diag([1.0, -1.0]), np.inf)):
            found = certificate.certify(system, cells, tree, P[None], 2.0)  # type: ignore[arg-type]
            assert found.level == pytest.approx(proved)
