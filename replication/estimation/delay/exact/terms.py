"""A matrix function of s made of a constant, delays and distributed delays; and a plant written as one such function.

M(s) = M_0 + sum_i e^{-s tau_i} M_i + sum_i integral of K_i(lag) e^{-s tau_i lag} over [0, 1].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array

# Polynomials of the lag on [0, 1], as Legendre series: exact Laplace transforms, bounds, weights for samples.
#
# The transform is a sum of modified spherical Bessel functions i_k, so that no quadrature has to resolve an
# oscillation.


Complex = npt.NDArray[np.complexfloating[Any, Any]]


@dataclass(frozen=True, eq=False)
class Kernel:
    """K(lag) on [0, 1]: coefficients (d+1, a, b) of the orthonormal Legendre polynomials of s = -lag."""

    series: Array

    def __call__(self, lags: Array) -> Array:
        """The values at `lags` (M,), shape (M, a, b)."""
        return np.asarray(np.tensordot(legendre.evaluate(len(self.series), -lags), self.series, axes=1))

    def transform(self, s: Complex) -> Complex:
        """Integral of K(lag) e^{-s lag} over [0, 1] at each s (M,), shape (M, a, b)."""
        factor = 0.5 * np.exp(-0.5 * s + 0.5 * np.abs(s.real))
        transforms = _legendre_transforms(0.5 * s, len(self.series))
        return np.asarray(np.einsum("m,mk,kab->mab", factor, transforms, self.series))

    def lagged(self) -> Kernel:
        """The kernel lag·K(lag)."""
        return Kernel(projected(lambda lags: lags[:, None, None] * self(lags), len(self.series)))

    def size(self) -> Array:
        """Upper bounds (a, b) of the integrals of |K|, by Cauchy's inequality."""
        return np.asarray(np.sqrt(np.sum(self.series**2, axis=0)))

    def variation(self) -> Array:
        """V (a, b) with |transform(s)| <= V/|s| for Re s >= 0: variation and jumps; p_k varies by 2k p_k(0) at most."""
        weights = (2.0 + 2.0 * np.arange(len(self.series))) * legendre.ends(len(self.series))[0]
        return np.asarray(np.einsum("kab,k->ab", np.abs(self.series), weights))

    def quadrature(self, step: float) -> tuple[Array, Array]:
        """Lags (M,), and values (M, a, b): K by weights that integrate its product with what is linear between steps.

        Exact: pieces between multiples of `step`, by Gauss' rule.
        """
        cuts = np.append(np.arange(0.0, 1.0, step), 1.0)
        nodes, weights = legendre.gauss(len(self.series) // 2 + 2)
        lags = (cuts[1:, None] + np.diff(cuts)[:, None] * nodes).ravel()
        return lags, self(lags) * np.outer(np.diff(cuts), weights).ravel()[:, None, None]


def _legendre_transforms(b: Complex, count: int) -> Complex:
    """2 e^{b - |Re b|} times the integrals (M, count) of p_k(-lag) e^{-2 b lag}, by Bessel functions i_k or j_k."""
    orders, sizes = np.arange(count), 2.0 * legendre.ends(count)[0]
    if not np.any(b.real):
        return np.asarray(sizes * 1j**orders * scipy.special.spherical_jn(orders, b.imag[:, None]))
    b = np.where(b == 0.0, 1e-200, b)
    bessel = np.sqrt(np.pi / (2.0 * b))[:, None] * scipy.special.ive(orders + 0.5, b[:, None])
    return np.asarray(sizes * bessel)


def projected(function: Callable[[Array], Array], degree: int) -> Array:
    """Coefficients (degree+1, a, b), for a `Kernel`, of a function of the lags that is a polynomial of `degree`."""
    nodes, weights = legendre.gauss(degree + 1)
    return np.asarray(np.einsum("t,tk,tab->kab", weights, legendre.evaluate(degree + 1, nodes), function(-nodes)))


@dataclass(frozen=True, eq=False)
class Terms:
    """M(s), of a rows and b columns."""

    constant: Array  # (a, b) M_0
    delays: tuple[float, ...] = ()  # tau_i, s; positive
    delayed: tuple[Array, ...] = ()  # (a, b) M_i
    kernels: tuple[Kernel | None, ...] = ()  # K_i; None for zero

    @property
    def spread(self) -> tuple[tuple[float, Array, Kernel | None], ...]:
        """Delay, matrix and kernel of each line."""
        return tuple(zip(self.delays, self.delayed, self.kernels, strict=True))

    def at(self, s: Complex, delays: Array | None = None) -> Complex:
        """M at each s (M,), shape (M, a, b); `delays` (M, K) stand for tau_i if given."""
        total = np.tile(self.constant.astype(complex), (len(s), 1, 1))
        for line in self.lines_at(s, delays):
            total += line
        return total

    def lines_at(self, s: Complex, delays: Array | None = None) -> list[Complex]:
        """The part of each line."""
        times = np.tile(self.delays, (len(s), 1)) if delays is None else delays
        parts = []
        for i, (_, matrix, kernel) in enumerate(self.spread):
            value = np.asarray(np.exp(-s * times[:, i])[:, None, None] * matrix, dtype=complex)
            if kernel is not None:
                value += kernel.transform(s * times[:, i])
            parts.append(value)
        return parts

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
            tuple(None if kernel is None else Kernel(left @ kernel.series @ right) for kernel in self.kernels),
        )

    def weights(self, dt: float) -> Array:
        """Weights (J, a, b) of the samples at lags 0, dt, 2 dt, .. of a signal that is linear between them."""
        count = 2 + int(np.ceil(max(self.delays, default=0.0) / dt))
        taps = np.zeros((count, *self.constant.shape))
        taps[0] = self.constant
        for delay, matrix, kernel in self.spread:
            far = np.ones(1), matrix[None]
            for lags, values in (far,) if kernel is None else (far, kernel.quadrature(dt / delay)):
                before = (delay * lags / dt).astype(int)
                share = (delay * lags / dt - before)[:, None, None]
                np.add.at(taps, before, (1.0 - share) * values)
                np.add.at(taps, before + 1, share * values)
        return taps

    def bound(self) -> Array:
        """Upper bounds (a, b) of the entries of |M(s)| wherever Re s >= 0."""
        sizes = (np.abs(matrix) + (0.0 if kernel is None else kernel.size()) for _, matrix, kernel in self.spread)
        return np.asarray(np.abs(self.constant) + sum(sizes))

    def sizes_beyond(self, phases: Array) -> list[Array]:
        """Bounds (M, a, b) of the part of line i on the imaginary axis where w tau_i >= phases[:, i]."""
        sizes = []
        for i, (_, matrix, kernel) in enumerate(self.spread):
            size = np.tile(np.abs(matrix), (len(phases), 1, 1))
            if kernel is not None:
                with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                    size += np.fmin(kernel.size(), kernel.variation() / phases[:, i, None, None])
            sizes.append(size)
        return sizes

    def variation(self, shortest: Sequence[float]) -> Array:
        """V (a, b): the kernels' part of M(s) is at most V/|s| for Re s >= 0, for delays from `shortest` on."""
        parts = (kernel.variation() / t for t, kernel in zip(shortest, self.kernels, strict=True) if kernel is not None)
        return sum(parts, np.zeros(self.constant.shape))


