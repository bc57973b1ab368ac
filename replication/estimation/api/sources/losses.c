typedef struct {
    double state[OBS_ORDER];
    unsigned long missed, unforeseen, unscheduled;
    int node;
} obs_t;

void obs_init(obs_t *s, const double *start)
{
    memset(s, 0, sizeof *s);
    if (start != NULL)
        memcpy(s->state, start, OBS_ESTIMATES * sizeof *start);
}

/* The node that knows of as many losses as it can, where there were more than were foreseen. */
static int obs_after(int node, int number, const unsigned char *came)
{
    const int target = obs_target[number];
    int memory[OBS_CHANNELS], i, c, other;
    memcpy(memory, obs_memory + target * OBS_CHANNELS, sizeof memory);
    for (i = 0; i < OBS_MEASUREMENTS; i++)
        if (obs_arrived[number * OBS_MEASUREMENTS + i] && !came[i]) {
            c = OBS_CHANNELS == 1 ? 0 : i;
            memory[c] = obs_memory[node * OBS_CHANNELS + c];
        }
    for (other = 0; other < OBS_NODES; other++)
        if (obs_phase[other] == obs_phase[target]
            && memcmp(obs_memory + other * OBS_CHANNELS, memory, sizeof memory) == 0)
            return other;
    return target;
}

int obs_step(obs_t *s, const double *u, const double *y, double *estimate)
{
    double innovation[OBS_MEASUREMENTS] = {0}, next[OBS_ORDER] = {0};
    unsigned char came[OBS_MEASUREMENTS];
    const unsigned char *due = obs_due + obs_phase[s->node] * OBS_MEASUREMENTS;
    int i, number, unlike, best = 0, least = OBS_MEASUREMENTS + 1;
    if (obs_bad(u, OBS_INPUTS, 0) || obs_bad(y, OBS_MEASUREMENTS, 1))
        return 1;
    for (i = 0; i < OBS_MEASUREMENTS; i++) {
        came[i] = due[i] && !isnan(y[i]);
        s->missed += due[i] && isnan(y[i]) ? 1u : 0u;
        s->unscheduled += !due[i] && !isnan(y[i]) ? 1u : 0u;
        if (came[i]) {
            obs_add(innovation + i, obs_output + i * OBS_ORDER, s->state, 1, OBS_ORDER, 1);
            obs_add(innovation + i, obs_direct + i * OBS_INPUTS, u, 1, OBS_INPUTS, 1);
            innovation[i] = y[i] - innovation[i];
        }
    }
    for (number = obs_first[s->node]; number < obs_first[s->node + 1]; number++) {
        for (unlike = i = 0; i < OBS_MEASUREMENTS; i++)
            unlike += came[i] != obs_arrived[number * OBS_MEASUREMENTS + i];
        if (unlike < least) {
            least = unlike;
            best = number;
        }
    }
    obs_add(next, obs_transition, s->state, OBS_ORDER, OBS_ORDER, 1);
    obs_add(next, obs_input, u, OBS_ORDER, OBS_INPUTS, 1);
    obs_add(next, obs_gain + best * OBS_ORDER * OBS_MEASUREMENTS, innovation, OBS_ORDER, OBS_MEASUREMENTS, 1);
    memcpy(s->state, next, sizeof next);
    s->unforeseen += least > 0 ? 1u : 0u;
    s->node = least > 0 ? obs_after(s->node, best, came) : obs_target[best];
    memcpy(estimate, s->state, OBS_ESTIMATES * sizeof *estimate);
    return 0;
}
