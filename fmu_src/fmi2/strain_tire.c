/* StrainTire.fmu without Python: FMI 2.0 co-simulation over the native core.
 *
 * Variables, refusals and texts are those of the Python FMU: tirelib.fmu.slave, tirelib.fmu.wheel,
 * fmu_src/strain_tire.py. Test: test_native_fmu. Memory is taken at the instantiation, for the
 * parameter `calibration` at the initialisation, and for states when they are asked for; never in a
 * step.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../core/state.h"
#include "fmi2.h"
#include "resources.h"

enum { PARAMETERS = 6, P_RATE = 0, P_ORDER, P_MISSING, P_AXES, P_CALIBRATION, P_TIRE };
enum { TEXT = 4096, LINE = 8192, CAUSES = 50 };
enum { INSTANTIATED, STEPPING, TERMINATED };

static const char *const AXES[] = {"iso", "sae", "adapted_sae"};
static const char *const ROLLING[] = {"unknown", "free", "braking", "driving"};
static const char *const FLAGS[] = {
    "first_turn", "gap", "bridged", "spike", "saturated", "dead_gage", "period_jump",
    "trigger_mismatch", "drift", "no_speed", "reversed", "out_of_range", "cut_off", "reduced_gages",
    "too_few_gages", "no_condition", "weak_edge", "no_contact", "fault", "accelerating",
    "other_tire"};
static const char *const NOTES[] = {
    "Fz_out_of_range", "alpha_out_of_range", "kappa_out_of_range", "Fy_out_of_range",
    "alpha_saturated", "condition_extrapolated", "camber_unknown", "friction_implausible",
    "tread_depth_implausible", "tread_temperature_implausible"};

typedef struct {
    const fmi2CallbackFunctions *host;
    char *name, *folder;
    Resources own, other; /* `other`: the parameter `calibration` */
    Calibration *calibration;
    Wheel *wheel;
    void *memory; /* of the wheel */
    size_t size;  /* of that memory */
    int gages, samples, buffered, phase, refused;
    size_t frame, conditions, outputs, reals, count; /* places; how many variables */
    double *real;
    int *whole; /* Integers and Booleans */
    char text[PARAMETERS][TEXT];
    char rolling[16], status[LINE], cause[LINE];
    uint64_t told[CAUSES];
    unsigned times[CAUSES], causes;
} Slave;

/* A state: variables and parameters, then the wheel's. */
typedef struct {
    size_t n;
    unsigned char bytes[];
} State;

/* Give a text to the importer as a printf format that shows it as it is. */
static void tell(const Slave *s, const char *text) {
    char format[2 * LINE + 1], *end = format;
    if (!s->host || !s->host->logger) return;
    for (const char *c = text; *c && c < text + LINE; c++) {
        if (*c == '%') *end++ = '%';
        *end++ = *c;
    }
    *end = 0;
    s->host->logger(s->host->environment, s->name, fmi2Error, "logStatusError", format);
}

static int power_of_ten(unsigned n) {
    while (n % 10 == 0) n /= 10;
    return n == 1;
}

/* Tell an error when it is new, and at its 10th, 100th .. time. Reference: tirelib.fmu.journal */
static void complain(Slave *s, const char *cause) {
    uint64_t h = 14695981039346656037u;
    unsigned i = 0;
    char line[LINE + 64];
    for (const char *c = cause; *c; c++) h = (h ^ (unsigned char)*c) * 1099511628211u;
    while (i < s->causes && i < CAUSES && s->told[i] != h) i++;
    if (i == CAUSES) {
        if (s->causes++ == CAUSES)
            tell(s, "50 different causes were reported; further causes are not reported until a "
                    "reset");
        if (s->causes > CAUSES + 1) s->causes = CAUSES + 1;
        return;
    }
    if (i == s->causes) {
        s->told[i] = h;
        s->times[i] = 1;
        s->causes++;
        tell(s, cause);
    } else if (power_of_ten(++s->times[i])) {
        snprintf(line, sizeof line, "%s (%u times by now)", cause, s->times[i]);
        tell(s, line);
    }
}

/* Log a cause and answer with an error. */
static fmi2Status failed(Slave *s, const char *format, ...) {
    char cause[LINE];
    va_list given;
    va_start(given, format);
    vsnprintf(cause, sizeof cause, format, given);
    va_end(given);
    complain(s, cause);
    return fmi2Error;
}

