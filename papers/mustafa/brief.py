"""What leads the report on this paper."""

from __future__ import annotations

from papers._sketch import curve, dots, label, signal, ticks
from replication.audit.brief import Brief, Draws, Sketch

SAMPLED = (14, 24, 49, 54, 92, 110, 116, 151, 159, 194, 203, 238, 246, 252, 289, 302)
DESIGNED = [14 + 19.2 * step for step in range(16)]


def _higher(x: float) -> float:
    """The signal, with room for two rows of ticks below."""
    return signal(x) - 14


BRIEF = Brief(
    topic="Samples at irregular instants",
    card="The levels [come out](+gamma.1) at each grid's [one period](+filter.norm); Sec. V-A calls such levels "
    "nominal. Over all sequences the gain is larger, [in](-valid.1) [both examples](-valid.2).",
    holds="At the period of its grid [each](gamma.1) [level](filter.norm) comes out; both examples are "
    "[stable](stable.1) [throughout](stable.2); [one element](condition-8.2) satisfies (8) on the second range.",
    correct="[What solves (6)](valid.1) on the grid does not elsewhere; [one](grid.1) [element](condition-8.1) "
    "does not cover the first range; [case U3](u3) and [two maps](map) are misprinted.",
    guess="Whether the abstract promises its levels [for every sequence](robust-level.1) or for the grid; what "
    "[step 4](algorithm) means; whether the printed filter is [an observer](filter.first-column).",
    sketch=Sketch(
        alt="A signal is sampled at irregular instants, while the level of the filter belongs to one constant period.",
        strokes=(
            curve(Draws.TRUTH, _higher),
            dots(Draws.MEASURED, SAMPLED, _higher),
            ticks(Draws.TICK, DESIGNED, 118),
            ticks(Draws.TICK_OURS, SAMPLED, 147),
            label("designed for", 8, 106),
            label("sampled at", 8, 134, Draws.LABEL_OURS),
        ),
    ),
)
