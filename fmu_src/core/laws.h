/* What is assumed of conditions that a calibration did not vary. Reference:
 * tirelib.estimators.laws, functions and methods of the same names. */
#ifndef TIRE_LAWS_H
#define TIRE_LAWS_H

#include "calibration.h"

/* Lowest and highest value. */
typedef struct {
    double low, high;
} Ends;

double load_correction(const Laws *laws, const Constants *k, const double *values, double *std);
double force_factor(const Laws *laws, const Constants *k, const double *values, double *std);
double equivalent_load(const Laws *laws, double load, const double *values);
Ends pressure_range(const Laws *laws, const Constants *k);
Ends slip_range(double contact_angle);
Ends speed_range(const Laws *laws, const Constants *k);
int pressure_allowed(const Laws *laws, const Constants *k, const double *values);
int not_too_fast(const Laws *laws, const Constants *k, const double *values);
int speed_allowed(const Laws *laws, const Constants *k, const double *values);
int conditions_allowed(const Laws *laws, const Constants *k, const double *values);
double speed_departure(const Laws *laws, const Constants *k, const double *values);
double speed_spread(const Laws *laws, const Constants *k, const double *values, double value);
double pressure_departure(const Laws *laws, const Constants *k, const double *values,
                          double *unknown);
int extrapolated(const Laws *laws, const Constants *k, const double *values);

#endif
