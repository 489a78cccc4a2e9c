#include "lowpass.h"

#include "linear.h"
#include "order.h"

static const double SUPPORT = 4.0;
static const double SUITABLE_LOW = 8.0, SUITABLE_HIGH = 120.0, NYQUIST_SHARE = 0.5;

/* LowPass.frequency */
static double frequency(const LowPass *p, double turn_rate) {
    return isnan(p->cut_off) ? p->order * turn_rate : p->cut_off;
}

double lowpass_sigma(const LowPass *p, double turn_rate) {
    return sqrt(log(2.0)) * turn_rate / frequency(p, turn_rate);
}

int lowpass_suits(const LowPass *p, double turn_rate, double rate) {
    double f = frequency(p, turn_rate);
    return SUITABLE_LOW * turn_rate <= f && f <= SUITABLE_HIGH * turn_rate &&
           f <= NYQUIST_SHARE * rate / 2.0;
}

double lowpass_half_width(double sigma) { return SUPPORT * sigma; }

/* Go on from a place to the sample nearest to a wheel angle, which grows from call to call. */
static size_t nearest(const Filter *filter, double phi, size_t *place) {
    const double *angle = filter->angle;
    while (*place < filter->n - 1 && angle[*place] < phi) ++*place; /* numpy.searchsorted */
    return *place - (phi - angle[*place - 1] <= angle[*place] - phi);
}

int filter_start(Filter *filter, const double *angle, size_t n, double sigma, int angles,
                 double *scratch) {
    if (n < 2) return 0;
    filter->angle = angle;
    filter->n = n;
    filter->sigma = sigma;
    filter->angles = angles;
    for (size_t i = 0; i + 1 < n; i++) scratch[i] = angle[i + 1] - angle[i];
    double width = lowpass_half_width(sigma), reach = width / median(scratch, n - 1);
    if (!(reach < (double)n)) return 0;
    filter->reach = reach < 1.0 ? 1 : (size_t)reach;
    double first = phi_at(0), last = phi_at(angles - 1);
    size_t place = 1, before = nearest(filter, first, &place);
    size_t behind = n - 1 - nearest(filter, last, &place);
    size_t room = before < behind ? before : behind;
    if (room >= filter->reach) return 1;
    filter->reach = room; /* as wide where the wheel is fastest */
    return angle[0] <= first - width && angle[n - 1] >= last + width;
}

/* Weights of the samples from `start` to before `stop` about a wheel angle, exp(-d^2 / 2 sigma^2),
 * and their arms, weight times distance.
 * Those before `known` were weighed about the angle before, a spacing h less: there the weight grows
 * by exp(h d / sigma^2 - h^2 / 2 sigma^2), and that by exp(-h^2 / sigma^2), so that a sample costs
 * two exponentials as it comes in and none later. */
static void weigh_samples(const Filter *filter, double phi, size_t start, size_t known, size_t stop,
                          double *weight, double *growth, double *arm) {
    double h = phi_at(1) - phi_at(0), narrow = 1.0 / (filter->sigma * filter->sigma);
    double slower = exp(-h * h * narrow);
    for (size_t i = start; i < known; i++) {
        weight[i] *= growth[i];
        growth[i] *= slower;
        arm[i] = weight[i] * (filter->angle[i] - phi);
    }
    for (size_t i = known > start ? known : start; i < stop; i++) {
        double distance = filter->angle[i] - phi;
        weight[i] = exp(-0.5 * distance * distance * narrow);
        growth[i] = exp((distance - 0.5 * h) * h * narrow);
        arm[i] = weight[i] * distance;
    }
}

/* Sums of n samples, weighted and times their arms. */
static void add_samples(const double *rows, size_t lanes, const double *weight, const double *arm,
                        size_t n, double *plain, double *moment) {
    double sum[LANES] = {0.0}, moved[LANES] = {0.0};
    for (size_t i = 0; i < n; i++) {
        for (size_t g = 0; g < LANES; g++) sum[g] += rows[i * lanes + g] * weight[i];
        for (size_t g = 0; g < LANES; g++) moved[g] += rows[i * lanes + g] * arm[i];
    }
    for (size_t g = 0; g < LANES; g++) plain[g] = sum[g];
    for (size_t g = 0; g < LANES; g++) moment[g] = moved[g];
}

void filter_rows(const Filter *filter, const double *samples, size_t stride, int gages,
                 double *rows) {
    size_t lanes = filter_lanes(gages), one = (size_t)gages;
    for (size_t i = 0; i < filter->n; i++, rows += lanes) {
        for (size_t g = 0; g < lanes; g++) rows[g] = g < one ? samples[g * stride + i] : 0.0;
        rows[one] = 1.0;
    }
}

void filter_turn(const Filter *filter, const double *rows, int gages, double *strain, double *rate,
                 double *scratch) {
    double *weight = scratch, *growth = weight + filter->n, *arm = growth + filter->n;
    double plain[MOST_LANES], moment[MOST_LANES];
    size_t size = 2 * filter->reach + 1, lanes = filter_lanes(gages), place = 1, known = 0;
    for (int k = 0; k < filter->angles; k++) {
        double phi = phi_at(k);
        size_t start = nearest(filter, phi, &place) - filter->reach;
        weigh_samples(filter, phi, start, known, start + size, weight, growth, arm);
        known = start + size;
        for (size_t g = 0; g < lanes; g += LANES)
            add_samples(rows + start * lanes + g, lanes, weight + start, arm + start, size,
                        plain + g, moment + g);
        double share = 1.0 / plain[gages], first = moment[gages];
        double mean = first * share; /* of the distance: the weights are not quite symmetric */
        double second = dot(arm + start, filter->angle + start, size) - phi * first;
        double steepness = 1.0 / (second - mean * first);
        for (int g = 0; g < gages; g++) {
            double slope = (moment[g] - mean * plain[g]) * steepness;
            rate[g * ANGLES + k] = slope;
            strain[g * ANGLES + k] = plain[g] * share - mean * slope;
        }
    }
}
