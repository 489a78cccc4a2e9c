#include "chance.h"

#include <math.h>

enum { BLOCK = 256, NOISE = 1, LOSS = 2 };

/* The upper and lower half of a product of 64-bit numbers. */
static uint64_t product(uint64_t a, uint64_t b, uint64_t *low) {
    uint64_t a0 = a & 0xffffffffu, a1 = a >> 32, b0 = b & 0xffffffffu, b1 = b >> 32;
    uint64_t middle = a1 * b0 + ((a0 * b0) >> 32), other = a0 * b1 + (middle & 0xffffffffu);
    *low = a * b;
    return a1 * b1 + (middle >> 32) + (other >> 32);
}

/* The `index`th of the numbers that numpy.random.Philox(key, counter = [0, place, kind, 0]) gives:
 * Philox4x64-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC11, 2011); numpy
 * counts before it draws four. */
static uint64_t bits_of(uint64_t seed, uint64_t place, uint64_t kind, uint64_t index) {
    uint64_t x[4] = {index / 4 + 1, place, kind, 0}, key[2] = {seed, 0};
    for (int round = 0; round < 10; round++) {
        uint64_t low0, low1, high0 = product(0xD2E7470EE14C6C93u, x[0], &low0);
        uint64_t high1 = product(0xCA5A826395121157u, x[2], &low1);
        x[0] = high1 ^ x[1] ^ key[0];
        x[1] = low1;
        x[2] = high0 ^ x[3] ^ key[1];
        x[3] = low0;
        key[0] += 0x9E3779B97F4A7C15u;
        key[1] += 0xBB67AE8584CAA73Bu;
    }
    return x[index % 4];
}

static double even(uint64_t bits) { return ((double)(bits >> 11) + 0.5) * 0x1p-53; }

static double ratio(const double *up, const double *down, int n, double x) {
    double a = up[n - 1], b = down[n - 1];
    for (int i = n - 2; i >= 0; i--) {
        a = a * x + up[i];
        b = b * x + down[i];
    }
    return a / b;
}

/* The normal quantile to 1e-16 (Wichura, AS 241, Applied Statistics 37, 1988, PPND16). */
static double quantile(double p) {
    static const double A[] = {3.3871328727963666080e0, 1.3314166789178437745e2,
                               1.9715909503065514427e3, 1.3731693765509461125e4,
                               4.5921953931549871457e4, 6.7265770927008700853e4,
                               3.3430575583588128105e4, 2.5090809287301226727e3},
                        B[] = {1.0,
                               4.2313330701600911252e1,
                               6.8718700749205790830e2,
                               5.3941960214247511077e3,
                               2.1213794301586595867e4,
                               3.9307895800092710610e4,
                               2.8729085735721942674e4,
                               5.2264952788528545610e3},
                        C[] = {1.42343711074968357734e0,  4.63033784615654529590e0,
                               5.76949722146069140550e0,  3.64784832476320460504e0,
                               1.27045825245236838258e0,  2.41780725177450611770e-1,
                               2.27238449892691845833e-2, 7.74545014278341407640e-4},
                        D[] = {1.0,
                               2.05319162663775882187e0,
                               1.67638483018380384940e0,
                               6.89767334985100004550e-1,
                               1.48103976427480074590e-1,
                               1.51986665636164571966e-2,
                               5.47593808499534494600e-4,
                               1.05075007164441684324e-9},
                        E[] = {6.65790464350110377720e0,  5.46378491116411436990e0,
                               1.78482653991729133580e0,  2.96560571828504891230e-1,
                               2.65321895265761230930e-2, 1.24266094738807843860e-3,
                               2.71155556874348757815e-5, 2.01033439929228813265e-7},
                        F[] = {1.0,
                               5.99832206555887937690e-1,
                               1.36929880922735805310e-1,
                               1.48753612908506148525e-2,
                               7.86869131145613259100e-4,
                               1.84631831751005468180e-5,
                               1.42151175831644588870e-7,
                               2.04426310338993978564e-15};
    double q = p - 0.5;
    if (fabs(q) <= 0.425) return q * ratio(A, B, 8, 0.180625 - q * q);
    double r = sqrt(-log(q < 0.0 ? p : 1.0 - p));
    double x = r <= 5.0 ? ratio(C, D, 8, r - 1.6) : ratio(E, F, 8, r - 5.0);
    return q < 0.0 ? -x : x;
}

double noise_of(uint64_t seed, uint64_t sample, int gage, int gages) {
    uint64_t index = sample % BLOCK * (uint64_t)gages + (uint64_t)gage;
    return quantile(even(bits_of(seed, sample / BLOCK, NOISE, index)));
}

double chance_of(uint64_t seed, uint64_t sample) { return even(bits_of(seed, sample, LOSS, 0)); }
