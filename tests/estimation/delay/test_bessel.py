"""The small cone: its forms lie in the large one, it gives the same optima, and its observers do what they promise."""

from __future__ import annotations

import numpy as np
import pytest

from papers.peet2019.experiments.scaling import lifted
from replication.errors import InfeasibleError, SolverError
from replication.estimation.delay import DegreeRule, DelayPlant, SdpaOptions, minimum_gain
from replication.estimation.delay.galerkin import check
from replication.estimation.delay.models import chebyshev_model, riccati_gain
from replication.estimation.delay.observer import error_system, hinf_norm
from replication.estimation.delay.operators import observer_gains
from replication.estimation.delay.sos import cone as bessel
from replication.estimation.delay.sos.certificate import certificate_at
from replication.estimation.delay.sos.cone import FormSpace, cone_blocks, cone_map, required_count
from replication.estimation.delay.spectrum import hinf_gain
from replication.estimation.validation import Array
from tests.estimation.delay.plants import blind_two_delays, one_delay, scalar, three_delays, two_delays, unstable_pair

AGREE = 1e-12
SIX_DIGITS = 1e-6


def semidefinite(rng: np.random.Generator, size: int) -> Array:
    """Of rank below its order, on the boundary of the cone."""
    root = rng.standard_normal((size, max(1, size - 1)))
    return np.asarray(root @ root.T)


@pytest.mark.parametrize(("moments", "rule"), [(1, DegreeRule.TOTAL), (1, DegreeRule.TENSOR), (2, DegreeRule.TENSOR)])
@pytest.mark.parametrize("ramp", [True, False])
def test_its_forms_lie_in_the_cone_of_corollary_2(moments: int, rule: DegreeRule, ramp: bool) -> None:
    rng = np.random.default_rng(8)
    space = FormSpace(3, 2, 2, required_count(1, rule))
    small, labels = bessel.cone(space, moments, ramp=ramp)
    blocks = [semidefinite(rng, label.size) for label in labels]
    target = cone_blocks(1, rule)
    large = lifted(blocks, space, moments, target)
    form = sum(cone_map(block, space) @ matrix.ravel() for block, matrix in zip(target, large, strict=True))
    assert np.allclose(form, small @ np.concatenate([block.ravel() for block in blocks]), atol=AGREE * 100)
    for matrix in large:
        assert np.linalg.eigvalsh(matrix)[0] >= -AGREE * np.linalg.norm(matrix)


@pytest.mark.parametrize(
    ("system", "exact"),
    [
        (unstable_pair(), 1 / np.sqrt(18)),
        (blind_two_delays(), hinf_gain(scalar([-0.5, -0.5], [0.5, 1.0])).upper),
        (one_delay(), riccati_gain(chebyshev_model(one_delay(), 14))),
    ],
)
def test_five_moments_reach_the_optimum(system: DelayPlant, exact: float) -> None:
    assert minimum_gain(system, 5, DegreeRule.BESSEL).gamma == pytest.approx(exact, rel=SIX_DIGITS)


def test_gain_falls_with_the_moments_and_is_never_below_that_of_the_larger_cone() -> None:
    levels = [minimum_gain(blind_two_delays(), moments, DegreeRule.BESSEL).gamma for moments in (1, 2, 3)]
    assert levels[0] > levels[1] > levels[2]
    larger = [minimum_gain(blind_two_delays(), 1, rule).gamma for rule in (DegreeRule.TOTAL, DegreeRule.TENSOR)]
    assert levels[0] >= larger[0] and levels[1] >= larger[1]


@pytest.mark.parametrize("system", [two_delays(), three_delays()])
def test_closed_loop_keeps_the_level(system: DelayPlant) -> None:
    level = 1.05 * riccati_gain(chebyshev_model(system, 12))
    certificate = certificate_at(system, level, 3, DegreeRule.BESSEL, epsilon=1e-4)
    verified = check(certificate)
    assert verified.storage > 0 and verified.dissipation <= 1e-6 * verified.scale
    norms = [hinf_norm(error_system(system, observer_gains(certificate), order)).upper for order in (20, 24)]
    assert norms == pytest.approx([norms[0]] * 2, rel=1e-3)
    assert max(norms) <= level * (1 + 1e-4)


@pytest.mark.parametrize("share", [0.3, 0.9, 0.995])
def test_level_below_the_optimum_is_infeasible(share: float) -> None:
    with pytest.raises(InfeasibleError, match="proves none below"):
        certificate_at(unstable_pair(), share / np.sqrt(18), 3, DegreeRule.BESSEL)


def test_level_that_the_solver_does_not_settle_says_what_is_known() -> None:
    """Two iterations settle nothing; the bracket of the least level still tells on which side the level lies."""
    few = SdpaOptions(iterations=2)
    with pytest.raises(SolverError, match="it is known that it can be reached"):
        certificate_at(unstable_pair(), 0.3, 2, DegreeRule.BESSEL, options=few)
    with pytest.raises(InfeasibleError, match="proves none below"):
        certificate_at(unstable_pair(), 0.2, 2, DegreeRule.BESSEL, options=few)
