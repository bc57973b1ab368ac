"""What leads the report on this paper."""

from __future__ import annotations

from papers._sketch import FIRST, LAST, curve, dots, label, signal
from replication.audit.brief import Brief, Draws, Sketch, Stroke

STEP = 24
FIRST_SENSOR, SECOND_SENSOR = range(22, LAST, 2 * STEP), range(22, LAST, 3 * STEP)


def _uncertainty() -> Stroke:
    """It grows between measurements and shrinks at each, more if both sensors measure."""
    upper, lower, width = [], [], 5.0
    for x in range(FIRST + 14, LAST, 4):
        width += 1.1
        for sensor, factor in ((FIRST_SENSOR, 0.65), (SECOND_SENSOR, 0.6)):
            if x in sensor:
                width *= factor
        upper.append((float(x), round(signal(x) - 10 - width, 1)))
        lower.append((float(x), round(signal(x) - 10 + width, 1)))
    return Stroke(draws=Draws.BAND, points=(*upper, *reversed(lower)))


BRIEF = Brief(
    topic="Sensors that tick at different rates",
    card="The stable plant's levels hold, except [one](-table1.n21) in Table 1; [both](+theory.theorem1) "
    "[theorems](+theory.theorem2) are tight at its gains and designs. Sec. IV-C prints [a stable "
    "matrix](?diagonal-of-a).",
    holds="To one part in a million [Theorem 1](theory.theorem1) is tight at four gain sets, "
    "[Theorem 2](theory.theorem2) at all designs; [levels](gamma.proposed) and [timings](timing.case-2) come out.",
    correct="[Table 1](table1.n21), entry (2, 1), exceeds the rounded optimum. Eq. (4) [counts](sensor-index) "
    "states for sensors, and Fig. 1 [names](noise-index) an entry off the diagonal.",
    guess="Which noises [eq. (34)](denominator) divides by; which [matrices](unstable.same-setting) Sec. IV-C has; "
    "whether the sentence that [shorter periods](order.shorter-in-general) help is meant beyond Table 1.",
    sketch=Sketch(
        alt="Two sensors with periods two and three; the uncertainty of the estimate grows between measurements and "
        "shrinks at each.",
        strokes=(
            _uncertainty(),
            curve(Draws.TRUTH, lambda x: signal(x) - 10),
            dots(Draws.MEASURED, FIRST_SENSOR, lambda x: 124),
            dots(Draws.MEASURED, SECOND_SENSOR, lambda x: 142),
            label("y₁", 0, 129, Draws.LABEL_OURS),
            label("y₂", 0, 147, Draws.LABEL_OURS),
        ),
    ),
)
