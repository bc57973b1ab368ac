"""Figures: levels over the periods, and the responses of the observers."""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from papers._common import Columns, Drawn
from papers.okajima2023.experiments.declared import PERIOD_TABLE
from replication.audit.model import Results
from replication.drawing.style import (
    BAND,
    FOREGROUND,
    GREY,
    OURS,
    line,
    mark_clipped,
    name_axes,
    name_end,
    name_line,
    new_axes,
    rms,
)


def table_of_periods(results: Results) -> Columns:
    """Optimal level for every pair of periods up to six, synchronous and with the best timing."""
    cells = results[PERIOD_TABLE]
    rows = [
        (*cell["periods"], cell["synchronous"]["optimum"], cell["best"]["optimum"], cell["best_offset"])
        for cell in cells
    ]
    return dict(zip(CELL, zip(*rows, strict=True), strict=True))


def plot_table_of_periods(c: Columns) -> Any:
    """A table of numbers on a shaded grid; below the level that of the best timing, framed where a rule breaks."""
    size = int(max(c["N1"]))
    drawing, (axis,) = new_axes(1, row_height=3.9)
    least, most = min(c["gamma_synchronous"]), max(c["gamma_synchronous"])
    broken = {pair for pair, _ in exceptions(c)}
    for first, second, level, best, offset in zip(*(c[name] for name in CELL), strict=True):
        across, shade = [second - 0.5, second + 0.5], (level - least) / (most - least)
        axis.fill_between(across, first - 0.5, first + 0.5, color=BAND, alpha=shade, linewidth=0)
        moved = offset > 0
        middle: dict[str, Any] = {"ha": "center", "va": "center"}
        axis.text(second, first - (0.2 if moved else 0), f"{level:.3f}", **middle)
        if moved:
            axis.text(second, first + 0.22, f"{best:.2f}→{offset:.0f}", color=OURS, **middle)
        if (first, second) in broken:
            axis.plot(
                [second + d for d in (-0.46, 0.46, 0.46, -0.46, -0.46)],
                [first + d for d in (-0.46, -0.46, 0.46, 0.46, -0.46)],
                color=FOREGROUND, linewidth=1.6, linestyle="-",
            )  # fmt: skip
    axis.set(xlim=(0.5, size + 0.5), ylim=(size + 0.5, 0.5))
    axis.set_xlabel("period N₂ (instants)\nblack: γ at offset 0; blue: least γ → its offset θ₂")
    axis.set_xticks(range(1, size + 1))
    axis.set_yticks(range(1, size + 1))
    axis.set_title("period N₁ (instants)")
    axis.grid(False)
    return drawing


CELL = ("N1", "N2", "gamma_synchronous", "gamma_best_timing", "best_offset")
Pair = tuple[float, float]


def exceptions(c: Columns) -> list[tuple[Pair, Pair]]:
    """Pairs of periods whose level is larger than that of the next pair with one period longer by one instant."""
    level = dict(zip(zip(c["N1"], c["N2"], strict=True), c["gamma_synchronous"], strict=True))
    longer = [((a, b), (a + da, b + db)) for a, b in level for da, db in ((1, 0), (0, 1)) if (a + da, b + db) in level]
    return [(pair, neighbour) for pair, neighbour in longer if level[pair] > level[neighbour] * (1 + LEVEL_EXCESS)]


LEVEL_EXCESS = 1e-6
"""Relative difference below which two levels count as equal: what bisection leaves is far smaller."""


def told_table_of_periods(c: Columns) -> dict[str, Any]:
    """Range of the table, the largest gain by timing, and where a longer period has the smaller level, if it does."""
    pairs = exceptions(c)
    rows = zip(*(c[name] for name in CELL), strict=True)
    saving, first, second, offset = max((1 - best / plain, a, b, at) for a, b, plain, best, at in rows)
    largest = f"{max(c['N1']):.0f}"
    message = f"Up to {largest} instants a longer period never lowers the level"
    if pairs:
        (a, b), (more, later) = max(pairs)
        message = f"A longer period can lower the level: ({a:.0f}, {b:.0f}) exceeds ({more:.0f}, {later:.0f})"
    return {
        "message": message,
        "largest": largest,
        "least": min(c["gamma_synchronous"]),
        "most": max(c["gamma_synchronous"]),
        "best": f"({first:.0f}, {second:.0f}) with offset {offset:.0f}: {100 * saving:.1f} %",
        "listed": ", ".join(
            f"({a:.0f}, {b:.0f}) has a larger level than ({c:.0f}, {d:.0f})" for (a, b), (c, d) in pairs
        ),
    }


SHOWN_TIMINGS = ((3, 3), (4, 4), (5, 5), (6, 6), (6, 3), (4, 6))


def levels_by_timing(results: Results) -> Columns:
    """Optimal level against the offset of the second sensor, for pairs of periods with a common divisor."""
    cells = {tuple(cell["periods"]): cell for cell in results[PERIOD_TABLE]}
    levels = {f"gamma_{a}_{b}": cells[a, b]["by_offset"] for a, b in SHOWN_TIMINGS}
    return {"offset": range(max(map(len, levels.values()))), **levels}


