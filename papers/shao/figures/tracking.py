"""Figures on tracking: Figs. 2 and 3, error against frequency, lag of the estimate."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

from papers.shao.printed import DATA, table_1
from papers.shao.problem import APO, COLUMNS, FAST, FREQUENCIES, HELD, LABELS, PMI, REPAIRED, SINGLE, STATE
from replication.audit.model import Results
from replication.audit.parts import Figure, FigureData
from replication.drawing.style import line, new_axes

SWEPT = (PMI, APO, HELD, REPAIRED, FAST, STATE, SINGLE)
LAGGING = (PMI, APO, HELD, REPAIRED)
DISTURBED = (PMI, APO, HELD, REPAIRED, FAST)
RESPONSES = {
    "output": ("time_s", "θ, rad"),
    "estimate": ("instant_s", "θ̂, rad"),
    "error": ("time_s", "e, rad"),
    "estimation_error": ("instant_s", "θ − θ̂, rad"),
}
"""Rows of Figs. 2 and 3: what is drawn against which time, and its label."""


def columns_of(columns: Mapping[str, Iterable[float]]) -> FigureData:
    """Columns of plain floats."""
    return FigureData(columns={name: tuple(float(x) for x in values) for name, values in columns.items()})


FROM = {"start-zero": "", "start-output": "_from_output"}
"""The readings of ζ(0) that Figs. 2 and 3 show, and the ends of their columns."""


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
    """Four rows: output, estimate, tracking error, estimation error."""
    figure, axes = new_axes(len(RESPONSES))
    c = drawn.columns
    for axis in axes[:2]:
        axis.plot(c["time_s"], c["reference"], color="#777777", label="reference")
    for axis, (key, (time, label)) in zip(axes, RESPONSES.items(), strict=True):
        for index, short in enumerate(COLUMNS):
            name, style = f"DRC-{short.upper()}", line(index)
            axis.plot(c[time], c[f"{key}_{short}"], label=f"{name}, from ζ(0) = 0", **style)
            late = style | {"linestyle": ":", "linewidth": 1.6}
            axis.plot(c[time], c[f"{key}_{short}_from_output"], label=f"{name}, from ζ(0) = [y(0), 0, 0]", **late)
        axis.set_ylabel(label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    axes[-1].set_xlabel("t, s")
    return figure


def describe_responses(drawn: FigureData) -> str:
    """Largest errors in the first eighth of the time shown, by start, and in its second half."""
    times = len(drawn.columns["error_pmi"])
    late = {short: max(abs(e) for e in drawn.columns[f"error_{short}"][times // 2 :]) for short in COLUMNS}
    early = [
        "{:.3f} and {:.3f} rad".format(
            *(max(abs(e) for e in drawn.columns[f"error_{short}{end}"][times // 40 : times // 8]) for short in COLUMNS)
        )
        for end in FROM.values()
    ]
    length = drawn.columns["time_s"][-1]
    return (
        f"Position, its estimate, tracking error and estimation error over {length:.0f} s under DRC-PMI and DRC-APO. "
        f"Between {length / 40:.0f} s and {length / 8:.0f} s the errors reach {early[0]} from ζ(0) = 0, and {early[1]} "
        f"from ζ(0) = [y(0), 0, 0]. In the second half they reach {late['pmi']:.3f} and {late['apo']:.3f} rad from "
        "ζ(0) = 0."
    )


def error_curves(results: Results) -> FigureData:
    """Percent error against σ, and Table I."""
    found = results["frequencies"]
    columns = {"frequency_rad_s": found["frequencies"]} | {name: found["ratios"][name] for name in SWEPT}
    columns["table_frequency_rad_s"] = FREQUENCIES
    return columns_of(columns | {f"table_{short}": map(float, table_1(f"DRC-{short.upper()}")) for short in COLUMNS})


def plot_error_curves(drawn: FigureData) -> Any:
    """Both axes logarithmic."""
    figure, (axis,) = new_axes(row_height=3.6)
    c = drawn.columns
    for index, name in enumerate(SWEPT):
        style = line(index) if name != SINGLE else {"color": "#777777", "linestyle": "-"}
        axis.loglog(c["frequency_rad_s"], c[name], label=LABELS[name], **style)
    for index, (short, marker) in enumerate(zip(COLUMNS, "so", strict=True)):
        label = f"Table I, DRC-{short.upper()}"
        axis.plot(c["table_frequency_rad_s"], c[f"table_{short}"], marker, color=line(index)["color"], label=label)
    axis.set(xlabel="σ, rad/s", ylabel="tracking error, percent")
    axis.legend()
    return figure


def describe_error_curves(drawn: FigureData) -> str:
    """Ends of the curves of the two printed controllers."""
    c = drawn.columns
    return (
        f"Tracking error against frequency from {c['frequency_rad_s'][0]:.2f} to {c['frequency_rad_s'][-1]:.0f} rad/s. "
        f"At the lowest it is {c[PMI][0]:.2f} percent under DRC-PMI and {c[APO][0]:.2f} under DRC-APO."
    )


def lag_curves(results: Results) -> FigureData:
    """Mean lag of the estimate against M, with half the hold beside it."""
    found = results["lags"]
    halves = [ratio * found["period"] / 2 for ratio in found["ratios"]]
    return columns_of({"ratio": found["ratios"]} | dict(found["lags"]) | {"half_slow_period_s": halves})


def plot_lag_curves(drawn: FigureData) -> Any:
    """Lag in seconds against M."""
    figure, (axis,) = new_axes(row_height=3.0)
    c = drawn.columns
    for index, name in enumerate(LAGGING):
        axis.plot(c["ratio"], c[name], marker="osv^"[index], label=LABELS[name], **line(index))
    axis.plot(c["ratio"], c["half_slow_period_s"], ":", color="#777777", label="M T/2")
    axis.set(xlabel="M", ylabel="lag of the estimate, s")
    axis.legend()
    return figure


def describe_lag_curves(drawn: FigureData) -> str:
    """The lags at the largest ratio."""
    c = drawn.columns
    return (
        f"At M = {c['ratio'][-1]:.0f} a slow reference is estimated {c[HELD][-1]:.3f} s late with a held measurement, "
        f"{c[PMI][-1]:.3f} s if the model alone carries the estimate between the slow instants, "
        f"{c[APO][-1]:.3f} s with the virtual one as printed and {c[REPAIRED][-1]:.3f} s with the repaired predictor; "
        f"half the slow period is {c['half_slow_period_s'][-1]:.3f} s."
    )


PARAMETERS = {"inertia": "J", "flux": "Ψ_f and K_T", "resistance": "R"}


def robustness_curves(results: Results) -> FigureData:
    """Percent error at σ = 1 rad/s against the factor by which a parameter of the plant is off."""
    found = results["robustness"]
    columns: dict[str, list[float]] = {"factor": found["factors"]}
    for parameter in PARAMETERS:
        for name in DISTURBED:
            columns[f"{parameter}_{name}"] = [float("inf") if e is None else e for _, e in found[parameter][name]]
    return columns_of(columns)


def plot_robustness_curves(drawn: FigureData) -> Any:
    """One axis per parameter."""
    figure, axes = new_axes(1, len(PARAMETERS), row_height=3.0)
    c = drawn.columns
    for axis, (parameter, symbol) in zip(axes, PARAMETERS.items(), strict=True):
        for index, name in enumerate(DISTURBED):
            axis.semilogy(c["factor"], c[f"{parameter}_{name}"], label=LABELS[name], **line(index))
        axis.set(title=symbol, xlabel="true over nominal")
        axis.sharey(axes[0])
    axes[0].set_ylabel("tracking error, percent")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def describe_robustness_curves(drawn: FigureData) -> str:
    """Range of the error over the factors for each parameter under DRC-APO."""
    ranges = [
        f"{symbol}: {min(drawn.columns[f'{parameter}_{APO}']):.2f} to {max(drawn.columns[f'{parameter}_{APO}']):.2f}"
        for parameter, symbol in PARAMETERS.items()
    ]
    return (
        f"Percent error of DRC-APO over the factors of a parameter that the model does not know. {'; '.join(ranges)}."
    )


ours = partial(Figure, published=False)
FIGURES = (
    *(
        Figure(
            name=f"fig{number}",
            place=f"Fig. {number}",
            title=f"Tracking of sin({sigma} t)",
            caption="Command as printed, printed initial state. Dotted: observer from ζ(0) = [y(0), 0, 0]; else "
            "from ζ(0) = 0. ζ(0) is not printed. The text at hand holds no image of the figure: the axes are ours.",
            published=True,
            uses=("transients",),
            data=partial(responses, sigma),
            plot=plot_responses,
            alt=describe_responses,
        )
        for number, sigma in DATA["frequency"].items()
    ),
    ours(
        name="robustness",
        place="Sec. V",
        title="Error at 1 rad/s when the plant is not the model",
        caption="Steady state under the literal reading. The observer and the feedforward keep the printed parameters; "
        "with Ψ_f the torque constant moves too.",
        uses=("robustness",),
        data=robustness_curves,
        plot=plot_robustness_curves,
        alt=describe_robustness_curves,
    ),
    ours(
        name="error-frequency",
        place="Table I",
        title="Tracking error against frequency",
        caption="Steady state, largest error over all times, with the points of Table I. The text leaves open which "
        "DRC-PMI is meant; three are drawn.",
        uses=("frequencies",),
        data=error_curves,
        plot=plot_error_curves,
        alt=describe_error_curves,
    ),
    ours(
        name="lag",
        place="eqs. (2) and (6)",
        title="Bias of held and of virtual measurements",
        caption="Mean lag of the position estimate for a very slow reference. A held measurement makes the estimate "
        "late by about half the hold, and so does (6), for references far below its slow rate. The frequencies of "
        "Table I lie above that rate: the lag shown here does not tell its columns apart.",
        uses=("lags",),
        data=lag_curves,
        plot=plot_lag_curves,
        alt=describe_lag_curves,
    ),
)
