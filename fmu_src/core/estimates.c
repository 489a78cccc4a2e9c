#include "estimates.h"

#include <string.h>

#include "chain.h"
#include "laws.h"
#include "polynomial.h"
#include "quality.h"
#include "regressors.h"
#include "unknowns.h"

/* Flags with which no estimate is valid: tirelib.core.flags.INVALIDATING. */
enum {
    INVALIDATING = FIRST_TURN | PERIOD_JUMP | ACCELERATING | TRIGGER_MISMATCH | REVERSED |
                   OUT_OF_RANGE | CUT_OFF | TOO_FEW_GAGES | NO_CONDITION | NO_CONTACT | FAULT |
                   OTHER_TIRE | OMEGA_MISMATCH
};

/* What the chain of the working gages says of a turn. */
typedef struct {
    int unlike, extrapolated, tilted, unknown;
    double traction;
} Said;

size_t estimate_scratch(const Calibration *calibration) {
    return (size_t)calibration->largest_cloud + 1;
}

const Chain *chain_for(const Calibration *cal, const Features *features) {
    int out = 0, missing = ALL_GAGES;
    for (int g = cal->gages - 1; g >= 0; g--)
        if (features->gage_flags[g] & UNUSABLE) out++, missing = g;
    return out > 1 || !cal->chain[missing].there ? NULL : &cal->chain[missing];
}

/* Reference: Calibration._unknown_condition */
static int condition_unknown(const Chain *c, const double *values) {
    int unknown = (c->needs_pressure && isnan(values[V_PRESSURE])) ||
                  (c->needs_camber && isnan(values[V_CAMBER])) ||
                  (c->needs_speed && isnan(values[V_SPEED]));
    return unknown && isfinite(values[V_OMEGA]);
}

/* Values, standard deviations and validity of the quantities by one chain. */
static Said by_chain(const Calibration *cal, const Chain *c, const Turn *turn,
                     const Features *features, double *scratch, Estimates *e) {
    const Constants *k = &cal->constants;
    double values[MOVES][VALUES];
    Prediction found[MOVES];
    Said said = {0, 0, 0, 0, NAN};
    int measured = !(features->flags & INVALIDATING);
    for (int m = 0; m < (measured ? MOVES : 1); m++) {
        compute_regressors(cal, c, turn, features, m, values[m]);
        chain_predict(cal, c, values[m], scratch, &found[m]);
    }
    said.traction = values[AS_READ][V_TRACTION];
    said.unknown = condition_unknown(c, values[AS_READ]);
    e->radius = found[AS_READ].radius;
    if (!measured) return said; /* what else there is to say would be of no use */
    said.unlike = chain_unlike(cal, c, values, &found[AS_READ], turn->angle_std);
    said.extrapolated = extrapolated(&c->laws, k, values[AS_READ]) ||
                        (c->force.there && extrapolated(&c->force_laws, k, values[AS_READ]));
    for (int q = 0; q < QUANTITIES; q++) {
        const Estimate *here = &found[AS_READ].of[q];
        if (!here->there) continue;
        if (here->by_camber * here->by_camber > 0.5 * (here->std * here->std)) said.tilted = 1;
        /* what an uncertain wheel angle and offset leave: tirelib.estimators.doubt */
        double share = turn->angle_std / k->angle_step;
        double by_angle = (found[LONGER].of[q].value - here->value) * share;
        double by_offset = found[HIGHER].of[q].value - here->value;
        e->value[q] = here->value;
        e->std[q] = hypot(here->std, hypot(by_angle, by_offset));
        e->valid[q] = here->valid;
    }
    e->std[KAPPA] = hypot(e->std[KAPPA], (1.0 + e->value[KAPPA]) * turn->slip_std);
    return said;
}

/* Reference: Rolling.classify */
static int rolling_of(const Calibration *cal, double traction) {
    double apart = traction - cal->rolling_centre;
    if (!isfinite(apart)) return ROLLING_UNKNOWN;
    if (apart > cal->rolling_threshold) return ROLLING_BRAKING;
    return apart < -cal->rolling_threshold ? ROLLING_DRIVING : ROLLING_FREE;
}

