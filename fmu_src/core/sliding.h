/* The cornering curve on roads of other friction. Reference: tirelib.estimators.sliding. */
#ifndef TIRE_SLIDING_H
#define TIRE_SLIDING_H

#include "calibration.h"

/* Told of the reference; `there` is 0 where it says None. */
typedef struct {
    int there;
    double angle, std, change, slope, sliding;
} Told;

/* Methods of SlidingCurve, same names. */
double curve_cornering(const SlidingCurve *c, const Constants *k, double load);
double curve_stiffer(const SlidingCurve *c, const Constants *k, double load);
double curve_load_power(const SlidingCurve *c, const Constants *k, double load);
double curve_along(const SlidingCurve *c, const Constants *k, double angle, double slip_ratio,
                   double load);
double curve_share(const SlidingCurve *c, const Constants *k, double used, double friction,
                   double load, double along);
double curve_across(const SlidingCurve *c, const Constants *k, double used, double t, double load);
double curve_lateral(const SlidingCurve *c, const Constants *k, double used, double friction,
                     double load, double along, double *t);
Told curve_at(const SlidingCurve *c, const Constants *k, double used, double load, double friction,
              double slip_ratio);
double curve_slope_at(const SlidingCurve *c, const Constants *k, double used, double t,
                      double across, double load, double along);

/* Functions of the reference, same names. */
double angle_of(const Constants *k, double across, double slip_ratio);
double lost_slip(const Constants *k, double used, double most, double along);

#endif
