"""Figures of the library's results, drawn from their panels in the house style; the only place that draws them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from replication.drawing import svg
from replication.drawing.style import BAND, house_style, line, name_axes, new_axes, say

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Figure
    from matplotlib.lines import Line2D


ROW, MARK, ROOM = 52, 9, 0.25
"""Characters of a row of names, those that the mark of each takes, and the share of the axes that a row is given."""


MARKS = "o^sxv"


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over a common axis x (M,). levels: horizontal lines. steps: values are held until the next x. band: lower
    and upper end of what is shaded, each (M,) or a number. dots: values are apart, and none lies between them."""

    x: npt.NDArray[Any]
    x_label: str
    y_label: str
    lines: Mapping[str, npt.NDArray[Any]]
    levels: Mapping[str, float]
    steps: bool = False
    band: tuple[Any, Any] | None = None
    dots: bool = False


def draw(panels: Sequence[Panel]) -> Figure:
    """One set of axes for each panel, one above the other."""
    alike = len({panel.x_label for panel in panels}) == 1
    with house_style():
        height = 2.4 if len(panels) == 1 else 1.6
        figure, every = new_axes(len(panels), row_height=height, share_x=alike and len(panels) > 1)
        for axes, panel, below in zip(every, panels, (*panels[1:], None), strict=True):
            _draw_panel(axes, panel)
            if below is None or below.x_label != panel.x_label:
                axes.set_xlabel(panel.x_label)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    """The curves of one panel and its levels, each level with its name and value on it."""
    drawn = "steps-post" if panel.steps else "default"

    def apart(i: int) -> dict[str, Any]:
        """Another mark for each curve, if its values are."""
        return {"linestyle": "none", "marker": MARKS[i % len(MARKS)], "markersize": 2.5} if panel.dots else {}

    if panel.band:
        axes.fill_between(panel.x, *panel.band, facecolor=BAND, alpha=0.55, linewidth=0, zorder=0)
    curves = [
        axes.plot(panel.x, values, label=name, drawstyle=drawn, **line(i) | apart(i))[0]
        for i, (name, values) in enumerate(panel.lines.items())
    ]
    for i, (name, level) in enumerate(panel.levels.items(), start=len(panel.lines)):
        axes.axhline(level, label=name, **line(i))
        highest = level == max(panel.levels.values())
        say(axes, f"{name} {level:.4g}", (panel.x[0], level), side=1 if highest else -1, ha="left")
    if panel.levels:
        # A gain is told against zero: a curve that is flat to rounding then looks flat, too.
        top = max(*panel.levels.values(), *(max(values) for values in panel.lines.values()))
        axes.set_ylim(0, 1.2 * top)
    name_axes(axes, panel.y_label)
    if len(curves) > 1:
        _legend(axes, curves)


def _legend(axes: Axes, curves: Sequence[Line2D]) -> None:
    """The names in rows above the curves, with room made for them: no curve runs through a name."""
    names = [str(curve.get_label()) for curve in curves]
    columns = next(count for count in (len(names), 2, 1) if count == 1 or _width(names, count) <= ROW)
    low, high = axes.get_ylim()
    rows = -(-len(names) // columns)
    axes.set_ylim(low, high + rows * ROOM * (high - low))
    axes.legend(handles=curves, loc="upper left", ncols=columns)


def _width(names: Sequence[str], columns: int) -> int:
    """Characters of a row of names with their marks, each as wide as the widest of its column."""
    rows = -(-len(names) // columns)
    return sum(MARK + max(map(len, names[i : i + rows])) for i in range(0, len(names), rows))


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
