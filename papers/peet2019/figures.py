"""Fig. 1 with its axes, and what the paper lacks: convergence, gains as functions, γ against τ, cost against n·K."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from papers.peet2019.claims.cost import FROM_PRODUCT, exponent
from papers.peet2019.claims.gains import optimum_of
from papers.peet2019.printed import DATA, DEGREES, published
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import COLOURS, line, new_axes

GAINS = ("l3", "l4", "l5", "l6")
WAYS = {"bessel": "small cone", "total": "full cone", "plain": "full cone, cvxpy"}


def _data(**columns: Iterable[float]) -> FigureData:
    return FigureData(columns={name: tuple(map(float, values)) for name, values in columns.items()})


def fig_1(results: Results) -> FigureData:
    """Disturbance and both errors for one reading of the sinc."""
    found = results["fig1"]
    return _data(t=found["t"], w=found["w"], **{f"e_{i}": values for i, values in enumerate(found["e"], 1)})


def convergence(results: Results) -> FigureData:
    """Relative distance from the optimum of Example 2, the middle of its bracket, against order and degree."""
    found, exact = results["convergence.ex2"], optimum_of("2", results)
    levels = [results[f"sos.ex2.d{degree}"]["tensor"]["gamma"] for degree in DEGREES]

    def away(levels: Iterable[float]) -> list[float]:
        return [abs(level / exact - 1.0) for level in levels]

    return _data(
        order=found["orders"],
        pade=away(found["pade"]),
        chebyshev=away(found["chebyshev"]),
        degree=DEGREES,
        sos=away(levels),
    )


def gains(results: Results) -> FigureData:
    """The gains of one observer as functions of s; first and second state."""
    found = results["gains"]
    return _data(s=found["s"], **{f"{name}_{i}": values for name in GAINS for i, values in enumerate(found[name], 1)})


def against_delay(results: Results) -> FigureData:
    """Least gain of Example 2 against its delay."""
    return _data(**{name: results["tau"][name] for name in ("tau", "sos", "chebyshev")})


def cost(results: Results) -> FigureData:
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
    return _data(**columns)


GAIN_TICKS = (1, 2, 3, 5, 10)
LABELS = {
    "w": "$w$",
    "e_1": "$e_1$",
    "e_2": "$e_2$",
    "pade": "Padé",
    "chebyshev": "collocation",
    "sos": "Theorem 3",
}


def plot_fig_1(figure: FigureData) -> Any:
    """Disturbance and errors against time on one axis."""
    drawing, axes = new_axes(row_height=2.6)
    for i, name in enumerate(name for name in figure.columns if name != "t"):
        axes[0].plot(figure.columns["t"], figure.columns[name], label=LABELS[name], linewidth=1.1, **line(i))
    axes[0].set(xlabel="time $t$ [s]", ylabel="disturbance and errors")
    axes[0].legend()
    return drawing


def plot_convergence(figure: FigureData) -> Any:
    """Errors on a logarithmic axis."""
    drawing, axes = new_axes(1, 2, row_height=2.6, share_x=False)
    for i, name in enumerate(("pade", "chebyshev")):
        axes[0].semilogy(figure.columns["order"], figure.columns[name], marker="o", label=LABELS[name], **line(i))
    axes[0].set(xlabel="order of the model", ylabel="relative error of $\\gamma$")
    axes[0].legend()
    axes[1].semilogy(figure.columns["degree"], figure.columns["sos"], marker="s", color=COLOURS[2])
    axes[1].set(xlabel="degree $d$ of Theorem 3", ylabel="relative error of $\\gamma$", xticks=figure.columns["degree"])
    return drawing


def plot_gains(figure: FigureData) -> Any:
    """One panel per gain."""
    drawing, axes = new_axes(2, 2, row_height=1.7)
    for axis, name in zip(axes, GAINS, strict=True):
        for i in (1, 2):
            axis.plot(figure.columns["s"], figure.columns[f"{name}_{i}"], label=f"state {i}", **line(i - 1))
        axis.set_ylabel(f"$L_{name[1]}(s)$")
    axes[0].legend()
    for axis in axes[2:]:
        axis.set_xlabel("$s$ [s]")
    return drawing


def plot_against_delay(figure: FigureData) -> Any:
    """A curve, and points that should lie on it."""
    drawing, axes = new_axes(row_height=2.6)
    tau = figure.columns["tau"]
    axes[0].semilogy(tau, figure.columns["sos"], label=LABELS["sos"], **line(0))
    axes[0].semilogy(tau, figure.columns["chebyshev"], "o", label=LABELS["chebyshev"], color=COLOURS[1], markersize=4)
    axes[0].set(xlabel="delay $\\tau$ [s]", ylabel="least gain $\\gamma$", yticks=GAIN_TICKS)
    axes[0].set_yticks([], minor=True)
    axes[0].yaxis.set_major_formatter("{x:g}")
    axes[0].legend()
    return drawing


def plot_cost(figure: FigureData) -> Any:
    """Both on logarithmic axes."""
    drawing, axes = new_axes(1, 2, row_height=3.0)
    c = figure.columns
    axes[0].loglog(c["published_product"], c["published_seconds"], "o", color=COLOURS[0], label="published")
    for (way, label), marker, colour in zip(WAYS.items(), "^sx", COLOURS[1:], strict=False):
        axes[0].loglog(c[f"{way}_measured_product"], c[f"{way}_seconds"], marker, color=colour, label=label)
    axes[1].loglog(c["total_product"], c["total_equalities"], "s", color=COLOURS[2], label=WAYS["total"])
    axes[1].loglog(c["bessel_measured_product"], c["bessel_equalities"], "^", color=COLOURS[1], label=WAYS["bessel"])
    for axis, label in zip(axes, ("CPU time [s]", "equalities of our program"), strict=True):
        axis.set(xlabel="$nK$", ylabel=label)
        axis.legend(loc="upper left")
    return drawing


def describe_fig_1(figure: FigureData) -> str:
    """When the disturbance and the errors are largest, and when the errors have died out."""
    t, c = figure.columns["t"], figure.columns
    peak = {name: max(range(len(t)), key=lambda i: abs(values[i])) for name, values in c.items() if name != "t"}
    parts = [f"{name} is largest at {t[i]:.2f} s with {c[name][i]:.3f}" for name, i in peak.items()]
    last = max(
        t[i] for i in range(len(t)) if max(abs(c["e_1"][i]), abs(c["e_2"][i])) > 0.1 * abs(c["e_1"][peak["e_1"]])
    )
    return (
        f"Disturbance and two errors over {t[-1]:g} s. {'; '.join(parts)}. After {last:.1f} s both errors stay below a "
        "tenth of the peak of e_1."
    )


def describe_convergence(figure: FigureData) -> str:
    """Errors at the first and last order, and at each degree."""
    c = figure.columns
    parts = [
        f"{LABELS[name]}: {c[name][0]:.1e} at order {c['order'][0]:g}, {c[name][-1]:.1e} at order {c['order'][-1]:g}"
        for name in ("pade", "chebyshev")
    ]
    degrees = ", ".join(f"{e:.1e} at degree {d:g}" for d, e in zip(c["degree"], c["sos"], strict=True))
    told = f"{'; '.join(parts)}. Theorem 3: {degrees}."
    return f"Relative distance from the optimum of Example 2, the middle of its bracket. {told}"


def describe_gains(figure: FigureData) -> str:
    """Values of each gain at the oldest end of the history and at the present."""
    c = figure.columns
    parts = [
        f"L{name[1]} from {c[f'{name}_1'][0]:.3g} to {c[f'{name}_1'][-1]:.3g} (state 1) and from "
        f"{c[f'{name}_2'][0]:.3g} to {c[f'{name}_2'][-1]:.3g} (state 2)"
        for name in GAINS
    ]
    return f"Four gains over s from {c['s'][0]:g} to {c['s'][-1]:g} s: {'; '.join(parts)}."


def describe_against_delay(figure: FigureData) -> str:
    """Where the gain starts, where it ends, and how far the two methods are apart."""
    c = figure.columns
    apart = max(abs(a / b - 1.0) for a, b in zip(c["sos"], c["chebyshev"], strict=True))
    return (
        f"The least gain rises from {c['sos'][0]:.4g} at a delay of {c['tau'][0]:g} s to {c['sos'][-1]:.4g} at "
        f"{c['tau'][-1]:g} s. Theorem 3 and collocation differ by {apart:.1e} at most."
    )


def describe_cost(figure: FigureData) -> str:
    """The largest cell of each, and the exponents of growth."""
    c = figure.columns
    parts = []
    for name, x, y in (
        ("published seconds", "published_product", "published_seconds"),
        *((f"our CPU seconds, {label}", f"{way}_measured_product", f"{way}_seconds") for way, label in WAYS.items()),
        ("equalities, full cone", "total_product", "total_equalities"),
        ("equalities, small cone", "bessel_measured_product", "bessel_equalities"),
    ):
        pairs = list(zip(c[x], c[y], strict=True))
        slope = exponent([pair for pair in pairs if pair[0] >= FROM_PRODUCT])
        parts.append(f"{name} up to {max(c[y]):.4g} and nK = {max(c[x]):g}, exponent {slope:.2f}")
    return f"All rise with nK (exponents from nK = {FROM_PRODUCT}): {'; '.join(parts)}."


FIGURES: tuple[Figure, ...] = (
    Figure(
        name="fig1",
        place="Fig. 1",
        title="Error of the observer for a sinc disturbance",
        caption="System (11), observer at the printed level; sinc(t - τ) on both channels, one reading of many.",
        published=True,
        uses=("fig1",),
        data=fig_1,
        plot=plot_fig_1,
        alt=describe_fig_1,
    ),
    Figure(
        name="convergence",
        place="Example 2",
        title="Convergence in the order of the model and in the degree",
        caption=(
            "Distance of γ from the optimum, the middle of its bracket: distances below the width of that bracket mean "
            "nothing. Low orders of collocation lie on either side."
        ),
        published=False,
        uses=("convergence.ex2", "reference.ex2", *(f"sos.ex2.d{degree}" for degree in DEGREES)),
        data=convergence,
        plot=plot_convergence,
        alt=describe_convergence,
    ),
    Figure(
        name="gains",
        place="Sec. VIII",
        title="Gains of the observer as functions of the history",
        caption="L₃ to L₆ of eq. (9) for an observer five per cent above the optimum, a system of ours with one delay.",
        published=False,
        uses=("gains",),
        data=gains,
        plot=plot_gains,
        alt=describe_gains,
    ),
    Figure(
        name="tau",
        place="Example 2",
        title="Least gain against the delay",
        caption="Theorem 3 at degree 2 and the Riccati equation of the collocated model.",
        published=False,
        uses=("tau",),
        data=against_delay,
        plot=plot_against_delay,
        alt=describe_against_delay,
    ),
    Figure(
        name="cost",
        place="Table I",
        title="Cost against n·K",
        caption=(
            "CPU seconds, published and ours as once measured (machines and solvers do not compare), "
            f"and the size of our programs. The paper's cells end at n·K = {DATA['largest-product']}."
        ),
        published=False,
        uses=("sizes", "measured"),
        data=cost,
        plot=plot_cost,
        alt=describe_cost,
    ),
)
