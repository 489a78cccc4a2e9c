#include "course.h"

#include <float.h>

#include "linear.h"
#include "order.h"

enum { DEGREE = 3, FEWEST = 3, BINS = 64 };

/* Rows: Legendre polynomials by their powers; means of the powers from -1 to 0. */
static const double LEGENDRE[4][4] = {
    {1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}, {-0.5, 0.0, 1.5, 0.0}, {0.0, -1.5, 0.0, 2.5}};
static const double MEANS[4] = {1.0, -1.0 / 2.0, 1.0 / 3.0, -1.0 / 4.0};

static int smaller(int a, int b) { return a < b ? a : b; }

/* How many values in a row count as one. Reference: _alike. */
static double alike(const double *left, int size, int lag) {
    double square = 0.0, product = 0.0, before = 0.0;
    for (int i = 0; i < size / lag; i++) {
        double value = 0.0;
        for (int k = 0; k < lag; k++) value += left[i * lag + k];
        value /= lag;
        square += value * value;
        if (i) product += value * before;
        before = value;
    }
    double correlation = square > 0.0 ? product / square : 0.0;
    double alike = (1.0 + correlation) / (1.0 - correlation);
    return alike > 1.0 ? alike : 1.0;
}

/* Legendre polynomials of the span by the powers of turns. Reference: _moved. */
static void terms_of(double gain, double shift, int size, double terms[4][4]) {
    double rows[4][4] = {{1.0, 0.0, 0.0, 0.0}};
    for (int k = 0; k < DEGREE; k++)
        for (int j = 0; j <= DEGREE; j++)
            rows[k + 1][j] = shift * rows[k][j] + (j ? gain * rows[k][j - 1] : 0.0);
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++) {
            terms[i][j] = 0.0;
            for (int k = 0; k < size; k++) terms[i][j] += LEGENDRE[i][k] * rows[k][j];
        }
}

/* Means of the samples over at most BINS bins, and where the bins' middles lie. */
static int gathered(const double *samples, size_t n, double *y, double *at) {
    int bins = smaller(BINS, (int)n);
    double step = (double)n / bins;
    size_t edge = 0;
    for (int i = 0; i < bins; i++) {
        size_t next = i + 1 < bins ? (size_t)((i + 1) * step) : n;
        y[i] = total(samples + edge, next - edge) / (double)(next - edge);
        at[i] = 0.5 * (double)(edge + next - 1);
        edge = next;
    }
    return bins;
}

/* Fit Legendre polynomials over z; leave what they do not follow in y. Returns the scatter. */
static double fit(const double *z, double *y, int n, int size, double *fitted) {
    double normal[4][4] = {{0.0}}, design[BINS][4], square = 0.0;
    for (int k = 0; k < 4; k++) fitted[k] = 0.0;
    for (int i = 0; i < n; i++) {
        double x = z[i];
        design[i][0] = 1.0;
        design[i][1] = x;
        for (int k = 2; k < 4; k++) /* numpy.polynomial.legendre.legvander */
            design[i][k] = (design[i][k - 1] * x * (2 * k - 1) - design[i][k - 2] * (k - 1)) / k;
        for (int k = 0; k < size; k++) {
            fitted[k] += y[i] * design[i][k];
            for (int j = 0; j < size; j++) normal[k][j] += design[i][k] * design[i][j];
        }
    }
    solve(&normal[0][0], 4, fitted, size);
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < size; k++) y[i] -= design[i][k] * fitted[k];
        square += y[i] * y[i];
    }
    return square / n;
}

static Course no_course(const double *samples, size_t n, double first, int told) {
    Course c = {1, 0, 1, {0.0}, 0.0, 0.0};
    double wanted = rint(-first);
    size_t part = wanted < 1.0 ? 1 : wanted < (double)n ? (size_t)wanted : n;
    for (size_t i = 0; i < part; i++) c.mean += samples[i];
    c.mean = told == 1 ? samples[0] : c.mean / (double)part;
    c.shape[0] = c.mean;
    return c;
}

Course course(const double *samples, size_t n, double first, double turn) {
    Course c = {0, 0, 0, {0.0}, NAN, 0.0};
    double low, high, y[BINS], z[BINS], fitted[4], terms[4][4];
    size_t lost = 0, changes = 0;
    limits(samples, n, &low, &high);
    for (size_t i = 0; i < n; i++) lost += !isfinite(samples[i]);
    for (size_t i = 1; i < n; i++) changes += samples[i] != samples[i - 1];
    if (n == 0 || lost || low * high <= 0.0) return c;
    if (changes + 1 < FEWEST) return no_course(samples, n, first, (int)changes + 1);
    int bins = gathered(samples, n, y, z);
    double late = 0.5 * ((double)n / (double)(changes + 1) - 1.0);
    int told = changes + 1 < (size_t)bins ? (int)(changes + 1) : bins;
    int size = 1 + smaller(DEGREE, told - FEWEST + 1);
    double half = 0.5 * (first + (double)n - 1.0 + turn) / turn;
    for (int i = 0; i < bins; i++) z[i] = (z[i] - late + first + turn) / (turn * half) - 1.0;
    double scatter = fit(z, y, bins, size, fitted) / (1.0 - (double)size / told);
    double independent = told / alike(y, bins, (bins + told - 1) / told);
    double variance[4], kept[4], spread = 0.0;
    terms_of(1.0 / half, 1.0 / half - 1.0, size, terms);
    c.there = c.known = 1;
    c.terms = size;
    c.mean = 0.0;
    for (int k = 0; k < size; k++) {
        double square = fitted[k] * fitted[k], mean = 0.0;
        variance[k] = scatter * (2.0 * k + 1.0) / independent;
        if (square < DBL_MIN) square = DBL_MIN;
        double share = 1.0 - variance[k] / square;
        kept[k] = k == 0 ? fitted[0] : share > 0.0 ? share * fitted[k] : 0.0;
        for (int j = 0; j < size; j++) {
            mean += terms[k][j] * MEANS[j];
            c.shape[j] += kept[k] * terms[k][j];
        }
        c.mean += fitted[k] * mean;
        spread += (terms[k][0] - mean) * (terms[k][0] - mean) * variance[k];
    }
    c.std = sqrt(spread) / fabs(c.mean);
    return c;
}
