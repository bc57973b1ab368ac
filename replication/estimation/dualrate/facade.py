"""Dual-rate output feedback for a plant of one's own: `design`, `analyse`, `compare`, `simulate`.

The input changes every period T, the sensor delivers every M T. The observer fills the instants between; which one
does so is a choice (`observer`, one of `OBSERVERS`). u = K x^, and L corrects the observer's differential equation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from replication.drawing.panel import Panel
from replication.errors import InfeasibleError, InvalidInputError
from replication.estimation.api.results import (
    EXACT_GAIN,
    Bracket,
    Evidence,
    GainResult,
    Simulation,
    frozen,
    require_result,
)
from replication.estimation.api.running import PeriodicObserver, Phase
from replication.estimation.api.signals import Signals, numbered
from replication.estimation.dualrate.loop import (
    MARGINAL,
    DualRateLoop,
    close_loop,
    lifted_system,
    noise_gain,
    require_stable,
    stability_radius,
)
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, Plant, as_plant, dual_rate_design
from replication.estimation.dualrate.response import time_response
from replication.estimation.dualrate.sampled import sampled_model
from replication.estimation.linear.norms import l2_gain, response_norm
from replication.estimation.linear.periodic import PeriodicSystem, Stage
from replication.estimation.validation import as_matrix

if TYPE_CHECKING:
    import control

QUANTITY = "root-mean-square gain of the closed loop from sensor noise to the plant output at the fast instants"
DEFAULT_OBSERVER = "running_prediction"
"""The repaired predictor: between measurements it carries on from the last one."""
ANGLES = 200
SUBSTEPS = 10
"""Points of a time response per fast period."""
SEMIDEFINITE = 1e-12
"""Negative eigenvalues of a weight up to so much of the largest are rounding."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class DualRateResult(GainResult):
    """Gains K (input, state) and L (state, output) in a closed loop with one observer."""

    loop: DualRateLoop
    observer_name: str
    discrete_gain: bool

    def observer(self) -> PeriodicObserver:
        """x^(k) at the fast instants; the measurement is looked at every M-th instant only. Use u(k) = K x^(k)."""
        problem = self.loop.design
        built = OBSERVERS[self.observer_name](sampled_model(problem, discrete_gain=self.discrete_gain))
        every = self.observer_name == "fast_sensor"
        count = len(problem.model.output)
        phases = [
            Phase(s.transition, s.input, s.injection, s.readout, np.full(count, every or k == 0))
            for k, s in enumerate(built.steps)
        ]
        return PeriodicObserver(phases, problem.model.output)

    def to_statespace(self) -> control.StateSpace:
        """The closed loop over one slow period M T, from sensor noise to the plant outputs at the M fast instants."""
        lifted = lifted_system(self.loop)
        instants = range(self.loop.design.ratio)
        noise = [f"noise of {name}" for name in self.signals.measurements]
        if lifted.ninputs != len(noise):
            noise = [f"{name}@{k}" for k in instants for name in noise]
        lifted.set_inputs(noise)
        lifted.set_outputs([f"{name}@{k}" for k in instants for name in self.signals.measurements])
        return lifted

    def panels(self) -> tuple[Panel, ...]:
        """The gain from noise to output over the frequency, with its supremum."""
        angles = np.linspace(0.0, np.pi, ANGLES)
        norm = response_norm(_noise_to_output(self.loop))
        gains = np.array([norm(float(angle)) for angle in angles])
        frequency = angles / self.loop.design.slow_period
        label = "frequency (rad/s, folded at the slow period)"
        return (
            Panel(frequency, label, "largest gain to the output", {"gain": gains}, {"guaranteed level": self.value}),
        )


