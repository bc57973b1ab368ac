"""Programs in one large symmetric matrix and a few scalars, by an interior-point method that uses their structure.

    maximise cost'y  subject to  constant + left'W right + right'W left + sum_j y_j others[j] >= 0  for every block.

Nearly all entries of the equations of a step come from W and are products of entries of small matrices; general solvers
form them one by one, which for ten states and two delays takes minutes. Directions of Nesterov and Todd with Mehrotra's
corrector. Nothing here is trusted: whoever calls evaluates the blocks at the point that comes out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from replication.errors import SolverError
from replication.estimation.conic.steps import Block, Equations, Scaled, Unknowns, scaled_pair, symmetric
from replication.estimation.validation import Array

START, ITERATIONS, GAP, WAIT = 10.0, 80, 1e-8, 4
"""Multiple of the unit matrix to start from; steps at most; relative gap at which to stop, and also where so many steps
gain no more than that: the multipliers may lag behind for long, and nothing hangs on them."""
FITS = 1e-9
"""How well slacks fit the unknowns, relative to these, for a point to count."""
ENDLESS = 1e8
"""Unknowns beyond which none are looked for."""
SHORT, STUCK = 1e-4, 4
"""Steps shorter than this count as none; so many in a row end the iteration."""


@dataclass(frozen=True)
class Point:
    """The best point: W (k, k), y (J,), the cost there; and how many steps the iteration took."""

    w: Array
    y: Array
    value: float
    steps: int


@dataclass(frozen=True)
class _Iterate:
    """Unknowns, slacks and multipliers; the slacks need not fit the unknowns yet."""

    y: Array
    slacks: tuple[Array, ...]
    duals: tuple[Array, ...]

    @property
    def mean(self) -> float:
        """The mean product of the eigenvalues of slacks and multipliers, which goes to zero."""
        total = sum(float(np.sum(s * x)) for s, x in zip(self.slacks, self.duals, strict=True))
        return total / sum(len(s) for s in self.slacks)


def solve(blocks: tuple[Block, ...], order: int, cost: Array, *, gap: float = GAP, floor: float = 1.0) -> Point:
    """The best point found, where every block is positive; the gap is relative to floor + |value|.

    Raises SolverError if none is.
    """
    unknowns = Unknowns.of(order, len(cost))
    b = np.concatenate([np.zeros(unknowns.triangle), cost])
    start = tuple(START * np.eye(len(block.constant)) for block in blocks)
    now = _Iterate(np.zeros(len(b)), start, start)
    best, stuck, step = None, 0, 0
    values: list[float] = []
    for step in range(ITERATIONS):
        missed = [block.at(*unknowns.split(now.y)) - slack for block, slack in zip(blocks, now.slacks, strict=True)]
        if max(float(np.abs(part).max()) for part in missed) <= FITS * (1.0 + float(np.abs(now.y).max())):
            value = float(b @ now.y)
            values = [*values, value][-WAIT:]
            if (best is None or value > best.value) and all(map(_positive, now.slacks, missed)):
                best = Point(*unknowns.split(now.y), value, step)
            small = gap * (floor + abs(value))
            if now.mean * sum(map(len, start)) <= small or (len(values) == WAIT and np.ptp(values) <= small):
                break
        try:
            pairs = [scaled_pair(slack, dual) for slack, dual in zip(now.slacks, now.duals, strict=True)]
            equations = Equations(unknowns, blocks, pairs, missed, -b - unknowns.adjoint(blocks, now.duals))
            now, length = _moved(now, pairs, equations, centring=stuck > 0)
        except np.linalg.LinAlgError:
            break
        stuck = stuck + 1 if length < SHORT else 0
        if stuck > STUCK or not np.abs(now.y).max() < ENDLESS:
            break
    if best is None:
        raise SolverError(f"the interior-point method found no point in {step} steps; scale the plant, or ask for less")
    return replace(best, steps=step)


def _moved(now: _Iterate, pairs: list[Scaled], equations: Equations, *, centring: bool) -> tuple[_Iterate, float]:
    """The next iterate, and how long the step was; only towards the centre if `centring`."""
    _, slacks, duals = equations.direction([-np.diag(pair.values) for pair in pairs])
    ahead, behind = _length(pairs, slacks), _length(pairs, duals)
    products = [
        np.sum((np.diag(pair.values) + ahead * s) * (np.diag(pair.values) + behind * x))
        for pair, s, x in zip(pairs, slacks, duals, strict=True)
    ]
    left = float(sum(products)) / sum(len(s) for s in slacks)
    centre = 1.0 if centring else min(1.0, max(1e-6, (left / now.mean) ** 2))
    dy, slacks, duals = equations.direction(
        [
            _lyapunov(pair.values, centre * now.mean, 0.0 * s if centring else s @ x)
            for pair, s, x in zip(pairs, slacks, duals, strict=True)
        ]
    )
    share = 0.5 if centring else max(0.9, min(0.98, 1.0 - 0.1 * centre))
    ahead, behind = (min(1.0, share * _length(pairs, steps, 1e9)) for steps in (slacks, duals))
    following = _Iterate(
        now.y + ahead * dy,
        tuple(
            symmetric(s + ahead * p.forward @ d @ p.forward.T)
            for s, p, d in zip(now.slacks, pairs, slacks, strict=True)
        ),
        tuple(
            symmetric(x + behind * p.inverse.T @ d @ p.inverse) for x, p, d in zip(now.duals, pairs, duals, strict=True)
        ),
    )
    return following, min(ahead, behind)


def _positive(slack: Array, missed: Array) -> bool:
    """Whether the block itself, not the slack alone, is positive at the unknowns beyond rounding."""
    block = slack + missed
    rounding = len(block) * np.finfo(float).eps * np.trace(block)
    try:
        np.linalg.cholesky(block - rounding * np.eye(len(block)))
    except np.linalg.LinAlgError:
        return False
    return True


def _lyapunov(values: Array, level: float, product: Array) -> Array:
    """S with (D S + S D) / 2 = level I - D^2 - the symmetric part of `product`."""
    wanted = level * np.eye(len(values)) - np.diag(values**2) - symmetric(product)
    return np.asarray(2.0 * wanted / (values[:, None] + values))


def _length(scaled: list[Scaled], steps: list[Array], most: float = 1.0) -> float:
    """How far one may go before a matrix gets singular."""
    for part, step in zip(scaled, steps, strict=True):
        root = np.sqrt(part.values)
        least = float(np.linalg.eigvalsh(symmetric(step / root[:, None] / root))[0])
        most = min(most, -1.0 / least) if least < 0.0 else most
    return most
