"""Running observers as one C99 file each, without allocation or globals: what all share, and the periodic recursion.

The C is written for an observer called `obs`; `c_file` puts the name that was asked for in its place, and in front of
it the sizes as an enumeration and the matrices as constants, row by row.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from replication.estimation.api.export import c_array, c_name, comment_text
from replication.estimation.api.phase import Recursion

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
