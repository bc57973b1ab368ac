"""A sketch as SVG: lines, areas, dots and ticks in the colours of the page, labels as text."""

from __future__ import annotations

from markupsafe import Markup, escape

from replication.audit.brief import Draws, Sketch, Stroke
from replication.audit.report.templates import seen

WIDTH, HEIGHT = 320, 150
_RADIUS = {Draws.MEASURED: 4.4, Draws.VIRTUAL: 3.0}
_TICK = {Draws.TICK: 6, Draws.TICK_OURS: 11}


def drawn(sketch: Sketch) -> Markup:
    """The sketch; its words are escaped, its numbers are numbers."""
    parts = Markup("").join(Markup(_part(stroke)) for stroke in sketch.strokes)
    return Markup('<svg class="art" role="img" viewBox="0 0 {} {}" aria-label="{}">{}</svg>').format(
        WIDTH, HEIGHT, seen(sketch.alt), parts
    )


def _part(stroke: Stroke) -> str:
    points, kind = stroke.points, stroke.draws
    if kind in _RADIUS:
        return "".join(f'<circle class="{kind}" cx="{x:g}" cy="{y:g}" r="{_RADIUS[kind]}"/>' for x, y in points)
    if kind in (Draws.LABEL, Draws.LABEL_OURS):
        return "".join(
            f'<text class="{kind}" x="{x:g}" y="{y:g}">{escape(seen(stroke.text))}</text>' for x, y in points
        )
    if kind in _TICK:
        steps = "".join(f"M{x:g} {y:g}v-{_TICK[kind]}" for x, y in points)
        return f'<path class="{kind}" d="{steps}"/>'
    line = " ".join(f"{x:g} {y:g}" for x, y in points)
    return f'<path class="{kind}" d="M{line}{"Z" if kind is Draws.BAND else ""}"/>'
