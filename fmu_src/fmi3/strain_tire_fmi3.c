/* StrainTire.fmu without Python: the functions of FMI 3.0 co-simulation. Test: test_native_fmi3.
 *
 * Same variables as in FMI 2, but strain, contact lengths and their standard deviations are arrays:
 * the value reference of an array is that of its first element in FMI 2, and its elements stand
 * behind one another, those of the last dimension next to each other. Behind them come a clock, the
 * event that a turn has ended, and the time. */
#include <stdlib.h>
#include <string.h>

#include "../slave/slave.h"
#include "fmi3.h"

typedef struct {
    Slave *slave;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int events; /* whether the importer handles them */
    int event_mode;
} Instance;

static void tell(const void *host, const char *name, const char *text, int warning) {
    const Instance *c = host;
    (void)name;
    if (c->log)
        c->log(c->environment, warning ? fmi3Warning : fmi3Error,
               warning ? "logStatusWarning" : "logStatusError", text);
}

static const Dialect FMI3 = {tell, "instantiationToken", "resourcePath", "Float64", "Int32"};

FMI3_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMI3_EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[],
    size_t n, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update) {
    Instance *c = calloc(1, sizeof *c);
    (void)visible, (void)logging, (void)early, (void)required, (void)n, (void)update;
    if (!c) return NULL;
    c->environment = environment;
    c->log = log;
    c->events = events;
    c->slave = slave_make(&FMI3, c, name, token, resources, NULL);
    if (c->slave && c->slave->model == &STRAIN_MODEL) return c;
    if (c->slave) slave_free(c->slave);
    free(c);
    return NULL;
}

/* Tell that this FMU is of another kind. */
static fmi3Instance other_kind(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    if (log)
        log(environment, fmi3Error, "logStatusError",
            "this FMU is for co-simulation; choose that in the importer");
    return NULL;
}

FMI3_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token,
                                                      fmi3String resources, fmi3Boolean visible,
                                                      fmi3Boolean logging,
                                                      fmi3InstanceEnvironment environment,
                                                      fmi3LogMessageCallback log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    return other_kind(environment, log);
}

FMI3_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    (void)update, (void)lock, (void)unlock;
    return other_kind(environment, log);
}

FMI3_EXPORT void fmi3FreeInstance(fmi3Instance instance) {
    Instance *c = instance;
    if (!c) return;
    slave_free(c->slave);
    free(c);
}

FMI3_EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n,
                                           const fmi3String categories[]) {
    (void)on, (void)n, (void)categories; /* errors are told whether logging is on or not */
    return c ? fmi3OK : fmi3Error;
}

FMI3_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean a,
                                                   fmi3Float64 tolerance, fmi3Float64 start,
                                                   fmi3Boolean b, fmi3Float64 stop) {
    Instance *c = instance;
    (void)a, (void)tolerance, (void)b, (void)stop;
    if (!c || slave_unstarted(c->slave)) return fmi3Error;
    c->slave->time = start;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    Instance *c = instance;
    if (!c || slave_start(c->slave)) return fmi3Error;
    c->event_mode = c->events;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3Terminate(fmi3Instance instance) {
    Instance *c = instance;
    return c && !slave_end(c->slave) ? fmi3OK : fmi3Error;
}

FMI3_EXPORT fmi3Status fmi3Reset(fmi3Instance instance) {
    Instance *c = instance;
    if (!c) return fmi3Error;
    slave_reset(c->slave);
    c->event_mode = 0;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 now, fmi3Float64 step,
                                  fmi3Boolean kept, fmi3Boolean *event, fmi3Boolean *end,
                                  fmi3Boolean *early, fmi3Float64 *reached) {
    Instance *c = instance;
    (void)kept;
    if (!c || !event || !end || !early || !reached) return fmi3Error;
    *event = *end = *early = false;
    *reached = now;
    if (c->event_mode)
        return (fmi3Status)slave_failed(c->slave, "a step in Event Mode; call enterStepMode first");
    if (slave_step(c->slave, step)) return fmi3Error;
    *reached = c->slave->time = now + step;
    if (c->events)
        *event = slave_turn(c->slave) != c->slave->announced;
    else
        c->slave->announced = slave_turn(c->slave);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    Instance *c = instance;
    if (!c) return fmi3Error;
    if (!c->events || c->slave->phase != STEPPING)
        return (fmi3Status)slave_failed(
            c->slave, "Event Mode; it is for initialised instances, instantiated with "
                      "eventModeUsed = true; read `turn` after each step instead");
    c->event_mode = 1;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    Instance *c = instance;
    if (!c) return fmi3Error;
    c->event_mode = 0;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return c ? fmi3OK : fmi3Error; }

FMI3_EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again,
                                                fmi3Boolean *end, fmi3Boolean *nominals,
                                                fmi3Boolean *values, fmi3Boolean *defined,
                                                fmi3Float64 *next) {
    Instance *c = instance;
    (void)next;
    if (!c || !again || !end || !nominals || !values || !defined) return fmi3Error;
    *again = *end = *nominals = *values = *defined = false;
    c->slave->announced = slave_turn(c->slave); /* the clock has ticked */
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                    fmi3Clock v[]) {
    Instance *c = instance;
    if (!c || !slave_given(c->slave, r, v, n)) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (r[i] != c->slave->count)
            return (fmi3Status)slave_failed(c->slave,
                                            "TypeError: value reference %u is no clock; "
                                            "that of turn_ended is %u",
                                            (unsigned)r[i], (unsigned)c->slave->count);
        v[i] = c->event_mode && slave_turn(c->slave) != c->slave->announced;
    }
    return fmi3OK;
}

