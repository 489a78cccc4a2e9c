/* Estimates of one turn. Reference: tirelib.estimators.calibration. */
#ifndef TIRE_ESTIMATES_H
#define TIRE_ESTIMATES_H

#include "calibration.h"
#include "features.h"

/* Notes of the reference, in the order in which it gives them. */
enum {
    FZ_OUT_OF_RANGE = 1,
    ALPHA_OUT_OF_RANGE = 2,
    KAPPA_OUT_OF_RANGE = 4,
    FY_OUT_OF_RANGE = 8,
    ALPHA_SATURATED = 16,
    CONDITION_EXTRAPOLATED = 32,
    CAMBER_UNKNOWN = 64,
    FRICTION_IMPLAUSIBLE = 128,
    TREAD_DEPTH_IMPLAUSIBLE = 256,
    TREAD_TEMPERATURE_IMPLAUSIBLE = 512,
    PRESSURE_OUT_OF_RANGE = 1024,
    SPEED_OUT_OF_RANGE = 2048,
    CAMBER_OUT_OF_RANGE = 4096
};
enum { ROLLING_UNKNOWN, ROLLING_FREE, ROLLING_BRAKING, ROLLING_DRIVING };

/* Estimates of the reference, of one turn: Fz, alpha, kappa, Fy; SI, ISO 8855. */
typedef struct {
    double value[QUANTITIES], std[QUANTITIES];
    double radius, contact_length[GAGES], contact_length_std[GAGES];
    int valid[QUANTITIES];
    int turn_valid, flags, notes, rolling;
} Estimates;

/* How many doubles `estimate` needs to work. */
size_t estimate_scratch(const Calibration *calibration);

/* Whether the chain of all gages knows a quantity. Reference: Chain.has; test: test_native_wheel. */
int quantity_calibrated(const Calibration *calibration, int quantity);

/* The chain of the gages that work; NULL if there is none. */
const Chain *chain_for(const Calibration *calibration, const Features *features);

/* Reference: Calibration.estimate; test: test_native_estimates. */
void estimate(const Calibration *calibration, const Turn *turn, const Features *features,
              double *scratch, Estimates *estimates);

#endif
