"""Figs. 2 and 3, and how each loop tracks: errors by frequency, window, period and start."""

from functools import partial
from typing import Any

from papers._common import Columns, Drawn
from papers.shao import printed
from papers.shao.figures import look
from papers.shao.printed import APO, COLUMNS, FAST, HELD, NAMES, PMI, RESTARTED, SINGLE, STATE
from replication.audit.model import Results
from replication.drawing.style import FOREGROUND, GREY, name_axes, name_end, name_line, new_axes, rms

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


BESIDE = {PMI: (0.2, 1), HELD: (0.08, -1), SINGLE: (0.5, -1), APO: (0.3, 1), FAST: (0.055, -1), STATE: (0.6, -1)}
"""Where the name of a curve stands: the frequency, and above it to the left (1) or below it to the right (-1)."""


def plot_error_curves(c: Columns) -> Any:
    """One panel for each column of Table I, both axes logarithmic; the printed points are joined."""
    drawing, axes = new_axes(len(SHOWN), row_height=2.4)
    for axis, (short, loops) in zip(axes, SHOWN.items(), strict=True):
        for loop in loops:
            (curve,) = axis.loglog(c["frequency_rad_s"], c[loop], **look(loop))
            if loop in BESIDE:
                at, side = BESIDE[loop]
                name = f"{NAMES[FAST]};\nrestarted lies on it" if loop == FAST else NAMES[loop]
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


def _print_over_ours(c: Columns, short: str) -> tuple[float, float]:
    """The least and the largest printed error of a column as a multiple of that of the literal reading."""
    pairs = zip(c[f"table_{short}"], c[f"literal_{short}"], strict=True)
    factors = [print_ / ours for print_, ours in pairs]
    return min(factors), max(factors)


def _told_error_curves(c: Columns) -> dict[str, Any]:
    factors = {short: "{:.2f} to {:.2f}".format(*_print_over_ours(c, short)) for short in COLUMNS}
    return {**factors, "last": c["frequency_rad_s"][-1]}


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


def _largest(c: Columns, parameter: str, loop: str = APO) -> float:
    return float(max(c[f"{parameter}_{loop}"]))


def _told_robustness_curves(c: Columns) -> dict[str, Any]:
    """The error of DRC-APO where it is largest, by which factor the flux is off there, and the largest of all."""
    apo, fast, factors = (c[name] for name in (f"flux_{APO}", f"flux_{FAST}", "factor"))
    at = apo.index(max(apo))
    return {
        "at": factors[at],
        "error": apo[at],
        "against": "more" if apo[at] > fast[at] else "less",
        "last": factors[-1],
        "loops": "; ".join(f"{printed.LABELS[loop]} {_largest(c, 'flux', loop):.0f} %" for loop in DISTURBED),
        "largest": "; ".join(f"{words} {_largest(c, name):.0f} %" for name, words in PARAMETERS.items()),
    }


FIGURES: Drawn = {
    **{
        f"fig{number}": (partial(responses, sigma), plot_responses, _told_responses)
        for number, sigma in printed.DATA["frequency"].items()
    },
    "robustness": (robustness_curves, plot_robustness_curves, _told_robustness_curves),
    "error-frequency": (error_curves, plot_error_curves, _told_error_curves),
    "lag": (lag_curves, plot_lag_curves, _told_lag_curves),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