static const char *name_of(const Slave *s, size_t i) { return s->own.variable[i] + 2; }
static char kind_of(const Slave *s, size_t i) { return s->own.variable[i][0]; }
static char causality_of(const Slave *s, size_t i) { return s->own.variable[i][1]; }

/* Whether references are of a type, and, to be set, not of an output or a fixed parameter. */
static int allowed(Slave *s, const fmi2ValueReference r[], size_t n, char kind, int set) {
    const char *type = kind == 'R'   ? "Real"
                       : kind == 'I' ? "Integer"
                       : kind == 'B' ? "Boolean"
                                     : "String";
    for (size_t i = 0; i < n; i++) {
        if (r[i] >= s->count) {
            failed(s, "value reference = %u; allowed are 0 .. %u", r[i], (unsigned)s->count - 1);
            return 0;
        }
        if (kind_of(s, r[i]) != kind) {
            failed(s, "TypeError: %s is not of type %s", name_of(s, r[i]), type);
            return 0;
        }
        char causality = causality_of(s, r[i]);
        if (set && (causality == 'o' || (causality == 'p' && s->phase != INSTANTIATED))) {
            failed(s,
                   "ParameterError: %s: cannot be set now; inputs can be set at any time, "
                   "parameters before initialisation only, outputs never",
                   name_of(s, r[i]));
            return 0;
        }
    }
    return 1;
}

/* Add a word to the status, by semicolons. */
static void add(Slave *s, const char *word) {
    size_t n = strlen(s->status);
    snprintf(s->status + n, sizeof s->status - n, "%s%s", n ? ";" : "", word);
}

/* Add a word with a cause, without the semicolon that parts words. Reference: status_entry */
static void add_cause(Slave *s, const char *word) {
    char line[LINE];
    snprintf(line, sizeof line, "%.32s: %.*s", word, LINE - 64, s->cause);
    for (char *c = line; *c; c++)
        if (*c == ';') *c = ',';
    add(s, line);
}

/* Write the outputs. Reference: GuardedSlave.publish, StrainTire.shown */
static void publish(Slave *s) {
    Outputs out;
    double *to = s->real + s->outputs, missing = s->real[P_MISSING];
    int *whole = s->whole + s->outputs + s->reals, fault;
    wheel_outputs(s->wheel, &out);
    fault = (out.flags & FAULT) != 0;
    for (int q = 0; q < QUANTITIES; q++) *to++ = out.value[q];
    for (int q = 0; q < QUANTITIES; q++) *to++ = out.std[q];
    for (int g = 0; g < s->gages; g++) *to++ = out.contact_length[g];
    for (int g = 0; g < s->gages; g++) *to++ = out.contact_length_std[g];
    *to++ = out.rolling_radius;
    *to++ = out.turn_rate;
    *to++ = out.contact_time;
    *to++ = out.age;
    for (double *x = s->real + s->outputs; x < to; x++)
        if (isnan(*x)) *x = missing;
    *whole++ = (int)out.turn;
    *whole++ = out.flags;
    *whole++ = out.valid;
    for (int q = 0; q < QUANTITIES; q++) *whole++ = out.valid_of[q];
    snprintf(s->rolling, sizeof s->rolling, "%s", ROLLING[out.rolling]);
    s->status[0] = 0;
    for (size_t i = 0; i < sizeof FLAGS / sizeof *FLAGS; i++)
        if (out.flags & (1 << i) && !(fault && 1 << i == FAULT)) add(s, FLAGS[i]);
    for (size_t i = 0; i < sizeof NOTES / sizeof *NOTES; i++)
        if (out.notes & (1 << i)) add(s, NOTES[i]);
    if (fault) add_cause(s, "fault");
    s->refused = 0;
}

/* What outputs show before the start: what a start would show. Reference: GuardedSlave._foresee */
static void foresee(Slave *s) {
    if (s->phase != INSTANTIATED || s->refused || s->wheel) return;
    for (size_t i = 0; i < s->reals; i++) s->real[s->outputs + i] = s->real[P_MISSING];
}

