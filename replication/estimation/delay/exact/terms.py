"""A matrix function of s made of a constant, delays and distributed delays; and a plant written as one such function.

M(s) = M_0 + sum_i e^{-s tau_i} M_i + sum_i integral of K_i(lag) e^{-s tau_i lag} over [0, 1].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from replication.estimation.delay.exact.kernel import Complex, Kernel
from replication.estimation.validation import Array


def axis(omega: Array) -> Complex:
    """The points s = j omega."""
    return np.asarray(1j * omega)


@dataclass(frozen=True, eq=False)
class Terms:
    """M(s), of a rows and b columns.

    Attributes
    ----------
    constant : array (a, b)
        M_0.
    delays : tuple of K floats
        tau_i, s; positive.
    delayed : tuple of K arrays (a, b)
        M_i.
    kernels : tuple of K kernels or None
        K_i; None for zero.
    """

    constant: Array
    delays: tuple[float, ...] = ()
    delayed: tuple[Array, ...] = ()
    kernels: tuple[Kernel | None, ...] = ()

    @property
    def spread(self) -> tuple[tuple[float, Array, Kernel | None], ...]:
        """Delay, matrix and kernel of each line."""
        return tuple(zip(self.delays, self.delayed, self.kernels, strict=True))

    def at(self, s: Complex, delays: Array | None = None) -> Complex:
        """M at each s (M,) with Re s >= 0, shape (M, a, b); `delays` (M, K) stand for tau_i if given."""
        total = np.tile(self.constant.astype(complex), (len(s), 1, 1))
        for line in self.lines_at(s, delays):
            total += line
        return total

    def lines_at(self, s: Complex, delays: Array | None = None) -> list[Complex]:
        """The part of each line."""
        times = np.tile(self.delays, (len(s), 1)) if delays is None else delays
        found = []
        for i, (_, matrix, kernel) in enumerate(self.spread):
            value = np.asarray(np.exp(-s * times[:, i])[:, None, None] * matrix, dtype=complex)
            if kernel is not None:
                value += kernel.transform(s * times[:, i])
            found.append(value)
        return found

    def aged(self) -> Terms:
        """Each line weighted with its lag: the far end as it is, the kernels as lag·K(lag); no constant."""
        kernels = tuple(None if kernel is None else kernel.lagged() for kernel in self.kernels)
        return replace(self, constant=np.zeros_like(self.constant), kernels=kernels)

    def applied(self, left: Array, right: Array) -> Terms:
        """left·M(s)·right."""
        return Terms(
            left @ self.constant @ right,
            self.delays,
            tuple(left @ matrix @ right for matrix in self.delayed),
            tuple(None if kernel is None else kernel.applied(left, right) for kernel in self.kernels),
        )

    def bound(self) -> Array:
        """Upper bounds (a, b) of the entries of |M(s)| wherever Re s >= 0."""
        return np.asarray(np.abs(self.constant) + sum(self.sizes()))

    def sizes(self) -> list[Array]:
        """Such bounds of the part of each line, whatever its delay."""
        return [np.abs(matrix) + (0.0 if kernel is None else kernel.size()) for _, matrix, kernel in self.spread]

    def sizes_beyond(self, phases: Array) -> list[Array]:
        """Bounds (M, a, b) of the part of line i on the imaginary axis where w tau_i >= phases[:, i]."""
        found = []
        for i, (_, matrix, kernel) in enumerate(self.spread):
            size = np.tile(np.abs(matrix), (len(phases), 1, 1))
            if kernel is not None:
                with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                    size += np.fmin(kernel.size(), kernel.variation() / phases[:, i, None, None])
            found.append(size)
        return found

    def variation(self, shortest: Sequence[float]) -> Array:
        """V (a, b): the kernels' part of M(s) is at most V/|s| for Re s >= 0, for delays from `shortest` on."""
        total = np.zeros(self.constant.shape)
        for least, kernel in zip(shortest, self.kernels, strict=True):
            if kernel is not None:
                total = total + kernel.variation() / least
        return total

    def without_kernels(self) -> Terms:
        """The constant and the delays alone."""
        return replace(self, kernels=(None,) * len(self.delays))


def stacked(blocks: Sequence[tuple[Terms, Array, Array]], constant: Array) -> Terms:
    """constant + the sum of left·M(s)·right over `blocks` (M, left, right); delays may be different ones in each."""
    lines = [line for terms, left, right in blocks for line in terms.applied(left, right).spread]
    for terms, left, right in blocks:
        constant = constant + left @ terms.constant @ right
    return Terms(constant, *(tuple(part) for part in zip(*lines, strict=True))) if lines else Terms(constant)


@dataclass(frozen=True, eq=False)
class PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u.

    Attributes
    ----------
    sizes : tuple of int
        n states, p outputs to estimate, q measurements, r disturbances.
    terms : Terms
        M, rows (x', z, y), columns (x, w).
    known : Terms
        N, the same rows, a column for each known input.
    """

    sizes: tuple[int, int, int, int]
    terms: Terms
    known: Terms

    @property
    def rows(self) -> tuple[slice, slice, slice]:
        """Where x', z and y stand."""
        n, p, q, _ = self.sizes
        return slice(0, n), slice(n, n + p), slice(n + p, n + p + q)

    def pencil(self, omega: Array, values: Complex) -> Complex:
        """[A - j omega, B; C_2, D_21] at each frequency (M,), `values` being M there; rows of unit length.

        So no rank and no null space of it hangs on the units.
        """
        n = self.sizes[0]
        states, _, measured = self.rows
        found = np.concatenate([values[:, states], values[:, measured]], axis=1)
        found[:, :n, :n] -= 1j * omega[:, None, None] * np.eye(n)
        found /= np.maximum(np.linalg.norm(found, axis=2, keepdims=True), np.finfo(float).tiny)
        return found

    @property
    def columns(self) -> tuple[slice, slice]:
        """Where x and w stand."""
        n, _, _, r = self.sizes
        return slice(0, n), slice(n, n + r)
