/* Polynomials in standardised regressors. Reference: tirelib.estimators.polynomial, border,
 * pulled. Test of all: test_native_estimates. */
#ifndef TIRE_POLYNOMIAL_H
#define TIRE_POLYNOMIAL_H

#include "calibration.h"

/* The value of a variable, standardised. */
double standardised(const Form *form, int variable, const double *values);

/* The terms' values. Reference: design */
void design(const Form *form, const double *values, double *terms);

/* Value, standard deviation, and whether the data are near. Reference: Polynomial.judge */
double judged(const Polynomial *p, const Constants *k, const double *values, double *std, int *near);

/* Value and standard deviation. Reference: Polynomial.predict */
double predicted(const Polynomial *p, const Constants *k, const double *values, double *std);

/* Derivative by a value. Reference: Polynomial.slope */
double slope_by(const Polynomial *p, const double *values, int value);

/* Whether a quantity and its regressors lie in their ranges. Reference: all_inside */
int all_inside(const Guard *guard, const double *values, double own);

/* Whether a value lies in its calibrated range, or is not known; number -1: the quantity itself. */
int named_inside(const Guard *guard, int number, double value);

/* Whether a combination of two regressors was calibrated; `scratch` holds a double for each point,
 * and for each mirrored one. Reference: Cloud.inside */
int in_cloud(const Cloud *cloud, const double *values, double *scratch);

#endif
