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
    card="The levels [come out](+gamma.1) at each grid's [one period](+filter.norm); Sec. V-A calls such levels "
    "nominal. Over all sequences the gain is larger, [in](?robust-level.1) [both examples](?robust-level.2).",
    holds="At grid periods [levels](gamma.1) [come out](filter.norm); both examples (first: our filter) are "
    "[stable](stable.1) [throughout](stable.2); the second's [element](condition-8.2) satisfies (8) for constant "
    "changes, motor constant corrected.",
    correct="[One](grid.1) [element](condition-8.1) does not cover the range of Example 1; [case U3](u3) and [two "
    "maps](map) are misprinted.",
    guess="Whether abstract and Sec. VII mean [the printed level](robust-level.1), and for which periods; what "
    "[valid](valid.1) and [step 4](algorithm) mean; whether the filter is [an observer](filter.first-column).",
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
            text="Our filter in Example 1, where none is printed, has the printed level at the middle of the range "
            "alone; the printed filter of Example 2 from about half the middle up to it. Over all sequences of periods "
            "the gain of each lies in the band, far above. In the last picture the range of our filter itself widens.",
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
