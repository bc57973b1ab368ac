"""Figures on stability (the counter-example in time, its rates, eigenvalues of the motor loop), and on readings."""

import math
from itertools import groupby, pairwise
from typing import Any

from papers._common import Columns
from papers.shao import printed
from papers.shao.experiments.tracking import SEARCH, merged
from papers.shao.figures import look
from papers.shao.printed import APO, COUNTEREXAMPLE, DESIGN, FAST, NAMES, PMI, RESTARTED
from replication.audit.model import Results
from replication.drawing.style import FOREGROUND, GREY, OURS, name_axes, name_line, new_axes, out_of_bounds, say

ENDS = 4.0, 15.0
"""What the upper panel of the counter-example shows: until when, in s, and how high."""


def counter_example(results: Results) -> Columns:
    """x(t) of the counter-example at its own M and at a longer one, by predictor."""
    record = results["divergence"]
    columns = {name: record["own"][name] for name in (APO, RESTARTED, FAST)}
    longer = {f"longer_{name}": record["longer"][name] for name in (RESTARTED, FAST)}
    return {"time_s": record["time"]} | columns | longer | {"longer_ratio": [record["ratio"]]}


def plot_counter_example(c: Columns) -> Any:
    """Above the printed predictor at M = 5, below the restarted one where the sensor is slower."""
    figure, axes = new_axes(2, row_height=2.3, share_x=False)
    panels = ("", COUNTEREXAMPLE.ratio, ABOVE), ("longer_", int(c["longer_ratio"][0]), BELOW)
    for axis, (front, ratio, curves) in zip(axes, panels, strict=True):
        for name, (text, at, side, ha) in curves.items():
            (curve,) = axis.plot(c["time_s"], c[f"{front}{name}"], **look(name))
            name_line(axis, curve, text, at, side=side, ha=ha)
        every = ratio * COUNTEREXAMPLE.period
        name_axes(axis, f"x, measured every {f'{every:g} s' if every >= 1 else f'{1000 * every:g} ms'}")
    axes[0].set(xlim=(0.0, ENDS[0]), ylim=(-1.0, ENDS[1]))
    axes[1].set(xlim=(0.0, c["time_s"][-1]), ylim=(-8.0, None), xlabel="time (s)")
    return figure


ABOVE = {
    FAST: ("restarted predictor, fast sensor", 1.5, 1, "left"),
    RESTARTED: ("", 0.0, 0, "left"),
    APO: ("DRC-APO as printed", 3.0, 1, "right"),
}
BELOW = {FAST: ("fast sensor", 5.0, -1, "left"), RESTARTED: ("restarted predictor", 6.4, 1, "right")}
"""By panel the curves: the name of each, at which time it stands, on which side, and which end of it is there."""


def _grown(c: Columns) -> float:
    """x of the printed loop at the end of the upper panel."""
    return float(min(zip(c["time_s"], c[APO], strict=True), key=lambda at: abs(at[0] - ENDS[0]))[1])


def _told_counter_example(c: Columns) -> dict[str, Any]:
    return {
        "grown": _grown(c),
        "until": ENDS[0],
        "ratio": COUNTEREXAMPLE.ratio,
        "start": c[APO][0],
        "size": max(map(abs, c[f"longer_{RESTARTED}"])),
        "end": c["time_s"][-1],
    }


def eigenvalues(results: Results) -> Columns:
    """Moduli of the eigenvalues under DRC-APO, and the radii of the other loops, against T."""
    record = results["eigenvalues"]
    moduli = record["moduli"][APO]
    columns = {"period_s": record["periods"]}
    columns |= {f"{APO}_{rank + 1}": [row[rank] for row in moduli] for rank in range(len(moduli[0]))}
    return columns | {name: [row[0] for row in record["moduli"][name]] for name in (PMI, RESTARTED, FAST)}


