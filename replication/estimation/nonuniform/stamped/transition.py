"""The transition over any period by the same few lines in Python and in C; estimators with time stamps in C.

Phi(h) = e^{Ah}, Gamma(h) = int_0^h e^{As} ds B and Q(h) = int_0^h e^{As} Q e^{A's} ds are power series in h whose
coefficients are known beforehand. They are summed at h / 2^j, where they converge fast, and doubled j times:
Q(2h) = Q(h) + Phi(h) Q(h) Phi(h)'. No exponential of -A is formed, so stiff plants do no harm (cf. C. F. Van Loan,
IEEE TAC 23 (1978), who takes all three from one exponential).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from replication.estimation.api.export import c_file
from replication.estimation.linear.riccati import symmetric
from replication.estimation.validation import Array

DEGREE = 18
"""With norm(A) h at most SHORT the first term left out is below 1e-16 of the sum."""
SHORT = 0.5


@dataclass(frozen=True, eq=False)
class Transition:
    """The power series of one plant.

    table (DEGREE + 1, n, 2n + m): coefficients of h^k in Phi, Gamma and Q; order, inputs: n and m; rate: norm of A in
    balanced units, 1/s.
    """

    table: Array
    order: int
    inputs: int
    rate: float

    @classmethod
    def of(cls, A: Array, B: Array, Q: Array) -> Transition:
        """For A (n, n) in 1/s, inputs B (n, m) that are held, and white noise of intensity Q (n, n)."""
        n, m = B.shape
        balanced = scipy.linalg.matrix_balance(A, permute=False)[0]
        table = np.zeros((DEGREE + 1, n, 2 * n + m))
        power, held, spread = np.eye(n), np.array(B), np.array(Q)
        table[0, :, :n] = power
        for k in range(1, DEGREE + 1):
            # The integrals of the terms before are the terms of degree k.
            table[k, :, n:] = np.hstack([held, spread]) / k
            power, held = A @ power / k, A @ held / k
            spread = (A @ spread + spread @ A.T) / k
            table[k, :, :n] = power
        return cls(table, n, m, float(np.linalg.norm(balanced, 1)))

    def at(self, h: float) -> tuple[Array, Array, Array]:
        """Phi (n, n), Gamma (n, m) and Q (n, n) over h >= 0, s."""
        Phi, Gamma, Q = self.over(np.array([h]))
        return Phi[0], Gamma[0], Q[0]

    def over(self, h: Array) -> tuple[Array, Array, Array]:
        """The same over each of several times (U,): Phi (U, n, n), Gamma (U, n, m) and Q (U, n, n)."""
        n, m = self.order, self.inputs
        doublings = np.ceil(np.log2(np.maximum(self.rate * h / SHORT, 1.0)))
        powers = (h / 2.0**doublings)[:, None] ** np.arange(DEGREE + 1)
        whole = (powers @ self.table.reshape(DEGREE + 1, -1)).reshape(len(h), n, -1)
        Phi, Gamma, Q = whole[..., :n], whole[..., n : n + m], whole[..., n + m :]
        for left in range(int(doublings.max(initial=0.0)), 0, -1):
            on = (doublings >= left)[:, None, None]
            Q = np.where(on, Q + Phi @ Q @ Phi.mT, Q)
            Gamma, Phi = np.where(on, Gamma + Phi @ Gamma, Gamma), np.where(on, Phi @ Phi, Phi)
        return Phi, Gamma, symmetric(Q)


USAGE = """\
obs_init(&s, NULL) or, with a start of OBS_ESTIMATES numbers, obs_init(&s, start); then for each sample
   obs_step(&s, t, u, y, estimate): t is its time stamp in seconds, u holds OBS_INPUTS known inputs from t on (NULL:
   as before), y holds OBS_MEASUREMENTS measurements (all of them or, of a Kalman filter, NAN where a sensor did not
   measure; NULL: there is no sample, only the input changes), and estimate receives the estimate of the OBS_ESTIMATES
   states at t. obs_predict(&s, t, estimate) gives that at a later time. Both return 0, or 1 and change nothing if a
   number is not finite, t is not later than the sample before, or it is before the newest input."""
TURN = """\
/* out (estimates, estimates) += left right left', symmetric: what rounding makes unequal would grow. */
static void obs_turn(double *out, const double *left, const double *right)
{
    double half[OBS_ESTIMATES * OBS_ESTIMATES] = {0};
    int i, j, k;
    obs_add(half, left, right, OBS_ESTIMATES, OBS_ESTIMATES, OBS_ESTIMATES);
    for (i = 0; i < OBS_ESTIMATES; i++)
        for (j = 0; j <= i; j++) {
            for (k = 0; k < OBS_ESTIMATES; k++)
                out[i * OBS_ESTIMATES + j] += half[i * OBS_ESTIMATES + k] * left[j * OBS_ESTIMATES + k];
            out[j * OBS_ESTIMATES + i] = out[i * OBS_ESTIMATES + j];
        }
}
"""
STATE = """\
typedef struct {
    double mean[OBS_MEAN], input[OBS_INPUTS + 1], time, sampled, covariance[OBS_SPREAD];
    unsigned long samples, gated;
    int started;
} obs_t;

