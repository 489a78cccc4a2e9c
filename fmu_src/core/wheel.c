#include "wheel.h"

#include <string.h>

#include "quality.h"

static const double WATCHDOG_TURNS = 2.0, STANDSTILL = 0.05, LONGEST_TURN = 3.0;
static const double LOWEST_RATE = 100.0, HIGHEST_RATE = 1e5, STEP_TOLERANCE = 0.01;

/* tirelib.core.axes.sign of Fz, alpha, kappa, Fy, and of the lateral position. */
static const double SIGN[3][QUANTITIES + 1] = {
    {1.0, 1.0, 1.0, 1.0, 1.0}, {-1.0, -1.0, 1.0, -1.0, -1.0}, {1.0, 1.0, 1.0, -1.0, -1.0}};

static size_t rounded(size_t bytes) { return (bytes + 15) / 16 * 16; }

size_t wheel_size(const Calibration *cal, double rate) {
    if (!(rate >= LOWEST_RATE && rate <= HIGHEST_RATE)) return 0;
    size_t doubles = estimate_scratch(cal);
    return rounded(sizeof(Wheel)) + rounded(sizeof(Turn)) + rounded(doubles * sizeof(double)) +
           cutter_size(cal->gages, rate);
}

/* Forget everything but the settings. Reference: StreamEstimator.reset */
static void reset(Wheel *w) {
    LowPass low_pass = {w->calibration->order, w->calibration->cut_off};
    w->cutter = cutter_start(w->cutter, w->gages, w->calibration->lateral, w->rate, &low_pass);
    w->live.count = w->live.turns = 0;
    w->live.told = w->live.complete = 0;
    w->live.deadline = LONGEST_TURN * w->rate;
    w->live.standing = -1;
    w->live.idle = 0.0;
    w->turned = 0;
}

/* Which gage of the calibration each one of the frame is. Reference: _gage_order */
static int find_order(Wheel *w) {
    const double *y = w->calibration->lateral, side = SIGN[w->axes][QUANTITIES];
    for (int g = 0; g < w->gages; g++) {
        int other = 0;
        while (other < w->gages && !(fabs(side * y[other] - y[g]) < 1e-4)) other++;
        if (other == w->gages) return 0;
        w->order[g] = other;
    }
    return 1;
}

Wheel *wheel_start(void *memory, const Calibration *cal, double rate, int samples, int axes) {
    Wheel *w = memory;
    char *next = (char *)memory + rounded(sizeof(Wheel));
    memset(w, 0, sizeof *w);
    w->calibration = cal;
    w->rate = rate;
    w->samples = samples;
    w->gages = cal->gages;
    w->axes = axes;
    w->turn = (Turn *)(void *)next;
    next += rounded(sizeof(Turn));
    w->scratch = (double *)(void *)next;
    next += rounded(estimate_scratch(cal) * sizeof(double));
    w->cutter = (Cutter *)(void *)next;
    reset(w);
    return find_order(w) ? w : NULL;
}

/* How many samples a step holds, or why it cannot be. Reference: Wheel.samples_in, _counted */
static int samples_in(const Wheel *w, double step, int count) {
    int length = step > 0.0 && step <= LONGEST_TURN;
    if (count >= 0 || count < -1) {
        if (!length) return STEP_LENGTH;
        return count < 0 || count > w->samples ? STEP_SAMPLES : count;
    }
    double exact = step * w->rate, whole = isfinite(exact) ? rint(exact) : 0.0;
    if (whole < 1.0 || !(fabs(exact - whole) <= STEP_TOLERANCE)) return STEP_NOT_WHOLE;
    return length ? (int)whole : STEP_LENGTH;
}

/* Whether a gage without contact stands still. Reference: NumpyEstimator._gage_out */
static int stands_still(const Cutter *c, int gage) {
    const ContactFinder *f = &c->finder;
    int64_t first = f->middles ? (int64_t)f->last_middle - 1
                    : f->pulse ? f->pulse_start
                               : f->count - 1;
    int64_t base = ring_base(&c->ring);
    double low = INFINITY, high = -INFINITY;
    if (c->queued && c->has_previous) {
        int64_t before = (int64_t)contact_middle(&c->previous) - 1;
        if (before < first) first = before;
    }
    for (int64_t i = first > base ? first : base; i < c->ring.total; i++) {
        double x = ring_at(&c->ring, gage, i);
        if (!isfinite(x)) return 1;
        low = fmin(low, x);
        high = fmax(high, x);
    }
    return !(high > low);
}

/* Whether a gage is missing, saturated or frozen; one without contact may be well. */
static int gage_out(const Wheel *w) {
    for (int g = 0; g < w->gages; g++) {
        int flags = w->features.gage_flags[g];
        if (flags & DEAD_GAGE ? stands_still(w->cutter, g) : (flags & UNUSABLE) != 0) return 1;
    }
    return 0;
}

/* Reference: NumpyEstimator._estimate */
static void take_turn(Wheel *w) {
    Live *l = &w->live;
    const Turn *turn = w->turn;
    double period = isfinite(turn->period) ? turn->period : LONGEST_TURN / WATCHDOG_TURNS;
    extract_features(turn, w->gages, &w->features);
    estimate(w->calibration, turn, &w->features, w->scratch, &l->latest);
    l->turns++;
    w->turned = l->told = 1;
    l->time = turn->time;
    l->ready = turn->ready;
    l->omega = turn->omega;
    l->deadline = (turn->time + WATCHDOG_TURNS * period) * w->rate;
    l->held = 0;
}

