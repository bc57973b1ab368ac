"""The text of the C99 file of an estimator with time stamps: what all share, and what each kind adds."""

from __future__ import annotations

from string import Template

SOURCE = Template(
    """\
/* $comment

   ${n}_init(&s, NULL) or, with a start of ${M}_ORDER numbers, ${n}_init(&s, start); then for each sample
   ${n}_step(&s, t, u, y, estimate): t is its time stamp in seconds, u holds ${M}_INPUTS known inputs from t on (NULL:
   as before), y holds ${M}_MEASUREMENTS measurements ($missing), and estimate receives the estimate of the
   ${M}_ORDER states at t. ${n}_predict(&s, t, estimate) gives that at a later time. Both return 0, or 1 and change
   nothing if a number is not finite or t is not later than the sample before. C99; link with -lm. */
#include <math.h>
#include <string.h>

enum {
    ${M}_ORDER = $order, ${M}_INPUTS = $inputs, ${M}_HELD = $held, ${M}_MEASUREMENTS = $measurements,
    ${M}_MEAN = ${M}_ORDER + ${M}_HELD, ${M}_DRIVES = ${M}_INPUTS + ${M}_HELD, ${M}_DEGREE = $degree,
    ${M}_COLUMNS = $columns, ${M}_CELLS = $cells
};
typedef struct {
    double mean[${M}_MEAN], input[${M}_INPUTS + 1], time;
$kept    unsigned long samples;
} ${n}_t;
void ${n}_init(${n}_t *s, const double *start);
int ${n}_predict(const ${n}_t *s, double t, double *estimate);
int ${n}_step(${n}_t *s, double t, const double *u, const double *y, double *estimate);

$arrays
static const double ${n}_rate = $rate, ${n}_short = $short;

/* [Phi, Gamma, Q] over h: a power series over h / 2^j, doubled j times. */
static void ${n}_transition(double h, double whole[${M}_ORDER][${M}_COLUMNS])
{
    double next[${M}_ORDER][${M}_COLUMNS], half[${M}_ORDER];
    const int spread = ${M}_COLUMNS - ${M}_ORDER;
    int doublings = 0, i, j, k, l;
    while (${n}_rate * h > ${n}_short) {
        h /= 2.0;
        doublings++;
    }
    for (i = 0; i < ${M}_ORDER; i++)
        for (j = 0; j < ${M}_COLUMNS; j++) {
            whole[i][j] = 0.0;
            for (k = ${M}_DEGREE; k >= 0; k--)
                whole[i][j] = whole[i][j] * h + ${n}_table[k][i][j];
        }
    for (; doublings > 0; doublings--) {
        for (i = 0; i < ${M}_ORDER; i++) {
            for (j = 0; j < spread; j++) {
                next[i][j] = j < ${M}_ORDER ? 0.0 : whole[i][j];
                for (k = 0; k < ${M}_ORDER; k++)
                    next[i][j] += whole[i][k] * whole[k][j];
            }
            for (k = 0; k < ${M}_ORDER; k++) {
                half[k] = 0.0;
                for (l = 0; l < ${M}_ORDER; l++)
                    half[k] += whole[i][l] * whole[l][spread + k];
            }
            for (j = 0; j < ${M}_ORDER; j++) {
                next[i][spread + j] = whole[i][spread + j];
                for (k = 0; k < ${M}_ORDER; k++)
                    next[i][spread + j] += half[k] * whole[j][k];
            }
        }
        memcpy(whole, next, sizeof next);
    }
}

static void ${n}_moved(const ${n}_t *s, double whole[${M}_ORDER][${M}_COLUMNS], double *x)
{
    int i, j;
    for (i = 0; i < ${M}_ORDER; i++) {
        x[i] = 0.0;
        for (j = 0; j < ${M}_ORDER; j++)
            x[i] += whole[i][j] * s->mean[j];
        for (j = 0; j < ${M}_DRIVES; j++)
            x[i] += whole[i][${M}_ORDER + j] * (j < ${M}_INPUTS ? s->input[j] : s->mean[${M}_ORDER + j - ${M}_INPUTS]);
    }
}

void ${n}_init(${n}_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    if (start != NULL)
        memcpy(s->mean, start, ${M}_ORDER * sizeof *start);
$begun}

int ${n}_predict(const ${n}_t *s, double t, double *estimate)
{
    double whole[${M}_ORDER][${M}_COLUMNS];
    if (!isfinite(t) || s->samples == 0 || t < s->time)
        return 1;
    ${n}_transition(t - s->time, whole);
    ${n}_moved(s, whole, estimate);
    return 0;
}

int ${n}_step(${n}_t *s, double t, const double *u, const double *y, double *estimate)
{
    double x[${M}_ORDER], whole[${M}_ORDER][${M}_COLUMNS];
$places    int i, j;
    if (!isfinite(t) || (s->samples > 0 && t <= s->time))
        return 1;
    for (i = 0; u != NULL && i < ${M}_INPUTS; i++)
        if (!isfinite(u[i]))
            return 1;
    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if ($refused)
            return 1;
    memcpy(x, s->mean, sizeof x);
    if (s->samples > 0) {
        ${n}_transition(t - s->time, whole);
        ${n}_moved(s, whole, x);
$moved    }
$corrected    for (i = 0; u != NULL && i < ${M}_INPUTS; i++)
        s->input[i] = u[i];
    s->time = t;
    s->samples++;
    memcpy(estimate, s->mean, ${M}_ORDER * sizeof *estimate);
    return 0;
}
"""
)

