/* Order statistics and sums of numbers. */
#ifndef TIRE_ORDER_H
#define TIRE_ORDER_H

#include <stddef.h>

/* Return the median of n > 0 numbers that are not NaN, the mean of the two in the middle if n is
 * even; reorders them. Reference: numpy.median. */
double median(double *x, size_t n);

/* Sort n numbers that are not NaN in place, smallest first. Reference: numpy.sort */
void sort(double *x, size_t n);

/* Lowest and highest of the numbers that are not NaN; INFINITY and -INFINITY where none is.
 * Reference: numpy.nanmin, numpy.nanmax */
void limits(const double *x, size_t n, double *low, double *high);

/* Sum of n numbers. Reference: numpy.sum */
double total(const double *x, size_t n);

#endif
