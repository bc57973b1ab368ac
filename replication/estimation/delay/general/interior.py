"""Programs in one large symmetric matrix and a few scalars, by an interior-point method that uses their structure.

    maximise cost'y  subject to  constant + left'W right + right'W left + sum_j y_j others[j] >= 0  for every block.

Nearly all entries of the equations of a step come from W and are products of entries of small matrices; general solvers
form them one by one, which for ten states and two delays takes minutes. Directions of Nesterov and Todd with Mehrotra's
corrector. Nothing here is trusted: whoever calls evaluates the blocks at the point that comes out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg

from replication.errors import SolverError
from replication.estimation.validation import Array

Index = npt.NDArray[np.intp]
START, ITERATIONS, GAP, WAIT = 10.0, 80, 1e-8, 4
"""Multiple of the unit matrix to start from; steps at most; relative gap at which to stop, and also where so many steps
gain no more than that: the multipliers may lag behind for long, and nothing hangs on them."""
SHORT, STUCK = 1e-4, 4
"""Steps shorter than this count as none; so many in a row end the iteration."""


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
class Point:
    """Where the iteration ended: W (k, k), y (J,), the cost there, the bound of the multipliers, steps."""

    w: Array
    y: Array
    value: float
    bound: float
    steps: int


@dataclass(frozen=True)
class _Scaled:
    """A pair Q, X > 0 with inverse' inverse = P, inverse Q inverse' = inverse^-T X inverse^-1 = diag(values)."""

    values: Array
    inverse: Array
    forward: Array

    @property
    def metric(self) -> Array:
        return np.asarray(self.inverse.T @ self.inverse)


def solve(blocks: tuple[Block, ...], order: int, cost: Array, *, gap: float = GAP, floor: float = 1.0) -> Point:
    """The best point found, where every block is positive; the gap is relative to floor + |value|.

    Raises SolverError if none is.
    """
    unknowns = _Unknowns.of(order, len(cost))
    b = np.concatenate([np.zeros(unknowns.triangle), cost])
    y = np.zeros(len(b))
    slacks = [START * np.eye(len(block.constant)) for block in blocks]
    duals = [START * np.eye(len(block.constant)) for block in blocks]
    size, best, stuck, step = sum(len(block.constant) for block in blocks), None, 0, 0
    values: list[float] = []
    for step in range(ITERATIONS):
        missed = [block.at(*unknowns.split(y)) - slack for block, slack in zip(blocks, slacks, strict=True)]
        lacking = -b - unknowns.adjoint(blocks, duals)
        value = float(b @ y)
        bound = sum(float(np.sum(block.constant * dual)) for block, dual in zip(blocks, duals, strict=True))
        feasible = max(float(np.abs(part).max()) for part in missed) <= 1e-9 * (1.0 + float(np.abs(y).max()))
        if feasible and (best is None or value > best.value):
            best = Point(*unknowns.split(y), value, bound, step)
        mean = sum(float(np.sum(s * x)) for s, x in zip(slacks, duals, strict=True)) / size
        values = [*values, value][-WAIT:] if feasible else []
        small = gap * (floor + abs(value))
        if feasible and (mean * size <= small or (len(values) == WAIT and max(values) - values[0] <= small)):
            break
        try:
            scaled = [_scaled(slack, dual) for slack, dual in zip(slacks, duals, strict=True)]
            equations = _Equations(unknowns, blocks, scaled, missed, lacking)
            wanted = [-np.diag(part.values) for part in scaled]
            _, ds, dx = equations.direction(wanted)
            ahead, ahead_dual = _length(scaled, ds), _length(scaled, dx)
            left = sum(
                float(np.sum((np.diag(p.values) + ahead * s) * (np.diag(p.values) + ahead_dual * x)))
                for p, s, x in zip(scaled, ds, dx, strict=True)
            )
            centre = 1.0 if stuck else min(1.0, max(1e-6, (left / size / mean) ** 2))
            wanted = [
                _lyapunov(part.values, centre * mean, np.zeros_like(s) if stuck else s @ x)
                for part, s, x in zip(scaled, ds, dx, strict=True)
            ]
            dy, ds, dx = equations.direction(wanted)
        except np.linalg.LinAlgError:
            break
        share = max(0.9, min(0.98, 1.0 - 0.1 * centre)) if not stuck else 0.5
        ahead, ahead_dual = min(1.0, share * _length(scaled, ds, 1e9)), min(1.0, share * _length(scaled, dx, 1e9))
        stuck = stuck + 1 if min(ahead, ahead_dual) < SHORT else 0
        if stuck > STUCK:
            break
        y = y + ahead * dy
        slacks = [
            _symmetric(s + ahead * p.forward @ d @ p.forward.T) for s, p, d in zip(slacks, scaled, ds, strict=True)
        ]
        duals = [
            _symmetric(x + ahead_dual * p.inverse.T @ d @ p.inverse) for x, p, d in zip(duals, scaled, dx, strict=True)
        ]
    if best is None:
        raise SolverError(f"the interior-point method found no point in {step} steps; scale the plant, or ask for less")
    return replace(best, steps=step)


def _symmetric(matrix: Array) -> Array:
    return np.asarray((matrix + matrix.T) / 2.0)


def _scaled(slack: Array, dual: Array) -> _Scaled:
    """Raises LinAlgError if one of them is not positive any more."""
    lower, other = np.linalg.cholesky(slack), np.linalg.cholesky(dual)
    left, values, right = np.linalg.svd(other.T @ lower)
    root = np.sqrt(values)
    return _Scaled(values, (left.T @ other.T) / root[:, None], lower @ right.T / root)


def _lyapunov(values: Array, level: float, product: Array) -> Array:
    """S with (D S + S D) / 2 = level I - D^2 - the symmetric part of `product`."""
    wanted = level * np.eye(len(values)) - np.diag(values**2) - _symmetric(product)
    return np.asarray(2.0 * wanted / (values[:, None] + values))


def _length(scaled: list[_Scaled], steps: list[Array], most: float = 1.0) -> float:
    """How far one may go before a matrix gets singular."""
    for part, step in zip(scaled, steps, strict=True):
        root = np.sqrt(part.values)
        least = float(np.linalg.eigvalsh(_symmetric(step / root[:, None] / root))[0])
        most = min(most, -1.0 / least) if least < 0.0 else most
    return most


@dataclass(frozen=True)
class _Unknowns:
    """The upper triangle of W, then the scalars."""

    order: int
    rows: Index
    columns: Index
    weights: Array

    @classmethod
    def of(cls, order: int, scalars: int) -> _Unknowns:
        rows, columns = np.triu_indices(order)
        return cls(order, rows, columns, np.where(rows == columns, 1.0, 2.0))

    @property
    def triangle(self) -> int:
        return len(self.rows)

    def split(self, vector: Array) -> tuple[Array, Array]:
        """W and the scalars."""
        w = np.zeros((self.order, self.order))
        w[self.rows, self.columns] = w[self.columns, self.rows] = vector[: self.triangle]
        return w, vector[self.triangle :]

    def adjoint(self, blocks: tuple[Block, ...], matrices: list[Array]) -> Array:
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


class _Equations:
    """The equations of a step: sum over the blocks of <F_i, P F(dy) P> = right-hand side."""

    def __init__(
        self, unknowns: _Unknowns, blocks: tuple[Block, ...], scaled: list[_Scaled], missed: list[Array], lacking: Array
    ) -> None:
        """Form and factor the matrix. Raises LinAlgError where that fails."""
        self.unknowns, self.blocks, self.scaled, self.missed, self.lacking = unknowns, blocks, scaled, missed, lacking
        self.metrics = [part.metric for part in scaled]
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

    def direction(self, wanted: list[Array]) -> tuple[Array, list[Array], list[Array]]:
        """dy, and the scaled steps of slacks and duals whose sum is `wanted` in every block."""
        pulled = [
            part.inverse.T @ want @ part.inverse - metric @ miss @ metric
            for part, want, metric, miss in zip(self.scaled, wanted, self.metrics, self.missed, strict=True)
        ]
        right = self.unit * (self.unknowns.adjoint(self.blocks, pulled) - self.lacking)
        solution = scipy.linalg.cho_solve(self.factor, right)
        for _ in range(2):  # rounding and regularisation
            solution = solution + scipy.linalg.cho_solve(self.factor, right - self.matrix @ solution)
        dy = self.unit * solution
        w, scalars = self.unknowns.split(dy)
        slacks = [
            _symmetric(part.inverse @ (block.linear(w, scalars) + miss) @ part.inverse.T)
            for part, block, miss in zip(self.scaled, self.blocks, self.missed, strict=True)
        ]
        return dy, slacks, [want - slack for want, slack in zip(wanted, slacks, strict=True)]


def _matrix(unknowns: _Unknowns, blocks: tuple[Block, ...], metrics: list[Array]) -> Array:
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
    return _symmetric(matrix)


def _products(unknowns: _Unknowns, pairs: list[tuple[Array, Array]]) -> Array:
    """sum over the pairs (A, B) of tr(E_i A E_j B), with E the symmetric unit matrices of the triangle."""
    k = unknowns.order
    result = np.empty((unknowns.triangle, unknowns.triangle))
    above = unknowns.rows * k + unknowns.columns
    below = unknowns.columns * k + unknowns.rows
    start = 0
    for a in range(k):  # rows (a, b), b >= a
        total = np.zeros((k - a, k, k))
        for first, second in pairs:
            total += first[a:, :, None] * second[:, a][None, None, :]
            total += first[a][None, :, None] * second[:, a:].T[:, None, :]
        flat = total.reshape(k - a, k * k)
        result[start : start + k - a] = flat[:, above] + flat[:, below]
        start += k - a
    half = np.where(unknowns.rows == unknowns.columns, 0.5, 1.0)
    return result * half[:, None] * half
