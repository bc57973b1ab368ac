"""House style of the figures: sizes, colours that hold on white and on dark paper, line styles that differ beside them.

matplotlib is imported inside the functions, so that commands which draw nothing start fast. Axes and text are drawn in
`FOREGROUND`, which `svg.tidy` turns into `currentColor`: an inlined figure then follows the text colour of its page.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from replication.errors import InvalidInputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOREGROUND = "#010203"
"""Stands for the text colour of the page; no figure may use it for anything else."""

COLOURS = ("#1f77b8", "#c8561b", "#168a62", "#a75a97", "#96780a", "#777777")
"""Line colours in the manner of Okabe and Ito, each with a contrast of at least 3:1 on white and on near-black."""

LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2)))
"""Line styles, one per colour, for readers who cannot tell the colours apart."""

FONTS = ("DejaVu Sans", "Verdana")
"""The text stays text; the second font has nearly the widths of the first, with which the layout is made."""

WIDTH = 6.4
"""Width of a figure in inches, the text width of the report: the font size below is then that of its tables."""


def line(index: int) -> dict[str, Any]:
    """Keywords of `Axes.plot` for the curve number `index`: colour and line style, both distinct up to six curves."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": LINES[index % len(LINES)]}


def new_axes(
    rows: int = 1, columns: int = 1, *, row_height: float = 1.6, share_x: bool = True
) -> tuple[Figure, list[Axes]]:
    """Return a figure of the house width and its axes, row by row; row_height in inches.

    Raises InvalidInputError if there is no axis to draw or the height is not positive.
    """
    if rows < 1 or columns < 1 or not row_height > 0:
        raise InvalidInputError(
            f"a figure needs at least one row and column of positive height, got {rows} x {columns}, {row_height} in"
        )
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, rows * row_height + 0.5), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=share_x, squeeze=False)
    return figure, list(axes.flat)


@contextmanager
def house_style() -> Iterator[None]:
    """Set the style for figures that are made and saved inside the block; leaves the global settings alone."""
    import matplotlib as mpl
    from cycler import cycler

    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_settings(cycler(color=COLOURS) + cycler(linestyle=LINES)))
        yield


def _settings(cycle: Any) -> Any:
    ink = dict.fromkeys(
        ("text.color", "axes.labelcolor", "axes.edgecolor", "axes.titlecolor", "xtick.color", "ytick.color"), FOREGROUND
    )
    return ink | {
        "axes.prop_cycle": cycle,
        "axes.linewidth": 0.7,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.facecolor": "none",
        "axes.grid": True,
        "axes.titlesize": 9,
        "axes.titlelocation": "left",
        "axes.labelsize": 9,
        "figure.facecolor": "none",
        "savefig.facecolor": "none",
        "grid.color": FOREGROUND,
        "grid.alpha": 0.13,
        "grid.linewidth": 0.6,
        "font.family": "sans-serif",
        "font.sans-serif": list(FONTS[:1]),
        "font.size": 9,
        "legend.fontsize": 8.5,
        "legend.frameon": False,
        "lines.linewidth": 1.2,
        "lines.markersize": 4,
        "xtick.labelsize": 8.5,
        "ytick.labelsize": 8.5,
        "xtick.major.width": 0.7,
        "ytick.major.width": 0.7,
        "svg.fonttype": "none",
    }
