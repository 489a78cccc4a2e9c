#include "chain.h"

#include <string.h>

#include "laws.h"
#include "likeness.h"
#include "polynomial.h"
#include "unknowns.h"

/* What all links of a chain look at. */
typedef struct {
    const Calibration *calibration;
    const Constants *k;
    const Chain *chain;
    double *values;
    int near_load, near_force; /* whether it lies near the data of load and force */
} Turned;

/* Reference: Estimate.widened */
static void widen(Estimate *e, double more) {
    e->std = hypot(e->std, more);
    e->valid = e->valid && isfinite(more);
}

/* Reference: Chain._valid and STANDS_ON */
static int valid(const Turned *t, int quantity, double value, double std) {
    if (!isfinite(value) || !isfinite(std)) return 0;
    if ((quantity == FZ || quantity == ALPHA) && !t->near_load) return 0;
    if ((quantity == FY || quantity == ALPHA) && !t->near_force) return 0;
    return all_inside(&t->chain->guard[quantity], t->values, value);
}

/* Standard deviation that an unknown or corrected tread leaves, per unit of what it does. */
static double hardening_std(const Turned *t, double doubt_of_known) {
    double unknown, harder = hardened(&t->chain->road, t->k, t->values, &unknown);
    return hypot(unknown, doubt_of_known * harder);
}

/* Reference: the load in Chain.predict */
static void find_load(Turned *t, int calibrated, Estimate *e) {
    const Chain *c = t->chain;
    double extra, unused;
    double load = judged(&c->load, t->k, t->values, &e->std, &t->near_load);
    load += load_correction(&c->laws, t->k, t->values, &extra);
    load += c->load_per_hardening * hardened(&c->road, t->k, t->values, &unused);
    e->std = hypot(e->std, extra + speed_spread(&c->laws, t->k, t->values, load));
    e->value = load;
    e->valid = valid(t, FZ, load, e->std) && calibrated;
    e->there = 1;
}

/* The radius that the model tells at a load. */
static double radius_at(const Turned *t, double load, double *std) {
    double at[VALUES];
    memcpy(at, t->values, sizeof at);
    at[V_LOAD] = load;
    return predicted(&t->chain->radius, t->k, at, std);
}

/* Reference: Chain._rolling_radius */
static double rolling_radius(const Turned *t, const Estimate *load, double *std) {
    const Chain *c = t->chain;
    const Constants *k = t->k;
    double at[VALUES], unused, unknown, known = load->there && load->valid;
    double load_here = known ? t->values[V_LOAD] : c->mean_load;
    double equal = equivalent_load(&c->laws, load_here, t->values);
    double radius = radius_at(t, equal, std);
    *std = hypot(*std, k->radius_share * fabs(radius - radius_at(t, load_here, &unused)));
    *std = hypot(*std, k->radius_doubt * radius * speed_departure(&c->laws, k, t->values));
    double lost = worn(&c->road, t->values, &unknown);
    double share = fmin(k->bent / t->values[V_CONTACT_ANGLE], 1.0);
    double doubt = share * hypot(unknown, k->law_doubt * lost);
    if (c->radius_knows_load) {
        memcpy(at, t->values, sizeof at);
        at[V_LOAD] = equal;
        double per_load = fabs(slope_by(&c->radius, at, V_LOAD));
        double away = 0.5 * c->mean_load * per_load;
        if (load->there) {
            double told =
                radius_at(t, equivalent_load(&c->laws, load->value, t->values), &unused);
            away = known ? per_load * load->std : fmax(away, fabs(told - radius));
        }
        *std = hypot(*std, away); /* one tread is behind both doubts below */
        doubt += per_load * (c->load_per_hardening * hardening_std(t, k->law_doubt));
    }
    *std = hypot(*std, doubt);
    return radius - share * lost;
}

/* Reference: the slip ratio in Chain.predict */
static void find_slip(const Turned *t, int plausible, Prediction *result) {
    Estimate *e = &result->of[KAPPA];
    double std, speed = t->values[V_SPEED], gain = t->values[V_OMEGA] / speed;
    result->radius = rolling_radius(t, &result->of[FZ], &std);
    e->value = speed > 0.0 ? gain * result->radius - 1.0 : NAN;
    e->std = fabs(gain) * std;
    t->values[V_SLIP_RATIO] = e->value;
    t->values[V_SLIP_STD] = e->std;
    Ends rolls = slip_range(t->values[V_CONTACT_ANGLE]);
    /* the radius depends on the pressure; at a low speed it is what it is at a higher one */
    e->valid = valid(t, KAPPA, e->value, e->std) && plausible && e->value > rolls.low &&
               !(e->value >= rolls.high) &&
               pressure_allowed(&t->chain->laws, t->k, t->values) &&
               not_too_fast(&t->chain->laws, t->k, t->values);
    e->there = 1;
}

