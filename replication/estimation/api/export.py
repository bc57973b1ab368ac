"""Gains and running observers for other programs: JSON, MAT files (level 5), C99, MATLAB; all as text or bytes.

The C lies in `sources`, written for an observer called `obs`; `c_file` puts the name that was asked for in its place,
and in front of it the sizes as an enumeration and the matrices as constants, row by row.
"""

import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import scipy

from replication.errors import InvalidInputError
from replication.estimation.validation import Array

MAT_HEADER = b"MATLAB 5.0 MAT-file: gains of an estimator"
"""In place of scipy's, which holds the date: same gains, same bytes."""
MAT_HEADER_SIZE = 116
IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}")
C_KEYWORD = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    "restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while"
)


def to_json(values: Mapping[str, Any]) -> str:
    """Indented JSON that ends in a line feed; NaN and infinities are refused, for JSON has none."""
    return json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def to_mat(arrays: Mapping[str, Array]) -> bytes:
    """A MATLAB file (level 5) with one variable for each array; vectors become rows."""
    stream = io.BytesIO()
    scipy.io.savemat(stream, {name: np.asarray(array) for name, array in arrays.items()}, oned_as="row")
    return MAT_HEADER.ljust(MAT_HEADER_SIZE) + stream.getvalue()[MAT_HEADER_SIZE:]


def to_c_header(name: str, arrays: Mapping[str, Array], axes: Mapping[str, str], comment: str) -> str:
    """`static const double NAME_ARRAY[..]` in row-major order, each with its shape as macros NAME_ARRAY_DIM0 and so on.

    Raises InvalidInputError if `name` is no C identifier of at most 31 characters or is a keyword of the language.
    """
    guard = f"{c_name(name).upper()}_H"
    lines = [f"/* {comment_text(comment)} */", f"#ifndef {guard}", f"#define {guard}", ""]
    for key, array in arrays.items():
        symbol = f"{name}_{key}"
        lines.append(f"/* {key}: {comment_text(axes[key])}, row-major */")
        lines += [f"#define {symbol.upper()}_DIM{i} {size}" for i, size in enumerate(array.shape)]
        lines.append(c_array(symbol, array))
    return "\n".join([*lines, f"#endif /* {guard} */", ""])


def c_name(name: str) -> str:
    """The name itself; raises InvalidInputError unless it is a C identifier of at most 31 characters."""
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or C_KEYWORD.fullmatch(name):
        raise InvalidInputError(
            f"name must be a C identifier (letters, digits and _, at most 31, not a word of the language), got {name!r}"
        )
    return name


def c_array(symbol: str, array: Array, kind: str = "double") -> str:
    """A constant array in row-major order, and an empty line."""
    shape = "".join(f"[{size}]" for size in array.shape)
    return f"static const {kind} {symbol}{shape} = {_initialiser(array)};\n"


def _initialiser(array: Array) -> str:
    if array.ndim == 0:
        return repr(float(array)) if array.dtype == float else str(int(array))
    return "{" + ", ".join(_initialiser(part) for part in array) + "}"


def comment_text(comment: str) -> str:
    """Text that cannot end the comment that it stands in, on one line."""
    return " ".join(comment.split()).replace("*/", "* /").replace("/*", "/ *")


@dataclass(frozen=True, eq=False)
class Phase:
    """One instant of a periodic observer: o+ = transition o + input u + injection y, x^ = readout o.

    transition (N, N), input (N, m), injection (N, q), readout (n, N); due (q,): which sensors measure.
    """

    transition: Array
    input: Array
    injection: Array
    readout: Array
    due: Array


@dataclass(frozen=True, eq=False)
class Recursion:
    """o+ = transition o + input u + injection y, x^ = readout o, phase after phase.

    starts: length of the start; the other entries of o begin at zero. expected, (q, N) for each instant: a measurement
    that is missing is replaced by expected o + direct u; without it the observer waits for the next sample. direct
    (q, m): effect of the known inputs on the measurements. limits (count, q): how far a measurement may be from the
    expected one, which replaces it if it is farther.
    """

    phases: Sequence[Phase]
    starts: int
    expected: Sequence[Array] | None = None
    direct: Array | None = None
    limits: Array | None = None

    def stacked(self, field: str) -> Array:
        """One field of all phases."""
        return np.stack([getattr(phase, field) for phase in self.phases])


INSTANTS = """\
obs_init(&s, NULL) or, with a start of OBS_STARTS numbers, obs_init(&s, start); then at every instant
   obs_step(&s, u, y, estimate): u holds OBS_INPUTS known inputs, y holds OBS_MEASUREMENTS measurements (NAN where
   one did not come), and estimate receives OBS_ESTIMATES numbers. It returns 0, or 1 and changes nothing if a number
   is infinite, an input is missing, or the sample is one that the observer refuses. s.missed counts samples that did
   not come, s.unscheduled those of sensors that were not due, which are left out."""
