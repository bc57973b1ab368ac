"""Gains and running observers for other programs: JSON, MAT files (level 5), C99, MATLAB; all as text or bytes.

The C is written for an observer called `obs`; `c_file` puts the name that was asked for in its place, and in front of
it the sizes as an enumeration and the matrices as constants, row by row.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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

    @property
    def through(self) -> Array | None:
        """`direct`, if any of it is not zero."""
        return self.direct if self.direct is not None and np.any(self.direct) else None


COMMON = """\
/* out (rows, columns) += left (rows, inner) right (inner, columns). */
static void obs_add(double *out, const double *left, const double *right, int rows, int inner, int columns)
{
    int i, j, k;
    for (i = 0; i < rows; i++)
        for (k = 0; k < inner; k++)
            for (j = 0; j < columns; j++)
                out[i * columns + j] += left[i * inner + k] * right[k * columns + j];
}

/* Whether a number is infinite or, unless there may be gaps, missing. */
static int obs_bad(const double *x, int count, int gaps)
{
    int i;
    for (i = 0; i < count; i++)
        if (gaps ? isinf(x[i]) : !isfinite(x[i]))
            return 1;
    return 0;
}
"""
INSTANTS = """\
obs_init(&s, NULL) or, with a start of OBS_STARTS numbers, obs_init(&s, start); then at every instant
   obs_step(&s, u, y, estimate): u holds OBS_INPUTS known inputs, y holds OBS_MEASUREMENTS measurements (NAN where
   one did not come), and estimate receives OBS_ESTIMATES numbers. It returns 0, or 1 and changes nothing if a number
   is infinite, an input is missing, or the sample is one that the observer refuses. s.missed counts samples that did
   not come, s.unscheduled those of sensors that were not due, which are left out."""
"""How an observer with instants of its own is called."""
PERIODIC = """\
typedef struct {
    double state[OBS_ORDER];
    unsigned long instant, missed, unscheduled, gated;
} obs_t;

void obs_init(obs_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    if (start != NULL)
        memcpy(s->state, start, OBS_STARTS * sizeof *start);
}

void obs_estimate(const obs_t *s, double *estimate)
{
    const unsigned long k = s->instant % OBS_PHASES;
    memset(estimate, 0, OBS_ESTIMATES * sizeof *estimate);
    obs_add(estimate, obs_readout + k * OBS_ESTIMATES * OBS_ORDER, s->state, OBS_ESTIMATES, OBS_ORDER, 1);
}

int obs_step(obs_t *s, const double *u, const double *y, double *estimate)
{
    const unsigned long k = s->instant % OBS_PHASES;
    double completed[OBS_MEASUREMENTS], next[OBS_ORDER] = {0}, expected;
    unsigned long missed = 0, gated = 0, unscheduled = 0, row = k * OBS_MEASUREMENTS;
    int i;
    if (obs_bad(u, OBS_INPUTS, 0) || obs_bad(y, OBS_MEASUREMENTS, 1))
        return 1;
    /* A measurement that should be there and is not, or is beyond the gate, is replaced by the one that is expected. */
    for (i = 0; i < OBS_MEASUREMENTS; i++, row++) {
        completed[i] = isnan(y[i]) || !obs_due[row] ? 0.0 : y[i];
        unscheduled += !isnan(y[i]) && !obs_due[row] ? 1u : 0u;
        if (obs_due[row] && (OBS_GATED || isnan(y[i]))) {
            expected = 0.0;
            obs_add(&expected, obs_expected + row * OBS_ORDER, s->state, 1, OBS_ORDER, 1);
            obs_add(&expected, obs_direct + i * OBS_INPUTS, u, 1, OBS_INPUTS, 1);
            missed += isnan(y[i]) ? 1u : 0u;
            gated += OBS_GATED && fabs(y[i] - expected) > obs_limit[row] ? 1u : 0u;
            if (isnan(y[i]) || (OBS_GATED && fabs(y[i] - expected) > obs_limit[row]))
                completed[i] = expected;
        }
    }
    /* One that waits lets a sample that does not come make the interval longer, and refuses one with gaps. */
    if (OBS_WAITS && missed > 0 && missed < OBS_MEASUREMENTS)
        return 1;
    if (!OBS_WAITS || missed == 0) {
        obs_add(next, obs_transition + k * OBS_ORDER * OBS_ORDER, s->state, OBS_ORDER, OBS_ORDER, 1);
        obs_add(next, obs_input + k * OBS_ORDER * OBS_INPUTS, u, OBS_ORDER, OBS_INPUTS, 1);
        obs_add(next, obs_injection + k * OBS_ORDER * OBS_MEASUREMENTS, completed, OBS_ORDER, OBS_MEASUREMENTS, 1);
        memcpy(s->state, next, sizeof next);
    }
    s->missed += missed;
    s->gated += gated;
    s->unscheduled += unscheduled;
    s->instant++;
    obs_estimate(s, estimate);
    return 0;
}
"""


def c_file(name: str, comment: str, usage: str, body: str, sizes: Mapping[str, int], tables: Mapping[str, Any]) -> str:
    """One C99 file; `comment` and `usage` stand at its top, `body` below sizes, tables and what all files share.

    Raises InvalidInputError if `name` is no C identifier, too long, or a keyword.
    """
    own = c_name(name)
    listed = ",\n".join(f"    OBS_{key.upper()} = {size}" for key, size in sizes.items())
    written = (c_array(f"obs_{key}", *_flat(np.asarray(table))) for key, table in tables.items())
    parts = f"enum {{\n{listed}\n}};\n", "".join(written), COMMON, body
    top = f"{usage} C99; link with -lm. */\n#include <math.h>\n#include <string.h>\n"
    text = re.sub("OBS_", f"{own.upper()}_", re.sub(r"\bobs_", f"{own}_", "\n".join([top, *parts])))
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
    return c_file(name, comment, INSTANTS, PERIODIC, sizes, tables)


RESERVED = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|persistent|return|spmd|"
    "switch|try|while"
)
SOURCE = Template(
    """\
