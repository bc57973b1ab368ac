"""The course of the epidemic."""

from typing import Any

from replication.audit.declare import Figure, FigureData, Results
from replication.drawing.style import line, new_axes


def columns(results: Results) -> FigureData:
    """The infected over time."""
    course = results["epidemic"]
    return FigureData(columns={"day": tuple(course["time"]), "infected": tuple(course["infected"])})


def plot(drawn: FigureData) -> Any:
    """One curve."""
    figure, (axes,) = new_axes(row_height=2.4)
    axes.plot(drawn.columns["day"], drawn.columns["infected"], **line(0))
    axes.set_xlabel("day")
    axes.set_ylabel("infected")
    return figure


def alt(drawn: FigureData) -> str:
    """The peak."""
    return f"The infected rise to {max(drawn.columns['infected']):.3f} of the population and fall again."


COURSE = Figure(
    name="course",
    place="Sec. 3",
    title="The epidemic falls more slowly than it rises",
    caption="Look at the tail: it lasts longer than the rise.",
    published=False,
    uses=("epidemic",),
    data=columns,
    plot=plot,
    alt=alt,
)
