#include "angle.h"

enum { NEWTON = 8, AT_ONCE = 32 };

static const double LARGEST_RATIO = 2.0, ENDS = 17.0 / 240.0; /* ENDS: squared */

/* numpy.polynomial.polynomial.polyval */
static double polynomial(const double *c, int64_t terms, double x) {
    double y = c[terms - 1];
    for (int64_t k = terms - 2; k >= 0; k--) y = c[k] + y * x;
    return y;
}

double law_at(const AngleLaw *law, double sample) {
    return polynomial(law->angle, law->terms, (sample - law->middle) / law->turn);
}

void law_angles(const AngleLaw *law, double first, size_t n, double *angle) {
    for (size_t i = 0; i < n; i += AT_ONCE) {
        double x[AT_ONCE], begin = first + (double)i;
        int many = n - i < AT_ONCE ? (int)(n - i) : AT_ONCE;
        for (int j = 0; j < many; j++) x[j] = (begin + (double)j - law->middle) / law->turn;
        for (int j = 0; j < many; j++) angle[i + (size_t)j] = law->angle[law->terms - 1];
        for (int64_t k = law->terms - 2; k >= 0; k--) /* as `polynomial` does it for one */
            for (int j = 0; j < many; j++)
                angle[i + (size_t)j] = law->angle[k] + angle[i + (size_t)j] * x[j];
    }
}

double law_sample(const AngleLaw *law, double phi) {
    double x = phi / (2.0 * PI);
    for (int i = 0; i < NEWTON; i++) {
        double angle = 0.0, rate = 0.0;
        for (int64_t k = law->terms - 1; k >= 0; k--) {
            rate = rate * x + angle;
            angle = angle * x + law->angle[k];
        }
        x -= (angle - phi) / rate;
    }
    return law->middle + x * law->turn;
}

double minmod(double a, double b) {
    if (!(a * b > 0.0)) return 0.0;
    double least = fabs(a) < fabs(b) ? fabs(a) : fabs(b);
    return a > 0.0 ? least : -least;
}

/* The slope of q that is followed, a turn's, and the doubt of q; relative. Reference: _followed. */
static double followed(const Past *past, int column, double turn, double *doubt) {
    double slope[3] = {NAN, NAN, NAN};
    int64_t last = past->n - 1;
    for (int k = 0; k < 3 && last - k > 0; k++) {
        const double *now = past->row[last - k], *before = past->row[last - k - 1];
        slope[k] = (now[column] - before[column]) / (now[PAST_TIME] - before[PAST_TIME]) * turn /
                   past->row[last][column];
    }
    double found = minmod(slope[0], slope[1]), most = 0.0;
    double apart[3] = {slope[0] - found, slope[0] - slope[1], slope[1] - slope[2]};
    for (int k = 0; k < 3; k++)
        if (fabs(apart[k]) > most) most = fabs(apart[k]);
    *doubt = 0.5 * most;
    return found;
}

/* Mean of a polynomial from -1 to 0. Reference: _means. */
static double mean_of(const double *c, int terms) {
    double sum = 0.0, sign = 1.0;
    for (int k = 0; k < terms; k++, sign = -sign) sum += c[k] * (sign / (k + 1.0));
    return sum;
}

/* Reference: _steady_enough */
static int steady_enough(const double *rate, int terms, double ahead) {
    double step = (ahead + 1.0) / 32.0;
    for (int k = 0; k <= 32; k++) {
        double y = polynomial(rate, terms, k < 32 ? k * step - 1.0 : ahead);
        if (!(y > 1.0 / LARGEST_RATIO && y < LARGEST_RATIO)) return 0;
    }
    return 1;
}

/* q of the speed at the contact over its mean of the turn, its doubt, and what is late.
 * Reference: _slip */
