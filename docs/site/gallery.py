"""Hook of the documentation site: `<!-- figures -->` stands for the figures of all papers, with their data and code."""

from __future__ import annotations

import csv
import functools
import inspect
import textwrap
from html import escape
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

import papers
from replication.audit.parts import Figure, FigureData

FIGURES = Path(__file__).resolve().parents[2] / "figures"
MARK = "<!-- figures -->"


def on_files(files: Files, config: Any) -> Files:
    """Add the figures that are committed, and their data."""
    for path in sorted(FIGURES.iterdir()):
        files.append(File.generated(config, f"figures/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the mark, where a page has it."""
    return markdown.replace(MARK, _gallery()) if MARK in markdown else markdown


def _gallery() -> str:
    """Thumbnails of all figures, which lead to them, then the figures."""
    shown = [paper for paper in papers.load() if paper.figures]
    small = "\n".join(
        f'<a href="#{figure.name}"><img src="figures/{figure.name}.svg" alt="{escape(figure.place)}" loading="lazy">'
        f"{escape(paper.authors[0].rpartition(' ')[2])}: {escape(figure.place)}</a>"
        for paper in shown
        for figure in paper.figures
    )
    large = (f"### {paper.title}\n\n" + "\n\n".join(_shown(figure) for figure in paper.figures) for paper in shown)
    return f'<div class="tiles">\n{small}\n</div>\n\n' + "\n\n".join(large)


def _shown(figure: Figure) -> str:
    drawing, table = (FIGURES / f"{figure.name}{suffix}" for suffix in (".svg", ".csv"))
    if not (drawing.is_file() and table.is_file()):
        raise PluginError(f"figures/{figure.name} is missing; `make report` draws it")
    data = FigureData(columns=_columns(table))
    title = figure.title(data) if callable(figure.title) else figure.title
    said, alt = escape(f"{figure.place}: {title}"), escape(figure.alt(data))
    code = textwrap.dedent(inspect.getsource(_function(figure.plot)))
    return (
        f'<figure id="{figure.name}"><img src="figures/{figure.name}.svg" alt="{alt}" loading="lazy">'
        f"<figcaption>{said}. "
        f'<a href="figures/{figure.name}.csv">The data of {figure.name}</a></figcaption></figure>\n\n'
        f'<details markdown="1"><summary>The code of {figure.name}</summary>\n\n'
        f"```python\n{code}\n```\n\n</details>"
    )


def _function(plot: Any) -> Any:
    """The function behind what wraps it, or gives it some arguments already."""
    plot = inspect.unwrap(plot)
    return _function(plot.func) if isinstance(plot, functools.partial) else plot


def _columns(table: Path) -> dict[str, tuple[float, ...]]:
    rows = list(csv.reader(table.read_text(encoding="utf-8").splitlines()))
    return {name: tuple(float(cell) for cell in column if cell) for name, *column in zip(*rows, strict=True)}
