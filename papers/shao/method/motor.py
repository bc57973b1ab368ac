"""Permanent magnet synchronous motor of eq. (23) in position coordinates x = (θ, ω, dω/dt), input u_q.

Parameters carry SI units; they are data of an example, not of a measured motor.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from replication.errors import InvalidInputError
from replication.estimation.dualrate.observers import Harmonic
from replication.estimation.dualrate.problem import DualRateDesign, Plant, make_plant
from replication.estimation.validation import one_of, positive_integer, positive_scalar


@dataclass(frozen=True, kw_only=True)
class Motor:
    """resistance R in Ω, flux Ψ_f in Wb, inductance L_q in H, pole_pairs p, friction B_ω in N m s/rad, inertia J in
    kg m², torque_constant K_T in N m/A. Raises InvalidInputError unless all are positive."""

    resistance: float
    flux: float
    inductance: float
    pole_pairs: int
    friction: float
    inertia: float
    torque_constant: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        positive_integer("number of pole pairs", self.pole_pairs)
        for name in ("resistance", "flux", "inductance", "friction", "inertia", "torque_constant"):
            positive_scalar(name.replace("_", " "), getattr(self, name))

    @property
    def velocity_coefficient(self) -> float:
        """a₂ = (R B_ω + K_T p Ψ_f)/(J L_q), 1/s²."""
        back_emf = self.torque_constant * self.pole_pairs * self.flux
        return (self.resistance * self.friction + back_emf) / (self.inertia * self.inductance)

    @property
    def acceleration_coefficient(self) -> float:
        """a₃ = R/L_q + B_ω/J, 1/s."""
        return self.resistance / self.inductance + self.friction / self.inertia

    @property
    def input_gain(self) -> float:
        """b = K_T/(J L_q), rad/s³ per V."""
        return self.torque_constant / (self.inertia * self.inductance)

    def system(self) -> Plant:
        """θ''' + a₃ θ'' + a₂ θ' = b u_q in continuous time; output θ."""
        state = [[0, 1, 0], [0, 0, 1], [0, -self.velocity_coefficient, -self.acceleration_coefficient]]
        return make_plant(state, [[0], [0], [self.input_gain]], [[1, 0, 0]])


class Feedforward(StrEnum):
    """How the command that should invert the motor is formed."""

    PRINTED = "printed"
    CORRECTED = "corrected"


def feedforward(motor: Motor, s: complex, form: Feedforward) -> complex:
    """ȳ_d/y_d at exp(st). Corrected: (s³ + a₃ s² + a₂ s)/b, the inverse of the motor; printed: (s² + a₂ s + a₃)/b."""
    a2, a3 = motor.velocity_coefficient, motor.acceleration_coefficient
    form = one_of(Feedforward, form)
    numerator = s**3 + a3 * s**2 + a2 * s if form is Feedforward.CORRECTED else s**2 + a2 * s + a3
    return numerator / motor.input_gain


class ReferenceTiming(StrEnum):
    """When the controller reads y_d and its derivatives: at t_k and holds, at t_{k+1} and holds, or at all times."""

    HELD = "held"
    PREVIEWED = "previewed"
    CONTINUOUS = "continuous"


def tracking_command(
    motor: Motor,
    design: DualRateDesign,
    frequency: float,
    form: Feedforward,
    timing: ReferenceTiming = ReferenceTiming.HELD,
) -> Harmonic:
    """The command r of u = K(x̂ − x_d) + ȳ_d with x_d = (y_d, y_d', y_d''), y_d = sin(frequency · t).

    Raises InvalidInputError: an unknown form or timing, K not of the motor's shape (1, 3).
    """
    timing = one_of(ReferenceTiming, timing)
    if design.feedback.shape != (1, 3):
        raise InvalidInputError(f"the motor needs a feedback gain K of shape (1, 3), got {design.feedback.shape}")
    s = 1j * frequency
    amplitude = feedforward(motor, s, form) - design.feedback @ np.array([1.0, s, s**2])
    lead = np.exp(s * design.period) if timing is ReferenceTiming.PREVIEWED else 1.0
    return Harmonic(frequency, amplitude * lead, timing is ReferenceTiming.CONTINUOUS)
