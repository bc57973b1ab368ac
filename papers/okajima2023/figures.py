"""Figures 2-8 on the axes of Fig. 6, and what the paper lacks: all periods, all timings, the worst disturbance."""

from __future__ import annotations

from functools import partial
from typing import Any

from papers.okajima2023.experiments.declared import PERIOD_TABLE, all_periods
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import COLOURS, FOREGROUND, line, new_axes

AXIS_LIMIT, LAST_SHOWN = 0.5, 500
"""The axes of Fig. 6, the only figure whose ticks the text shows: errors from -0.5 to 0.5, instants from 0 to 500."""

TIMED = ("timing-1", "timing-2", "timing-3")
_OURS = "central optimal gains of ours, none being printed"
_SHOWN = (
    ("proposed", "Fig. 2", "the proposed multi-rate observer", "the printed gains (33)"),
    ("A", "Fig. 3", "the dual-rate observer with y₁ alone (Case A)", _OURS),
    ("B", "Fig. 4", "the dual-rate observer with y₂ alone (Case B)", _OURS),
    ("C", "Fig. 5", "both outputs read at the common period 6 (Case C)", _OURS),
    ("timing-1", "Fig. 6", "N₁ = N₂ = 3, both sensors together (Case 1)", "the printed gains (38)"),
    ("timing-2", "Fig. 7", "N₁ = N₂ = 3, the second sensor one instant later (Case 2)", "the printed gains (39)"),
    ("timing-3", "Fig. 8", "N₁ = N₂ = 3, the second sensor two instants later (Case 3)", "the printed gains (40)"),
)


def errors(name: str, results: Results) -> FigureData:
    """The three estimation errors of one observer under the seeded draw, k = 0 ... 500."""
    rows = results["responses"]["errors"][name][: LAST_SHOWN + 1]
    columns = {f"e_{i + 1}": tuple(row[i] for row in rows) for i in range(len(rows[0]))}
    return FigureData(columns={"k": tuple(float(k) for k in range(len(rows))), **columns})


def plot_errors(figure: FigureData) -> Any:
    """Three stacked panels with the axes of Fig. 6; a triangle at the edge for each instant beyond them."""
    k = figure.columns["k"]
    names = [name for name in figure.columns if name != "k"]
    drawing, axes = new_axes(len(names), row_height=1.05)
    for i, (axis, name) in enumerate(zip(axes, names, strict=True)):
        axis.plot(k, figure.columns[name], linewidth=0.8, color=COLOURS[i], linestyle="-")
        axis.axhline(0.0, color=FOREGROUND, linewidth=0.5)
        for edge, marker in ((AXIS_LIMIT, "^"), (-AXIS_LIMIT, "v")):
            beyond = [at for at, value in zip(k, figure.columns[name], strict=True) if value * edge > AXIS_LIMIT**2]
            if beyond:
                axis.plot(beyond, [0.92 * edge] * len(beyond), marker, markersize=4, color=COLOURS[i])
        axis.set(xlim=(0, LAST_SHOWN), ylim=(-AXIS_LIMIT, AXIS_LIMIT), ylabel=f"$e_{i + 1}$")
    axes[-1].set_xlabel("instant $k$")
    return drawing


def describe_errors(figure: FigureData) -> str:
    """Root mean square, largest size, and how often the axes are exceeded."""
    parts = []
    for name, values in figure.columns.items():
        if name == "k":
            continue
        rms = (sum(v * v for v in values) / len(values)) ** 0.5
        outside = sum(abs(v) > AXIS_LIMIT for v in values)
        text = f"{name}: root mean square {rms:.3f}, largest {max(map(abs, values)):.3f}"
        parts.append(text + (f", {outside} of {len(values)} instants beyond the axes" if outside else ""))
    return f"Estimation errors over {LAST_SHOWN} instants of noise. " + "; ".join(parts) + "."


def table_of_periods(results: Results) -> FigureData:
    """Optimal level for every pair of periods up to six, synchronous and with the best timing."""
    cells = all_periods(results)
    return FigureData(
        columns={
            "N1": tuple(float(cell["periods"][0]) for cell in cells),
            "N2": tuple(float(cell["periods"][1]) for cell in cells),
            "gamma_synchronous": tuple(cell["synchronous"]["optimum"] for cell in cells),
            "gamma_best_timing": tuple(cell["best"]["optimum"] for cell in cells),
            "best_offset": tuple(float(cell["best_offset"]) for cell in cells),
        }
    )


