"""Writes a design into a directory: gains in three forms, the observer in three that run, the figure, and the page."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from html import escape
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np

from replication.drawing.panels import draw_svg
from replication.errors import InvalidInputError
from replication.estimation.api.results import GainResult
from replication.estimation.validation import Array
from replication.files import write_directory
from replication.ownplant.reading import PlantFile

FILES = ("gains.json", "gains.mat", "gains.h", "figure.svg", "index.html")
RUNNING = ("observer.json", "observer.c", "observer.m")
"""Beside FILES where the observer runs at periods that the design knows, each if it has that form."""
STYLE = """
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #1c1f23;
       background: #fff }
table { border-collapse: collapse; margin: 1rem 0; display: block; overflow-x: auto }
th, td { text-align: left; padding: .25rem .75rem .25rem 0; vertical-align: top; border-bottom: 1px solid #ccc }
th { font-weight: 600 } caption { text-align: left; font-weight: 600 }
code, pre { font-family: ui-monospace, monospace; overflow-x: auto } figure { margin: 1rem 0 } svg { max-width: 100% }
"""
MAX_PRINTED = 60
"""Gains of more numbers than this are in the files only."""


def require_free(directory: Path, *, replace: bool, proof: str = "") -> None:
    """Raise InvalidInputError unless `directory` can be made, or `replace` and holds nothing but an earlier design.

    proof: the name of the file that a design with a certificate has, too.
    """
    nearest = next((path for path in directory.absolute().parents if path.exists()), directory)
    if not nearest.is_dir() or not os.access(nearest, os.W_OK | os.X_OK):
        raise InvalidInputError(f"{nearest} is no directory that can be written; choose another --output")
    if not directory.exists() and not directory.is_symlink():
        return
    if not replace:
        raise InvalidInputError(f"{directory} exists; choose another --output, or --force to replace an earlier design")
    if directory.is_symlink() or not directory.is_dir():
        raise InvalidInputError(f"{directory} is no directory; choose another --output")
    others = sorted(path.name for path in directory.iterdir() if path.name not in (*FILES, *RUNNING, proof))
    if others:
        raise InvalidInputError(
            f"{directory} holds more than a design ({', '.join(others[:3])}); choose another --output"
        )


def write_design(
    directory: Path, plant: PlantFile, result: GainResult, call: str, proof: Mapping[str, bytes] | None = None
) -> None:
    """All of FILES, RUNNING and `proof`, files by name, or none: they appear under their name at once."""
    name = (plant.name.replace("-", "_")[:20] + "_" + plant.method)[:31]
    more = running_files(result, name, plant.title) | dict(proof or {})
    figure = draw_svg(result.panels(), "figure")
    write_directory(
        directory,
        {
            "gains.json": result.to_json().encode(),
            "gains.mat": result.to_mat(),
            "gains.h": result.to_c_header(name).encode(),
            "figure.svg": figure.encode(),
            "index.html": page(plant.title, result, figure, call, (*FILES[:-1], *more)).encode(),
            **more,
        },
    )


def running_files(result: Any, name: str, title: str) -> dict[str, bytes]:
    """RUNNING by name, without the forms that the observer does not have; none if it asks for a sampling period."""
    if any(asked.default is asked.empty for asked in signature(result.observer).parameters.values()):
        return {}
    observer, comment = result.observer(), f"{title}: {result.method} observer"
    forms: tuple[Callable[[], str], ...] = (
        observer.to_json,
        partial(observer.to_c, name, comment),
        partial(observer.to_matlab, "observer", comment),  # it is called by the name of its file
    )
    found = {}
    for file, form in zip(RUNNING, forms, strict=True):
        with suppress(InvalidInputError):
            found[file] = form().encode()
    return found


def page(title: str, result: GainResult, figure: str, call: str, files: tuple[str, ...]) -> str:
    """The page; figure: an SVG element, call: the command line that made it, files: what lies beside the page."""
    drawing = figure.replace("<svg ", f'<svg role="img" aria-label="{escape(_alt(result))}" ', 1)
    names = "".join(
        f'<tr><th scope="row">{kind}</th><td>{escape(", ".join(result.signals.called(labels)))}</td></tr>\n'
        for kind, labels in result.signals.to_dict().items()
        if isinstance(labels, list) and labels
    )
    links = ", ".join(f'<a href="{escape(name)}">{escape(name)}</a>' for name in files)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}: {result.method} estimator</title>
<style>{STYLE}</style>
</head>
<body>
<main>
<h1>{escape(title)}: {result.method} estimator</h1>
{result._repr_html_()}
<figure>
{drawing}<figcaption>{escape(_alt(result))}</figcaption>
</figure>
<h2>Signals</h2>
<table><tbody>
{names}</tbody></table>
<h2>Gains</h2>
{"".join(_gain(name, result.axes[name], gain) for name, gain in result.gains.items())}
<h2>Files</h2>
<p>{links}. All numbers there are in full precision; those on this page are rounded.</p>
<h2>Made by</h2>
<pre><code>{escape(call)}</code></pre>
</main>
</body>
</html>
"""


def _alt(result: GainResult) -> str:
    (panel,) = result.panels()
    return f"{panel.y_label} over {panel.x_label}; {', '.join(f'{name} {v:.4g}' for name, v in panel.levels.items())}"


def _gain(name: str, axes: str, gain: Array) -> str:
    heading = f"<h3>{escape(name)} {escape(axes)}, shape {gain.shape}</h3>\n"
    if gain.size > MAX_PRINTED:
        return f"{heading}<p>{gain.size} numbers, in the files.</p>\n"
    with np.printoptions(precision=6, linewidth=95, suppress=False):
        return f"{heading}<pre>{escape(str(gain))}</pre>\n"
