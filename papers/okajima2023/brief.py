"""What leads the report on this paper."""

from __future__ import annotations

from papers._sketch import FIRST, LAST, curve, dots, label, signal
from papers.okajima2023.experiments.declared import table_claim
from papers.okajima2023.printed import TABLE_1
from replication.audit.brief import Brief, Curve, Draws, Entries, Explorer, Picture, Sketch, Stroke, Ticks

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


_Y1, _Y2 = Ticks(label="y₁", period=2), Ticks(label="y₂", period=3)
_COMMON, _COMMON_2 = Ticks(label="y₁", period=6), Ticks(label="y₂", period=6)
SHOWN_LAST = 60.0
"""The last instant of the error curves, so that single measurements can be seen."""


def _case(label: str, name: str, claim: str, *sensors: Ticks) -> Picture:
    """The error of one observer of Sec. IV-A over that of the proposed one."""
    errors = {case: tuple(f"{case}_e_{i}" for i in (1, 2, 3)) for case in ("proposed", name)}
    reference = Curve(label="each at its own period", columns=errors["proposed"], quiet=True)
    return Picture(
        label=label,
        figure="okajima2023-fig2-5",
        across="k",
        x="instant k",
        y="size of the error |e(k)|",
        last=SHOWN_LAST,
        claim=f"gamma.{claim}",
        sensors=sensors,
        curves=(*((reference,) if name != "proposed" else ()), Curve(label="this observer", columns=errors[name])),
    )


BRIEF = Brief(
    topic="Sensors that tick at different rates",
    card="Every level of the [stable plant](+gamma.proposed) is right but [one](-table1.n21), in its last digit. The "
    "unstable plant is printed with [a stable matrix](-unstable.is-unstable).",
    holds="All levels of the stable plant ([its own](gamma.proposed), [Cases A](gamma.case-a), [B](gamma.case-b), "
    "[C](gamma.case-c), Table 1) but one, and the [level](gains.eq33) of all four printed gain sets.",
    correct=f"[Table 1](table1.n21) prints {TABLE_1[2, 1]} for periods (2, 1); the optimum is {{table1.n21}}. Eq. (41) "
    "repeats the stable matrix, with which gains (42) [diverge](unstable.stabilised).",
    guess="Which noises [eq. (34)](denominator) divides by; which [plant](unstable.same-setting) Sec. IV-C has; "
    "whether [shorter periods](order.shorter-in-general) are said to help beyond Table 1.",
    verdict="theorems hold",
    headline="Table 1, periods (2, 1), should say [{table1.n21:not}](table1.n21); every other level of the table is "
    "right",
    picture=Entries(
        columns=tuple(f"{first}, {second}" for first, second in TABLE_1),
        rows=(("level γ", tuple(table_claim(periods) for periods in TABLE_1)),),
    ),
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
    explorers=(
        Explorer(
            title="Two sensors, each read at its own pace, give the lowest of four levels",
            moves="Choose what the observer reads.",
            text="Blue is the size of its estimation error under one draw of noise, grey that of the observer that "
            "reads both sensors at their own periods. For Cases A to C the gains are ours, none being printed. Ticks "
            "are measurements.",
            pictures=(
                _case("both sensors, each at its own period", "proposed", "proposed", _Y1, _Y2),
                _case("y₁ alone (Case A)", "A", "case-a", _Y1),
                _case("y₂ alone (Case B)", "B", "case-b", _Y2),
                _case("both at their common period (Case C)", "C", "case-c", _COMMON, _COMMON_2),
            ),
        ),
        Explorer(
            title="Timing alone moves the level",
            moves="Move the offset.",
            text="Both sensors keep their periods; the second starts later by the offset. The best offset is "
            "not always zero. A curve ends where the timings repeat.",
            pictures=(
                Picture(
                    label="offset",
                    figure="okajima2023-timing",
                    across="offset",
                    x="offset θ₂ (instants)",
                    y="optimal level γ",
                    begin=1.0,
                    curves=tuple(
                        Curve(label=f"periods ({first}, {second})", columns=(f"gamma_{first}_{second}",))
                        for first, second in ((6, 6), (4, 6), (5, 5), (6, 3), (4, 4), (3, 3))
                    ),
                ),
            ),
        ),
    ),
)
