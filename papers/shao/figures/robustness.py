"""Figure on the error when the plant is not the model."""

from __future__ import annotations

from typing import Any

from papers.shao.figures.looks import NAMES, columns_of, look, ours
from papers.shao.problem import APO, FAST, HELD, PMI, REPAIRED
from replication.audit.model import Results
from replication.audit.parts import FigureData
from replication.drawing.labels import name_axes, name_line
from replication.drawing.style import GREY, WIDTH

DISTURBED = (PMI, APO, HELD, REPAIRED, FAST)
PARAMETERS = {"inertia": "inertia J", "flux": "flux with torque constant", "resistance": "resistance R"}


def robustness_curves(results: Results) -> FigureData:
    """Percent error at σ = 1 rad/s against the factor by which a parameter of the plant is off."""
    found = results["robustness"]
    columns: dict[str, list[float]] = {"factor": found["factors"]}
    for parameter in PARAMETERS:
        for name in DISTURBED:
            columns[f"{parameter}_{name}"] = [float("inf") if e is None else e for _, e in found[parameter][name]]
    return columns_of(columns)


def plot_robustness_curves(drawn: FigureData) -> Any:
    """The flux above, on which the error hangs; inertia and resistance below."""
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(WIDTH, 4.9), layout="constrained")
    grid = drawing.add_gridspec(2, 2, height_ratios=(3, 2))
    flux = drawing.add_subplot(grid[0, :])
    inertia, resistance = (drawing.add_subplot(grid[1, k], sharey=flux) for k in (0, 1))
    c = drawn.columns
    panels = {"flux": flux, "inertia": inertia, "resistance": resistance}
    for parameter, axis in panels.items():
        for name in DISTURBED:
            axis.semilogy(c["factor"], c[f"{parameter}_{name}"], zorder=3 if name == APO else 2, **look(name))
        axis.set_xticks((0.5, 1, 1.5, 2), ("0.5", "1", "1.5", "2"))
        axis.minorticks_off()
        name_axes(axis, f"{parameter}: error (%)", "true over nominal")
        axis.axvline(1.0, color=GREY, linewidth=0.6)
    resistance.tick_params(labelleft=False)
    flux.set_ylim(bottom=0.6)
    lines = dict(zip(DISTURBED, flux.lines, strict=False))
    for name, at, side, ha in PLACES:
        name_line(flux, lines[name], NAMES[name], at, side=side, ha=ha)
    return drawing


PLACES = (
    (PMI, 0.6, 1, "left"),
    (HELD, 1.5, -1, "left"),
    (APO, 1.0, -1, "right"),
    (REPAIRED, 1.12, -1, "left"),
    (FAST, 1.075, -1, "left"),
)
"""Where the names of the curves stand: abscissa, side, and which end of the words is there."""


def _range(drawn: FigureData, parameter: str) -> tuple[float, float]:
    errors = drawn.columns[f"{parameter}_{APO}"]
    return min(errors), max(errors)


def say_robustness_curves(drawn: FigureData) -> str:
    """The message: what the most telling parameter does."""
    worst = max(PARAMETERS, key=lambda name: _range(drawn, name)[1] / _range(drawn, name)[0])
    low, high = _range(drawn, worst)
    return f"A wrong {worst} moves the tracking error of DRC-APO between {low:.2f} and {high:.2f} %"


def describe_robustness_curves(drawn: FigureData) -> str:
    """Range of the error over the factors for each parameter under DRC-APO."""
    ranges = [
        f"{symbol}: {min(drawn.columns[f'{parameter}_{APO}']):.2f} to {max(drawn.columns[f'{parameter}_{APO}']):.2f}"
        for parameter, symbol in PARAMETERS.items()
    ]
    factors = drawn.columns["factor"]
    return (
        f"Percent error of DRC-APO where the model does not know a parameter, true over nominal from {factors[0]:g} to "
        f"{factors[-1]:g}. {'; '.join(ranges)}."
    )


FIGURES = (
    ours(
        name="robustness",
        place="Sec. V",
        title=say_robustness_curves,
        caption="Error at 1 rad/s, steady state, under the literal reading. The observer and the feedforward keep "
        "the printed parameters; "
        "with the flux the torque constant moves, too. Largest and least over the factors drawn.",
        uses=("robustness",),
        data=robustness_curves,
        plot=plot_robustness_curves,
        alt=describe_robustness_curves,
    ),
)
