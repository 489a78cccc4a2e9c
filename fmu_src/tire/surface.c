#include "surface.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
static const double FORMAT = 2.0, LOAD = 4000.0, SPEED = 20.0, PRESSURE = 2.4e5;
static const double COMMON_HALF_ANGLE = 0.25, SMALLEST_HALF_ANGLE = 0.08;

/* Take a count of the table: a whole number within limits; 0 where it is none. */
static int count(double x, int low, int high) {
    return x >= low && x <= high && x == floor(x) ? (int)x : 0;
}

int tire_surface_read(TireSurface *s, const double *table, size_t n) {
    if (n < 7 || table[0] != FORMAT) return 0;
    s->gages = count(table[1], 1, TIRE_GAGES);
    s->inputs = count(table[2], 6, MOST_INPUTS);
    s->parts = count(table[3], 1, 100);
    s->grid = count(table[4], 4, 100000);
    s->points = count(table[5], 1, 100000);
    s->terms = count(table[6], 1, 1000);
    if (!s->gages || !s->inputs || !s->parts || !s->grid || !s->points || !s->terms) return 0;
    s->places = s->inputs + 2;
    s->answers = s->parts + 2 * s->gages + OUT_FORCES;
    if (s->answers > MOST_ANSWERS || s->points + s->terms > MOST_BASIS) return 0;
    size_t i = (size_t)s->inputs, d = (size_t)s->places, p = (size_t)s->points;
    size_t t = (size_t)s->terms, q = (size_t)s->answers;
    size_t m = (size_t)s->grid * (size_t)s->gages * (size_t)(s->parts + 1);
    if (n != 7 + 2 * i + 4 + 3 * d + t * d + p * d + (p + t) * q + m + ROLLING_TERMS) return 0;
    for (size_t k = 7; k < n; k++)
        if (!isfinite(table[k])) return 0;
    const double *at = table + 7, *power = at + 2 * i + 4 + 3 * d;
    for (size_t k = 0; k < t * d; k++)
        if (power[k] != 0.0 && !count(power[k], 1, 9)) return 0;
    s->low = at, at += i;
    s->high = at, at += i;
    s->slip = at, at += 4;
    s->scales = at, at += d;
    s->shift = at, at += d;
    s->scale = at, at += d;
    s->powers = at, at += t * d;
    s->at = at, at += p * d;
    s->weights = at, at += (p + t) * q;
    s->spline = at, at += m;
    s->rolling = at;
    return 1;
}

int tire_outside(const TireSurface *s, const double *inputs) {
    int bits = 0;
    for (int i = 0; i < s->inputs; i++)
        if (!(s->low[i] <= inputs[i] && inputs[i] <= s->high[i])) bits |= 1 << i;
    return bits;
}

/* Reference: coordinates */
static void places_of(const TireSurface *s, const double *in, double *x) {
    double friction = s->inputs > IN_FRICTION ? in[IN_FRICTION] : 1.0;
    double along = (1.0 + in[IN_KAPPA]) / cos(in[IN_ALPHA]) - 1.0;
    double size = pow(in[IN_LOAD] / LOAD, s->slip[2]) *
                  pow(in[IN_PRESSURE] / PRESSURE, s->slip[3]) / (1.0 + along);
    double u = s->slip[0] * along * size, w = s->slip[1] * tan(in[IN_ALPHA]) * size;
    double total = hypot(u, w) + 1e-12;
    double bent = friction * tanh(total / friction) / total;
    double found[MOST_PLACES] = {sqrt(in[IN_LOAD] / LOAD),
                                 in[IN_CAMBER] / 0.1,
                                 in[IN_SPEED] / SPEED,
                                 in[IN_PRESSURE] / PRESSURE,
                                 u * bent,
                                 w * bent,
                                 along / 0.1,
                                 in[IN_ALPHA] / 0.1,
                                 friction};
    for (int d = 0; d < s->places; d++) x[d] = s->scales[d] * found[d];
}

