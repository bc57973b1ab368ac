"""What the gains of a delay observer guarantee, as a result: running observer, error system, plot; and of the plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import SolverError
from replication.estimation.api.plants import Signals
from replication.estimation.api.results import Bracket, Evidence, GainResult
from replication.estimation.api.shown import Shown
from replication.estimation.delay.collocation import grid
from replication.estimation.delay.exact.forms import plant_terms
from replication.estimation.delay.exact.worth import worth
from replication.estimation.delay.observer import error_system
from replication.estimation.delay.operators.gains import ObserverGains, evaluate, observer_gains
from replication.estimation.delay.operators.galerkin import check
from replication.estimation.delay.response import hinf_norm
from replication.estimation.delay.running import RunningDelayObserver
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.delay.spectrum import frequency_response
from replication.estimation.delay.system import DelaySystem
from replication.estimation.validation import Array, frozen

if TYPE_CHECKING:
    import control

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
class DelayResult(GainResult):
    """The gains L_0 ... L_7 of eq. (9) at `points` of the scaled histories [-1, 0].

    Attributes
    ----------
    system : DelaySystem
        The plant for which the level holds.
    certificate : Certificate
        The feasible point of Theorem 3 that proves it.
    operators : ObserverGains
        The operators of which the gains are values.
    order : int
        Points of each history less one.
    """

    method: str = "delay"
    quantity: str = "L2 gain from the disturbance w to the estimation error of z"
    axes: Mapping[str, str] = field(default_factory=AXES.copy)
    system: DelaySystem
    certificate: Certificate
    operators: ObserverGains
    order: int

    def observer(self, dt: float) -> RunningDelayObserver:
        """The observer on sampled measurements, to run in a loop.

        Parameters
        ----------
        dt : float
            Sampling period of the measurements, s.

        Returns
        -------
        RunningDelayObserver
            Its `step` returns the estimate at the same instant.
        """
        return RunningDelayObserver(self.system, self.operators, dt=dt, order=self.order).named(self.signals)

    def to_statespace(self) -> control.StateSpace:
        """The estimation error from w to z^ - z, histories collocated at `order` + 1 points.

        Returns
        -------
        control.StateSpace
            Continuous-time, without feedthrough.
        """
        import control

        error = error_system(self.system, self.operators, self.order)
        feedthrough = np.zeros((len(error.c), error.b.shape[1]))
        outputs = [f"error of {name}" for name in self.signals.outputs]
        return control.StateSpace(error.a, error.b, error.c, feedthrough, outputs=outputs)

    def estimator(self, dt: float) -> control.StateSpace:
        """The observer on sampled measurements, as `observer(dt)` runs, from known inputs and y to x^.

        Parameters
        ----------
        dt : float
            Sampling period of the measurements, s.

        Returns
        -------
        control.StateSpace
            Discrete-time; its states are what the observer remembers. It starts from rest with a first sample of zero.
        """
        return self.observer(dt).to_statespace()

    def panels(self) -> tuple[Panel, ...]:
        """The gain of the error over the frequency, beside the guaranteed level."""
        error, omega = error_system(self.system, self.operators, self.order), _frequencies(self.system)
        eye = np.eye(len(error.a))
        gains = [np.linalg.norm(error.c @ np.linalg.solve(1j * w * eye - error.a, error.b), 2) for w in omega]
        curves = {"gain": np.array(gains)}
        return self._panel(np.log10(omega), "frequency, log10 of rad/s", "largest gain to the error", curves)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayAnalysis(Shown):
    """What the plant does by itself: its rightmost root, and the gain from w to z if it is stable.

    Attributes
    ----------
    system : DelaySystem
        The plant.
    evidence : tuple of Evidence
        Root (1/s) and gain, with how they were found.
    """

    system: DelaySystem
    evidence: tuple[Evidence, ...]

    def rows(self) -> list[tuple[str, str, str]]:
        """The evidence."""
        return [(fact.what, f"{fact.value} {fact.unit}".strip(), fact.method) for fact in self.evidence]

    def panels(self) -> tuple[Panel, ...]:
        """The exact gain from w to z over the frequency."""
        omega = _frequencies(self.system)
        gains = np.linalg.norm(frequency_response(self.system, omega), 2, axis=(1, 2))
        return (Panel(np.log10(omega), "frequency, log10 of rad/s", "gain from w to z", {"gain": gains}, {}),)

    def to_dict(self) -> dict[str, Any]:
        """The evidence as plain values."""
        return {"method": "delay", "evidence": [fact.to_dict() for fact in self.evidence]}


def _frequencies(system: DelaySystem) -> Array:
    """Frequencies (rad/s) around the rate of the longest delay."""
    return np.asarray(1 / system.delays[-1] * np.logspace(-DECADES, DECADES, FREQUENCIES))


def result_of(
    system: DelaySystem, signals: Signals, certificate: Certificate, facts: tuple[Evidence, ...], order: int
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
        system=system,
        certificate=certificate,
        operators=operators,
        order=order,
    )
