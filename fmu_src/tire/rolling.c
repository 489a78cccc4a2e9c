#include "rolling.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "chance.h"

#define PI 3.14159265358979323846
static const double LOCK = 1e-9, ROUNDING = 1e-6, SETTLED = 1e-10;
static const double FOLLOWED[2] = {0.5 * PI, 100.0};
static const char *const INPUTS[] = {"Fz",    "alpha",    "kappa",   "camber",
                                     "speed", "pressure", "friction"};
static const char *const STILL[] = {"", "standstill", "locked"};

static double wrapped(double angle) {
    double t = fmod(angle + PI, 2.0 * PI);
    return (t < 0.0 ? t + 2.0 * PI : t) - PI;
}

/* Why the wheel does not turn. */
static int still(const double *in) {
    if (in[IN_SPEED] == 0.0) return STILL_STANDS;
    int locked = isfinite(in[IN_SPEED]) && in[IN_SPEED] > 0.0 && fabs(in[IN_KAPPA] + 1.0) < LOCK;
    return locked ? STILL_LOCKED : STILL_NOT;
}

/* Take the slip that is given from now on; returns whether it acts already. Reference: Relaxation
 */
static int aim(RollingTire *w, const double *given, double speed) {
    int good[2], moves = 0;
    for (int i = 0; i < 2; i++) good[i] = fabs(given[i]) <= FOLLOWED[i];
    if (!w->settled_once) {
        if (!good[0] || !good[1]) {
            w->goal[0] = w->goal[1] = NAN;
            return 1;
        }
        memcpy(w->slip, given, sizeof w->slip);
        w->settled_once = 1;
    }
    for (int i = 0; i < 2; i++) {
        w->goal[i] = good[i] ? given[i] : w->slip[i];
        w->rest[i] = w->slip[i] - w->goal[i];
        if (!(fabs(w->rest[i]) >= SETTLED)) w->rest[i] = 0.0;
        moves |= w->rest[i] != 0.0;
    }
    if (!moves) {
        memcpy(w->slip, w->goal, sizeof w->slip);
        return 1;
    }
    double way = isfinite(speed) ? fabs(speed) : 0.0;
    for (int i = 0; i < 2; i++)
        w->rates[i] = w->options.relaxation[i] > 0.0 ? -way / w->options.relaxation[i] : -INFINITY;
    return 0;
}

/* A condition with the slip that is felt a time from now, above zero. */
static void felt(const RollingTire *w, const double *given, int inputs, double time,
                 double *found) {
    memcpy(found, given, (size_t)inputs * sizeof *found);
    for (int i = 0; i < 2; i++)
        found[IN_ALPHA + i] = w->goal[i] + w->rest[i] * exp(w->rates[i] * time);
}

/* Omega = v (1 + kappa) / R_e; out of range R_e stays, without speed the rest. */
static double turn_rate(RollingTire *w, const TireSurface *s, const double *in, int wrong) {
    double rolls[3] = {in[IN_LOAD], in[IN_SPEED], in[IN_PRESSURE]};
    int known = !(wrong & (1 << IN_LOAD | 1 << IN_SPEED | 1 << IN_PRESSURE));
    if (known && !(w->rolls_once && !memcmp(rolls, w->rolls, sizeof rolls))) {
        memcpy(w->rolls, rolls, sizeof rolls);
        w->rolls_once = 1;
        w->radius = tire_rolling_radius(s, rolls[0], rolls[1], rolls[2]);
    }
    double found = in[IN_SPEED] * (1.0 + in[IN_KAPPA]) / w->radius;
    return isfinite(found) ? found : w->omega;
}

/* Whether the frame that begins with the next sample is lost. */
static int lost(RollingTire *w) {
    const TireOptions *o = &w->options;
    if (!(o->dropped > 0.0 && (double)w->count / o->rate >= o->fault_start)) return 0;
    if (!(chance_of((uint64_t)o->seed, (uint64_t)w->count) < o->dropped)) return 0;
    w->valid = 0;
    strcpy(w->status, "frame_dropped");
    return 1;
}

/* Add noise and faults to the strain of a sample. Reference: Faults.of */
static void seen(const RollingTire *w, int gages, int64_t sample, double *strain) {
    const TireOptions *o = &w->options;
    double time = (double)sample / o->rate;
    int on = time >= o->fault_start;
    for (int g = 0; g < gages; g++) {
        double *x = strain + g;
        if (o->noise > 0.0)
            *x += o->noise * noise_of((uint64_t)o->seed, (uint64_t)sample, g, gages);
        if (!on) continue;
        *x += o->drift * (time - o->fault_start);
        if (o->saturation > 0.0) *x = fmin(fmax(*x, -o->saturation), o->saturation);
        if (o->dead_gage == g + 1) *x = 0.0;
    }
}

/* Add a word to the status, by semicolons. */
static void add(RollingTire *w, const char *before, const char *word) {
    size_t n = strlen(w->status);
    snprintf(w->status + n, sizeof w->status - n, "%s%s%s", n ? ";" : "", before, word);
}

/* Name the faults that are active, after n samples were shown. Reference: VirtualWheel._show */
static void shown(RollingTire *w, int gages, int n) {
    const TireOptions *o = &w->options;
    double time = (double)(w->count + n - 1) / o->rate;
    for (int i = n; i < w->samples; i++)
        memcpy(w->frame + i * gages, w->frame + (n - 1) * gages, (size_t)gages * sizeof *w->frame);
    w->valid = 1;
    w->status[0] = 0;
    if (time >= o->fault_start) {
        if (o->dead_gage) add(w, "fault_", "dead_gage");
        if (o->saturation != 0.0) add(w, "fault_", "saturation");
        if (o->drift != 0.0) add(w, "fault_", "drift");
        if (o->dropped != 0.0) add(w, "fault_", "dropped_frames");
    }
    if (!w->status[0]) strcpy(w->status, "ok");
}

