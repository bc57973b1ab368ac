"""Writes a design into a directory: gains as JSON, MATLAB file and C header, the figure, and the page."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from replication.drawing.panels import draw_svg
from replication.errors import InvalidInputError
from replication.estimation.api.results import GainResult
from replication.files import write_directory
from replication.ownplant.page import page
from replication.ownplant.reading import PlantFile

FILES = ("gains.json", "gains.mat", "gains.h", "figure.svg", "index.html")


def require_free(directory: Path, *, replace: bool, proof: str = "") -> None:
    """Raise InvalidInputError unless `directory` can be made, or `replace` and holds nothing but an earlier design.

    proof: the name of the file that a design with a certificate has beside FILES.
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
    others = sorted(path.name for path in directory.iterdir() if path.name not in (*FILES, proof))
    if others:
        raise InvalidInputError(
            f"{directory} holds more than a design ({', '.join(others[:3])}); choose another --output"
        )


def with_names(result: GainResult, given: Mapping[str, tuple[str, ...]]) -> GainResult:
    """The result with the names that the file gives; estimated outputs that are the states are called like them."""
    own = result.signals
    names: dict[str, Any] = dict(given)
    if "states" in given and own.outputs == own.states:
        names = {"outputs": given["states"], **names}
    return replace(result, signals=replace(own, **names))


def write_design(
    directory: Path, plant: PlantFile, result: GainResult, call: str, proof: Mapping[str, bytes] | None = None
) -> None:
    """All of FILES and of `proof`, files by name, or none: they appear under their name at once."""
    more = dict(proof or {})
    name = plant.name.replace("-", "_")[:20] + "_" + plant.method
    figure = draw_svg(result.panels(), "figure")
    write_directory(
        directory,
        {
            "gains.json": result.to_json().encode(),
            "gains.mat": result.to_mat(),
            "gains.h": result.to_c_header(name[:31]).encode(),
            "figure.svg": figure.encode(),
            "index.html": page(plant.title, result, figure, call, (*FILES[:-1], *more)).encode(),
            **more,
        },
    )