function [estimate, missed] = $name(u, y)
% $upper  $comment
%   $name('reset') or $name('reset', start) begins again at instant 0; start has $starts entries.
%   estimate = $name(u, y) goes on by one instant: u has $inputs known inputs ([] if none), y has
%   $measurements measurements, NaN where one did not come. missed counts those.
persistent state instant lost_so_far
transition = $transition;
injection = $injection;
readout = $readout;
$known$tables
if isempty(instant) || ischar(u)
    state = zeros($order, 1);
    instant = 0;
    lost_so_far = 0;
end
if ischar(u)
    if nargin > 1
        state(1:$starts) = y(:);
    end
    estimate = readout{1} * state;
    missed = 0;
    return
end
u = u(:);
y = y(:);
if numel(u) ~= $inputs || numel(y) ~= $measurements || any(isnan(u)) || any(isinf(u)) || any(isinf(y))
    error('$name: u must be $inputs finite numbers, y $measurements that are finite or NaN');
end
k = mod(instant, $count) + 1;
$measured
state = transition{k} * state + injection{k} * y$driven;
instant = instant + 1;
k = mod(instant, $count) + 1;
estimate = readout{k} * state;
missed = lost_so_far;
end
"""
)
COMPLETED = """\
guess = expected{k} * state$through;
lost_so_far = lost_so_far + sum(isnan(y) & due{k});
left_out = isnan(y) | ~due{k};
y(left_out) = guess(left_out);"""
"""A measurement that should be there and is not is replaced by the one that is expected."""
WAITING = """\
if any(isnan(y)) && ~all(isnan(y))
    error('$name: a sample must be complete, or NaN as a whole');
end
lost_so_far = lost_so_far + sum(isnan(y));
if all(isnan(y))
    instant = instant + 1;
    estimate = readout{k} * state;
    missed = lost_so_far;
    return
end"""
"""A sample that does not come only makes the interval longer; one that is not complete is refused."""


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
    phases, expected, through = recursion.phases, recursion.expected, recursion.through
    inputs, tables = phases[0].input.shape[1], ""
    if expected is not None:
        due = [phase.due[:, None] for phase in phases]
        if through is not None:
            tables = f"direct = {_cells([through])};\n"
        tables += f"expected = {_cells(expected)};\ndue = {_cells(due)};\n"
    return SOURCE.substitute(
        name=name,
        upper=name.upper(),
        comment=" ".join(comment.split()),
        starts=recursion.starts,
        inputs=inputs,
        measurements=phases[0].injection.shape[1],
        order=len(phases[0].transition),
        count=len(phases),
        transition=_cells([phase.transition for phase in phases]),
        injection=_cells([phase.injection for phase in phases]),
        readout=_cells([phase.readout for phase in phases]),
        known=f"drive = {_cells([phase.input for phase in phases])};\n" if inputs else "",
        tables=tables,
        driven=" + drive{k} * u" if inputs else "",
        measured=Template(WAITING if expected is None else COMPLETED).substitute(
            name=name, through="" if through is None else " + direct{1} * u"
        ),
    )


def _cells(matrices: Sequence[Array]) -> str:
    """A cell array with a matrix for each phase, a line for each."""
    return "{ ...\n" + ", ...\n".join(f"    {_matrix(matrix)}" for matrix in matrices) + "}"


def _matrix(matrix: Array) -> str:
    written = str.lower if matrix.dtype == np.bool_ else str  # str of a float is as exact as its repr
    return f"[{'; '.join(' '.join(written(str(entry)) for entry in row) for row in matrix.tolist())}]"
