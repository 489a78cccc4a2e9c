#include "sliding.h"

/* Reference: _power_series */
static double power_series(const double logs[3], const Constants *k, double load) {
    double x = log(load / k->curve_load);
    return exp(logs[0] + (logs[1] + logs[2] * x) * x);
}

double curve_cornering(const SlidingCurve *c, const Constants *k, double load) {
    return power_series(c->stiffness, k, load);
}

double curve_stiffer(const SlidingCurve *c, const Constants *k, double load) {
    return power_series(c->ratio, k, load);
}

double curve_load_power(const SlidingCurve *c, const Constants *k, double load) {
    return c->stiffness[1] + 2.0 * c->stiffness[2] * log(load / k->curve_load);
}

double curve_along(const SlidingCurve *c, const Constants *k, double angle, double slip_ratio,
                   double load) {
    double slip = cos(angle) / maximum(1.0 + slip_ratio, k->least_rolling) - 1.0;
    return curve_stiffer(c, k, load) * or_else(slip, 0.0);
}

double curve_share(const SlidingCurve *c, const Constants *k, double used, double friction,
                   double load, double along) {
    double n = c->sharpness, effective = c->grip * friction, across = used / effective;
    double pull = fabs(curve_cornering(c, k, load) * along) / (n * effective);
    double alone = 1.0 - pow(maximum(1.0 - across, 0.0), 1.0 / n), before = NAN;
    double t = maximum(alone, minimum(pull, 1.0));
    if (!(pull > 0.0)) return alone;
    for (int i = 0; i < (int)k->newton && t != before; i++) { /* one that stays, stays */
        double at = maximum(t, k->tiny), rest = pow(1.0 - at, n - 1.0);
        double filled = maximum(1.0 - rest * (1.0 - at), k->tiny);
        double a = pull / at * (pull / at), b = across / filled * (across / filled);
        double fall = 2.0 * (a / at + b * n * rest / filled);
        before = t;
        t = minimum(t + maximum(a + b - 1.0, 0.0) / maximum(fall, k->tiny), 1.0);
    }
    return t;
}

double curve_across(const SlidingCurve *c, const Constants *k, double used, double t, double load) {
    double n = c->sharpness, filled = maximum(1.0 - pow(1.0 - t, n), k->tiny);
    return used / curve_cornering(c, k, load) * (t > 0.0 ? n * t / filled : 1.0);
}

double curve_lateral(const SlidingCurve *c, const Constants *k, double used, double friction,
                     double load, double along, double *t) {
    *t = curve_share(c, k, used, friction, load, along);
    double within = curve_across(c, k, used, *t, load);
    double lost = lost_slip(k, used, c->grip * friction, fabs(along));
    return isfinite(lost) ? maximum(within, lost) : within;
}

Told curve_at(const SlidingCurve *c, const Constants *k, double used, double load, double friction,
              double slip_ratio) {
    Told told = {1, NAN, 0.0, 0.0, NAN, NAN};
    double here, there, unused;
    double free = atan(curve_lateral(c, k, used, c->friction, load, 0.0, &unused));
    double along = curve_along(c, k, free, slip_ratio, load);
    double across = curve_lateral(c, k, used, friction, load, along, &here);
    double usual = curve_lateral(c, k, used, c->friction, load, along, &there);
    double more = c->friction_std / c->friction;
    told.angle = angle_of(k, across, slip_ratio);
    if (friction != c->friction) {
        double moved = 0.0 * told.angle;
        if (more > 0.0) {
            double lower =
                curve_lateral(c, k, used, friction * (1.0 - more), load, along, &unused);
            moved = angle_of(k, lower, slip_ratio) - told.angle;
        }
        told.change = told.angle - angle_of(k, usual, slip_ratio);
        told.std = hypot(k->curve_doubt * told.change, moved);
    }
    if (!(used < c->grip * friction)) told.std = INFINITY;
    told.slope = curve_slope_at(c, k, used, here, across, load, along);
    told.sliding = fabs(here - there);
    return told;
}

double curve_slope_at(const SlidingCurve *c, const Constants *k, double used, double t,
                      double across, double load, double along) {
    double square = maximum(across * across + along * along, k->tiny);
    double rest = pow(maximum(1.0 - t, k->steepest), c->sharpness - 1.0);
    double pulled = used / maximum(across, k->tiny) * (along * along);
    double cornering = curve_cornering(c, k, load);
    return square / (pulled + cornering * rest * (across * across) + k->tiny);
}

double angle_of(const Constants *k, double across, double slip_ratio) {
    if (isnan(slip_ratio)) return atan(across);
    double sine = minimum(across * maximum(1.0 + slip_ratio, k->least_rolling), 1.0);
    return asin(or_else(sine, 0.0));
}

double lost_slip(const Constants *k, double used, double most, double along) {
    double ratio = most / used;
    if (!(most > used)) return INFINITY;
    return along / sqrt(maximum(ratio * ratio - 1.0, k->tiny));
}
