"""What the methods cost against n·K: seconds as published and as measured, and the size of the programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from papers.peet2019.claims.cost import FROM_PRODUCT, exponent
from papers.peet2019.figures import columns
from papers.peet2019.printed import DATA, published
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import FOREGROUND, GREY, OURS, RAISED, name_axes, name_end, new_axes, say

WAYS = {"bessel": "small cone", "total": "full cone", "plain": "cvxpy"}
STYLES = {
    "published": (FOREGROUND, "-", "o"),
    "small cone": (OURS, "-", "^"),
    "full cone": (GREY, "--", "s"),
    "cvxpy": (GREY, ":", "x"),
}
"""Colour, dashes and marker of each cloud of points."""
CLOUDS = (
    ("published", "published_product", "published_seconds"),
    *((label, f"{way}_measured_product", f"{way}_seconds") for way, label in WAYS.items()),
    ("small cone", "bessel_measured_product", "bessel_equalities"),
    ("full cone", "total_product", "total_equalities"),
)
"""Name, abscissa and ordinate of each cloud."""


def cost(results: Results) -> FigureData:
    """Published seconds, our CPU seconds as recorded, and the equalities of both cones, against n·K."""
    cells = results["sizes"]["cells"]
    found: dict[str, list[float]] = {
        "published_product": [n * k for n, k, _ in published()],
        "published_seconds": [float(seconds) for *_, seconds in published()],
        "total_product": [cell["states"] * cell["delays"] for cell in cells],
        "total_equalities": [cell["equalities"] for cell in cells],
    }
    for way in WAYS:
        ours = [c for c in results["measured"]["cells"] if c["cone"] == way and c["cpu_seconds"] is not None]
        found[f"{way}_measured_product"] = [c["states"] * c["delays"] for c in ours]
        found[f"{way}_seconds"] = [c["cpu_seconds"] for c in ours]
        if way == "bessel":
            found[f"{way}_equalities"] = [c["equalities"] for c in ours]
    return columns(**found)


def plot_cost(figure: FigureData) -> Any:
    """Both on logarithmic axes; the line through each cloud has the exponent that stands beside its name."""
    drawing, panels = new_axes(2, row_height=2.6)
    for name, x, y in CLOUDS:
        _plot_cloud(panels["equalities" in y], name, *(figure.columns[key] for key in (x, y)))
    for axis, label in zip(panels, ("CPU time (s)", "equalities of our program"), strict=True):
        axis.set_xlim(0.8, 130)
        axis.set_xticks((1, 10, 100), ("1", "10", "100"))
        axis.minorticks_off()
        axis.set_ylim(top=10 * axis.get_ylim()[1])
        name_axes(axis, label)
    panels[-1].set_xlabel("product nK")
    return drawing


def _plot_cloud(axis: Any, name: str, products: Sequence[float], costs: Sequence[float]) -> None:
    colour, dashes, marker = STYLES[name]
    axis.loglog(products, costs, marker, markersize=4, color=colour, markerfacecolor="none")
    points = [(k, cost) for k, cost in zip(products, costs, strict=True) if k >= FROM_PRODUCT]
    slope = exponent(points)
    at = math.exp(sum(math.log(cost / k**slope) for k, cost in points) / len(points))
    ends = [min(points)[0], max(points)[0]]
    (curve,) = axis.loglog(ends, [at * k**slope for k in ends], color=colour, linestyle=dashes, linewidth=1.1)
    if name == "cvxpy":  # its line is short, and ends among the points of others
        say(axis, f"{name},\n{_power(slope)}", (ends[0], 10 * max(costs[:5])), ha="right", color=colour)
    else:
        name_end(axis, curve, f"{name},\n{_power(slope)}", lift=6 if name == "full cone" else -6)


def _power(slope: float) -> str:
    """(nK) with a raised exponent."""
    return f"(nK){f'{slope:.1f}'.translate(RAISED).replace('.', '·')}"


def growth(figure: FigureData, x: str, y: str) -> float:
    """Exponent with which one column grows with another, from the product on from which it is asked."""
    pairs = zip(figure.columns[x], figure.columns[y], strict=True)
    return exponent([pair for pair in pairs if pair[0] >= FROM_PRODUCT])


def say_cost(figure: FigureData) -> str:
    """The message: both exponents."""
    printed, ours = (growth(figure, x, y) for _, x, y in CLOUDS[:2])
    return f"Seconds grow with nK to the power {printed:.1f} in print, {ours:.1f} with our small cone"


def describe_cost(figure: FigureData) -> str:
    """The largest cell of each, and the exponents of growth."""
    c = figure.columns
    parts = [
        f"{name}, {'seconds' if 'seconds' in y else 'equalities'} up to {max(c[y]):.4g} at nK = {max(c[x]):g}, "
        f"exponent {growth(figure, x, y):.2f} (near {growth(figure, x, y):.1f})"
        for name, x, y in CLOUDS
    ]
    return f"All rise with nK (exponents from nK = {FROM_PRODUCT}): {'; '.join(parts)}."


FIGURES = (
    Figure(
        name="cost",
        place="Table I",
        title=say_cost,
        caption=(
            "CPU seconds, published and ours as once measured (machines and solvers do not compare; cvxpy: the full "
            "cone by cvxpy), "
            f"and the size of our programs. The paper's cells end at n·K = {DATA['largest-product']}; exponents are "
            f"fitted from n·K = {FROM_PRODUCT} on."
        ),
        published=False,
        uses=("sizes", "measured"),
        data=cost,
        plot=plot_cost,
        alt=describe_cost,
    ),
)
