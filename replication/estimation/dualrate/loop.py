"""The closed dual-rate loop as a linear M-periodic system over the fast instants, and its monodromy matrix.

State z = (x, o, v): plant, observer, last computed command. With y_d = 0 it is (1), (8) and the observer; a command
r(k) adds to K x̂(k), and each sensor reading may carry noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from replication.errors import InfeasibleError, InvalidInputError, SolverError
from replication.estimation.dualrate.observers import (
    Builder,
    Harmonic,
    Held,
    ObserverStep,
    check_fit,
    over_time,
    sampled_model,
)
from replication.estimation.dualrate.problem import DualRateDesign, Plant, as_plant
from replication.estimation.linear.periodic import PeriodicSystem, Stage, lifted_statespace
from replication.estimation.linear.riccati import gramians
from replication.estimation.validation import Array, ComplexArray, StateSpace

MARGINAL = 1e-12
"""A monodromy radius this near to one is one, up to rounding."""


@dataclass(frozen=True, eq=False)
class LoopStep:
    """One phase: z' = state z + command r + noise n + forcing w; applied input u and estimate x̂ of the same form."""

    state: Array
    command: Array
    noise: Array
    forcing: ComplexArray
    input_state: Array
    input_command: Array
    estimate_state: Array


@dataclass(frozen=True, eq=False)
class DualRateLoop:
    """A design, the plant that it really drives, and the M steps of the closed loop."""

    design: DualRateDesign
    plant: Plant
    harmonic: Harmonic | None
    steps: tuple[LoopStep, ...]

    @property
    def size(self) -> int:
        """Number of states of (x, o, v)."""
        return len(self.steps[0].state)


class Driven(NamedTuple):
    """One instant of a loop that follows set-points r: z+ = state z + drive r, u = input z + ahead r, x^ = estimate z.

    The first states are those of the plant, then come those of the observer, x^ in front.
    """

    state: Array
    drive: Array
    input: Array
    ahead: Array
    estimate: Array


def close_loop(
    design: DualRateDesign,
    builder: Builder,
    *,
    plant: StateSpace | Plant | None = None,
    harmonic: Harmonic | None = None,
    discrete_gain: bool = False,
) -> DualRateLoop:
    """Close the loop of `design` with one of `OBSERVERS`.

    plant: the true plant if it differs from the model; it may have another order, unless the full state is measured.
    harmonic: the reference, if there is one. discrete_gain: L corrects by steps (see `sampled_model`).
    Raises InvalidInputError: not an observer, a plant or a command that does not fit the model.
    """
    if not callable(builder):
        raise InvalidInputError(f"the observer must be one of OBSERVERS, such as OBSERVERS[{builder!r}]")
    true_plant = design.model if plant is None else as_plant(plant)
    check_fit(design.model, true_plant, harmonic)
    model = sampled_model(design, harmonic, discrete_gain=discrete_gain)
    observer = builder(model)
    if observer.full_state and true_plant.order != design.model.order:
        raise InvalidInputError(
            f"state feedback needs a true plant with the {design.model.order} states of the model, got "
            f"{true_plant.order}"
        )
    sampled = model.predictor if plant is None else over_time(true_plant, design.period, harmonic)
    sensed = np.eye(true_plant.order) if observer.full_state else true_plant.C
    m = sampled.input.shape[1]
    law = np.hstack([design.feedback, np.zeros((m, m))])
    pairs = [(step, phase == 0 or not observer.slow_command) for phase, step in enumerate(observer.steps)]
    different = {(id(step), computes): (step, computes) for step, computes in pairs}
    steps = {
        key: loop_step(law, step, sampled, sensed, computes=computes) for key, (step, computes) in different.items()
    }
    return DualRateLoop(design, true_plant, harmonic, tuple(steps[id(step), computes] for step, computes in pairs))


