#include "quality.h"

#include "order.h"

enum { LONGEST_BRIDGE = 2, FLAT_SAMPLES = 6 };
static const double SPIKE_SHARE = 0.05, SPIKE_BEND = 350.0, DEAD_SHARE = 0.25;
static const double FLAT_ANGLE = 0.04, CORNER_ANGLE = 0.02, CORNER_SHARE = 0.02;

/* Reference: _longest_run */
static size_t longest_run(const unsigned char *mask, size_t n) {
    size_t run = 0, longest = 0;
    for (size_t i = 0; i < n; i++) {
        run = mask[i] ? run + 1 : 0;
        if (run > longest) longest = run;
    }
    return longest;
}

/* How long the samples stand still at a value at the longest; 0 where fewer than `needed` have it. */
static size_t longest_stand(const double *x, size_t n, double value, double needed) {
    size_t run = 0, longest = 0, there = 0;
    for (size_t i = 0; i < n; i++) there += x[i] == value;
    if ((double)there < needed) return 0;
    for (size_t i = 0; i < n; i++) {
        run = x[i] == value ? run + 1 : 0;
        if (run > longest) longest = run;
    }
    return longest;
}

/* Whether the samples leave their extreme within a corner's angle. Reference: _has_corner */
static int has_corner(const double *x, size_t n, double extreme, double jump, double step) {
    size_t first = 0, last = n - 1;
    double wanted = rint(CORNER_ANGLE / step);
    size_t reach = wanted > 1.0 ? (wanted < (double)n ? (size_t)wanted : n) : 1;
    while (x[first] != extreme) first++;
    while (x[last] != extreme) last--;
    first = first > reach ? first - reach : 0;
    last = last + reach < n ? last + reach : n - 1;
    return fabs(x[first] - extreme) > jump || fabs(x[last] - extreme) > jump;
}

static double bend(const double *x, size_t i) { return fabs(x[i + 1] - 2.0 * x[i] + x[i - 1]); }

/* Whether one of the samples bends more than `most`. */
static int bent_more(const double *x, size_t n, double most) {
    size_t many = 0;
    for (size_t i = 1; i + 1 < n; i++) many += bend(x, i) > most;
    return many > 0;
}

/* Median of a sample's four neighbours; NaN if one of them is. */
static double around(const double *x, size_t i) {
    double four[4] = {x[i - 2], x[i - 1], x[i + 1], x[i + 2]};
    for (int k = 0; k < 4; k++)
        if (isnan(four[k])) return NAN;
    return median(four, 4);
}

/* Replace missing samples by straight lines, or all by zero. Reference: _bridge (numpy.interp) */
static void bridge(double *x, const unsigned char *missing, size_t n) {
    size_t known = n;
    for (size_t i = 0; i < n; i++) {
        if (missing[i]) continue;
        if (known == n)
            for (size_t k = 0; k < i; k++) x[k] = x[i];
        else if (i > known + 1) {
            double slope = (x[i] - x[known]) / (double)(i - known);
            for (size_t k = known + 1; k < i; k++) x[k] = slope * (double)(k - known) + x[known];
        }
        known = i;
    }
    for (size_t k = known == n ? 0 : known + 1; k < n; k++) x[k] = known == n ? 0.0 : x[known];
}

/* Swing of the samples that are there, and whether they stand still at its ends. */
static double swing_of(const double *x, size_t n, double step, int *flags) {
    double low, high;
    limits(x, n, &low, &high);
    double swing = low > high ? 0.0 : high - low, angle = floor(FLAT_ANGLE / step);
    double needed = angle > FLAT_SAMPLES ? angle : FLAT_SAMPLES;
    for (int end = 0; end < 2 && swing > 0.0; end++) {
        double extreme = end ? low : high;
        if ((double)longest_stand(x, n, extreme, needed) >= needed &&
            has_corner(x, n, extreme, CORNER_SHARE * swing, step))
            *flags |= SATURATED;
    }
    return swing;
}

/* Mark the samples that stand apart from their neighbours as missing. Reference: _spikes */
static int spikes(const double *x, size_t n, double least, unsigned char *missing) {
    int any = 0;
    for (size_t i = 2; i + 2 < n && least > 0.0; i++)
        if (fabs(x[i] - around(x, i)) > least) any = missing[i] = 1;
    return any;
}

void inspect(double *window, size_t stride, size_t n, int gages, double step, int *flags,
             unsigned char *missing) {
    double swing[GAGES], share = SPIKE_BEND * (step * step);
    int bent = 0; /* where no gage bends sharply, none is looked at for spikes */
    if (share < SPIKE_SHARE) share = SPIKE_SHARE;
    for (int g = 0; g < gages; g++) {
        double *x = window + (size_t)g * stride;
        size_t lost = 0;
        for (size_t i = 0; i < n; i++) lost += !isfinite(x[i]);
        for (size_t i = 0; i < n && lost; i++) {
            missing[i] = (unsigned char)!isfinite(x[i]);
            if (missing[i]) x[i] = NAN;
        }
        flags[g] = !lost ? 0 : longest_run(missing, n) > LONGEST_BRIDGE ? GAP : BRIDGED;
        swing[g] = swing_of(x, n, step, &flags[g]);
        bent = bent || bent_more(x, n, share * swing[g]);
    }
    for (int g = 0; g < gages; g++) {
        double *x = window + (size_t)g * stride;
        int lost = (flags[g] & (GAP | BRIDGED)) != 0;
        if (!lost && !bent) continue;
        for (size_t i = 0; i < n; i++) missing[i] = (unsigned char)(isnan(x[i]) != 0);
        if (bent && n >= 5 && spikes(x, n, share * swing[g], missing)) {
            flags[g] |= SPIKE | BRIDGED;
            lost = 1;
        }
        if (lost && longest_run(missing, n) > LONGEST_BRIDGE) flags[g] |= GAP;
        if (lost) bridge(x, missing, n);
    }
}

void mark_without_contact(const double *rate, size_t n, int gages, int *flags) {
    double steep[GAGES], sorted[GAGES];
    for (int g = 0; g < gages; g++) {
        double low, high;
        limits(rate + g * ANGLES, n, &low, &high);
        steep[g] = sorted[g] = high - low;
    }
    double usual = median(sorted, (size_t)gages);
    for (int g = 0; g < gages; g++)
        if (steep[g] < DEAD_SHARE * usual) flags[g] |= DEAD_GAGE;
}
