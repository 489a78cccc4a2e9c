#include "remarks.h"

#include <string.h>

#include "laws.h"
#include "regressors.h"

static int beyond(double x, double low, double high) { return x < low || x > high; }

static const double MOST_STRAIN = 1.0;

static Remark remark_of(double value, double low, double high, int name) {
    Remark r = {1, name, value, fmin(low, high), fmax(low, high)};
    return r;
}

/* Conditions that cannot be, or that the calibration does not hold for. Reference: _given */
static void given(const Wheel *w, int notes, Remark *r) {
    const Constants *k = &w->calibration->constants;
    const Chain *full = &w->calibration->chain[ALL_GAGES];
    const Guard *guard = &full->guard[FY];
    const Turn *turn = w->turn;
    double said[3] = {turn->friction, turn->tread_depth, turn->tread_temperature};
    Ends pressure = pressure_range(&full->laws, k), speed = speed_range(&full->laws, k);
    if (full->force.there) {
        Ends other = pressure_range(&full->force_laws, k), fast = speed_range(&full->force_laws, k);
        pressure.low = fmax(pressure.low, other.low), pressure.high = fmin(pressure.high, other.high);
        speed.low = fmax(speed.low, fast.low), speed.high = fmin(speed.high, fast.high);
    }
    for (int i = 0; i < 3; i++)
        if (notes & (FRICTION_IMPLAUSIBLE << i))
            r[FRICTION_REMARK + i] =
                remark_of(said[i], full->road.ends[i][0], full->road.ends[i][1], 0);
    if (notes & PRESSURE_OUT_OF_RANGE)
        r[PRESSURE_REMARK] = remark_of(turn->pressure, pressure.low, pressure.high, 0);
    if (notes & SPEED_OUT_OF_RANGE)
        r[SPEED_REMARK] = remark_of(turn->speed, speed.low, speed.high, 0);
    for (int i = 0; i < guard->ranges; i++) {
        const double *range = guard->range + RANGE_WIDTH * i;
        if (range[RANGE_NUMBER] == V_CAMBER && (notes & CAMBER_OUT_OF_RANGE))
            r[CAMBER_REMARK] = remark_of(turn->camber, range[RANGE_LOW], range[RANGE_HIGH], 0);
    }
}

static int any(const Remark *r) {
    int found = 0;
    for (int i = 0; i < REMARKS; i++) found |= r[i].holds;
    return found;
}

/* Quantities beyond their own ranges. */
static void own(const Wheel *w, const Chain *c, int notes, Remark *r) {
    const double *side = wheel_signs(w), *value = w->live.latest.value;
    for (int q = 0; q < QUANTITIES; q++)
        for (int i = 0; i < c->guard[q].ranges; i++) {
            const double *range = c->guard[q].range + RANGE_WIDTH * i;
            double low = range[RANGE_LOW], high = range[RANGE_HIGH];
            if ((notes & (FZ_OUT_OF_RANGE << q)) && range[RANGE_NUMBER] < 0.0 &&
                beyond(value[q], low, high))
                r[FZ_REMARK + q] = remark_of(side[q] * value[q], side[q] * low, side[q] * high, 0);
        }
}

/* The first number read from the strain that is out of its range, if one is.
 * Reference: _of_strain */
static void of_strain(const Wheel *w, const Chain *c, int notes, Remark *r) {
    double x[VALUES];
    const double *value = w->live.latest.value;
    compute_regressors(w->calibration, c, w->turn, &w->features, AS_READ, x);
    x[V_UTILISATION] = value[FY] / value[FZ];
    for (int q = 0; q < QUANTITIES; q++)
        for (int i = 0; i < c->guard[q].ranges && (notes & (FZ_OUT_OF_RANGE << q)); i++) {
            const double *range = c->guard[q].range + RANGE_WIDTH * i;
            int name = (int)range[RANGE_NUMBER];
            if (name < 0 || !beyond(x[name], range[RANGE_LOW], range[RANGE_HIGH])) continue;
            r[STRAIN_REMARK] = remark_of(x[name], range[RANGE_LOW], range[RANGE_HIGH], name);
            return;
        }
    r[COMBINATION_REMARK] = remark_of(NAN, NAN, NAN, 0);
}

void wheel_remarks(const Wheel *w, double omega, Remark r[REMARKS]) {
    int notes = w->live.latest.notes;
    int out = notes & (FZ_OUT_OF_RANGE | ALPHA_OUT_OF_RANGE | KAPPA_OUT_OF_RANGE | FY_OUT_OF_RANGE);
    const Chain *c = chain_for(w->calibration, &w->features);
    memset(r, 0, REMARKS * sizeof *r);
    given(w, notes, r);
    if (w->live.latest.flags & OMEGA_MISMATCH) {
        double rate = copysign(2.0 * PI / w->turn->period, w->turn->speed);
        r[OMEGA_REMARK] =
            remark_of(omega, rate / LARGEST_OMEGA_RATIO, rate * LARGEST_OMEGA_RATIO, 0);
    }
    if (w->live.latest.flags & OTHER_TIRE) r[OTHER_TIRE_REMARK] = remark_of(NAN, NAN, NAN, 0);
    if (any(r) || !out || !c) return;
    own(w, c, out, r);
    if (!any(r)) of_strain(w, c, out, r);
}

Remark strain_remark(const double *sample, int gages) {
    Remark none = {0, 0, 0.0, 0.0, 0.0};
    for (int g = 0; g < gages; g++)
        if (isfinite(sample[g]) && fabs(sample[g]) > MOST_STRAIN)
            return remark_of(sample[g], -MOST_STRAIN, MOST_STRAIN, 0);
    return none;
}

Remark step_remark(double count, int samples) {
    Remark none = {0, 0, 0.0, 0.0, 0.0};
    return count > samples ? remark_of(count, 1.0, samples, 0) : none;
}