def loop_step(law: Array, o: ObserverStep, plant: Held, sensed: Array, *, computes: bool = True) -> LoopStep:
    """One phase over z = (x, o, v): read m = sensed x, estimate, compute v+ = law (x̂, v) + r or keep the last v."""
    n, m, size = plant.state.shape[0], plant.input.shape[1], o.transition.shape[0]
    p = sensed.shape[0]
    estimate = np.hstack([o.feedthrough @ sensed, o.readout, np.zeros((len(o.readout), m))])
    last = np.hstack([np.zeros((m, n + size)), np.eye(m)])
    hold = (last, np.zeros((m, m)), np.zeros((m, p)))
    computed = (law @ np.vstack([estimate, last]), np.eye(m), law[:, :-m] @ o.feedthrough)
    command = computed if computes else hold
    drive = np.vstack([plant.input, o.input, np.eye(m)])
    free = np.zeros((n + size + m, n + size + m))
    free[:n, :n] = plant.state
    free[n : n + size, : n + size] = np.hstack([o.injection @ sensed, o.transition])
    read = np.vstack([np.zeros((n, p)), o.injection, np.zeros((m, p))])
    return LoopStep(
        state=free + drive @ command[0],
        command=drive @ command[1],
        noise=read + drive @ command[2],
        forcing=np.concatenate([plant.forcing, o.forcing, np.zeros(m)]),
        input_state=command[0],
        input_command=command[1],
        estimate_state=estimate,
    )


def driven(steps: Sequence[LoopStep], ahead: Sequence[Array]) -> list[Driven]:
    """The loop with the command ahead r, instant by instant; ahead (m, t) for each."""
    return [
        Driven(step.state, step.command @ N, step.input_state, step.input_command @ N, step.estimate_state)
        for step, N in zip(steps, ahead, strict=True)
    ]


def monodromy(loop: DualRateLoop) -> Array:
    """Φ = S_{M−1} … S_0, shape (nz, nz): the state transition over one slow period; InvalidInputError on overflow."""
    total = np.eye(loop.size)
    with np.errstate(over="ignore", invalid="ignore"):
        for step in loop.steps:
            total = step.state @ total
    if not np.all(np.isfinite(total)):
        raise InvalidInputError(
            f"the loop overflows over M T = {loop.design.slow_period:g} s: the plant grows too fast for this slow "
            "period; choose a shorter one"
        )
    return total


def stability_radius(loop: DualRateLoop) -> float:
    """Largest modulus of the eigenvalues of the monodromy matrix; the loop is stable iff it is below one."""
    return float(np.max(np.abs(np.linalg.eigvals(monodromy(loop)))))


def require_stable(loop: DualRateLoop, consequence: str) -> None:
    """Raise InfeasibleError, ending in `consequence`, unless the radius is below one by more than rounding."""
    radius = stability_radius(loop)
    if radius >= 1.0 - MARGINAL:
        word = "unstable" if radius > 1.0 + MARGINAL else "marginal"
        raise InfeasibleError(f"the loop is {word} (monodromy radius {radius:.6g}, must be below 1): {consequence}")


def noise_system(loop: DualRateLoop, weight: float = 1.0) -> PeriodicSystem:
    """The loop from the sensor noise to the plant outputs times `weight` at all M phases."""
    rows = len(loop.plant.C)
    output = weight * np.hstack([loop.plant.C, np.zeros((rows, loop.size - loop.plant.order))])
    return PeriodicSystem(
        tuple(Stage(step.state, step.noise, output, np.zeros((rows, step.noise.shape[1]))) for step in loop.steps)
    )


def lifted_system(loop: DualRateLoop) -> StateSpace:
    """`noise_system` over one slow period, dt = M T: inputs the sensor noises, outputs those of all M phases."""
    return lifted_statespace(noise_system(loop), dt=loop.design.period)


def noise_gain(loop: DualRateLoop) -> float:
    """Standard deviation of the output per unit standard deviation of white noise on each sensor reading.

    The largest over the fast instants, from the periodic Lyapunov equation, by doubling: units of the states do not
    matter. Raises InfeasibleError if the loop is unstable.
    """
    require_stable(loop, "its noise grows without bound")
    stages = noise_system(loop).stages
    covariances = gramians((s.A, s.B) for s in stages)
    if covariances is None:
        raise SolverError("the covariance of the output was lost in rounding; choose other units of the states")
    return float(np.sqrt(max(np.max(np.diag(s.C @ P @ s.C.T)) for s, P in zip(stages, covariances, strict=True))))
