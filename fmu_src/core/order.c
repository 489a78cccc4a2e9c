#include "order.h"

#include <math.h>

enum { AT_ONCE = 8 }; /* numbers that do not wait for each other */

/* Bring the numbers from `low` to before `high` that are less than the pivot, or with `equal` those
 * that are not more, before the others; return where these begin. Without branches, as which way
 * a number goes cannot be foretold (N. Lomuto's partition). */
static size_t partitioned(double *x, size_t low, size_t high, double pivot, int equal) {
    size_t place = low;
    for (size_t i = low; i < high; i++) {
        double here = x[i];
        x[i] = x[place];
        x[place] = here;
        place += (size_t)((here < pivot) | (equal & (here == pivot)));
    }
    return place;
}

/* Bring the k-th smallest number to its place, smaller ones before it (C. A. R. Hoare, 1961). */
static double selected(double *x, size_t n, size_t k) {
    size_t low = 0, high = n;
    for (;;) {
        double pivot = x[low + (high - low) / 2];
        size_t place = partitioned(x, low, high, pivot, 0);
        if (k < place) {
            high = place;
            continue;
        }
        low = partitioned(x, place, high, pivot, 1); /* those that are equal: one at least */
        if (k < low) return pivot;
    }
}

double median(double *x, size_t n) {
    double upper = selected(x, n, n / 2);
    if (n % 2) return upper;
    double lower = x[0];
    for (size_t i = 1; i < n / 2; i++)
        if (x[i] > lower) lower = x[i];
    return 0.5 * (lower + upper);
}

/* Let the number at `root` sink in a heap of n. */
static void sink(double *x, size_t root, size_t n) {
    for (size_t child = 2 * root + 1; child < n; child = 2 * root + 1) {
        if (child + 1 < n && x[child] < x[child + 1]) child++;
        if (x[root] >= x[child]) return;
        double kept = x[root];
        x[root] = x[child];
        x[child] = kept;
        root = child;
    }
}

void sort(double *x, size_t n) { /* heapsort (J. W. J. Williams, 1964): no memory, bounded time */
    for (size_t i = n / 2; i > 0; i--) sink(x, i - 1, n);
    for (size_t last = n; last > 1; last--) {
        double kept = x[0];
        x[0] = x[last - 1];
        x[last - 1] = kept;
        sink(x, 0, last - 1);
    }
}

void limits(const double *x, size_t n, double *low, double *high) {
    double lows[AT_ONCE], highs[AT_ONCE];
    size_t i = 0;
    for (int k = 0; k < AT_ONCE; k++) lows[k] = INFINITY, highs[k] = -INFINITY;
    for (; i + AT_ONCE <= n; i += AT_ONCE)
        for (int k = 0; k < AT_ONCE; k++) {
            double y = x[i + (size_t)k];
            lows[k] = y < lows[k] ? y : lows[k];
            highs[k] = y > highs[k] ? y : highs[k];
        }
    for (; i < n; i++) {
        lows[0] = x[i] < lows[0] ? x[i] : lows[0];
        highs[0] = x[i] > highs[0] ? x[i] : highs[0];
    }
    *low = lows[0], *high = highs[0];
    for (int k = 1; k < AT_ONCE; k++) {
        *low = lows[k] < *low ? lows[k] : *low;
        *high = highs[k] > *high ? highs[k] : *high;
    }
}

double total(const double *x, size_t n) {
    double sum[AT_ONCE] = {0.0}, all = 0.0;
    size_t i = 0;
    for (; i + AT_ONCE <= n; i += AT_ONCE)
        for (int k = 0; k < AT_ONCE; k++) sum[k] += x[i + (size_t)k];
    for (; i < n; i++) all += x[i];
    for (int k = 0; k < AT_ONCE; k++) all += sum[k];
    return all;
}
