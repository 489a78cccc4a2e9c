/* StrainTire.fmu without Python: the functions of FMI 2.0 co-simulation. Test: test_native_fmu. */
#include <stdlib.h>
#include <string.h>

#include "../slave/slave.h"
#include "fmi2.h"

/* Give a text to the importer as a printf format that shows it as it is. */
static void tell(const void *functions, const char *name, const char *text, int warning) {
    const fmi2CallbackFunctions *host = functions;
    char format[2 * LINE + 1], *end = format;
    if (!host || !host->logger) return;
    for (const char *c = text; *c && c < text + LINE; c++) {
        if (*c == '%') *end++ = '%';
        *end++ = *c;
    }
    *end = 0;
    host->logger(host->environment, name, warning ? fmi2Warning : fmi2Error,
                 warning ? "logStatusWarning" : "logStatusError", format);
}

static const Dialect FMI2 = {tell, "fmuGUID", "fmuResourceLocation", "Real", "Integer"};

/* Whether there are values for references, which are of a type and can be got, or set. */
static int allowed(Slave *s, const fmi2ValueReference r[], const void *v, size_t n, char kind,
                   int set) {
    if (!slave_given(s, r, v, n)) return 0;
    for (size_t i = 0; i < n; i++)
        if (!slave_allowed(s, r[i], kind, set)) return 0;
    return 1;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                          fmi2String uri, const fmi2CallbackFunctions *functions,
                                          fmi2Boolean visible, fmi2Boolean logging) {
    (void)visible, (void)logging;
    return slave_make(&FMI2, functions, name, guid, uri,
                      type == fmi2CoSimulation ? NULL
                                               : "fmuType is model exchange; this FMU is for "
                                                 "co-simulation; choose that in the importer");
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) {
    if (c) slave_free(c);
}

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                           const fmi2String categories[]) {
    (void)on, (void)n, (void)categories; /* errors are told whether logging is on or not */
    return c ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real tolerance,
                                           fmi2Real start, fmi2Boolean b, fmi2Real stop) {
    (void)a, (void)tolerance, (void)start, (void)b, (void)stop;
    return c ? (fmi2Status)slave_unstarted(c) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return c ? (fmi2Status)slave_unstarted(c) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return c ? (fmi2Status)slave_start(c) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    return c ? (fmi2Status)slave_end(c) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    if (!c) return fmi2Error;
    slave_reset(c);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean kept) {
    (void)now, (void)kept;
    return c ? (fmi2Status)slave_step(c, step) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    (void)c;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                   fmi2Real v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, v, n, 'R', 0)) return fmi2Error;
    slave_foresee(s);
    for (size_t i = 0; i < n; i++) v[i] = s->real[r[i]];
    return fmi2OK;
}

static fmi2Status get_whole(Slave *s, const fmi2ValueReference r[], size_t n, int v[], char kind) {
    if (!s || !allowed(s, r, v, n, kind, 0)) return fmi2Error;
    slave_foresee(s);
    for (size_t i = 0; i < n; i++) v[i] = s->whole[r[i]];
    return fmi2OK;
}

static fmi2Status set_whole(Slave *s, const fmi2ValueReference r[], size_t n, const int v[],
                            char kind) {
    if (!s || !allowed(s, r, v, n, kind, 1)) return fmi2Error;
    for (size_t i = 0; i < n; i++) s->whole[r[i]] = kind == 'B' ? v[i] != 0 : v[i];
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                      fmi2Integer v[]) {
    return get_whole(c, r, n, v, 'I');
}

FMI2_EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                      fmi2Boolean v[]) {
    return get_whole(c, r, n, v, 'B');
}

FMI2_EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                     fmi2String v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, v, n, 'S', 0)) return fmi2Error;
    slave_foresee(s);
    for (size_t i = 0; i < n; i++) v[i] = slave_text(s, r[i]);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                   const fmi2Real v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, v, n, 'R', 1)) return fmi2Error;
    for (size_t i = 0; i < n; i++) s->real[r[i]] = v[i];
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                      const fmi2Integer v[]) {
    return set_whole(c, r, n, v, 'I');
}

FMI2_EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                      const fmi2Boolean v[]) {
    return set_whole(c, r, n, v, 'B');
}

FMI2_EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                     const fmi2String v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, v, n, 'S', 1)) return fmi2Error;
    for (size_t i = 0; i < n; i++)
        if (slave_set_text(s, r[i], v[i])) return fmi2Error;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    SlaveState *kept = c && state ? slave_save(c) : NULL;
    if (!kept) return fmi2Error;
    free(*state);
    *state = kept;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    return c && state ? (fmi2Status)slave_restore(c, state) : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    if (!state) return fmi2OK;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *n) {
    if (!c || !state || !n) return fmi2Error;
    *n = ((SlaveState *)state)->n;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte b[],
                                             size_t n) {
    const SlaveState *kept = state;
    if (!c || !kept || !b) return fmi2Error;
    if (n < kept->n)
        return (fmi2Status)slave_failed(c, "the state needs %lu bytes", (unsigned long)kept->n);
    memcpy(b, kept->bytes, kept->n);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n,
                                               fmi2FMUstate *state) {
    if (!c || !b || !state) return fmi2Error;
    SlaveState *kept = malloc(sizeof *kept + n);
    if (!kept) return (fmi2Status)slave_failed(c, "MemoryError: %lu bytes", (unsigned long)n);
    kept->n = n;
    memcpy(kept->bytes, b, n);
    free(*state);
    *state = kept;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[],
                                                    size_t m, const fmi2ValueReference r[],
                                                    size_t n, const fmi2Real d[], fmi2Real v[]) {
    (void)c, (void)u, (void)m, (void)r, (void)n, (void)d, (void)v;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[],
                                                   size_t n, const fmi2Integer o[],
                                                   const fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[],
                                                    size_t n, const fmi2Integer o[], fmi2Real v[]) {
    (void)c, (void)r, (void)n, (void)o, (void)v;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *v) {
    (void)c, (void)kind, (void)v;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *v) {
    (void)c, (void)kind, (void)v;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind,
                                            fmi2Integer *v) {
    (void)c, (void)kind, (void)v;
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind,
                                            fmi2Boolean *v) {
    if (!c || !v) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *v = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind,
                                           fmi2String *v) {
    (void)c, (void)kind, (void)v;
    return fmi2Discard;
}
