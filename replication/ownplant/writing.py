"""Writes a design into a directory: gains in three forms, the observer in three that run, the figure, and the page."""

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from html import escape
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from replication.drawing.panels import draw_svg
from replication.errors import InvalidInputError
from replication.estimation.api.results import GainResult
from replication.files import write_directory
from replication.ownplant.reading import PlantFile

FILES = ("gains.json", "gains.mat", "gains.h", "figure.svg", "index.html")
RUNNING = ("observer.json", "observer.c", "observer.m")
"""Beside FILES where the observer runs at periods that the design knows, each if it has that form."""
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
    files = sorted(path.name for path in directory.iterdir() if path.name not in (*FILES, *RUNNING, proof))
    if files:
        raise InvalidInputError(
            f"{directory} holds more than a design ({', '.join(files[:3])}); choose another --output"
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
    if any(parameter.default is parameter.empty for parameter in signature(result.observer).parameters.values()):
        return {}
    observer, comment = result.observer(), f"{title}: {result.method} observer"
    forms: tuple[Callable[[], str], ...] = (
        observer.to_json,
        partial(observer.to_c, name, comment),
        partial(observer.to_matlab, "observer", comment),  # it is called by the name of its file
    )
    files = {}
    for file, form in zip(RUNNING, forms, strict=True):
        with suppress(InvalidInputError):
            files[file] = form().encode()
    return files


def page(title: str, result: GainResult, figure: str, call: str, files: tuple[str, ...]) -> str:
    """The page; figure: an SVG element, call: the command line that made it, files: what lies beside the page."""
    (panel,) = result.panels()
    levels = ", ".join(f"{name} {value:.4g}" for name, value in panel.levels.items())
    alt = f"{panel.y_label} over {panel.x_label}; {levels}"
    drawing = figure.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)
    names = {kind: labels for kind, labels in result.signals.to_dict().items() if isinstance(labels, list) and labels}
    fields = {"title": title, "result": result, "drawing": drawing, "alt": alt, "names": names, "call": call}
    texts = FileSystemLoader(Path(__file__).parent)
    template = Environment(loader=texts, autoescape=True, undefined=StrictUndefined).get_template("page.html.j2")
    with np.printoptions(precision=6, linewidth=95, suppress=False):
        return template.render(**fields, files=files, most=MAX_PRINTED) + "\n"