/* What is known of a tread that slides more than it was calibrated. Reference: Chain._slid */
static Told slid(const Turned *t, const double *values, double force, double load) {
    const Chain *c = t->chain;
    const SlidingCurve *curve = &c->sliding;
    const Constants *k = t->k;
    Told told = {0, NAN, NAN, NAN, NAN, NAN};
    if (!curve->there) return told;
    double camber = or_else(values[V_CAMBER], 0.0), slip = values[V_SLIP_RATIO];
    double friction = road_said(&c->road, values, V_FRICTION);
    load = maximum(load, 1.0);
    double used = -force / load - curve->camber[0] * camber, side = used < 0.0 ? -1.0 : 1.0;
    if (isfinite(friction)) {
        told = curve_at(curve, k, fabs(used), load, friction, slip);
    } else {
        Seen seen = {fabs(used), load, slip, c->radius.there ? values[V_SLIP_STD] : 0.0 * used,
                     0.0, INFINITY, 0.0, INFINITY, curve->unseen};
        if (c->moment.there) {
            double std, moment = predicted(&c->moment, k, values, &std);
            double doubt = hypot(curve->misfit, k->moment_doubt * curve->unseen);
            seen.moment = (moment - curve->camber[1] * camber) * side;
            seen.moment_std = fabs(slip) <= k->free_slip ? hypot(std, doubt) : INFINITY;
        }
        if (c->drag.there) {
            seen.pull = predicted(&c->drag, k, values, &seen.pull_std);
            if (!isfinite(slip)) seen.pull_std = INFINITY;
        }
        told = tell(t->calibration, curve, &seen, c->widest);
    }
    told.change *= side;
    told.sliding *= curve->unseen;
    return told;
}

/* The part of Fy that is a camber's, and its standard deviation. Reference: Chain._tilt and
 * tirelib.estimators.tilt */
static double tilt(const Turned *t, double force, double load, double *std) {
    const Chain *c = t->chain;
    const Constants *k = t->k;
    double camber = t->values[V_CAMBER], leaning = 0.0, weight = 0.0, noise, rest;
    *std = 0.0;
    if (c->force_knows_camber) return 0.0;
    double size = maximum(load, k->tilt_least) / k->tilt_load;
    double per_camber = k->tilt_force * pow(size, k->tilt_power);
    if (!isnan(camber)) {
        double away = camber - minimum(maximum(camber, c->camber[0]), c->camber[1]);
        *std = per_camber * fabs(or_else(away, 0.0));
        return 0.0;
    }
    *std = k->tilt_usual;
    if (c->likeness.there) {
        Told known = slid(t, t->values, force, load);
        rest = slope_left(&c->likeness, k, t->values, known.there ? known.sliding : 0.0, &noise);
        if (isfinite(rest) && isfinite(noise)) {
            double ratio = k->tilt_slope * k->tilt_usual / noise;
            weight = ratio * ratio;
            leaning = weight / (1.0 + weight) * rest / k->tilt_slope;
        }
        *std = k->tilt_usual / sqrt(1.0 + weight);
    }
    *std = per_camber * hypot(*std, k->tilt_doubt * leaning);
    return per_camber * leaning;
}

/* Reference: AngleModel.predict */
static double angle_from(const Turned *t, double spread, double *std) {
    const Chain *c = t->chain;
    double value = predicted(&c->angle, t->k, t->values, std);
    double slope = slope_by(&c->angle, t->values, V_UTILISATION);
    double blurred = maximum(c->blur, spread) * slope, bent = c->bend * (slope * slope);
    *std = sqrt(*std * *std + blurred * blurred + bent * bent);
    return value;
}

/* Reference: Chain._slip_angle */
static void find_angle(const Turned *t, double load, double spread, const Told *told, int calibrated,
                       Estimate *e) {
    const Chain *c = t->chain;
    const Constants *k = t->k;
    double std, unknown, angle = angle_from(t, spread, &std);
    double slope = fabs(slope_by(&c->angle, t->values, V_UTILISATION));
    int known = isfinite(angle);
    if (told->there) { /* flatter than where it was calibrated */
        double flatter = sqrt(fmax(told->slope * told->slope - slope * slope, 0.0));
        double blurred = fmax(c->blur, spread) * flatter;
        angle += told->change;
        known = isfinite(told->std);
        std = sqrt(std * std + told->std * told->std + blurred * blurred);
        slope = told->slope;
    }
    double harder = hardened(&c->road, k, t->values, &unknown);
    /* a stiffer tread hides load, so the utilisation seems larger, and turns it into more force */
    double lighter = slope * fabs(t->values[V_UTILISATION]);
    if (c->sliding.there) /* and the tire is stiffer for its load than it seems */
        lighter += curve_load_power(&c->sliding, k, maximum(load, 1.0)) * fabs(angle);
    double both = maximum(lighter, 0.0) * (c->load_per_hardening / fabs(load));
    double doubt = (both + k->cornering * fabs(angle)) * hypot(unknown, k->law_doubt * harder);
    e->value = angle * (1.0 - k->cornering * harder);
    e->std = fmin(hypot(std, doubt), k->widest);
    e->valid = known && valid(t, ALPHA, e->value, e->std) && calibrated;
    e->there = 1;
}

