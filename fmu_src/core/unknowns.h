/* What nobody measures on the road. Reference: tirelib.estimators.unknowns.Road, same names. */
#ifndef TIRE_UNKNOWNS_H
#define TIRE_UNKNOWNS_H

#include "calibration.h"

/* Whether friction, depth or temperature (from V_FRICTION on) can be; unknown ones can. */
int road_plausible(const Road *road, const double *values, int value);
double road_said(const Road *road, const double *values, int value);
double worn(const Road *road, const double *values, double *std);
double hardened(const Road *road, const Constants *k, const double *values, double *std);

#endif
