#include "unknowns.h"

static double clipped(double x, const double range[2]) {
    return minimum(maximum(x, range[0]), range[1]);
}

int road_plausible(const Road *road, const double *values, int value) {
    const double *end = road->ends[value - V_FRICTION];
    return !(values[value] < end[0]) && !(values[value] > end[1]);
}

double road_said(const Road *road, const double *values, int value) {
    return road_plausible(road, values, value) ? values[value] : NAN;
}

double worn(const Road *road, const double *values, double *std) {
    double depth = road_said(road, values, V_TREAD_DEPTH);
    double lost = clipped(depth, road->depth) - depth;
    *std = isfinite(lost) ? 0.0 : road->unknown_wear;
    return isfinite(lost) ? lost : 0.0;
}

double hardened(const Road *road, const Constants *k, const double *values, double *std) {
    double depth = road_said(road, values, V_TREAD_DEPTH), under = k->under_grooves;
    double temperature = road_said(road, values, V_TREAD_TEMPERATURE);
    double wear = -log((depth + under) / (clipped(depth, road->depth) + under));
    double warmer = temperature - clipped(temperature, road->temperature);
    double height_std = isfinite(wear) ? 0.0 : road->unknown_height;
    double warmth_std = isfinite(warmer) ? 0.0 : k->softening * road->unknown_warmth;
    *std = hypot(height_std, warmth_std);
    return (isfinite(wear) ? wear : 0.0) - (isfinite(warmer) ? k->softening * warmer : 0.0);
}
