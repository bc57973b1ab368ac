"""What the gains of a delay observer guarantee, as a result: running observer, error system, plot; and of the plant."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from replication.drawing.panels import Panel
from replication.errors import InvalidInputError, SolverError
from replication.estimation.api.plants import Signals
from replication.estimation.api.results import Bracket, Evidence, GainResult
from replication.estimation.api.running import RunningObserver, require_small, single
from replication.estimation.api.shown import Shown
from replication.estimation.delay.exact.loop import error_response, no_injection, plant_terms
from replication.estimation.delay.exact.smoothing import worth
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.observer import ErrorSystem, Trajectory, assembled, error_system, hinf_norm, simulate
from replication.estimation.delay.operators import GainValues, ObserverGains, check, evaluate, observer_gains
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.delay.spectrum import Grid, grid
from replication.estimation.validation import Array, frozen, positive_scalar

if TYPE_CHECKING:
    import control


# The observer (2) run in real time on sampled measurements: its histories on a grid, exact between linear samples.
#
# State xi: x^ and the values of phi^_i at the points of the grid other than 0, as in `observer`. With Y the
# measurements y(t + eta tau_i) at all points, xi' = a xi - G Y, and a = F + G E, where E reads C_2 phi^_i at all
# points.


LONGEST = 1_000_000
"""Measurements that are kept, at the most."""


class RunningDelayObserver(RunningObserver):
    """`step(None, y)` takes y(t_k) every dt seconds and returns x^(t_k), the estimate at the same instant.

    Between two samples y is taken as linear; before the first one as what x^(0) makes it, for all time. A missing
    entry is replaced by what the model without correction expects at t_k.

    Parameters
    ----------
    system : DelayPlant
        The plant.
    gains : ObserverGains
        What `observer_gains` gave.
    dt : float
        Sampling period, s.
    order : int
        Points of each history less one.

    Raises
    ------
    InvalidInputError
        dt is not positive, or so short that more than LONGEST measurements would be kept.
    """

    def __init__(self, system: DelayPlant, gains: ObserverGains, *, dt: float, order: int) -> None:
        self.dt = positive_scalar("dt", dt, unit="s")
        if system.delays[-1] > LONGEST * self.dt:
            raise InvalidInputError(
                f"dt must be at least {system.delays[-1] / LONGEST:.3g} s, got {self.dt:g} s: the observer keeps the "
                "measurements of its longest delay"
            )
        self._system, self._net = system, grid(order)
        values = evaluate(gains, self._net.points)
        a, G, E = assembled(system, values, self._net).a, injection(values, self._net), reading(system, self._net)
        self._step, hold, ramp = _over_step(a, -G, self.dt)
        # Y at the end of the step weighs by the ramp, Y at its start by the rest.
        self._old, self._new = hold - ramp, ramp
        self._free = scipy.linalg.expm((a - G @ E) * self.dt)
        super().__init__(system.states, 0, system.measurements)

    @property
    def estimate(self) -> Array:
        """x^(t_k), (n,)."""
        return np.array(self._state[: self.states])

    def to_statespace(self) -> control.StateSpace:
        """From y to x^ at the same instant, from rest and from a first sample of zero.

        Returns
        -------
        control.StateSpace
            Discrete-time; its states are the histories at the points of the grid, and the past measurements.

        Raises
        ------
        InvalidInputError
            dt is so short that there are more than 2000 states.
        """
        count, q, size = len(self._past), self.measurements, len(self._state)
        require_small(size + count * q)
        whole = np.eye(size + count * q + q)
        state, past, now = np.split(whole, [size, size + count * q])
        samples = np.kron(np.stack([self._between(row) for row in np.eye(count)], axis=-1), np.eye(q))
        later = np.vstack([now, past])[: count * q]
        state = self._step @ state + self._old @ samples @ past + self._new @ samples @ later
        return single(np.vstack([state, later]), state[: self.states], self.dt, self.signals)

    def _begin(self, start: Array) -> None:
        self._state = np.tile(start, 1 + self._system.delay_count * (self._net.points.size - 1))
        length = int(np.ceil(self._system.delays[-1] / self.dt)) + 1
        self._past = np.tile(self._system.c2 @ start, (length, 1))  # newest first

    def _advance(self, u: Array, y: Array) -> None:
        moved = self.instant > 0
        free = (self._free @ self._state if moved else self._state)[: self.states]
        y = self._completed(y, self._system.c2 @ free, np.ones(self.measurements, dtype=bool))
        before = self._histories()
        self._past = np.vstack([y, self._past[:-1]])
        if moved:
            self._state = self._step @ self._state + self._old @ before + self._new @ self._histories()

    def _histories(self) -> Array:
        """Y: y(t + eta tau_i) at all points of all histories, interpolated, in the order of `reading`."""
        return np.stack([self._between(column) for column in self._past.T], axis=-1).ravel()

    def _between(self, column: Array) -> Array:
        """One measurement at all points of all histories, from its samples, newest first."""
        ages = -self._net.points[None, :] * np.array(self._system.delays)[:, None] / self.dt
        return np.asarray(np.interp(ages.ravel(), np.arange(len(column)), column))


def injection(values: GainValues, net: Grid) -> Array:
    """G (size, K M q): what the differences of all measured histories add to the derivative of xi."""
    count = net.points.size
    k, _, q = values.l2.shape
    every = np.eye(k * count * q).reshape(k, count, q, -1)
    now, late, weighted = every[0, 0], every[:, -1], net.weights[None, :, None, None] * every
    first = values.l0 @ now + np.einsum("kiq,kqs->is", values.l2, late)
    first = first + np.einsum("tkiq,ktqs->is", values.l3, weighted)
    rates = np.einsum("tkiq,qs->ktis", values.l4, now) + np.einsum("tkliq,lqs->ktis", values.l5, late)
    rates = rates + np.einsum("tkiq,ktqs->ktis", values.l6, every)
    rates = rates + np.einsum("tkuliq,luqs->ktis", values.l7, weighted, optimize=True)
    return np.vstack([first, rates[:, 1:].reshape(-1, every.shape[-1])])


def reading(system: DelayPlant, net: Grid) -> Array:
    """E (K M q, size): C_2 phi_i at all points, history by history; point 0 of each is C_2 x."""
    n, k, inner = system.states, system.delay_count, net.points.size - 1
    rows = np.zeros((k, inner + 1, system.measurements, n * (1 + k * inner)))
    rows[:, 0, :, :n] = system.c2
    for i in range(k):
        for t in range(inner):
            start = n * (1 + i * inner + t)
            rows[i, t + 1, :, start : start + n] = system.c2
    return rows.reshape(-1, rows.shape[-1])


def _over_step(a: Array, b: Array, dt: float) -> tuple[Array, Array, Array]:
    """e^{a dt}, and the effect of an input b v with v constant, and with v growing from 0 to 1 over the step."""
    n = len(a)
    whole = np.zeros((3 * n, 3 * n))
    whole[:n, :n], whole[:n, n : 2 * n], whole[n : 2 * n, 2 * n :] = a, np.eye(n), np.eye(n) / dt
    power = scipy.linalg.expm(whole * dt)
    return power[:n, :n], power[:n, n : 2 * n] @ b, power[:n, 2 * n :] @ b


BOTH_ENDS = "closed loop with collocated histories; a certificate by sums of squares"
AGREES = 1e-4
"""Relative excess of the gain of the discretised closed loop over the proved level that is left to discretisation."""
DECADES, FREQUENCIES = 2, 200
"""The plots: decades on both sides of the rate of the longest delay, and points."""
AXES = {
    "points": "(point)",
    "L0": "(state, measurement)",
    "L2": "(delay, state, measurement)",
    "L3": "(point, delay, state, measurement)",
    "L4": "(point, delay, state, measurement)",
    "L5": "(point, delay, delay of y, state, measurement)",
    "L6": "(point, delay, state, measurement)",
    "L7": "(point, delay, point of y, delay of y, state, measurement)",
}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayDesign(GainResult):
    """Gains of an observer of a plant with delays; hooks: `error_model`, `gain_at` and `trajectory`.

    Attributes
    ----------
    order : int
        How finely each delay is resolved in the state-space model of the error.
    """

    method: str = "delay"
    quantity: str = "L2 gain from the disturbance w to the estimation error of z"
    order: int

    @abstractmethod
    def error_model(self) -> tuple[ErrorSystem, Array]:
        """The error of the estimate without delays, and its direct part (p, r)."""

    @abstractmethod
    def gain_at(self, omega: Array) -> Array:
        """The largest gain from w to the error of z at frequencies (M,), rad/s."""

    @abstractmethod
    def trajectory(self, times: Any, disturbance: Any) -> Trajectory:
        """The error from rest, as in `simulate`."""

    @property
    @abstractmethod
    def rate(self) -> float:
        """The rate of the longest delay, 1/s."""

    def to_statespace(self) -> control.StateSpace:
        """The estimation error from w to z - z^ in continuous time, each delay resolved by `order`."""
        import control

        error, direct = self.error_model()
        outputs = [f"error of {name}" for name in self.signals.outputs]
        return control.StateSpace(error.a, error.b, error.c, direct, outputs=outputs)

    def panels(self) -> tuple[Panel, ...]:
        """The gain of the error over the frequency, beside the guaranteed level."""
        omega = _frequencies(self.rate)
        curves = {"gain": self.gain_at(omega)}
        return self._panel(np.log10(omega), "frequency, log10 of rad/s", "largest gain to the error", curves)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayResult(DelayDesign):
    """The gains L_0 ... L_7 of eq. (9) at `points` of the scaled histories [-1, 0].

    Attributes
    ----------
    plant : DelayPlant
        The plant for which the level holds.
    certificate : Certificate
        The feasible point of Theorem 3 that proves it.
    operators : ObserverGains
        The operators of which the gains are values.
    """

    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    plant: DelayPlant
    certificate: Certificate
    operators: ObserverGains

    def observer(self, dt: float) -> RunningDelayObserver:
        """The observer on measurements sampled every `dt` (s); `step` gives the estimate at the same instant."""
        return RunningDelayObserver(self.plant, self.operators, dt=dt, order=self.order).named(self.signals)

    def error_model(self) -> tuple[ErrorSystem, Array]:
        """Histories collocated at `order` + 1 points."""
        error = error_system(self.plant, self.operators, self.order)
        return error, np.zeros((len(error.c), error.b.shape[1]))

    def gain_at(self, omega: Array) -> Array:
        """Of the collocated error."""
        error, _ = self.error_model()
        eye = np.eye(len(error.a))
        return np.array([np.linalg.norm(error.c @ np.linalg.solve(1j * w * eye - error.a, error.b), 2) for w in omega])

    def trajectory(self, times: Any, disturbance: Any) -> Trajectory:
        """Of the collocated error; exact for it."""
        return simulate(self.error_model()[0], times, disturbance, self.plant.states)

    @property
    def rate(self) -> float:
        """The rate of the longest delay, 1/s."""
        return 1 / self.plant.delays[-1]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayAnalysis(Shown):
    """What the plant does by itself: its rightmost root, and the gain from w to z if it is stable.

    Attributes
    ----------
    plant : DelayPlant
        The plant.
    evidence : tuple of Evidence
        Root (1/s) and gain, with how they were found.
    """

    plant: DelayPlant
    evidence: tuple[Evidence, ...]

    def rows(self) -> list[tuple[str, str, str]]:
        """The evidence."""
        return [(fact.what, f"{fact.value} {fact.unit}".strip(), fact.method) for fact in self.evidence]

    def panels(self) -> tuple[Panel, ...]:
        """The exact gain from w to z over the frequency."""
        omega = _frequencies(1 / self.plant.delays[-1])
        terms = plant_terms(self.plant)
        gains = error_response(terms, no_injection(terms)).gains(omega)
        return (Panel(np.log10(omega), "frequency, log10 of rad/s", "gain from w to z", {"gain": gains}, {}),)

    def to_dict(self) -> dict[str, Any]:
        """The evidence as plain values."""
        return {"method": "delay", "evidence": [fact.to_dict() for fact in self.evidence]}


def _frequencies(rate: float) -> Array:
    """Frequencies (rad/s) around a rate."""
    return np.asarray(rate * np.logspace(-DECADES, DECADES, FREQUENCIES))


def result_of(
    system: DelayPlant, signals: Signals, certificate: Certificate, facts: tuple[Evidence, ...], order: int
) -> DelayResult:
    """The gains of a certificate, evaluated in the closed loop by a method that shares nothing with the proof."""
    operators = observer_gains(certificate)
    norm = hinf_norm(error_system(system, operators, order))
    if norm.lower > certificate.gamma * (1 + AGREES):
        raise SolverError(
            f"the gains prove the level {certificate.gamma:.6g}, but on {order + 1} points they have {norm.lower:.6g}; "
            "raise `order` or `margin`"
        )
    coarse = hinf_norm(error_system(system, operators, max(2 * order // 3, 1)))
    points = grid(order).points
    values = evaluate(operators, points)
    galerkin, report = check(certificate), certificate.solution.report
    evidence = (
        *facts,
        Evidence("lower end attained at", norm.frequency, f"closed loop, {order + 1} Chebyshev points", "rad/s"),
        Evidence("gain on a coarser grid", coarse.lower, f"{max(2 * order // 3, 1) + 1} points"),
        Evidence("upper end proved by", f"degree {certificate.degree}, {certificate.rule} rule", "sums of squares"),
        Evidence(
            "residual of the proof", report.residuals["equalities"], f"{report.name} {report.version}, our measure"
        ),
        Evidence("storage, least eigenvalue", galerkin.storage, "Galerkin check; positive"),
        Evidence("dissipation, largest eigenvalue", galerkin.dissipation, "Galerkin check; zero or negative"),
        Evidence("error decays at", -norm.abscissa, "rightmost eigenvalue of the closed loop", "1/s"),
        *worth(plant_terms(system), certificate.gamma),
    )
    arrays = {"points": points} | {f"L{i}": getattr(values, f"l{i}") for i in (0, 2, 3, 4, 5, 6, 7)}
    return DelayResult(
        bracket=Bracket(min(norm.lower, certificate.gamma), certificate.gamma, BOTH_ENDS),
        gains=frozen(arrays),
        evidence=evidence,
        signals=signals,
        plant=system,
        certificate=certificate,
        operators=operators,
        order=order,
    )