def _by_pair(c: Columns) -> dict[str, tuple[float, ...]]:
    return {f"({', '.join(name.split('_')[1:])})": v for name, v in c.items() if name != "offset"}


def plot_levels_by_timing(c: Columns) -> Any:
    """One curve per pair of periods, which is its name."""
    drawing, (axis,) = new_axes(1, row_height=2.7)
    offsets = c["offset"]
    for index, (pair, levels) in enumerate(_by_pair(c).items()):
        (curve,) = axis.plot(offsets[: len(levels)], levels, marker="os^vDx"[index], markersize=4, **line(index))
        name_end(axis, curve, pair)
    axis.set_xticks(range(len(offsets)))
    axis.set_xlim(-0.1, len(offsets) - 0.5)
    name_axes(axis, "optimal level γ for the periods (N₁, N₂)", "offset θ₂ of the second sensor (instants)")
    return drawing


def told_levels_by_timing(c: Columns) -> dict[str, Any]:
    """Smallest and largest level of each curve, and what shifting a sensor is worth where it is worth most."""
    levels = _by_pair(c)
    saving, pair = max((100 * (1 - min(values) / values[0]), pair) for pair, values in levels.items())
    ranges = "; ".join(f"{pair}: {min(values):.4f} to {max(values):.4f}" for pair, values in levels.items())
    return {"saving": saving, "pair": pair, "ranges": ranges}


# Figures 2-8 on the axes of Fig. 6: the errors under one draw of the noise; and the worst disturbance


AXIS_LIMIT, LAST_SHOWN = 0.5, 500
"""The axes of Fig. 6, the only figure whose ticks the text shows: errors from -0.5 to 0.5, instants from 0 to 500."""

STATES, TOGETHER = 3, 8
CASES = {
    "proposed": "Fig. 2, proposed",
    "A": "Fig. 3, y₁ alone",
    "B": "Fig. 4, y₂ alone",
    "C": "Fig. 5, every 6th instant",
}
TIMINGS = {
    "timing-1": "Fig. 6, both together", "timing-2": "Fig. 7, y₂ one later", "timing-3": "Fig. 8, y₂ two later",
}  # fmt: skip
"""The observers of Figs. 2-5 and of Figs. 6-8, each with its name in the figure."""
OBSERVERS = CASES | TIMINGS


def errors(names: Iterable[str], results: Results) -> Columns:
    """The three estimation errors of some observers under the same seeded draw, k = 0 ... 500."""
    shown = {name: results["responses"]["errors"][name][: LAST_SHOWN + 1] for name in names}
    rows = {f"{name}_e_{i + 1}": [row[i] for row in series] for name, series in shown.items() for i in range(STATES)}
    return {"k": range(LAST_SHOWN + 1), **rows}


def plot_errors(names: Mapping[str, str], c: Columns) -> Any:
    """A row for each observer on the axes of Fig. 6; a triangle at the edge for each instant beyond them."""
    drawing, axes = new_axes(len(names), STATES, row_height=1.25, sharey=True)
    for row, (name, title) in enumerate(names.items()):
        for i in range(STATES):
            axis, values = axes[STATES * row + i], c[f"{name}_e_{i + 1}"]
            axis.plot(*extremes(c["k"], values), linewidth=0.7, color=OURS)
            axis.axhline(0.0, color=FOREGROUND, linewidth=0.5)
            mark_clipped(axis, c["k"], values, AXIS_LIMIT, OURS)
            axis.set(xlim=(0, LAST_SHOWN), ylim=(-AXIS_LIMIT, AXIS_LIMIT), yticks=(-AXIS_LIMIT, 0, AXIS_LIMIT))
            axis.set_xticks((0, 200, 400))
            axis.tick_params(bottom=row == len(names) - 1, left=i == 0)
            axis.set_title(f" \ne{'₁₂₃'[i]}: {rms(values):.3f}")
        label = f"{title}: RMS {rms_of_all(name, c):.3f}"
        axes[STATES * row].annotate(
            label, (0, 1), xytext=(0, 20), xycoords="axes fraction", textcoords="offset points", annotation_clip=False
        ).set_in_layout(False)
    axes[-2].set_xlabel("instant k")
    return drawing


def extremes(k: Sequence[float], values: Sequence[float]) -> tuple[list[float], list[float]]:
    """Least and largest value of every `TOGETHER` instants, in their order: the same line to the eye."""
    indices: list[int] = []
    for start in range(0, len(values), TOGETHER):
        part = range(start, min(start + TOGETHER, len(values)))
        indices += sorted({min(part, key=values.__getitem__), max(part, key=values.__getitem__)})
    return [k[i] for i in indices], [values[i] for i in indices]


def rms_of_all(name: str, c: Columns) -> float:
    """Root mean square of the three errors together."""
    return rms([value for i in range(STATES) for value in c[f"{name}_e_{i + 1}"]])


