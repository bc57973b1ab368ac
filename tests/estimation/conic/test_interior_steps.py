"""A step of the interior-point method solves its equations; what counts as positive."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from replication.errors import SolverError
from replication.estimation.conic import interior
from replication.estimation.conic.interior import Block, Equations, Unknowns, _positive, scaled_pair, solve
from replication.estimation.linear.riccati import symmetric


def test_a_step_takes_away_what_was_missed_and_keeps_the_duals_balanced() -> None:
    """Slack and block move together but for what they were apart; the duals meet what was lacking."""
    rng = np.random.default_rng(3)
    n, k = 4, 3
    blocks = tuple(
        Block(symmetric(rng.normal(size=(n, n))), others, rng.normal(size=(k, n)), rng.normal(size=(k, n)))
        for others in np.stack([[symmetric(rng.normal(size=(n, n))) for _ in range(2)] for _ in range(2)])
    )
    positive = [part @ part.T + np.eye(n) for part in rng.normal(size=(4, n, n))]
    pairs = [scaled_pair(positive[0], positive[1]), scaled_pair(positive[2], positive[3])]
    missed = [symmetric(rng.normal(size=(n, n))) for _ in blocks]
    unknowns = Unknowns.of(k, 2)
    lacking = rng.normal(size=unknowns.triangle + 2)
    wanted = [symmetric(rng.normal(size=(n, n))) for _ in blocks]
    dy, slacks, duals = Equations(unknowns, blocks, pairs, missed, lacking).direction(wanted)
    for block, pair, miss, slack, dual, want in zip(blocks, pairs, missed, slacks, duals, wanted, strict=True):
        moved = block.linear(*unknowns.split(dy)) + miss
        assert pair.forward @ slack @ pair.forward.T == pytest.approx(moved, abs=1e-9)
        assert slack + dual == pytest.approx(want, abs=1e-12)
    plain = [pair.inverse.T @ dual @ pair.inverse for pair, dual in zip(pairs, duals, strict=True)]
    assert unknowns.adjoint(blocks, plain) == pytest.approx(lacking, abs=1e-9)


def test_a_point_whose_blocks_are_not_positive_is_none() -> None:
    """The largest y with 1 - y - w >= 0 and w >= 0."""
    one = np.ones((1, 1))
    blocks = (Block(one, -one[None], one, -one / 2), Block(0.0 * one, 0.0 * one[None], one, one / 2))
    assert solve(blocks, 1, np.ones(1)).value == pytest.approx(1.0, abs=1e-6)
    with patch.object(interior, "_positive", return_value=False), pytest.raises(SolverError, match="no point"):
        solve(blocks, 1, np.ones(1))


def test_a_block_on_the_edge_is_not_positive() -> None:
    """The block is the slack and what it misses, beyond rounding."""
    eye = np.eye(2)
    assert _positive(eye, 0.0 * eye)
    assert not _positive(np.diag([1.0, 0.0]), 0.0 * eye)
    assert not _positive(np.diag([1.0, 1e-17]), 0.0 * eye)
    assert not _positive(eye, np.diag([0.0, -1.0]))
