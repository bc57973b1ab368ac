void obs_f(const double *x, const double *u, double d, double *next, double *jacobian);
void obs_h(const double *x, double *y, double *jacobian);

/* f at the estimate, and F (P + Q d/2) F' + Q d/2. */
static int obs_ahead(const obs_t *s, double d, double *x, double *covariance)
{
    double jacobian[OBS_ESTIMATES * OBS_ESTIMATES], spread[OBS_ESTIMATES * OBS_ESTIMATES];
    int i;
    if (d <= 0.0)
        return 0;
    obs_f(s->mean, s->input, d, x, jacobian);
    if (obs_bad(x, OBS_ESTIMATES, 0) || obs_bad(jacobian, OBS_ESTIMATES * OBS_ESTIMATES, 0))
        return 1;
    for (i = 0; i < OBS_ESTIMATES * OBS_ESTIMATES; i++) {
        covariance[i] = obs_q[i] * d / 2.0;
        spread[i] = s->covariance[i] + covariance[i];
    }
    obs_turn(covariance, jacobian, spread);
    return 0;
}

static int obs_correct(obs_t *s, double t, const double *x, const double *covariance, const double *y)
{
    double expected[OBS_MEASUREMENTS], jacobian[OBS_MEASUREMENTS * OBS_ESTIMATES];
    (void)t;
    obs_h(x, expected, jacobian);
    if (obs_bad(expected, OBS_MEASUREMENTS, 0) || obs_bad(jacobian, OBS_MEASUREMENTS * OBS_ESTIMATES, 0))
        return 1;
    obs_weigh(s, x, covariance, y, expected, jacobian);
    return 0;
}
