"""Figures 2-8 on the axes of Fig. 6: the errors under one draw of the noise; and the worst disturbance."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import FOREGROUND, OURS, line, mark_clipped, name_axes, name_line, new_axes, rms

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


def errors(names: Iterable[str], results: Results) -> FigureData:
    """The three estimation errors of some observers under the same seeded draw, k = 0 ... 500."""
    columns: dict[str, tuple[float, ...]] = {"k": tuple(map(float, range(LAST_SHOWN + 1)))}
    for name in names:
        rows = results["responses"]["errors"][name][: LAST_SHOWN + 1]
        columns |= {f"{name}_e_{i + 1}": tuple(row[i] for row in rows) for i in range(STATES)}
    return FigureData(columns=columns)


def plot_errors(names: Mapping[str, str], figure: FigureData) -> Any:
    """A row for each observer on the axes of Fig. 6; a triangle at the edge for each instant beyond them."""
    c = figure.columns
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
            above = (f"{title}\n", "", f"all: RMS {rms_of_all(name, figure):.3f}\n")[i]
            axis.set_title(f"{above}e{'₁₂₃'[i]}: RMS {rms(values):.3f}")
    axes[-2].set_xlabel("instant k")
    return drawing


def extremes(k: Sequence[float], values: Sequence[float]) -> tuple[list[float], list[float]]:
    """Least and largest value of every `TOGETHER` instants, in their order: the same line to the eye."""
    kept: list[int] = []
    for start in range(0, len(values), TOGETHER):
        part = range(start, min(start + TOGETHER, len(values)))
        kept += sorted({min(part, key=values.__getitem__), max(part, key=values.__getitem__)})
    return [k[i] for i in kept], [values[i] for i in kept]


def rms_of_all(name: str, figure: FigureData) -> float:
    """Root mean square of the three errors together."""
    return rms([value for i in range(STATES) for value in figure.columns[f"{name}_e_{i + 1}"]])


def say_cases(figure: FigureData) -> str:
    """The message of Figs. 2-5: what a sensor more is worth in this draw."""
    proposed, *others = (rms_of_all(name, figure) for name in CASES)
    return f"One draw: the proposed observer's overall RMS error is at most {_factor(proposed, others)} of any other's"


def say_timings(figure: FigureData) -> str:
    """The message of Figs. 6-8: how near the three timings are in this draw."""
    sizes = [rms_of_all(name, figure) for name in TIMINGS]
    return f"In one draw the three timings differ little: overall RMS errors from {min(sizes):.3f} to {max(sizes):.3f}"


def _factor(one: float, others: Iterable[float]) -> str:
    """The largest ratio, rounded up, since it is called a bound."""
    return f"{math.ceil(100 * max(one / other for other in others)) / 100:.2f}"


def describe_errors(names: Mapping[str, str], figure: FigureData) -> str:
    """Root mean squares, and how often the axes are exceeded."""
    parts = []
    for name, title in names.items():
        values = [figure.columns[f"{name}_e_{i + 1}"] for i in range(STATES)]
        sizes, beyond = ", ".join(f"{rms(v):.3f}" for v in values), sum(abs(e) > AXIS_LIMIT for v in values for e in v)
        parts.append(f"{title}: {sizes}, together {rms_of_all(name, figure):.3f}, {beyond} values beyond the axes")
    first, *others = (rms_of_all(name, figure) for name in names)
    factor = _factor(first, others)
    most = f"at most {factor} of any other" if float(factor) <= 1 else f"up to {factor} times as large as another"
    return (
        f"Root mean square of three estimation errors over the instants 0 to {LAST_SHOWN} of one draw of noise. "
        f"{'; '.join(parts)}. In this draw the first is {most}."
    )


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
    """Both error sizes over time, each named with its ratio."""
    drawing, (axis,) = new_axes(1, row_height=2.3)
    c = figure.columns
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
    name_axes(axis, "size of the error |e| (1)", "instant k")
    return drawing


def say_disturbances(figure: FigureData) -> str:
    """The message: both ratios, and that the worst one is so over these instants; over all time it is the norm."""
    worst, random = (figure.columns[name][0] for name in ("ratio_worst", "ratio_random"))
    return f"Over the instants shown the worst disturbance has the ratio {worst:.3f}, a random one {random:.3f}"


def describe_disturbances(figure: FigureData) -> str:
    """Both ratios beside the norm."""
    worst, random, norm = (figure.columns[name][0] for name in ("ratio_worst", "ratio_random", "norm"))
    return (
        f"Error size over {len(figure.columns['k'])} instants for disturbances of unit energy: the worst over these "
        f"instants has the ratio {worst:.3f}, against the norm {norm:.4f} over all time; one random draw {random:.3f}."
    )


_DRAW = (
    "One seeded draw of the noise of Sec. IV-A, the same in Figs. 2-8, on the axes of Fig. 6, the only ones whose "
    "ticks the text shows; triangles mark instants beyond them. The published figures are another draw: sizes compare, "
    "single peaks do not."
)

FIGURES = (
    *(
        Figure(
            name=name,
            place=place,
            title=title,
            caption=caption,
            published=True,
            uses=("responses",),
            data=partial(errors, tuple(names)),
            plot=partial(plot_errors, names),
            alt=partial(describe_errors, names),
        )
        for name, place, title, names, caption in (
            (
                "fig2-5",
                "Figs. 2-5",
                say_cases,
                CASES,
                f"{_DRAW} Fig. 2 has the printed gains (33); for the others, Cases A to C, none are printed, and ours "
                "are central optimal ones.",
            ),
            (
                "fig6-8",
                "Figs. 6-8",
                say_timings,
                TIMINGS,
                f"{_DRAW} Periods (3, 3), Cases 1 to 3 with the printed gains (38) to (40). One draw need not rank the "
                "three timings as most do.",
            ),
        )
    ),
    Figure(
        name="worst",
        place="Beyond eq. (34)",
        title=say_disturbances,
        caption=(
            "Proposed observer with the printed gains (33): the disturbance that is worst over the instants shown, and "
            "one seeded random one of equal energy. The random one brings out a fraction of what the norm allows, as "
            "white noise does in the simulated ratios of eq. (34)."
        ),
        published=False,
        uses=("worst-disturbance",),
        data=disturbances,
        plot=plot_disturbances,
        alt=describe_disturbances,
    ),
)
