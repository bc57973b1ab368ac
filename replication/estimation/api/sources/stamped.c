typedef struct {
    double mean[OBS_MEAN], input[OBS_INPUTS + 1], time, sampled, covariance[OBS_SPREAD];
    unsigned long samples, gated;
    int started;
} obs_t;

/* Moves x and covariance over h; takes a sample y at t. Both return 1 for what they refuse. */
static int obs_ahead(const obs_t *s, double h, double *x, double *covariance);
static int obs_correct(obs_t *s, double t, const double *x, const double *covariance, const double *y);

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
