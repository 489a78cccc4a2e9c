/* Low-pass without phase shift, and the way from time to wheel angle. Reference:
 * tirelib.measured.signal.lowpass. */
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

/* Numbers that are summed at once; a row of samples has a multiple of them: the gages, and a one, so
 * that the sums of the weights come along. */
enum { LANES = 6, MOST_LANES = (GAGES + 1 + LANES - 1) / LANES * LANES };

/* The samples of a turn, and how many of them the filter looks at for one wheel angle. */
typedef struct {
    const double *angle; /* of each sample */
    size_t n, reach;
    double sigma;
    int angles; /* of the grid, from its first one on */
} Filter;

/* Return how many doubles a row of samples has. */
static inline size_t filter_lanes(int gages) {
    return (size_t)((gages + 1 + LANES - 1) / LANES * LANES);
}

/* Prepare the filter for samples at given, growing angles; `scratch` holds n doubles.
 * Returns 0 if it would reach beyond the samples for one of the first `angles` of the grid. */
int filter_start(Filter *filter, const double *angle, size_t n, double sigma, int angles,
                 double *scratch);

/* Write samples as rows: gage g's begin at samples + g * stride; `rows` holds filter_lanes(gages)
 * doubles for each sample. */
void filter_rows(const Filter *filter, const double *samples, size_t stride, int gages,
                 double *rows);

/* Filter all gages at the wheel angles: strain[g * ANGLES + k] and rate[g * ANGLES + k] of gage g at
 * angle k; `scratch` holds 3 n doubles. Reference: smooth_to_angle; test: test_native_turns. */
void filter_turn(const Filter *filter, const double *rows, int gages, double *strain, double *rate,
                 double *scratch);

#endif
