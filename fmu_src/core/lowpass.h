/* Low-pass without phase shift, and the way from time to wheel angle. Reference:
 * tirelib.signal.lowpass. */
#ifndef TIRE_LOWPASS_H
#define TIRE_LOWPASS_H

#include "common.h"

/* The choice of the cut-off: in cycles per turn, or, where `cut_off` is not NaN, in Hz. */
typedef struct {
    double order, cut_off;
} LowPass;

/* Standard deviation of the filter in wheel angle, [rad]. Reference: LowPass.sigma. */
double lowpass_sigma(const LowPass *low_pass, double turn_rate);

/* Reference: LowPass.suits */
int lowpass_suits(const LowPass *low_pass, double turn_rate, double rate);

/* Reference: half_width */
double lowpass_half_width(double sigma);

/* The samples that the filter looks at for one wheel angle, and their weights' sums. */
typedef struct {
    const double *angle; /* of each sample */
    size_t n, reach;
    double sigma;
} Filter;

/* Prepare the filter for samples at given, growing angles; `scratch` holds n doubles.
 * Returns 0 if it would reach beyond the samples for an angle from `first` to `last`. */
int filter_start(Filter *filter, const double *angle, size_t n, double sigma, double first,
                 double last, double *scratch);

/* Filter all gages at one wheel angle: strain[g * ANGLES] and rate[g * ANGLES] of each gage g, whose
 * samples begin at samples + g * stride; `weights` holds 2 (2 reach + 1) doubles.
 * Reference: smooth_to_angle; test: test_native_turns. */
void filter_at(const Filter *filter, double phi, const double *samples, size_t stride, int gages,
               double *strain, double *rate, double *weights);

#endif
