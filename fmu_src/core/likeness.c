#include "likeness.h"

#include "laws.h"
#include "linear.h"
#include "polynomial.h"

void likeness_rest(const Likeness *l, const double *values, double *rest) {
    double x[TERMS];
    design(&l->form, values, x);
    for (int i = 0; i < l->names; i++) {
        double expected = 0.0;
        for (int t = 0; t < l->form.terms; t++) expected += x[t] * l->coefficient[t * l->names + i];
        rest[i] = values[(int)l->name[SHIFTS * i + SHIFT_NUMBER]] - expected;
    }
}

/* Reference: Likeness.within */
static int within(const Likeness *l, const double *values) {
    for (int v = 0; v < l->form.variables; v++)
        if (!(fabs(standardised(&l->form, v, values)) <= l->edge)) return 0;
    return 1;
}

/* Reference: _each */
static void add_each(double s[NAMES][NAMES], int n, const double *shift, double share) {
    for (int i = 0; i < n; i++) s[i][i] += share * shift[i] * (share * shift[i]);
}

/* Reference: _along */
static void add_along(double s[NAMES][NAMES], int n, const double *shift, double doubt) {
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) s[i][j] += shift[i] * shift[j];
    if (doubt > 0.0) add_each(s, n, shift, doubt);
}

double likeness_apart(const Likeness *l, const Constants *k, const Look *look) {
    double s[NAMES][NAMES], rest[NAMES], found[NAMES] = {0.0}, unknown, sided_unknown, square = 0.0;
    double doubt[NAMES] = {0.0}, tread[NAMES] = {0.0}, hard[NAMES] = {0.0};
    double slid[NAMES] = {0.0}, leaning[NAMES] = {0.0};
    double pressure = pressure_departure(look->laws, k, look->values, &unknown);
    double sided = pressure_departure(look->force_laws, k, look->values, &sided_unknown);
    double speed = or_else(speed_departure(look->laws, k, look->values), 0.0);
    int n = l->names;
    likeness_rest(l, look->values, rest);
    sided = hypot(sided, sided_unknown);
    for (int i = 0; i < n; i++) {
        const double *shift = l->name + SHIFTS * i;
        int odd = shift[SHIFT_ODD] != 0.0;
        double even = hypot(k->unlike_pressure * pressure, unknown) * shift[SHIFT_PRESSURE];
        double side = !odd ? 1.0 : look->sliding > 0.0 ? 1.0 : look->sliding < 0.0 ? -1.0 : 0.0;
        doubt[i] = hypot(odd ? sided * shift[SHIFT_PRESSURE] : even,
                         k->unlike_speed * speed * shift[SHIFT_SPEED]);
        rest[i] -= pressure * (odd ? 0.0 : shift[SHIFT_PRESSURE]);
        rest[i] -= look->tread * shift[SHIFT_TREAD];
        tread[i] = look->tread_std * shift[SHIFT_TREAD];
        hard[i] = look->tread * shift[SHIFT_TREAD];
        slid[i] = fabs(look->sliding) * side * shift[SHIFT_SLIDING];
        leaning[i] = look->camber * shift[SHIFT_CAMBER];
        found[i] = rest[i];
        for (int j = 0; j < n; j++) s[i][j] = l->covariance[i * n + j];
    }
    add_each(s, n, doubt, 1.0);
    add_along(s, n, tread, k->road_doubt);
    add_each(s, n, hard, k->road_doubt);
    if (!isnan(look->sliding)) add_along(s, n, slid, k->road_doubt);
    add_along(s, n, leaning, k->road_doubt);
    for (int m = 0; m < 2; m++) add_along(s, n, look->moves[m], 0.0);
    solve(&s[0][0], NAMES, found, n);
    for (int i = 0; i < n; i++) square += rest[i] * found[i];
    return within(l, look->values) ? square / n : NAN;
}

double slope_left(const Likeness *l, const Constants *k, const double *values, double sliding,
                  double *noise) {
    double rest[NAMES];
    int i = l->angle_slope;
    *noise = NAN;
    if (i < 0) return NAN;
    likeness_rest(l, values, rest);
    *noise = hypot(sqrt(l->covariance[i * l->names + i]), k->slope_sliding * or_else(sliding, 1.0));
    return within(l, values) ? rest[i] : NAN;
}