"""
STEPPED = """
void obs_init(obs_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    memcpy(s->mean, start == NULL ? obs_origin : start, OBS_ESTIMATES * sizeof *s->mean);
    memcpy(s->covariance, obs_start, sizeof s->covariance);
}

int obs_predict(const obs_t *s, double t, double *estimate)
{
    double covariance[OBS_SPREAD];
    if (!isfinite(t) || !s->started || t < s->time)
        return 1;
    memcpy(estimate, s->mean, OBS_ESTIMATES * sizeof *estimate);
    return obs_ahead(s, t - s->time, estimate, covariance);
}

int obs_step(obs_t *s, double t, const double *u, const double *y, double *estimate)
{
    double x[OBS_ESTIMATES], covariance[OBS_SPREAD];
    if (!isfinite(t) || (s->started && t < s->time) || (s->samples > 0 && y != NULL && t <= s->sampled))
        return 1;
    if ((u != NULL && obs_bad(u, OBS_INPUTS, 0)) || (y == NULL ? u == NULL : obs_bad(y, OBS_MEASUREMENTS, OBS_GAPS)))
        return 1;
    memcpy(x, s->mean, sizeof x);
    memcpy(covariance, s->covariance, sizeof covariance);
    if (s->started && obs_ahead(s, t - s->time, x, covariance))
        return 1;
    if (y != NULL) {
        if (obs_correct(s, t, x, covariance, y))
            return 1;
        s->sampled = t;
        s->samples++;
    } else {
        memcpy(s->mean, x, sizeof x);
        memcpy(s->covariance, covariance, sizeof covariance);
    }
    if (u != NULL)
        memcpy(s->input, u, OBS_INPUTS * sizeof *u);
    /* Before the first sample nothing is known of the time at which the start of a filter of fixed gains holds. */
    if (y != NULL || OBS_GAPS || s->started) {
        s->time = t;
        s->started = 1;
    }
    memcpy(estimate, s->mean, OBS_ESTIMATES * sizeof *estimate);
    return 0;
}
"""
"""Around `obs_ahead`, which moves x and covariance by a time, and `obs_correct`, which takes a sample; 1: refused."""
AHEAD = """
typedef struct {
    double Phi[OBS_ESTIMATES * OBS_ESTIMATES], Gamma[OBS_ESTIMATES * OBS_DRIVES + 1], Q[OBS_ESTIMATES * OBS_ESTIMATES];
} obs_move;

static void obs_series(double *out, const double *table, int count, double h)
{
    int i, k;
    for (i = 0; i < count; i++)
        for (out[i] = 0.0, k = OBS_DEGREE; k >= 0; k--)
            out[i] = out[i] * h + table[k * count + i];
}

