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
