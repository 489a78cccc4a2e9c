#include "linear.h"

#include <math.h>

static void exchange(double *a, double *b) {
    double kept = *a;
    *a = *b;
    *b = kept;
}

double dot(const double *x, const double *y, size_t n) {
    double sum[4] = {0.0}; /* which do not wait for each other */
    size_t i = 0;
    for (; i + 4 <= n; i += 4)
        for (size_t k = 0; k < 4; k++) sum[k] += x[i + k] * y[i + k];
    for (; i < n; i++) sum[0] += x[i] * y[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

void solve(double *a, int stride, double *b, int n) {
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i * stride + k]) > fabs(a[pivot * stride + k])) pivot = i;
        if (pivot != k) {
            for (int j = 0; j < n; j++) exchange(&a[k * stride + j], &a[pivot * stride + j]);
            exchange(&b[k], &b[pivot]);
        }
        for (int i = k + 1; i < n; i++) {
            double share = a[i * stride + k] / a[k * stride + k];
            for (int j = k; j < n; j++) a[i * stride + j] -= share * a[k * stride + j];
            b[i] -= share * b[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++) b[k] -= a[k * stride + j] * b[j];
        b[k] /= a[k * stride + k];
    }
}
