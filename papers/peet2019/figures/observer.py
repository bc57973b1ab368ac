"""Fig. 1 with its axes, and the gains of an observer as functions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from papers.peet2019.figures import columns
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import RAISED, line, name_axes, name_end, name_line, new_axes


def fig_1(results: Results) -> FigureData:
    """Disturbance and both errors for one reading of the sinc."""
    found = results["fig1"]
    return columns(t=found["t"], w=found["w"], **{f"e_{i}": values for i, values in enumerate(found["e"], 1)})


def gains(results: Results) -> FigureData:
    """The gains of one observer as functions of s; first and second state."""
    found = results["gains"]
    return columns(s=found["s"], **{f"{name}_{i}": values for name in GAINS for i, values in enumerate(found[name], 1)})


GAINS = ("l3", "l4", "l5")
LABELS = {"w": "disturbance w", "e_1": "error e₁", "e_2": "error e₂"}


def plot_fig_1(figure: FigureData) -> Any:
    """Disturbance and errors against time on one axis, each named at its peak."""
    drawing, (axis,) = new_axes(row_height=2.6)
    t, c = figure.columns["t"], figure.columns
    for index, (name, side) in enumerate((("e_1", -1), ("w", 1), ("e_2", 0))):
        (curve,) = axis.plot(t, c[name], **line(index))
        peak = t[_peak(c[name])]
        beside = side == 0
        name_line(axis, curve, LABELS[name], peak / (1 + beside), side=side, ha="right" if beside else "left")
    axis.set_ylim(1.25 * min(c["e_1"]), 1.25 * max(c["w"]))
    axis.set_xlim(-0.15 * t[-1], t[-1])
    axis.set_xticks([share * t[-1] for share in (0, 0.25, 0.5, 0.75, 1)])
    name_axes(axis, "disturbance and errors", "time (s)")
    return drawing


def _peak(values: Sequence[float]) -> int:
    return max(range(len(values)), key=lambda i: abs(values[i]))


def plot_gains(figure: FigureData) -> Any:
    """One panel per gain, in the power of ten that its numbers have; one curve where both states have the same gain."""
    drawing, axes = new_axes(len(GAINS), row_height=1.45)
    c = figure.columns
    for axis, name in zip(axes, GAINS, strict=True):
        size = max(map(abs, c[f"{name}_1"] + c[f"{name}_2"]))
        power = math.floor(math.log10(size)) if size < SMALL else 0
        scaled = [[value / 10**power for value in c[f"{name}_{i}"]] for i in (1, 2)]
        same = relation(figure, name) == "same"
        for i, values in enumerate(scaled[:1] if same else scaled):
            (curve,) = axis.plot(c["s"], values, **line(i))
            name_end(axis, curve, "both" if same else f"x{'₁₂'[i]}")
        axis.set_ylim(*_room([value for values in scaled for value in values]))
        axis.set_xticks((c["s"][0], c["s"][0] / 2, 0.0))
        unit = f" (10{str(power).translate(RAISED)})" if power else ""
        last = axis is axes[-1]
        name_axes(axis, f"L{'₃₄₅'[GAINS.index(name)]}{unit}", "history s (s)" if last else "", ticks=3)
    return drawing


SMALL = 0.01


def _room(values: Sequence[float]) -> tuple[float, float]:
    """Limits that show zero as well and leave a margin."""
    low, high = min(0.0, *values), max(0.0, *values)
    return low - 0.1 * (high - low), high + 0.1 * (high - low)


def relation(figure: FigureData, name: str) -> str:
    """How a gain of the second state stands to that of the first, to one per cent of their size."""
    first, second = (figure.columns[f"{name}_{i}"] for i in (1, 2))
    near = 0.01 * max(map(abs, first))
    for word, sign in (("same", 1), ("opposite", -1)):
        if all(abs(a - sign * b) <= near for a, b in zip(first, second, strict=True)):
            return word
    return "other"


def say_fig_1(figure: FigureData) -> str:
    """The message of Fig. 1."""
    return (
        f"From {_died_out(figure):.1f} s to {figure.columns['t'][-1]:g} s both errors stay below a tenth of the largest"
    )


def _died_out(figure: FigureData) -> float:
    c = figure.columns
    peak = max(map(abs, c["e_1"] + c["e_2"]))
    return max(t for t, *errors in zip(c["t"], c["e_1"], c["e_2"], strict=True) if max(map(abs, errors)) > 0.1 * peak)


def describe_fig_1(figure: FigureData) -> str:
    """When the disturbance and the errors are largest, and when the errors have died out."""
    t, c = figure.columns["t"], figure.columns
    peaks = {name: _peak(values) for name, values in c.items() if name != "t"}
    parts = [f"{name} is largest at {t[i]:.2f} s with {c[name][i]:.3f}" for name, i in peaks.items()]
    return (
        f"Disturbance and two errors over {t[-1]:g} s. {'; '.join(parts)}. From {_died_out(figure):.1f} s to the end "
        "both errors stay below a tenth of the largest."
    )


def say_gains(figure: FigureData) -> str:
    """The message: which gains are the same for both states."""
    named = {word: [f"L{'₃₄₅'[i]}" for i, name in enumerate(GAINS) if relation(figure, name) == word] for word in _SAID}
    said = [f"{' and '.join(names)} {_SAID[word]}" for word, names in named.items() if names]
    return f"Gains of both states in one observer of ours: {', '.join(said) or 'all differ'}"


_SAID = {"same": "equal", "opposite": "opposite"}


def describe_gains(figure: FigureData) -> str:
    """Values of each gain at the oldest end of the history and at the present."""
    c = figure.columns
    parts = [
        f"L{name[1]} from {c[f'{name}_1'][0]:.3g} to {c[f'{name}_1'][-1]:.3g} (state 1) and from "
        f"{c[f'{name}_2'][0]:.3g} to {c[f'{name}_2'][-1]:.3g} (state 2)"
        for name in GAINS
    ]
    return f"Three gains over s from {c['s'][0]:g} to {c['s'][-1]:g} s: {'; '.join(parts)}."


FIGURES = (
    Figure(
        name="fig1",
        place="Fig. 1",
        title=say_fig_1,
        caption="System (11), observer at the printed level; sinc(t - τ) on both channels, one reading of many.",
        published=True,
        uses=("fig1",),
        data=fig_1,
        plot=plot_fig_1,
        alt=describe_fig_1,
    ),
    Figure(
        name="gains",
        place="Sec. VIII",
        title=say_gains,
        caption="L₃ to L₅ of eq. (9), for the states x₁ and x₂, of an observer five per cent above the "
        "optimum, a system of ours with one delay; equal or opposite to one per cent of the first state's gain.",
        published=False,
        uses=("gains",),
        data=gains,
        plot=plot_gains,
        alt=describe_gains,
    ),
)