def sizes(results: Results) -> Columns:
    """Root mean square of each error, and of all three, of the observers of Figs. 2-5 and of Figs. 6-8."""
    c = errors(OBSERVERS, results)
    each = {f"e_{i + 1}": [rms(c[f"{name}_e_{i + 1}"]) for name in OBSERVERS] for i in range(STATES)}
    return {"row": range(len(OBSERVERS)), **each, "all": [rms_of_all(name, c) for name in OBSERVERS]}


def plot_sizes(c: Columns) -> Any:
    """A row for each observer: the whole error as a dot with its number, the three errors as small rings."""
    drawing, (axis,) = new_axes(1, row_height=2.9)
    for i in range(STATES):
        axis.plot(c[f"e_{i + 1}"], c["row"], "o", markersize=4, color=GREY, markerfacecolor="none", linestyle="none")
    axis.plot(c["all"], c["row"], "o", markersize=7, color=OURS, linestyle="none")
    for row, whole in zip(c["row"], c["all"], strict=True):
        axis.text(0.0, row - 0.28, f"{OBSERVERS[list(OBSERVERS)[int(row)]]}: {whole:.3f}", va="center")
    axis.set(xlim=(0, None), ylim=(len(OBSERVERS) - 0.5, -0.7), yticks=())
    axis.locator_params(axis="x", nbins=5)
    axis.set_xlabel("RMS error; blue: all three states, grey: each")
    axis.grid(False)
    return drawing


def told_sizes(c: Columns) -> dict[str, Any]:
    """The whole errors, row by row: of the observer that reads both sensors at their own periods, and of the next."""
    whole = c["all"]
    listed = ", ".join(f"{title} {value:.3f}" for title, value in zip(OBSERVERS.values(), whole, strict=True))
    return {"proposed": whole[0], "least": min(whole[1 : len(CASES)]), "listed": listed}


def told_errors(names: Mapping[str, str], c: Columns) -> dict[str, Any]:
    """Root mean squares, how often the axes are exceeded, and what the first observer is worth in this draw."""
    parts = []
    for name, title in names.items():
        values = [c[f"{name}_e_{i + 1}"] for i in range(STATES)]
        sizes, beyond = ", ".join(f"{rms(v):.3f}" for v in values), sum(abs(e) > AXIS_LIMIT for v in values for e in v)
        parts.append(f"{title}: {sizes}, together {rms_of_all(name, c):.3f}, {beyond} values beyond the axes")
    whole = [rms_of_all(name, c) for name in names]
    # The largest ratio, rounded up, since it is called a bound.
    factor = f"{math.ceil(100 * max(whole[0] / total for total in whole[1:])) / 100:.2f}"
    most = f"at most {factor} of any other" if float(factor) <= 1 else f"up to {factor} times as large as another"
    ends = {"least": min(whole), "largest": max(whole)}
    return {"factor": factor, **ends, "last": LAST_SHOWN, "sizes": "; ".join(parts), "most": most}


def disturbances(results: Results) -> Columns:
    """Size of the error under the worst disturbance and under a random one of the same energy."""
    record = results["worst-disturbance"]
    ends = {"ratio_worst": "worst_ratio", "ratio_random": "random_ratio", "norm": "norm"}
    errors = {"worst": record["worst_error"], "random": record["random_error"]}
    return {"k": range(len(errors["worst"]))} | errors | {name: [record[of]] for name, of in ends.items()}


def plot_disturbances(c: Columns) -> Any:
    """Both error sizes over time, each named with its ratio."""
    drawing, (axis,) = new_axes(1, row_height=2.3)
    (random,) = axis.plot(c["k"], c["random"], **line(1) | {"linewidth": 0.9, "linestyle": "-"})
    (worst,) = axis.plot(c["k"], c["worst"], **line(0))
    peaks = {
        curve: max(range(len(c[name])), key=c[name].__getitem__)
        for curve, name in ((worst, "worst"), (random, "random"))
    }
    name_line(axis, worst, f"worst disturbance, ratio {c['ratio_worst'][0]:.3f}", peaks[worst])
    name_line(axis, random, f"random one,\nratio {c['ratio_random'][0]:.3f}", peaks[random], ha="left")
    axis.set_xlim(0, 1.15 * len(c["k"]))
    axis.set_ylim(0, 1.2 * max(c["worst"]))
    name_axes(axis, "size of the error |e|", "instant k")
    return drawing


FIGURES: Drawn = {
    "rms": (sizes, plot_sizes, told_sizes),
    **{
        name: (partial(errors, tuple(names)), partial(plot_errors, names), partial(told_errors, names))
        for name, names in (("fig2-5", CASES), ("fig6-8", TIMINGS))
    },
    "worst": (disturbances, plot_disturbances, lambda c: {"instants": len(c["k"])}),
    "periods": (table_of_periods, plot_table_of_periods, told_table_of_periods),
    "timing": (levels_by_timing, plot_levels_by_timing, told_levels_by_timing),
}
"""What gives the data of each, draws them, and finds what their words name; told.toml has the rest."""
