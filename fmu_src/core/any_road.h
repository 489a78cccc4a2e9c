/* What utilisation, aligning moment and traction tell of the slip angle on an unknown road.
 * Reference: tirelib.estimators.any_road. */
#ifndef TIRE_ANY_ROAD_H
#define TIRE_ANY_ROAD_H

#include "sliding.h"

/* Seen of the reference, same names. */
typedef struct {
    double used, load, slip_ratio, slip_std, moment, moment_std, pull, pull_std, unseen;
} Seen;

/* Reference: tell */
Told tell(const Calibration *calibration, const SlidingCurve *curve, const Seen *seen,
          double widest);

#endif