def _columns(figure: FigureData, *names: str) -> list[tuple[float, ...]]:
    return [figure.columns[name] for name in names]


def plot_table_of_periods(figure: FigureData) -> Any:
    """Two tables of numbers on a shaded grid, one row per N₁."""
    columns = figure.columns
    size = int(max(columns["N1"]))
    drawing, axes = new_axes(1, 2, row_height=3.0)
    best, worst = min(columns["gamma_synchronous"]), max(columns["gamma_synchronous"])
    shown = {"gamma_synchronous": "all sensors at k = 0", "gamma_best_timing": "best timing"}
    for axis, (key, title) in zip(axes, shown.items(), strict=True):
        for first, second, value, offset in zip(*_columns(figure, "N1", "N2", key, "best_offset"), strict=True):
            shade = 0.55 * (value - best) / (worst - best)
            across = [second - 0.5, second + 0.5]
            axis.fill_between(across, first - 0.5, first + 0.5, color=COLOURS[1], alpha=shade, linewidth=0)
            moved = key == "gamma_best_timing" and offset > 0
            centred: dict[str, Any] = {"ha": "center", "va": "center"}
            weight = "bold" if moved else "normal"
            axis.text(
                second, first - (0.13 if moved else 0), f"{value:.3f}", fontsize=7.5, fontweight=weight, **centred
            )
            if moved:
                axis.text(second, first + 0.24, f"θ₂ = {offset:.0f}", fontsize=6, **centred)
        axis.set(
            xlim=(0.5, size + 0.5),
            ylim=(size + 0.5, 0.5),
            xlabel="$N_2$",
            ylabel="$N_1$",
            title=title,
            xticks=range(1, size + 1),
            yticks=range(1, size + 1),
        )
        axis.grid(False)
    return drawing


def describe_table_of_periods(figure: FigureData) -> str:
    """Range of the table and the largest gain by timing."""
    columns = figure.columns
    names = ("gamma_synchronous", "gamma_best_timing", "N1", "N2", "best_offset")
    savings = [(1 - best / plain, *cell) for plain, best, *cell in zip(*_columns(figure, *names), strict=True)]
    saving, first, second, offset = max(savings)
    return (
        f"Optimal levels for periods 1 to {max(columns['N1']):.0f}: from {min(columns['gamma_synchronous']):.4f} to "
        f"{max(columns['gamma_synchronous']):.4f} if all sensors start at instant 0. The best timing gains most for "
        f"periods ({first:.0f}, {second:.0f}) with offset {offset:.0f}: {100 * saving:.1f} %."
    )


SHOWN_TIMINGS = ((3, 3), (4, 4), (5, 5), (6, 6), (6, 3), (4, 6))


def levels_by_timing(results: Results) -> FigureData:
    """Optimal level against the offset of the second sensor, for pairs of periods with a common divisor."""
    cells = {tuple(cell["periods"]): cell for cell in all_periods(results)}
    columns: dict[str, tuple[float, ...]] = {
        "offset": tuple(float(theta) for theta in range(max(len(cells[pair]["by_offset"]) for pair in SHOWN_TIMINGS)))
    }
    for pair in SHOWN_TIMINGS:
        columns[f"gamma_{pair[0]}_{pair[1]}"] = tuple(cells[pair]["by_offset"])
    return FigureData(columns=columns)


def plot_levels_by_timing(figure: FigureData) -> Any:
    """One curve per pair of periods."""
    drawing, (axis,) = new_axes(1, row_height=2.8)
    for index, (name, values) in enumerate((n, v) for n, v in figure.columns.items() if n != "offset"):
        first, second = name.split("_")[1:]
        axis.plot(
            figure.columns["offset"][: len(values)],
            values,
            marker="o",
            markersize=3.5,
            label=f"({first}, {second})",
            **line(index),
        )
    axis.set(xlabel="offset θ₂ of the second sensor (θ₁ = 0)", ylabel="optimal level γ", xticks=range(6))
    axis.legend(title="$(N_1, N_2)$", ncols=3)
    return drawing