/* Bring all variables to their start values. */
static void start_values(Slave *s) {
    for (size_t i = 0; i < s->count; i++) {
        s->real[i] = NAN;
        s->whole[i] = 0;
    }
    for (size_t i = s->frame; i < s->conditions; i++) s->real[i] = 0.0;
    memset(s->text, 0, sizeof s->text);
    strcpy(s->text[P_AXES], "iso");
    s->real[P_RATE] = s->own.rate;
    s->real[P_ORDER] = 0.0;
    s->real[P_MISSING] = s->own.missing;
    s->whole[s->conditions + HELD] = 1; /* frame_valid */
    s->whole[s->outputs + s->reals + 1] = FIRST_TURN;
    strcpy(s->rolling, "unknown");
    strcpy(s->status, "first_turn");
    s->phase = INSTANTIATED;
    s->refused = 0;
    s->causes = 0;
    s->wheel = NULL;
}

/* Write where gages lie. Reference: tirelib.estimators.calibration._millimetres */
static const char *millimetres(const double *lateral, int gages, char text[GAGES * 16]) {
    text[0] = 0;
    for (int g = 0; g < gages; g++) {
        size_t n = strlen(text);
        snprintf(text + n, GAGES * 16 - n, "%s%+g", g ? ", " : "", 1e3 * lateral[g]);
    }
    return text;
}

/* Take up another calibration; tells what is wrong with it. Reference: load_wheel */
static int override(Slave *s) {
    const char *path = s->text[P_CALIBRATION];
    Calibration *known = malloc(sizeof *known);
    double lateral[GAGES];
    char here[GAGES * 16], there[GAGES * 16];
    int gages = s->calibration->gages, same;
    resources_free(&s->other);
    const char *wrong = known ? resources_read(&s->other, path) : "needs more memory";
    if (!wrong && calibration_read(known, s->other.table, s->other.numbers)) wrong = "is damaged";
    if (wrong) {
        free(known);
        failed(s, "FormatError: %s: %s; give a file made by `tirelib fmu table`", path, wrong);
        return 0;
    }
    memcpy(lateral, s->calibration->lateral, sizeof lateral);
    same = known->gages == gages;
    for (int g = 0; g < gages && same; g++) same = fabs(known->lateral[g] - lateral[g]) <= 1e-4;
    memcpy(s->calibration, known, sizeof *known);
    free(known);
    if (!same)
        failed(s, "CalibrationError: StrainTire.fmu: %s: gages lie at %s mm (ISO), the calibration "
                  "has them at %s mm; calibrate with this layout",
               path, millimetres(lateral, gages, here),
               millimetres(s->calibration->lateral, s->calibration->gages, there));
    return same;
}

/* Start a wheel with the parameters as they are now. Reference: StrainTire.started */
static int started(Slave *s) {
    const char *path = s->text[P_CALIBRATION], *tire = s->text[P_TIRE], *known;
    double rate = s->real[P_RATE], order = s->real[P_ORDER];
    int axes = 0;
    if (isinf(s->real[P_MISSING]))
        return failed(s, "ParameterError: missing = %g; allowed are NaN and finite numbers; set "
                         "what Real outputs show where there is no value", s->real[P_MISSING]), 0;
    calibration_read(s->calibration, s->own.table, s->own.numbers);
    if (path[0] && !override(s)) return 0;
    known = path[0] ? s->other.tire : s->own.tire;
    if (strcmp(tire[0] ? tire : s->own.tire, known))
        return failed(s, "CalibrationError: StrainTire.fmu: %s: the tire is '%s', the calibration "
                         "is of '%s'; calibrate on a campaign of this tire",
                      path[0] ? path : "the embedded calibration", tire[0] ? tire : s->own.tire,
                      known), 0;
    if (order != 0.0 && !(fabs(order - s->calibration->order) <= 1e-6 * fabs(order)))
        return failed(s, "ParameterError: filter_order = %g; the calibration was made with %g "
                         "cycles per turn, another low-pass would bias it; set 0, or calibrate "
                         "anew with `tirelib calibrate --order`", order, s->calibration->order), 0;
    while (axes < 3 && strcmp(AXES[axes], s->text[P_AXES])) axes++;
    if (axes == 3)
        return failed(s, "ParameterError: axes = '%s'; allowed are adapted_sae, iso, sae; name "
                         "the axis system of the data", s->text[P_AXES]), 0;
    size_t size = wheel_size(s->calibration, rate);
    if (!size)
        return failed(s, "ParameterError: sample rate = %g Hz; allowed are 100 .. 100000 Hz; give "
                         "the rate of the gages", rate), 0;
    if (size > s->size) {
        free(s->memory);
        s->memory = malloc(size);
        s->size = s->memory ? size : 0;
        if (!s->memory) return failed(s, "MemoryError: %lu bytes", (unsigned long)size), 0;
    }
    s->wheel = wheel_start(s->memory, s->calibration, rate, s->samples, axes);
    if (!s->wheel) {
        char lateral[GAGES * 16];
        failed(s, "ParameterError: axes = '%s': gages at %s mm (ISO) have no mirror image; use "
                  "axes = 'iso' with this layout", s->text[P_AXES],
               millimetres(s->calibration->lateral, s->gages, lateral));
    }
    return s->wheel != NULL;
}

