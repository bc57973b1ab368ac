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
