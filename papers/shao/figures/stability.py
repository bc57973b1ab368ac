"""Figures on stability: stable sets over (T, M), rates of the counter-example."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from papers.shao.figures.looks import NAMES, columns_of, look, ours
from papers.shao.problem import APO, COUNTEREXAMPLE, DESIGN, FAST, PMI, RESTARTED
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.labels import name_axes, name_line, out_of_bounds, say
from replication.drawing.style import FOREGROUND, GREY, OURS, new_axes

SETS = (PMI, APO, RESTARTED)


def stable_sets(results: Results) -> FigureData:
    """Ends of the stable intervals of T for each M and observer."""
    found = results["stable-sets"]
    columns: dict[str, list[float]] = {}
    for name in SETS:
        rows = [
            (ratio, start, end)
            for ratio, intervals in zip(found["ratios"], found["intervals"][name], strict=True)
            for start, end in intervals
        ]
        for key, values in zip(("ratio", "from_s", "to_s"), zip(*rows, strict=True), strict=True):
            columns[f"{name}_{key}"] = list(values)
    return columns_of(columns)


BARS = {APO: (7.0, OURS), RESTARTED: (1.5, GREY), PMI: (4.0, FOREGROUND)}
"""Thickness and colour of the bars, from above; each loop has its own line of each ratio."""


def plot_stable_sets(drawn: FigureData) -> Any:
    """Horizontal bars over T, three lines of bars per M."""
    figure, (axis,) = new_axes(row_height=3.4)
    c = drawn.columns
    ratios = sorted(set(c[f"{APO}_ratio"]))
    for index, (name, (thickness, colour)) in enumerate(BARS.items()):
        heights = [ratios.index(ratio) - 0.25 * (index - 1) for ratio in c[f"{name}_ratio"]]
        axis.hlines(heights, c[f"{name}_from_s"], c[f"{name}_to_s"], color=colour, linewidth=thickness)
    start = min(c[f"{APO}_from_s"])
    for index, (name, (_, colour)) in enumerate(BARS.items()):
        say(axis, NAMES[name], (start * 3 ** (1.8 * index), len(ratios) - 0.55), ha="left", color=colour)
    axis.axvline(DESIGN.period, linestyle=":", color=FOREGROUND, linewidth=1.0)
    say(axis, "printed T", (DESIGN.period, -0.75), side=0, ha="right")
    axis.set(xscale="log", ylim=(-1, len(ratios)))
    name_axes(axis, "ratio M", "fast period T (s)")
    axis.set_yticks(range(len(ratios)), [f"{ratio:.0f}" for ratio in ratios])
    axis.grid(visible=False)
    return figure


def say_stable_sets(drawn: FigureData) -> str:
    """The message: in how many pieces the stable set of the printed ratio falls."""
    return f"At the printed ratio DRC-APO is stable for T in at least {len(_own(drawn))} separate intervals"


def _own(drawn: FigureData) -> list[tuple[float, float]]:
    c = drawn.columns
    rows = zip(c[f"{APO}_ratio"], c[f"{APO}_from_s"], c[f"{APO}_to_s"], strict=True)
    return [(start, end) for ratio, start, end in rows if ratio == DESIGN.ratio]


def describe_stable_sets(drawn: FigureData) -> str:
    """How many intervals were found for the printed ratio."""
    own = _own(drawn)
    listed = ", ".join(f"{start:.4f} to {end:.4f} s" for start, end in own)
    return (
        f"Stable periods found for each ratio. For M = {DESIGN.ratio} DRC-APO is stable for T in {len(own)} sets: "
        f"{listed}."
    )


def eigenvalues(results: Results) -> FigureData:
    """Moduli of the eigenvalues under DRC-APO, and the radii of the other loops, against T."""
    found = results["eigenvalues"]
    moduli = found["moduli"][APO]
    columns = {"period_s": found["periods"]}
    columns |= {f"{APO}_{rank + 1}": [row[rank] for row in moduli] for rank in range(len(moduli[0]))}
    return columns_of(columns | {name: [row[0] for row in found["moduli"][name]] for name in (PMI, RESTARTED, FAST)})


TOP = 1.4
"""Upper end of the axis of moduli; what leaves it is marked by a triangle."""


BESIDE = {APO: (0.1, 1, "right"), FAST: (0.1, -1, "right"), PMI: (0.13, 0, "right")}
"""Where the name of a curve stands: the period, the side, and which end of the words is there."""


def plot_eigenvalues(drawn: FigureData) -> Any:
    """Moduli against T; above one is unstable."""
    figure, (axis,) = new_axes(row_height=3.2)
    c = drawn.columns
    period = c["period_s"]
    out_of_bounds(axis, 1.0, TOP, "unstable above 1", at=0.45)
    for key in (key for key in c if key.startswith(f"{APO}_") and key != f"{APO}_1"):
        axis.semilogx(period, c[key], **look(APO) | {"linewidth": 0.5})
    name_line(axis, axis.lines[3], "thin: others\nof DRC-APO", 0.0013, side=0, ha="left")
    for key, name in ((FAST, FAST), (PMI, PMI), (RESTARTED, RESTARTED), (f"{APO}_1", APO)):
        (curve,) = axis.semilogx(period, c[key], **look(name))
        edges = [k for k, (a, b) in enumerate(pairwise(c[key])) if (a > TOP) != (b > TOP)]
        axis.plot([period[k] for k in edges], [0.96 * TOP] * len(edges), "^", color=curve.get_color(), markersize=5)
        if name in BESIDE:
            at, side, ha = BESIDE[name]
            name_line(axis, curve, NAMES[name], at, side=side, ha=ha)
    axis.axvline(DESIGN.period, linestyle=":", color=FOREGROUND, linewidth=1.0)
    say(axis, "printed T", (DESIGN.period, 0.06), side=0, ha="right")
    axis.set_ylim(0, TOP)
    name_axes(axis, "moduli of the eigenvalues (1)", "fast period T (s)")
    return figure


def _at_print(drawn: FigureData, key: str) -> float:
    """The value of a column at the period nearest to the printed one."""
    periods = drawn.columns["period_s"]
    nearest = min(range(len(periods)), key=lambda k: abs(periods[k] - DESIGN.period))
    return drawn.columns[key][nearest]


def say_eigenvalues(drawn: FigureData) -> str:
    """The message: both largest moduli at the printed period."""
    own, fast = _at_print(drawn, f"{APO}_1"), _at_print(drawn, FAST)
    return f"Near the printed T the largest modulus is {own:.2f} (DRC-APO) and {fast:.2f} (fast sensor)"


def describe_eigenvalues(drawn: FigureData) -> str:
    """Range of T shown, and how the radii compare over it."""
    c = drawn.columns
    slower = sum(own > fast for own, fast in zip(c[f"{APO}_1"], c[FAST], strict=True))
    return (
        f"Moduli of the eigenvalues of the motor loop over one slow period for T from {c['period_s'][0]:g} to "
        f"{c['period_s'][-1]:g} s. The largest one under DRC-APO exceeds that with a true fast sensor at {slower} of "
        f"{len(c[FAST])} periods; nearest to the printed T they are {_at_print(drawn, f'{APO}_1'):.2f} and "
        f"{_at_print(drawn, FAST):.2f}."
    )


def rates(results: Results) -> FigureData:
    """Slowest rate of the counter-example against T, and its two candidate limits."""
    found = results["rates"]
    a, gain = COUNTEREXAMPLE.model.A[0, 0], (COUNTEREXAMPLE.injection @ COUNTEREXAMPLE.model.C)[0, 0]
    ends = [found["periods"][0], found["periods"][-1]]
    return columns_of(
        {"period_s": found["periods"]}
        | dict(found["rates"])
        | {"limit_period_s": ends, "shared_gain": [a - gain / COUNTEREXAMPLE.ratio] * 2, "full_gain": [a - gain] * 2}
    )


def plot_rates(drawn: FigureData) -> Any:
    """Rate against T on a logarithmic axis; above zero is unstable."""
    figure, (axis,) = new_axes(row_height=2.7)
    c = drawn.columns
    top = 1.35 * max(c[APO])
    out_of_bounds(axis, 0.0, top, "unstable above 0")
    for name in (FAST, RESTARTED, APO):
        axis.semilogx(c["period_s"], c[name], **look(name))
    fast, restarted, own = axis.lines
    name_line(axis, own, "DRC-APO as printed", c["period_s"][len(c["period_s"]) // 2])
    name_line(axis, restarted, NAMES[RESTARTED], 0.1, ha="right")
    name_line(axis, fast, NAMES[FAST], 0.35, side=0, ha="left")
    axis.set_xlim(right=4)
    for key, text, side in (("shared_gain", "A − LC/M", -1), ("full_gain", "A − LC", -1)):
        axis.axhline(c[key][0], color=GREY, linewidth=0.9, linestyle=(0, (1, 2)))
        say(axis, text, (c["period_s"][0], c[key][0]), side=side, ha="left", color=GREY)
    axis.set_ylim(1.35 * c["full_gain"][0], top)
    name_axes(axis, "slowest rate (1/s)", "fast period T (s)")
    return figure


def say_rates(drawn: FigureData) -> str:
    """The message: the sign of the rate."""
    least = min(drawn.columns[APO])
    said = "unstable at every T shown" if least > 0 else "not always unstable"
    return f"Under (6) the counter-example's rate is at least {least:.2f} 1/s: {said}"


def describe_rates(drawn: FigureData) -> str:
    """The rates at the smallest period."""
    c = drawn.columns
    return (
        f"At T = {c['period_s'][0]:g} s the slowest rate is {c[APO][0]:.4f} 1/s with the virtual measurement (6), "
        f"near A − LC/M = {c['shared_gain'][0]:.4f} and never below {min(c[APO]):.2f}, and "
        f"{c[RESTARTED][0]:.4f} with the restarted predictor."
    )


FIGURES = (
    ours(
        name="stable-sets",
        place="Sec. V",
        title=say_stable_sets,
        caption="Bars cover the periods with a stable motor loop; gaps narrower than the grid of T may be missed.",
        uses=("stable-sets",),
        data=stable_sets,
        plot=plot_stable_sets,
        alt=describe_stable_sets,
    ),
    ours(
        name="motor-eigenvalues",
        place="Sec. V",
        title=say_eigenvalues,
        caption="Moduli of the eigenvalues of the monodromy matrix at the printed M: all of DRC-APO (thick: the "
        "largest), the largest of the other loops. Above one the loop is unstable.",
        uses=("eigenvalues",),
        data=eigenvalues,
        plot=plot_eigenvalues,
        alt=describe_eigenvalues,
    ),
    ours(
        name="rates",
        place="Sec. IV",
        title=say_rates,
        caption="With the virtual measurement as printed the gain acts once in M periods: the rate tends to that of "
        "A − LC/M, which is positive here.",
        uses=("rates",),
        data=rates,
        plot=plot_rates,
        alt=describe_rates,
    ),
)
