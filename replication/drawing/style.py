"""House style of the figures: a narrow column, colours of the report, curves that differ without colour as well.

matplotlib is imported inside the functions, so that commands which draw nothing start fast. Axes and text are drawn in
`FOREGROUND`, which `panels.tidy` turns into `currentColor`, and the other colours become those of the page in
`panels.inner`: an inlined figure follows its page, light or dark.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

from replication.errors import InvalidInputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


FOREGROUND = "#010203"
"""Stands for the text colour of the page; no figure may use it for anything else."""

OURS, GREY, SOFT, BAND, REFUTED = "#0b5cbd", "#5f6c79", "#dbe9fa", "#d4dbe2", "#c4261a"
"""What is ours; references; an area of ours; an area out of bounds, or the values that round to a print; a loop that is
printed and refuted."""

TOKENS = {OURS: "--ours", GREY: "--open", SOFT: "--soft", BAND: "--band", REFUTED: "--fails"}
"""The custom property of the report's style sheet that each colour is in the light, and its partner in the dark."""

COLOURS = (OURS, FOREGROUND, GREY, OURS, FOREGROUND, GREY)
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)))
"""Six curves: no two have the same dashes, so that each is known without its colour."""
WIDTHS = (1.8, 1.3, 1.3, 1.8, 1.3, 1.3)

FONTS = ("DejaVu Sans", "Verdana")
"""The text stays text; the second font has nearly the widths of the first, with which the layout is made."""

WIDTH, FONT_SIZE = 4.44, 11
"""Width in inches, that of the narrowest telephone, so that all text is at least 11 pixels high there."""


def line(index: int) -> dict[str, Any]:
    """Keywords of `Axes.plot` for the curve number `index`: colour, dashes and weight, distinct up to six curves."""
    k = index % len(LINES)
    return {"color": COLOURS[k], "linestyle": LINES[k], "linewidth": WIDTHS[k]}


def new_axes(
    rows: int = 1, columns: int = 1, *, row_height: float = 1.6, share_x: bool = True, **more: Any
) -> tuple[Figure, list[Axes]]:
    """Return a figure of the house width and its axes, row by row; row_height in inches, more: as for `subplots`.

    Raises InvalidInputError if there is no axis to draw or the height is not positive.
    """
    if rows < 1 or columns < 1 or not row_height > 0:
        raise InvalidInputError(
            f"a figure needs at least one row and column of positive height, got {rows} x {columns}, {row_height} in"
        )
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, rows * row_height + 0.5), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=share_x, squeeze=False, **more)
    return figure, list(axes.flat)


@contextmanager
def house_style() -> Iterator[None]:
    """Set the style for figures that are made and saved inside the block; leaves the global settings alone."""
    import matplotlib as mpl
    from cycler import cycler

    with mpl.rc_context():
        mpl.rcdefaults()
        cycle = cycler(color=COLOURS) + cycler(linestyle=LINES) + cycler(linewidth=WIDTHS)
        mpl.rcParams.update({**SETTINGS, "axes.prop_cycle": cycle})
        yield


INK = ("text.color", "axes.labelcolor", "axes.edgecolor", "axes.titlecolor", "xtick.color", "ytick.color")
SIZES = ("font.size", "axes.titlesize", "axes.labelsize", "legend.fontsize", "xtick.labelsize", "ytick.labelsize")
SETTINGS: Any = {
    **dict.fromkeys(INK, FOREGROUND),
    **dict.fromkeys(SIZES, FONT_SIZE),
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.facecolor": "none",
    "axes.grid": True,
    "axes.grid.axis": "y",
    "axes.titlelocation": "left",
    "axes.titlepad": 5,
    "axes.unicode_minus": True,
    "axes.xmargin": 0.02,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "grid.color": FOREGROUND,
    "grid.alpha": 0.13,
    "grid.linewidth": 0.6,
    "font.family": "sans-serif",
    "font.sans-serif": list(FONTS[:1]),
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "lines.markersize": 5,
    "path.simplify_threshold": 0.25,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.minor.size": 0,
    "ytick.minor.size": 0,
    "svg.fonttype": "none",
}


