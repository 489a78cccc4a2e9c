#include "features.h"

enum { INTEGRAL_POINTS = 65 };
static const double AFTER = 20.0 * (3.14159265358979323846 / 180.0);
static const double EDGE_REACH = 0.35, COMPRESSION_REACH = 0.6;

/* A peak of a curve: where, how high, and whether it stands at the border of its range. */
typedef struct {
    double angle, value;
    int at_border;
} Peak;

/* Largest of sign * y where the wheel angle is from `low` to `high`, refined by a parabola.
 * Reference: tirelib.measured.features.peaks.peak */
static Peak peak(const double *y, double sign, double low, double high) {
    Peak found = {NAN, NAN, 0};
    double start = phi_at(0), spacing = phi_at(1) - phi_at(0), highest = -INFINITY;
    int index = -1, first = phi_before(low), stop = phi_before(high);
    while (first < ANGLES && !(phi_at(first) >= low)) first++;
    while (stop < ANGLES && phi_at(stop) <= high) stop++;
    for (int k = first; k < stop; k++)
        if (sign * y[k] > highest && isfinite(y[k])) highest = sign * y[k], index = k;
    if (index < 0) return found;
    int at = index < 1 ? 1 : index > ANGLES - 2 ? ANGLES - 2 : index;
    double a = sign * y[at - 1], b = sign * y[at], c = sign * y[at + 1];
    int inside = at == index || (phi_at(at) >= low && phi_at(at) <= high && isfinite(b));
    found.at_border = !(b >= a && b >= c && inside);
    if (found.at_border) {
        found.angle = start + spacing * index;
        found.value = highest;
        return found;
    }
    double bend = a - 2.0 * b + c, shift = bend == 0.0 ? 0.0 : 0.5 * (a - c) / bend;
    found.angle = start + spacing * (at + shift);
    found.value = b - 0.25 * (a - c) * shift;
    return found;
}

/* Strain between two wheel angles of the grid; NaN where one of them is. */
static double between(const double *strain, double position) {
    if (isnan(position)) return NAN;
    int index = position < 0.0 ? 0 : position > ANGLES - 2 ? ANGLES - 2 : (int)position;
    return strain[index] + (strain[index + 1] - strain[index]) * (position - index);
}

/* Integrals over the contact angle of gage g, by the trapezoidal rule. Reference: _integrals */
static void integrals(const double *strain, int g, Features *f) {
    double values[INTEGRAL_POINTS], lead = f->lead[g], length = f->trail[g] - lead;
    double share_step = 1.0 / (INTEGRAL_POINTS - 1), step = length * share_step;
    double vertical = 0.0, friction = 0.0, moment = 0.0;
    for (int k = 0; k < INTEGRAL_POINTS; k++) {
        double where = 0.5 * (lead + f->trail[g]) + length * (k * share_step - 0.5);
        values[k] = between(strain, (where - phi_at(0)) / (phi_at(1) - phi_at(0)));
    }
    for (int k = 0; k < INTEGRAL_POINTS; k++) {
        double weight = k == 0 || k == INTEGRAL_POINTS - 1 ? 0.5 : 1.0;
        double odd = 0.5 * fabs(values[k] - values[INTEGRAL_POINTS - 1 - k]);
        vertical += values[k] * weight * step;
        friction += odd * weight * step;
        moment += values[k] * weight * step * (length * (k * share_step - 0.5));
    }
    f->e_vertical[g] = vertical;
    f->e_friction[g] = length * 0.5 * friction;
    f->skew[g] = moment / vertical;
}

void extract_features(const Turn *turn, int gages, Features *f) {
    f->flags = turn->flags;
    for (int g = 0; g < gages; g++) {
        const double *strain = turn->strain + g * ANGLES, *rate = turn->rate + g * ANGLES;
        Peak lead = peak(rate, 1.0, -turn->pulse - EDGE_REACH, 0.0);
        Peak trail = peak(rate, -1.0, 0.0, turn->pulse + AFTER);
        Peak before = peak(strain, -1.0, lead.angle - COMPRESSION_REACH, lead.angle);
        Peak after = peak(strain, -1.0, trail.angle, INFINITY);
        Peak inside = peak(strain, 1.0, lead.angle, trail.angle);
        f->lead[g] = lead.angle;
        f->trail[g] = trail.angle;
        f->rate_lead[g] = lead.value;
        f->rate_trail[g] = -trail.value;
        f->cp1[g] = -before.value;
        f->cp2[g] = -after.value;
        f->tp[g] = inside.value;
        f->cp1_angle[g] = before.angle;
        f->cp2_angle[g] = after.angle;
        f->tp_angle[g] = inside.angle;
        f->gage_flags[g] = turn->gage_flags[g];
        if (lead.at_border || trail.at_border) f->gage_flags[g] |= WEAK_EDGE;
        f->flags |= f->gage_flags[g] & WEAK_EDGE;
        integrals(strain, g, f);
    }
}
