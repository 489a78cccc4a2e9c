#include "lowpass.h"

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

/* Return the sample nearest to a wheel angle. */
static size_t nearest(const Filter *filter, double phi) {
    size_t low = 0, high = filter->n;
    while (low < high) { /* numpy.searchsorted */
        size_t middle = low + (high - low) / 2;
        if (filter->angle[middle] < phi)
            low = middle + 1;
        else
            high = middle;
    }
    if (low < 1) low = 1;
    if (low > filter->n - 1) low = filter->n - 1;
    return low - (phi - filter->angle[low - 1] <= filter->angle[low] - phi);
}

int filter_start(Filter *filter, const double *angle, size_t n, double sigma, double first,
                 double last, double *scratch) {
    if (n < 2) return 0;
    filter->angle = angle;
    filter->n = n;
    filter->sigma = sigma;
    for (size_t i = 0; i + 1 < n; i++) scratch[i] = angle[i + 1] - angle[i];
    double width = lowpass_half_width(sigma), reach = width / median(scratch, n - 1);
    if (!(reach < (double)n)) return 0;
    filter->reach = reach < 1.0 ? 1 : (size_t)reach;
    size_t before = nearest(filter, first), behind = n - 1 - nearest(filter, last);
    size_t room = before < behind ? before : behind;
    if (room >= filter->reach) return 1;
    filter->reach = room; /* as wide where the wheel is fastest */
    return angle[0] <= first - width && angle[n - 1] >= last + width;
}

void filter_at(const Filter *filter, double phi, const double *samples, size_t stride, int gages,
               double *strain, double *rate, double *weights) {
    size_t start = nearest(filter, phi) - filter->reach, size = 2 * filter->reach + 1;
    const double *angle = filter->angle + start;
    double *moments = weights + size, narrow = -0.5 / (filter->sigma * filter->sigma);
    double total = 0.0, first = 0.0, second = 0.0;
    for (size_t i = 0; i < size; i++) {
        double distance = angle[i] - phi;
        weights[i] = exp(distance * distance * narrow);
        moments[i] = weights[i] * distance;
        total += weights[i];
        first += moments[i];
        second += moments[i] * distance;
    }
    double mean = first / total; /* of the distance: the weights are not quite symmetric */
    for (int g = 0; g < gages; g++) {
        const double *sample = samples + (size_t)g * stride + start;
        double plain = 0.0, moment = 0.0;
        for (size_t i = 0; i < size; i++) {
            plain += sample[i] * weights[i];
            moment += sample[i] * moments[i];
        }
        double slope = (moment - mean * plain) / (second - mean * first);
        rate[g * ANGLES] = slope;
        strain[g * ANGLES] = plain / total - mean * slope;
    }
}
