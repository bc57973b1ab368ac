"""An observer that counts losses as one C99 file: its cases as tables, without allocation or globals."""

from __future__ import annotations

from string import Template

import numpy as np

from replication.estimation.api.c_code import CHECKS, NO_INPUTS
from replication.estimation.api.export import c_array, c_name, comment_text
from replication.estimation.multirate.losses.automaton import Automaton
from replication.estimation.multirate.problem import MultirateProblem
from replication.estimation.validation import Array

KNOWN = """\
        for (j = 0; j < ${M}_INPUTS; j++)
            next[i] += ${n}_input[i][j] * u[j];
"""
DIRECT = """\
            for (j = 0; j < ${M}_INPUTS; j++)
                innovation[i] -= ${n}_direct[i][j] * u[j];
"""
SOURCE = Template(
    """\
/* $comment

   ${n}_init(&s, NULL) or, with a start of ${M}_STARTS numbers, ${n}_init(&s, start); then at every instant
   ${n}_step(&s, u, y, estimate): u holds ${M}_INPUTS known inputs, y holds ${M}_MEASUREMENTS measurements (NAN where
   one did not come), and estimate receives ${M}_STARTS numbers. It returns 0, or 1 and changes nothing if a number is
   infinite or an input is missing. s.missed counts losses; s.unforeseen counts instants with more of them than the
   gains were made for, after which nothing is guaranteed. C99; link with -lm. */
#include <math.h>
#include <string.h>

enum {
    ${M}_ORDER = $order, ${M}_STARTS = $starts, ${M}_INPUTS = $inputs, ${M}_MEASUREMENTS = $measurements,
    ${M}_NODES = $nodes, ${M}_CHANNELS = $channels
};
typedef struct {
    double state[${M}_ORDER];
    unsigned long missed, unforeseen;
    int node;
} ${n}_t;
void ${n}_init(${n}_t *s, const double *start);
int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate);

$arrays
void ${n}_init(${n}_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    if (start != NULL)
        memcpy(s->state, start, ${M}_STARTS * sizeof *start);
}

/* The node that knows of as many losses as it can, where there were more than were foreseen. */
static int ${n}_after(int node, int number, const unsigned char *came)
{
    const int target = ${n}_target[number];
    int memory[${M}_CHANNELS], i, c, other;
    for (c = 0; c < ${M}_CHANNELS; c++)
        memory[c] = ${n}_memory[target][c];
    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if (${n}_arrived[number][i] && !came[i]) {
            c = ${M}_CHANNELS == 1 ? 0 : i;
            memory[c] = ${n}_memory[node][c];
        }
    for (other = 0; other < ${M}_NODES; other++)
        if (${n}_phase[other] == ${n}_phase[target] && memcmp(${n}_memory[other], memory, sizeof memory) == 0)
            return other;
    return target;
}

int ${n}_step(${n}_t *s, const double *u, const double *y, double *estimate)
{
    double innovation[${M}_MEASUREMENTS], next[${M}_ORDER];
    unsigned char came[${M}_MEASUREMENTS];
    const int phase = ${n}_phase[s->node];
    int i, j, number, best = 0, least = ${M}_MEASUREMENTS + 1;
$checks    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if (isinf(y[i]))
            return 1;
    for (i = 0; i < ${M}_MEASUREMENTS; i++) {
        came[i] = ${n}_due[phase][i] && !isnan(y[i]);
        s->missed += ${n}_due[phase][i] && isnan(y[i]) ? 1u : 0u;
        innovation[i] = 0.0;
        if (came[i]) {
            innovation[i] = y[i];
            for (j = 0; j < ${M}_ORDER; j++)
                innovation[i] -= ${n}_output[i][j] * s->state[j];
$direct        }
    }
    for (number = ${n}_first[s->node]; number < ${n}_first[s->node + 1]; number++) {
        int unlike = 0;
        for (i = 0; i < ${M}_MEASUREMENTS; i++)
            unlike += came[i] != ${n}_arrived[number][i];
        if (unlike < least) {
            least = unlike;
            best = number;
        }
    }
    for (i = 0; i < ${M}_ORDER; i++) {
        next[i] = 0.0;
        for (j = 0; j < ${M}_ORDER; j++)
            next[i] += ${n}_transition[i][j] * s->state[j];
$known        for (j = 0; j < ${M}_MEASUREMENTS; j++)
            next[i] += ${n}_gain[best][i][j] * innovation[j];
    }
    memcpy(s->state, next, sizeof next);
    if (least > 0)
        s->unforeseen++;
    s->node = least > 0 ? ${n}_after(s->node, best, came) : ${n}_target[best];
    memcpy(estimate, s->state, ${M}_STARTS * sizeof *estimate);
    return 0;
}
"""
)


def c_form(name: str, comment: str, problem: MultirateProblem, given: Automaton, gains: Array) -> str:
    """The C99 source for gains (edges, n, q); raises InvalidInputError if `name` is no C identifier."""
    plant, inputs = problem.plant, problem.plant.B_u.shape[1]
    through = inputs > 0 and bool(np.any(plant.D_u))
    # The edges of each node follow each other, as they were found.
    first = np.array([0, *np.cumsum([len(leaving) for leaving in given.out])])
    arrays = {"transition": plant.A, "output": plant.C, "gain": gains}
    if inputs:
        arrays["input"] = plant.B_u
    if through:
        arrays["direct"] = plant.D_u
    counts = {
        "first": first,
        "target": np.array([edge.target for edge in given.edges]),
        "phase": np.array(given.phases),
        "memory": np.array(given.memories),
    }
    marks = {"arrived": np.array([edge.arrived for edge in given.edges]), "due": problem.schedule.mask}
    written = [c_array(f"{name}_{key}", np.asarray(array, dtype=float)) for key, array in arrays.items()]
    written += [c_array(f"{name}_{key}", array, "int") for key, array in counts.items()]
    written += [c_array(f"{name}_{key}", array, "unsigned char") for key, array in marks.items()]
    names = {"n": c_name(name), "M": name.upper()}
    return SOURCE.substitute(
        **names,
        comment=comment_text(comment),
        order=plant.order,
        starts=plant.order - plant.under_way,
        inputs=inputs,
        measurements=plant.sensors,
        nodes=len(given.phases),
        channels=counts["memory"].shape[1],
        arrays="\n".join(written),
        checks=Template(CHECKS if inputs else NO_INPUTS).substitute(names),
        known=Template(KNOWN if inputs else "").substitute(names),
        direct=Template(DIRECT if through else "").substitute(names),
    )
