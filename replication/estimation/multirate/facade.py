"""Multi-rate observers for a plant of one's own: `design`, `analyse`, `simulate` (Okajima et al., 2023).

The plant is sampled at a base period; sensor i measures every periods[i] of them, offsets[i] later. A design gives the
periodic gains with the smallest worst-case gain from process and sensor noise to the weighted estimation error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from replication.drawing.panel import Panel
from replication.errors import InvalidInputError
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
from replication.estimation.api.signals import Signals, is_statespace, numbered
from replication.estimation.linear.norms import l2_gain, response_norm
from replication.estimation.multirate.optimum import DESIGN_MARGIN, Optimum, optimum, riccati_design
from replication.estimation.multirate.plant import MultiratePlant
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.multirate.schedule import SensingSchedule
from replication.estimation.multirate.simulation import simulate as simulate_system
from replication.estimation.multirate.simulation import white_noise_variance, worst_case_response
from replication.estimation.multirate.statespace import lifted_statespace, observer_system
from replication.estimation.multirate.timing import search_timing
from replication.estimation.validation import Array, positive_integer

if TYPE_CHECKING:
    import control

QUANTITY = "l2 gain from process and sensor noise (d, w) to the weighted estimation error W e"
ANGLES = 200
"""Points of the frequency plot."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MultirateResult(GainResult):
    """Gains L of shape (phase, state, sensor), and `problem`: plant and schedule."""

    problem: MultirateProblem

    def observer(self) -> PeriodicObserver:
        """x^(k+1) = A x^ + B_u u + L_k S_k (y - C x^); y has all q sensors, only those that are due are looked at."""
        plant, schedule = self.problem.plant, self.problem.schedule
        identity = np.eye(plant.order)
        phases = []
        for k, L in enumerate(self.gains["L"]):
            used = L * schedule.mask[k]
            phases.append(Phase(plant.A - used @ plant.C, plant.B_u, used, identity, schedule.mask[k]))
        return PeriodicObserver(phases, plant.C)

    def to_statespace(self) -> control.StateSpace:
        """The observer over one period N: inputs (u, y) of all N instants, outputs W x^; sampling period N dt.

        With N = 1 it has the names of the plant; with N > 1 `@k` is added for instant k.
        """
        system = observer_system(self.problem, self.gains["L"])
        lifted = lifted_statespace(system, dt=self.problem.plant.dt)
        names = [f"estimate of {name}" for name in self.signals.outputs]
        inputs = [*self.signals.inputs, *self.signals.measurements]
        instants = range(system.period)
        several = system.period > 1
        lifted.set_inputs([f"{name}@{k}" if several else name for k in instants for name in inputs])
        lifted.set_outputs([f"{name}@{k}" if several else name for k in instants for name in names])
        lifted.set_states(list(self.signals.states))
        return lifted

    def panels(self) -> tuple[Panel, ...]:
        """The gain over the frequency, with the guaranteed level."""
        error = self.problem.error_system(self.gains["L"])
        angles = np.linspace(0.0, np.pi, ANGLES)
        norm = response_norm(error)
        gains = np.array([norm(float(angle)) for angle in angles])
        duration = self.problem.plant.dt * self.problem.schedule.period
        return (
            Panel(
                angles / duration,
                "frequency (rad/s, folded at the period of the schedule)",
                "largest gain to the error",
                {"gain": gains},
                {"guaranteed level": self.value},
            ),
        )


def design(
    plant: MultiratePlant | control.StateSpace,
    *,
    periods: Sequence[int],
    offsets: Sequence[int] | Literal["best"] = (),
    level: float | None = None,
    noise: Any = None,
    disturbances: Sequence[int | str] | None = None,
    weight: Any = None,
) -> MultirateResult:
    """The observer with the smallest worst-case gain, or with a gain below `level`.

    plant: a `MultiratePlant` of arrays, or a discrete-time `control.StateSpace`; the latter with noise: the sensor
    noise matrix D (q, q_w), or one number for each sensor; disturbances: which inputs are process noise, by index or
    name (all unless given; the others are known inputs u); weight: W (n_z, n), the identity unless given.
    periods: N_i in base periods, one for each sensor; offsets: zeros unless given, "best" searches all, one after the
    other (many sensors have many: `search_timing` takes a way to use every core).
    Raises InvalidInputError for what does not fit (see `MultiratePlant`, `SensingSchedule`, `MultirateProblem`),
    InfeasibleError if no observer reaches the level.

    >>> cart = MultiratePlant(A=[[1, 0.1], [0, 0.98]], B_d=[[0], [0.1]], C=[[0, 1], [1, 0]], D=np.diag([0.5, 0.1]))
    >>> best = design(cart, periods=(1, 4), offsets=(0, 2))
    >>> best.gains["L"].shape
    (4, 2, 2)
    >>> best.bracket.lower <= best.value <= 1.000001 * best.fact("optimum").value
    True
    """
    problem, signals = _problem(plant, periods, offsets, noise, disturbances, weight)
    best = optimum(problem)
    found = riccati_design(problem, best.upper * (1 + DESIGN_MARGIN) if level is None else level)
    return _result(problem, signals, found.gains, best)


def analyse(
    plant: MultiratePlant | control.StateSpace,
    gains: Any,
    *,
    periods: Sequence[int],
    offsets: Sequence[int] = (),
    noise: Any = None,
    disturbances: Sequence[int | str] | None = None,
    weight: Any = None,
) -> MultirateResult:
    """What given gains (N, n, q) guarantee; the other arguments as in `design`.

    Raises InvalidInputError for gains of another shape, InfeasibleError if they do not stabilise the error.
    """
    problem, signals = _problem(plant, periods, offsets, noise, disturbances, weight)
    return _result(problem, signals, gains, optimum(problem))


