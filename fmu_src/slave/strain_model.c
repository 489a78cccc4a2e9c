/* The model of StrainTire.fmu: parameters, the wheel's estimator, its outputs. Reference:
 * fmu_src/strain_tire.py, tirelib.fmu.wheel */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

enum { NAME = 200 };

static const char *const AXES[] = {"iso", "sae", "adapted_sae"};
static const char *const ROLLING[] = {"unknown", "free", "braking", "driving"};
static const char *const FLAGS[] = {
    "first_turn",   "gap",          "bridged",          "spike",         "saturated",
    "dead_gage",    "period_jump",  "trigger_mismatch", "drift",         "no_speed",
    "reversed",     "out_of_range", "cut_off",          "reduced_gages", "too_few_gages",
    "no_condition", "weak_edge",    "no_contact",       "fault",         "accelerating",
    "other_tire",   "omega_mismatch"};
static const char *const NOTES[] = {"Fz_out_of_range",         "alpha_out_of_range",
                                    "kappa_out_of_range",      "Fy_out_of_range",
                                    "alpha_saturated",         "condition_extrapolated",
                                    "camber_unknown",          "friction_implausible",
                                    "tread_depth_implausible", "tread_temperature_implausible",
                                    "pressure_out_of_range",   "speed_out_of_range",
                                    "camber_out_of_range"};

/* Tell what of a turn that has just ended is out of range. Reference: StrainTire.advance */
static void tell_remarks(Slave *s) {
    Remark remark[REMARKS];
    wheel_remarks(s->wheel, s->real[s->conditions + OMEGA], remark);
    for (int kind = 0; kind < REMARKS; kind++)
        if (remark[kind].holds)
            slave_remark(s, kind, &remark[kind], s->own.remark[REMARKS + remark[kind].name]);
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
    if (*whole != (int)out.turn && (out.notes || (out.flags & (OMEGA_MISMATCH | OTHER_TIRE))))
        tell_remarks(s);
    *whole++ = (int)out.turn;
    *whole++ = out.flags;
    *whole++ = out.valid;
    for (int q = 0; q < QUANTITIES; q++) *whole++ = out.valid_of[q];
    snprintf(s->rolling, sizeof s->rolling, "%s", ROLLING[out.rolling]);
    s->status[0] = 0;
    for (size_t i = 0; i < sizeof FLAGS / sizeof *FLAGS; i++)
        if (out.flags & (1 << i) && !(fault && 1 << i == FAULT)) slave_add(s, FLAGS[i]);
    for (size_t i = 0; i < sizeof NOTES / sizeof *NOTES; i++)
        if (out.notes & (1 << i)) slave_add(s, NOTES[i]);
    if (fault) slave_add_cause(s, "fault");
}

/* Reference: GuardedSlave._foresee */
static void foresee(Slave *s) {
    for (size_t i = 0; i < s->reals; i++) s->real[s->outputs + i] = s->real[P_MISSING];
}

