#include "order.h"

/* Bring the k-th smallest number to its place, smaller ones before it (C. A. R. Hoare, 1961). */
static double selected(double *x, size_t n, size_t k) {
    size_t low = 0, high = n - 1;
    while (low < high) {
        double pivot = x[low + (high - low) / 2];
        size_t i = low, j = high;
        for (;;) {
            while (x[i] < pivot) i++;
            while (pivot < x[j]) j--;
            if (i >= j) break;
            double kept = x[i];
            x[i++] = x[j];
            x[j--] = kept;
        }
        if (x[j] > pivot) j--; /* x[low..j] <= pivot <= x[j+1..high] */
        if (k <= j)
            high = j;
        else
            low = j + 1;
    }
    return x[k];
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