def stacked(blocks: Sequence[tuple[Terms, Array, Array]], constant: Array) -> Terms:
    """constant + the sum of left·M(s)·right over `blocks` (M, left, right); delays may be different ones in each."""
    lines = [line for terms, left, right in blocks for line in terms.applied(left, right).spread]
    for terms, left, right in blocks:
        constant = constant + left @ terms.constant @ right
    return Terms(constant, *(tuple(part) for part in zip(*lines, strict=True))) if lines else Terms(constant)


@dataclass(frozen=True, eq=False)
class PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u."""

    sizes: tuple[int, int, int, int]  # n states, p outputs to estimate, q measurements, r disturbances
    terms: Terms  # M, rows (x', z, y), columns (x, w)
    known: Terms  # N, the same rows, a column for each known input

    @property
    def rows(self) -> tuple[slice, slice, slice]:
        """Where x', z and y stand."""
        n, p, q, _ = self.sizes
        return slice(0, n), slice(n, n + p), slice(n + p, n + p + q)

    def pencil(self, omega: Array, values: Complex) -> Complex:
        """[A - j omega, B; C_2, D_21] at each frequency (M,), where M is `values`; rows of unit length."""
        n = self.sizes[0]
        states, _, measured = self.rows
        pencil = np.concatenate([values[:, states], values[:, measured]], axis=1)
        pencil[:, :n, :n] -= 1j * omega[:, None, None] * np.eye(n)
        pencil /= np.maximum(np.linalg.norm(pencil, axis=2, keepdims=True), np.finfo(float).tiny)
        return pencil


def plant_terms(plant: DelayPlant) -> PlantTerms:
    """(x', z, y) = M(s) (x, w) + N(s) u of a plant."""
    n, p, q, r, m = plant.states, plant.outputs, plant.measurements, plant.inputs, plant.known_inputs

    def driven(b_u: Array) -> Array:
        return np.vstack([b_u, np.zeros((p + q, m))])

    present = np.block([[plant.a0, plant.b], [plant.c10, plant.d11], [plant.c2, plant.d21]])
    states = zip(plant.a, plant.b_delayed, plant.c1, plant.c2_delayed, plant.d21_delayed, strict=True)
    late = tuple(np.block([[a, b], [c1, np.zeros((p, r))], [c2, d2]]) for a, b, c1, c2, d2 in states)
    kernels = tuple(map(_average, zip(plant.a_spread, plant.c1_spread, plant.c2_spread, strict=True), repeat(r)))
    known = Terms(driven(plant.b_u), plant.delays, tuple(map(driven, plant.b_u_delayed)), (None,) * len(late))
    return PlantTerms((n, p, q, r), Terms(present, plant.delays, late, kernels), known)


def _average(parts: tuple[Array, ...], inputs: int) -> Kernel | None:
    """The kernel of a mean from what multiplies powers of the lag in x', z and y, each (k, rows, n); None for zero."""
    count = max(map(len, parts))
    powers = np.concatenate([np.pad(part, ((0, count - len(part)), (0, 0), (0, inputs))) for part in parts], axis=1)
    if not np.any(powers):
        return None
    return Kernel(projected(lambda lags: np.tensordot(lags[:, None] ** np.arange(count), powers, axes=1), count - 1))
