"""Figures 2 and 3 over many draws, and what the paper lacks: the level over h, the true gain, a worst sequence."""

from __future__ import annotations

from typing import Any

from papers.mustafa.claims.preliminaries import down, up
from papers.mustafa.experiments.draws import DRAWS, merged
from papers.mustafa.printed import EXAMPLES, GAMMA
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import COLOURS, line, new_axes

OF_FILTER = {1: "our filter", 2: "printed filter"}
SHOWN = 400
"""Last samples of the worst sequence of Example 1 that its figure shows."""


def responses(results: Results) -> FigureData:
    """One draw of the error, the band of all, and the disturbance."""
    r = merged(results)
    return FigureData(columns={name: tuple(r[name]) for name in ("k", "w", "e", "band_low", "band_high")})


def plot_responses(figure: FigureData) -> Any:
    """Disturbance, band and one draw on one axis."""
    c = figure.columns
    drawing, (axis,) = new_axes(1, row_height=2.6)
    axis.fill_between(c["k"], c["band_low"], c["band_high"], color=COLOURS[0], alpha=0.3, linewidth=0)
    axis.plot(c["k"], c["e"], linewidth=0.8, label="error, one draw", **line(0))
    axis.plot(c["k"], c["w"], linewidth=0.8, label="disturbance", **line(1))
    axis.set(xlabel="sample $k$", ylabel="$e_k$, $w_k$")
    axis.legend()
    return drawing


def describe_responses(figure: FigureData) -> str:
    """Peaks of disturbance and error."""
    c = figure.columns
    peak = max(max(map(abs, c["band_low"])), max(map(abs, c["band_high"])))
    return (
        f"Over {len(c['k'])} samples the disturbance peaks at {max(map(abs, c['w'])):.3f}, the error of one draw at "
        f"{max(map(abs, c['e'])):.3f}, that of any draw at {peak:.3f}."
    )


def intervals(results: Results) -> FigureData:
    """The sampling periods of the same draw."""
    r = merged(results)
    return FigureData(columns={"k": tuple(r["k"]), "h": tuple(r["periods"])})


def plot_intervals(figure: FigureData) -> Any:
    """Periods against samples as steps."""
    drawing, (axis,) = new_axes(1, row_height=2.2)
    axis.step(figure.columns["k"], figure.columns["h"], where="post", linewidth=0.6, **line(0))
    axis.set(xlabel="sample $k$", ylabel="$h_k$ (s)")
    return drawing


def describe_intervals(figure: FigureData) -> str:
    """Range and mean of the periods."""
    h = figure.columns["h"]
    return f"{len(h)} sampling periods between {min(h):.4f} and {max(h):.4f} s, {sum(h) / len(h):.4f} s on average."


def curves(results: Results) -> FigureData:
    """gamma*(h), the norm of the filter at constant periods, its bracket over all sequences, the published level."""
    columns: dict[str, tuple[float, ...]] = {}
    for e in EXAMPLES:
        r = results[f"curve.{e}"]
        columns |= {f"h_{e}": tuple(r["h"]), f"optimum_{e}": tuple(r["optimum"]), f"filter_{e}": tuple(r["filter"])}
        columns |= {f"middle_{e}": (r["middle"],), f"published_{e}": (float(GAMMA[e]),)}
        columns |= {f"{end}_{e}": (results[f"bracket.{e}"][end],) for end in ("lower", "upper")}
    return FigureData(columns=columns)


def plot_curves(figure: FigureData) -> Any:
    """One panel per example."""
    c = figure.columns
    drawing, axes = new_axes(1, 2, row_height=2.6, share_x=False)
    for e, axis in zip(EXAMPLES, axes, strict=True):
        axis.plot(c[f"h_{e}"], c[f"optimum_{e}"], label="optimum for constant $h$", **line(0))
        axis.plot(c[f"h_{e}"], c[f"filter_{e}"], label="filter, constant $h$", **line(1))
        axis.plot(c[f"middle_{e}"], c[f"published_{e}"], "o", color=COLOURS[2], label="published level")
        axis.axhspan(*c[f"lower_{e}"], *c[f"upper_{e}"], color=COLOURS[3], label="filter, all sequences")
        axis.set(xlabel="constant period $h$ (s)", ylabel="gain", title=f"Example {e}, {OF_FILTER[e]}")
    axes[1].legend(loc="center")
    return drawing


def describe_curves(figure: FigureData) -> str:
    """Largest gains, and the jump of the first curve."""
    c = figure.columns
    steps = [b - a for a, b in zip(c["optimum_1"], c["optimum_1"][1:], strict=False)]
    jump = steps.index(max(steps))
    return (
        "; ".join(
            f"Example {e}: published {c[f'published_{e}'][0]} at {c[f'middle_{e}'][0]:.4f} s, the filter at constant "
            f"periods up to {max(c[f'filter_{e}']):.4f}, the optimum up to {max(c[f'optimum_{e}']):.4f}; its gain "
            f"over all sequences lies between {down(c[f'lower_{e}'][0])} and {up(c[f'upper_{e}'][0])}"
            for e in EXAMPLES
        )
        + f". In Example 1 the optimum jumps by {max(steps):.4f} near {c['h_1'][jump]:.4f} s."
    )