/* Hold the strain of the angle at which the wheel stopped; the noise continues. */
static void stand(RollingTire *w, const TireSurface *s, int why, int n) {
    if (!w->last_once) {
        w->valid = 0;
        strcpy(w->status, STILL[why]);
        return;
    }
    if (!w->held_once) {
        tire_strain(s, w->last, w->angle, w->held);
        w->held_once = 1;
    }
    if (!n || lost(w)) return;
    for (int i = 0; i < n; i++) {
        memcpy(w->frame + i * s->gages, w->held, (size_t)s->gages * sizeof *w->held);
        seen(w, s->gages, w->count + i, w->frame + i * s->gages);
    }
    shown(w, s->gages, n);
    char words[TIRE_STATUS];
    snprintf(words, sizeof words, "%s", strcmp(w->status, "ok") ? w->status : "");
    strcpy(w->status, STILL[why]);
    if (words[0]) add(w, "", words);
}

/* Ask the surface; of a condition that stays, once. */
static const double *answers_of(RollingTire *w, const TireSurface *s, const double *condition) {
    size_t n = (size_t)s->inputs * sizeof *condition;
    if (!w->asked_once || memcmp(w->asked, condition, n)) {
        memcpy(w->asked, condition, n);
        w->asked_once = 1;
        tire_answers(s, condition, w->answer);
    }
    return w->answer;
}

/* Fill the frame with n samples, the first at a time from the start angle on. */
static void measure(RollingTire *w, const TireSurface *s, const double *given, int settled,
                    double start, double first, int n) {
    double own[MOST_ANSWERS], condition[MOST_INPUTS];
    const double *answers = settled ? answers_of(w, s, given) : own;
    for (int i = 0; i < n; i++) {
        double time = first + (double)i / w->options.rate, *strain = w->frame + i * s->gages;
        if (!settled) {
            felt(w, given, s->inputs, time, condition);
            tire_answers(s, condition, own);
        }
        tire_strain(s, answers, start + w->omega * time, strain);
        seen(w, s->gages, w->count + i, strain);
    }
    shown(w, s->gages, n);
    memcpy(w->force, answers + s->answers - OUT_FORCES, sizeof w->force);
    memcpy(w->last, answers, (size_t)s->answers * sizeof *answers);
    w->last_once = 1;
}

int rolling_outside(const TireSurface *s, const double *inputs) {
    const int held = 1 << IN_ALPHA | 1 << IN_KAPPA | 1 << IN_SPEED;
    return tire_outside(s, inputs) & ~(still(inputs) ? held : 0);
}

/* Which of the relaxed inputs are still out of range at the ends of a step. */
static int lag_outside(const RollingTire *w, const TireSurface *s, const double *given, double a,
                       double b, int order[2]) {
    double condition[MOST_INPUTS];
    felt(w, given, s->inputs, a, condition);
    order[0] = tire_outside(s, condition);
    felt(w, given, s->inputs, b, condition);
    order[1] = tire_outside(s, condition) & ~order[0];
    return order[0] | order[1];
}

/* Move on by a step [s] with n samples; the last one was `due` samples before. */
static void take(RollingTire *w, const TireSurface *s, const double *given, double step, double due,
                 int n) {
    int why = still(given), order[2] = {rolling_outside(s, given), 0};
    double omega = why ? 0.0 : turn_rate(w, s, given, order[0]);
    int settled = aim(w, given + IN_ALPHA, given[IN_SPEED]);
    double first = (1.0 - due) / w->options.rate, condition[MOST_INPUTS];
    if (!why) {
        w->held_once = 0;
        if (!order[0] && !settled) lag_outside(w, s, given, n ? first : step, step, order);
    }
    double start = w->angle;
    w->omega = omega;
    w->angle = wrapped(start + omega * step);
    if (order[0] || order[1]) {
        w->valid = 0;
        strcpy(w->status, "out_of_range: ");
        for (int part = 0, some = 0; part < 2; part++)
            for (int i = 0; i < s->inputs; i++)
                if (order[part] & 1 << i) {
                    size_t at = strlen(w->status);
                    snprintf(w->status + at, sizeof w->status - at, "%s%s", some ? ", " : "",
                             INPUTS[i]);
                    some = 1;
                }
    } else if (why) {
        stand(w, s, why, n);
    } else if (n && !lost(w)) {
        measure(w, s, given, settled, start, first, n);
    }
    if (settled) return;
    felt(w, given, s->inputs, step, condition);
    memcpy(w->slip, condition + IN_ALPHA, sizeof w->slip);
}

void rolling_start(RollingTire *w, const TireSurface *s, const TireOptions *options, int samples,
                   const double *inputs) {
    memset(w, 0, sizeof *w);
    w->options = *options;
    w->samples = samples;
    w->angle = options->start_angle;
    w->radius = NAN;
    for (int i = 0; i < OUT_FORCES; i++) w->force[i] = NAN;
    strcpy(w->status, "not_started");
    w->fresh = 1;
    take(w, s, inputs, 0.0, 1.0, 1);
    w->count = 1;
}

int rolling_step(RollingTire *w, const TireSurface *s, double step, const double *inputs,
                 double *most) {
    double exact = step * w->options.rate, until = w->due + exact;
    if (!(isfinite(exact) && exact > 0.0)) return TIRE_STEP_LENGTH;
    *most = floor(until + ROUNDING);
    if (*most > w->samples) return TIRE_STEP_SAMPLES;
    int n = (int)*most;
    double due = w->due;
    w->due = until - n;
    w->fresh = n;
    take(w, s, inputs, step, due, n);
    w->count += n;
    return TIRE_DONE;
}
