"""Figures on stability: stable sets over (T, M), rates of the counter-example."""

from __future__ import annotations

from typing import Any

from papers.shao.figures.tracking import columns_of, ours
from papers.shao.problem import APO, COUNTEREXAMPLE, DESIGN, FAST, LABELS, PMI, REPAIRED
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.style import line, new_axes

SETS = (PMI, APO, REPAIRED)


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


def plot_stable_sets(drawn: FigureData) -> Any:
    """Horizontal bars over T, one row of bars per M, shifted by observer."""
    figure, (axis,) = new_axes(row_height=3.6)
    c = drawn.columns
    ratios = sorted(set(c[f"{APO}_ratio"]))
    for index, name in enumerate(SETS):
        heights = [ratios.index(ratio) + 0.2 * (index - 1) for ratio in c[f"{name}_ratio"]]
        colour = line(index)["color"]
        axis.hlines(heights, c[f"{name}_from_s"], c[f"{name}_to_s"], color=colour, linewidth=2.5, label=LABELS[name])
    axis.axvline(DESIGN.period, linestyle=":", color="#777777", label="printed T")
    axis.set(xscale="log", xlabel="T, s", ylabel="M")
    axis.set_yticks(range(len(ratios)), [f"{ratio:.0f}" for ratio in ratios])
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def describe_stable_sets(drawn: FigureData) -> str:
    """How many intervals there are for the printed ratio."""
    c = drawn.columns
    rows = zip(c[f"{APO}_ratio"], c[f"{APO}_from_s"], c[f"{APO}_to_s"], strict=True)
    own = [(start, end) for ratio, start, end in rows if ratio == DESIGN.ratio]
    listed = ", ".join(f"{start:.4f} to {end:.4f} s" for start, end in own)
    return (
        f"Stable periods for each ratio. For M = {DESIGN.ratio} DRC-APO is stable for T in {len(own)} sets: {listed}."
    )


def eigenvalues(results: Results) -> FigureData:
    """Moduli of the eigenvalues under DRC-APO, and the radii of the other loops, against T."""
    found = results["eigenvalues"]
    moduli = found["moduli"][APO]
    columns = {"period_s": found["periods"]}
    columns |= {f"{APO}_{rank + 1}": [row[rank] for row in moduli] for rank in range(len(moduli[0]))}
    return columns_of(columns | {name: [row[0] for row in found["moduli"][name]] for name in (PMI, REPAIRED, FAST)})


def plot_eigenvalues(drawn: FigureData) -> Any:
    """Moduli against T; above one is unstable."""
    figure, (axis,) = new_axes(row_height=3.4)
    c = drawn.columns
    for key in (key for key in c if key.startswith(APO)):
        first = key == f"{APO}_1"
        axis.semilogx(
            c["period_s"], c[key], label=LABELS[APO] if first else None, linewidth=1.6 if first else 0.6, **line(0)
        )
    for index, name in enumerate((PMI, REPAIRED, FAST), start=1):
        axis.semilogx(c["period_s"], c[name], label=f"{LABELS[name]}, largest", linewidth=1.0, **line(index))
    axis.axvline(DESIGN.period, linestyle=":", color="#777777", label="printed T")
    axis.set(xlabel="T, s", ylabel="modulus", ylim=(0, 1.5))
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def describe_eigenvalues(drawn: FigureData) -> str:
    """Range of T shown, and how the radii compare over it."""
    c = drawn.columns
    slower = sum(own > fast for own, fast in zip(c[f"{APO}_1"], c[FAST], strict=True))
    return (
        f"Moduli of the eigenvalues of the motor loop over one slow period for T from {c['period_s'][0]:g} to "
        f"{c['period_s'][-1]:g} s. The largest one under DRC-APO exceeds that with a true fast sensor at {slower} of "
        f"{len(c[FAST])} periods."
    )


def rates(results: Results) -> FigureData:
    """Slowest rate of the counter-example against T, and its two candidate limits."""
    found = results["rates"]
    a, gain = COUNTEREXAMPLE.model.state[0, 0], (COUNTEREXAMPLE.injection @ COUNTEREXAMPLE.model.output)[0, 0]
    ends = [found["periods"][0], found["periods"][-1]]
    return columns_of(
        {"period_s": found["periods"]}
        | dict(found["rates"])
        | {"limit_period_s": ends, "shared_gain": [a - gain / COUNTEREXAMPLE.ratio] * 2, "full_gain": [a - gain] * 2}
    )


def plot_rates(drawn: FigureData) -> Any:
    """Rate against T on a logarithmic axis; above zero is unstable."""
    figure, (axis,) = new_axes(row_height=3.2)
    c = drawn.columns
    for index, name in enumerate((APO, REPAIRED, FAST)):
        axis.semilogx(c["period_s"], c[name], label=LABELS[name], **line(index))
    axis.plot(c["limit_period_s"], c["shared_gain"], ":", color="#777777", label="A − LC/M")
    axis.plot(c["limit_period_s"], c["full_gain"], "--", color="#777777", label="A − LC")
    axis.set(xlabel="T, s", ylabel="slowest rate, 1/s")
    axis.legend()
    return figure


def describe_rates(drawn: FigureData) -> str:
    """The rates at the smallest period."""
    c = drawn.columns
    return (
        f"At T = {c['period_s'][0]:g} s the slowest rate is {c[APO][0]:.4f} 1/s with the virtual measurement (6), "
        f"near A − LC/M = {c['shared_gain'][0]:.4f}, and {c[REPAIRED][0]:.4f} with the repaired predictor."
    )


FIGURES = (
    ours(
        name="stable-sets",
        place="Sec. V",
        title="Stable fast periods T for each ratio M",
        caption="Bars cover the periods with a stable motor loop. Sampling folds the motor's fast mode, so the stable "
        "set is not an interval; gaps narrower than the grid of T may be missed.",
        uses=("stable-sets",),
        data=stable_sets,
        plot=plot_stable_sets,
        alt=describe_stable_sets,
    ),
    ours(
        name="motor-eigenvalues",
        place="Sec. V",
        title="Eigenvalues of the motor loop against T",
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
        title="Slowest rate of the counter-example against T",
        caption="With the virtual measurement as printed the gain acts once in M periods: the rate tends to that of "
        "A − LC/M, which is positive here.",
        uses=("rates",),
        data=rates,
        plot=plot_rates,
        alt=describe_rates,
    ),
)
