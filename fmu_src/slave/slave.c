#include "slave.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

static const char *name_of(const Slave *s, size_t i) { return s->own.variable[i] + 2; }
static char kind_of(const Slave *s, size_t i) { return s->own.variable[i][0]; }
static char causality_of(const Slave *s, size_t i) { return s->own.variable[i][1]; }

int slave_allowed(Slave *s, unsigned r, char kind, int set) {
    const char *type = kind == 'R'   ? s->dialect->real
                       : kind == 'I' ? s->dialect->integer
                       : kind == 'B' ? "Boolean"
                                     : "String";
    if (r >= s->count) {
        slave_failed(s, "value reference = %u; allowed are 0 .. %u", r, (unsigned)s->count - 1);
        return 0;
    }
    if (kind_of(s, r) != kind) {
        slave_failed(s, "TypeError: %s is not of type %s", name_of(s, r), type);
        return 0;
    }
    char causality = causality_of(s, r);
    if (set && (causality == 'o' || (causality == 'p' && s->phase != INSTANTIATED))) {
        slave_failed(s,
                     "ParameterError: %s: cannot be set now; inputs can be set at any time, "
                     "parameters before initialisation only, outputs never",
                     name_of(s, r));
        return 0;
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

/* Reference: GuardedSlave._foresee */
void slave_foresee(Slave *s) {
    if (s->phase != INSTANTIATED || s->refused || s->wheel) return;
    for (size_t i = 0; i < s->reals; i++) s->real[s->outputs + i] = s->real[P_MISSING];
}

void slave_reset(Slave *s) {
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
    s->refused = s->announced = 0;
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
        slave_failed(s, "FormatError: %s: %s; give a file made by `tirelib fmu table`", path, wrong);
        return 0;
    }
    memcpy(lateral, s->calibration->lateral, sizeof lateral);
    same = known->gages == gages;
    for (int g = 0; g < gages && same; g++) same = fabs(known->lateral[g] - lateral[g]) <= 1e-4;
    memcpy(s->calibration, known, sizeof *known);
    free(known);
    if (!same)
        slave_failed(s, "CalibrationError: StrainTire.fmu: %s: gages lie at %s mm (ISO), the calibration "
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
        return slave_failed(s, "ParameterError: missing = %g; allowed are NaN and finite numbers; set "
                         "what Real outputs show where there is no value", s->real[P_MISSING]), 0;
    calibration_read(s->calibration, s->own.table, s->own.numbers);
    if (path[0] && !override(s)) return 0;
    known = path[0] ? s->other.tire : s->own.tire;
    if (strcmp(tire[0] ? tire : s->own.tire, known))
        return slave_failed(s, "CalibrationError: StrainTire.fmu: %s: the tire is '%s', the calibration "
                         "is of '%s'; calibrate on a campaign of this tire",
                      path[0] ? path : "the embedded calibration", tire[0] ? tire : s->own.tire,
                      known), 0;
    if (order != 0.0 && !(fabs(order - s->calibration->order) <= 1e-6 * fabs(order)))
        return slave_failed(s, "ParameterError: filter_order = %g; the calibration was made with %g "
                         "cycles per turn, another low-pass would bias it; set 0, or calibrate "
                         "anew with `tirelib calibrate --order`", order, s->calibration->order), 0;
    while (axes < 3 && strcmp(AXES[axes], s->text[P_AXES])) axes++;
    if (axes == 3)
        return slave_failed(s, "ParameterError: axes = '%s'; allowed are adapted_sae, iso, sae; name "
                         "the axis system of the data", s->text[P_AXES]), 0;
    size_t size = wheel_size(s->calibration, rate);
    if (!size)
        return slave_failed(s, "ParameterError: sample rate = %g Hz; allowed are 100 .. 100000 Hz; give "
                         "the rate of the gages", rate), 0;
    if (size > s->size) {
        free(s->memory);
        s->memory = malloc(size);
        s->size = s->memory ? size : 0;
        if (!s->memory) return slave_failed(s, "MemoryError: %lu bytes", (unsigned long)size), 0;
    }
    s->wheel = wheel_start(s->memory, s->calibration, rate, s->samples, axes);
    if (!s->wheel) {
        char lateral[GAGES * 16];
        slave_failed(s, "ParameterError: axes = '%s': gages at %s mm (ISO) have no mirror image; use "
                  "axes = 'iso' with this layout", s->text[P_AXES],
               millimetres(s->calibration->lateral, s->gages, lateral));
    }
    return s->wheel != NULL;
}

/* Let nothing be valid until a step is done. Reference: GuardedSlave._refuse */
static int refuse(Slave *s, const char *format, ...) {
    va_list given;
    va_start(given, format);
    vsnprintf(s->cause, sizeof s->cause, format, given);
    va_end(given);
    s->refused = 1;
    for (int i = 2; i < 3 + QUANTITIES; i++) s->whole[s->outputs + s->reals + i] = 0;
    s->status[0] = 0;
    add_cause(s, "step_refused");
    return slave_failed(s, "%s", s->cause);
}

int slave_start(Slave *s) {
    if (!started(s)) return FAILED;
    s->phase = STEPPING;
    publish(s);
    return DONE;
}

int slave_step(Slave *s, double step) {
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
        slave_complain(s, s->cause);
    }
    publish(s);
    return DONE;
}

void slave_free(Slave *s) {
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

static Slave *refused(Slave *s, const char *format, ...) {
    char cause[LINE];
    va_list given;
    va_start(given, format);
    vsnprintf(cause, sizeof cause, format, given);
    va_end(given);
    slave_tell(s, cause);
    slave_free(s);
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

Slave *slave_make(const Dialect *dialect, const void *host, const char *name, const char *guid,
                  const char *place, const char *wrong_type) {
    Slave *s = calloc(1, sizeof *s);
    size_t n = place ? strlen(place) : 0;
    if (!s) return NULL;
    s->dialect = dialect;
    s->host = host;
    s->name = calloc(1, name ? strlen(name) + 1 : 1);
    s->folder = malloc(n + 32);
    s->calibration = malloc(sizeof *s->calibration);
    if (!s->name || !s->folder || !s->calibration) return refused(s, "there is no memory left");
    if (name) strcpy(s->name, name);
    if (wrong_type) return refused(s, "%s", wrong_type);
    if (!place)
        return refused(s, "%s is missing; the place of the unpacked folder resources is needed",
                       dialect->place);
    path_of(place, s->folder);
    strcat(s->folder, "/StrainTire.core");
    const char *wrong = resources_read(&s->own, s->folder);
    if (!wrong && calibration_read(s->calibration, s->own.table, s->own.numbers))
        wrong = "is damaged";
    if (!wrong && (!(s->own.samples >= 1.0 && s->own.samples <= 256.0) || !placed(s)))
        wrong = "does not fit the calibration";
    if (wrong)
        return refused(s, "%s = %s: StrainTire.core %s; unpack the whole FMU and give the place of "
                          "its folder resources", dialect->place, place, wrong);
    if (!guid || strcmp(guid, s->own.guid))
        return refused(s, "%s = %s; that of this FMU is %s; model description and binary come from "
                          "different builds; unpack the FMU anew", dialect->guid,
                       guid ? guid : "missing", s->own.guid);
    slave_reset(s);
    return s;
}

int slave_turn(const Slave *s) { return s->whole[s->outputs + s->reals]; }

const char *slave_text(const Slave *s, unsigned r) {
    return r < PARAMETERS ? s->text[r] : r == s->count - 1 ? s->status : s->rolling;
}

int slave_set_text(Slave *s, unsigned r, const char *text) {
    if (!text || strlen(text) >= TEXT)
        return slave_failed(s, "ParameterError: %s: a text of up to %d bytes is needed",
                            name_of(s, r), TEXT - 1);
    strcpy(s->text[r], text);
    return DONE;
}

/* How many bytes variables and parameters need in a state. */
static size_t own_size(const Slave *s) {
    return s->count * (sizeof *s->real + sizeof *s->whole) + sizeof s->text + sizeof s->rolling +
           sizeof s->status + sizeof s->cause + 4 * sizeof(int);
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
                {&s->announced, sizeof s->announced},  {with_wheel, sizeof *with_wheel}};
    for (size_t i = 0; i < sizeof part / sizeof *part; i++) {
        memcpy(back ? part[i].own : (void *)bytes, back ? (void *)bytes : part[i].own, part[i].n);
        bytes += part[i].n;
    }
}

SlaveState *slave_save(Slave *s) {
    int with_wheel = s->wheel != NULL;
    size_t n = own_size(s) + (with_wheel ? state_size(s->wheel) : 0);
    SlaveState *kept = malloc(sizeof *kept + n);
    if (!kept) {
        slave_failed(s, "MemoryError: %lu bytes", (unsigned long)n);
        return NULL;
    }
    kept->n = n;
    exchange(s, kept->bytes, &with_wheel, 0);
    if (with_wheel) state_save(s->wheel, kept->bytes + own_size(s));
    return kept;
}

static const char NO_STATE[] =
    "FormatError: the bytes are not a saved state of this FMU; save the state again";

int slave_restore(Slave *s, const SlaveState *kept) {
    int with_wheel = 0;
    if (kept->n < own_size(s)) return slave_failed(s, NO_STATE);
    exchange(s, (unsigned char *)kept->bytes, &with_wheel, 1);
    for (int i = 0; i < PARAMETERS; i++) s->text[i][TEXT - 1] = 0;
    s->rolling[sizeof s->rolling - 1] = s->status[LINE - 1] = s->cause[LINE - 1] = 0;
    s->wheel = NULL;
    if (!with_wheel) {
        s->phase = INSTANTIATED;
        return DONE;
    }
    int phase = s->phase;
    s->phase = INSTANTIATED;
    if (!started(s)) return FAILED;
    if (!state_restore(s->wheel, kept->bytes + own_size(s), kept->n - own_size(s))) {
        s->wheel = NULL;
        return slave_failed(s, NO_STATE);
    }
    s->phase = phase == TERMINATED ? TERMINATED : STEPPING;
    return DONE;
}
