"""Figure on the readings of Table I: how near they come."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from papers.shao.experiments.tracking import SEARCH, merged
from papers.shao.figures import NAMES, columns_of, ours
from papers.shao.printed import APO_READINGS, COLUMNS, PMI_READINGS, table_1
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.style import FOREGROUND, GREY, OURS, new_axes, say


def reading_scores(results: Results) -> FigureData:
    """Best distance for each structure and observer."""
    blocks = [results[name] for name in SEARCH]
    observers = merged(blocks).by_observer
    columns: dict[str, list[float]] = {"structure": [float(block["structure"]) for block in blocks]}
    return columns_of(columns | {name: [block["by_observer"][name] for block in blocks] for name in observers})


def plot_reading_scores(drawn: FigureData) -> Any:
    """A line for each observer with a mark for each structure, the nearest one filled."""
    drawing, (axis,) = new_axes(row_height=3.2)
    observers = _observers(drawn)
    axis.axvline(1.0, color=FOREGROUND, linewidth=1.0)
    say(axis, "line: agrees with the print", (1.0, -0.8), side=0, ha="left")
    for row, distances in enumerate(observers.values()):
        factors = [math.exp(distance) for distance in distances]
        axis.plot(factors, [row] * len(factors), "o", color=GREY, markerfacecolor="none", markersize=5)
        axis.plot(min(factors), row, "D", color=OURS, markersize=6)
        axis.text(min(factors), row - 0.2, f"×{min(factors):.2f}", color=OURS, ha="left", va="bottom")
    axis.set(xscale="log", xlim=(0.98, 1.1 * math.exp(max(map(max, observers.values())))))
    axis.set_ylim(len(observers) - 0.5, -1.1)
    axis.set_yticks(range(len(observers)), [NAMES[name].replace(", ", ",\n") for name in observers])
    axis.set_xticks((1, 1.5, 2, 3, 5), ("×1", "×1.5", "×2", "×3", "×5"))
    axis.minorticks_off()
    axis.set_xlabel("factor between print and ours,\nworst number of a column")
    return drawing


def _observers(drawn: FigureData) -> dict[str, tuple[float, ...]]:
    return {name: values for name, values in drawn.columns.items() if name != "structure"}


def rounding() -> float:
    """The largest distance that half a unit of the last printed place makes in either column."""
    texts = [text for short in COLUMNS for text in table_1(f"DRC-{short.upper()}")]
    return max(math.log1p(0.5 * 10.0 ** -len(text.split(".")[1]) / float(text)) for text in texts)


def say_reading_scores(drawn: FigureData) -> str:
    """The message: how near the nearest reading of each column comes."""
    pmi, apo = (_nearest(drawn, group) for group in (PMI_READINGS, APO_READINGS))
    return f"The nearest settings miss a number of Table I by factors {pmi:.2f} and {apo:.2f}"


def _nearest(drawn: FigureData, group: Iterable[str]) -> float:
    """The factor by which the nearest reading of a column misses its worst number."""
    return math.exp(min(min(drawn.columns[name]) for name in group))


def describe_reading_scores(drawn: FigureData) -> str:
    """The nearest reading of each observer, and of each column."""
    parts = [f"{NAMES[name]}: {math.exp(min(distances)):.2f}" for name, distances in _observers(drawn).items()]
    pmi, apo = (_nearest(drawn, group) for group in (PMI_READINGS, APO_READINGS))
    return (
        f"By observer, the factor by which the nearest of {len(drawn.columns['structure'])} structures misses its "
        "worst "
        "number of a column. "
        f"{'; '.join(parts)}. "
        f"The nearest setting searched of DRC-PMI is off by a factor of up to {pmi:.2f}, that of DRC-APO of "
        f"up to {apo:.2f}, {'more' if min(pmi, apo) > math.exp(rounding()) else 'not more'} than rounding allows."
    )


FIGURES = (
    ours(
        name="readings",
        place="Table I",
        title=say_reading_scores,
        caption="A mark for each simulation setting: feedforward, timing of the reference, kind of gain, form of the "
        "observer. Filled: the nearest one. A setting on the line would reproduce all six numbers of a column.",
        uses=SEARCH,
        data=reading_scores,
        plot=plot_reading_scores,
        alt=describe_reading_scores,
    ),
)
