"""What leads the report on this paper."""

from __future__ import annotations

import math

from papers._sketch import curve, dots, label, signal, ticks
from papers.shao.problem import DESIGN
from replication.audit.brief import Brief, Curve, Draws, Explorer, Picture, Sketch, Traces

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
    ours = figure in ("rates", "counter-example")
    stable = (0.0, "unstable above") if figure == "rates" else None
    others = () if ours else ("model_interpolation",)
    return Picture(
        label=label,
        figure=f"shao-{figure}",
        across=across,
        x=x,
        y=y,
        begin=begin,
        log_x=fast and figure != "counter-example",
        log_y=figure == "error-frequency",
        limit=stable,
        last=4.0 if figure == "counter-example" else None,
        curves=(
            Curve(label="DRC-APO as printed", columns=("alternating_predictive",)),
            Curve(label="restarted predictor", columns=("running_prediction",)),
            *(Curve(label="DRC-PMI", columns=(name,), quiet=True) for name in others),
            *((Curve(label="true fast sensor", columns=("fast_sensor",), quiet=True),) if fast else ()),
        ),
    )


BRIEF = Brief(
    topic="A slow sensor in a fast loop",
    card="[The stability result of Sec. IV](-theory.stability) is false: a loop that meets its condition diverges. "
    "[No simulation setting tried](-table.any-reading) reproduces Table I.",
    holds="DRC-APO [keeps the motor stable](stability.apo), and [SRC does not](stability.src), as the text says; "
    "[both gains](motor.hurwitz-feedback) stabilise in continuous time.",
    correct="[Condition (18)](theory.stability) does not guarantee stability: it does not contain M, and its proof "
    "breaks "
    "at [eq. (15)](theory.prediction-bound). [Table I](table.any-reading) is not reproduced.",
    guess="Does DRC-APO [track better](order.apo-below-pmi) than DRC-PMI, and [settle better](order.transient)? It "
    "depends on which DRC-PMI is meant and where observers start.",
    headline="[The stability result](-theory.stability) is false: this loop meets its condition (18) and diverges",
    picture=Traces(
        figure="shao-counter-example",
        last=4.0,
        across="time_s",
        x="time (s), from a start at 1",
        y="output of the loop",
        text="Our loop: ẋ = x + u, feedback −2, observer gain 2, one measurement in 5 control periods of 1 ms. It "
        "meets all that the theorem asks.",
        curves=(
            Curve(label="as printed", columns=("alternating_predictive",)),
            Curve(label="with a true fast sensor", columns=("fast_sensor",), quiet=True),
        ),
    ),
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
            title="At short periods the loop grows as printed, and decays with a true fast sensor",
            moves="Move the time, or the fast period.",
            text="The counter-example: its state in time, and the rate at which it grows. At short periods the "
            "restarted "
            "predictor does nearly what a fast sensor does; the printed one does not.",
            pictures=(
                _compared("counter-example", "in time", "time_s", "time (s)", "state x", 4.0, fast=True),
                _compared("rates", "period", "period_s", "fast period T (s)", "slowest rate (1/s)", 0.01, fast=True),
            ),
        ),
        Explorer(
            title="On the motor a held measurement makes the estimate late",
            moves="Move the ratio of both periods, or the frequency of the reference.",
            text="The mean lag of the estimate for a slow reference, and the largest steady-state error.",
            pictures=(
                _compared("lag", "ratio", "ratio", "ratio M of the periods", "lag of the estimate (s)", 6),
                _compared(
                    "error-frequency",
                    "frequency",
                    "frequency_rad_s",
                    "frequency (rad/s)",
                    "tracking error (%)",
                    0.5,
                    fast=True,
                ),
            ),
        ),
    ),
)
