"""Hook of the documentation site: `<!-- figures -->` stands for the figures of all papers, with their data and code."""

from __future__ import annotations

import inspect
import textwrap
from html import escape
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

import papers
from replication.audit.parts import Figure

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
    return "\n\n".join(
        f"### {paper.title}\n\n" + "\n\n".join(_shown(figure) for figure in paper.figures)
        for paper in papers.load()
        if paper.figures
    )


def _shown(figure: Figure) -> str:
    if not (FIGURES / f"{figure.name}.svg").is_file():
        raise PluginError(f"figures/{figure.name}.svg is missing; `make report` draws it")
    said = escape(f"{figure.place}: {figure.title}")
    code = textwrap.dedent(inspect.getsource(figure.plot))
    return (
        f'<figure><img src="figures/{figure.name}.svg" alt="{said}" loading="lazy"><figcaption>{said}. '
        f'<a href="figures/{figure.name}.csv">The data of {figure.name}</a></figcaption></figure>\n\n'
        f'<details markdown="1"><summary>The code of {figure.name}</summary>\n\n```python\n{code}\n```\n\n</details>'
    )
