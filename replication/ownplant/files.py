"""The files of an own plant: reads it from TOML, and writes a design for it into a directory.

Every mistake in a plant file is reported at once, each with its path; nothing is computed here. Beside the matrices of
its method (`methods`) a file may hold name (starts the names of what is written), title, method, time_unit (only "s":
rates, periods and delays are in seconds), a table [names] and a table [units] with the units of names. A design is
written as gains in three forms, the observer in three that run, the figure, and the page.
"""

import difflib
import math
import os
import re
import tomllib
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from html import escape
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from replication.drawing.panels import as_svg, draw
from replication.errors import InvalidInputError
from replication.estimation.api.results import GainResult
from replication.files import write_directory
from replication.ownplant.methods import LARGEST, METHODS, NAMES, Field, Kind

MAX_BYTES = 2_000_000
MAX_ENTRIES = 40_000
"""Entries of one matrix; a plant of 200 states. Larger ones are for the library, which takes arrays."""
MAX_SHOWN = 20
"""Mistakes that are listed; the others are counted."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")
MAX_LABEL = 60
GENERAL = ("name", "title", "method", "time_unit", "names", "units")


@dataclass(frozen=True)
class PlantFile:
    """What a file holds. values: by field, checked in kind and shape; names: of signals, where the file gives them;
    units: of named signals."""

    name: str
    title: str
    method: str
    values: Mapping[str, Any]
    names: Mapping[str, tuple[str, ...]]
    units: Mapping[str, str]


def read_plant(path: Path, method: str) -> PlantFile:
    """The plant in the file at `path` for one of the four methods.

    Raises InvalidInputError that lists all mistakes, or says with its line where the file is not TOML; OSError if it
    cannot be read.
    """
    table = _parsed(path)
    problems: list[str] = []
    known = {field.name: field for field in METHODS[method].fields}
    for key in table:
        if key not in known and key not in GENERAL:
            problems.append(f"{key}: {_unknown(key, [*known, *GENERAL])}")
    _check_general(table, method, problems)
    values = {name: _value(field, table[name], problems) for name, field in known.items() if name in table}
    missing = [
        field for field in known.values() if field.required and table.keys().isdisjoint({field.name, field.instead})
    ]
    problems += [
        f"{field.name}: is missing; write {field.kind}{field.instead and f', or give {field.instead}'}"
        for field in missing
    ]
    sizes = _sizes(known, values, problems)
    names = _names(table.get("names", {}), sizes, problems)
    units = _units(table.get("units", {}), {label for labels in names.values() for label in labels}, problems)
    if problems:
        more = [f"and {len(problems) - MAX_SHOWN} more"] if len(problems) > MAX_SHOWN else []
        lines = "\n  ".join([*problems[:MAX_SHOWN], *more])
        count = f"{len(problems)} mistakes" if len(problems) > 1 else "a mistake"
        raise InvalidInputError(f"{path} has {count}:\n  {lines}")
    name = table.get("name", path.stem if NAME.fullmatch(path.stem) else "plant")
    return PlantFile(name, table.get("title", name), method, values, names, units)


def _parsed(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise InvalidInputError(f"{str(path)!r} is not a file; give the path of a plant file (TOML)")
    with path.open("rb") as stream:
        content = stream.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise InvalidInputError(f"{path} is larger than {MAX_BYTES} bytes; pass arrays of that size to the library")
    try:
        text = content.decode("utf-8-sig")
        return tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{path} is not UTF-8 text: {error.reason} at byte {error.start}") from None
    except tomllib.TOMLDecodeError as error:
        raise InvalidInputError(f"{path} is not TOML: {error}{_line(text, str(error))}") from None
    except RecursionError:
        raise InvalidInputError(f"{path} is nested too deeply; a matrix is a list of rows") from None
    except ValueError as error:
        # An integer of thousands of digits, which Python refuses to read.
        raise InvalidInputError(f"{path} holds a number that cannot be read: {error}") from None


def _line(text: str, message: str) -> str:
    """The line that a message of tomllib speaks of, a duplicate key for example."""
    at = re.search(r"at line (\d+)", message)
    lines = text.splitlines()
    return f": {lines[int(at[1]) - 1].strip()[:MAX_LABEL]!r}" if at and int(at[1]) <= len(lines) else ""


def _unknown(key: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(key, known, n=1)
    return "is not a key of this method" + (f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}")


def _check_general(table: Mapping[str, Any], method: str, problems: list[str]) -> None:
    name = table.get("name", "plant")
    if not isinstance(name, str) or not NAME.fullmatch(name):
        problems.append(
            f"name: must start with a letter and hold at most 40 letters, digits, - and _, for files are called after "
            f"it, got {_shown(name)}"
        )
    title = table.get("title", "")
    if not isinstance(title, str) or not title.isprintable() or len(title) > 2 * MAX_LABEL:
        problems.append(f"title: must be one line of at most {2 * MAX_LABEL} characters, got {_shown(title)}")
    if table.get("method", method) != method:
        problems.append(f"method: the file is for {_shown(table['method'])}, the command for '{method}'")
    if table.get("time_unit", "s") != "s":
        problems.append(
            f"time_unit: must be 's', got {_shown(table['time_unit'])}; convert rates, periods and delays to seconds"
        )


def _value(field: Field, value: Any, problems: list[str]) -> Any:
    if field.kind is Kind.WORD:
        if not _is_label(value):
            problems.append(f"{field.name}: must be {Kind.WORD}, got {_shown(value)}")
        return value
    return _nested(field.name, value, len(_letters(field, value)), field.kind, problems)


def _letters(field: Field, value: Any) -> tuple[str, ...]:
    """Those of the shape that a value has, one for each level of its lists: the first alone of a list of variances."""
    variances = field.kind is Kind.COVARIANCE and isinstance(value, list) and value and not isinstance(value[0], list)
    return field.shape[:1] if variances else field.shape


def _nested(where: str, value: Any, depth: int, kind: Kind, problems: list[str]) -> Any:
    """Numbers in so many lists, one in the other; None for what is no such list, or a matrix with a mistake in it."""
    if depth == 0:
        return _number(where, value, problems, kind)
    matrix = depth == 2
    whole = isinstance(value, list) and (len(value) > 0 or depth == 1)
    if not whole or (matrix and not all(isinstance(row, list) for row in value)):
        wanted = Kind.MATRIX if matrix and kind is Kind.MATRICES else kind
        problems.append(f"{where}: must be {wanted}, got {_shown(value)}")
        return None
    entries = sum(len(row) for row in value) if matrix else len(value)
    if entries > MAX_ENTRIES:
        problems.append(f"{where}: has {entries} entries, more than {MAX_ENTRIES}; pass such arrays to the library")
        return None
    if matrix and len({len(row) for row in value}) > 1:
        problems.append(f"{where}: its rows have different lengths, {[len(row) for row in value][:MAX_SHOWN]}")
        return None
    before = len(problems)
    parts = [_nested(f"{where}[{i}]", part, depth - 1, kind, problems) for i, part in enumerate(value)]
    return None if matrix and len(problems) > before else parts


def _number(where: str, value: Any, problems: list[str], kind: Kind) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        advice = "; write it without quotes and unit" if isinstance(value, str) else ""
        problems.append(f"{where}: {_shown(value)} is not a number{advice}")
        return math.nan
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        problems.append(f"{where}: {_shown(value)} is not finite")
    elif abs(number) > LARGEST:
        problems.append(f"{where}: {_shown(value)} is beyond {LARGEST:g} in size; choose other units")
    elif kind is Kind.AGES and number < 0:
        problems.append(f"{where}: must be at least 0, got {number:g}")
    elif kind in (Kind.TIME, Kind.TIMES) and number <= 0:
        problems.append(f"{where}: must be positive, got {number:g}")
    elif kind in (Kind.TIME, Kind.TIMES) and number < 1 / LARGEST:
        problems.append(f"{where}: {number:g} is below {1 / LARGEST:g}; choose another unit of time")
    return number


def _sizes(known: Mapping[str, Field], values: Mapping[str, Any], problems: list[str]) -> dict[str, int]:
    """What each letter stands for, from the first field that has it; adds a problem where a later one differs."""
    sizes: dict[str, tuple[int, str]] = {}
    for name, value in values.items():
        for where, shape, letters in _shapes(known[name], value):
            for axis, (size, letter) in enumerate(zip(shape, letters, strict=True)):
                first, source = sizes.setdefault(letter, (size, where))
                if size != first:
                    word = "entries" if len(letters) == 1 else ("rows", "columns")[axis]
                    rival = "itself has another number" if source == where else f"{source} sets {letter} = {first}"
                    problems.append(f"{where}: has {size} {word}, where {rival}")
    return {letter: size for letter, (size, _) in sizes.items()}


def _shapes(field: Field, value: Any) -> list[tuple[str, tuple[int, ...], tuple[str, ...]]]:
    """(path, sizes, letters) of each part of a value that is whole."""
    letters = _letters(field, value)
    if value is None or not letters:
        return []
    if len(letters) < 3:
        return [(field.name, np.shape(value), letters)]
    parts = [(f"{field.name}[{i}]", np.shape(matrix), letters[1:]) for i, matrix in enumerate(value) if matrix]
    return [(field.name, (len(value),), letters[:1]), *parts]


def _names(table: Any, sizes: Mapping[str, int], problems: list[str]) -> dict[str, tuple[str, ...]]:
    if not isinstance(table, dict):
        problems.append(f"names: must be a table of lists, got {_shown(table)}")
        return {}
    names = {}
    for key, labels in table.items():
        where = f"names.{key}"
        if key not in NAMES:
            problems.append(f"{where}: {_unknown(key, NAMES)}")
        elif not isinstance(labels, list) or not all(_is_label(label) for label in labels):
            problems.append(f"{where}: must be a list of names of at most {MAX_LABEL} characters, got {_shown(labels)}")
        elif len(set(labels)) < len(labels):
            problems.append(f"{where}: a name stands there twice, got {_shown(labels)}")
        elif NAMES[key] in sizes and len(labels) != sizes[NAMES[key]]:
            problems.append(f"{where}: has {len(labels)} names for {sizes[NAMES[key]]} {key}")
        else:
            names[key] = tuple(labels)
    return names


def _units(table: Any, names: Collection[str], problems: list[str]) -> dict[str, str]:
    if not isinstance(table, dict) or not all(_is_label(unit) for unit in table.values()):
        problems.append(f"units: must be a table of names with their units, got {_shown(table)}")
        return {}
    problems += [
        f"units.{name}: no signal of [names] is called so; there are {', '.join(sorted(names)) or 'none'}"
        for name in table
        if name not in names
    ]
    return table


def _is_label(label: Any) -> bool:
    return isinstance(label, str) and label.isprintable() and 0 < len(label) <= MAX_LABEL


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= MAX_LABEL else f"{text[:MAX_LABEL]}..."


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
    figure = as_svg(draw(result.panels()), "figure")
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
