/* What of a turn is out of range, in numbers, for the importer's log. Reference: tirelib.fmu.remarks */
#ifndef TIRE_REMARKS_H
#define TIRE_REMARKS_H

#include "wheel.h"

/* Kinds, in the order of the reference's TEXTS. */
enum {
    FRICTION_REMARK,
    TREAD_DEPTH_REMARK,
    TREAD_TEMPERATURE_REMARK,
    PRESSURE_REMARK,
    SPEED_REMARK,
    CAMBER_REMARK,
    OMEGA_REMARK,
    FZ_REMARK,
    ALPHA_REMARK,
    KAPPA_REMARK,
    FY_REMARK,
    STRAIN_REMARK,
    COMBINATION_REMARK,
    OTHER_TIRE_REMARK,
    IMPLAUSIBLE_REMARK,
    STEP_REMARK,
    REMARKS
};

/* `name`: which regressor it is, in a remark about the strain. */
typedef struct {
    int holds, name;
    double value, low, high;
} Remark;

/* What holds for the last turn of a wheel to which the turn rate `omega` is given now.
 * Reference: remarks; test: test_native_fmu. */
void wheel_remarks(const Wheel *wheel, double omega, Remark remark[REMARKS]);

/* What cannot be strain in a sample of all gages. Reference: strain_remark; test: test_remarks. */
Remark strain_remark(const double *sample, int gages);

/* Whether a step brings more samples than a frame holds. Reference: step_remark; test: test_remarks. */
Remark step_remark(double count, int samples);

#endif