/* Over h: a power series over h / 2^j, doubled j times. */
static int obs_ahead(const obs_t *s, double h, double *x, double *covariance)
{
    double drive[OBS_DRIVES + 1] = {0};
    obs_move move, half;
    int doublings;
    for (doublings = 0; obs_rate[0] * h > obs_rate[1]; doublings++)
        h /= 2.0;
    obs_series(move.Phi, obs_phi, OBS_ESTIMATES * OBS_ESTIMATES, h);
    obs_series(move.Gamma, obs_gamma, OBS_ESTIMATES * OBS_DRIVES, h);
    obs_series(move.Q, obs_q, OBS_ESTIMATES * OBS_ESTIMATES, h);
    for (; doublings > 0; doublings--) {
        half = move;
        memset(move.Phi, 0, sizeof move.Phi);
        obs_add(move.Phi, half.Phi, half.Phi, OBS_ESTIMATES, OBS_ESTIMATES, OBS_ESTIMATES);
        obs_add(move.Gamma, half.Phi, half.Gamma, OBS_ESTIMATES, OBS_ESTIMATES, OBS_DRIVES);
        obs_turn(move.Q, half.Phi, half.Q);
    }
    memcpy(drive, s->input, OBS_INPUTS * sizeof *drive);
    memcpy(drive + OBS_INPUTS, s->mean + OBS_ESTIMATES, OBS_HELD * sizeof *drive);
    memset(x, 0, OBS_ESTIMATES * sizeof *x);
    obs_add(x, move.Phi, s->mean, OBS_ESTIMATES, OBS_ESTIMATES, 1);
    obs_add(x, move.Gamma, drive, OBS_ESTIMATES, OBS_DRIVES, 1);
    if (OBS_GAPS) {
        obs_turn(move.Q, move.Phi, s->covariance);
        memcpy(covariance, move.Q, OBS_SPREAD * sizeof *covariance);
    }
    return 0;
}
"""
FIXED = """\
/* By the gain of the period before, which also estimates the held disturbance. */
static int obs_correct(obs_t *s, double t, const double *x, const double *covariance, const double *y)
{
    double innovation[OBS_MEASUREMENTS] = {0};
    int cell = 0, i;
    while (cell < OBS_CELLS - 1 && (s->samples == 0 || t - s->sampled >= obs_edges[cell]))
        cell++;
    obs_add(innovation, obs_output, x, OBS_MEASUREMENTS, OBS_ESTIMATES, 1);
    for (i = 0; i < OBS_MEASUREMENTS; i++)
        innovation[i] = y[i] - innovation[i];
    memset(s->mean, 0, sizeof s->mean);
    memcpy(s->mean, x, OBS_ESTIMATES * sizeof *x);
    obs_add(s->mean, obs_gain + cell * OBS_MEAN * OBS_MEASUREMENTS, innovation, OBS_MEAN, OBS_MEASUREMENTS, 1);
    memcpy(s->covariance, covariance, sizeof s->covariance);
    return 0;
}
"""
WEIGHED = """\
/* By the gain that follows from the covariance, through a Cholesky factor of that of the innovations. */
static void obs_weigh(obs_t *s, const double *x, const double *covariance, const double *y, const double *expected,
    const double *output)
{
    double crossed[OBS_MEASUREMENTS][OBS_ESTIMATES] = {{0}}, root[OBS_MEASUREMENTS][OBS_MEASUREMENTS];
    double innovation[OBS_MEASUREMENTS] = {0};
    int seen[OBS_MEASUREMENTS], count = 0, i, j, k;
    for (i = 0; i < OBS_MEASUREMENTS; i++) {
        const double *row = output + i * OBS_ESTIMATES;
        double variance = obs_noise[i * OBS_MEASUREMENTS + i];
        if (isnan(y[i]))
            continue;
        memset(crossed[count], 0, sizeof crossed[count]);
        obs_add(crossed[count], row, covariance, 1, OBS_ESTIMATES, OBS_ESTIMATES);
        obs_add(&variance, crossed[count], row, 1, OBS_ESTIMATES, 1);
        if (obs_gate[0] > 0.0 && fabs(y[i] - expected[i]) > obs_gate[0] * sqrt(variance)) {
            s->gated++;
            continue;
        }
        innovation[count] = y[i] - expected[i];
        seen[count++] = i;
    }
    for (i = 0; i < count; i++) {
        for (j = 0; j <= i; j++) {
            root[i][j] = obs_noise[seen[i] * OBS_MEASUREMENTS + seen[j]];
            obs_add(&root[i][j], crossed[i], output + seen[j] * OBS_ESTIMATES, 1, OBS_ESTIMATES, 1);
        }
    }
    for (i = 0; i < count; i++) {
        for (j = 0; j <= i; j++) {
            for (k = 0; k < j; k++)
                root[i][j] -= root[i][k] * root[j][k];
            root[i][j] = i == j ? sqrt(root[i][j]) : root[i][j] / root[j][j];
        }
        for (k = 0; k <= i; k++) {
            innovation[i] = k < i ? innovation[i] - root[i][k] * innovation[k] : innovation[i] / root[i][i];
            for (j = 0; j < OBS_ESTIMATES; j++)
                crossed[i][j] = k < i ? crossed[i][j] - root[i][k] * crossed[k][j] : crossed[i][j] / root[i][i];
        }
    }
    memcpy(s->mean, x, OBS_ESTIMATES * sizeof *x);
    memcpy(s->covariance, covariance, sizeof s->covariance);
    for (k = 0; k < count; k++)
        for (i = 0; i < OBS_ESTIMATES; i++) {
            s->mean[i] += crossed[k][i] * innovation[k];
            for (j = 0; j < OBS_ESTIMATES; j++)
                s->covariance[i * OBS_ESTIMATES + j] -= crossed[k][i] * crossed[k][j];
        }
}
"""
RUNNING = """
static int obs_correct(obs_t *s, double t, const double *x, const double *covariance, const double *y)
{
    double expected[OBS_MEASUREMENTS] = {0};
    (void)t;
    obs_add(expected, obs_output, x, OBS_MEASUREMENTS, OBS_ESTIMATES, 1);
    obs_weigh(s, x, covariance, y, expected, obs_output);
    return 0;
}
"""


def c_form(
    name: str, comment: str, transition: Transition, output: Array, inputs: int, own: Mapping[str, Array]
) -> str:
    """The C99 source; `name` begins every name in it, `comment` stands at the top.

    output: C; inputs: how many of those of `transition` are known. own: "gain" and "edges", G of a filter by the
    period before; or "noise" and "start", R and P0 of a Kalman filter. Raises InvalidInputError if `name` is no C
    identifier.
    """
    n, drives, fixed = transition.order, transition.inputs, "gain" in own
    phi, gamma, q = np.split(transition.table, [n, n + drives], axis=2)
    tables = {"phi": phi, "gamma": gamma, "q": q, "rate": np.array([transition.rate, SHORT]), "output": output}
    tables |= {"start": np.zeros(1), "origin": np.zeros(n), **own}
    sizes = {"estimates": n, "inputs": inputs, "held": drives - inputs, "drives": drives, "mean": n + drives - inputs}
    sizes |= {"measurements": len(output), "degree": DEGREE, "gaps": int(not fixed)}
    # A filter of fixed gains keeps no covariance.
    sizes |= {"cells": len(own["gain"]) if fixed else 1, "spread": 1 if fixed else n * n}
    body = stepped(TURN + AHEAD, FIXED if fixed else WEIGHED + RUNNING)
    return c_file(name, comment, USAGE, body, sizes, tables)


def stepped(ahead: str, correct: str) -> str:
    """The whole body in C of an estimator with time stamps, from how it moves and how it takes a sample."""
    return STATE + ahead + correct + STEPPED
