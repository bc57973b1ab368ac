"""How each loop tracks (Figs. 2 and 3; errors by frequency, window, period and start), and how stable it is.

The latter: the counter-example in time, its rates, and the eigenvalues of the motor loop; and the readings of Table I.
"""

import math
from functools import partial
from itertools import groupby, pairwise
from typing import Any

from papers._common import Columns, Drawn
from papers.shao import printed
from papers.shao.experiments.tracking import SEARCH, merged
from papers.shao.printed import APO, COLUMNS, COUNTEREXAMPLE, DESIGN, FAST, HELD, NAMES, PMI, RESTARTED, SINGLE, STATE
from replication.audit.model import Results
from replication.drawing.style import (
    FOREGROUND,
    GREY,
    OURS,
    REFUTED,
    name_axes,
    name_end,
    name_line,
    new_axes,
    out_of_bounds,
    rms,
    say,
)

_LOOKS: dict[str, tuple[str, Any, float]] = {
    APO: (REFUTED, "-", 1.8),
    PMI: (FOREGROUND, "--", 1.3),
    HELD: (GREY, "-.", 1.3),
    SINGLE: (FOREGROUND, ":", 1.5),
    RESTARTED: (OURS, ":", 1.8),
    FAST: (GREY, "-", 1.1),
    STATE: (GREY, (0, (1, 2)), 1.3),
}


def look(loop: str) -> dict[str, Any]:
    """Keywords of `Axes.plot` for the curve of a loop: its colour, dashes and weight, the same in every figure."""
    colour, dashes, width = _LOOKS[loop]
    return {"color": colour, "linestyle": dashes, "linewidth": width}


ROWS = {
    "output": ("time_s", "position θ (rad)"),
    "error": ("time_s", "tracking error (rad)"),
    "estimation_error": ("instant_s", "estimation error (rad)"),
}
"""Rows of Figs. 2 and 3: what is drawn against which time, and its label."""

FROM = {"start-zero": "", "start-output": "_from_output"}
"""The readings of ζ(0) that Figs. 2 and 3 show, and the ends of their columns."""
WEIGHTS = {"pmi": 0.7, "apo": 1.6}
"""Line widths: thin and thick are told apart in grey where dashes would drown in the steps of the held input."""
STARTS = ("from ζ(0) = 0", "from ζ(0) = (y(0), 0, 0)")


def responses(sigma: str, results: Results) -> Columns:
    """Time, reference, outputs, tracking errors; instants, estimates and estimation errors; from both starts."""
    loops = {
        f"{short}{end}": results["transients"]["responses"][choice][name][sigma]
        for choice, end in FROM.items()
        for short, name in COLUMNS.items()
    }
    first = loops["pmi"]
    columns = {
        "time_s": first["time"],
        "reference": [y - e for y, e in zip(first["output"], first["error"], strict=True)],
        "instant_s": first["instants"],
    }
    for short in loops:
        for key in ("output", "error", "estimate", "estimation_error"):
            columns[f"{key}_{short}"] = loops[short][key]
    return columns


def plot_responses(c: Columns) -> Any:
    """A row for each signal, a column for each start; RMS values are those of the second half."""
    drawing, axes = new_axes(len(ROWS), len(FROM), row_height=1.45, sharey="row")
    for row, (key, (time, label)) in enumerate(ROWS.items()):
        largest = max(abs(e) for short in COLUMNS for end in FROM.values() for e in c[f"{key}_{short}{end}"])
        for column, (end, start) in enumerate(zip(FROM.values(), STARTS, strict=True)):
            axis = axes[len(FROM) * row + column]
            if key == "output":
                axis.plot(c["time_s"], c["reference"], color=GREY, linewidth=0.6, linestyle="-")
            for short, loop in COLUMNS.items():
                values, colour = c[f"{key}_{short}{end}"], look(loop)["color"]
                axis.plot(c[time], values, color=colour, linestyle="-", linewidth=WEIGHTS[short])
                caption = NAMES[loop] if key == "output" else f"{short.upper()} {rms(values[len(values) // 2 :]):.3f}"
                at, side = (0, "left") if short == "pmi" else (c["time_s"][-1], "right")
                axis.text(at, 1.2 * largest, caption, ha=side, va="bottom", color=colour)
            axis.set_ylim(-1.1 * largest, 1.9 * largest)
            heading = [start] * (row == 0) + [label if column == 0 else " "]
            name_axes(axis, "\n".join(heading), ticks=3)
    for axis in axes[-len(FROM) :]:
        axis.set_xlabel("time (s)")
    return drawing


