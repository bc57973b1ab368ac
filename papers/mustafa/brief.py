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
    card="The abstract can be read as giving [robust levels](-robust-level.1). They are nominal: over all sampling "
    "sequences the gain is larger, [in both examples](-robust-level.2).",
    holds="At one constant period the levels are right: [Example 1](gamma.1), [Example 2](gamma.2). "
    "[The printed filter](filter.norm) has the level printed for it.",
    correct="Levels are nominal, as Sec. V-A says, not [robust](robust-level.1); [one grid element](condition-8.1) "
    "does not cover the first range; [case U3](u3) and [two maps](map) are misprinted.",
    guess="Why the grids have [one element](grid.1) each: of the readings tried, only the square root of "
    "[step 4](algorithm) lets one cover both ranges.",
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
