static int obs_correct(obs_t *s, double t, const double *x, const double *covariance, const double *y)
{
    double expected[OBS_MEASUREMENTS] = {0};
    (void)t;
    obs_add(expected, obs_output, x, OBS_MEASUREMENTS, OBS_ESTIMATES, 1);
    obs_weigh(s, x, covariance, y, expected, obs_output);
    return 0;
}
