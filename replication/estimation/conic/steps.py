"""The equations of a step of the interior-point method in one large symmetric matrix W and a few scalars."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.validation import Array

Index = npt.NDArray[np.intp]


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

    @property
    def metric(self) -> Array:
        """P."""
        return np.asarray(self.inverse.T @ self.inverse)


def symmetric(matrix: Array) -> Array:
    """Its symmetric part."""
    return np.asarray((matrix + matrix.T) / 2.0)


def scaled_pair(slack: Array, dual: Array) -> Scaled:
    """Raises LinAlgError if one of them is not positive any more."""
    lower, other = np.linalg.cholesky(slack), np.linalg.cholesky(dual)
    left, values, right = np.linalg.svd(other.T @ lower)
    root = np.sqrt(values)
    return Scaled(values, (left.T @ other.T) / root[:, None], lower @ right.T / root)


@dataclass(frozen=True)
class Unknowns:
    """The upper triangle of W, then the scalars."""

    order: int
    rows: Index
    columns: Index
    weights: Array

    @classmethod
    def of(cls, order: int, scalars: int) -> Unknowns:
        """Those of a symmetric matrix of an order and of some scalars."""
        rows, columns = np.triu_indices(order)
        return cls(order, rows, columns, np.where(rows == columns, 1.0, 2.0))

    @property
    def triangle(self) -> int:
        """How many belong to W."""
        return len(self.rows)

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
            symmetric(part.inverse @ (block.linear(w, scalars) + miss) @ part.inverse.T)
            for part, block, miss in zip(self.scaled, self.blocks, self.missed, strict=True)
        ]
        return dy, slacks, [want - slack for want, slack in zip(wanted, slacks, strict=True)]


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
