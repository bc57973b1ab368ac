"""What the gains of a delay observer guarantee, as a result: running observer, error system, plot; and of the plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from replication.drawing.panels import Panel
from replication.errors import InfeasibleError, SolverError
from replication.estimation.api.results import Bracket, Evidence, GainResult
from replication.estimation.api.shown import Measures, Shown, Traded
from replication.estimation.delay.exact.response import error_response
from replication.estimation.delay.exact.smoothing import worth
from replication.estimation.delay.exact.terms import plant_terms
from replication.estimation.delay.general.synthesis import OF, Designs, GeneralLevel
from replication.estimation.delay.plant import DelayPlant
from replication.estimation.delay.sos.certificate import Certificate
from replication.estimation.delay.sos.observer import DelayGains, HistoryObserver, spectral_abscissa
from replication.estimation.delay.sos.operators import check, observer_gains
from replication.estimation.linear.norms import GainBracket, continuous_norm
from replication.estimation.linear.periodic import Stage
from replication.estimation.validation import Array, FrozenArrays, StateSpace

BOTH_ENDS = "closed loop with collocated histories; a certificate by sums of squares"
ORDER = 24
"""Points of histories that resolve what gains attain; also how many `design` takes unless told."""
AGREES = 1e-4
"""Relative excess of the gain of the closed loop over the proved level that is left to rounding and discretisation."""
DECADES, FREQUENCIES = 2, 200
"""The plots: decades on both sides of the rate of the longest delay, and points."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayResult(GainResult, Traded):
    """Gains of an observer of a plant with delays.

    Of a plant whose y is free of noise they are L_0 ... L_7 of eq. (9) at `points` of the scaled histories [-1, 0]; of
    one with noise L_0, L_z and, for each delay i, the Legendre coefficients L_i and what the delay carries, E_i.

    Attributes
    ----------
    gains_of : HistoryObserver or DelayObserver
        The gains with the plant.
    order : int
        How finely each delay is resolved in the state-space model of the error.
    proof : Certificate or GeneralLevel or None
        The feasible point of Theorem 3, or the storage function, that proves the level; None for gains of a Riccati
        equation, whose gain is that of the exact closed loop.
    covariance : array (p, p) or None
        Of the error of z for white w of unit intensity; only with the goals h2 and mixed.
    """

    method: str = "delay"
    mean: ClassVar[str] = OF
    quantity: str = "L2 gain from the disturbance w to the estimation error of z"
    gains_of: DelayGains
    order: int
    proof: Certificate | GeneralLevel | None = None
    covariance: Array | None = None

    @property
    def plant(self) -> DelayPlant:
        """The plant for which the level holds."""
        return self.gains_of.plant

    def observer(self, dt: float) -> Any:
        """The observer on measurements sampled every `dt` (s); `step(u, y)` gives the estimate at the same instant."""
        return self.gains_of.running(dt, self.order).named(self.signals)

    def to_statespace(self) -> StateSpace:
        """The estimation error from w to z - z^ in continuous time, each delay resolved by `order`."""
        import control

        outputs = [f"error of {name}" for name in self.signals.outputs]
        return control.StateSpace(*self.gains_of.error_model(self.order), outputs=outputs)

    def panels(self) -> tuple[Panel, ...]:
        """The gain of the error over the frequency, beside the guaranteed level."""
        omega = _frequencies(self.plant)
        curves = {"gain": self.gains_of.gain_at(omega, self.order)}
        return self._panel(np.log10(omega), "frequency, log10 of rad/s", "largest gain to the error", curves)

    def designs(self) -> tuple[float, Callable[[float], Measures]]:
        """Central gains, from one per cent above the least level of any observer on."""
        central = Designs(self.plant, None)
        return central.least(), central.measures


def kept(lower: float, level: float, fault: str, how: str) -> Bracket:
    """The bracket of gains that attain `lower` and prove `level`; raises SolverError if they do not keep it."""
    if lower > level * (1 + AGREES):
        raise SolverError(f"the gains prove the level {level:.6g}, {fault}")
    return Bracket(min(lower, level), level, how)