/* Reference: Chain._lateral */
static void find_lateral(Turned *t, double load, int calibrated, Prediction *result) {
    const Chain *c = t->chain;
    const Constants *k = t->k;
    Estimate *e = &result->of[FY], *fz = &result->of[FZ];
    double std, doubt, tilted, force = judged(&c->force, k, t->values, &std, &t->near_force);
    double factor = force_factor(&c->force_laws, k, t->values, &doubt);
    double law = doubt * fabs(force);
    law += speed_spread(&c->force_laws, k, t->values, factor * force);
    calibrated = calibrated && conditions_allowed(&c->force_laws, k, t->values);
    double leaning = tilt(t, factor * force, load, &tilted);
    force = factor * force - leaning;
    std = hypot(hypot(factor * std, law), tilted);
    e->there = 1;
    e->value = force;
    e->valid = valid(t, FY, force, std) && calibrated;
    e->std = std;
    e->by_camber = isnan(t->values[V_CAMBER]) ? tilted : 0.0;
    t->values[V_UTILISATION] = force / load;
    double load_std = fz->there ? fz->std : 0.0;
    double spread = hypot(std, t->values[V_UTILISATION] * load_std) / fabs(load);
    Told told = slid(t, t->values, force, load);
    if (c->angle.there) find_angle(t, load, spread, &told, calibrated, &result->of[ALPHA]);
    widen(e, k->force * hardening_std(t, 1.0) * fabs(force));
    if (!told.there) return;
    double share = or_else(told.sliding, 1.0); /* any, where no slip angle fits */
    widen(e, k->sliding_force * share * fabs(force));
    e->slid = 1;
    e->sliding = told.sliding;
    if (fz->there) widen(fz, k->sliding_load * share * fabs(load));
}

void chain_predict(const Calibration *calibration, const Chain *c, double *values, double *scratch,
                   Prediction *result) {
    const Constants *k = &calibration->constants;
    Turned t = {calibration, k, c, values, 1, 1};
    int plausible = 1;
    memset(result, 0, sizeof *result);
    result->radius = NAN;
    for (int i = V_FRICTION; i <= V_TREAD_TEMPERATURE; i++)
        plausible = plausible && road_plausible(&c->road, values, i);
    int calibrated = conditions_allowed(&c->laws, k, values) && plausible;
    if (c->cloud.there) calibrated = calibrated && in_cloud(&c->cloud, values, scratch);
    values[V_LOAD] = c->mean_load;
    if (c->load.there) {
        find_load(&t, calibrated, &result->of[FZ]);
        values[V_LOAD] = result->of[FZ].value;
    }
    if (c->radius.there) find_slip(&t, plausible, result);
    values[V_SLIP_SIZE] = fabs(values[V_SLIP_RATIO]);
    if (c->force.there) find_lateral(&t, values[V_LOAD], calibrated, result);
    if (c->load.there)
        widen(&result->of[FZ], c->load_per_hardening * hardening_std(&t, k->law_doubt));
    /* Reference: Chain._slip_calibrated */
    if (c->radius.there && !named_inside(&c->guard[KAPPA], -1, result->of[KAPPA].value))
        for (int q = 0; q < QUANTITIES; q++)
            if (q != KAPPA) result->of[q].valid = 0;
}

/* Whether a turn shows what one of the two does not know. */
static int unlike(const Calibration *calibration, const Chain *c, const Likeness *l,
                  double values[3][VALUES], const Prediction *found, double angle_std) {
    const Constants *k = &calibration->constants;
    double here[NAMES], longer[NAMES], higher[NAMES];
    Look look;
    if (!l->there) return 0;
    likeness_rest(l, values[0], here);
    likeness_rest(l, values[1], longer);
    likeness_rest(l, values[2], higher);
    for (int i = 0; i < l->names; i++) {
        longer[i] = (longer[i] - here[i]) * (angle_std / k->angle_step);
        higher[i] -= here[i];
    }
    look.sliding = NAN;
    if (found->of[FZ].there && found->of[FY].there && found->of[FY].slid) {
        double side = found->of[FY].value > 0.0 ? -1.0 : 1.0;
        look.sliding = side * or_else(found->of[FY].sliding, 1.0); /* any, where no angle fits */
    }
    look.values = values[0];
    look.laws = &c->laws;
    look.force_laws = &c->force_laws;
    look.tread = hardened(&c->road, k, values[0], &look.tread_std);
    look.camber = isnan(values[0][V_CAMBER]) ? k->tilt_usual : 0.0;
    look.moves[0] = longer;
    look.moves[1] = higher;
    return likeness_apart(l, k, &look) > l->limit;
}

int chain_unlike(const Calibration *calibration, const Chain *c, double values[3][VALUES],
                 const Prediction *found, double angle_std) {
    return unlike(calibration, c, &c->likeness, values, found, angle_std) ||
           unlike(calibration, c, &c->agreement, values, found, angle_std);
}
