"""The printed problem as objects: motor, design, reading space, and which observers may stand for which column."""

from __future__ import annotations

import numpy as np

from papers.shao import data
from papers.shao.method.motor import Feedforward, Motor, ReferenceTiming, tracking_command
from papers.shao.method.readings import ReadingSpace
from replication.estimation.dualrate.loop import DualRateLoop, close_loop
from replication.estimation.dualrate.observers import OBSERVERS
from replication.estimation.dualrate.problem import DualRateDesign, dual_rate_design, make_plant

MOTOR = Motor(
    resistance=float(data.RESISTANCE),
    flux=float(data.FLUX),
    inductance=float(data.INDUCTANCE),
    pole_pairs=int(data.POLE_PAIRS),
    friction=float(data.FRICTION),
    inertia=float(data.INERTIA),
    torque_constant=float(data.TORQUE_CONSTANT),
)
DESIGN = dual_rate_design(
    MOTOR.system(),
    feedback=[[float(k) for k in data.FEEDBACK]],
    injection=[[float(gain)] for gain in data.INJECTION],
    period=float(data.PERIOD),
    ratio=int(data.RATIO),
)
START = np.array([float(x) for x in data.START])
FREQUENCIES = tuple(float(sigma) for sigma in data.FREQUENCIES)
READINGS = ReadingSpace(MOTOR, DESIGN, tuple(START.tolist()), FREQUENCIES)

SRC, PMI, APO = "single_rate", "model_interpolation", "alternating_predictive"
"""The literal readings of SRC, DRC-PMI (observer (2) at M T, the model alone between) and DRC-APO."""
HELD, SINGLE = "held_measurement", "single_correction"
"""Other readings of DRC-PMI: observer (2) read at every T with y held, and (7) corrected once in M T."""
PMI_READINGS = (PMI, HELD, SINGLE, "slow_input_interpolation")
APO_READINGS = (APO, "open_loop_prediction", "running_prediction")
REPAIRED, FAST, STATE = "running_prediction", "fast_sensor", "state_feedback"

LABELS = {
    SRC: "SRC",
    PMI: "DRC-PMI, slow observer and model",
    HELD: "DRC-PMI, y held",
    SINGLE: "DRC-PMI, one correction and model",
    "slow_input_interpolation": "DRC-PMI, slow observer with slow input",
    APO: "DRC-APO as printed",
    "open_loop_prediction": "DRC-APO, open-loop prediction",
    REPAIRED: "APO, repaired predictor",
    FAST: "true fast sensor",
    STATE: "state feedback",
}

COUNTEREXAMPLE = dual_rate_design(
    make_plant([[1.0]], [[1.0]], [[1.0]]), feedback=[[-2.0]], injection=[[2.0]], period=1e-3, ratio=5
)
"""A = B = C = 1, K = −2, L = 2, M = 5: ours, not the manuscript's."""


def literal_loop(observer: str, frequency: float, design: DualRateDesign = DESIGN) -> DualRateLoop:
    """The loop as printed: printed feedforward, references held over T, L as a continuous gain."""
    return reading_loop(observer, frequency, Feedforward.PRINTED, ReferenceTiming.HELD, design=design)


def reading_loop(
    observer: str,
    frequency: float,
    form: Feedforward,
    timing: ReferenceTiming,
    *,
    design: DualRateDesign = DESIGN,
) -> DualRateLoop:
    """The motor's tracking loop with another feedforward or timing of the reference."""
    return close_loop(design, OBSERVERS[observer], harmonic=tracking_command(MOTOR, design, frequency, form, timing))