"""How an observer with instants of its own is called."""


def source(*files: str) -> str:
    """The text of these files of `sources`, one after the other."""
    return "\n".join((Path(__file__).parent / "sources" / file).read_text(encoding="utf-8") for file in files)


def c_file(name: str, comment: str, usage: str, body: str, sizes: Mapping[str, int], tables: Mapping[str, Any]) -> str:
    """One C99 file; `comment` and `usage` stand at its top, `body` below sizes, tables and what all files share.

    Raises InvalidInputError if `name` is no C identifier, too long, or a keyword.
    """
    prefix = c_name(name)
    listed = ",\n".join(f"    OBS_{key.upper()} = {size}" for key, size in sizes.items())
    written = (c_array(f"obs_{key}", *_flat(np.asarray(table))) for key, table in tables.items())
    parts = f"enum {{\n{listed}\n}};\n", "".join(written), source("common.c"), body
    top = f"{usage} C99; link with -lm. */\n#include <math.h>\n#include <string.h>\n"
    text = re.sub("OBS_", f"{prefix.upper()}_", re.sub(r"\bobs_", f"{prefix}_", "\n".join([top, *parts])))
    return f"/* {comment_text(comment)}\n\n   {text}"


def _flat(table: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], str]:
    """All entries row by row, one zero where there are none, as C has no empty array; and their type in C."""
    kind = {"b": "unsigned char", "i": "int"}.get(table.dtype.kind, "double")
    return (table.ravel() if table.size else np.zeros(1, table.dtype)), kind


def c_source(name: str, comment: str, recursion: Recursion) -> str:
    """A periodic recursion as one file; raises as `c_file`."""
    tables = {key: recursion.stacked(key) for key in ("transition", "input", "injection", "readout", "due")}
    count, order, inputs = tables["input"].shape
    sensors, waits = tables["injection"].shape[2], recursion.expected is None
    tables["expected"] = np.zeros((count, sensors, order)) if waits else np.stack(recursion.expected or ())
    tables["direct"] = np.zeros((sensors, inputs)) if recursion.direct is None else recursion.direct
    tables["limit"] = np.zeros(1) if recursion.limits is None else recursion.limits
    sizes = {"order": order, "starts": recursion.starts, "estimates": tables["readout"].shape[1], "inputs": inputs}
    sizes |= {"measurements": sensors, "phases": count, "waits": int(waits), "gated": int(recursion.limits is not None)}
    return c_file(name, comment, INSTANTS, source("periodic.c"), sizes, tables)


RESERVED = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|persistent|return|spmd|"
    "switch|try|while"
)


def matlab_source(name: str, comment: str, recursion: Recursion) -> str:
    """The recursion as a function `name`, with `comment` in its help.

    Raises InvalidInputError if `name` is no name of a function, or the observer has a gate.
    """
    if not isinstance(name, str) or not IDENTIFIER.fullmatch(name) or RESERVED.fullmatch(name):
        raise InvalidInputError(
            f"name must be one of a MATLAB function (letters, digits and _, at most 31, no reserved word), got {name!r}"
        )
    if recursion.limits is not None:
        raise InvalidInputError("an observer with a gate has no form in MATLAB; leave the gate out, or take its C form")
    phases, expected, direct = recursion.phases, recursion.expected, recursion.direct
    inputs, tables, through = phases[0].input.shape[1], "", ""
    if expected is not None:
        due = [phase.due[:, None] for phase in phases]
        if direct is not None and np.any(direct):
            tables, through = f"direct = {_cells([direct])};\n", " + direct{1} * u"
        tables += f"expected = {_cells(expected)};\ndue = {_cells(due)};\n"
    return Template(source("periodic.m")).substitute(
        name=name,
        upper=name.upper(),
        comment=" ".join(comment.split()),
        starts=recursion.starts,
        inputs=inputs,
        measurements=phases[0].injection.shape[1],
        order=len(phases[0].transition),
        count=len(phases),
        **{key: _cells(recursion.stacked(key)) for key in ("transition", "injection", "readout")},
        known=f"drive = {_cells(recursion.stacked('input'))};\n" if inputs else "",
        tables=tables,
        driven=" + drive{k} * u" if inputs else "",
        measured=Template(source("waiting.m" if expected is None else "completed.m")).substitute(
            name=name, through=through
        ),
    )


def _cells(matrices: Iterable[Array]) -> str:
    """A cell array with a matrix for each phase, a line for each."""
    return "{ ...\n" + ", ...\n".join(f"    {_matrix(matrix)}" for matrix in matrices) + "}"


def _matrix(matrix: Array) -> str:
    written = str.lower if matrix.dtype == np.bool_ else str  # str of a float is as exact as its repr
    return f"[{'; '.join(' '.join(written(str(entry)) for entry in row) for row in matrix.tolist())}]"
