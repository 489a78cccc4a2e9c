/* The model of VirtualTire.fmu: parameters, the rolling tire, its outputs. Reference:
 * fmu_src/virtual_tire.py, tirelib.fmu.virtual.wheel */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

enum {
    V_RATE,
    V_RELAXATION,
    V_RELAXATION_KAPPA,
    V_NOISE,
    V_ANGLE,
    V_FAULT,
    V_SATURATION,
    V_DRIFT,
    V_DROPPED,
    V_DEAD,
    V_SEED,
    V_PARAMETERS
};

/* How many start values stand behind the surface: of parameters and inputs. */
static size_t starts(const Slave *s) { return V_PARAMETERS + (size_t)s->surface.inputs; }

static int place(Slave *s) {
    for (int inputs = 6; inputs <= MOST_INPUTS; inputs++) {
        size_t behind = V_PARAMETERS + (size_t)inputs;
        if (s->own.numbers > behind && s->own.remarks == MOST_INPUTS &&
            tire_surface_read(&s->surface, s->own.table, s->own.numbers - behind) &&
            s->surface.inputs == inputs) {
            s->gages = s->surface.gages;
            s->frame = V_PARAMETERS;
            s->conditions = V_PARAMETERS;
            s->outputs = starts(s);
            s->reals = (size_t)(s->samples * s->gages) + 9;
            s->count = s->outputs + s->reals + 4;
            s->tire = calloc(1, sizeof *s->tire);
            return s->tire != NULL;
        }
    }
    return 0;
}

/* Bring variables to their start values. */
static void first(Slave *s) {
    const double *start = s->own.table + s->own.numbers - starts(s);
    size_t frame = (size_t)(s->samples * s->gages);
    for (size_t i = 0; i < starts(s); i++) {
        if (i == V_DEAD || i == V_SEED)
            s->whole[i] = (int)start[i];
        else
            s->real[i] = start[i];
    }
    for (size_t i = 0; i < frame + 2; i++) s->real[s->outputs + i] = 0.0;
    for (size_t i = frame + 2; i < s->reals; i++) s->real[s->outputs + i] = NAN;
    memset(s->whole + s->outputs + s->reals, 0, 3 * sizeof *s->whole);
    strcpy(s->status, "not_started");
}

/* Whether a parameter is in its range; told if not and wished. Reference: faults.check */
static int within(Slave *s, const char *name, double x, double low, double high, int told) {
    if (low <= x && x <= high && !isinf(x)) return 1;
    if (told)
        slave_failed(s,
                     "ParameterError: %s = %g; allowed are finite numbers from %g to %g; set a "
                     "value in this range before the FMU is initialised",
                     name, x, low, high);
    return 0;
}

/* Take the parameters; whether all can be. */
static int taken(Slave *s, TireOptions *o, int told) {
    static const double PI = 3.14159265358979323846;
    const double *x = s->real;
    TireOptions found = {x[V_RATE],        {x[V_RELAXATION], x[V_RELAXATION_KAPPA]},
                         x[V_NOISE],       x[V_ANGLE],
                         x[V_FAULT],       x[V_SATURATION],
                         x[V_DRIFT],       x[V_DROPPED],
                         s->whole[V_DEAD], s->whole[V_SEED]};
    *o = found;
    if (!(within(s, "fault_start", o->fault_start, 0.0, INFINITY, told) &&
          within(s, "saturation", o->saturation, 0.0, 1.0, told) &&
          within(s, "drift", o->drift, -1.0, 1.0, told) &&
          within(s, "dropped_frames", o->dropped, 0.0, 1.0, told) &&
          within(s, "sample_rate", o->rate, 100.0, 1e5, told) &&
          within(s, "relaxation_length", o->relaxation[0], 0.0, 100.0, told) &&
          within(s, "relaxation_length_kappa", o->relaxation[1], 0.0, 100.0, told) &&
          within(s, "noise_std", o->noise, 0.0, 1.0, told) &&
          within(s, "seed", o->seed, 0.0, 2147483647.0, told) &&
          within(s, "start_angle", o->start_angle, -PI, PI, told)))
        return 0;
    if (o->dead_gage >= 0 && o->dead_gage <= s->gages) return 1;
    if (told)
        slave_failed(s,
                     "ParameterError: dead_gage = %d; allowed are 0 (none) to %d; set another "
                     "number before the FMU is initialised",
                     o->dead_gage, s->gages);
    return 0;
}

