"""The recursion of an observer of a delay plant as one C99 file: a ring of past samples, no allocation."""

from __future__ import annotations

from string import Template

import numpy as np

from replication.estimation.api.c_code import CHECKS, NO_INPUTS
from replication.estimation.api.export import c_array, c_name, comment_text
from replication.estimation.delay.sampled.recursion import SampledObserver

SOURCE = Template(
    """\
/* $comment

   ${n}_init(&s, NULL) or, with a start of ${M}_STATES numbers, ${n}_init(&s, start); then every $dt s
   ${n}_step(&s, u, y, estimate): u holds ${M}_INPUTS known inputs, y holds ${M}_MEASUREMENTS measurements (NAN where
   one did not come), and estimate receives the estimate of the ${M}_STATES states at the same instant; ${n}_output
   gives that of z. It returns 0, or 1 and changes nothing if a number is infinite or an input is missing.
   C99; link with -lm. */
#include <math.h>
#include <string.h>

enum {
    ${M}_STATES = $states, ${M}_OUTPUTS = $outputs, ${M}_MEASUREMENTS = $measurements, ${M}_INPUTS = $inputs,
    ${M}_UNKNOWNS = ${M}_STATES + ${M}_MEASUREMENTS, ${M}_COLUMNS = ${M}_UNKNOWNS + ${M}_INPUTS,
    ${M}_ROWS = ${M}_UNKNOWNS + ${M}_OUTPUTS, ${M}_PAST = $past, ${M}_FIRST = ${M}_STATES + ${M}_OUTPUTS
};
typedef struct {
    double past[${M}_PAST][${M}_COLUMNS], state[${M}_STATES], rate[${M}_STATES], output[${M}_OUTPUTS];
    unsigned long instant, missed, newest;
} ${n}_t;
void ${n}_init(${n}_t *s, const double *start);
void ${n}_estimate(const ${n}_t *s, double *estimate);
void ${n}_output(const ${n}_t *s, double *output);
int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate);

$arrays
void ${n}_init(${n}_t *s, const double *start)
{
    int i, j;
    memset(s, 0, sizeof *s);
    if (start == NULL)
        return;
    memcpy(s->state, start, sizeof s->state);
    for (j = 0; j < ${M}_PAST; j++)
        for (i = 0; i < ${M}_STATES; i++)
            s->past[j][i] = start[i];
}

void ${n}_estimate(const ${n}_t *s, double *estimate)
{
    memcpy(estimate, s->state, sizeof s->state);
}

void ${n}_output(const ${n}_t *s, double *output)
{
    memcpy(output, s->output, sizeof s->output);
}

int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate)
{
    double known[${M}_ROWS], target[${M}_UNKNOWNS], now[${M}_COLUMNS];
    unsigned long missed = 0;
    int i, j, k;
$checks    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if (isinf(y[i]))
            return 1;
    for (i = 0; i < ${M}_ROWS; i++) {
        known[i] = 0.0;
        for (k = 0; k < ${M}_PAST; k++) {
            const double *past = s->past[(s->newest + (unsigned long)k) % ${M}_PAST];
            for (j = 0; j < ${M}_COLUMNS; j++)
                known[i] += ${n}_taps[k + 1][i][j] * past[j];
        }
$copied    }
    for (i = 0; i < ${M}_STATES; i++)
        target[i] = s->instant > 0 ? s->state[i] + ${n}_half * (s->rate[i] + known[i]) : s->state[i];
    for (i = 0; i < ${M}_STATES; i++) {
        now[i] = s->instant > 0 ? 0.0 : target[i];
        for (j = 0; j < ${M}_STATES && s->instant > 0; j++)
            now[i] += ${n}_free[i][j] * target[j];
    }
    for (i = 0; i < ${M}_MEASUREMENTS; i++) {
        double expected = known[${M}_FIRST + i];
        for (j = 0; j < ${M}_STATES; j++)
            expected += ${n}_taps[0][${M}_FIRST + i][j] * now[j];
        missed += isnan(y[i]) ? 1u : 0u;
        target[${M}_STATES + i] = (isnan(y[i]) ? expected : y[i]) - (s->instant > 0 ? known[${M}_FIRST + i] : expected);
    }
    for (i = s->instant > 0 ? 0 : ${M}_STATES; i < ${M}_UNKNOWNS; i++) {
        now[i] = 0.0;
        for (j = 0; j < ${M}_UNKNOWNS && s->instant > 0; j++)
            now[i] += ${n}_solve[i][j] * target[j];
        for (j = 0; j < ${M}_MEASUREMENTS && s->instant == 0; j++)
            now[i] += ${n}_first[i - ${M}_STATES][j] * target[${M}_STATES + j];
    }
$kept    for (i = 0; i < ${M}_FIRST; i++)
        for (j = 0; j < ${M}_UNKNOWNS; j++)
            known[i] += ${n}_taps[0][i][j] * now[j];
    memcpy(s->state, now, sizeof s->state);
    memcpy(s->rate, known, sizeof s->rate);
    memcpy(s->output, known + ${M}_STATES, sizeof s->output);
    s->newest = (s->newest + ${M}_PAST - 1) % ${M}_PAST;
    memcpy(s->past[s->newest], now, sizeof now);
    s->missed += missed;
    s->instant++;
    ${n}_estimate(s, estimate);
    return 0;
}
"""
)
COPIED = """\
        for (j = 0; j < ${M}_INPUTS; j++)
            known[i] += ${n}_taps[0][i][${M}_UNKNOWNS + j] * u[j];
"""
KEPT = """\
    for (i = 0; i < ${M}_INPUTS; i++)
        now[${M}_UNKNOWNS + i] = u[i];
"""


def c_form(name: str, comment: str, recursion: SampledObserver) -> str:
    """The C99 source of the recursion; `name` begins every name in it, `comment` stands at the top.

    Raises InvalidInputError if `name` is no C identifier, too long, or a keyword.
    """
    n, p, q, m = recursion.sizes
    names = {"n": c_name(name), "M": name.upper()}
    present = recursion.present()
    arrays = {
        "taps": recursion.taps,
        "half": np.array(recursion.dt / 2.0),
        "solve": np.linalg.inv(present),
        "free": np.linalg.inv(present[:n, :n]),
        "first": np.linalg.inv(present[n:, n:]),
    }
    return SOURCE.substitute(
        **names,
        comment=comment_text(comment),
        dt=repr(recursion.dt),
        states=n,
        outputs=p,
        measurements=q,
        inputs=m,
        past=len(recursion.taps) - 1,
        arrays="\n".join(c_array(f"{name}_{key}", array) for key, array in arrays.items()),
        checks=Template(CHECKS if m else NO_INPUTS).substitute(names),
        copied=Template(COPIED if m else "").substitute(names),
        kept=Template(KEPT if m else "").substitute(names),
    )