LOW, TOP = 0.2, 1.4
"""Ends of the axis of moduli; what leaves it upwards is marked by a triangle."""


BESIDE = {APO: (0.06, 1, "right"), FAST: (0.04, -1, "right"), PMI: (0.12, -1, "right")}
"""Where the name of a curve stands: the period, the side, and which end of the words is there."""


def plot_eigenvalues(c: Columns) -> Any:
    """Moduli against T; above one is unstable."""
    figure, (axis,) = new_axes(row_height=3.2)
    period = c["period_s"]
    out_of_bounds(axis, 1.0, TOP, "unstable above 1", at=0.45)
    for key, name in ((FAST, FAST), (PMI, PMI), (RESTARTED, RESTARTED), (f"{APO}_1", APO)):
        (curve,) = axis.semilogx(period, c[key], **look(name))
        edges = [k for k, (a, b) in enumerate(pairwise(c[key])) if (a > TOP) != (b > TOP)]
        axis.plot([period[k] for k in edges], [0.96 * TOP] * len(edges), "^", color=curve.get_color(), markersize=5)
        if name in BESIDE:
            at, side, ha = BESIDE[name]
            name_line(axis, curve, NAMES[name], at, side=side, ha=ha)
    axis.axvline(DESIGN.period, linestyle=":", color=FOREGROUND, linewidth=1.0)
    say(axis, "printed T", (DESIGN.period, LOW + 0.05), side=0, ha="right")
    axis.set_ylim(LOW, TOP)
    name_axes(axis, "largest modulus of an eigenvalue", "fast period T (s)")
    return figure


SHORT = 0.006
"""Periods in s below the first at which the fast mode of the motor is folded."""


def _told_eigenvalues(c: Columns) -> dict[str, Any]:
    """The largest moduli under DRC-APO at short periods, over all of them, and nearest to the printed one."""
    periods, apo, fast = (c[name] for name in ("period_s", f"{APO}_1", FAST))
    nearest = min(range(len(periods)), key=lambda k: abs(periods[k] - DESIGN.period))
    return {
        "count": len(fast),
        "end": periods[-1],
        "at_short": max(value for T, value in zip(periods, apo, strict=True) if T < SHORT),
        "short": 1000 * SHORT,
        "unstable": sum(value > 1.0 for value in apo),
        # In how many ranges of periods, on the grid, DRC-APO is stable.
        "ranges": sum(stable for stable, _ in groupby(modulus < 1.0 for modulus in apo)),
        "slower": sum(value > reference for value, reference in zip(apo, fast, strict=True)),
        "own": apo[nearest],
        "fast": fast[nearest],
    }


def rates(results: Results) -> Columns:
    """Slowest rate of the counter-example against T, and its two candidate limits."""
    record = results["rates"]
    a, gain = COUNTEREXAMPLE.model.A[0, 0], (COUNTEREXAMPLE.injection @ COUNTEREXAMPLE.model.C)[0, 0]
    ends = [record["periods"][0], record["periods"][-1]]
    limits = {"shared_gain": [a - gain / COUNTEREXAMPLE.ratio] * 2, "full_gain": [a - gain] * 2}
    return {"period_s": record["periods"]} | dict(record["rates"]) | {"limit_period_s": ends} | limits