GAP = 4
"""Points between a curve and its name."""
_ANCHOR = {-1: ("top", -GAP), 0: ("center", 0), 1: ("bottom", GAP)}
_ASIDE = {"left": GAP, "center": 0, "right": -GAP}


def name_axes(axes: Axes, y: str = "", x: str = "", *, ticks: int = 4) -> None:
    """Name what is measured: `y` above the axis, where it costs no width; at most `ticks` + 1 lines across.

    Powers of ten are written at the size of all text; ticks that have words of their own keep them.
    """
    if y:
        axes.set_title(y)
    if x:
        axes.set_xlabel(x)
    if axes.get_yscale() == "linear":
        axes.locator_params(axis="y", nbins=ticks)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log" and type(axis.get_major_formatter()).__name__ == "LogFormatterSciNotation":
            axis.set_major_formatter(lambda value, _: decade(value))
            axis.set_minor_formatter(lambda value, _: "")


def decade(value: float) -> str:
    """A power of ten: as a number where that is short, else with raised digits."""
    power = round(math.log10(value))
    return f"{10.0**power:g}" if -PLAIN <= power <= PLAIN else f"10{str(power).translate(RAISED)}"


PLAIN, RAISED = 3, str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Up to which power of ten zeros are counted at a glance; the raised digits of the others."""


def name_line(axes: Axes, curve: Line2D, text: str, at: float, *, side: int = 1, **more: Any) -> None:
    """Write `text` at abscissa `at` of `curve`, in its colour: above it (side 1), below it (-1) or across (0)."""
    import numpy as np

    x, y = (np.asarray(values, dtype=float) for values in curve.get_data())
    order = np.argsort(x, kind="stable")
    height = float(np.interp(at, x[order], y[order]))
    say(axes, text, (at, height), side=side, color=str(curve.get_color()), **more)


def name_end(axes: Axes, curve: Line2D, text: str, *, lift: float = 0.0, **more: Any) -> None:
    """Write `text` right of the last point of `curve`, in its colour; lift: points upwards, to part two names."""
    x, y = (list(values)[-1] for values in cast(Any, curve.get_data()))
    axes.annotate(
        text, (x, y), xytext=(GAP + 1, lift), textcoords="offset points", va="center",
        color=curve.get_color(), annotation_clip=False, **more,
    )  # fmt: skip


def say(
    axes: Axes, text: str, point: Sequence[float], *, side: int = 1, ha: str = "center", color: str = FOREGROUND,
    **more: Any,
) -> None:  # fmt: skip
    """Write `text` above (side 1), below (-1) or at (0) a point of the axes, given in the units of the data."""
    va, gap = _ANCHOR[side]
    axes.annotate(
        text, (point[0], point[1]), xytext=(_ASIDE[ha], gap), textcoords="offset points", ha=ha, va=va, color=color,
        annotation_clip=False, **more,
    )  # fmt: skip


def out_of_bounds(axes: Axes, low: float, high: float, text: str = "", *, at: float = 0.02) -> None:
    """Shade heights from `low` to `high`, say where a loop is unstable; its words begin at the share `at` across."""
    axes.axhspan(low, high, facecolor=BAND, alpha=0.55, linewidth=0, zorder=0)
    if text:
        across = axes.get_yaxis_transform()
        axes.text(at, high, text, transform=across, ha="left", va="top", color=FOREGROUND)


def rms(values: Sequence[float]) -> float:
    """Root mean square."""
    return float((sum(value * value for value in values) / len(values)) ** 0.5)


def mark_clipped(axes: Axes, x: Sequence[float], y: Sequence[float], limit: float, color: str) -> int:
    """A triangle at the edge for every value beyond plus or minus `limit`; how many there are."""
    count = 0
    for edge, marker in ((limit, "^"), (-limit, "v")):
        beyond = [at for at, value in zip(x, y, strict=True) if value / edge > 1]
        axes.plot(beyond, [0.9 * edge] * len(beyond), marker, markersize=4, color=color, linestyle="none")
        count += len(beyond)
    return count
