"""The observer of a delay plant as it runs: one step for each sample, in Python and as C99."""

from dataclasses import dataclass

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.export import INSTANTS, c_file, source
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.exact.terms import Complex, PlantTerms, Terms, axis
from replication.estimation.validation import Array, StateSpace, increasing_grid, positive_scalar

# An observer of a delay plant on a grid of time: histories linear between samples, the derivative by the trapezoid.
#
# With g = (x^, eps, u) at the instants, (x^', z^, y^)(t_k) = sum_j H_j g(t_{k-j}): delays are interpolated linearly and
# distributed delays integrated exactly over the interpolant. x^ follows by the trapezoidal rule, implicit in x^ and
# eps: stiff gains ask for no short step. It is of second order: in the frequency domain s becomes (2/dt) tanh(s dt/2),
# and a delayed signal its interpolant, both with errors of (w dt)^2.


FINE, SMALL, LONGEST_CIRCLE = 8, 0.8, 2**22
"""Points on the unit circle for each tap; phase between two of them, rad; the most points."""


@dataclass(frozen=True, eq=False)
class SampledObserver:
    """The recursion."""

    dt: float  # Step, s
    sizes: tuple[int, int, int, int]  # n states, p outputs to estimate, q measurements, m known inputs
    parts: tuple[slice, slice, slice]  # Rows of x', z and y
    taps: Array  # (J, n+p+q, n+q+m) H_0 ... H_{J-1}

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
    return SampledObserver(dt, (n, p, q, columns[2].shape[2]), plant.rows, taps)


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


LONGEST = 20_000
"""Samples that are kept, at the most."""


