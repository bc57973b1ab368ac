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