def plot_rates(c: Columns) -> Any:
    """Rate against T on a logarithmic axis; above zero is unstable."""
    figure, (axis,) = new_axes(row_height=2.7)
    top = 1.35 * max(c[APO])
    out_of_bounds(axis, 0.0, top, "unstable above 0")
    for name in (FAST, RESTARTED, APO):
        axis.semilogx(c["period_s"], c[name], **look(name))
    fast, restarted, apo = axis.lines
    name_line(axis, apo, "DRC-APO as printed", c["period_s"][len(c["period_s"]) // 2])
    name_line(axis, restarted, NAMES[RESTARTED], 0.1, ha="right")
    name_line(axis, fast, NAMES[FAST], 0.35, side=0, ha="left")
    axis.set_xlim(right=4)
    for key, text, side in (("shared_gain", "A − LC/M", -1), ("full_gain", "A − LC", -1)):
        axis.axhline(c[key][0], color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
        say(axis, text, (c["period_s"][0], c[key][0]), side=side, ha="left", color=GREY)
    axis.set_ylim(1.35 * c["full_gain"][0], top)
    name_axes(axis, "rate of the dominant mode (1/s)", "fast period T (s)")
    return figure


def _told_rates(c: Columns) -> dict[str, Any]:
    least = min(c[APO])
    grows = f"The counter-example grows at every T shown, by {least:.2f} 1/s or more"
    return {
        "least": least,
        "message": grows if least > 0 else "With (6) the counter-example is not unstable at every T shown",
    }


def reading_scores(results: Results) -> Columns:
    """Best distance for each structure and observer."""
    blocks = [results[name] for name in SEARCH]
    observers = merged(blocks).by_observer
    columns: dict[str, list[float]] = {"structure": [float(block["structure"]) for block in blocks]}
    return columns | {name: [block["by_observer"][name] for block in blocks] for name in observers}


def plot_reading_scores(c: Columns) -> Any:
    """A line for each observer with a mark for each structure, the nearest one filled."""
    drawing, (axis,) = new_axes(row_height=3.2)
    observers = _observers(c)
    axis.axvline(1.0, color=FOREGROUND, linewidth=1.0)
    say(axis, "line: agrees with the print", (1.0, -0.8), side=0, ha="left")
    for row, distances in enumerate(observers.values()):
        factors = [math.exp(distance) for distance in distances]
        axis.plot(factors, [row] * len(factors), "o", color=GREY, markerfacecolor="none", markersize=5)
        axis.plot(min(factors), row, "D", color=OURS, markersize=6)
        axis.text(min(factors), row - 0.2, f"×{min(factors):.2f}", color=OURS, ha="left", va="bottom")
    xlim = 0.98, 1.1 * math.exp(max(map(max, observers.values())))
    axis.set(xscale="log", xlim=xlim, ylim=(len(observers) - 0.5, -1.1))
    axis.set_yticks(range(len(observers)), [NAMES[name].replace(", ", ",\n") for name in observers])
    axis.set_xticks((1, 1.5, 2, 3, 5), ("×1", "×1.5", "×2", "×3", "×5"))
    axis.minorticks_off()
    axis.set_xlabel("factor between print and ours,\nworst number of a column")
    return drawing


def _observers(c: Columns) -> dict[str, tuple[float, ...]]:
    return {name: values for name, values in c.items() if name != "structure"}


def _told_reading_scores(c: Columns) -> dict[str, Any]:
    """The factors by which the nearest readings miss the worst number of a column, by observer and by column."""
    observers = {name: math.exp(min(distances)) for name, distances in _observers(c).items()}
    texts = [text for short in printed.COLUMNS for text in printed.table_1(f"DRC-{short.upper()}")]
    half_a_unit = max(0.5 * 10.0 ** -len(text.split(".")[1]) / float(text) for text in texts)
    pmi, apo = (min(observers[name] for name in group) for group in (printed.PMI_READINGS, printed.APO_READINGS))
    return {
        "structures": len(c["structure"]),
        "observers": "; ".join(f"{NAMES[name]}: {factor:.2f}" for name, factor in observers.items()),
        "pmi": pmi,
        "apo": apo,
        "more": "more" if min(pmi, apo) > 1.0 + half_a_unit else "not more",
    }


FIGURES = {
    "counter-example": (counter_example, plot_counter_example, _told_counter_example),
    "motor-eigenvalues": (eigenvalues, plot_eigenvalues, _told_eigenvalues),
    "rates": (rates, plot_rates, _told_rates),
    "readings": (reading_scores, plot_reading_scores, _told_reading_scores),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