def made(gains_of: DelayGains, bracket: Bracket, evidence: tuple[Evidence, ...], **fields: Any) -> DelayResult:
    """The result with the gains as arrays."""
    arrays, axes = gains_of.arrays(fields["order"])
    return DelayResult(
        gains_of=gains_of, bracket=bracket, evidence=evidence, gains=FrozenArrays(arrays), axes=axes, **fields
    )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayAnalysis(Shown):
    """What the plant does by itself, and what any observer of it can do.

    Attributes
    ----------
    plant : DelayPlant
        The plant.
    evidence : tuple of Evidence
        Roots, gain, mean square and least level, with how they were found.
    """

    plant: DelayPlant
    evidence: tuple[Evidence, ...]

    def rows(self) -> list[tuple[str, str, str]]:
        """The evidence."""
        return [(fact.what, f"{fact.value} {fact.unit}".strip(), fact.method) for fact in self.evidence]

    def panels(self) -> tuple[Panel, ...]:
        """The exact gain from w to z over the frequency."""
        omega = _frequencies(self.plant)
        terms = plant_terms(self.plant)
        gains = error_response(terms).gains(omega)
        return (Panel(np.log10(omega), "frequency, log10 of rad/s", "gain from w to z", {"gain": gains}, {}),)

    def to_dict(self) -> dict[str, Any]:
        """The evidence as plain values."""
        return {"method": "delay", "evidence": [fact.to_dict() for fact in self.evidence]}


def _frequencies(plant: DelayPlant) -> Array:
    """Frequencies (rad/s) around the rate of the longest delay."""
    return np.asarray(1 / plant.delays[-1] * np.logspace(-DECADES, DECADES, FREQUENCIES))


def result_of(
    system: DelayPlant, certificate: Certificate, facts: tuple[Evidence, ...], *, order: int, **shown: Any
) -> DelayResult:
    """The gains of a certificate, evaluated in the closed loop by a method that shares nothing with the proof."""
    observer, level = HistoryObserver(system, observer_gains(certificate)), certificate.gamma
    fine = max(order, ORDER)
    coarse = order if order < fine else 2 * fine // 3

    def on(points: int, model: Stage) -> GainBracket:
        try:
            return continuous_norm(*model)
        except InfeasibleError as error:
            fault = f"the gains prove the level {level:.6g}, but on {points + 1} points of the histories {error}"
            raise SolverError(f"{fault}; raise `order` or `margin`") from error

    error = observer.error_model(fine)
    norm, on_coarse = on(fine, error), on(coarse, observer.error_model(coarse)).lower
    # As it runs, the observer has `order`; the gains themselves attain what finer grids agree on.
    lower = min(norm.lower, float(observer.gain_at(np.array([norm.angle]), 3 * fine // 2)[0]))
    largest = on_coarse if order == coarse else norm.lower
    fault = f"but on {order + 1} points they have {largest:.6g}; raise `order` or `margin`"
    bracket = replace(kept(max(largest, lower), level, fault, BOTH_ENDS), lower=min(lower, level))
    galerkin, report = check(certificate), certificate.solution.report
    evidence = (
        *facts,
        Evidence("lower end attained at", norm.angle, f"closed loop, {fine + 1} Chebyshev points", "rad/s"),
        Evidence("gain on a coarser grid", on_coarse, f"{coarse + 1} points"),
        Evidence("upper end proved by", f"degree {certificate.degree}, {certificate.rule} rule", "sums of squares"),
        Evidence(
            "residual of the proof", report.residuals["equalities"], f"{report.name} {report.version}, our measure"
        ),
        Evidence("storage, least eigenvalue", galerkin.storage, "Galerkin check; positive"),
        Evidence("dissipation, largest eigenvalue", galerkin.dissipation, "Galerkin check; zero or negative"),
        Evidence("error decays at", -spectral_abscissa(error), "rightmost eigenvalue of the closed loop", "1/s"),
        *worth(plant_terms(system), level),
    )
    return made(observer, bracket, evidence, proof=certificate, order=order, **shown)
