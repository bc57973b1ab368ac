"""What leads the report on this paper."""

from __future__ import annotations

import math

from papers._sketch import curve, dots, label, signal, ticks
from papers.shao.problem import DESIGN
from replication.audit.brief import Brief, Draws, Sketch

STEP = 14
PERIOD = STEP * DESIGN.ratio
SLOW = range(14, 303, PERIOD)
FAST = [x for x in range(14, 303, STEP) if x not in SLOW]


def _virtual(x: float) -> float:
    """The model drifts away from the signal until the sensor measures again."""
    since = (x - 14) % PERIOD
    return signal(x) - 0.3 * since * math.cos(x / 40)


BRIEF = Brief(
    topic="A slow sensor in a fast loop",
    card="[The stability theorem](-theory.stability) is false: a loop that meets its condition diverges. "
    "[No reading tried](-table.any-reading) gives a whole column of Table I.",
    holds="The motor loop is [stable under DRC-APO](stability.apo) and [unstable under SRC](stability.src); "
    "[both gains](motor.hurwitz-feedback) are as the theorem supposes.",
    correct="[The stability theorem](theory.stability) is false; its proof breaks at "
    "[eq. (15)](theory.prediction-bound). [Table I](table.any-reading) does not come out under any reading tried.",
    guess="Whether DRC-APO [tracks better](order.apo-below-pmi), or has [the better transient](order.transient), "
    "depends on what the text leaves open.",
    sketch=Sketch(
        alt=f"A slow sensor measures at every {DESIGN.ratio}th fast instant; a model fills in virtual measurements "
        "between, which drift away from the output.",
        strokes=(
            curve(Draws.TRUTH),
            dots(Draws.VIRTUAL, FAST, _virtual),
            dots(Draws.MEASURED, SLOW),
            ticks(Draws.TICK, FAST, 142),
            ticks(Draws.TICK_OURS, SLOW, 142),
            label("measured", 8, 14, Draws.LABEL_OURS),
            label("virtual, from a model", 172, 14),
        ),
    ),
)
