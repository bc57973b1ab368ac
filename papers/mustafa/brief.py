"""What leads the report on this paper."""

from __future__ import annotations

from papers._sketch import curve, dots, label, signal, ticks
from replication.audit.brief import Bars, Brief, Curve, Draws, Explorer, Pair, Picture, Sketch

SAMPLED = (14, 24, 49, 54, 92, 110, 116, 151, 159, 194, 203, 238, 246, 252, 289, 302)
DESIGNED = [14 + 19.2 * step for step in range(16)]


def _higher(x: float) -> float:
    """The signal, with room for two rows of ticks below."""
    return signal(x) - 14


def _example(number: int, begin: float, whose: str) -> Picture:
    """Gains at one constant period, and over all sequences of periods; whose: whose filter it is."""
    return Picture(
        label=f"Example {number}, {whose} filter",
        figure="mustafa-levels",
        across=f"h_{number}",
        x="constant period h (s)",
        y="gain",
        begin=begin,
        curves=(
            Curve(label="all sequences, bounds", columns=(f"lower_{number}",), upper=f"upper_{number}"),
            Curve(label=f"{whose} filter, this period", columns=(f"filter_{number}",)),
            Curve(label="least, this period", columns=(f"optimum_{number}",), quiet=True),
            Curve(label="printed level", columns=(f"published_{number}",), quiet=True),
        ),
    )


BRIEF = Brief(
    topic="Samples at irregular instants",
    card="[Both printed](+gamma.1) [levels](+filter.norm) are right at one constant sampling period; the paper calls "
    "them nominal. If the period varies, [the](?robust-level.1) [gain](?robust-level.2) is several times larger.",
    holds="Both levels at the design period ([Example 1](gamma.1), [Example 2](filter.norm)); stability for every "
    "sequence of periods, in [both](stable.1) [examples](stable.2).",
    correct="One grid element does not cover the range of Example 1: it takes [{grid.1}](grid.1). [Case U3](u3) and "
    "[two maps](map) are misprinted.",
    guess="Does the abstract promise [the printed level](robust-level.1) for every period? What does "
    "[step 4](algorithm) of Algorithm 1 compute?",
    verdict="only at one period",
    headline="The printed accuracy is for one constant sampling period; if the period varies, the error can be "
    "[{robust-level.1:over:gamma.1}](robust-level.1) and [{robust-level.2:over:gamma.2}](robust-level.2) times as "
    "large, or more",
    picture=Bars(
        printed="printed, right at one constant period",
        bound="if the period varies",
        pairs=(
            Pair(
                label="Example 1, worst-case gain of our filter (none is printed)",
                printed="gamma.1",
                bound="robust-level.1",
            ),
            Pair(label="Example 2, worst-case gain of the printed filter", printed="gamma.2", bound="robust-level.2"),
        ),
    ),
    sketch=Sketch(
        alt="A signal is sampled at irregular instants, while the filter is designed for one constant period.",
        strokes=(
            curve(Draws.TRUTH, _higher),
            dots(Draws.MEASURED, SAMPLED, _higher),
            ticks(Draws.TICK, DESIGNED, 118),
            ticks(Draws.TICK_OURS, SAMPLED, 147),
            label("designed for", 8, 106),
            label("sampled at", 8, 131, Draws.LABEL_OURS),
        ),
    ),
    explorers=(
        Explorer(
            title="A level is designed at one period; spread costs more",
            moves="Move the constant period.",
            text="Each filter has the printed level at the period for which it was designed. If the period varies, its "
            "gain lies in the band far above. Example 1 prints no filter; ours stands for it. In the last picture the "
            "range of periods widens.",
            pictures=(
                _example(1, 0.0678, "our"),
                _example(2, 0.05, "printed"),
                Picture(
                    label="Example 1, our filter, wider range",
                    figure="mustafa-range",
                    across="h_u",
                    x="longest period h_u (s)",
                    y="gain over all sequences",
                    begin=0.1,
                    curves=(Curve(label="gain, bounds", columns=("lower",), upper="upper"),),
                ),
            ),
        ),
    ),
)