def _told_responses(c: Columns) -> dict[str, Any]:
    """Errors early on from either start, and their root mean squares in the second half, from ζ(0) = 0."""
    times = len(c["error_pmi"])
    early = [
        "{:.3f} and {:.3f} rad".format(
            *(max(abs(e) for e in c[f"error_{short}{end}"][times // 40 : times // 8]) for short in COLUMNS)
        )
        for end in FROM.values()
    ]
    late = {short: rms(c[f"error_{short}"][times // 2 :]) for short in COLUMNS}
    length = c["time_s"][-1]
    return {**late, "early": early, "length": length, "from": length / 40, "to": length / 8}


SWEPT = (PMI, APO, HELD, RESTARTED, FAST, STATE, SINGLE)
LAGGING = (PMI, APO, HELD, RESTARTED)


def error_curves(results: Results) -> Columns:
    """Percent error against σ, and Table I."""
    record = results["frequencies"]
    columns = {"frequency_rad_s": record["frequencies"]} | {name: record["ratios"][name] for name in SWEPT}
    columns["table_frequency_rad_s"] = printed.FREQUENCIES
    columns |= {f"literal_{short}": results["table"]["ratios"][loop] for short, loop in COLUMNS.items()}
    return columns | {f"table_{short}": map(float, printed.table_1(f"DRC-{short.upper()}")) for short in COLUMNS}


SHOWN = {"pmi": (PMI, HELD, SINGLE), "apo": (APO, FAST, RESTARTED, STATE)}
"""The curves beside each column of Table I: its readings, or the loops it is compared with."""
BESIDE = {PMI: (0.2, 1), HELD: (0.08, -1), SINGLE: (0.5, -1), APO: (0.3, 1), FAST: (0.05, -1), STATE: (0.6, -1)}
"""Where the name of a curve stands: the frequency, and above it to the left (1) or below it to the right (-1)."""


def plot_error_curves(c: Columns) -> Any:
    """One panel for each column of Table I, both axes logarithmic; the printed points are joined."""
    drawing, axes = new_axes(len(SHOWN), row_height=2.4)
    for axis, (short, loops) in zip(axes, SHOWN.items(), strict=True):
        for loop in loops:
            (curve,) = axis.loglog(c["frequency_rad_s"], c[loop], **look(loop))
            if loop in BESIDE:
                at, side = BESIDE[loop]
                name = f"{NAMES[FAST]};\nrestarted\nlies on it" if loop == FAST else NAMES[loop]
                name_line(axis, curve, name, at, side=side, ha="right" if side > 0 else "left")
        points = c["table_frequency_rad_s"], c[f"table_{short}"]
        (joined,) = axis.plot(*points, "D", linestyle="-", color=FOREGROUND, linewidth=0.8)
        first = short == "pmi"
        name_line(axis, joined, "printed", points[0][0 if first else -1], side=-1 if first else 1, family="serif")
        name_axes(axis, f"DRC-{short.upper()}: tracking error (%)")
        axis.minorticks_off()
    axes[-1].set_xlabel("frequency σ (rad/s)")
    axes[-1].set_xticks((0.1, 1), ("0.1", "1"))
    return drawing


def _told_error_curves(c: Columns) -> dict[str, Any]:
    """The least and the largest printed error of each column as a multiple of that of the literal reading."""
    told: dict[str, Any] = {"last": c["frequency_rad_s"][-1]}
    for short in COLUMNS:
        pairs = zip(c[f"table_{short}"], c[f"literal_{short}"], strict=True)
        factors = [print_ / ours for print_, ours in pairs]
        told[short] = f"{min(factors):.2f} to {max(factors):.2f}"
    return told


def lag_curves(results: Results) -> Columns:
    """Mean lag of the estimate against M, with half the hold beside it, and the slowest rate under (6) at one M."""
    record = results["lags"]
    halves = [ratio * record["period"] / 2 for ratio in record["ratios"]]
    columns = {"ratio": record["ratios"]} | dict(record["lags"]) | {"half_slow_period_s": halves}
    return columns | {"rate_at_printed_ratio": [1 / results["transients"]["time_constants"][APO]]}


LIFTS = {PMI: 3.0, APO: -5.0, HELD: -12.0, RESTARTED: 0.0}
"""How far, in points, the names of the lags are moved apart."""


def plot_lag_curves(c: Columns) -> Any:
    """Lag in seconds against M."""
    drawing, (axis,) = new_axes(row_height=2.5)
    for index, name in enumerate(LAGGING):
        (curve,) = axis.plot(c["ratio"], c[name], marker="osv^"[index], markersize=4, **look(name))
        name_end(axis, curve, NAMES[name], lift=LIFTS[name])
    (half,) = axis.plot(c["ratio"], c["half_slow_period_s"], color=GREY, linewidth=0.8, linestyle="-")
    name_end(axis, half, "M T/2", lift=5)
    axis.set_xticks(c["ratio"][::3])
    name_axes(axis, "lag of the estimate (s)", "ratio M")
    return drawing


def _told_lag_curves(c: Columns) -> dict[str, Any]:
    last = {f"last_{name}": values[-1] for name, values in c.items()}
    return {**last, "printed_ratio": printed.DESIGN.ratio, "lowest": min(printed.FREQUENCIES)}


DISTURBED = (PMI, APO, HELD, RESTARTED, FAST)
PARAMETERS = {"inertia": "inertia J", "flux": "flux", "resistance": "resistance R"}


def robustness_curves(results: Results) -> Columns:
    """Percent error at σ = 1 rad/s against the factor by which a parameter of the plant is off."""
    record = results["robustness"]
    columns: dict[str, list[float]] = {"factor": record["factors"]}
    for parameter in PARAMETERS:
        for name in DISTURBED:
            columns[f"{parameter}_{name}"] = [float("inf") if e is None else e for _, e in record[parameter][name]]
    return columns


def plot_robustness_curves(c: Columns) -> Any:
    """Error against the true over the nominal flux, on which it hangs; inertia and resistance are told in words."""
    drawing, (axis,) = new_axes(row_height=3.0)
    for name in DISTURBED:
        (curve,) = axis.semilogy(c["factor"], c[f"flux_{name}"], zorder=3 if name == APO else 2, **look(name))
        at, side, ha = PLACES[name]
        name_line(axis, curve, NAMES[name], at, side=side, ha=ha)
    axis.axvline(1.0, color=GREY, linewidth=0.6)
    axis.set_xticks((0.5, 1, 1.5, 2), ("0.5", "1", "1.5", "2"))
    axis.set_yticks((1, 10, 100), ("1", "10", "100"))
    axis.minorticks_off()
    axis.set_ylim(bottom=0.6)
    name_axes(axis, "largest tracking error (%)", "true flux over nominal flux")
    return drawing


PLACES = {
    PMI: (0.6, 1, "left"),
    HELD: (1.5, -1, "left"),
    APO: (0.85, -1, "right"),
    RESTARTED: (1.12, -1, "left"),
    FAST: (1.065, -1, "left"),
}
"""Where the name of a curve stands: abscissa, side, and which end of the words is there."""


def _told_robustness_curves(c: Columns) -> dict[str, Any]:
    """The error of DRC-APO where it is largest, by which factor the flux is off there, and the largest of all."""
    apo, fast, factors = (c[name] for name in (f"flux_{APO}", f"flux_{FAST}", "factor"))
    at = apo.index(max(apo))
    return {
        "at": factors[at],
        "error": apo[at],
        "against": "more" if apo[at] > fast[at] else "less",
        "last": factors[-1],
        "loops": "; ".join(f"{printed.LABELS[loop]} {max(c[f'flux_{loop}']):.0f} %" for loop in DISTURBED),
        "largest": "; ".join(f"{words} {max(c[f'{name}_{APO}']):.0f} %" for name, words in PARAMETERS.items()),
    }


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


def _told_counter_example(c: Columns) -> dict[str, Any]:
    return {
        # x of the printed loop at the end of the upper panel.
        "grown": min(zip(c["time_s"], c[APO], strict=True), key=lambda at: abs(at[0] - ENDS[0]))[1],
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
SIDES = {APO: (0.06, 1), FAST: (0.04, -1), PMI: (0.12, -1)}
"""Where the name of a curve ends: the period, and above it (1) or below it (-1)."""


def plot_eigenvalues(c: Columns) -> Any:
    """Moduli against T; above one is unstable."""
    figure, (axis,) = new_axes(row_height=3.2)
    period = c["period_s"]
    out_of_bounds(axis, 1.0, TOP, "unstable above 1", at=0.45)
    for key, name in ((FAST, FAST), (PMI, PMI), (RESTARTED, RESTARTED), (f"{APO}_1", APO)):
        (curve,) = axis.semilogx(period, c[key], **look(name))
        edges = [k for k, (a, b) in enumerate(pairwise(c[key])) if (a > TOP) != (b > TOP)]
        axis.plot([period[k] for k in edges], [0.96 * TOP] * len(edges), "^", color=curve.get_color(), markersize=5)
        if name in SIDES:
            at, side = SIDES[name]
            name_line(axis, curve, NAMES[name], at, side=side, ha="right")
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


FIGURES: Drawn = {
    **{
        f"fig{number}": (partial(responses, sigma), plot_responses, _told_responses)
        for number, sigma in printed.DATA["frequency"].items()
    },
    "robustness": (robustness_curves, plot_robustness_curves, _told_robustness_curves),
    "error-frequency": (error_curves, plot_error_curves, _told_error_curves),
    "lag": (lag_curves, plot_lag_curves, _told_lag_curves),
    "counter-example": (counter_example, plot_counter_example, _told_counter_example),
    "motor-eigenvalues": (eigenvalues, plot_eigenvalues, _told_eigenvalues),
    "rates": (rates, plot_rates, _told_rates),
    "readings": (reading_scores, plot_reading_scores, _told_reading_scores),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