def simulate(
    result: MultirateResult,
    steps: int,
    *,
    disturbance: Literal["none", "white", "worst"] | Array = "none",
    initial_error: Any = None,
    rng: np.random.Generator | None = None,
) -> Simulation:
    """The weighted error W e over `steps` instants, from e(0) = `initial_error` (n,), zero unless given.

    disturbance: an array (steps, m_d + q_w) of (d, w); "white" draws unit white noise from `rng`; "worst" is the one of
    unit norm that hurts most from rest. Raises InvalidInputError for another shape, or "white" without `rng`.
    """
    require_result(result, MultirateResult)
    count = positive_integer("steps", steps)
    error = result.problem.error_system(result.gains["L"])
    width = error.stages[0].B.shape[1]
    if isinstance(disturbance, str):
        inputs = _drawn(
            disturbance, error_width=width, steps=count, rng=rng, worst=lambda: worst_case_response(error, count).inputs
        )
    else:
        inputs = np.asarray(disturbance)
    outputs = simulate_system(error, inputs, initial_error)
    if len(outputs) != count:
        raise InvalidInputError(f"disturbance must have {count} rows, got {len(outputs)}")
    size = float(np.linalg.norm(inputs))
    return Simulation(
        method="multirate",
        time=np.arange(count, dtype=float) * result.problem.plant.dt,
        time_label="time (s)",
        signals=frozen({"error": outputs, "disturbance": inputs}),
        ratio=float(np.linalg.norm(outputs)) / size if size and initial_error is None else None,
        steps=True,
    )


def _drawn(kind: str, *, error_width: int, steps: int, rng: np.random.Generator | None, worst: Any) -> Array:
    if kind == "none":
        return np.zeros((steps, error_width))
    if kind == "white":
        if not isinstance(rng, np.random.Generator):
            raise InvalidInputError('disturbance="white" needs `rng`, for example numpy.random.default_rng(1)')
        return rng.standard_normal((steps, error_width))
    if kind == "worst":
        return np.asarray(worst())
    raise InvalidInputError(f'disturbance must be "none", "white", "worst" or an array, got {kind!r}')


def _problem(
    plant: MultiratePlant | control.StateSpace,
    periods: Any,
    offsets: Any,
    noise: Any,
    disturbances: Sequence[int | str] | None,
    weight: Any,
) -> tuple[MultirateProblem, Signals]:
    if isinstance(plant, MultiratePlant):
        if noise is not None or disturbances is not None or weight is not None:
            raise InvalidInputError(
                "noise, disturbances and weight belong to a control.StateSpace; a MultiratePlant has D, B_d and W"
            )
        checked, system = plant, None
    elif is_statespace(plant):
        if noise is None:
            raise InvalidInputError("give the sensor noise: noise=D, or one number for each sensor")
        checked = MultiratePlant.from_statespace(plant, _noise(noise), disturbances=disturbances, W=weight)
        system = plant
    else:
        raise InvalidInputError(
            f"plant must be a MultiratePlant or a control.StateSpace, got {type(plant).__name__}; "
            "arrays make one: MultiratePlant(A=.., B_d=.., C=.., D=..)"
        )
    best = isinstance(offsets, str) and offsets == "best"
    schedule = SensingSchedule(periods, search_timing(checked, periods).best if best else offsets)
    return MultirateProblem(checked, schedule), _signals(checked, system, disturbances)


def _noise(noise: Any) -> Any:
    """A list of numbers stands for a diagonal matrix: each sensor with noise of its own."""
    return np.diag(noise) if np.ndim(noise) == 1 else noise


def _signals(plant: MultiratePlant, system: Any, disturbances: Sequence[int | str] | None) -> Signals:
    if system is None:
        states = numbered("x", plant.order)
        inputs, measurements = numbered("u", plant.B_u.shape[1]), numbered("y", plant.sensors)
    else:
        labels = list(system.input_labels)
        noisy = set(range(len(labels))) if disturbances is None else {*disturbances}
        states, measurements = tuple(system.state_labels), tuple(system.output_labels)
        inputs = tuple(name for i, name in enumerate(labels) if i not in noisy and name not in noisy)
    whole = np.array_equal(plant.W, np.eye(plant.order))
    outputs = states if whole else numbered("z", len(plant.W))
    return Signals(states, inputs, measurements, outputs, plant.dt)


def _result(problem: MultirateProblem, signals: Signals, gains: Any, best: Optimum) -> MultirateResult:
    error = problem.error_system(gains)
    exact = l2_gain(error)
    bound = "non-causal bound: no smoother does better" if best.limited_by == "noncausal" else "Riccati condition"
    evidence = (
        Evidence("optimum", best.value, f"least gain of any observer; {bound}"),
        Evidence("optimum lies above", best.lower, bound),
        Evidence("spectral radius over one period", error.spectral_radius(), "eigenvalues of the monodromy matrix"),
        Evidence("mean error variance", white_noise_variance(error), "periodic Lyapunov equation, white unit noise"),
        Evidence("schedule", f"periods {problem.schedule.periods}, offsets {problem.schedule.offsets}", "as given"),
        Evidence("base period", problem.plant.dt, "as given", "s"),
    )
    return MultirateResult(
        method="multirate",
        quantity=QUANTITY,
        bracket=Bracket(exact.lower, exact.upper, EXACT_GAIN),
        gains=frozen({"L": gains}),
        axes={"L": "(phase, state, sensor)"},
        evidence=evidence,
        signals=signals,
        problem=problem,
    )
