"""Programs in one large symmetric matrix and a few scalars, by an interior-point method that uses their structure.

    maximise cost'y  subject to  constant + left'W right + right'W left + sum_j y_j others[j] >= 0  for every block.

Nearly all entries of the equations of a step come from W and are products of entries of small matrices; general solvers
form them one by one, which for ten states and two delays takes minutes. Directions of Nesterov and Todd with Mehrotra's
corrector. Nothing here is trusted: whoever calls evaluates the blocks at the point that comes out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from replication.errors import SolverError
from replication.estimation.linear.riccati import symmetric
from replication.estimation.validation import Array


@dataclass(frozen=True)
class Block:
    """One matrix inequality of order q; left, right (k, q), None where W does not occur; others (J, q, q)."""

    constant: Array
    others: Array
    left: Array | None = None
    right: Array | None = None

    def linear(self, w: Array, y: Array) -> Array:
        """The part that depends on the unknowns."""
        value = np.tensordot(y, self.others, axes=1)
        if self.left is None or self.right is None:
            return value
        half = self.left.T @ w @ self.right
        return np.asarray(value + half + half.T)

    def at(self, w: Array, y: Array) -> Array:
        """The matrix that must be positive."""
        return np.asarray(self.constant + self.linear(w, y))

    def fixed(self, which: int, value: float) -> Block:
        """The same with one scalar given."""
        constant = self.constant + value * self.others[which]
        return replace(self, constant=constant, others=np.delete(self.others, which, axis=0))


@dataclass(frozen=True)
class Scaled:
    """A pair Q, X > 0 with inverse' inverse = P, inverse Q inverse' = inverse^-T X inverse^-1 = diag(values)."""

    values: Array
    inverse: Array
    forward: Array


def scaled_pair(slack: Array, dual: Array) -> Scaled:
    """Raises LinAlgError if one of them is not positive any more."""
    lower, dual_lower = np.linalg.cholesky(slack), np.linalg.cholesky(dual)
    left, values, right = np.linalg.svd(dual_lower.T @ lower)
    root = np.sqrt(values)
    return Scaled(values, (left.T @ dual_lower.T) / root[:, None], lower @ right.T / root)


class Unknowns:
    """The upper triangle of W, `triangle` numbers, then the scalars."""

    def __init__(self, order: int) -> None:
        self.order = order
        self.rows, self.columns = np.triu_indices(order)
        self.weights = np.where(self.rows == self.columns, 1.0, 2.0)
        self.triangle = len(self.rows)

    def split(self, vector: Array) -> tuple[Array, Array]:
        """W and the scalars."""
        w = np.zeros((self.order, self.order))
        w[self.rows, self.columns] = w[self.columns, self.rows] = vector[: self.triangle]
        return w, vector[self.triangle :]

    def adjoint(self, blocks: tuple[Block, ...], matrices: Sequence[Array]) -> Array:
        """The inner product of the matrices with what each unknown adds to the blocks."""
        total = np.zeros(self.triangle + len(blocks[0].others))
        for block, matrix in zip(blocks, matrices, strict=True):
            total[self.triangle :] += np.tensordot(block.others, matrix, axes=2)
            if block.left is not None and block.right is not None:
                total[: self.triangle] += self.folded(block.left @ matrix @ block.right.T)
        return total

    def folded(self, half: Array) -> Array:
        """Of W: the triangle (.., N) of half + half' (.., k, k), entries off the diagonal twice."""
        whole = half + np.swapaxes(half, -1, -2)
        return np.asarray(whole[..., self.rows, self.columns] * self.weights)