FIXED = {
    "missing": "all of them",
    "kept": "",
    "begun": "",
    "places": "    int cell;\n",
    "refused": "!isfinite(y[i])",
    "moved": "",
    "corrected": """\
    for (cell = 0; cell < ${M}_CELLS - 1 && (s->samples == 0 || t - s->time >= ${n}_edges[cell]); cell++)
        ;
    for (i = 0; i < ${M}_MEAN; i++)
        s->mean[i] = i < ${M}_ORDER ? x[i] : 0.0;
    for (i = 0; i < ${M}_MEASUREMENTS; i++) {
        double innovation = y[i];
        for (j = 0; j < ${M}_ORDER; j++)
            innovation -= ${n}_output[i][j] * x[j];
        for (j = 0; j < ${M}_MEAN; j++)
            s->mean[j] += ${n}_gain[cell][j][i] * innovation;
    }
""",
}
"""A filter with gains G by the period before, which estimates the held disturbance, too."""

RUNNING = {
    "missing": "NAN where a sensor did not measure",
    "kept": "    double covariance[${M}_ORDER][${M}_ORDER];\n",
    "begun": "    memcpy(s->covariance, ${n}_start, sizeof s->covariance);\n",
    "places": """\
    double half[${M}_ORDER][${M}_ORDER], crossed[${M}_MEASUREMENTS][${M}_ORDER];
    double root[${M}_MEASUREMENTS][${M}_MEASUREMENTS], innovation[${M}_MEASUREMENTS];
    int seen[${M}_MEASUREMENTS], count = 0, k;
""",
    "refused": "isinf(y[i])",
    "moved": """\
        for (i = 0; i < ${M}_ORDER; i++)
            for (j = 0; j < ${M}_ORDER; j++) {
                half[i][j] = 0.0;
                for (k = 0; k < ${M}_ORDER; k++)
                    half[i][j] += whole[i][k] * s->covariance[k][j];
            }
        /* One triangle and its mirror image: what rounding makes unequal would grow. */
        for (i = 0; i < ${M}_ORDER; i++)
            for (j = 0; j <= i; j++) {
                s->covariance[i][j] = whole[i][${M}_COLUMNS - ${M}_ORDER + j];
                for (k = 0; k < ${M}_ORDER; k++)
                    s->covariance[i][j] += half[i][k] * whole[j][k];
                s->covariance[j][i] = s->covariance[i][j];
            }
""",
    "corrected": """\
    for (i = 0; i < ${M}_MEASUREMENTS; i++)
        if (!isnan(y[i]))
            seen[count++] = i;
    for (i = 0; i < count; i++) {
        innovation[i] = y[seen[i]];
        for (j = 0; j < ${M}_ORDER; j++) {
            innovation[i] -= ${n}_output[seen[i]][j] * x[j];
            crossed[i][j] = 0.0;
            for (k = 0; k < ${M}_ORDER; k++)
                crossed[i][j] += ${n}_output[seen[i]][k] * s->covariance[k][j];
        }
    }
    /* A Cholesky factor of the covariance of the innovations; innovations and crossed in units of it. */
    for (i = 0; i < count; i++) {
        for (j = 0; j <= i; j++) {
            root[i][j] = ${n}_noise[seen[i]][seen[j]];
            for (k = 0; k < ${M}_ORDER; k++)
                root[i][j] += crossed[i][k] * ${n}_output[seen[j]][k];
        }
    }
    for (i = 0; i < count; i++) {
        for (j = 0; j <= i; j++) {
            for (k = 0; k < j; k++)
                root[i][j] -= root[i][k] * root[j][k];
            root[i][j] = i == j ? sqrt(root[i][j]) : root[i][j] / root[j][j];
        }
        for (k = 0; k < i; k++) {
            innovation[i] -= root[i][k] * innovation[k];
            for (j = 0; j < ${M}_ORDER; j++)
                crossed[i][j] -= root[i][k] * crossed[k][j];
        }
        innovation[i] /= root[i][i];
        for (j = 0; j < ${M}_ORDER; j++)
            crossed[i][j] /= root[i][i];
    }
    for (i = 0; i < ${M}_ORDER; i++) {
        s->mean[i] = x[i];
        for (k = 0; k < count; k++)
            s->mean[i] += crossed[k][i] * innovation[k];
        for (j = 0; j < ${M}_ORDER; j++)
            for (k = 0; k < count; k++)
                s->covariance[i][j] -= crossed[k][i] * crossed[k][j];
    }
""",
}
"""A Kalman filter, whose gain follows from the covariance at each sample."""
