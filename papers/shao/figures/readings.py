"""Figure on the readings of Table I: the map of their scores, and the null test."""

from __future__ import annotations

from typing import Any

from papers.shao.experiments.readings import SEARCH, merged
from papers.shao.figures.tracking import columns_of, ours
from papers.shao.method.readings import STRUCTURES
from papers.shao.problem import COLUMNS, LABELS
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.style import line, new_axes

NAMES = {"pmi": "DRC-PMI", "apo": "DRC-APO", "common": "both columns"}


def reading_scores(results: Results) -> FigureData:
    """Best distance for each structure and observer; distances of the printed columns and of the decoys."""
    blocks = [results[name] for name in SEARCH]
    found = merged(blocks)
    columns: dict[str, list[float]] = {"structure": [float(block["structure"]) for block in blocks]}
    for name in found.by_observer:
        columns[name] = [block["by_observer"][name] for block in blocks]
    for key in COLUMNS:
        columns |= {f"decoys_{key}": sorted(found.decoys[key]), f"nearest_{key}": [found.nearest[key].distance]}
    columns |= {"decoys_common": sorted(found.joint_decoys), "nearest_common": [found.joint_distance]}
    return columns_of(columns)


def plot_reading_scores(drawn: FigureData) -> Any:
    """Upper: the map of scores, one cell for each observer and structure. Lower: decoys against the printed columns."""
    figure, axes = new_axes(2, row_height=4.0, share_x=False)
    c = drawn.columns
    observers = [name for name in c if name in LABELS]
    cells = list(zip(*(c[name] for name in observers), strict=True))
    axes[0].pcolormesh(cells, cmap="Blues_r", norm="log", alpha=0.5, edgecolors="none")
    for row, distances in enumerate(cells):
        for column, distance in enumerate(distances):
            axes[0].text(column + 0.5, row + 0.5, f"{distance:.2f}", ha="center", va="center", fontsize=6.5)
    choices = ["{}, {}; {}, {}".format(*structure.words) for structure in STRUCTURES]
    axes[0].set_yticks([k + 0.5 for k in range(len(STRUCTURES))], choices, fontsize=6.5)
    labels = [LABELS[name].replace(" ", "\n") for name in observers]
    axes[0].set_xticks([k + 0.5 for k in range(len(observers))], labels, fontsize=6.5)
    axes[0].invert_yaxis()
    axes[0].grid(visible=False)
    for index, (key, name) in enumerate(NAMES.items()):
        decoys = c[f"decoys_{key}"]
        share = [(k + 1) / len(decoys) for k in range(len(decoys))]
        axes[1].step(decoys, share, where="post", label=f"decoys, {name}", **line(index))
        axes[1].axvline(c[f"nearest_{key}"][0], **line(index))
    axes[1].set(xlabel="distance of the nearest reading", ylabel="share of decoys", xscale="log")
    axes[1].legend()
    return figure


def describe_reading_scores(drawn: FigureData) -> str:
    """The nearest readings and how many decoys come as near."""
    c = drawn.columns
    parts = []
    for key, name in NAMES.items():
        own = c[f"nearest_{key}"][0]
        nearer = sum(d <= own for d in c[f"decoys_{key}"])
        parts.append(f"{name}: {own:.3f}, as near as for {nearer} of {len(c[f'decoys_{key}'])} decoys")
    return f"Distance of the nearest reading. {'; '.join(parts)}."


FIGURES = (
    ours(
        name="readings",
        place="Table I",
        title="How near the readings come to Table I, and to random columns",
        caption=(
            "Distance: largest |ln(computed/printed)| of a column. Upper: best reading for each observer and each "
            "structure (feedforward, timing of the reference; gain, form of the observer). Lower: the same search for "
            "smooth random columns; vertical lines are the printed ones."
        ),
        uses=SEARCH,
        data=reading_scores,
        plot=plot_reading_scores,
        alt=describe_reading_scores,
    ),
)