/* Bring variables to their start values. */
static void first(Slave *s) {
    for (size_t i = s->frame; i < s->conditions; i++) s->real[i] = 0.0;
    strcpy(s->text[P_AXES], "iso");
    s->real[P_RATE] = s->own.rate;
    s->real[P_ORDER] = 0.0;
    s->real[P_MISSING] = s->own.missing;
    s->whole[s->conditions + HELD] = 1; /* frame_valid */
    s->whole[s->outputs + s->reals + 1] = FIRST_TURN;
    strcpy(s->rolling, "unknown");
    strcpy(s->status, "first_turn");
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

/* A name as it is shown: what is not printable ASCII, as in a damaged file, as a question mark. */
static const char *printable(const char *name, char text[NAME]) {
    size_t i = 0;
    for (; name[i] && i < NAME - 1; i++) text[i] = name[i] >= ' ' && name[i] <= '~' ? name[i] : '?';
    text[i] = 0;
    return text;
}

/* Whether a file's numbers are those that were written: the line of an FMU's GUID holds their hash,
 * or "-" in a file of an earlier version. Reference: tirelib.fmu.native.core_file */
static int undamaged(const Resources *file) {
    char sum[17];
    snprintf(sum, sizeof sum, "%016" PRIx64,
             state_hash(file->table, file->numbers * sizeof *file->table));
    return !strcmp(file->guid, sum) || !strcmp(file->guid, "-");
}

/* Read another calibration, unless it is the one that was read last: a state may be taken up again
 * where its file is gone. Returns what is wrong with it, NULL if nothing is. */
static const char *loaded(Slave *s, const char *path, Calibration *known) {
    Resources found;
    int again = !strcmp(path, s->loaded);
    const char *wrong = again ? NULL : resources_read(&found, path);
    const Resources *file = again ? &s->other : &found;
    if (!wrong &&
        (calibration_read(known, file->table, file->numbers) || (!again && !undamaged(file))))
        wrong = "is damaged";
    if (again || wrong) {
        if (!again) resources_free(&found);
        return wrong;
    }
    resources_free(&s->other);
    s->other = found;
    strcpy(s->loaded, path);
    return NULL;
}

/* Take up another calibration; tells what is wrong with it. Reference: load_wheel */
static int override(Slave *s) {
    const char *path = s->text[P_CALIBRATION];
    Calibration *known = malloc(sizeof *known);
    double lateral[GAGES];
    char here[GAGES * 16], there[GAGES * 16];
    int gages = s->calibration->gages, same;
    const char *wrong = known ? loaded(s, path, known) : "needs more memory";
    if (wrong) {
        free(known);
        slave_failed(s, "FormatError: %s: %s; give a file made by `tirelib fmu table`", path,
                     wrong);
        return 0;
    }
    memcpy(lateral, s->calibration->lateral, sizeof lateral);
    same = known->gages == gages;
    for (int g = 0; g < gages && same; g++) same = fabs(known->lateral[g] - lateral[g]) <= 1e-4;
    memcpy(s->calibration, known, sizeof *known);
    free(known);
    s->numbers = state_hash(s->other.table, s->other.numbers * sizeof *s->other.table);
    if (!same)
        slave_failed(
            s,
            "CalibrationError: StrainTire.fmu: %s: gages lie at %s mm (ISO), the calibration "
            "has them at %s mm; calibrate with this layout",
            path, millimetres(lateral, gages, here),
            millimetres(s->calibration->lateral, s->calibration->gages, there));
    return same;
}

/* Start a wheel with the parameters as they are now. Reference: StrainTire.started */
static int start(Slave *s) {
    s->wheel = NULL;
    const char *path = s->text[P_CALIBRATION], *tire = s->text[P_TIRE], *known;
    double rate = s->real[P_RATE], order = s->real[P_ORDER];
    int axes = 0;
    char name[NAME];
    if (isinf(s->real[P_MISSING]))
        return slave_failed(s,
                            "ParameterError: missing = %g; allowed are NaN and finite numbers; set "
                            "what Real outputs show where there is no value",
                            s->real[P_MISSING]),
               0;
    calibration_read(s->calibration, s->own.table, s->own.numbers);
    s->numbers = 0;
    if (path[0] && !override(s)) return 0;
    known = path[0] ? s->other.tire : s->own.tire;
    if (strcmp(tire[0] ? tire : s->own.tire, known))
        return slave_failed(
                   s,
                   "CalibrationError: StrainTire.fmu: %s: the tire is '%s', the calibration "
                   "is of '%s'; calibrate on a campaign of this tire",
                   path[0] ? path : "the embedded calibration", tire[0] ? tire : s->own.tire,
                   printable(known, name)),
               0;
    if (order != 0.0 && !(fabs(order - s->calibration->order) <= 1e-6 * fabs(order)))
        return slave_failed(s,
                            "ParameterError: filter_order = %g; the calibration was made with %g "
                            "cycles per turn, another low-pass would bias it; set 0, or calibrate "
                            "anew with `tirelib calibrate --order`",
                            order, s->calibration->order),
               0;
    while (axes < 3 && strcmp(AXES[axes], s->text[P_AXES])) axes++;
    if (axes == 3)
        return slave_failed(s,
                            "ParameterError: axes = '%s'; allowed are adapted_sae, iso, sae; name "
                            "the axis system of the data",
                            s->text[P_AXES]),
               0;
    size_t size = wheel_size(s->calibration, rate);
    if (!size)
        return slave_failed(
                   s,
                   "ParameterError: sample rate = %g Hz; allowed are 100 .. 100000 Hz; give "
                   "the rate of the gages",
                   rate),
               0;
    if (size > s->size) {
        free(s->memory);
        s->memory = malloc(size);
        s->size = s->memory ? size : 0;
        if (!s->memory) return slave_failed(s, "MemoryError: %lu bytes", (unsigned long)size), 0;
    }
    s->wheel = wheel_start(s->memory, s->calibration, rate, s->samples, axes);
    if (!s->wheel) {
        char lateral[GAGES * 16];
        slave_failed(s,
                     "ParameterError: axes = '%s': gages at %s mm (ISO) have no mirror image; use "
                     "axes = 'iso' with this layout",
                     s->text[P_AXES], millimetres(s->calibration->lateral, s->gages, lateral));
    }
    return s->wheel != NULL;
}

static int step(Slave *s, double step) {
    double rate = s->wheel->rate, frame = s->samples / rate;
    int count = s->buffered ? s->whole[s->conditions + HELD + 1] : -1;
    int valid = s->whole[s->conditions + HELD];
    if (s->buffered && (count < 0 || count > s->samples) && step > 0.0 && step <= 3.0)
        return slave_refuse(s,
                            "samples = %d; allowed are 0 .. %d, the frame's length; set how many "
                            "samples of the frame are new",
                            count, s->samples);
    int done = wheel_step(s->wheel, s->real + s->frame, step, valid, s->real + s->conditions,
                          count < -1 ? -2 : count);
    if (done == STEP_NOT_WHOLE)
        return slave_refuse(s,
                            "communication step = %g s is %g samples at %g Hz; a whole number of "
                            "samples is needed; step by %g s",
                            step, step * rate, rate, frame);
    if (done == STEP_LENGTH || done == STEP_SAMPLES)
        return slave_refuse(s,
                            "communication step = %g s; allowed is above 0 and up to 3 s, the "
                            "longest turn; step by %g s",
                            step, frame);
    if (done == WHEEL_FAULT) {
        snprintf(s->cause, sizeof s->cause, "%s",
                 "ParameterError: the low-pass would reach beyond the samples of the turn");
        slave_complain(s, s->cause);
    }
    Remark beyond = step_remark(s->buffered ? 0.0 : rint(step * rate), s->samples);
    Remark strange = strain_remark(s->real + s->frame, s->gages);
    if (beyond.holds) slave_remark(s, STEP_REMARK, &beyond, "");
    if (valid && strange.holds) slave_remark(s, IMPLAUSIBLE_REMARK, &strange, "");
    return DONE;
}

/* Where the variables stand; whether the calibration can be read. */
static int place(Slave *s) {
    s->calibration = malloc(sizeof *s->calibration);
    if (!s->calibration || calibration_read(s->calibration, s->own.table, s->own.numbers)) return 0;
    s->gages = s->calibration->gages;
    s->frame = PARAMETERS;
    s->conditions = s->frame + (size_t)(s->samples * s->gages);
    s->outputs = s->conditions + HELD + 1 + (size_t)s->buffered;
    s->reals = 2 * QUANTITIES + 2 * (size_t)s->gages + 4;
    s->count = s->outputs + s->reals + 2 + 1 + QUANTITIES + 2;
    return s->own.remarks == REMARKS + VALUES;
}

static size_t size(const Slave *s) { return state_size(s->wheel); }
static void save(const Slave *s, unsigned char *bytes) { state_save(s->wheel, bytes); }

static int restore(Slave *s, const unsigned char *bytes, size_t n) {
    return state_restore(s->wheel, bytes, n);
}

const Model STRAIN_MODEL = {"StrainTire.core", 2,       1 + QUANTITIES, place, first,  start, step,
                            publish,           foresee, size,           save,  restore};

int slave_turn(const Slave *s) { return s->whole[s->outputs + s->reals]; }
