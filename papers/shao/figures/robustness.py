"""Figure on the error when the plant is not the model."""

from __future__ import annotations

from typing import Any

from papers.shao.figures.looks import NAMES, columns_of, look, ours
from papers.shao.problem import APO, FAST, HELD, PMI, RESTARTED
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.labels import name_axes, name_line
from replication.drawing.style import GREY, new_axes

DISTURBED = (PMI, APO, HELD, RESTARTED, FAST)
PARAMETERS = {"inertia": "inertia J", "flux": "flux", "resistance": "resistance R"}


def robustness_curves(results: Results) -> FigureData:
    """Percent error at σ = 1 rad/s against the factor by which a parameter of the plant is off."""
    found = results["robustness"]
    columns: dict[str, list[float]] = {"factor": found["factors"]}
    for parameter in PARAMETERS:
        for name in DISTURBED:
            columns[f"{parameter}_{name}"] = [float("inf") if e is None else e for _, e in found[parameter][name]]
    return columns_of(columns)


def plot_robustness_curves(drawn: FigureData) -> Any:
    """Error against the true over the nominal flux, on which it hangs; inertia and resistance are told in words."""
    drawing, (axis,) = new_axes(row_height=3.0)
    c = drawn.columns
    for name in DISTURBED:
        (curve,) = axis.semilogy(c["factor"], c[f"flux_{name}"], zorder=3 if name == APO else 2, **look(name))
        at, side, ha = PLACES[name]
        name_line(axis, curve, NAMES[name], at, side=side, ha=ha)
    axis.axvline(1.0, color=GREY, linewidth=0.6)
    axis.set_xticks((0.5, 1, 1.5, 2), ("0.5", "1", "1.5", "2"))
    axis.set_yticks((1, 10, 100), ("1", "10", "100"))
    axis.minorticks_off()
    axis.set_ylim(bottom=0.6)
    name_axes(axis, "largest tracking error (%)", "true flux over nominal flux")
    return drawing


PLACES = {
    PMI: (0.6, 1, "left"),
    HELD: (1.5, -1, "left"),
    APO: (1.0, -1, "right"),
    RESTARTED: (1.12, -1, "left"),
    FAST: (1.075, -1, "left"),
}
"""Where the name of a curve stands: abscissa, side, and which end of the words is there."""


def _largest(drawn: FigureData, parameter: str) -> float:
    return max(drawn.columns[f"{parameter}_{APO}"])


def say_robustness_curves(drawn: FigureData) -> str:
    """The message: what the flux does, as the largest error drawn."""
    return f"A wrong flux raises the tracking error of DRC-APO to {_largest(drawn, 'flux'):.0f} %"


def describe_robustness_curves(drawn: FigureData) -> str:
    """Largest error over the factors for each parameter under DRC-APO."""
    largest = [f"{words} {_largest(drawn, parameter):.0f} %" for parameter, words in PARAMETERS.items()]
    factors = drawn.columns["factor"]
    return (
        f"Largest error of DRC-APO where the model does not know a parameter, true over nominal from {factors[0]:g} to "
        f"{factors[-1]:g}: {'; '.join(largest)}."
    )


FIGURES = (
    ours(
        name="robustness",
        place="Sec. V",
        title=say_robustness_curves,
        caption="Reference of 1 rad/s, steady state, literal reading. Observer, gains and command keep the printed "
        "parameters; the torque constant changes with the flux. A wrong inertia or resistance matters far less.",
        uses=("robustness",),
        data=robustness_curves,
        plot=plot_robustness_curves,
        alt=describe_robustness_curves,
    ),
)
