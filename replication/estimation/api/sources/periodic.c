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
