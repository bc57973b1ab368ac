"""Observers for systems with state delays, for a plant of one's own: `design`, `analyse`, `simulate` (Peet and Gu).

x'(t) = A_0 x(t) + sum_i A_i x(t - tau_i) + B w(t); z is to be estimated from y = C_2 x, which is free of noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.api.results import (
    Bracket,
    Evidence,
    GainResult,
    Panel,
    Shown,
    Simulation,
    frozen,
    require_result,
)
from replication.estimation.api.signals import Signals, is_statespace, numbered, split_outputs
from replication.estimation.delay.collocation import grid
from replication.estimation.delay.observer import error_system
from replication.estimation.delay.operators.gains import ObserverGains, evaluate, observer_gains
from replication.estimation.delay.operators.galerkin import check
from replication.estimation.delay.response import hinf_norm
from replication.estimation.delay.response import simulate as simulate_error
from replication.estimation.delay.running import RunningDelayObserver
from replication.estimation.delay.sos.certificate import Certificate, certificate_at
from replication.estimation.delay.sos.cone import DegreeRule
from replication.estimation.delay.sos.least_gain import LeastGain, minimum_gain
from replication.estimation.delay.sos.synthesis import degree_for
from replication.estimation.delay.spectrum import frequency_response, hinf_gain, rightmost_roots
from replication.estimation.delay.system import DelaySystem, delay_system
from replication.estimation.dualrate.arguments import one_of
from replication.estimation.validation import at_most, positive_scalar

if TYPE_CHECKING:
    import control

QUANTITY = "L2 gain from the disturbance w to the estimation error of z"
BOTH_ENDS = "closed loop with collocated histories; a certificate by sums of squares"
HIGHEST, FINEST = 12, 200
"""Degree and order beyond which programs and closed loops do not end, or rounding decides them."""
MARGIN, ORDER = 0.05, 24
"""Relative distance from the optimum, whose gains have no bound; points of histories."""
AGREES = 1e-4
"""Relative excess of the gain of the discretised closed loop over the proved level that is left to discretisation."""
DECADES, FREQUENCIES = 2, 200
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
    """The gains L_0 ... L_7 at `points` of the scaled histories [-1, 0], with the operators and the certificate."""

    system: DelaySystem
    certificate: Certificate
    operators: ObserverGains
    order: int

    def observer(self, dt: float) -> RunningDelayObserver:
        """The observer on measurements every dt seconds; see `RunningDelayObserver`."""
        return RunningDelayObserver(self.system, self.operators, dt=dt, order=self.order)

    def to_statespace(self) -> control.StateSpace:
        """The estimation error from w to z^ - z as a continuous-time system, histories collocated at `order` + 1
        points."""
        import control

        error = error_system(self.system, self.operators, self.order)
        feedthrough = np.zeros((len(error.c), error.b.shape[1]))
        outputs = [f"error of {name}" for name in self.signals.outputs]
        return control.StateSpace(error.a, error.b, error.c, feedthrough, outputs=outputs)

    def panels(self) -> tuple[Panel, ...]:
        """The gain of the error over the frequency, beside the guaranteed level."""
        error = error_system(self.system, self.operators, self.order)
        rate = 1 / self.system.delays[-1]
        omega = rate * np.logspace(-DECADES, DECADES, FREQUENCIES)
        eye = np.eye(len(error.a))
        gains = [np.linalg.norm(error.c @ np.linalg.solve(1j * w * eye - error.a, error.b), 2) for w in omega]
        return (
            Panel(
                np.log10(omega),
                "frequency, log10 of rad/s",
                "largest gain to the error",
                {"gain": np.array(gains)},
                {"guaranteed level": self.value},
            ),
        )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DelayAnalysis(Shown):
    """What the plant does by itself: its rightmost roots (1/s), and the gain from w to z if it is stable."""

    system: DelaySystem
    evidence: tuple[Evidence, ...]

    def rows(self) -> list[tuple[str, str, str]]:
        """The evidence."""
        return [(fact.what, f"{fact.value} {fact.unit}".strip(), fact.method) for fact in self.evidence]

    def panels(self) -> tuple[Panel, ...]:
        """The exact gain from w to z over the frequency."""
        omega = np.logspace(-DECADES, DECADES, FREQUENCIES) / self.system.delays[-1]
        gains = np.linalg.norm(frequency_response(self.system, omega), 2, axis=(1, 2))
        return (Panel(np.log10(omega), "frequency, log10 of rad/s", "gain from w to z", {"gain": gains}, {}),)

    def to_dict(self) -> dict[str, Any]:
        """The evidence as plain values."""
        facts = [
            {"what": fact.what, "value": fact.value, "unit": fact.unit, "method": fact.method} for fact in self.evidence
        ]
        return {"method": "delay", "evidence": facts}


def design(
    plant: DelaySystem | control.StateSpace,
    *,
    degree: int | None = None,
    rule: DegreeRule | str = DegreeRule.BESSEL,
    margin: float = MARGIN,
    level: float | None = None,
    order: int = ORDER,
    delayed: Sequence[Any] | None = None,
    delays: Sequence[float] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> DelayResult:
    """An observer whose level is `margin` above the least that polynomials of `degree` prove, or is `level`.

    plant: a `delay_system(...)`, or the delay-free part as a continuous-time `control.StateSpace` with inputs w and
    outputs y and z; the latter with delayed: A_1 ... A_K; delays: tau_1 < ... < tau_K in seconds; measured: how many of
    the first outputs are y, or which ones. degree: unless given, 3 or less for a large plant, whose cost grows
    steeply with it; the evidence names it. rule: see `DegreeRule`. order: histories are evaluated at order + 1 points.
    Raises InvalidInputError for what does not fit or an undetectable plant, InfeasibleError if no level is found,
    SolverError if the solver does not settle or the gains do not keep what was proved.

    >>> from replication.estimation.delay import delay_system
    >>> eye = [[1, 0], [0, 1]]
    >>> tanks = delay_system([[-1, 0.2], [0.5, -2]], [[[0, 0], [0.5, 0.2]]], [0.4], eye, eye, [[1, 0]])
    >>> best = design(tanks)
    >>> 0 < best.bracket.lower <= best.value
    True
    """
    system, signals = _plant(plant, delayed, delays, measured)
    rule = one_of(DegreeRule, rule)
    degree = degree_for(system, rule) if degree is None else at_most("degree", degree, HIGHEST)
    order = at_most("order", order, FINEST)
    if level is None:
        least = _minimum(system, degree, rule)
        target = least.gamma * (1 + positive_scalar("margin", margin))
        how = f"degree {degree} of the {rule} rule, {least.solution.report.name} {least.solution.report.version}"
        facts: tuple[Evidence, ...] = (Evidence("least level", least.gamma, how),)
    else:
        target, facts = positive_scalar("level", level), ()
    return _result(system, signals, certificate_at(system, target, degree, rule), facts, order)


def analyse(
    plant: DelaySystem | control.StateSpace,
    *,
    delayed: Sequence[Any] | None = None,
    delays: Sequence[float] | None = None,
    measured: int | Sequence[int | str] | None = None,
) -> DelayAnalysis:
    """The plant without an observer: roots, and how much w moves z; the arguments as in `design`."""
    system, _ = _plant(plant, delayed, delays, measured)
    root = complex(rightmost_roots(system, 1)[0])
    facts = [Evidence("rightmost root", f"{root:.6g}", "collocation, refined by Newton's method", "1/s")]
    if root.real < 0:
        gain = hinf_gain(system)
        facts.append(Evidence("gain from w to z", gain.upper, "upper bound over all frequencies, exact response"))
    else:
        facts.append(Evidence("gain from w to z", "infinite", "the plant is not stable"))
    return DelayAnalysis(system=system, evidence=tuple(facts))


def simulate(result: DelayResult, times: Any, disturbance: Any) -> Simulation:
    """The estimation error from rest for w (M, r), linear between the equidistant `times` (M,) in seconds.

    Raises InvalidInputError for other shapes, unequal steps or a disturbance that is zero.
    """
    require_result(result, DelayResult)
    error = error_system(result.system, result.operators, result.order)
    found = simulate_error(error, times, disturbance, result.system.states)
    return Simulation(
        method="delay",
        time=found.times,
        time_label="time (s)",
        signals=frozen({"error of z": found.output, "error of x": found.state, "disturbance": found.disturbance}),
        ratio=found.gain,
        steps=False,
    )


def _minimum(system: DelaySystem, degree: int, rule: DegreeRule) -> LeastGain:
    """`minimum_gain`, refused where the optimum may be zero: measurements without noise may reveal w."""
    rank = np.linalg.matrix_rank(system.c2 @ system.b)
    advice = (
        f"y has no noise and may reveal w here ({system.inputs} disturbances, {system.measurements} measurements, "
        f"C_2 B of rank {rank}); let more disturbances act on the measured states, or ask for a `level`"
    )
    try:
        least = minimum_gain(system, degree, rule)
    except (InfeasibleError, SolverError) as error:
        if system.inputs > rank == system.measurements:
            raise
        raise type(error)(f"{error}; {advice}") from error
    if least.lower <= 0.0:
        raise InfeasibleError(f"the least level cannot be told from zero (found {least.gamma:.3g}): {advice}")
    return least


def _plant(
    plant: DelaySystem | control.StateSpace,
    delayed: Sequence[Any] | None,
    delays: Sequence[float] | None,
    measured: int | Sequence[int | str] | None,
) -> tuple[DelaySystem, Signals]:
    if isinstance(plant, DelaySystem):
        if delayed is not None or delays is not None or measured is not None:
            raise InvalidInputError("delayed, delays and measured belong to a control.StateSpace")
        states, outputs = numbered("x", plant.states), numbered("z", plant.outputs)
        return plant, Signals(states, (), numbered("y", plant.measurements), outputs)
    if not is_statespace(plant):
        raise InvalidInputError(
            f"plant must be a delay_system(...) or a control.StateSpace, got {type(plant).__name__}"
        )
    if delayed is None or delays is None or measured is None:
        raise InvalidInputError("a control.StateSpace needs delayed=[A_1, ..], delays=[tau_1, ..] and measured=..")
    if not plant.isctime(strict=True) or np.any(plant.D):
        raise InvalidInputError(
            f"the plant must be continuous-time without feedthrough, got dt = {plant.dt}, D = {plant.D.tolist()}"
        )
    seen, others = split_outputs(plant, measured)
    labels = plant.output_labels
    signals = Signals(tuple(plant.state_labels), (), tuple(labels[i] for i in seen), tuple(labels[i] for i in others))
    return delay_system(plant.A, delayed, delays, plant.B, plant.C[others], plant.C[seen]), signals


def _result(
    system: DelaySystem, signals: Signals, certificate: Certificate, facts: tuple[Evidence, ...], order: int
) -> DelayResult:
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
    )
    arrays = {"points": points} | {f"L{i}": getattr(values, f"l{i}") for i in (0, 2, 3, 4, 5, 6, 7)}
    return DelayResult(
        method="delay",
        quantity=QUANTITY,
        bracket=Bracket(min(norm.lower, certificate.gamma), certificate.gamma, BOTH_ENDS),
        gains=frozen(arrays),
        axes=AXES,
        evidence=evidence,
        signals=signals,
        system=system,
        certificate=certificate,
        operators=operators,
        order=order,
    )
