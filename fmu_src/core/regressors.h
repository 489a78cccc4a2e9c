/* Few numbers per turn, from the features of the gages that work. Reference:
 * tirelib.estimators.regressors, and doubt for the moved ones. */
#ifndef TIRE_REGRESSORS_H
#define TIRE_REGRESSORS_H

#include "calibration.h"
#include "features.h"

/* The features as read, with longer angles, with a higher offset. Reference: with_moved */
enum { AS_READ, LONGER, HIGHER, MOVES };

/* Reference: compute_regressors; fills values up to V_SPEED_SQUARED, the rest is NaN. */
void compute_regressors(const Calibration *calibration, const Chain *chain, const Turn *turn,
                        const Features *features, int moved, double *values);

#endif
