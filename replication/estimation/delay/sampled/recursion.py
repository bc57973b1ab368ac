"""An observer of a delay plant on a grid of time: histories linear between samples, the derivative by the trapezoid.

With g = (x^, eps, u) at the instants, (x^', z^, y^)(t_k) = sum_j H_j g(t_{k-j}): delays are interpolated linearly and
distributed delays integrated exactly over the interpolant. x^ follows by the trapezoidal rule, implicit in x^ and eps:
stiff gains ask for no short step. It is of second order: in the frequency domain s becomes (2/dt) tanh(s dt/2), and a
delayed signal its interpolant, both with errors of (w dt)^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.delay.exact.kernel import Complex
from replication.estimation.delay.exact.terms import PlantTerms, Terms, axis
from replication.estimation.validation import Array

FINE, SMALL, LONGEST_CIRCLE = 8, 0.8, 2**22
"""Points on the unit circle for each tap; phase between two of them, rad; the most points."""


@dataclass(frozen=True, eq=False)
class SampledObserver:
    """The recursion.

    Attributes
    ----------
    dt : float
        Step, s.
    sizes : tuple of int
        n states, p outputs to estimate, q measurements, m known inputs.
    taps : array (J, n+p+q, n+q+m)
        H_0 ... H_{J-1}.
    """

    dt: float
    sizes: tuple[int, int, int, int]
    taps: Array

    @property
    def parts(self) -> tuple[slice, slice, slice]:
        """Rows of x', z and y."""
        n, p, q, _ = self.sizes
        return slice(0, n), slice(n, n + p), slice(n + p, n + p + q)

    def present(self) -> Array:
        """(n+q, n+q): what the unknowns x^(t_k), eps(t_k) are multiplied with."""
        n, _, q, _ = self.sizes
        states, _, measured = self.parts
        now = self.taps[0][:, : n + q]
        return np.asarray(np.eye(n + q) + np.vstack([-self.dt / 2.0 * now[states], now[measured]]))

    def response(self, omega: Array) -> Complex:
        """From y to x^ at each frequency (M, n, q), for a sampled sinusoid."""
        n, _, q, _ = self.sizes
        turn = np.exp(-1j * omega * self.dt)
        powers = turn[:, None] ** np.arange(len(self.taps))
        values = np.tensordot(powers, self.taps[:, :, : n + q], axes=1)
        slope = 2.0 / self.dt * (1.0 - turn) / (1.0 + turn)
        return _from_measurements(values, slope, self.sizes)

    def outside(self) -> int | None:
        """Roots of the recursion outside the unit circle, by the argument principle; None if one is next to it."""
        n, _, q, _ = self.sizes
        states, _, measured = self.parts
        count = 1 << int(np.ceil(np.log2(FINE * (len(self.taps) + 1))))
        while count <= LONGEST_CIRCLE:
            values = np.fft.fft(self.taps[:, :, : n + q], count, axis=0)
            turn = np.exp(-2j * np.pi * np.arange(count) / count)[:, None, None]
            rows = np.eye(n, n + q) * (1.0 - turn) - self.dt / 2.0 * (1.0 + turn) * values[:, states]
            whole = np.concatenate([rows, values[:, measured] + np.eye(q, n + q, n)], axis=1)
            determinant = np.linalg.slogdet(whole)[0]
            steps = np.angle(np.roll(determinant, -1) / determinant)
            if np.abs(steps).max() <= SMALL:
                return -round(float(steps.sum() / (2.0 * np.pi)))
            count *= 4
        return None


def sampled(plant: PlantTerms, injection: Terms, dt: float) -> SampledObserver:
    """The observer of `plant` that `injection` describes, on a grid of step `dt`."""
    n, p, q, _ = plant.sizes
    columns = (_taps(plant.terms, dt)[:, :, :n], _taps(injection, dt), _taps(plant.known, dt))
    count = max(len(part) for part in columns)
    taps = np.concatenate([np.pad(part, ((0, count - len(part)), (0, 0), (0, 0))) for part in columns], axis=2)
    return SampledObserver(dt, (n, p, q, columns[2].shape[2]), taps)


def exact_response(plant: PlantTerms, injection: Terms, omega: Array) -> Complex:
    """From y to x^ at each frequency (M, n, q), delays and averages exact: what `response` converges to."""
    n, p, q, _ = plant.sizes
    values = np.concatenate([plant.terms.at(axis(omega))[:, :, :n], injection.at(axis(omega))], axis=2)
    return _from_measurements(values, 1j * omega, (n, p, q, 0))


def _from_measurements(values: Complex, slope: Complex, sizes: tuple[int, int, int, int]) -> Complex:
    """x^ of y, from the values of (x^', z^, y^) of (x^, eps), and what stands for the derivative."""
    n, p, q, _ = sizes
    rows = slope[:, None, None] * np.eye(n, n + q) - values[:, :n]
    whole = np.concatenate([rows, values[:, n + p :] + np.eye(q, n + q, n)], axis=1)
    return np.asarray(np.linalg.solve(whole, np.broadcast_to(np.eye(n + q)[:, n:], (len(whole), n + q, q)))[:, :n])


def _taps(terms: Terms, dt: float) -> Array:
    """Weights of the samples at lags 0, dt, 2 dt, ..."""
    count = 2 + int(np.ceil(max(terms.delays, default=0.0) / dt))
    taps = np.zeros((count, *terms.constant.shape))
    taps[0] = terms.constant
    for delay, matrix, kernel in terms.spread:
        before = int(delay / dt)
        share = delay / dt - before
        taps[before] += (1.0 - share) * matrix
        taps[before + 1] += share * matrix
        if kernel is not None:
            weights = kernel.weights(dt / delay)
            taps[: len(weights)] += weights
    return taps
