"""The observer of a delay plant with gains on the present innovation: its error; and on samples, in Python and C99."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.export import INSTANTS, c_file, source
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.exact.response import (
    GainBracket,
    Response,
    decided,
    error_response,
    gain_bracket,
    mismatched_response,
    norms,
    right_roots,
)
from replication.estimation.delay.exact.terms import (
    Complex,
    Kernel,
    PlantTerms,
    Terms,
    plant_terms,
    projected,
    stacked,
)
from replication.estimation.delay.general.cone import Line, LineForm, moment_plant
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.delay.sos.observer import DelayGains
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import (
    Array,
    StateSpace,
    as_array,
    increasing_grid,
    positive_integer,
    positive_scalar,
)

# An observer of a delay plant on a grid of time: histories linear between samples, the derivative by the trapezoid.
#
# With g = (x^, eps, u) at the instants, (x^', z^, y^)(t_k) = sum_j H_j g(t_{k-j}): delays are interpolated linearly and
# distributed delays integrated exactly over the interpolant. x^ follows by the trapezoidal rule, implicit in x^ and
# eps: stiff gains ask for no short step. It is of second order: in the frequency domain s becomes (2/dt) tanh(s dt/2),
# and a delayed signal its interpolant, both with errors of (w dt)^2.


FINE, SMALL, LONGEST_CIRCLE = 8, 0.8, 2**22
"""Points on the unit circle for each tap; phase between two of them, rad; the most points."""
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
        n, p, q, r = plant.sizes
        self._sizes, self._parts, m = (n, p, q), plant.rows, plant.known.constant.shape[1]
        rows, (x, eps, known) = np.eye(n + p + q), np.split(np.eye(n + q + m), [n, n + q])
        blocks = [(plant.terms, rows, np.pad(x, ((0, r), (0, 0)))), (injection, rows, eps), (plant.known, rows, known)]
        self._terms = stacked(blocks, np.zeros((n + p + q, n + q + m)))
        self._taps = self._terms.weights(self.dt)  # H_0 ... H_{J-1}
        if self._outside() != 0:
            raise InvalidInputError(f"dt = {self.dt:g} s is too long: the recursion is not stable; sample faster")
        self._past = np.zeros((len(self._taps) - 1, n + q + m))
        # What the unknowns x^(t_k), eps(t_k) are multiplied with.
        now = self._taps[0][:, : n + q]
        present = np.eye(n + q) + np.vstack([-self.dt / 2.0 * now[plant.rows[0]], now[plant.rows[2]]])
        self._solve, self._free, self._first = (
            np.linalg.inv(part) for part in (present, present[:n, :n], present[n:, n:])
        )
        super().__init__(n, m, q)

    def _outside(self) -> int | None:
        """Roots of the recursion outside the unit circle, by the argument principle; None if one is next to it."""
        (n, _, q), (states, _, measured) = self._sizes, self._parts
        count = 1 << int(np.ceil(np.log2(FINE * (len(self._taps) + 1))))
        while count <= LONGEST_CIRCLE:
            values = np.fft.fft(self._taps[:, :, : n + q], count, axis=0)
            turn = np.exp(-2j * np.pi * np.arange(count) / count)[:, None, None]
            rows = np.eye(n, n + q) * (1.0 - turn) - self.dt / 2.0 * (1.0 + turn) * values[:, states]
            whole = np.concatenate([rows, values[:, measured] + np.eye(q, n + q, n)], axis=1)
            determinant = np.linalg.slogdet(whole)[0]
            steps = np.angle(np.roll(determinant, -1) / determinant)
            if np.abs(steps).max() <= SMALL:
                return -round(float(steps.sum() / (2.0 * np.pi)))
            count *= 4
        return None

    def _responses(self, omega: Array) -> tuple[Complex, Complex]:
        """From y to x^ at each frequency (M, n, q): of a sampled sinusoid, and what that converges to."""
        turn = np.exp(-1j * omega * self.dt)
        values = np.tensordot(turn[:, None] ** np.arange(len(self._taps)), self._taps, axes=1)
        slope = 2.0 / self.dt * (1.0 - turn) / (1.0 + turn)
        return self._solved(values, slope), self._solved(self._terms.at(1j * omega), 1j * omega)

    def _solved(self, values: Complex, slope: Complex) -> Complex:
        """x^ of y, from the values of (x^', z^, y^) of (x^, eps), and what stands for the derivative."""
        (n, _, q), (states, _, measured) = self._sizes, self._parts
        rows = slope[:, None, None] * np.eye(n, n + q) - values[:, states, : n + q]
        whole = np.concatenate([rows, values[:, measured, : n + q] + np.eye(q, n + q, n)], axis=1)
        return np.asarray(np.linalg.solve(whole, np.broadcast_to(np.eye(n + q)[:, n:], (len(whole), n + q, q)))[:, :n])

    @property
    def estimate(self) -> Array:
        """x^(t_k), (n,)."""
        return np.array(self._past[0, : self.states])

    @property
    def output(self) -> Array:
        """z^(t_k), the estimate of z at the instant of the last step, (p,); zeros before the first."""
        return np.array(self._output)

    @property
    def innovation(self) -> Array:
        """eps(t_k) = y(t_k) - y^(t_k), (q,), zero where y was missing; zeros before the first step."""
        return np.array(self._past[0, self.states : self.states + self.measurements])

    def to_c(self, name: str = "observer", comment: str = "") -> str:
        """As in `RunningObserver`; NAME_output gives the estimate of z."""
        (n, p, q), m, now, past = self._sizes, self.inputs, self._taps[0], self._taps[1:]
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
        (n, _, q), m, (states, _, measured) = self._sizes, self.inputs, self._parts
        first, taps = self._taps[0], np.hstack(list(self._taps[1:]))
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
        grid = increasing_grid("omega", omega)
        if grid[-1] >= np.pi / self.dt:
            raise InvalidInputError(f"omega must be below pi / dt = {np.pi / self.dt:.6g} rad/s, got {grid[-1]:.6g}")
        sampled, exact = self._responses(grid)
        return norms(sampled - exact) / norms(exact)

    def _begin(self, start: Array) -> None:
        n, p, _ = self._sizes
        self._rate, self._output = np.zeros(n), np.zeros(p)
        self._past[:] = 0.0
        self._past[:, :n] = start  # newest first

    def _advance(self, u: Array, y: Array) -> None:
        (n, _, q), (states, estimated, measured) = self._sizes, self._parts
        now, state, moves = self._taps[0], self._past[0, :n], self.instant > 0
        known = np.einsum("jab,jb->a", self._taps[1:], self._past) + now[:, n + q :] @ u
        target = state + self.dt / 2.0 * (self._rate + known[states]) if moves else state
        free = self._free @ target if moves else state
        expected = known[measured] + now[measured, :n] @ free
        y = self._completed(y, expected, np.ones(q, dtype=bool))
        if moves:
            unknowns = self._solve @ np.concatenate([target, y - known[measured]])
        else:
            unknowns = np.concatenate([free, self._first @ (y - expected)])
        rows = known + now[:, : n + q] @ unknowns
        self._rate, self._output = rows[states], rows[estimated]
        self._past = np.vstack([np.concatenate([unknowns, u])[None], self._past[:-1]])


# The observer of a delay plant: gains on the present innovation, as data.
#
# With the plant as lines (`LineForm`), x^ and psi^_i follow
#
#     x^'(t) = [A_0 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_x + L_0 eps(t) + known inputs,
#     d psi^_i / dt = (1/tau_i) d psi^_i / ds + L_i(s) eps(t),    psi^_i(0, t) = E_x,i x^(t),    -1 <= s <= 0,
#     eps(t) = y(t) - [C_2 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_y,
#     z^(t) = [C_10 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_z + L_z eps(t),
#
# so that psi^_i(s, t) = E_x,i x^(t + s tau_i) + integral over 0 <= a <= -s tau_i of L_i(s + a / tau_i) eps(t - a): a
# delay equation for x^ with finite memory of the innovation; no history of y is kept. The errors e = x - x^ and psi_i -
# psi^_i follow the same equations with B w for the known inputs, -L_0 eps, -L_i eps, and psi_i(0) = E_i [e; w]; then
# eps is C_2 e + .. + D_21 w, and the error of z is C_10 e + .. + D_11 w - L_z eps.


@dataclass(frozen=True)
class DelayObserver(DelayGains):
    """The gains of an observer, in the units of the plant.

    Attributes
    ----------
    plant : DelayPlant
        Whose known inputs the observer copies.
    form : LineForm
        The same plant as lines.
    l0 : array (n, q)
        L_0, in 1/s.
    lz : array (p, q)
        L_z.
    kernels : tuple of arrays (c, m, q)
        For each line the Legendre coefficients of the polynomial L_i(s) over -1 <= s <= 0, in 1/s.
    """

    plant: DelayPlant
    form: LineForm
    l0: Array
    lz: Array
    kernels: tuple[Array, ...]

    def kernel(self, line: int, points: Array) -> Array:
        """L_i at points of [-1, 0].

        Parameters
        ----------
        line : int
            i, from zero.
        points : array (M,)
            Points s.

        Returns
        -------
        array (M, m, q)
            In 1/s.
        """
        return Kernel(self.kernels[line])(-points)

    @cached_property
    def terms(self) -> Terms:
        """What the innovation adds to the observer's (x', z, y): gains and, for each line, its kernel over the lags.

        The far end of line i adds tau L(lag - 1); its moment c adds tau times the integral of p_c(s) L(s + lag) over
        -1 <= s <= -lag.
        """
        lines, q = self.form.lines, self.plant.measurements
        constant = np.vstack([self.l0, self.lz, np.zeros((q, q))])
        kernels = tuple(
            Kernel(projected(partial(self._injected, i, line), len(self.kernels[i]) + len(line.moments)))
            for i, line in enumerate(lines)
        )
        return Terms(constant, tuple(line.delay for line in lines), (np.zeros_like(constant),) * len(lines), kernels)

    def _injected(self, i: int, line: Line, lags: Array) -> Array:
        """What the innovation adds by line i at `lags` (M,), as `terms` says; shape (M, n + p + q, q)."""
        total = np.einsum("am,tmq->taq", line.end, self.kernel(i, lags - 1.0))
        if count := len(line.moments):
            nodes, weights = legendre.gauss(len(self.kernels[i]) + count + 1)
            for t, lag in enumerate(lags):
                points = -1.0 + (1.0 - lag) * (nodes + 1.0)
                basis = legendre.evaluate(count, points) * (weights * (1.0 - lag))[:, None]
                total[t] += np.einsum("cam,tc,tmq->aq", line.moments, basis, self.kernel(i, points + lag))
        return np.asarray(line.delay * total)

    @cached_property
    def error(self) -> Response:
        """From w to the error of z, true exponentials."""
        return error_response(plant_terms(self.plant), self.terms)

    def arrays(self, order: int = 0) -> tuple[dict[str, Array], dict[str, str]]:
        """A line that carries nothing has none."""
        gains, axes = {"L0": self.l0, "Lz": self.lz}, {"L0": "(state, measurement)", "Lz": "(output, measurement)"}
        for i, (line, kernel) in enumerate(zip(self.form.lines, self.kernels, strict=True), start=1):
            gains |= {f"L{i}": kernel, f"E{i}": line.carry}
            axes |= {f"L{i}": "(Legendre coefficient, line, measurement)", f"E{i}": "(line, state and disturbance)"}
        return gains, axes

    def error_model(self, order: int) -> Stage:
        """Each line by `order` moments (Legendre-tau method), no fewer than the averages need."""
        plant = moment_plant(self.form, positive_integer("order", order))
        kept = (kernel[:order] for kernel in self.kernels)
        moments = (np.pad(part, ((0, order - len(part)), (0, 0), (0, 0))) for part in kept)
        return plant.error(np.vstack([self.l0, *(part.reshape(-1, part.shape[2]) for part in moments)]), self.lz)

    def gain_at(self, omega: Array, order: int = 0) -> Array:
        """With true exponentials."""
        return self.error.gains(omega)

    def running(self, dt: float, order: int = 0) -> InnovationsObserver:
        """By the trapezoidal rule, of second order in `dt`."""
        return InnovationsObserver(plant_terms(self.plant), self.terms, dt=dt)


@decided
def exact_gain(observer: DelayObserver, relative: float = 1e-6) -> GainBracket:
    """The L2 gain from w to the error of z, delays and kernels exact.

    Parameters
    ----------
    observer : DelayObserver
        What a synthesis gave.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        Both ends, in floating point; the error system is stable.

    Raises
    ------
    InvalidInputError
        `relative` is not positive.
    InfeasibleError
        The error does not die out.
    SolverError
        A root of the error lies on the imaginary axis, or so near that stability stays open.
    """
    positive_scalar("relative", relative)
    return gain_bracket(observer.error, relative)


@decided
def worst_gain(
    observer: DelayObserver, ranges: Sequence[tuple[float, float]] | None = None, relative: float = 1e-3
) -> GainBracket:
    """The largest gain of an observer while the delays of the plant, constant and unknown, lie anywhere in ranges.

    Parameters
    ----------
    observer : DelayObserver
        Made for the nominal delays, which it keeps.
    ranges : sequence of K pairs of floats, optional
        Shortest and longest delay, s; those of the plant unless given.
    relative : float
        Relative width of the bracket that is asked for.

    Returns
    -------
    GainBracket
        The upper end holds for all delays of the ranges, in floating point; the lower end is attained at the delays
        that it names. The upper end is infinite where stability over the ranges stays open.

    Raises
    ------
    InvalidInputError
        `relative` is not positive, or the ranges are no pairs of positive, ordered delays.
    InfeasibleError
        The plant is unstable: with the least error in a delay the estimate does not follow it.
    SolverError
        Stability at the nominal delays stays open, or the plant has a root on the axis, to rounding.

    Notes
    -----
    The ranges and the frequencies are cut into cells. On each the response is its value and slope at the centre, plus a
    remainder that is bounded. An observer that is stable at the nominal delays, and has no root on the axis in any
    cell, is stable for all delays of the ranges.
    """
    plant = plant_terms(observer.plant)
    positive_scalar("relative", relative)
    intervals = observer.plant.ranges if ranges is None else ranges
    ends = as_array("ranges", intervals, (len(plant.terms.delays), 2), axes="(delays, 2)")
    if np.any(ends[:, 0] <= 0.0) or np.any(ends[:, 0] > ends[:, 1]):
        raise InvalidInputError(f"ranges must be pairs (shortest, longest) of positive delays, got {ends.tolist()}")
    roots = right_roots(error_response(plant))[1]
    if roots:
        raise InfeasibleError(
            f"the plant has {roots} unstable roots: with an error in a delay, however small, no estimate follows it; "
            "stabilise the plant, or measure the delays"
        )
    middle = [float(value) for value in ends.mean(axis=1)]
    pairs = [(float(low), float(high)) for low, high in ends]
    response = mismatched_response(plant, observer.terms, middle, pairs)
    gain = gain_bracket(response, relative)
    return replace(gain, delays=gain.delays[: len(pairs)])
