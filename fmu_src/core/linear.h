/* Linear algebra. */
#ifndef TIRE_LINEAR_H
#define TIRE_LINEAR_H

#include <stddef.h>

/* Sum of the products of n numbers. Reference: numpy.dot */
double dot(const double *x, const double *y, size_t n);

/* Solve a x = b of n unknowns by elimination with partial pivoting; row i of a begins at
 * a + i * stride. Overwrites a; b becomes x. Reference: numpy.linalg.solve */
void solve(double *a, int stride, double *b, int n);

#endif