class InnovationsObserver(RunningObserver):
    """`step(u, y)` takes u(t_k) and y(t_k) every dt seconds and returns x^(t_k), the estimate at the same instant.

    Between samples all signals are taken as linear: errors fall with the square of dt; see `discretisation_error`.
    Before the first sample x^ is taken as x^(0), with neither innovations nor known inputs. A missing entry of y is
    replaced by what the observer expects at t_k without it.

    Parameters
    ----------
    plant : PlantTerms
        The plant.
    injection : Terms
        What the innovation adds to (x^', z^, y^).
    dt : float
        Sampling period, s.

    Raises
    ------
    InvalidInputError
        dt is not positive, so short that more than LONGEST samples would be kept, or so long that the recursion is
        unstable.
    """

    def __init__(self, plant: PlantTerms, injection: Terms, *, dt: float) -> None:
        self.dt = positive_scalar("dt", dt, unit="s")
        longest = max(plant.terms.delays, default=0.0)
        if longest > LONGEST * self.dt:
            raise InvalidInputError(
                f"dt must be at least {longest / LONGEST:.3g} s, got {self.dt:g} s: the observer keeps the samples of "
                "its longest delay"
            )
        self._plant, self._injection = plant, injection
        self.recursion: SampledObserver = sampled(plant, injection, self.dt)
        if self.recursion.outside() != 0:
            raise InvalidInputError(f"dt = {self.dt:g} s is too long: the recursion is not stable; sample faster")
        n, _, q, m = self.recursion.sizes
        self._past = np.zeros((len(self.recursion.taps) - 1, n + q + m))
        present = self.recursion.present()
        self._solve, self._free, self._first = (
            np.linalg.inv(part) for part in (present, present[:n, :n], present[n:, n:])
        )
        super().__init__(n, m, q)

    @property
    def estimate(self) -> Array:
        """x^(t_k), (n,)."""
        return np.array(self._state)

    @property
    def output(self) -> Array:
        """z^(t_k), the estimate of z at the instant of the last step, (p,); zeros before the first."""
        return np.array(self._output)

    @property
    def innovation(self) -> Array:
        """eps(t_k) = y(t_k) - y^(t_k), (q,), zero where y was missing; zeros before the first step."""
        return np.array(self._innovation)

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """As in `RunningObserver`; NAME_output gives the estimate of z."""
        (n, p, q, m), now, past = self.recursion.sizes, self.recursion.taps[0], self.recursion.taps[1:]
        tables = {"taps": past, "now": now[:, : n + q], "driven": now[:, n + q :], "solve": self._solve}
        tables |= {"free": self._free, "start": self._first, "half": np.array([self.dt / 2.0])}
        sizes = {"starts": n, "estimates": n, "outputs": p, "measurements": q, "inputs": m, "first": n + p}
        sizes |= {"unknowns": n + q, "columns": n + q + m, "rows": n + p + q, "past": len(past)}
        usage = f"{INSTANTS} An instant lasts {self.dt!r} s; obs_output gives the estimate of z."
        return c_file(name, comment, usage, source("delay.c"), sizes, tables)

    def to_statespace(self) -> StateSpace:
        """From u and y to x^ at the same instant, from rest and from a first sample of zero.

        Returns
        -------
        control.StateSpace
            Discrete-time; its states are the past estimates, innovations and inputs, and the derivative.

        Raises
        ------
        InvalidInputError
            dt is so short that there are more than 2000 states.
        """
        (n, _, q, m), (states, _, measured) = self.recursion.sizes, self.recursion.parts
        first, taps = self.recursion.taps[0], np.hstack(list(self.recursion.taps[1:]))
        require_small(n + taps.shape[1])
        whole = np.eye(n + taps.shape[1] + m + q)
        rate, past, u, y = np.split(whole, np.cumsum([n, taps.shape[1], m]))
        known = taps @ past + first[:, n + q :] @ u
        target = past[:n] + self.dt / 2.0 * (rate + known[states])
        now = self._solve @ np.vstack([target, y - known[measured]])
        later = np.vstack([now, u, past])[: len(past)]
        rate = known[states] + first[states, : n + q] @ now
        return single(np.vstack([rate, later]), now[:n], self.dt, self.signals)

    def discretisation_error(self, omega: object) -> Array:
        """How far the recursion is from the observer in continuous time, for sampled sinusoids.

        Parameters
        ----------
        omega : float or array (M,)
            A frequency, or increasing ones, below that of Nyquist, pi / dt, rad/s.

        Returns
        -------
        array (M,)
            Norm of the difference of both responses from y to x^, over that of the exact one.

        Raises
        ------
        InvalidInputError
            Frequencies that are not positive, increasing and below pi / dt.
        """
        grid = increasing_grid("omega", omega, least=1)
        if grid[-1] >= np.pi / self.dt:
            raise InvalidInputError(f"omega must be below pi / dt = {np.pi / self.dt:.6g} rad/s, got {grid[-1]:.6g}")
        exact = exact_response(self._plant, self._injection, grid)
        apart = np.linalg.norm(self.recursion.response(grid) - exact, 2, axis=(1, 2))
        return np.asarray(apart / np.linalg.norm(exact, 2, axis=(1, 2)))

    def _begin(self, start: Array) -> None:
        n, p, q, _ = self.recursion.sizes
        self._state, self._rate, self._output = np.array(start), np.zeros(n), np.zeros(p)
        self._innovation = np.zeros(q)
        self._past[:] = 0.0
        self._past[:, :n] = start  # newest first

    def _advance(self, u: Array, y: Array) -> None:
        n, _, q, _ = self.recursion.sizes
        states, estimated, measured = self.recursion.parts
        now = self.recursion.taps[0]
        known = np.einsum("jab,jb->a", self.recursion.taps[1:], self._past) + now[:, n + q :] @ u
        moves = self.instant > 0
        target = self._state + self.dt / 2.0 * (self._rate + known[states]) if moves else self._state
        free = self._free @ target if moves else self._state
        expected = known[measured] + now[measured, :n] @ free
        y = self._completed(y, expected, np.ones(q, dtype=bool))
        if moves:
            unknowns = self._solve @ np.concatenate([target, y - known[measured]])
        else:
            unknowns = np.concatenate([free, self._first @ (y - expected)])
        rows = known + now[:, : n + q] @ unknowns
        self._state, self._rate, self._output = unknowns[:n], rows[states], rows[estimated]
        self._innovation = unknowns[n:]
        self._past = np.vstack([np.concatenate([unknowns, u])[None], self._past[:-1]])
