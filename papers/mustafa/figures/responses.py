"""Figures 2 and 3 over many draws of the sampling periods."""

from __future__ import annotations

from typing import Any

from papers.mustafa.claims.preliminaries import up
from papers.mustafa.experiments.draws import DRAWS, merged
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import FOREGROUND, GREY, OURS, SOFT, name_axes, name_line, new_axes, say

FIRST = 60
"""The first samples of Fig. 3, as many as can be told apart."""


def responses(results: Results) -> FigureData:
    """One draw of the error, the band of all and how many they are, and the disturbance."""
    r = merged(results)
    columns = {name: tuple(r[name]) for name in ("k", "w", "e", "band_low", "band_high")}
    return FigureData(columns=columns | {"draws": (float(len(r["ratios"])),)})


def plot_responses(figure: FigureData) -> Any:
    """Disturbance, band and one draw on one axis."""
    c = figure.columns
    drawing, (axis,) = new_axes(1, row_height=2.4)
    axis.fill_between(c["k"], c["band_low"], c["band_high"], color=SOFT, linewidth=0)
    (disturbance,) = axis.plot(c["k"], c["w"], linewidth=1.1, color=FOREGROUND, linestyle="--")
    (error,) = axis.plot(c["k"], c["e"], linewidth=1.1, color=OURS)
    name_line(axis, disturbance, "disturbance w", 27, ha="left")
    text = f"error e, one draw (line)\nand {_draws(figure)} draws (band)"
    axis.annotate(
        text, (150, max(c["band_high"][140:160])), xytext=(6, 22), textcoords="offset points",
        color=error.get_color(), arrowprops={"arrowstyle": "-", "color": OURS},
    )  # fmt: skip
    axis.set_ylim(1.2 * min(c["w"]), 1.2 * max(c["w"]))
    name_axes(axis, "error e, disturbance w", "sample k")
    return drawing


def say_responses(figure: FigureData) -> str:
    """The message of Fig. 2: the largest error of these draws, which is no bound for others."""
    error, disturbance = _peaks(figure)
    return f"In our uniform draws the error peaks at {up(error, 2)} at most, the disturbance at {disturbance:.2f}"


def _draws(figure: FigureData) -> str:
    return f"{figure.columns['draws'][0]:.0f}"


def _peaks(figure: FigureData) -> tuple[float, float]:
    c = figure.columns
    return max(map(abs, c["band_low"] + c["band_high"])), max(map(abs, c["w"]))


def describe_responses(figure: FigureData) -> str:
    """Peaks of disturbance and error."""
    c, (error, disturbance) = figure.columns, _peaks(figure)
    return (
        f"Over {len(c['k'])} samples the disturbance peaks at {disturbance:.2f}, the error of one draw at "
        f"{max(map(abs, c['e'])):.2f}, that of {_draws(figure)} draws of uniform periods at {up(error, 2)} at most."
    )


def intervals(results: Results) -> FigureData:
    """The sampling periods of the same draw."""
    r = merged(results)
    return FigureData(columns={"k": tuple(r["k"]), "h": tuple(r["periods"])})


def plot_intervals(figure: FigureData) -> Any:
    """The first periods as steps; beside them how often each length occurs among all."""
    h = figure.columns["h"]
    drawing, (axis, counts) = new_axes(
        1, 2, row_height=1.9, share_x=False, sharey=True, gridspec_kw={"width_ratios": (3, 1)}
    )
    axis.step(figure.columns["k"][:FIRST], h[:FIRST], where="post", linewidth=1.1, color=OURS)
    for end, side in ((min(h), -1), (max(h), 1)):
        axis.axhline(end, color=GREY, linestyle="--", linewidth=1.1)
        say(axis, f"{'shortest' if side < 0 else 'longest'} {end:.4f} s", (FIRST / 2, end), side=side, color=GREY)
    counts.hist(h, bins=10, orientation="horizontal", facecolor=SOFT, edgecolor=OURS, linewidth=0.7)
    axis.set_ylim(-0.02, 0.12)
    name_axes(axis, "period h (s)", f"sample k, first {FIRST}")
    name_axes(counts, "", f"of {len(h)}")
    return drawing


def say_intervals(figure: FigureData) -> str:
    """The message of Fig. 3."""
    h = figure.columns["h"]
    return f"One draw of independent uniform periods spans {min(h):.3f} to {max(h):.3f} s"


def describe_intervals(figure: FigureData) -> str:
    """Range and mean of the periods."""
    h = figure.columns["h"]
    return (
        f"One draw of {len(h)} sampling periods from {min(h):.3f} to {max(h):.3f} s, {sum(h) / len(h):.4f} s on "
        f"average; the first {FIRST} are shown, and how often each length occurs among all."
    )


FIGURES = (
    Figure(
        name="fig2", place="Fig. 2", title=say_responses,
        caption="Example 2, the printed filter, uniform random periods. The published figure is one unknown draw under "
        "a law that is not stated; the band holds our uniform draws, and another draw or law may leave it.",
        published=True, uses=DRAWS, data=responses, plot=plot_responses, alt=describe_responses,
    ),
    Figure(
        name="fig3", place="Fig. 3", title=say_intervals,
        caption="The periods of the draw in Fig. 2, independent and uniform between the ends of the range; the law of "
        "the published draw is not stated. Right: how often each length occurs.",
        published=True, uses=DRAWS, data=intervals, plot=plot_intervals, alt=describe_intervals,
    ),
)  # fmt: skip
