"""What all results offer: text, a rich table, HTML, plain values, and a plot; arrays that cannot be replaced."""

from __future__ import annotations

from abc import ABC, abstractmethod
from html import escape
from typing import TYPE_CHECKING, Any

from replication.drawing.panels import Panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.table import Table

HEADINGS = ("quantity", "value", "how")


class Shown(ABC):
    """A result that prints itself on a terminal and in a notebook, and plots itself."""

    @abstractmethod
    def rows(self) -> list[tuple[str, str, str]]:
        """The lines of the table.

        Returns
        -------
        list of (str, str, str)
            Quantity, value with unit, and how it was found.
        """

    @abstractmethod
    def panels(self) -> tuple[Panel, ...]:
        """The curves that show the result best, computed when asked for.

        Returns
        -------
        tuple of Panel
            One for each set of axes.
        """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The result as plain JSON values.

        Returns
        -------
        dict
            Arrays are nested lists in full precision.
        """

    def plot(self) -> Figure:
        """Draw the panels, one above the other.

        Returns
        -------
        matplotlib.figure.Figure
            Not shown yet; `savefig` writes it.
        """
        from replication.drawing.panels import draw

        return draw(self.panels())

    def __str__(self) -> str:
        """One line for each row of the table."""
        return "\n".join(f"{what}: {value}{how and f'  ({how})'}" for what, value, how in self.rows())

    def __repr__(self) -> str:
        """The class and the first row."""
        what, value, _ = self.rows()[0]
        return f"<{type(self).__name__}: {what} {value}>"

    def __rich__(self) -> Table:
        """The table on a terminal."""
        from rich import box
        from rich.table import Table
        from rich.text import Text

        table = Table(box=box.SIMPLE)
        for heading in HEADINGS:
            table.add_column(heading)
        for row in self.rows():
            table.add_row(*(Text(cell) for cell in row))
        return table

    def _repr_html_(self) -> str:
        """The table in a notebook; everything is escaped."""
        head = "".join(f'<th scope="col">{heading}</th>' for heading in HEADINGS)
        body = "".join(
            f'<tr><th scope="row">{escape(what)}</th><td>{escape(value)}</td><td>{escape(how)}</td></tr>\n'
            for what, value, how in self.rows()
        )
        return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n"


def as_text(value: float | int | str | bool) -> str:
    """A value in a table: floats with six significant digits."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
