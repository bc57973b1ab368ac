"""What leads the report on this paper."""

from __future__ import annotations

import math

from papers._sketch import curve, dots, label, signal, ticks
from papers.shao.problem import DESIGN
from replication.audit.brief import Brief, Curve, Draws, Explorer, Picture, Sketch

STEP = 14
PERIOD = STEP * DESIGN.ratio
SLOW = range(14, 303, PERIOD)
FAST = [x for x in range(14, 303, STEP) if x not in SLOW]


def _virtual(x: float) -> float:
    """The model drifts away from the signal until the sensor measures again."""
    since = (x - 14) % PERIOD
    return signal(x) - 0.3 * since * math.cos(x / 40)


def _compared(figure: str, label: str, across: str, x: str, y: str, begin: float, fast: bool = False) -> Picture:
    """One measure of the printed predictor beside the restarted one and, where it was computed, a fast sensor."""
    stable = (0.0, "unstable above") if figure == "rates" else None
    others = ("model_interpolation",) if figure != "rates" else ()
    return Picture(
        label=label,
        figure=f"shao-{figure}",
        across=across,
        x=x,
        y=y,
        begin=begin,
        log_x=fast,
        log_y=figure == "error-frequency",
        limit=stable,
        curves=(
            Curve(label="DRC-APO as printed", columns=("alternating_predictive",)),
            Curve(label="restarted predictor", columns=("running_prediction",)),
            *(Curve(label="DRC-PMI", columns=(name,), quiet=True) for name in others),
            *((Curve(label="true fast sensor", columns=("fast_sensor",), quiet=True),) if fast else ()),
        ),
    )


BRIEF = Brief(
    topic="A slow sensor in a fast loop",
    card="[The stability theorem](-theory.stability) is false: a loop that meets its condition diverges. "
    "[No reading tried](-table.any-reading) gives the two columns of numbers of Table I.",
    holds="The motor loop is [stable under the alternating observer, DRC-APO](stability.apo), and [unstable at the "
    "single slow rate, SRC](stability.src); "
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
    explorers=(
        Explorer(
            title="In the counter-example the printed virtual measurement is no fast sensor",
            moves="Move the fast period of the counter-example or, on the motor, the ratio of both periods or the "
            "frequency of the reference.",
            text="In the counter-example at short periods the restarted predictor does nearly what a fast sensor "
            "would; the printed one does not.",
            pictures=(
                _compared("rates", "period", "period_s", "fast period T (s)", "slowest rate (1/s)", 0.01, fast=True),
                _compared("lag", "ratio", "ratio", "ratio M of the periods", "lag of the estimate (s)", 6),
                _compared(
                    "error-frequency",
                    "frequency",
                    "frequency_rad_s",
                    "frequency (rad/s)",
                    "tracking error (%)",
                    0.5,
                    True,
                ),
            ),
        ),
    ),
)
