#include "laws.h"

static double reference_pressure(const Laws *laws) {
    return 0.5 * (laws->pressure[0] + laws->pressure[1]);
}

/* Whether a law must stand for a pressure that was not varied. */
static int needs_law(const Laws *laws) {
    return !laws->pressure_fitted && isfinite(reference_pressure(laws));
}

double load_correction(const Laws *laws, const Constants *k, const double *values, double *std) {
    double width = laws->contact_width * laws->radius, reference = reference_pressure(laws);
    double angle = values[V_CONTACT_ANGLE], pressure = values[V_PRESSURE];
    *std = 0.0;
    if (!needs_law(laws) || !isfinite(width)) return 0.0;
    if (!isfinite(pressure)) {
        *std = k->unknown_pressure * reference * width * angle;
        return 0.0 * width * angle;
    }
    double correction = (pressure - reference) * width * angle;
    *std = k->pressure_doubt * fabs(correction);
    return correction;
}

double force_factor(const Laws *laws, const Constants *k, const double *values, double *std) {
    double pressure = values[V_PRESSURE], reference = reference_pressure(laws);
    *std = 0.0;
    if (!needs_law(laws)) return 1.0;
    if (!(isfinite(pressure) && pressure > 0.0)) {
        *std = k->unknown_pressure;
        return 1.0;
    }
    double ratio = pressure / reference;
    if (ratio > laws->pressure[0] / reference && ratio < laws->pressure[1] / reference) ratio = 1.0;
    double factor = pow(ratio, k->force_exponent);
    *std = k->force_doubt * fabs(factor - 1.0);
    return factor;
}

double equivalent_load(const Laws *laws, double load, const double *values) {
    double ratio = reference_pressure(laws) / values[V_PRESSURE];
    return needs_law(laws) && isfinite(ratio) && ratio > 0.0 ? load * ratio : load;
}

Ends pressure_range(const Laws *laws, const Constants *k) {
    double low = laws->pressure[0], high = laws->pressure[1];
    double slack = k->calibrated_slack * (high - low);
    Ends law = {low * k->pressure_low, high * k->pressure_high};
    Ends fitted = {low - slack, high + slack};
    return laws->pressure_fitted ? fitted : law;
}

Ends slip_range(double contact_angle) {
    Ends ends = {-1.0, 2.0 * PI / contact_angle - 1.0};
    return ends;
}

Ends speed_range(const Laws *laws, const Constants *k) {
    Ends ends = {fmin(k->slowest, 0.95 * laws->speed[0]),
                 laws->speed_fitted ? 1.05 * laws->speed[1] : k->fastest};
    return ends;
}

int pressure_allowed(const Laws *laws, const Constants *k, const double *values) {
    Ends ends = pressure_range(laws, k);
    return !(values[V_PRESSURE] < ends.low) && !(values[V_PRESSURE] > ends.high);
}

int not_too_fast(const Laws *laws, const Constants *k, const double *values) {
    return !(fabs(values[V_SPEED]) > speed_range(laws, k).high);
}

int speed_allowed(const Laws *laws, const Constants *k, const double *values) {
    int slow = fabs(values[V_SPEED]) < speed_range(laws, k).low;
    return !slow && not_too_fast(laws, k, values);
}

int conditions_allowed(const Laws *laws, const Constants *k, const double *values) {
    return pressure_allowed(laws, k, values) && speed_allowed(laws, k, values);
}

double speed_departure(const Laws *laws, const Constants *k, const double *values) {
    double squared = values[V_SPEED] * values[V_SPEED];
    if (!isfinite(laws->speed[1])) return 0.0;
    double above = squared - laws->speed[1] * laws->speed[1];
    double below = laws->speed[0] * laws->speed[0] - squared;
    return fmax(maximum(above, below), 0.0) / k->speed_unit;
}

double speed_spread(const Laws *laws, const Constants *k, const double *values, double value) {
    return k->speed_doubt * speed_departure(laws, k, values) * fabs(value);
}

double pressure_departure(const Laws *laws, const Constants *k, const double *values,
                          double *unknown) {
    double apart = values[V_PRESSURE] / reference_pressure(laws) - 1.0;
    *unknown = 0.0;
    if (!needs_law(laws)) return 0.0;
    if (isfinite(apart)) return apart;
    *unknown = k->unknown_pressure;
    return 0.0;
}

int extrapolated(const Laws *laws, const Constants *k, const double *values) {
    double ratio = values[V_PRESSURE] / reference_pressure(laws), speed = fabs(values[V_SPEED]);
    double slack = laws->speed_fitted ? 0.05 : 0.1;
    if (!laws->pressure_fitted && !(fabs(ratio - 1.0) <= k->calibrated_slack)) return 1;
    return speed > (1.0 + slack) * laws->speed[1] || speed < (1.0 - slack) * laws->speed[0];
}