/* Values of the basis at a place: -r^5, and the terms of a polynomial. */
static void basis_at(const TireSurface *s, const double *x, double *value) {
    const int places = s->places;
    double scaled[MOST_PLACES];
    for (int i = 0; i < s->points; i++) {
        const double *at = s->at + i * places;
        double square = 0.0;
        for (int d = 0; d < places; d++) square += (x[d] - at[d]) * (x[d] - at[d]);
        value[i] = -square * square * sqrt(square);
    }
    for (int d = 0; d < places; d++) scaled[d] = (x[d] - s->shift[d]) / s->scale[d];
    for (int i = 0; i < s->terms; i++) {
        const double *powers = s->powers + i * places;
        double term = 1.0;
        for (int d = 0; d < places; d++)
            for (int k = (int)powers[d]; k > 0; k--) term *= scaled[d];
        value[s->points + i] = term;
    }
}

/* As scipy.interpolate.RBFInterpolator with the kernel `quintic`; four rows of weights at a time.
 */
void tire_answers(const TireSurface *s, const double *inputs, double *answers) {
    double x[MOST_PLACES], value[MOST_BASIS], sum[MOST_ANSWERS] = {0.0};
    const double *w = s->weights;
    const int n = s->answers, rows = s->points + s->terms;
    int i = 0;
    places_of(s, inputs, x);
    basis_at(s, x, value);
    for (; i + 4 <= rows; i += 4, w += 4 * n) {
        const double a = value[i], b = value[i + 1], c = value[i + 2], d = value[i + 3];
        for (int k = 0; k < n; k++)
            sum[k] += a * w[k] + b * w[n + k] + c * w[2 * n + k] + d * w[3 * n + k];
    }
    for (; i < rows; i++, w += n)
        for (int k = 0; k < n; k++) sum[k] += value[i] * w[k];
    memcpy(answers, sum, (size_t)n * sizeof *answers);
}

/* Reference: warped */
static double warped(double angle, double centre, double half) {
    double t = fmod(angle - centre + PI, 2.0 * PI);
    t = (t < 0.0 ? t + 2.0 * PI : t) - PI;
    double far = 1.0 - (t / PI) * (t / PI);
    return t - (half - COMMON_HALF_ANGLE) * (tanh(2.0 * t / half) * far * far);
}

void tire_strain(const TireSurface *s, const double *answers, double angle, double *strain) {
    const int parts = s->parts, gages = s->gages;
    for (int g = 0; g < gages; g++) {
        double square = answers[parts + g], middle = answers[parts + gages + g];
        double half =
            sqrt(0.5 * (square + hypot(square, SMALLEST_HALF_ANGLE * SMALLEST_HALF_ANGLE)));
        double place = (warped(angle, middle, half) + PI) * (s->grid / (2.0 * PI));
        if (!(fabs(place) < 1e9)) { /* a condition far out of range */
            strain[g] = NAN;
            continue;
        }
        double first = floor(place), t = place - first, r = 1.0 - t;
        double weight[4] = {r * r * r / 6.0, (t * t * (3.0 * t - 6.0) + 4.0) / 6.0,
                            (r * r * (3.0 * r - 6.0) + 4.0) / 6.0, t * t * t / 6.0};
        strain[g] = 0.0;
        for (int k = 0; k < 4; k++) {
            int row = ((int)first - 1 + k) % s->grid;
            const double *part =
                s->spline + ((row < 0 ? row + s->grid : row) * gages + g) * (parts + 1);
            double value = part[parts];
            for (int j = 0; j < parts; j++) value += answers[j] * part[j];
            strain[g] += weight[k] * value;
        }
    }
}

double tire_rolling_radius(const TireSurface *s, double load, double speed, double pressure) {
    double x[3] = {sqrt(load / LOAD), 0.5 * (speed / SPEED) * (speed / SPEED), pressure / PRESSURE};
    double powers[3][4], found = 0.0;
    const double *term = s->rolling;
    for (int k = 0; k < 3; k++) {
        powers[k][0] = 1.0;
        for (int p = 1; p < 4; p++) powers[k][p] = powers[k][p - 1] * x[k];
    }
    for (int a = 0; a < 4; a++)
        for (int b = 0; a + b < 4; b++)
            for (int c = 0; a + b + c < 4; c++)
                found += *term++ * powers[0][a] * powers[1][b] * powers[2][c];
    return found;
}