class Equations:
    """The equations of a step: sum over the blocks of <F_i, P F(dy) P> = right-hand side."""

    def __init__(
        self, unknowns: Unknowns, blocks: tuple[Block, ...], scaled: list[Scaled], missed: list[Array], lacking: Array
    ) -> None:
        """Form and factor the matrix. Raises LinAlgError where that fails."""
        self.unknowns, self.blocks, self.scaled, self.missed, self.lacking = unknowns, blocks, scaled, missed, lacking
        self.metrics = [part.inverse.T @ part.inverse for part in scaled]
        matrix = _matrix(unknowns, blocks, self.metrics)
        self.unit = 1.0 / np.sqrt(np.diag(matrix))
        self.matrix = matrix * self.unit[:, None] * self.unit
        for regular in (0.0, 1e-14, 1e-12, 1e-10):
            try:
                self.factor = scipy.linalg.cho_factor(self.matrix + regular * np.eye(len(matrix)))
                return
            except np.linalg.LinAlgError:
                continue
        raise np.linalg.LinAlgError("the equations of a step are singular")

    def direction(self, targets: list[Array]) -> tuple[Array, list[Array], list[Array]]:
        """dy, and the scaled steps of slacks and duals whose sum is `targets` in every block."""
        pulled = [
            part.inverse.T @ target @ part.inverse - metric @ miss @ metric
            for part, target, metric, miss in zip(self.scaled, targets, self.metrics, self.missed, strict=True)
        ]
        right = self.unit * (self.unknowns.adjoint(self.blocks, pulled) - self.lacking)
        solution = scipy.linalg.cho_solve(self.factor, right)
        for _ in range(2):  # rounding and regularisation
            solution = solution + scipy.linalg.cho_solve(self.factor, right - self.matrix @ solution)
        dy = self.unit * solution
        w, scalars = self.unknowns.split(dy)
        slacks = [
            symmetric(part.inverse @ (block.linear(w, scalars) + miss) @ part.inverse.T)
            for part, block, miss in zip(self.scaled, self.blocks, self.missed, strict=True)
        ]
        return dy, slacks, [target - slack for target, slack in zip(targets, slacks, strict=True)]


def _matrix(unknowns: Unknowns, blocks: tuple[Block, ...], metrics: list[Array]) -> Array:
    """<F_i, P F_j P>, summed over the blocks."""
    count = unknowns.triangle
    matrix = np.zeros((count + len(blocks[0].others),) * 2)
    pairs: list[tuple[Array, Array]] = []
    for block, metric in zip(blocks, metrics, strict=True):
        used = np.flatnonzero(np.any(block.others, axis=(1, 2)))
        others = block.others[used]
        moved = metric @ others @ metric
        flat = (len(used), metric.size)
        matrix[np.ix_(count + used, count + used)] += others.reshape(flat) @ moved.reshape(flat).T
        if block.left is None or block.right is None:
            continue
        left, right = block.left, block.right
        cross = right @ metric @ left.T
        pairs += [(cross, cross), (cross.T, cross.T), (2.0 * right @ metric @ right.T, left @ metric @ left.T)]
        edge = unknowns.folded(left @ moved @ right.T)
        matrix[count + used, :count] += edge
        matrix[:count, count + used] += edge.T
    matrix[:count, :count] = _products(unknowns, pairs)
    return symmetric(matrix)


def _products(unknowns: Unknowns, pairs: list[tuple[Array, Array]]) -> Array:
    """sum over the pairs (A, B) of tr(E_i A E_j B), with E the symmetric unit matrices of the triangle."""
    k = unknowns.order
    result = np.empty((unknowns.triangle, unknowns.triangle))
    first = np.stack([pair[0] for pair in pairs], axis=-1)  # (b, c, pair)
    second = np.stack([pair[1].T for pair in pairs], axis=1)  # (a, pair, d)
    start = 0
    for a in range(k):  # rows (a, b) and columns (c, d), both with all indices from a on
        m = k - a
        left = np.concatenate([first[a:, a:], np.broadcast_to(first[a, a:], (m, m, len(pairs)))], axis=2)
        right = np.concatenate([np.broadcast_to(second[a, :, a:], (m, len(pairs), m)), second[a:, :, a:]], axis=1)
        flat = (left @ right).reshape(m, m * m)
        rows, columns = unknowns.rows[start:] - a, unknowns.columns[start:] - a
        part = flat[:, rows * m + columns] + flat[:, columns * m + rows]
        result[start : start + m, start:] = part
        result[start:, start : start + m] = part.T
        start += m
    half = np.where(unknowns.rows == unknowns.columns, 0.5, 1.0)
    return result * half[:, None] * half


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
    unknowns = Unknowns(order)
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
    right = level * np.eye(len(values)) - np.diag(values**2) - symmetric(product)
    return np.asarray(2.0 * right / (values[:, None] + values))


def _length(scaled: list[Scaled], steps: list[Array], most: float = 1.0) -> float:
    """How far one may go before a matrix gets singular."""
    for part, step in zip(scaled, steps, strict=True):
        root = np.sqrt(part.values)
        least = float(np.linalg.eigvalsh(symmetric(step / root[:, None] / root))[0])
        most = min(most, -1.0 / least) if least < 0.0 else most
    return most