static double slip_of(const Course *omega, const Course *speed, double slope, double slope_std,
                      double rate_std, double *std, double *late) {
    double slip = 1.0 + 0.5 * slope;
    *std = slope_std;
    *late = 1.0;
    if (!omega->there || !omega->known || !speed->there) return slip;
    double rate_there = omega->shape[0] / mean_of(omega->shape, omega->terms);
    double speed_there = 1.0, speed_std = 0.0;
    if (speed->known) {
        speed_there = speed->shape[0] / mean_of(speed->shape, speed->terms);
        speed_std = speed->std;
    }
    double apart = rate_there / speed_there - slip;
    double variance = omega->std * omega->std + speed_std * speed_std;
    double share = 0.0;
    if (speed->known && apart * apart > variance) share = 1.0 - variance / (apart * apart);
    double left = hypot(slope_std, apart) * (1.0 - share);
    double direct = share * hypot(sqrt(variance), 2.0 * rate_std);
    *std = hypot(left, direct);
    *late = 1.0 - share;
    return slip + share * apart;
}

/* What the law of the next turn needs: the past, and this turn's row. */
static Past remembered(const Past *past, double middle, double turn, const Course *omega,
                       const Course *speed) {
    Past now = *past;
    if (now.n == REMEMBERED) {
        for (int i = 1; i < REMEMBERED; i++)
            for (int k = 0; k < PAST_COLUMNS; k++) now.row[i - 1][k] = now.row[i][k];
        now.n--;
    }
    double *row = now.row[now.n++];
    row[PAST_TIME] = middle - 0.5 * turn;
    row[PAST_OMEGA] = omega->there ? 1.0 / (turn * omega->mean) : NAN;
    row[PAST_SPEED] = speed->there ? 1.0 / (turn * speed->mean) : NAN;
    row[PAST_NONE] = 1.0 / turn;
    return now;
}

AngleLaw angle_law(double middle, double turn, double ahead, const Course *omega,
                   const Course *speed, const Past *past, double unknown) {
    static const double EVEN[1] = {1.0};
    AngleLaw law = {0};
    const double *shape = EVEN;
    int terms = 1, row = PAST_NONE;
    double fit_std = 0.0, slope_std, speed_slope_std, rate[ANGLE_TERMS] = {0.0};
    law.middle = middle;
    law.turn = turn;
    law.past = remembered(past, middle, turn, omega, speed);
    if (omega->there && omega->known) {
        shape = omega->shape, terms = omega->terms, fit_std = omega->std, row = PAST_OMEGA;
    } else if (speed->there && speed->known) {
        shape = speed->shape, terms = speed->terms, fit_std = speed->std, row = PAST_SPEED;
    }
    double speed_slope = followed(&law.past, PAST_SPEED, turn, &speed_slope_std);
    speed_slope_std = hypot(speed_slope_std, sqrt(ENDS) * speed_slope);
    double slope = followed(&law.past, row, turn, &slope_std);
    if (row == PAST_SPEED) slope_std = speed_slope_std;
    if (law.past.n == 1 && !omega->there && !speed->there) slope_std = unknown;
    for (int k = 0; k < terms; k++) {
        rate[k] += shape[k] * (1.0 + 0.5 * slope);
        rate[k + 1] += shape[k] * slope;
    }
    double mean = mean_of(rate, ++terms);
    for (int k = 0; k < terms; k++) rate[k] /= mean;
    if (!steady_enough(rate, terms, ahead / turn)) {
        rate[0] = 1.0;
        terms = 1;
        fit_std = 1.0;
    }
    double contact_rate = rate[0] / turn;
    double slip = slip_of(omega, speed, speed_slope, speed_slope_std, slope_std, &law.slip_std,
                          &law.late);
    if (!(slip > 1.0 / LARGEST_RATIO && slip < LARGEST_RATIO)) {
        slip = 1.0;
        law.slip_std = fit_std = 1.0;
    }
    law.terms = terms + 1;
    for (int k = 0; k < terms; k++) law.angle[k + 1] = 2.0 * PI * rate[k] / (k + 1);
    law.step = 2.0 * PI * contact_rate;
    law.std = hypot(fit_std, slope_std);
    law.speed = contact_rate / (law.past.row[law.past.n - 1][PAST_SPEED] * slip);
    return law;
}
