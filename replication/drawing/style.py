"""House style of the figures: a narrow column, colours of the report, curves that differ without colour as well.

matplotlib is imported inside the functions, so that commands which draw nothing start fast. Axes and text are drawn in
`FOREGROUND`, which `svg.tidy` turns into `currentColor`, and the other colours become those of the page in `svg.inner`:
an inlined figure follows its page, light or dark.
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

OURS, GREY, SOFT, BAND = "#0b5cbd", "#5f6c79", "#dbe9fa", "#d4dbe2"
"""What is ours; references; an area of ours; an area out of bounds, or the values that round to a print."""

TOKENS = {OURS: "--link", GREY: "--open", SOFT: "--soft", BAND: "--band"}
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
        mpl.rcParams.update(_settings(cycler(color=COLOURS) + cycler(linestyle=LINES) + cycler(linewidth=WIDTHS)))
        yield


def _settings(cycle: Any) -> Any:
    ink = dict.fromkeys(
        ("text.color", "axes.labelcolor", "axes.edgecolor", "axes.titlecolor", "xtick.color", "ytick.color"), FOREGROUND
    )
    sizes = dict.fromkeys(
        ("font.size", "axes.titlesize", "axes.labelsize", "legend.fontsize", "xtick.labelsize", "ytick.labelsize"),
        FONT_SIZE,
    )
    return ink | sizes | {
        "axes.prop_cycle": cycle,
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
    }  # fmt: skip
