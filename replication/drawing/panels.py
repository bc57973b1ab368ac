"""Figures of the library's results, drawn from their panels in the house style; the only place that draws them."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from replication.drawing import svg
from replication.drawing.panel import Panel
from replication.drawing.style import house_style, line, new_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Figure


def draw(panels: Sequence[Panel]) -> Figure:
    """One set of axes for each panel, one above the other."""
    with house_style():
        figure, every = new_axes(len(panels), row_height=2.4 if len(panels) == 1 else 1.6, share_x=len(panels) > 1)
        for axes, panel in zip(every, panels, strict=True):
            for i, (name, values) in enumerate(panel.lines.items()):
                axes.plot(panel.x, values, label=name, drawstyle="steps-post" if panel.steps else "default", **line(i))
            for i, (name, level) in enumerate(panel.levels.items(), start=len(panel.lines)):
                axes.axhline(level, label=f"{name} {level:.4g}", **line(i))
            axes.set_ylabel(panel.y_label)
            if len(panel.lines) + len(panel.levels) > 1:
                axes.legend()
        every[-1].set_xlabel(panels[-1].x_label)
    return figure


def draw_svg(panels: Sequence[Panel], name: str) -> str:
    """The same as a small stand-alone SVG file, the same bytes every time; `name` starts its ids."""
    return as_svg(draw(panels), name)


def as_svg(figure: Figure, name: str) -> str:
    """Any figure in the house style as such a file."""
    import matplotlib as mpl

    with house_style(), mpl.rc_context({"svg.hashsalt": name}):
        stream = io.StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    return svg.tidy(stream.getvalue(), name)