/* Let nothing be valid until a step is done. Reference: GuardedSlave._refuse */
static fmi2Status refuse(Slave *s, const char *format, ...) {
    va_list given;
    va_start(given, format);
    vsnprintf(s->cause, sizeof s->cause, format, given);
    va_end(given);
    s->refused = 1;
    for (int i = 2; i < 3 + QUANTITIES; i++) s->whole[s->outputs + s->reals + i] = 0;
    s->status[0] = 0;
    add_cause(s, "step_refused");
    return failed(s, "%s", s->cause);
}

static void release(Slave *s) {
    resources_free(&s->own);
    resources_free(&s->other);
    free(s->calibration);
    free(s->memory);
    free(s->real);
    free(s->whole);
    free(s->name);
    free(s->folder);
    free(s);
}

static fmi2Component refused(Slave *s, const char *format, ...) {
    char cause[LINE];
    va_list given;
    va_start(given, format);
    vsnprintf(cause, sizeof cause, format, given);
    va_end(given);
    tell(s, cause);
    release(s);
    return NULL;
}

/* Where the variables stand; whether there are as many as the calibration asks for. */
static int placed(Slave *s) {
    s->gages = s->calibration->gages;
    s->samples = (int)s->own.samples;
    s->buffered = s->own.buffered != 0.0;
    s->frame = PARAMETERS;
    s->conditions = s->frame + (size_t)(s->samples * s->gages);
    s->outputs = s->conditions + HELD + 1 + (size_t)s->buffered;
    s->reals = 2 * QUANTITIES + 2 * (size_t)s->gages + 4;
    s->count = s->outputs + s->reals + 2 + 1 + QUANTITIES + 2;
    s->real = calloc(s->count, sizeof *s->real);
    s->whole = calloc(s->count, sizeof *s->whole);
    return s->own.variables == s->count && s->real && s->whole;
}

FMI2_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMI2_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                                          fmi2String uri, const fmi2CallbackFunctions *functions,
                                          fmi2Boolean visible, fmi2Boolean logging) {
    Slave *s = calloc(1, sizeof *s);
    size_t n = uri ? strlen(uri) : 0;
    (void)visible, (void)logging;
    if (!s) return NULL;
    s->host = functions;
    s->name = calloc(1, name ? strlen(name) + 1 : 1);
    s->folder = malloc(n + 32);
    s->calibration = malloc(sizeof *s->calibration);
    if (!s->name || !s->folder || !s->calibration) return refused(s, "there is no memory left");
    if (name) strcpy(s->name, name);
    if (type != fmi2CoSimulation)
        return refused(s, "fmuType is model exchange; this FMU is for co-simulation; choose that "
                          "in the importer");
    if (!uri)
        return refused(s, "fmuResourceLocation is missing; the URI of the unpacked folder "
                          "resources is needed");
    path_of(uri, s->folder);
    strcat(s->folder, "/StrainTire.core");
    const char *wrong = resources_read(&s->own, s->folder);
    if (!wrong && calibration_read(s->calibration, s->own.table, s->own.numbers))
        wrong = "is damaged";
    if (!wrong && (!(s->own.samples >= 1.0 && s->own.samples <= 256.0) || !placed(s)))
        wrong = "does not fit the calibration";
    if (wrong)
        return refused(s, "fmuResourceLocation = %s: StrainTire.core %s; unpack the whole FMU and "
                          "give the URI of its folder resources", uri, wrong);
    if (!guid || strcmp(guid, s->own.guid))
        return refused(s, "fmuGUID = %s; that of this FMU is %s; model description and binary come "
                          "from different builds; unpack the FMU anew",
                       guid ? guid : "missing", s->own.guid);
    start_values(s);
    return s;
}