def design(
    plant: Plant | control.StateSpace,
    *,
    period: float,
    ratio: int,
    observer: str = DEFAULT_OBSERVER,
    state_weight: Any = None,
    input_weight: Any = None,
    process_noise: Any = None,
    sensor_noise: Any = None,
) -> DualRateResult:
    """A loop with the linear-quadratic K and the stationary Kalman gain L of the continuous-time plant.

    plant: a strictly proper continuous-time `control.StateSpace`, or `make_plant(A, B, C)`; period T in seconds; ratio
    M; observer: one of `OBSERVERS`. K minimises the integral of x'Qx + u'Ru, Q = state_weight (C'C unless given),
    R = input_weight (identity); L is the Kalman gain for noise of intensities process_noise (n, n) (BB') and
    sensor_noise (p, p) (identity). The loop that these gains make at the two rates is then analysed exactly. Raises
    InvalidInputError for what does not fit, InfeasibleError if there are no such gains or the loop is unstable.

    >>> from replication.estimation.dualrate import make_plant
    >>> servo = make_plant([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])
    >>> loop = design(servo, period=0.01, ratio=20)
    >>> loop.fact("monodromy radius").value < 1
    True
    """
    model = as_plant(plant)
    A, B, C = model.state, model.input, model.output
    Q = C.T @ C if state_weight is None else _symmetric("state_weight", state_weight, len(A))
    R = np.eye(B.shape[1]) if input_weight is None else _definite("input_weight", input_weight, B.shape[1])
    W = B @ B.T if process_noise is None else _symmetric("process_noise", process_noise, len(A))
    V = np.eye(len(C)) if sensor_noise is None else _definite("sensor_noise", sensor_noise, len(C))
    K = -np.linalg.solve(R, B.T @ _riccati(A, B, Q, R, "state_weight, input_weight"))
    L = np.linalg.solve(V, C @ _riccati(A.T, C.T, W, V, "process_noise, sensor_noise")).T
    return analyse(plant, feedback=K, injection=L, period=period, ratio=ratio, observer=observer)


def analyse(
    plant: Plant | control.StateSpace,
    *,
    feedback: Any,
    injection: Any,
    period: float,
    ratio: int,
    observer: str = DEFAULT_OBSERVER,
    discrete_gain: bool = False,
) -> DualRateResult:
    """The closed loop with given gains: feedback K (m, n) with u = K x^ (A + BK stable), injection L (n, p).

    discrete_gain: L corrects by steps instead of in the observer's differential equation. The others as in `design`.
    Raises InvalidInputError for what does not fit (see `dual_rate_design`), InfeasibleError if the loop is unstable.
    """
    problem = dual_rate_design(plant, feedback=feedback, injection=injection, period=period, ratio=ratio)
    loop = close_loop(problem, _builder(observer), discrete_gain=discrete_gain)
    if stability_radius(loop) >= 1.0 - MARGINAL:
        require_stable(loop, _advice(problem, discrete_gain))
    gain = l2_gain(_noise_to_output(loop))
    evidence = (
        Evidence("monodromy radius", stability_radius(loop), "largest eigenvalue over one slow period; stable below 1"),
        Evidence("noise to output", noise_gain(loop), "standard deviations, white noise, periodic Lyapunov equation"),
        Evidence("observer", observer, "discrete gain" if discrete_gain else "gain in the differential equation"),
        Evidence("fast period T", problem.period, "as given", "s"),
        Evidence("ratio M", problem.ratio, "as given"),
    )
    return DualRateResult(
        method="dualrate",
        quantity=QUANTITY,
        bracket=Bracket(gain.lower, gain.upper, EXACT_GAIN),
        gains=frozen({"K": problem.feedback, "L": problem.injection}),
        axes={"K": "(input, state)", "L": "(state, output)"},
        evidence=evidence,
        signals=_signals(plant, problem),
        loop=loop,
        observer_name=observer,
        discrete_gain=discrete_gain,
    )


def compare(result: DualRateResult) -> dict[str, float]:
    """The monodromy radius of the same gains with each of `OBSERVERS`: the loop is stable iff it is below one."""
    require_result(result, DualRateResult)
    return _radii(result.loop.design, result.discrete_gain)


def simulate(
    result: DualRateResult, start: Any, *, slow_periods: int, estimate: Any = None, output: int = 0
) -> Simulation:
    """The loop from x(0) = `start` and x^(0) = `estimate` (zero unless given), between the instants too; no noise.

    output: which output is shown, from 0. Raises InvalidInputError for another length or no such output.
    """
    require_result(result, DualRateResult)
    first = np.zeros(result.loop.design.model.size) if estimate is None else estimate
    response = time_response(result.loop, start, first, slow_periods=slow_periods, substeps=SUBSTEPS, output=output)
    held = np.repeat(np.arange(len(response.instants)), SUBSTEPS)
    signals = {
        "output": response.output[:, None],
        "input": response.input[held],
        "estimation error": (response.state - response.estimate)[held],
    }
    return Simulation(
        method="dualrate", time=response.time, time_label="time (s)", signals=frozen(signals), ratio=None, steps=False
    )


