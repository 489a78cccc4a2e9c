/* Regressors of a turn and what the chain adds to them, by number; NaN where unknown.
 *
 * Same order as tirelib.estimators.core_table.VALUES, from which the numbers in a table come.
 */
#ifndef TIRE_VALUES_H
#define TIRE_VALUES_H

#include "common.h"

enum {
    V_CONTACT_ANGLE,
    V_COMPRESSION,
    V_TRACTION,
    V_TENSION,
    V_CP1_SLOPE,
    V_CP2_SLOPE,
    V_ANGLE_SLOPE,
    V_TP_SLOPE,
    V_ANGLE_BOW,
    V_TP_BOW,
    V_CP1_BOW,
    V_CP2_BOW,
    V_FULLNESS,
    V_SKEW,
    V_STEEPNESS,
    V_STEEPNESS_CHANGE,
    V_LEAD_BEND,
    V_TRAIL_BEND,
    V_OMEGA,
    V_PRESSURE,
    V_SPEED,
    V_CAMBER,
    V_FRICTION,
    V_TREAD_DEPTH,
    V_TREAD_TEMPERATURE,
    V_ANGLE_TWIST,
    V_CP1_TWIST,
    V_CP2_TWIST,
    V_TP_TWIST,
    V_ANGLE_WAVE,
    V_CP1_WAVE,
    V_CP2_WAVE,
    V_TP_WAVE,
    V_SPEED_SQUARED,
    V_LOAD,
    V_SLIP_RATIO,
    V_SLIP_STD,
    V_SLIP_SIZE,
    V_UTILISATION,
    VALUES
};

/* numpy.maximum, numpy.minimum: NaN where one is; fmax and fmin are numpy.fmax and numpy.fmin. */
static inline double maximum(double a, double b) { return isnan(a) || a > b ? a : b; }
static inline double minimum(double a, double b) { return isnan(a) || a < b ? a : b; }

/* numpy.nan_to_num, of numbers that are not infinite. */
static inline double or_else(double x, double otherwise) { return isnan(x) ? otherwise : x; }

#endif
