/* A ring of past samples; nothing is allocated. */
typedef struct {
    double past[OBS_PAST][OBS_COLUMNS], state[OBS_ESTIMATES], rate[OBS_ESTIMATES], output[OBS_OUTPUTS];
    unsigned long instant, missed, newest;
} obs_t;

void obs_init(obs_t *s, const double *start)
{
    int j;
    memset(s, 0, sizeof *s);
    for (j = 0; start != NULL && j < OBS_PAST; j++)
        memcpy(s->past[j], start, sizeof s->state);
    if (start != NULL)
        memcpy(s->state, start, sizeof s->state);
}

void obs_estimate(const obs_t *s, double *estimate)
{
    memcpy(estimate, s->state, sizeof s->state);
}

void obs_output(const obs_t *s, double *output)
{
    memcpy(output, s->output, sizeof s->output);
}

int obs_step(obs_t *s, const double *u, const double *y, double *estimate)
{
    double known[OBS_ROWS] = {0}, target[OBS_UNKNOWNS], now[OBS_COLUMNS] = {0}, expected;
    const int moves = s->instant > 0;
    unsigned long k;
    int i;
    if (obs_bad(u, OBS_INPUTS, 0) || obs_bad(y, OBS_MEASUREMENTS, 1))
        return 1;
    for (k = 0; k < OBS_PAST; k++)
        obs_add(known, obs_taps + k * OBS_ROWS * OBS_COLUMNS, s->past[(s->newest + k) % OBS_PAST], OBS_ROWS,
                OBS_COLUMNS, 1);
    obs_add(known, obs_driven, u, OBS_ROWS, OBS_INPUTS, 1);
    for (i = 0; i < OBS_ESTIMATES; i++)
        target[i] = moves ? s->state[i] + obs_half[0] * (s->rate[i] + known[i]) : s->state[i];
    if (moves)
        obs_add(now, obs_free, target, OBS_ESTIMATES, OBS_ESTIMATES, 1);
    else
        memcpy(now, target, sizeof s->state);
    for (i = 0; i < OBS_MEASUREMENTS; i++) {
        expected = known[OBS_FIRST + i];
        obs_add(&expected, obs_now + (OBS_FIRST + i) * OBS_UNKNOWNS, now, 1, OBS_ESTIMATES, 1);
        s->missed += isnan(y[i]) ? 1u : 0u;
        target[OBS_ESTIMATES + i] = (isnan(y[i]) ? expected : y[i]) - (moves ? known[OBS_FIRST + i] : expected);
    }
    if (moves) {
        memset(now, 0, sizeof now);
        obs_add(now, obs_solve, target, OBS_UNKNOWNS, OBS_UNKNOWNS, 1);
    } else
        obs_add(now + OBS_ESTIMATES, obs_start, target + OBS_ESTIMATES, OBS_MEASUREMENTS, OBS_MEASUREMENTS, 1);
    for (i = 0; i < OBS_INPUTS; i++)
        now[OBS_UNKNOWNS + i] = u[i];
    obs_add(known, obs_now, now, OBS_ROWS, OBS_UNKNOWNS, 1);
    memcpy(s->state, now, sizeof s->state);
    memcpy(s->rate, known, sizeof s->rate);
    memcpy(s->output, known + OBS_ESTIMATES, sizeof s->output);
    s->newest = (s->newest + OBS_PAST - 1) % OBS_PAST;
    memcpy(s->past[s->newest], now, sizeof now);
    s->instant++;
    obs_estimate(s, estimate);
    return 0;
}
