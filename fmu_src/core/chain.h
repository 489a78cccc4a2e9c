/* The chain of estimators of one gage set. Reference: tirelib.estimators.chain.Chain. */
#ifndef TIRE_CHAIN_H
#define TIRE_CHAIN_H

#include "any_road.h"
#include "calibration.h"

/* Estimate of the reference; `there` is 0 where the quantity is not calibrated. `slid` is 0 where
 * its `sliding` is None. */
typedef struct {
    int there, valid, slid;
    double value, std, by_camber, sliding;
} Estimate;

/* What the chain says of one turn, Chain.predict's result. */
typedef struct {
    Estimate of[QUANTITIES];
    double radius;
} Prediction;

/* Reference: Chain.predict. `values` are the regressors; what the chain finds is added. `scratch`
 * holds a double for each calibrated combination. */
void chain_predict(const Calibration *calibration, const Chain *chain, double *values,
                   double *scratch, Prediction *result);

/* Reference: Chain.unlike, of the regressors of the three moves and of what was found as read. */
int chain_unlike(const Calibration *calibration, const Chain *chain, double values[3][VALUES],
                 const Prediction *found, double angle_std);

#endif
