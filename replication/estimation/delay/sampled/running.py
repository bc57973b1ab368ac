"""The observer of a delay plant as it runs: one step for each sample, in Python and as C99."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.delay.exact.forms import injection_terms, plant_terms
from replication.estimation.delay.exact.terms import PlantTerms, Terms
from replication.estimation.delay.general.observer import DelayObserver
from replication.estimation.delay.response import Trajectory, equidistant
from replication.estimation.delay.sampled.c_form import c_form
from replication.estimation.delay.sampled.recursion import SampledObserver, exact_response, sampled
from replication.estimation.validation import Array, increasing_grid, positive_scalar

if TYPE_CHECKING:
    import control

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
        self._solve = np.linalg.inv(self.recursion.present())
        self._free = np.linalg.inv(self.recursion.present()[:n, :n])
        self._first = np.linalg.inv(self.recursion.present()[n:, n:])
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
        return c_form(name, comment, self.recursion)

    def to_statespace(self) -> control.StateSpace:
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
        found = self._solve @ np.vstack([target, y - known[measured]])
        later = np.vstack([found, u, past])[: len(past)]
        rate = known[states] + first[states, : n + q] @ found
        return single(np.vstack([rate, later]), found[:n], self.dt, self.signals)

    def discretisation_error(self, omega: object) -> Array:
        """How far the recursion is from the observer in continuous time, for sampled sinusoids.

        Parameters
        ----------
        omega : array (M,)
            Increasing frequencies below that of Nyquist, pi / dt, rad/s.

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
            found = self._solve @ np.concatenate([target, y - known[measured]])
        else:
            found = np.concatenate([free, self._first @ (y - expected)])
        rows = known + now[:, : n + q] @ found
        self._state, self._rate, self._output = found[:n], rows[states], rows[estimated]
        self._innovation = found[n:]
        self._past = np.vstack([np.concatenate([found, u])[None], self._past[:-1]])


def running(observer: DelayObserver, dt: float) -> InnovationsObserver:
    """A designed observer, ready to run on samples.

    Parameters
    ----------
    observer : DelayObserver
        What a synthesis gave.
    dt : float
        Sampling period, s.

    Returns
    -------
    InnovationsObserver
        At instant 0.

    Raises
    ------
    InvalidInputError
        As `InnovationsObserver`.
    """
    return InnovationsObserver(plant_terms(observer.plant), injection_terms(observer), dt=dt)


def simulate_error(observer: DelayObserver, times: object, disturbance: object) -> Trajectory:
    """The error of an observer from rest, by the same recursion: of second order in the step.

    Parameters
    ----------
    observer : DelayObserver
        What a synthesis gave.
    times : array (M,)
        Equidistant instants, s.
    disturbance : array (M, r)
        w at these instants, linear between them.

    Returns
    -------
    Trajectory
        The errors of z and x beside w; its `gain` tends to a lower bound of the exact gain.

    Raises
    ------
    InvalidInputError
        Another shape, unequal steps, a disturbance that is zero, or steps that are too long.
    """
    instants, w, dt = equidistant(times, disturbance, observer.plant.inputs)
    plant = plant_terms(observer.plant)
    n, _, q, _ = plant.sizes
    # An observer that measures y = 0 and is told -w as if it were known estimates -e.
    rows, columns = np.eye(len(plant.terms.constant)), np.eye(plant.terms.constant.shape[1])
    told = replace(plant, known=plant.terms.applied(-rows, columns[:, plant.columns[1]]))
    copy = InnovationsObserver(told, injection_terms(observer), dt=dt)
    output, state = np.zeros((len(w), plant.sizes[1])), np.zeros((len(w), n))
    for k, value in enumerate(w):
        state[k] = -copy.step(value, np.zeros(q))
        output[k] = -copy.output
    return Trajectory(instants, w, output, state)
