"""What the paper lacks: the level for all periods and all timings."""

from __future__ import annotations

from typing import Any

from papers.okajima2023.experiments.declared import PERIOD_TABLE, all_periods
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import BAND, FOREGROUND, OURS, line, name_axes, name_end, new_axes


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
    """A table of numbers on a shaded grid; below the level that of the best timing, framed where a rule breaks."""
    c = figure.columns
    size = int(max(c["N1"]))
    drawing, (axis,) = new_axes(1, row_height=3.9)
    least, most = min(c["gamma_synchronous"]), max(c["gamma_synchronous"])
    broken = {pair for pair, _ in exceptions(figure)}
    for first, second, level, best, offset in zip(*_columns(figure, *CELL), strict=True):
        across, shade = [second - 0.5, second + 0.5], (level - least) / (most - least)
        axis.fill_between(across, first - 0.5, first + 0.5, color=BAND, alpha=shade, linewidth=0)
        moved = offset > 0
        middle: dict[str, Any] = {"ha": "center", "va": "center"}
        axis.text(second, first - (0.2 if moved else 0), f"{level:.3f}", **middle)
        if moved:
            axis.text(second, first + 0.22, f"{best:.3f}→{offset:.0f}", color=OURS, **middle)
        if (first, second) in broken:
            axis.plot(
                [second + d for d in (-0.46, 0.46, 0.46, -0.46, -0.46)],
                [first + d for d in (-0.46, -0.46, 0.46, 0.46, -0.46)],
                color=FOREGROUND, linewidth=1.6, linestyle="-",
            )  # fmt: skip
    axis.set(xlim=(0.5, size + 0.5), ylim=(size + 0.5, 0.5), xlabel="period N₂ of the second sensor (instants)")
    axis.set_xticks(range(1, size + 1))
    axis.set_yticks(range(1, size + 1))
    axis.set_title("period N₁ (instants); optimal level γ in the cells")
    axis.grid(False)
    return drawing


CELL = ("N1", "N2", "gamma_synchronous", "gamma_best_timing", "best_offset")
Pair = tuple[float, float]


def exceptions(figure: FigureData) -> list[tuple[Pair, Pair]]:
    """Pairs of periods whose level is larger than that of the next pair with one period longer by one instant."""
    level = {(first, second): value for first, second, value in zip(*_columns(figure, *CELL[:3]), strict=True)}
    longer = [((a, b), (a + da, b + db)) for a, b in level for da, db in ((1, 0), (0, 1)) if (a + da, b + db) in level]
    return [(pair, other) for pair, other in longer if level[pair] > level[other] * (1 + LEVEL_EXCESS)]


LEVEL_EXCESS = 1e-6
"""Relative difference below which two levels count as equal: what bisection leaves is far smaller."""


def say_table_of_periods(figure: FigureData) -> str:
    """The message: that a rule breaks, or for which periods it holds."""
    found = exceptions(figure)
    if not found:
        return f"Up to {max(figure.columns['N1']):.0f} instants a longer period never lowers the level"
    (a, b), (c, d) = max(found)
    return f"A longer period can lower the level: ({a:.0f}, {b:.0f}) exceeds ({c:.0f}, {d:.0f})"


def describe_table_of_periods(figure: FigureData) -> str:
    """Range of the table, the largest gain by timing, and where a longer period has the smaller level."""
    columns = figure.columns
    names = ("gamma_synchronous", "gamma_best_timing", "N1", "N2", "best_offset")
    savings = [(1 - best / plain, *cell) for plain, best, *cell in zip(*_columns(figure, *names), strict=True)]
    saving, first, second, offset = max(savings)
    listed = ", ".join(
        f"({a:.0f}, {b:.0f}) has a larger level than ({c:.0f}, {d:.0f})" for (a, b), (c, d) in exceptions(figure)
    )
    return (
        f"Optimal levels for periods 1 to {max(columns['N1']):.0f}: from {min(columns['gamma_synchronous']):.4f} to "
        f"{max(columns['gamma_synchronous']):.4f} if all sensors start at instant 0. Of these periods the best timing "
        f"gains most for ({first:.0f}, {second:.0f}) with offset {offset:.0f}: {100 * saving:.1f} %. {listed}."
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
    """One curve per pair of periods, which is its name."""
    drawing, (axis,) = new_axes(1, row_height=2.7)
    for index, (name, values) in enumerate((n, v) for n, v in figure.columns.items() if n != "offset"):
        first, second = name.split("_")[1:]
        (curve,) = axis.plot(
            figure.columns["offset"][: len(values)], values, marker="os^vDx"[index], markersize=4, **line(index)
        )
        name_end(axis, curve, f"({first}, {second})")
    axis.set_xticks(range(len(figure.columns["offset"])))
    axis.set_xlim(-0.1, len(figure.columns["offset"]) - 0.5)
    name_axes(axis, "optimal level γ for the periods (N₁, N₂)", "offset θ₂ of the second sensor (instants)")
    return drawing


def _by_pair(figure: FigureData) -> dict[str, tuple[float, ...]]:
    return {f"({', '.join(name.split('_')[1:])})": v for name, v in figure.columns.items() if name != "offset"}


def _largest_saving(figure: FigureData) -> tuple[float, str]:
    return max((100 * (1 - min(values) / values[0]), pair) for pair, values in _by_pair(figure).items())


def say_levels_by_timing(figure: FigureData) -> str:
    """The message: what shifting a sensor is worth, for the pair of those drawn where it is worth most."""
    saving, pair = _largest_saving(figure)
    return f"For periods {pair} shifting the second sensor lowers the level by {saving:.1f} %"


def describe_levels_by_timing(figure: FigureData) -> str:
    """Smallest and largest level of each curve, and the largest saving."""
    parts = [f"{pair}: {min(values):.4f} to {max(values):.4f}" for pair, values in _by_pair(figure).items()]
    saving, pair = _largest_saving(figure)
    return (
        f"Optimal level over the offset of the second sensor, smallest to largest. {'; '.join(parts)}. Against offset "
        f"0 the best one saves {saving:.1f} % for {pair}, the most of these pairs."
    )


FIGURES = (
    Figure(
        name="periods",
        place="Beyond Table 1",
        title=say_table_of_periods,
        caption=(
            "Upper number of a cell: both sensors read at instant 0. Lower, where it helps: the best timing, with the "
            "offset θ₂ behind the arrow. Darker is worse. Framed: a longer period would have the smaller level."
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
        title=say_levels_by_timing,
        caption="Only θ₂ modulo the greatest common divisor of the periods matters, so each curve shows that many.",
        published=False,
        uses=PERIOD_TABLE,
        data=levels_by_timing,
        plot=plot_levels_by_timing,
        alt=describe_levels_by_timing,
    ),
)
