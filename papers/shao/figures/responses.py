"""Figs. 2 and 3: position, tracking error and estimation error, from both readings of the observer's start."""

from __future__ import annotations

from functools import partial
from typing import Any

from papers.shao.figures.looks import NAMES, columns_of, look
from papers.shao.printed import DATA
from papers.shao.problem import COLUMNS
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import GREY, name_axes, new_axes, rms

ROWS = {
    "output": ("time_s", "position θ (rad)"),
    "error": ("time_s", "tracking error (rad), RMS of the second half"),
    "estimation_error": ("instant_s", "estimation error (rad), RMS of the second half"),
}
"""Rows of Figs. 2 and 3: what is drawn against which time, and its label."""

FROM = {"start-zero": "", "start-output": "_from_output"}
"""The readings of ζ(0) that Figs. 2 and 3 show, and the ends of their columns."""
WEIGHTS = {"pmi": 0.7, "apo": 1.6}
"""Line widths: thin and thick are told apart in grey where dashes would drown in the steps of the held input."""
STARTS = ("from ζ(0) = 0", "from ζ(0) = (y(0), 0, 0)")


def responses(sigma: str, results: Results) -> FigureData:
    """Time, reference, outputs, tracking errors; instants, estimates and estimation errors; from both starts."""
    found = {
        f"{short}{end}": results["transients"]["responses"][choice][name][sigma]
        for choice, end in FROM.items()
        for short, name in COLUMNS.items()
    }
    first = found["pmi"]
    columns = {
        "time_s": first["time"],
        "reference": [y - e for y, e in zip(first["output"], first["error"], strict=True)],
        "instant_s": first["instants"],
    }
    for short in found:
        for key in ("output", "error", "estimate", "estimation_error"):
            columns[f"{key}_{short}"] = found[short][key]
    return columns_of(columns)


def plot_responses(drawn: FigureData) -> Any:
    """A row for each signal, a column for each start; RMS values are those of the second half."""
    drawing, axes = new_axes(len(ROWS), len(FROM), row_height=1.45, sharey="row")
    c = drawn.columns
    for row, (key, (time, label)) in enumerate(ROWS.items()):
        largest = max(abs(e) for short in COLUMNS for end in FROM.values() for e in c[f"{key}_{short}{end}"])
        for column, (end, start) in enumerate(zip(FROM.values(), STARTS, strict=True)):
            axis = axes[len(FROM) * row + column]
            if key == "output":
                axis.plot(c["time_s"], c["reference"], color=GREY, linewidth=0.6, linestyle="-")
            for short, loop in COLUMNS.items():
                values, colour = c[f"{key}_{short}{end}"], look(loop)["color"]
                axis.plot(c[time], values, color=colour, linestyle="-", linewidth=WEIGHTS[short])
                said = NAMES[loop] if key == "output" else f"{short.upper()} {rms(values[len(values) // 2 :]):.3f}"
                at, side = (0, "left") if short == "pmi" else (c["time_s"][-1], "right")
                axis.text(at, 1.2 * largest, said, ha=side, va="bottom", color=colour)
            axis.set_ylim(-1.1 * largest, 1.9 * largest)
            heading = [start] * (row == 0) + [label if column == 0 else " "]
            name_axes(axis, "\n".join(heading), ticks=3)
    for axis in axes[-len(FROM) :]:
        axis.set_xlabel("time (s)")
    return drawing


def late(drawn: FigureData, short: str, key: str = "error") -> float:
    """Root mean square of a signal in the second half, from ζ(0) = 0."""
    values = drawn.columns[f"{key}_{short}"]
    return rms(values[len(values) // 2 :])


def say_responses(drawn: FigureData) -> str:
    """The message: both errors in the second half."""
    apo, pmi = (late(drawn, short) for short in ("apo", "pmi"))
    return f"In the second half DRC-APO's RMS tracking error is {apo:.3f} rad, DRC-PMI's {pmi:.3f} rad"


def describe_responses(drawn: FigureData) -> str:
    """Largest errors in the first eighth of the time shown, by start, and in its second half."""
    times = len(drawn.columns["error_pmi"])
    early = [
        "{:.3f} and {:.3f} rad".format(
            *(max(abs(e) for e in drawn.columns[f"error_{short}{end}"][times // 40 : times // 8]) for short in COLUMNS)
        )
        for end in FROM.values()
    ]
    length = drawn.columns["time_s"][-1]
    return (
        f"Position, tracking error and estimation error over {length:.0f} s under DRC-PMI and DRC-APO. "
        f"Between {length / 40:.0f} s and {length / 8:.0f} s the errors reach {early[0]} from ζ(0) = 0, and {early[1]} "
        f"from ζ(0) = [y(0), 0, 0]. In the second half their root mean squares are {late(drawn, 'pmi'):.3f} "
        f"and {late(drawn, 'apo'):.3f} rad from ζ(0) = 0."
    )


FIGURES = tuple(
    Figure(
        name=f"fig{number}",
        place=f"Fig. {number}",
        title=say_responses,
        caption=f"Tracking of sin({sigma} t), the thin grey line. Command as printed, printed initial state, literal "
        "reading. ζ(0) is not printed; the title is for ζ(0) = 0. Numbers: root mean square of the second half. The "
        "text at hand holds no image of the figure: the axes are ours.",
        published=True,
        uses=("transients",),
        data=partial(responses, sigma),
        plot=plot_responses,
        alt=describe_responses,
    )
    for number, sigma in DATA["frequency"].items()
)
