"""What the manuscript prints, the printed problem as objects (motor, design, reading space), and its readings."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from papers.shao.method.motor import Feedforward, Motor
from papers.shao.method.readings import Reading, ReadingSpace, Start, Structure
from replication.audit.data import PrintedValue, read_printed
from replication.audit.judge.printed import number
from replication.estimation.dualrate.loop import DualRateLoop, Points
from replication.estimation.dualrate.problem import DualRateDesign, dual_rate_design, make_plant

DATA = read_printed(Path(__file__).with_suffix(".toml"))

PARAMETERS = ("resistance", "flux", "inductance", "friction", "inertia", "torque_constant")
"""Parameters of the motor that are printed with a tolerance; the number of pole pairs has none."""
REFERENCES = tuple(DATA["table-1"])


def table_1(controller: str) -> tuple[PrintedValue, ...]:
    """The column of Table I of SRC, DRC-PMI or DRC-APO."""
    return tuple(row[controller] for row in DATA["table-1"].values())


def frequency(reference: str) -> float:
    """σ of a reference as Table I writes it, such as sin(3t/2), rad/s."""
    times, _, over = reference.removeprefix("sin(").removesuffix(")").partition("/")
    return float(times.removesuffix("t") or 1) / float(over or 1)


MOTOR = Motor(pole_pairs=int(DATA["pole_pairs"]), **{name: float(DATA[name]) for name in PARAMETERS})
DESIGN = dual_rate_design(
    MOTOR.system(),
    feedback=[number(DATA["feedback"])],
    injection=[[gain] for gain in number(DATA["injection"])],
    period=float(DATA["period"]),
    ratio=int(DATA["ratio"]),
)
START = np.array(number(DATA["start"]))
FREQUENCIES = tuple(frequency(reference) for reference in REFERENCES)
READINGS = ReadingSpace(MOTOR, DESIGN, tuple(START.tolist()), FREQUENCIES)

SRC, PMI, APO = "single_rate", "model_interpolation", "alternating_predictive"
"""The literal readings of SRC, DRC-PMI (observer (2) at M T, the model alone between) and DRC-APO."""
SRC_SINGLE = "single_rate_correction"
"""Another reading of SRC: (7) corrected once in M T."""
COLUMNS = {"pmi": PMI, "apo": APO}
"""The columns of Table I that hold numbers, under the names that claims and figures give them."""
HELD, SINGLE, SLOW_INPUT = "held_measurement", "single_correction", "slow_input_interpolation"
"""Other readings of DRC-PMI: (2) read at every T with y held; (7) corrected once in M T; (2) with u frozen over M T."""
PMI_READINGS = (PMI, HELD, SINGLE, SLOW_INPUT)
PMI_OPEN = (PMI, SINGLE)
"""Of these, what the text allows: Sec. V has the observer updated once in M T, and u at every T."""
APO_READINGS = (APO, "open_loop_prediction", "running_prediction")
RESTARTED, FAST, STATE = "running_prediction", "fast_sensor", "state_feedback"

CALLED = {
    SRC: ("SRC, slow observer", "SRC"),
    SRC_SINGLE: ("SRC, one correction and model", "SRC, one correction"),
    PMI: ("DRC-PMI, slow observer and model", "DRC-PMI"),
    HELD: ("DRC-PMI, y held", "PMI, y held"),
    SINGLE: ("DRC-PMI, one correction and model", "PMI, one correction"),
    SLOW_INPUT: ("DRC-PMI, slow observer with slow input", "PMI, slow input"),
    APO: ("DRC-APO as printed", "DRC-APO"),
    "open_loop_prediction": ("DRC-APO, open-loop prediction", "APO, open loop"),
    RESTARTED: ("APO, restarted predictor", "APO, restarted"),
    FAST: ("true fast sensor", "fast sensor"),
    STATE: ("state feedback", "state feedback"),
}
"""What the loop with each observer is called in words, and in figures, where the literal ones have the text's names."""
LABELS, NAMES = ({observer: called[place] for observer, called in CALLED.items()} for place in (0, 1))

COUNTEREXAMPLE = dual_rate_design(
    make_plant([[1.0]], [[1.0]], [[1.0]]), feedback=[[-2.0]], injection=[[2.0]], period=1e-3, ratio=5
)
"""A = B = C = 1, K = −2, L = 2, M = 5: ours, not the manuscript's."""


def literal_loop(
    observer: str, frequency: float, design: DualRateDesign = DESIGN, motor: Motor = MOTOR
) -> DualRateLoop:
    """The loop as printed: printed feedforward, references held over T, L as a continuous gain."""
    return replace(READINGS, design=design, motor=motor).loop(observer, Structure(), frequency)


LITERAL = "literal"
CORRECTED = Structure(feedforward=Feedforward.CORRECTED)
MEASURES: Mapping[str, tuple[Structure, Points]] = {
    LITERAL: (Structure(), Points.BETWEEN),
    "fast-instants": (Structure(), Points.FAST),
    "corrected-feedforward": (CORRECTED, Points.BETWEEN),
    "corrected-feedforward-fast-instants": (CORRECTED, Points.FAST),
}
"""Readings of the command and of the maximum in Table I."""
INTERPOLATIONS: Mapping[str, str] = {
    LITERAL: PMI,
    "pmi-held": HELD,
    "pmi-one-correction": SINGLE,
    "pmi-slow-input": SLOW_INPUT,
}
"""Observers that may be meant by DRC-PMI, by reading."""
READ: Mapping[str, dict[str, Reading]] = {
    column: {name: Reading(observer, structure, points=points) for name, (structure, points) in MEASURES.items()}
    for column, observer in COLUMNS.items()
}
READ["pmi"] |= {name: Reading(loop) for name, loop in INTERPOLATIONS.items() if loop not in (PMI, SLOW_INPUT)}
"""By column of Table I its readings; with u frozen over M T DRC-PMI is unstable and has no steady state."""
SINGLE_RATES: Mapping[str, str] = {LITERAL: SRC, "src-one-correction": SRC_SINGLE}
"""Observers that may be meant by SRC, by reading."""
STARTS: Mapping[str, Start] = {"start-zero": Start.ZERO, "start-output": Start.OUTPUT, "start-true": Start.TRUE}
"""Readings of ζ(0), which is not printed."""
SLOWEST = "slowest-mode"
EVERY = "every-open-choice"
ESTIMATES: Mapping[str, str] = {
    f"estimate-{reading}": observer for reading, observer in INTERPOLATIONS.items() if observer != SLOW_INPUT
}
"""Observers that may be meant by DRC-PMI and have a steady state, by the reading of the estimation error."""
