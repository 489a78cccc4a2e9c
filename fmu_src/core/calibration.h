/* A calibration as a flat table of doubles, which tirelib.estimators.core_table writes.
 *
 * Constants of the estimators stand in the table as well, so that the Python modules are the only
 * place where they are. The structures point into the table; the caller keeps it.
 */
#ifndef TIRE_CALIBRATION_H
#define TIRE_CALIBRATION_H

#include "values.h"

/* Sizes of tirelib.estimators.core_table. */
enum { VARIABLES = 32, TERMS = 256, NAMES = 24, NODES = 64, WHOLE = 6 };
enum { FZ, ALPHA, KAPPA, FY, QUANTITIES };
enum { ALL_GAGES = GAGES }; /* place of the chain without a missing gage */

/* Constants of tirelib.estimators, in the order of core_table.CONSTANTS. */
typedef struct {
    double pressure_low, pressure_high, pressure_doubt, force_exponent, force_doubt;
    double unknown_pressure, fastest, slowest, speed_doubt, speed_unit, radius_share;
    double radius_doubt, calibrated_slack; /* laws */
    double under_grooves, softening, bent, cornering, force, law_doubt; /* unknowns */
    double curve_load, moment_doubt, curve_doubt, sliding_load, sliding_force, free_slip;
    double least_rolling, tiny, steepest, newton; /* sliding */
    double rougher, hidden, hidden_doubt, least_utilisation, smooth, slippery; /* any_road */
    double pull; /* pulled */
    double tilt_usual, tilt_force, tilt_load, tilt_power, tilt_slope, tilt_doubt;
    double tilt_least; /* tilt */
    double road_doubt, unlike_pressure, unlike_speed, slope_sliding; /* likeness */
    double widest, angle_step, largest_angle_std; /* chain, doubt, calibration */
    double bias, bias_middle, bias_width, least_std, short_std, short_width; /* contact_length */
} Constants;

/* Variables and terms of a polynomial: number, centre and scale of each variable; exponents. */
typedef struct {
    int variables, terms;
    const double *variable, *exponent;
} Form;

/* tirelib.estimators.polynomial.Polynomial; `there` is 0 where the calibration has none. */
typedef struct {
    int there, bordered;
    Form form;
    double residual, floor, pulled, near, growth, far;
    const double *coefficient, *covariance;
} Polynomial;

/* tirelib.estimators.laws.ConditionLaws */
typedef struct {
    double pressure[2], speed[2], contact_width, radius;
    int pressure_fitted, speed_fitted;
} Laws;

/* tirelib.estimators.unknowns.Road: calibrated ranges, what can be, and what is unknown. */
typedef struct {
    double depth[2], temperature[2], ends[3][2], unknown_wear, unknown_height, unknown_warmth;
} Road;

/* tirelib.estimators.sliding.SlidingCurve; `unseen` is Road.unseen_friction of its friction. */
typedef struct {
    int there;
    double friction, friction_std, grip, sharpness, fading, camber[2], misfit, slant, unseen;
    double stiffness[3], trail[3], ratio[3];
} SlidingCurve;

/* tirelib.estimators.polynomial.Cloud */
typedef struct {
    int there, mirrored, points, name[2];
    double scale[2], reach, around;
    const double *point;
} Cloud;

/* tirelib.estimators.likeness.Likeness; of each regressor: number, and its shifts. */
typedef struct {
    int there, names, angle_slope; /* angle_slope: its place among the names; -1: none */
    Form form;
    double limit, edge;
    const double *name, *coefficient, *covariance;
} Likeness;
enum { SHIFT_NUMBER, SHIFT_PRESSURE, SHIFT_SPEED, SHIFT_ODD, SHIFT_TREAD, SHIFT_SLIDING,
       SHIFT_CAMBER, SHIFTS };

/* Ranges of one quantity: number (-1: the quantity itself), lowest, highest, may be unknown. */
typedef struct {
    int ranges;
    const double *range;
} Guard;
enum { RANGE_NUMBER, RANGE_LOW, RANGE_HIGH, RANGE_OPTIONAL, RANGE_WIDTH };

/* tirelib.estimators.chain.Chain, and what follows from its ranges. */
typedef struct {
    int there, gages, gage[GAGES];
    const double *line, *highest; /* fitting matrices: 2 rows of `gages`, 3 for degrees 2 to 4 */
    int needs_pressure, needs_camber, needs_speed, force_knows_camber, radius_knows_load;
    double mean_load, load_per_hardening, widest, camber[2];
    Guard guard[QUANTITIES];
    Laws laws, force_laws;
    Road road;
    Polynomial load, radius, force, angle, moment, drag;
    double blur, bend;
    SlidingCurve sliding;
    Cloud cloud;
    Likeness likeness, agreement;
} Chain;

typedef struct {
    int gages;
    double lateral[GAGES], order, cut_off, rolling_centre, rolling_threshold;
    Constants constants;
    const double *node, *weight; /* of Gauss and Legendre's rule */
    int largest_cloud;
    Chain chain[GAGES + 1];
} Calibration;

/* Return sizeof(Calibration), for hosts that are not C. */
size_t calibration_size(void);

/* Read a table of n doubles. Returns 0, or the place (from 1) at which it is damaged.
 * Reference: tirelib.estimators.calibration_file; test: test_native_estimates. */
size_t calibration_read(Calibration *calibration, const double *table, size_t n);

#endif
