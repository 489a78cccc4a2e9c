/* Order statistics of numbers without NaN. */
#ifndef TIRE_ORDER_H
#define TIRE_ORDER_H

#include <stddef.h>

/* Return the median of n > 0 numbers, the mean of the two in the middle if n is even; reorders
 * them. Reference: numpy.median. */
double median(double *x, size_t n);

/* Sort n numbers in place, smallest first. Reference: numpy.sort */
void sort(double *x, size_t n);

#endif
