"""Designs shared by the tests of dual-rate loops."""

import numpy as np

from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming, tracking_command
from replication.estimation.dualrate.loop import DualRateLoop, close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, dual_rate_design, make_plant

PMSM = Motor(
    resistance=0.54, flux=0.61, inductance=0.0096, pole_pairs=4, friction=1e-4, inertia=0.016, torque_constant=3.66
)
MOTOR = PMSM.system()
MOTOR_DESIGN = dual_rate_design(
    MOTOR, feedback=[[-20, -0.1, -0.01]], injection=[[0.45], [0.9], [0.9]], period=0.2, ratio=5
)
START = np.array([-0.5, 1.0, -1.0])


def motor_loop(
    name: str,
    frequency: float,
    *,
    design: DualRateDesign = MOTOR_DESIGN,
    form: Feedforward = Feedforward.PRINTED,
    timing: ReferenceTiming = ReferenceTiming.HELD,
) -> DualRateLoop:
    harmonic = tracking_command(PMSM, design, frequency, form, timing)
    return close_loop(design, OBSERVERS[name], harmonic=harmonic)


def random_design(rng: np.random.Generator, ratio: int) -> DualRateDesign:
    """A generic third-order plant with mild gains: stable or not, it is a loop."""
    return dual_rate_design(
        make_plant(rng.normal(size=(3, 3)), rng.normal(size=(3, 1)), rng.normal(size=(1, 3))),
        feedback=0.3 * rng.normal(size=(1, 3)),
        injection=0.3 * rng.normal(size=(3, 1)),
        period=0.2,
        ratio=ratio,
    )