def brackets(results: Results) -> FigureData:
    """Lower and upper ends against h_u; for the range of the example the narrower ones of the report."""
    *rows, (h_u, lower, upper) = results["against-range"]["rows"]
    best = results["bracket.1"]
    rows.append([h_u, max(lower, best["lower"]), min(upper, best["upper"])])
    return FigureData(columns={name: tuple(row[i] for row in rows) for i, name in enumerate(("h_u", "lower", "upper"))})


def plot_brackets(figure: FigureData) -> Any:
    """The bracket as a band."""
    c = figure.columns
    drawing, (axis,) = new_axes(1, row_height=2.6)
    axis.fill_between(c["h_u"], c["lower"], c["upper"], color=COLOURS[0], alpha=0.25, linewidth=0)
    axis.plot(c["h_u"], c["upper"], label="guaranteed for every sequence", **line(0))
    axis.plot(c["h_u"], c["lower"], label="attained by one sequence", **line(1))
    axis.set(xlabel="longest period $h_u$ (s)", ylabel="worst-case gain")
    axis.legend()
    return drawing


def describe_brackets(figure: FigureData) -> str:
    """First and last bracket."""
    c = figure.columns
    return (
        "; ".join(f"h_u = {c['h_u'][i]:.4f} s: between {down(c['lower'][i])} and {up(c['upper'][i])}" for i in (0, -1))
        + "."
    )


def worst(results: Results) -> FigureData:
    """The last samples of the worst sequence of Example 1, its disturbance and error, scaled to a disturbance of
    one."""
    r = results["bracket.1"]
    size = max(map(abs, r["w"][-SHOWN:]))
    return FigureData(
        columns={
            "k": tuple(float(k) for k in range(SHOWN)),
            "h": tuple(r["periods"][-SHOWN:]),
            "w": tuple(value / size for value in r["w"][-SHOWN:]),
            "e": tuple(value / size for value in r["e"][1:][-SHOWN:]),
        }
    )


def plot_worst(figure: FigureData) -> Any:
    """Periods above, signals below."""
    c = figure.columns
    drawing, axes = new_axes(2, row_height=1.6)
    axes[0].step(c["k"], c["h"], where="post", linewidth=0.8, **line(0))
    axes[0].set_ylabel("$h_k$ (s)")
    axes[1].plot(c["k"], c["w"], label="disturbance", linewidth=0.8, **line(1))
    axes[1].plot(c["k"], c["e"], label="error", linewidth=0.8, **line(0))
    axes[1].set(xlabel="sample", ylabel="$w_k$, $e_k$")
    axes[1].legend()
    return drawing


def describe_worst(figure: FigureData) -> str:
    """Share of long periods and the peak of the error."""
    c = figure.columns
    long = sum(h > (min(c["h"]) + max(c["h"])) / 2 for h in c["h"])
    return (
        f"{long} of {len(c['h'])} sampling periods are long ({max(c['h']):.4f} s), the others short "
        f"({min(c['h']):.4f} s); with a disturbance of at most 1 the error peaks at {max(map(abs, c['e'])):.3f}."
    )


FIGURES = (
    Figure(
        name="fig2", place="Fig. 2", title="Estimation error and disturbance of Example 2",
        caption="The printed filter, uniform random periods. The published figure is one unknown draw under a law that "
        "is not stated; the band holds all our uniform draws.",
        published=True, uses=DRAWS, data=responses, plot=plot_responses, alt=describe_responses,
    ),
    Figure(
        name="fig3", place="Fig. 3", title="Sampling periods of the same draw",
        caption="Independent and uniform between the ends of the range; the law of the published draw is not stated.",
        published=True, uses=DRAWS, data=intervals, plot=plot_intervals, alt=describe_intervals,
    ),
    Figure(
        name="levels", place="Beyond Sec. VI", title="What the nominal level is nominal to",
        caption="Gains at constant periods, of our filter next to the optimum at the middle of the range in Example 1, "
        "where none is printed, and of the printed one in Example 2. The published level belongs to one period; over "
        "most of the range the filter has a larger gain, and a larger one still when the period varies: the band holds "
        "its worst-case gain. In Example 1 the optimum is zero where Phi - Gamma C/D is Schur.",
        published=False, uses=tuple(f"{name}.{e}" for name in ("curve", "bracket") for e in EXAMPLES),
        data=curves, plot=plot_curves, alt=describe_curves,
    ),
    Figure(
        name="range", place="Beyond Sec. VI-A", title="Worst-case gain against the range of periods",
        caption="Our filter of Example 1 on shorter ranges. The worst case over all sequences lies in the band; more "
        "effort makes it narrower, as was done at the last point, the range of the paper.",
        published=False, uses=("against-range", "bracket.1"), data=brackets, plot=plot_brackets, alt=describe_brackets,
    ),
    Figure(
        name="worst", place="Beyond Sec. VI-A", title="A bad sampling sequence of Example 1",
        caption="Our filter. A few long periods between many short ones, with the disturbance that suits them.",
        published=False, uses=("bracket.1",), data=worst, plot=plot_worst, alt=describe_worst,
    ),
)  # fmt: skip