/* How many values a reference has; 0 where no variable begins. */
static size_t span(const Slave *s, fmi3ValueReference r) {
    size_t frame = (size_t)(s->samples * s->gages), gages = (size_t)s->gages;
    size_t lengths = s->outputs + 2 * QUANTITIES;
    if (r == s->frame) return frame;
    if (r > s->frame && r < s->frame + frame) return 0;
    if (r == lengths || r == lengths + gages) return gages;
    return r > lengths && r < lengths + 2 * gages ? 0 : 1;
}

/* Whether references are of a type and have so many values together. */
static int allowed(Slave *s, const fmi3ValueReference r[], size_t n, const void *v, size_t values,
                   char kind, int set) {
    size_t sum = 0;
    if (!slave_given(s, r, v, n)) return 0;
    for (size_t i = 0; i < n; i++) {
        size_t own = r[i] < s->count ? span(s, r[i]) : 1;
        if (!own) {
            slave_failed(s,
                         "value reference = %u; this is an element of an array; use the "
                         "reference of the array",
                         (unsigned)r[i]);
            return 0;
        }
        if (!slave_allowed(s, r[i], kind, set)) return 0;
        sum += own;
    }
    if (sum != values)
        slave_failed(s, "nValues = %lu; these variables have %lu values", (unsigned long)values,
                     (unsigned long)sum);
    return sum == values;
}

FMI3_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      fmi3Float64 v[], size_t values) {
    Instance *c = instance;
    if (!c) return fmi3Error;
    Slave *s = c->slave;
    if (n == 1 && values == 1 && r && v && r[0] == s->count + 1) {
        v[0] = s->time;
        return fmi3OK;
    }
    if (!allowed(s, r, n, v, values, 'R', 0)) return fmi3Error;
    slave_foresee(s);
    for (size_t i = 0; i < n; v += span(s, r[i++]))
        memcpy(v, s->real + r[i], span(s, r[i]) * sizeof *v);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      const fmi3Float64 v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'R', 1)) return fmi3Error;
    for (size_t i = 0; i < n; v += span(c->slave, r[i++]))
        memcpy(c->slave->real + r[i], v, span(c->slave, r[i]) * sizeof *v);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                    fmi3Int32 v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'I', 0)) return fmi3Error;
    for (size_t i = 0; i < n; i++) v[i] = c->slave->whole[r[i]];
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetInt32(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                    const fmi3Int32 v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'I', 1)) return fmi3Error;
    for (size_t i = 0; i < n; i++) c->slave->whole[r[i]] = v[i];
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      fmi3Boolean v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'B', 0)) return fmi3Error;
    for (size_t i = 0; i < n; i++) v[i] = c->slave->whole[r[i]] != 0;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetBoolean(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      const fmi3Boolean v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'B', 1)) return fmi3Error;
    for (size_t i = 0; i < n; i++) c->slave->whole[r[i]] = v[i];
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetString(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     fmi3String v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'S', 0)) return fmi3Error;
    for (size_t i = 0; i < n; i++) v[i] = slave_text(c->slave, r[i]);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetString(fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     const fmi3String v[], size_t values) {
    Instance *c = instance;
    if (!c || !allowed(c->slave, r, n, v, values, 'S', 1)) return fmi3Error;
    for (size_t i = 0; i < n; i++)
        if (slave_set_text(c->slave, r[i], v[i])) return fmi3Error;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) {
    Instance *c = instance;
    SlaveState *kept = c && state ? slave_save(c->slave) : NULL;
    if (!kept) return fmi3Error;
    free(*state);
    *state = kept;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) {
    Instance *c = instance;
    if (!c || !state) return fmi3Error;
    c->event_mode = 0;
    return (fmi3Status)slave_restore(c->slave, state);
}

FMI3_EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    (void)c;
    if (!state) return fmi3OK;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *n) {
    if (!c || !state || !n) return fmi3Error;
    *n = ((SlaveState *)state)->n;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state,
                                             fmi3Byte b[], size_t n) {
    Instance *c = instance;
    const SlaveState *kept = state;
    if (!c || !kept || !b) return fmi3Error;
    if (n < kept->n)
        return (fmi3Status)slave_failed(c->slave, "the state needs %lu bytes",
                                        (unsigned long)kept->n);
    memcpy(b, kept->bytes, kept->n);
    return fmi3OK;
}

FMI3_EXPORT fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte b[], size_t n,
                                               fmi3FMUState *state) {
    Instance *c = instance;
    if (!c || !b || !state) return fmi3Error;
    SlaveState *kept = malloc(sizeof *kept + n);
    if (!kept)
        return (fmi3Status)slave_failed(c->slave, "MemoryError: %lu bytes", (unsigned long)n);
    kept->n = n;
    memcpy(kept->bytes, b, n);
    free(*state);
    *state = kept;
    return fmi3OK;
}
