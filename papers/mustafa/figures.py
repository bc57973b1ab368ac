"""Figures: gains over the period, over all sequences of periods, and the responses of Figs. 2 and 3."""

from decimal import Decimal
from typing import Any

from papers._common import Columns
from papers.mustafa.claims.preliminaries import down, times, up
from papers.mustafa.printed import EXAMPLES, GAMMA
from replication.audit.model import Results
from replication.drawing.style import FOREGROUND, GREY, OURS, SOFT, line, name_axes, name_end, name_line, new_axes, say

OF_FILTER = {1: "our filter", 2: "printed filter"}
SHOWN, ZOOMED = 400, 120
"""Last samples of the worst sequence of Example 1 in its table, and the first of them in its picture."""


def curves(results: Results) -> Columns:
    """gamma*(h), the norm of the filter at constant periods, its bracket over all sequences, the published level."""
    columns: dict[str, list[float]] = {}
    for e in EXAMPLES:
        r = results[f"curve.{e}"]
        columns |= {f"{name}_{e}": r[name] for name in ("h", "optimum", "filter")}
        columns |= {f"middle_{e}": [r["middle"]], f"published_{e}": [float(GAMMA[e])]}
        columns |= {f"{end}_{e}": [results[f"bracket.{e}"][end]] for end in ("lower", "upper")}
    return columns


def plot_curves(c: Columns) -> Any:
    """One panel per example: what happens at constant periods, and the worst case above."""
    drawing, axes = new_axes(len(EXAMPLES), row_height=2.3, share_x=False)
    for e, axis in zip(EXAMPLES, axes, strict=True):
        h, low, top = c[f"h_{e}"], c[f"lower_{e}"][0], c[f"upper_{e}"][0]
        axis.axhspan(low, top, color=OURS, linewidth=0.8)
        say(axis, f"period varies: at least {down(low)}, ×{_excess(c, e)}", (h[0], top), ha="left", color=OURS)
        (curve,) = axis.plot(h, c[f"filter_{e}"], **line(0))
        (optimum,) = axis.plot(h, c[f"optimum_{e}"], **line(1))
        name_end(axis, curve, OF_FILTER[e].replace(" ", "\n"), lift=8)
        name_end(axis, optimum, "optimum", lift=-9)
        level = (c[f"middle_{e}"][0], c[f"published_{e}"][0])
        axis.plot(*level, "o", color=FOREGROUND, markersize=6)
        axis.annotate(
            f"printed {level[1]} at {level[0]:.4f} s", level, xytext=(0, 34), textcoords="offset points", ha="center",
            family="serif", arrowprops={"arrowstyle": "-", "color": FOREGROUND, "linewidth": 0.7},
        )  # fmt: skip
        axis.set_ylim(-0.02 * top, 1.2 * top)
        name_axes(axis, f"Example {e}: gain", "constant period h (s)" if e == EXAMPLES[-1] else "", ticks=3)
    return drawing


def told_curves(c: Columns) -> dict[str, Any]:
    """How much larger the gains are than the printed levels, largest gains, and the jump of the first curve."""
    steps = [b - a for a, b in zip(c["optimum_1"], c["optimum_1"][1:], strict=False)]
    examples = "; ".join(
        f"Example {e}: published {c[f'published_{e}'][0]} at {c[f'middle_{e}'][0]:.4f} s, {OF_FILTER[e]} at "
        f"constant periods up to {max(c[f'filter_{e}']):.4f}, the optimum up to {max(c[f'optimum_{e}']):.4f}; its "
        f"gain over all sequences lies between {down(c[f'lower_{e}'][0])} and {up(c[f'upper_{e}'][0])}, at least "
        f"{_excess(c, e)} times the printed level"
        for e in EXAMPLES
    )
    jump = max(steps)
    return {
        "excess": [_excess(c, e) for e in EXAMPLES],
        "examples": examples,
        "jump": jump,
        "at": c["h_1"][steps.index(jump)],
    }


def _excess(c: Columns, e: int) -> Decimal:
    return times(c[f"lower_{e}"][0], GAMMA[e])


def brackets(results: Results) -> Columns:
    """Lower and upper ends against h_u; for the range of the example the narrower ones of the report."""
    *rows, (h_u, lower, upper) = results["against-range"]["rows"]
    best = results["bracket.1"]
    rows.append([h_u, max(lower, best["lower"]), min(upper, best["upper"])])
    return dict(zip(("h_u", "lower", "upper"), zip(*rows, strict=True), strict=True))


def plot_brackets(c: Columns) -> Any:
    """The bracket as a band."""
    drawing, (axis,) = new_axes(1, row_height=2.3)
    axis.fill_between(c["h_u"], c["lower"], c["upper"], color=SOFT, linewidth=0)
    (upper,) = axis.plot(c["h_u"], c["upper"], marker="v", **line(0))
    (lower,) = axis.plot(c["h_u"], c["lower"], marker="^", **line(1))
    middle = c["h_u"][2]
    name_line(axis, upper, "no sequence exceeds it", middle, ha="right")
    name_line(axis, lower, "one sequence attains it", middle, side=-1, ha="left")
    name_axes(axis, "worst-case gain", "longest period (s)")
    axis.set_ylim(0, 1.15 * max(c["upper"]))
    return drawing


def told_brackets(c: Columns) -> dict[str, Any]:
    """First and last bracket, and how much the worst case grows at least."""
    h_u, lower, upper = c.values()
    ends = "; ".join(f"h_u = {h_u[i]:.4f} s: between {down(lower[i])} and {up(upper[i])}" for i in (0, -1))
    return {"growth": down(lower[-1] / upper[0], 1), "widest": h_u[-1], "ends": ends}