/* Reference: NumpyEstimator.stale */
static int stale(const Wheel *w) {
    const Live *l = &w->live;
    if ((double)l->count + l->idle * w->rate > l->deadline) return 1;
    double ready = l->told ? l->ready * w->rate : -1.0;
    return l->standing >= 0 && (double)l->standing + 1.0 > ready;
}

static double elapsed(const Wheel *w) { return (double)w->live.count / w->rate + w->live.idle; }

/* Hold the last values as invalid and start anew. Reference: Wheel.fault */
static void fault(Wheel *w) {
    Live *l = &w->live;
    wheel_outputs(w, &l->shown);
    l->held = 1;
    l->offset += (double)l->count / w->rate;
    l->earlier += l->turns;
    reset(w);
}

/* Take samples up to the next turn: 1; 0 when there are no more; -1 after an error. */
static int go_on(Wheel *w, const Column *columns, int64_t n, int64_t *taken) {
    const Column *omega = &columns[w->gages + OMEGA];
    Live *l = &w->live;
    int found = cutter_next(w->cutter, w->turn);
    while (!found && *taken < n) {
        int64_t at = (*taken)++;
        if (!cutter_take(w->cutter, columns, at)) return -1;
        if (fabs(omega->first[at * omega->step]) < STANDSTILL) l->standing = l->count;
        l->idle = 0.0;
        l->count++;
        found = cutter_next(w->cutter, w->turn);
    }
    if (found > 0) take_turn(w);
    return found;
}

/* Tell, after the samples of a frame, whether all gages and the speed were there in the last turn. */
static void settle(Wheel *w) {
    if (w->turned) w->live.complete = !(w->turn->flags & NO_SPEED) && !gage_out(w);
    w->turned = 0;
}

int wheel_take(Wheel *w, const Column *columns, int64_t n, int64_t *taken) {
    int found = go_on(w, columns, n, taken);
    if (!found) settle(w);
    return found;
}

/* Take n samples of a frame; those that did not come are missing. */
static int take_samples(Wheel *w, const double *frame, int64_t n, int valid,
                        const double *conditions) {
    static const double MISSING = NAN;
    int64_t taken = 0, given = !valid ? 0 : n < w->samples ? n : w->samples;
    Column columns[GAGES + HELD + 1];
    int found;
    for (int i = 0; i < w->gages + HELD + 1; i++) {
        int held = i - w->gages; /* there is no trigger */
        int known = held >= 0 && held < HELD && isfinite(conditions[held]);
        columns[i].first = held < 0 ? frame + w->order[i] : known ? conditions + held : &MISSING;
        columns[i].step = held < 0 ? w->gages : 0;
    }
    while ((found = go_on(w, columns, given, &taken)) > 0) continue;
    for (int g = 0; g < w->gages; g++) {
        columns[g].first = &MISSING;
        columns[g].step = 0;
    }
    while (found >= 0 && (found = go_on(w, columns, n, &taken)) > 0) continue;
    settle(w);
    return found >= 0;
}

int wheel_step(Wheel *w, const double *frame, double step, int valid, const double *conditions,
               int count) {
    int n = samples_in(w, step, count);
    Live *l = &w->live;
    if (n < 0) return n;
    if (n == 0) {
        l->idle += step;
        return STEP_DONE;
    }
    int64_t before = l->count, standing = l->standing;
    double idle = l->idle;
    if (take_samples(w, frame, n, valid, conditions)) return STEP_DONE;
    l->count = before, l->standing = standing, l->idle = idle; /* the step was not done */
    fault(w);
    return WHEEL_FAULT;
}

const double *wheel_signs(const Wheel *w) { return SIGN[w->axes]; }

/* Old values, no validity. Reference: Wheel._held_outputs */
static void held_outputs(const Wheel *w, Outputs *out) {
    *out = w->live.shown;
    out->age += elapsed(w);
    out->flags |= FAULT | (stale(w) ? NO_CONTACT : 0);
    out->valid = 0;
    out->notes = 0;
    memset(out->valid_of, 0, sizeof out->valid_of);
}

void wheel_outputs(const Wheel *w, Outputs *out) {
    const Live *l = &w->live;
    const Estimates *e = &l->latest;
    if (l->held) {
        held_outputs(w, out);
        return;
    }
    int late = stale(w);
    memset(out, 0, sizeof *out);
    out->turn = l->earlier + l->turns;
    out->flags = (l->told ? e->flags : FIRST_TURN) | (late ? NO_CONTACT : 0);
    out->notes = l->told ? e->notes : 0;
    out->rolling = l->told ? e->rolling : ROLLING_UNKNOWN;
    out->valid = l->told && e->turn_valid && l->complete && !late;
    for (int q = 0; q < QUANTITIES; q++) {
        out->value[q] = l->told ? SIGN[w->axes][q] * e->value[q] : NAN;
        out->std[q] = l->told ? e->std[q] : NAN;
        out->valid_of[q] = l->told && e->valid[q] && !late;
        if (quantity_calibrated(w->calibration, q)) out->valid = out->valid && out->valid_of[q];
    }
    for (int g = 0; g < w->gages; g++) {
        out->contact_length[w->order[g]] = l->told ? e->contact_length[g] : NAN;
        out->contact_length_std[w->order[g]] = l->told ? e->contact_length_std[g] : NAN;
    }
    out->rolling_radius = l->told ? e->radius : NAN;
    out->turn_rate = l->told ? l->omega : NAN;
    out->contact_time = l->told ? l->time + l->offset : NAN;
    out->age = l->told ? elapsed(w) - l->ready : NAN;
}
