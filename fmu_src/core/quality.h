/* What is wrong with a window of samples. Reference: tirelib.measured.signal.quality. */
#ifndef TIRE_QUALITY_H
#define TIRE_QUALITY_H

#include "common.h"

enum { UNUSABLE = GAP | SATURATED | DEAD_GAGE }; /* with these a gage says nothing in a turn */

/* Look for faults in the samples of one turn's window and bridge short gaps and spikes.
 * The samples of gage g begin at window + g * stride; missing ones are not finite. `missing` holds
 * n bytes. Reference: inspect; test: test_native_turns. */
void inspect(double *window, size_t stride, size_t n, int gages, double step, int *flags,
             unsigned char *missing);

/* Mark the gages that show no contact while most do. The smoothed rates of gage g begin at
 * rate + g * ANGLES. Reference: without_contact. */
void mark_without_contact(const double *rate, size_t n, int gages, int *flags);

#endif
