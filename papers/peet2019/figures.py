"""Figures: Fig. 1, how near the methods come to the optimum, what they cost."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from papers._common import Columns
from papers.peet2019.claims.cost import FROM_PRODUCT, exponent
from papers.peet2019.claims.gains import optimum_of
from papers.peet2019.printed import DEGREES, published
from replication.audit.judge.numerals import short
from replication.audit.model import Results
from replication.drawing.style import FOREGROUND, GREY, OURS, line, name_axes, name_line, new_axes, out_of_bounds, say


def fig_1(results: Results) -> Columns:
    """Disturbance and both errors for one reading of the sinc."""
    simulation = results["fig1"]
    errors = {f"e_{i}": values for i, values in enumerate(simulation["e"], 1)}
    return {"t": simulation["t"], "w": simulation["w"]} | errors


_SIGNALS = {"w": "disturbance w", "e_1": "error e₁", "e_2": "error e₂"}


def plot_fig_1(c: Columns) -> Any:
    """Disturbance and errors against time on one axis, each named at its peak."""
    drawing, (axis,) = new_axes(row_height=2.6)
    t = c["t"]
    for index, (name, side) in enumerate((("e_1", -1), ("w", 1), ("e_2", 0))):
        (curve,) = axis.plot(t, c[name], **line(index))
        peak = t[_peak(c[name])]
        beside = side == 0
        name_line(axis, curve, _SIGNALS[name], peak / (1 + beside), side=side, ha="right" if beside else "left")
    axis.set(xlim=(-0.2 * t[-1], t[-1]), ylim=(1.25 * min(c["e_1"]), 1.25 * max(c["w"])))
    axis.set_xticks([share * t[-1] for share in (0, 0.25, 0.5, 0.75, 1)])
    name_axes(axis, "disturbance and errors", "time (s)")
    return drawing


def _peak(values: Sequence[float]) -> int:
    return max(range(len(values)), key=lambda i: abs(values[i]))


def _told_fig_1(c: Columns) -> dict[str, Any]:
    t = c["t"]
    tenth = 0.1 * max(map(abs, c["e_1"] + c["e_2"]))
    peaks = {name: _peak(values) for name, values in c.items() if name != "t"}
    return {
        "died_out": max(t for t, *e in zip(t, c["e_1"], c["e_2"], strict=True) if max(map(abs, e)) > tenth),
        "end": t[-1],
        "peaks": "; ".join(f"{name} is largest at {t[i]:.2f} s with {c[name][i]:.3f}" for name, i in peaks.items()),
    }


def convergence(results: Results) -> Columns:
    """Relative distance from the optimum of Example 2, the middle of its bracket, against order and degree.

    floor: half the relative width of that bracket; distances below it say nothing.
    """
    record, exact, bracket = results["convergence.ex2"], optimum_of("2", results), results["reference.ex2"]["exact"]
    levels = [results[f"sos.ex2.d{degree}"]["tensor"]["gamma"] for degree in DEGREES]

    def away(levels: Iterable[float]) -> list[float]:
        return [abs(level / exact - 1.0) for level in levels]

    return {
        "order": record["orders"],
        "pade": away(record["pade"]),
        "chebyshev": away(record["chebyshev"]),
        "degree": DEGREES,
        "sos": away(levels),
        "floor": [(bracket["upper"] - bracket["lower"]) / (2.0 * exact)],
    }


def against_delay(results: Results) -> Columns:
    """Least gain of Example 2 against its delay."""
    return {name: results["tau"][name] for name in ("tau", "sos", "chebyshev")}


_MODELS = {"pade": "Padé", "chebyshev": "collocation"}


def plot_convergence(c: Columns) -> Any:
    """Errors on a logarithmic axis; what lies below the bracket of the optimum is shaded."""
    drawing, (orders, degrees) = new_axes(
        1, 2, row_height=2.7, share_x=False, sharey=True, gridspec_kw={"width_ratios": (2, 1)}
    )
    for index, (name, side) in enumerate((("pade", -1), ("chebyshev", 1))):
        (curve,) = orders.semilogy(c["order"], c[name], marker="os"[index], markersize=4, **line(index))
        at = c["order"][2 + 2 * index]
        name_line(orders, curve, _MODELS[name], at, side=side, ha="right" if side < 0 else "left")
    degrees.semilogy(c["degree"], c["sos"], marker="D", markersize=4, **line(3))
    say(degrees, "Theorem 3", (c["degree"][1], c["sos"][1]), ha="left")
    for axis in (orders, degrees):
        out_of_bounds(axis, BOTTOM, c["floor"][0], "in the bracket" if axis is orders else "")
    orders.set(ylim=(BOTTOM, 3), xticks=[order for order in c["order"] if order % 2 == 0])
    degrees.set(xticks=c["degree"])
    name_axes(orders, "relative distance from the optimum", "order of the model")
    name_axes(degrees, "", "degree d")
    return drawing


BOTTOM = 1e-11
"""Lower end of the axis of relative distances, below all that the bracket tells apart."""


def _told_convergence(c: Columns) -> dict[str, Any]:
    models = zip(c["order"], c["pade"], c["chebyshev"], strict=True)
    first, last = (f"at order {c['order'][i]:g}" for i in (0, -1))
    return {
        # The largest order at which both models are farther than Theorem 3 at its last degree.
        "order": max(order for order, *away in models if min(away) > c["sos"][-1]),
        "last": c["degree"][-1],
        "models": "; ".join(
            f"{words}: {short(c[name][0], 2)} {first}, {short(c[name][-1], 2)} {last}"
            for name, words in _MODELS.items()
        ),
        "degrees": ", ".join(f"{short(e, 2)} at degree {d:g}" for d, e in zip(c["degree"], c["sos"], strict=True)),
        "bracket": short(c["floor"][0], 2),
    }


def plot_against_delay(c: Columns) -> Any:
    """A curve, and points that should lie on it."""
    drawing, (axis,) = new_axes(row_height=2.4)
    (sos,) = axis.semilogy(c["tau"], c["sos"], **line(0))
    axis.semilogy(c["tau"], c["chebyshev"], "o", color=FOREGROUND, markersize=5)
    name_line(axis, sos, "Theorem 3 (line)\nand collocation (points)", c["tau"][8], ha="right")
    axis.set_yticks((1, 2, 5, 10), ("1", "2", "5", "10"))
    axis.set_yticks([], minor=True)
    name_axes(axis, "least gain γ", "delay τ (s)")
    return drawing


def _told_against_delay(c: Columns) -> dict[str, Any]:
    tau, sos, chebyshev = c.values()
    apart = max(abs(a / b - 1.0) for a, b in zip(sos, chebyshev, strict=True))
    return {"rise": sos[-1] / sos[0], "high": sos[-1], "last": tau[-1], "apart": short(apart, 2)}


NAMES_AT = 150
"""Where the names of the clouds begin: right of all points."""
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


def cost(results: Results) -> Columns:
    """Published seconds, our CPU seconds as recorded, and the equalities of both cones, against n·K."""
    cells = results["sizes"]["cells"]
    columns: dict[str, list[float]] = {
        "published_product": [n * k for n, k, _ in published()],
        "published_seconds": [float(seconds) for *_, seconds in published()],
        "total_product": [cell["states"] * cell["delays"] for cell in cells],
        "total_equalities": [cell["equalities"] for cell in cells],
    }
    for way in WAYS:
        ours = [c for c in results["measured"]["cells"] if c["cone"] == way and c["cpu_seconds"] is not None]
        columns[f"{way}_measured_product"] = [c["states"] * c["delays"] for c in ours]
        columns[f"{way}_seconds"] = [c["cpu_seconds"] for c in ours]
        if way == "bessel":
            columns[f"{way}_equalities"] = [c["equalities"] for c in ours]
    return columns


def plot_cost(c: Columns) -> Any:
    """Both on logarithmic axes; the line through each cloud has the exponent that stands beside its name."""
    drawing, panels = new_axes(2, row_height=2.6)
    for name, x, y in CLOUDS:
        _plot_cloud(panels["equalities" in y], name, *(c[key] for key in (x, y)))
    for axis, label in zip(panels, ("CPU time (s)", "equalities of our program"), strict=True):
        axis.set(xlim=(0.8, NAMES_AT), ylim=(None, 10 * axis.get_ylim()[1]))
        axis.set_xticks((1, 10, 100), ("1", "10", "100"))
        axis.minorticks_off()
        name_axes(axis, label)
    panels[-1].set_xlabel("product nK")
    return drawing


def _plot_cloud(axis: Any, name: str, products: Sequence[float], costs: Sequence[float]) -> None:
    colour, dashes, marker = STYLES[name]
    axis.loglog(products, costs, marker, markersize=4, color=colour, markerfacecolor="none")
    points = _fitted(products, costs)
    slope = exponent(points)
    words = f"{name},\npower {slope:.1f}"
    at = math.exp(sum(math.log(cost / k**slope) for k, cost in points) / len(points))
    ends = [min(points)[0], max(points)[0]]
    axis.loglog(ends, [at * k**slope for k in ends], color=colour, linestyle=dashes, linewidth=1.1)
    if name == "cvxpy":  # its line is short, and ends among the points of others
        say(axis, words, (ends[0], 10 * max(costs[:5])), ha="right", color=colour)
    else:
        end = (NAMES_AT, at * max(points)[0] ** slope)
        lift = {"published": 8, "full cone": 22 if products[-1] < NAMES_AT / 2 else 6}.get(name, -12)
        axis.annotate(
            words, end, xytext=(0, lift), textcoords="offset points", va="center", color=colour,
            annotation_clip=False,
        )  # fmt: skip


def growth(c: Columns, x: str, y: str) -> float:
    """Exponent with which one column grows with another, over the products of which it is asked."""
    return exponent(_fitted(c[x], c[y]))


def _fitted(products: Sequence[float], costs: Sequence[float]) -> list[tuple[float, float]]:
    """Of a cloud, what lies between the least product that is fitted and the largest that the paper prints."""
    largest = max(n * k for n, k, _ in published())
    return [pair for pair in zip(products, costs, strict=True) if FROM_PRODUCT <= pair[0] <= largest]


def _told_cost(c: Columns) -> dict[str, Any]:
    powers = [growth(c, x, y) for _, x, y in CLOUDS]
    clouds = "; ".join(
        f"{name}, {'seconds' if 'seconds' in y else 'equalities'} up to {short(max(c[y]), 4)} at nK = {max(c[x]):g}, "
        f"exponent {power:.2f} (near {power:.1f})"
        for power, (name, x, y) in zip(powers, CLOUDS, strict=True)
    )
    return {"powers": powers, "first": FROM_PRODUCT, "largest": max(c["published_product"]), "clouds": clouds}


FIGURES = {
    "fig1": (fig_1, plot_fig_1, _told_fig_1),
    "convergence": (convergence, plot_convergence, _told_convergence),
    "tau": (against_delay, plot_against_delay, _told_against_delay),
    "cost": (cost, plot_cost, _told_cost),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