def worst(results: Results) -> Columns:
    """The last samples of the worst sequence of Example 1, its disturbance and error, scaled to a disturbance of
    one; the gain that the whole sequence reaches."""
    r = results["bracket.1"]
    size = max(map(abs, r["w"][-SHOWN:]))
    scaled = {name: [value / size for value in r[name][-SHOWN:]] for name in ("w", "e")}
    return {"k": range(SHOWN), "h": r["periods"][-SHOWN:], **scaled, "gain": [r["lower"]]}


def plot_worst(c: Columns) -> Any:
    """The first samples against time: periods, disturbance, error; each value is held over its period."""
    drawing, axes = new_axes(3, row_height=1.15)
    instants = [sum(c["h"][:k]) for k in range(ZOOMED)]
    for axis, (name, label, colour) in zip(
        axes, (("h", "period h (s)", GREY), ("w", "disturbance w", FOREGROUND), ("e", "error e", OURS)), strict=True
    ):
        axis.step(instants, c[name][:ZOOMED], where="post", linewidth=1.3, color=colour)
        name_axes(axis, label, ticks=3)
    for axis in axes[1:]:
        axis.axhline(0.0, color=GREY, linewidth=0.6)
    axes[-1].set_xlabel("time (s)")
    return drawing


def told_worst(c: Columns) -> dict[str, Any]:
    """What the sequence does to the gain, its share of long periods, and the peak of the error."""
    h, gain = c["h"], c["gain"][0]
    short, long = min(h), max(h)
    return {
        "reached": down(gain),
        "times": times(gain, GAMMA[1]),
        "count": sum(period > (short + long) / 2 for period in h),
        "of": len(h),
        "long": long,
        "short": short,
        "peak": max(map(abs, c["e"])),
    }


# Figures 2 and 3 over many draws of the sampling periods


FIRST = 60
"""The first samples of Fig. 3, as many as can be told apart."""


def responses(results: Results) -> Columns:
    """One draw of the error, the band of all and how many they are, and the disturbance."""
    r = results["draws"]
    return {name: r[name] for name in ("k", "w", "e", "band_low", "band_high")} | {"draws": [len(r["ratios"])]}


def plot_responses(c: Columns) -> Any:
    """Disturbance, band and one draw on one axis."""
    drawing, (axis,) = new_axes(1, row_height=2.4)
    axis.fill_between(c["k"], c["band_low"], c["band_high"], color=SOFT, linewidth=0)
    (disturbance,) = axis.plot(c["k"], c["w"], linewidth=1.1, color=FOREGROUND, linestyle="--")
    (error,) = axis.plot(c["k"], c["e"], linewidth=1.1, color=OURS)
    name_line(axis, disturbance, "disturbance w", 27, ha="left")
    text = f"error e, one draw (line)\nand {c['draws'][0]:.0f} draws (band)"
    axis.annotate(
        text, (150, max(c["band_high"][140:160])), xytext=(6, 22), textcoords="offset points",
        color=error.get_color(), arrowprops={"arrowstyle": "-", "color": OURS},
    )  # fmt: skip
    axis.set_ylim(1.2 * min(c["w"]), 1.2 * max(c["w"]))
    name_axes(axis, "error e, disturbance w", "sample k")
    return drawing


def told_responses(c: Columns) -> dict[str, Any]:
    """Peaks of disturbance and error in these draws, which are no bound for others."""
    return {
        "samples": len(c["k"]),
        "disturbance": max(map(abs, c["w"])),
        "one": max(map(abs, c["e"])),
        "most": up(max(map(abs, c["band_low"] + c["band_high"])), 2),
    }


def intervals(results: Results) -> Columns:
    """The sampling periods of the same draw."""
    r = results["draws"]
    return {"k": r["k"], "h": r["periods"]}


def plot_intervals(c: Columns) -> Any:
    """The first periods as steps; beside them how often each length occurs among all."""
    h = c["h"]
    drawing, (axis, counts) = new_axes(
        1, 2, row_height=1.9, share_x=False, sharey=True, gridspec_kw={"width_ratios": (3, 1)}
    )
    axis.step(c["k"][:FIRST], h[:FIRST], where="post", linewidth=1.1, color=OURS)
    for end, side in ((min(h), -1), (max(h), 1)):
        axis.axhline(end, color=GREY, linestyle="--", linewidth=1.1)
        say(axis, f"{'shortest' if side < 0 else 'longest'} {end:.4f} s", (FIRST / 2, end), side=side, color=GREY)
    counts.hist(h, bins=10, orientation="horizontal", facecolor=SOFT, edgecolor=OURS, linewidth=0.7)
    axis.set_ylim(-0.02, 0.12)
    name_axes(axis, "period h (s)", f"sample k, first {FIRST}")
    name_axes(counts, "", f"count, of {len(h)}")
    return drawing


def told_intervals(c: Columns) -> dict[str, Any]:
    """Range and mean of the periods."""
    h = c["h"]
    return {"count": len(h), "least": min(h), "most": max(h), "mean": sum(h) / len(h), "first": FIRST}


FIGURES = {
    "fig2": (responses, plot_responses, told_responses),
    "fig3": (intervals, plot_intervals, told_intervals),
    "levels": (curves, plot_curves, told_curves),
    "range": (brackets, plot_brackets, told_brackets),
    "worst": (worst, plot_worst, told_worst),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