FMI2_EXPORT void fmi2FreeInstance(fmi2Component c) {
    if (c) release(c);
}

FMI2_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                           const fmi2String categories[]) {
    (void)on, (void)n, (void)categories; /* errors are told whether logging is on or not */
    return c ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real tolerance,
                                           fmi2Real start, fmi2Boolean b, fmi2Real stop) {
    (void)a, (void)tolerance, (void)start, (void)b, (void)stop;
    return c ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return c ? fmi2OK : fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Slave *s = c;
    if (!s || !started(s)) return fmi2Error;
    s->phase = STEPPING;
    publish(s);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Terminate(fmi2Component c) {
    Slave *s = c;
    if (!s) return fmi2Error;
    s->phase = TERMINATED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    if (!c) return fmi2Error;
    start_values(c);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean kept) {
    Slave *s = c;
    (void)now, (void)kept;
    if (!s) return fmi2Error;
    if (s->phase == INSTANTIATED)
        return refuse(s, "the FMU is not initialised; call exitInitializationMode first");
    if (s->phase == TERMINATED)
        return refuse(s, "the FMU is terminated; reset it and initialise it again");
    double rate = s->wheel->rate, frame = s->samples / rate;
    int count = s->buffered ? s->whole[s->conditions + HELD + 1] : -1;
    int valid = s->whole[s->conditions + HELD];
    if (s->buffered && (count < 0 || count > s->samples) && step > 0.0 && step <= 3.0)
        return refuse(s, "samples = %d; allowed are 0 .. %d, the frame's length; set how many "
                         "samples of the frame are new", count, s->samples);
    int done = wheel_step(s->wheel, s->real + s->frame, step, valid, s->real + s->conditions,
                          count < -1 ? -2 : count);
    if (done == STEP_NOT_WHOLE)
        return refuse(s, "communication step = %g s is %g samples at %g Hz; a whole number of "
                         "samples is needed; step by %g s", step, step * rate, rate, frame);
    if (done == STEP_LENGTH || done == STEP_SAMPLES)
        return refuse(s, "communication step = %g s; allowed is above 0 and up to 3 s, the longest "
                         "turn; step by %g s", step, frame);
    if (done == WHEEL_FAULT) {
        snprintf(s->cause, sizeof s->cause, "%s",
                 "ParameterError: the low-pass would reach beyond the samples of the turn");
        complain(s, s->cause);
    }
    publish(s);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    (void)c;
    return fmi2Error;
}

FMI2_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                   fmi2Real v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, n, 'R', 0)) return fmi2Error;
    foresee(s);
    for (size_t i = 0; i < n; i++) v[i] = s->real[r[i]];
    return fmi2OK;
}

static fmi2Status get_whole(Slave *s, const fmi2ValueReference r[], size_t n, int v[], char kind) {
    if (!s || !allowed(s, r, n, kind, 0)) return fmi2Error;
    for (size_t i = 0; i < n; i++) v[i] = s->whole[r[i]];
    return fmi2OK;
}

static fmi2Status set_whole(Slave *s, const fmi2ValueReference r[], size_t n, const int v[],
                            char kind) {
    if (!s || !allowed(s, r, n, kind, 1)) return fmi2Error;
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
    if (!s || !allowed(s, r, n, 'S', 0)) return fmi2Error;
    for (size_t i = 0; i < n; i++)
        v[i] = r[i] < PARAMETERS ? s->text[r[i]] : r[i] == s->count - 1 ? s->status : s->rolling;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                   const fmi2Real v[]) {
    Slave *s = c;
    if (!s || !allowed(s, r, n, 'R', 1)) return fmi2Error;
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
    if (!s || !allowed(s, r, n, 'S', 1)) return fmi2Error;
    for (size_t i = 0; i < n; i++)
        if (!v[i] || strlen(v[i]) >= TEXT)
            return failed(s, "ParameterError: %s: a text of up to %d bytes is needed",
                          name_of(s, r[i]), TEXT - 1);
    for (size_t i = 0; i < n; i++) strcpy(s->text[r[i]], v[i]);
    return fmi2OK;
}