static int start(Slave *s) {
    TireOptions options;
    if (!taken(s, &options, 1)) return 0;
    rolling_start(s->tire, &s->surface, &options, s->samples, s->real + s->conditions);
    return 1;
}

/* Reference: VirtualWheel.outputs */
static void publish(Slave *s) {
    const RollingTire *w = s->tire;
    size_t frame = (size_t)(s->samples * s->gages);
    double *to = s->real + s->outputs;
    int *whole = s->whole + s->outputs + s->reals;
    memcpy(to, w->frame, frame * sizeof *to);
    to += frame;
    *to++ = w->omega;
    *to++ = w->angle;
    for (int i = 0; i < 2; i++) *to++ = w->settled_once ? w->slip[i] : NAN;
    for (int i = 0; i < OUT_FORCES; i++) *to++ = w->force[i];
    *to = w->radius;
    whole[0] = w->fresh;
    whole[1] = w->valid;
    whole[2] = w->omega != 0.0;
    strcpy(s->status, w->status);
}

/* Reference: GuardedSlave._foresee */
static void foresee(Slave *s) {
    TireOptions options;
    if (!taken(s, &options, 0)) {
        double kept[V_PARAMETERS + MOST_INPUTS];
        int whole[V_PARAMETERS];
        memcpy(kept, s->real, starts(s) * sizeof *kept);
        memcpy(whole, s->whole, sizeof whole);
        first(s);
        memcpy(s->real, kept, starts(s) * sizeof *kept);
        memcpy(s->whole, whole, sizeof whole);
        return;
    }
    rolling_start(s->tire, &s->surface, &options, s->samples, s->real + s->conditions);
    publish(s);
}

/* Tell which inputs are out of range. Reference: VirtualTire.advance */
static void tell_outside(Slave *s) {
    const double *given = s->real + s->conditions;
    int bits = rolling_outside(&s->surface, given);
    for (int i = 0; i < s->surface.inputs; i++) {
        Remark beyond = {1, 0, given[i], s->surface.low[i], s->surface.high[i]};
        if (bits & 1 << i) slave_remark(s, i, &beyond, "");
    }
}

static int step(Slave *s, double step) {
    double most = 0.0, rate = s->tire->options.rate, frame = s->samples / rate;
    switch (rolling_step(s->tire, &s->surface, step, s->real + s->conditions, &most)) {
    case TIRE_STEP_LENGTH:
        return slave_refuse(s, "communication step = %g s; allowed is above 0; step by %g s", step,
                            frame);
    case TIRE_STEP_SAMPLES:
        return slave_refuse(s,
                            "communication step = %g s brings %g samples at %g Hz; allowed are up "
                            "to %d, the frame's length; step by %g s",
                            step, most, rate, s->samples, frame);
    }
    tell_outside(s);
    return DONE;
}

static uint64_t hash_of(const RollingTire *w) {
    const unsigned char *byte = (const unsigned char *)w;
    uint64_t h = 14695981039346656037u;
    for (size_t i = 0; i < sizeof *w; i++) h = (h ^ byte[i]) * 1099511628211u;
    return h;
}

static size_t size(const Slave *s) {
    (void)s;
    return sizeof *s->tire + sizeof(uint64_t);
}

static void save(const Slave *s, unsigned char *bytes) {
    uint64_t hash = hash_of(s->tire);
    memcpy(bytes, s->tire, sizeof *s->tire);
    memcpy(bytes + sizeof *s->tire, &hash, sizeof hash);
}

static int restore(Slave *s, const unsigned char *bytes, size_t n) {
    uint64_t hash;
    if (n != size(s)) return 0;
    TireOptions options = s->tire->options;
    memcpy(s->tire, bytes, sizeof *s->tire);
    memcpy(&hash, bytes + sizeof *s->tire, sizeof hash);
    if (hash != hash_of(s->tire) || s->tire->samples != s->samples || s->tire->count < 0 ||
        s->tire->status[TIRE_STATUS - 1])
        return 0;
    s->tire->options = options;
    return 1;
}

const Model VIRTUAL_MODEL = {
    "VirtualTire.core", 1, 2, place, first, start, step, publish, foresee, size, save, restore};
