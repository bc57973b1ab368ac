"""A running observer as one C99 file: `NAME_init` and `NAME_step`, with all matrices, without allocation or globals."""

from __future__ import annotations

from string import Template

import numpy as np

from replication.estimation.api.export import c_array, c_name, comment_text
from replication.estimation.api.phase import Recursion
from replication.estimation.validation import Array

COMPLETED = """\
    for (i = 0; i < ${M}_MEASUREMENTS; i++) {
        completed[i] = isnan(y[i]) ? 0.0 : y[i];
        if (${n}_due[k][i] && isnan(y[i])) {
            missed++;
            for (j = 0; j < ${M}_ORDER; j++)
                completed[i] += ${n}_expected[k][i][j] * s->state[j];
$direct        }
    }
"""
"""A measurement that should be there and is not is replaced by the one that is expected."""
DIRECT = """\
            for (j = 0; j < ${M}_INPUTS; j++)
                completed[i] += ${n}_direct[i][j] * u[j];
"""
WAITING = """\
    for (i = 0; i < ${M}_MEASUREMENTS; i++) {
        completed[i] = y[i];
        missed += isnan(y[i]) ? 1u : 0u;
    }
    if (missed == ${M}_MEASUREMENTS) {
        ${n}_estimate(s, estimate);
        s->missed += missed;
        s->instant++;
        return 0;
    }
    if (missed > 0)
        return 1;
"""
"""A sample that does not come only makes the interval longer; one that is not complete is refused."""
SOURCE = Template(
    """\
/* $comment

   ${n}_init(&s, NULL) or, with a start of ${M}_STARTS numbers, ${n}_init(&s, start); then at every instant
   ${n}_step(&s, u, y, estimate): u holds ${M}_INPUTS known inputs, y holds ${M}_MEASUREMENTS measurements (NAN where
   one did not come), and estimate receives ${M}_ESTIMATES numbers. It returns 0, or 1 and changes nothing if a number
   is infinite, an input is missing, or the sample is one that the observer refuses. C99; link with -lm. */
#include <math.h>
#include <string.h>

enum {
    ${M}_ORDER = $order, ${M}_STARTS = $starts, ${M}_ESTIMATES = $states,
    ${M}_INPUTS = $inputs, ${M}_MEASUREMENTS = $measurements, ${M}_PHASES = $count
};
typedef struct {
    double state[${M}_ORDER];
    unsigned long instant, missed;
} ${n}_t;
void ${n}_init(${n}_t *s, const double *start);
void ${n}_estimate(const ${n}_t *s, double *estimate);
int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate);

$arrays
void ${n}_init(${n}_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    if (start != NULL)
        memcpy(s->state, start, ${M}_STARTS * sizeof *start);
}

void ${n}_estimate(const ${n}_t *s, double *estimate)
{
    const unsigned long k = s->instant % ${M}_PHASES;
    int i, j;
    for (i = 0; i < ${M}_ESTIMATES; i++) {
        estimate[i] = 0.0;
        for (j = 0; j < ${M}_ORDER; j++)
            estimate[i] += ${n}_readout[k][i][j] * s->state[j];
    }
}

int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate)
{
    const unsigned long k = s->instant % ${M}_PHASES;
    double completed[${M}_MEASUREMENTS], next[${M}_ORDER];
    unsigned long missed = 0;
    int i, j;
$checks    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if (isinf(y[i]))
            return 1;
$measured    for (i = 0; i < ${M}_ORDER; i++) {
        next[i] = 0.0;
        for (j = 0; j < ${M}_ORDER; j++)
            next[i] += ${n}_transition[k][i][j] * s->state[j];
$known        for (j = 0; j < ${M}_MEASUREMENTS; j++)
            next[i] += ${n}_injection[k][i][j] * completed[j];
    }
    memcpy(s->state, next, sizeof next);
    s->missed += missed;
    s->instant++;
    ${n}_estimate(s, estimate);
    return 0;
}
"""
)
CHECKS = """\
    for (i = 0; i < ${M}_INPUTS; i++)
        if (!isfinite(u[i]))
            return 1;
"""
NO_INPUTS = "    (void)u;\n"
KNOWN = """\
        for (j = 0; j < ${M}_INPUTS; j++)
            next[i] += ${n}_input[k][i][j] * u[j];
"""


def c_source(name: str, comment: str, recursion: Recursion) -> str:
    """The recursion as one file.

    Parameters
    ----------
    name : str
        C identifier with which every name begins.
    comment : str
        What it is, for the top of the file.
    recursion : Recursion
        What it does.

    Raises
    ------
    InvalidInputError
        `name` is no C identifier, too long, or a keyword.
    """
    arrays = {key: recursion.stacked(key) for key in ("transition", "input", "injection", "readout")}
    inputs, expected, through = arrays["input"].shape[2], recursion.expected, recursion.through
    tables: dict[str, Array] = arrays if inputs else {key: array for key, array in arrays.items() if key != "input"}
    if expected is not None:
        tables = {**tables, "expected": np.stack(expected)}
    if through is not None:
        tables = {**tables, "direct": through}
    written = [c_array(f"{name}_{key}", array) for key, array in tables.items()]
    if expected is not None:
        written.append(c_array(f"{name}_due", recursion.stacked("due"), "unsigned char"))
    names = {"n": c_name(name), "M": name.upper()}
    return SOURCE.substitute(
        **names,
        comment=comment_text(comment),
        order=arrays["transition"].shape[1],
        starts=recursion.starts,
        states=arrays["readout"].shape[1],
        inputs=inputs,
        measurements=arrays["injection"].shape[2],
        count=len(recursion.phases),
        arrays="\n".join(written),
        checks=Template(CHECKS if inputs else NO_INPUTS).substitute(names),
        known=Template(KNOWN if inputs else "").substitute(names),
        measured=Template(WAITING if expected is None else COMPLETED).substitute(
            names, direct=Template(DIRECT if through is not None else "").substitute(names)
        ),
    )
