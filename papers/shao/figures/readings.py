"""Figures on the readings of Table I: how near they come, and the null test."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.figures.looks import NAMES, columns_of, ours
from papers.shao.printed import table_1
from papers.shao.problem import APO_READINGS, COLUMNS, PMI_READINGS
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.labels import name_axes, say
from replication.drawing.style import BAND, GREY, OURS, line, new_axes

TABLES = {"pmi": "DRC-PMI", "apo": "DRC-APO", "common": "both columns"}


def reading_scores(results: Results) -> FigureData:
    """Best distance for each structure and observer."""
    blocks = [results[name] for name in SEARCH]
    observers = merged(blocks).by_observer
    columns: dict[str, list[float]] = {"structure": [float(block["structure"]) for block in blocks]}
    return columns_of(columns | {name: [block["by_observer"][name] for block in blocks] for name in observers})


def decoy_distances(results: Results) -> FigureData:
    """Distances of the printed columns and of the decoys."""
    found = merged([results[name] for name in SEARCH])
    columns: dict[str, list[float]] = {}
    for key in COLUMNS:
        columns |= {f"decoys_{key}": sorted(found.decoys[key]), f"nearest_{key}": [found.nearest[key].distance]}
    return columns_of(columns | {"decoys_common": sorted(found.joint_decoys), "nearest_common": [found.joint_distance]})


def plot_reading_scores(drawn: FigureData) -> Any:
    """A line for each observer with a mark for each structure, the nearest one filled."""
    drawing, (axis,) = new_axes(row_height=3.2)
    observers = _observers(drawn)
    axis.axvspan(LEAST, rounding(), facecolor=BAND, alpha=0.55, linewidth=0)
    say(axis, "rounds to the print", (rounding(), -0.75), side=0, ha="left")
    for row, distances in enumerate(observers.values()):
        axis.plot(distances, [row] * len(distances), "o", color=GREY, markerfacecolor="none", markersize=5)
        axis.plot(min(distances), row, "D", color=OURS, markersize=6)
        axis.text(min(distances), row - 0.22, f"{min(distances):.3f}", color=OURS, ha="center", va="bottom")
    axis.set(xscale="log", xlim=(LEAST, 2.5), ylim=(len(observers) - 0.5, -1.1))
    axis.set_yticks(range(len(observers)), [NAMES[name].replace(", ", ",\n") for name in observers])
    axis.set_xticks((0.01, 0.1, 1), ("0.01", "0.1", "1"))
    axis.minorticks_off()
    axis.set_xlabel("largest |ln(ours/print)| of a column")
    return drawing


LEAST = 0.003


def _observers(drawn: FigureData) -> dict[str, tuple[float, ...]]:
    return {name: values for name, values in drawn.columns.items() if name != "structure"}


def rounding() -> float:
    """The largest distance that half a unit of the last printed place makes in either column."""
    texts = [text for short in COLUMNS for text in table_1(f"DRC-{short.upper()}")]
    return max(math.log1p(0.5 * 10.0 ** -len(text.split(".")[1]) / float(text)) for text in texts)


def say_reading_scores(drawn: FigureData) -> str:
    """The message: how near the nearest reading of each column comes."""
    pmi, apo = (_nearest(drawn, group) for group in (PMI_READINGS, APO_READINGS))
    return f"Nearest readings searched miss columns of Table I by factors up to {pmi:.2f} and {apo:.2f}"


def _nearest(drawn: FigureData, group: Iterable[str]) -> float:
    """The factor by which the nearest reading of a column misses its worst number."""
    return math.exp(min(min(drawn.columns[name]) for name in group))


def describe_reading_scores(drawn: FigureData) -> str:
    """The nearest reading of each observer, and of each column."""
    parts = [f"{NAMES[name]}: {min(distances):.3f}" for name, distances in _observers(drawn).items()]
    pmi, apo = (_nearest(drawn, group) for group in (PMI_READINGS, APO_READINGS))
    return (
        f"Distance of the nearest of {len(drawn.columns['structure'])} structures for each observer. "
        f"{'; '.join(parts)}. "
        f"The nearest reading searched of DRC-PMI is off by a factor of up to {pmi:.2f}, that of DRC-APO of "
        f"up to {apo:.2f}; the print allows a distance of {rounding():.4f}."
    )


def plot_decoys(drawn: FigureData) -> Any:
    """Share of decoys nearer than a distance; a mark where the printed column stands."""
    drawing, (axis,) = new_axes(row_height=2.5)
    c = drawn.columns
    for index, (key, name) in enumerate(TABLES.items()):
        decoys = c[f"decoys_{key}"]
        share = [100 * (k + 1) / len(decoys) for k in range(len(decoys))]
        (curve,) = axis.step(decoys, share, where="post", **line(index))
        own = c[f"nearest_{key}"][0]
        axis.plot(own, 100 * nearer(drawn, key) / len(decoys), "D", color=curve.get_color(), markersize=8)
        k, side, ha = WORDS[key]
        say(axis, name, (decoys[k], share[k]), side=side, ha=ha, color=str(curve.get_color()))
    axis.set_xscale("log")
    axis.set_xlim(0.005, 4)
    axis.set_xticks((0.01, 0.1, 1), ("0.01", "0.1", "1"))
    axis.minorticks_off()
    name_axes(axis, "made-up columns met as nearly (%)", "distance of the nearest reading")
    return drawing


WORDS = {"pmi": (20, 0, "right"), "apo": (0, 1, "center"), "common": (22, -1, "left")}
"""Where the name of a curve stands: at which decoy, above it (1) or beside it (0), and which end of the words."""


def nearer(drawn: FigureData, key: str) -> int:
    """How many decoys some reading meets as nearly as the printed column."""
    return sum(distance <= drawn.columns[f"nearest_{key}"][0] for distance in drawn.columns[f"decoys_{key}"])


def say_decoys(drawn: FigureData) -> str:
    """The message: how little the nearest reading proves."""
    met, of = nearer(drawn, "common"), len(drawn.columns["decoys_common"])
    return f"Some reading meets {met} of {of} made-up tables as nearly as Table I"


def describe_decoys(drawn: FigureData) -> str:
    """The nearest readings and how many decoys come as near."""
    c = drawn.columns
    parts = [
        f"{name}: {c[f'nearest_{key}'][0]:.3f}, as near as for {nearer(drawn, key)} of {len(c[f'decoys_{key}'])} decoys"
        for key, name in TABLES.items()
    ]
    return f"Distance of the nearest reading. {'; '.join(parts)}."


FIGURES = (
    ours(
        name="readings",
        place="Table I",
        title=say_reading_scores,
        caption="Each mark is the best reading of one structure (feedforward, timing of the reference, kind of gain, "
        "form of the observer) with that observer; filled: the nearest one, with its distance. In the shaded part "
        "all six numbers of a column would come out.",
        uses=SEARCH,
        data=reading_scores,
        plot=plot_reading_scores,
        alt=describe_reading_scores,
    ),
    ours(
        name="decoys",
        place="Table I",
        title=say_decoys,
        caption="The same search for smooth random columns like those of Table I. Diamonds: the printed columns. A "
        "reading would be singled out if its diamond stood at the foot of its curve.",
        uses=SEARCH,
        data=decoy_distances,
        plot=plot_decoys,
        alt=describe_decoys,
    ),
)