/* Reference: tirelib.estimators.contact_length.contact_lengths */
static void contact_lengths(const Calibration *cal, const Turn *turn, const Features *features,
                            Estimates *e) {
    const Constants *k = &cal->constants;
    for (int g = 0; g < cal->gages; g++) {
        double angle = features->trail[g] - features->lead[g];
        double more = k->bias / (1.0 + exp((k->bias_middle - angle) / k->bias_width));
        double read = hypot(k->least_std, k->short_std * exp(-angle / k->short_width));
        e->contact_length[g] = (angle + more) * e->radius;
        e->contact_length_std[g] = hypot(read, angle * turn->angle_std) * e->radius;
    }
}

/* Notes of the conditions for which the calibration does not hold.
 * Reference: Chain.conditions_allowed */
static int conditions_beyond(const Chain *c, const Constants *k, const double *given) {
    int notes = 0;
    for (int i = 0; i < (c->force.there ? 2 : 1); i++) {
        const Laws *laws = i ? &c->force_laws : &c->laws;
        if (!pressure_allowed(laws, k, given)) notes |= PRESSURE_OUT_OF_RANGE;
        if (!speed_allowed(laws, k, given)) notes |= SPEED_OUT_OF_RANGE;
    }
    if (!named_inside(&c->guard[FY], V_CAMBER, given[V_CAMBER]))
        notes |= CAMBER_OUT_OF_RANGE;
    return notes;
}

int quantity_calibrated(const Calibration *calibration, int quantity) {
    const Chain *c = &calibration->chain[ALL_GAGES];
    const Polynomial *model[QUANTITIES] = {&c->load, &c->angle, &c->radius, &c->force};
    return model[quantity]->there;
}

/* What can be used, and why not. Reference: Calibration._finish */
static void finish(const Calibration *cal, const Turn *turn, const Said *said, Estimates *e) {
    const Chain *full = &cal->chain[ALL_GAGES];
    int measured = !(e->flags & INVALIDATING), in_range = 1;
    for (int q = 0; q < QUANTITIES; q++) {
        if (!quantity_calibrated(cal, q)) continue;
        int unfit = measured && !e->valid[q] && !(q == KAPPA && (e->flags & NO_SPEED));
        if (unfit) e->notes |= FZ_OUT_OF_RANGE << q;
        in_range = in_range && !unfit;
        e->valid[q] = e->valid[q] && measured;
    }
    int other = measured && in_range && said->unlike;
    for (int q = 0; q < QUANTITIES; q++) e->valid[q] = e->valid[q] && !other;
    if (e->valid[ALPHA] && e->std[ALPHA] > cal->constants.largest_angle_std) {
        e->valid[ALPHA] = 0;
        e->notes |= ALPHA_SATURATED;
    }
    double given[VALUES];
    given[V_FRICTION] = turn->friction;
    given[V_TREAD_DEPTH] = turn->tread_depth;
    given[V_TREAD_TEMPERATURE] = turn->tread_temperature;
    if (measured && said->extrapolated) e->notes |= CONDITION_EXTRAPOLATED;
    if (measured && said->tilted) e->notes |= CAMBER_UNKNOWN;
    for (int i = 0; i < 3; i++)
        if (measured && !road_plausible(&full->road, given, V_FRICTION + i))
            e->notes |= FRICTION_IMPLAUSIBLE << i;
    given[V_PRESSURE] = turn->pressure;
    given[V_SPEED] = turn->speed;
    given[V_CAMBER] = turn->camber;
    if (measured) e->notes |= conditions_beyond(full, &cal->constants, given);
    if (measured && !in_range) e->flags |= OUT_OF_RANGE;
    if (other) e->flags |= OTHER_TIRE;
    for (int q = 0; q < QUANTITIES && !measured; q++) e->value[q] = e->std[q] = NAN;
    e->turn_valid = measured && in_range && !other;
}

void estimate(const Calibration *cal, const Turn *turn, const Features *features, double *scratch,
              Estimates *e) {
    const Chain *c = chain_for(cal, features);
    Said said = {0, 0, 0, 0, NAN};
    memset(e, 0, sizeof *e);
    for (int q = 0; q < QUANTITIES; q++) e->value[q] = e->std[q] = NAN;
    e->radius = NAN;
    e->flags = features->flags;
    if (c) {
        said = by_chain(cal, c, turn, features, scratch, e);
        if (said.unknown) e->flags |= NO_CONDITION;
    } else {
        e->flags |= TOO_FEW_GAGES;
    }
    finish(cal, turn, &said, e);
    e->rolling = rolling_of(cal, said.traction);
    contact_lengths(cal, turn, features, e);
}