def describe_levels_by_timing(figure: FigureData) -> str:
    """Smallest and largest level of each curve."""
    parts = [
        f"({name.split('_')[1]}, {name.split('_')[2]}): {min(values):.4f} to {max(values):.4f}"
        for name, values in figure.columns.items()
        if name != "offset"
    ]
    return "Optimal level over the offset of the second sensor, smallest to largest. " + "; ".join(parts) + "."


def disturbances(results: Results) -> FigureData:
    """Size of the error under the worst disturbance and under a random one of the same energy."""
    found = results["worst-disturbance"]
    return FigureData(
        columns={
            "k": tuple(float(k) for k in range(len(found["worst_error"]))),
            "worst": tuple(found["worst_error"]),
            "random": tuple(found["random_error"]),
            "ratio_worst": (found["worst_ratio"],),
            "ratio_random": (found["random_ratio"],),
            "norm": (found["norm"],),
        }
    )


def plot_disturbances(figure: FigureData) -> Any:
    """Two curves of |e(k)| for unit disturbance energy."""
    drawing, (axis,) = new_axes(1, row_height=2.4)
    for index, (name, label) in enumerate((("worst", "worst disturbance"), ("random", "random disturbance"))):
        ratio = figure.columns[f"ratio_{name}"][0]
        axis.plot(figure.columns["k"], figure.columns[name], label=f"{label}, ratio {ratio:.3f}", **line(index))
    axis.set(xlabel="instant $k$", ylabel="$|e(k)|$", xlim=(0, len(figure.columns["k"])))
    # Room above the curves for the legend.
    axis.set_ylim(0, 1.5 * max(figure.columns["worst"]))
    axis.legend(loc="upper right", title=f"norm of the observer {figure.columns['norm'][0]:.3f}")
    return drawing


def describe_disturbances(figure: FigureData) -> str:
    """Both ratios beside the norm."""
    worst, random, norm = (figure.columns[name][0] for name in ("ratio_worst", "ratio_random", "norm"))
    return (
        f"Error size over {len(figure.columns['k'])} instants for disturbances of unit energy: the worst over these "
        f"instants has the ratio {worst:.4f}, against the norm {norm:.4f} over all time; a random one {random:.4f}."
    )


FIGURES = (
    *(
        Figure(
            name=place.lower().replace(". ", ""),
            place=place,
            title=f"Estimation errors of {what}",
            caption=(
                f"One seeded draw of the noise of Sec. IV-A, the same in Figs. 2-8, with {gains}. Axes of Fig. 6, the "
                "only ones whose ticks the text shows; triangles mark instants beyond them. The published figure is "
                "another draw: sizes compare, single peaks do not."
                + (" One draw need not rank the three timings as most do." if name in TIMED else "")
            ),
            published=True,
            uses=("responses",),
            data=partial(errors, name),
            plot=plot_errors,
            alt=describe_errors,
        )
        for name, place, what, gains in _SHOWN
    ),
    Figure(
        name="periods",
        place="Beyond Table 1",
        title="Optimal level for all periods up to six",
        caption=(
            "Left: all sensors at instant 0. Right: the best timing, bold where it helps, with the offset of the "
            "second sensor. Along a row or column a longer period mostly, but not always, has the larger level."
        ),
        published=False,
        uses=PERIOD_TABLE,
        data=table_of_periods,
        plot=plot_table_of_periods,
        alt=describe_table_of_periods,
    ),
    Figure(
        name="timing",
        place="Beyond Sec. IV-B",
        title="Optimal level against the timing of the second sensor",
        caption="Only θ₂ modulo the greatest common divisor of the periods matters, so each curve shows that many.",
        published=False,
        uses=PERIOD_TABLE,
        data=levels_by_timing,
        plot=plot_levels_by_timing,
        alt=describe_levels_by_timing,
    ),
    Figure(
        name="worst",
        place="Beyond eq. (34)",
        title="The worst disturbance beside a random one",
        caption=(
            "Proposed observer with the printed gains (33), one seeded random disturbance. It brings out a fraction of "
            "what the norm allows, as white noise does in the simulated ratios of eq. (34)."
        ),
        published=False,
        uses=("worst-disturbance",),
        data=disturbances,
        plot=plot_disturbances,
        alt=describe_disturbances,
    ),
)