/* How many bytes variables and parameters need in a state. */
static size_t own_size(const Slave *s) {
    return s->count * (sizeof *s->real + sizeof *s->whole) + sizeof s->text + sizeof s->rolling +
           sizeof s->status + sizeof s->cause + 3 * sizeof(int);
}

/* Copy variables and parameters into a state, or back out of it. */
static void exchange(Slave *s, unsigned char *bytes, int *with_wheel, int back) {
    struct {
        void *own;
        size_t n;
    } part[] = {{s->real, s->count * sizeof *s->real}, {s->whole, s->count * sizeof *s->whole},
                {s->text, sizeof s->text},             {s->rolling, sizeof s->rolling},
                {s->status, sizeof s->status},         {s->cause, sizeof s->cause},
                {&s->phase, sizeof s->phase},          {&s->refused, sizeof s->refused},
                {with_wheel, sizeof *with_wheel}};
    for (size_t i = 0; i < sizeof part / sizeof *part; i++) {
        memcpy(back ? part[i].own : (void *)bytes, back ? (void *)bytes : part[i].own, part[i].n);
        bytes += part[i].n;
    }
}

FMI2_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Slave *s = c;
    if (!s || !state) return fmi2Error;
    int with_wheel = s->wheel != NULL;
    size_t n = own_size(s) + (with_wheel ? state_size(s->wheel) : 0);
    State *kept = malloc(sizeof *kept + n);
    if (!kept) return failed(s, "MemoryError: %lu bytes", (unsigned long)n);
    kept->n = n;
    exchange(s, kept->bytes, &with_wheel, 0);
    if (with_wheel) state_save(s->wheel, kept->bytes + own_size(s));
    free(*state);
    *state = kept;
    return fmi2OK;
}

static const char NO_STATE[] =
    "FormatError: the bytes are not a saved state of this FMU; save the state again";

FMI2_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    Slave *s = c;
    State *kept = state;
    int with_wheel = 0;
    if (!s || !kept) return fmi2Error;
    if (kept->n < own_size(s)) return failed(s, NO_STATE);
    exchange(s, kept->bytes, &with_wheel, 1);
    for (int i = 0; i < PARAMETERS; i++) s->text[i][TEXT - 1] = 0;
    s->rolling[sizeof s->rolling - 1] = s->status[LINE - 1] = s->cause[LINE - 1] = 0;
    s->wheel = NULL;
    if (!with_wheel) {
        s->phase = INSTANTIATED;
        return fmi2OK;
    }
    int phase = s->phase;
    s->phase = INSTANTIATED;
    if (!started(s)) return fmi2Error;
    if (!state_restore(s->wheel, kept->bytes + own_size(s), kept->n - own_size(s))) {
        s->wheel = NULL;
        return failed(s, NO_STATE);
    }
    s->phase = phase == TERMINATED ? TERMINATED : STEPPING;
    return fmi2OK;
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
    *n = ((State *)state)->n;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte b[],
                                             size_t n) {
    const State *kept = state;
    if (!c || !kept) return fmi2Error;
    if (n < kept->n) return failed(c, "the state needs %lu bytes", (unsigned long)kept->n);
    memcpy(b, kept->bytes, kept->n);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n,
                                               fmi2FMUstate *state) {
    if (!c || !b || !state) return fmi2Error;
    State *kept = malloc(sizeof *kept + n);
    if (!kept) return failed(c, "MemoryError: %lu bytes", (unsigned long)n);
    kept->n = n;
    memcpy(kept->bytes, b, n);
    free(*state);
    *state = kept;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[],
                                                    size_t m, const fmi2ValueReference r[], size_t n,
                                                    const fmi2Real d[], fmi2Real v[]) {
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
    if (!c) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *v = 0;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind,
                                           fmi2String *v) {
    (void)c, (void)kind, (void)v;
    return fmi2Discard;
}

#ifndef SOURCE
#define SOURCE "unknown"
#endif
/* The hash of all sources, so that a test can tell whether a binary was made from them. */
FMI2_EXPORT const char tirelib_core_source[] = "source sha256 " SOURCE;