def _radii(problem: DualRateDesign, discrete_gain: bool) -> dict[str, float]:
    loops = {name: close_loop(problem, builder, discrete_gain=discrete_gain) for name, builder in OBSERVERS.items()}
    return {name: stability_radius(loop) for name, loop in loops.items()}


def _advice(problem: DualRateDesign, discrete_gain: bool) -> str:
    """Which observers would do with the same gains, and what else can be changed."""
    stable = [name for name, radius in _radii(problem, discrete_gain).items() if radius < 1.0 - MARGINAL]
    if "state_feedback" not in stable:
        return "so it is with the full state at every instant; choose a shorter period or a weaker feedback K"
    others = ", ".join(name for name in stable if name not in ("state_feedback", "fast_sensor"))
    choice = f"one of the observers {others}" if others else "a smaller ratio"
    return f"with the full state at every instant it would be stable; choose {choice}, or another gain L"


def _builder(observer: str) -> Any:
    if not isinstance(observer, str) or observer not in OBSERVERS or observer == "state_feedback":
        known = ", ".join(name for name in OBSERVERS if name != "state_feedback")
        raise InvalidInputError(f"observer must be one of {known}, got {observer!r}")
    return OBSERVERS[observer]


def _noise_to_output(loop: DualRateLoop) -> PeriodicSystem:
    """Outputs are weighted so that the mean square over M fast instants is set beside that over the readings."""
    rows = len(loop.plant.output)
    readings = sum(bool(np.any(step.noise)) for step in loop.steps)
    weight = np.sqrt(max(readings, 1) / len(loop.steps))
    output = weight * np.hstack([loop.plant.output, np.zeros((rows, loop.size - loop.plant.size))])
    return PeriodicSystem(
        tuple(Stage(step.state, step.noise, output, np.zeros((rows, step.noise.shape[1]))) for step in loop.steps)
    )


def _symmetric(name: str, value: Any, size: int) -> Any:
    """The matrix (size, size); raises InvalidInputError unless it is symmetric and positive semidefinite."""
    matrix = as_matrix(name, value, rows=size, columns=size)
    least, largest = np.linalg.eigvalsh(matrix)[[0, -1]]
    if not np.array_equal(matrix, matrix.T) or least < -SEMIDEFINITE * max(largest, 0.0):
        raise InvalidInputError(f"{name} must be symmetric and positive semidefinite, got {matrix.tolist()}")
    return matrix


def _definite(name: str, value: Any, size: int) -> Any:
    """The matrix (size, size); raises InvalidInputError unless it is symmetric and positive definite."""
    matrix = as_matrix(name, value, rows=size, columns=size)
    if not np.array_equal(matrix, matrix.T) or np.linalg.eigvalsh(matrix)[0] <= 0:
        raise InvalidInputError(f"{name} must be symmetric and positive definite, got {matrix.tolist()}")
    return matrix


def _riccati(A: Any, B: Any, Q: Any, R: Any, weights: str) -> Any:
    try:
        return scipy.linalg.solve_continuous_are(A, B, Q, R)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InfeasibleError(
            f"the Riccati equation for {weights} has no stabilising solution ({error}): every unstable mode must be "
            "moved by the input and seen by the sensor, and no mode on the imaginary axis may be left out of the weight"
        ) from None


def _signals(plant: Plant | control.StateSpace, problem: DualRateDesign) -> Signals:
    model = problem.model
    if not isinstance(plant, Plant):
        states, inputs = tuple(plant.state_labels), tuple(plant.input_labels)
        return Signals(states, inputs, tuple(plant.output_labels), states, problem.period)
    states, inputs = numbered("x", model.size), numbered("u", model.input.shape[1])
    return Signals(states, inputs, numbered("y", len(model.output)), states, problem.period)
