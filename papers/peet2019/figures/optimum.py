"""How near the methods come to the optimum: against order and degree, and against the delay."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from papers.peet2019.claims.gains import optimum_of
from papers.peet2019.figures import columns
from papers.peet2019.printed import DEGREES
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import FOREGROUND, line, name_axes, name_line, new_axes, out_of_bounds, say


def convergence(results: Results) -> FigureData:
    """Relative distance from the optimum of Example 2, the middle of its bracket, against order and degree.

    floor: half the relative width of that bracket; distances below it say nothing.
    """
    found, exact, bracket = results["convergence.ex2"], optimum_of("2", results), results["reference.ex2"]["exact"]
    levels = [results[f"sos.ex2.d{degree}"]["tensor"]["gamma"] for degree in DEGREES]

    def away(levels: Iterable[float]) -> list[float]:
        return [abs(level / exact - 1.0) for level in levels]

    return columns(
        order=found["orders"],
        pade=away(found["pade"]),
        chebyshev=away(found["chebyshev"]),
        degree=DEGREES,
        sos=away(levels),
        floor=[(bracket["upper"] - bracket["lower"]) / (2.0 * exact)],
    )


def against_delay(results: Results) -> FigureData:
    """Least gain of Example 2 against its delay."""
    return columns(**{name: results["tau"][name] for name in ("tau", "sos", "chebyshev")})


LABELS = {"pade": "Padé", "chebyshev": "collocation"}


def plot_convergence(figure: FigureData) -> Any:
    """Errors on a logarithmic axis; what lies below the bracket of the optimum is shaded."""
    c = figure.columns
    drawing, (orders, degrees) = new_axes(
        1, 2, row_height=2.7, share_x=False, sharey=True, gridspec_kw={"width_ratios": (2, 1)}
    )
    for index, (name, side) in enumerate((("pade", -1), ("chebyshev", 1))):
        (curve,) = orders.semilogy(c["order"], c[name], marker="os"[index], markersize=4, **line(index))
        at = c["order"][2 + 2 * index]
        name_line(orders, curve, LABELS[name], at, side=side, ha="right" if side < 0 else "left")
    degrees.semilogy(c["degree"], c["sos"], marker="D", markersize=4, **line(3))
    say(degrees, "Theorem 3", (c["degree"][1], c["sos"][1]), ha="left")
    for axis in (orders, degrees):
        out_of_bounds(axis, BOTTOM, c["floor"][0], "in the bracket" if axis is orders else "")
    orders.set_ylim(BOTTOM, 3)
    name_axes(orders, "relative distance from the optimum", "order of the model")
    name_axes(degrees, "", "degree d")
    orders.set_xticks([order for order in c["order"] if order % 2 == 0])
    degrees.set_xticks(c["degree"])
    return drawing


BOTTOM = 1e-11
"""Lower end of the axis of relative distances, below all that the bracket tells apart."""


def say_convergence(figure: FigureData) -> str:
    """The message: which order of the models is as good as the last degree of Theorem 3."""
    degree = figure.columns["degree"][-1]
    return f"Theorem 3 at degree {degree:g} is as near the optimum as models of order {_order(figure):g}"


def _order(figure: FigureData) -> float:
    """The least order at which both models are as near as Theorem 3 at its last degree."""
    c = figure.columns
    models = zip(c["order"], c["pade"], c["chebyshev"], strict=True)
    return next(order for order, *away in models if max(away) <= c["sos"][-1])


def describe_convergence(figure: FigureData) -> str:
    """Errors at the first and last order, and at each degree."""
    c = figure.columns
    parts = [
        f"{LABELS[name]}: {c[name][0]:.1e} at order {c['order'][0]:g}, {c[name][-1]:.1e} at order {c['order'][-1]:g}"
        for name in ("pade", "chebyshev")
    ]
    degrees = ", ".join(f"{e:.1e} at degree {d:g}" for d, e in zip(c["degree"], c["sos"], strict=True))
    told = f"{'; '.join(parts)}. Theorem 3: {degrees}, which both models reach at order {_order(figure):g}."
    floor = f"Half the bracket is {c['floor'][0]:.1e}"
    return f"Relative distance from the optimum of Example 2, the middle of its bracket. {told} {floor}."


def plot_against_delay(figure: FigureData) -> Any:
    """A curve, and points that should lie on it."""
    drawing, (axis,) = new_axes(row_height=2.4)
    c = figure.columns
    (sos,) = axis.semilogy(c["tau"], c["sos"], **line(0))
    axis.semilogy(c["tau"], c["chebyshev"], "o", color=FOREGROUND, markersize=5)
    name_line(axis, sos, "Theorem 3 (line)\nand collocation (points)", c["tau"][8], ha="right")
    ticks = (1, 2, 5, 10)
    axis.set_yticks(ticks, [str(tick) for tick in ticks])
    axis.set_yticks([], minor=True)
    name_axes(axis, "least gain γ", "delay τ (s)")
    return drawing


def say_against_delay(figure: FigureData) -> str:
    """The message: how much the least gain grows."""
    return f"The least gain grows {_rise(figure):.1f}-fold up to a delay of {figure.columns['tau'][-1]:g} s"


def _rise(figure: FigureData) -> float:
    return figure.columns["sos"][-1] / figure.columns["sos"][0]


def describe_against_delay(figure: FigureData) -> str:
    """Where the gain starts, where it ends, and how far the two methods are apart."""
    c = figure.columns
    apart = max(abs(a / b - 1.0) for a, b in zip(c["sos"], c["chebyshev"], strict=True))
    return (
        f"The least gain rises from {c['sos'][0]:.4g} at a delay of {c['tau'][0]:g} s to {c['sos'][-1]:.4g} at "
        f"{c['tau'][-1]:g} s, {_rise(figure):.1f}-fold. Theorem 3 and collocation differ by {apart:.1e} at most."
    )


FIGURES = (
    Figure(
        name="convergence",
        place="Example 2",
        title=say_convergence,
        caption=(
            "Example 2, Theorem 3 as corrected, the degree counted in each variable. Distance of γ from the optimum; "
            "in the "
            "shaded part, where the optimum itself is not known that well, distances mean nothing. Low orders of "
            "collocation lie on either side."
        ),
        published=False,
        uses=("convergence.ex2", "reference.ex2", *(f"sos.ex2.d{degree}" for degree in DEGREES)),
        data=convergence,
        plot=plot_convergence,
        alt=describe_convergence,
    ),
    Figure(
        name="tau",
        place="Example 2",
        title=say_against_delay,
        caption="Example 2: Theorem 3 as corrected at degree 2, counted in each variable, and the Riccati equation "
        "of the collocated model.",
        published=False,
        uses=("tau",),
        data=against_delay,
        plot=plot_against_delay,
        alt=describe_against_delay,
    ),
)
