"""Figures on the steady state: error against frequency, lag of the estimate, error of a wrong model."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from papers.shao.figures.looks import NAMES, columns_of, look, ours
from papers.shao.printed import table_1
from papers.shao.problem import APO, COLUMNS, FAST, FREQUENCIES, HELD, PMI, REPAIRED, SINGLE, STATE
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.labels import name_axes, name_end, name_line
from replication.drawing.style import FOREGROUND, GREY, WIDTH, new_axes

SWEPT = (PMI, APO, HELD, REPAIRED, FAST, STATE, SINGLE)
LAGGING = (PMI, APO, HELD, REPAIRED)
DISTURBED = (PMI, APO, HELD, REPAIRED, FAST)


def error_curves(results: Results) -> FigureData:
    """Percent error against σ, and Table I."""
    found = results["frequencies"]
    columns = {"frequency_rad_s": found["frequencies"]} | {name: found["ratios"][name] for name in SWEPT}
    columns["table_frequency_rad_s"] = FREQUENCIES
    return columns_of(columns | {f"table_{short}": map(float, table_1(f"DRC-{short.upper()}")) for short in COLUMNS})


SHOWN = {"pmi": (PMI, HELD, SINGLE), "apo": (APO, FAST, REPAIRED, STATE)}
"""The curves beside each column of Table I: its readings, or the loops it is compared with."""


BESIDE = {PMI: (0.2, 1), HELD: (0.08, -1), SINGLE: (0.5, -1), APO: (0.3, 1), FAST: (0.07, -1), STATE: (0.3, -1)}
"""Where the name of a curve stands: the frequency, and above it to the left (1) or below it to the right (-1)."""


def plot_error_curves(drawn: FigureData) -> Any:
    """One panel for each column of Table I, both axes logarithmic; the printed points are joined."""
    drawing, axes = new_axes(len(SHOWN), row_height=2.4)
    c = drawn.columns
    for axis, (short, loops) in zip(axes, SHOWN.items(), strict=True):
        for loop in loops:
            (curve,) = axis.loglog(c["frequency_rad_s"], c[loop], **look(loop))
            if loop in BESIDE:
                at, side = BESIDE[loop]
                name = f"{NAMES[FAST]},\n{NAMES[REPAIRED]}" if loop == FAST else NAMES[loop]
                name_line(axis, curve, name, at, side=side, ha="right" if side > 0 else "left")
        points = c["table_frequency_rad_s"], c[f"table_{short}"]
        (printed,) = axis.plot(*points, "D", linestyle="-", color=FOREGROUND, linewidth=0.8)
        first = short == "pmi"
        name_line(axis, printed, "printed", points[0][0 if first else -1], side=-1 if first else 1, family="serif")
        name_axes(axis, f"DRC-{short.upper()}: tracking error (%)")
        axis.minorticks_off()
    axes[-1].set_xlabel("frequency σ (rad/s)")
    axes[-1].set_xticks((0.1, 1), ("0.1", "1"))
    return drawing


def _print_over_ours(drawn: FigureData) -> Iterator[float]:
    """Each printed error as a multiple of that of the literal reading, between whose points the curve is a power."""
    c = drawn.columns
    x = [math.log(frequency) for frequency in c["frequency_rad_s"]]
    for short, loop in COLUMNS.items():
        y = [math.log(error) for error in c[loop]]
        for frequency, printed in zip(c["table_frequency_rad_s"], c[f"table_{short}"], strict=True):
            at = math.log(frequency)
            k = max(i for i in range(len(x) - 1) if x[i] <= at)
            yield printed / math.exp(y[k] + (y[k + 1] - y[k]) * (at - x[k]) / (x[k + 1] - x[k]))


def say_error_curves(drawn: FigureData) -> str:
    """The message: how far the print is from the literal reading."""
    factors = sorted(_print_over_ours(drawn))
    return f"Table I prints {factors[0]:.2f} to {factors[-1]:.2f} times the errors of the literal reading"


def describe_error_curves(drawn: FigureData) -> str:
    """Ends of the curves of the two printed controllers, and how far the print is from them."""
    c, factors = drawn.columns, sorted(_print_over_ours(drawn))
    return (
        f"Tracking error against frequency from {c['frequency_rad_s'][0]:.2f} to {c['frequency_rad_s'][-1]:.0f} rad/s. "
        f"At the lowest it is {c[PMI][0]:.2f} percent under DRC-PMI and {c[APO][0]:.2f} under DRC-APO. The printed "
        f"errors are {factors[0]:.2f} to {factors[-1]:.2f} times those of the literal reading."
    )


def lag_curves(results: Results) -> FigureData:
    """Mean lag of the estimate against M, with half the hold beside it."""
    found = results["lags"]
    halves = [ratio * found["period"] / 2 for ratio in found["ratios"]]
    return columns_of({"ratio": found["ratios"]} | dict(found["lags"]) | {"half_slow_period_s": halves})


LIFTS = {PMI: 3.0, APO: -5.0, HELD: -12.0, REPAIRED: 0.0}
"""How far, in points, the names of the lags are moved apart."""


def plot_lag_curves(drawn: FigureData) -> Any:
    """Lag in seconds against M."""
    drawing, (axis,) = new_axes(row_height=2.5)
    c = drawn.columns
    for index, name in enumerate(LAGGING):
        (curve,) = axis.plot(c["ratio"], c[name], marker="osv^"[index], markersize=4, **look(name))
        name_end(axis, curve, NAMES[name], lift=LIFTS[name])
    (half,) = axis.plot(c["ratio"], c["half_slow_period_s"], color=GREY, linewidth=0.8, linestyle="-")
    name_end(axis, half, "M T/2", lift=5)
    axis.set_xticks(c["ratio"][::3])
    name_axes(axis, "lag of the estimate (s)", "ratio M")
    return drawing


def say_lag_curves(drawn: FigureData) -> str:
    """The message: the lag of the virtual measurement beside that of the repaired one."""
    printed, repaired = (drawn.columns[name][-1] for name in (APO, REPAIRED))
    return f"At the largest ratio DRC-APO's estimate lags {printed:.3f} s, with the repaired predictor {repaired:.3f} s"


def describe_lag_curves(drawn: FigureData) -> str:
    """The lags at the largest ratio."""
    c = drawn.columns
    return (
        f"At M = {c['ratio'][-1]:.0f} a slow reference is estimated {c[HELD][-1]:.3f} s late with a held measurement, "
        f"{c[PMI][-1]:.3f} s if the model alone carries the estimate between the slow instants, "
        f"{c[APO][-1]:.3f} s with the virtual one as printed and {c[REPAIRED][-1]:.3f} s with the repaired predictor; "
        f"half the slow period is {c['half_slow_period_s'][-1]:.3f} s."
    )


PARAMETERS = {"inertia": "inertia J", "flux": "flux Ψ_f and torque constant K_T", "resistance": "resistance R"}


def robustness_curves(results: Results) -> FigureData:
    """Percent error at σ = 1 rad/s against the factor by which a parameter of the plant is off."""
    found = results["robustness"]
    columns: dict[str, list[float]] = {"factor": found["factors"]}
    for parameter in PARAMETERS:
        for name in DISTURBED:
            columns[f"{parameter}_{name}"] = [float("inf") if e is None else e for _, e in found[parameter][name]]
    return columns_of(columns)


def plot_robustness_curves(drawn: FigureData) -> Any:
    """The flux above, on which the error hangs; inertia and resistance below."""
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(WIDTH, 4.9), layout="constrained")
    grid = drawing.add_gridspec(2, 2, height_ratios=(3, 2))
    flux = drawing.add_subplot(grid[0, :])
    inertia, resistance = (drawing.add_subplot(grid[1, k], sharey=flux) for k in (0, 1))
    c = drawn.columns
    panels = {"flux": flux, "inertia": inertia, "resistance": resistance}
    for parameter, axis in panels.items():
        for name in DISTURBED:
            axis.semilogy(c["factor"], c[f"{parameter}_{name}"], zorder=3 if name == APO else 2, **look(name))
        axis.set_xticks((0.5, 1, 1.5, 2))
        axis.minorticks_off()
        name_axes(axis, f"{parameter}: error (%)", "true over nominal")
        axis.axvline(1.0, color=GREY, linewidth=0.6)
    resistance.tick_params(labelleft=False)
    flux.set_ylim(bottom=0.6)
    lines = dict(zip(DISTURBED, flux.lines, strict=False))
    for name, at, side, ha in PLACES:
        name_line(flux, lines[name], NAMES[name], at, side=side, ha=ha)
    return drawing


PLACES = (
    (PMI, 0.6, 1, "left"),
    (HELD, 1.5, -1, "left"),
    (APO, 1.0, -1, "right"),
    (REPAIRED, 1.075, 1, "left"),
    (FAST, 1.075, -1, "left"),
)
"""Where the names of the curves stand: abscissa, side, and which end of the words is there."""


def _range(drawn: FigureData, parameter: str) -> tuple[float, float]:
    errors = drawn.columns[f"{parameter}_{APO}"]
    return min(errors), max(errors)


def say_robustness_curves(drawn: FigureData) -> str:
    """The message: what the most telling parameter does."""
    worst = max(PARAMETERS, key=lambda name: _range(drawn, name)[1] / _range(drawn, name)[0])
    low, high = _range(drawn, worst)
    return f"A wrong {worst} moves the tracking error of DRC-APO between {low:.2f} and {high:.2f} %"


def describe_robustness_curves(drawn: FigureData) -> str:
    """Range of the error over the factors for each parameter under DRC-APO."""
    ranges = [
        f"{symbol}: {min(drawn.columns[f'{parameter}_{APO}']):.2f} to {max(drawn.columns[f'{parameter}_{APO}']):.2f}"
        for parameter, symbol in PARAMETERS.items()
    ]
    return (
        f"Percent error of DRC-APO over the factors of a parameter that the model does not know. {'; '.join(ranges)}."
    )


FIGURES = (
    ours(
        name="robustness",
        place="Sec. V",
        title=say_robustness_curves,
        caption="Error at 1 rad/s, steady state, under the literal reading. The observer and the feedforward keep "
        "the printed parameters; "
        "with Ψ_f the torque constant moves too.",
        uses=("robustness",),
        data=robustness_curves,
        plot=plot_robustness_curves,
        alt=describe_robustness_curves,
    ),
    ours(
        name="error-frequency",
        place="Table I",
        title=say_error_curves,
        caption="Steady state, largest error over all times, with the points of Table I. The text leaves open which "
        "DRC-PMI is meant; three are drawn.",
        uses=("frequencies",),
        data=error_curves,
        plot=plot_error_curves,
        alt=describe_error_curves,
    ),
    ours(
        name="lag",
        place="eqs. (2) and (6)",
        title=say_lag_curves,
        caption="Mean lag of the position estimate for a very slow reference. A held measurement makes the estimate "
        "late by about half the hold, and so does (6), for references far below its slow rate. The frequencies of "
        "Table I lie above that rate: the lag shown here does not tell its columns apart.",
        uses=("lags",),
        data=lag_curves,
        plot=plot_lag_curves,
        alt=describe_lag_curves,
    ),
)
