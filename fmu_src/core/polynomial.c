#include "polynomial.h"

#include "linear.h"
#include "order.h"

double standardised(const Form *form, int variable, const double *values) {
    const double *v = form->variable + 3 * variable;
    return (values[(int)v[0]] - v[1]) / v[2];
}

static double power(double z, int exponent) {
    double product = 1.0;
    for (int i = 0; i < exponent; i++) product *= z;
    return product;
}

void design(const Form *form, const double *values, double *terms) {
    double z[VARIABLES];
    for (int v = 0; v < form->variables; v++) z[v] = standardised(form, v, values);
    for (int t = 0; t < form->terms; t++) {
        const double *exponent = form->exponent + t * form->variables;
        double product = 1.0;
        for (int v = 0; v < form->variables; v++) /* most are zero */
            if (exponent[v] > 0.0) product *= power(z[v], (int)exponent[v]);
        terms[t] = product;
    }
}

/* Variance that uncertain coefficients leave, from the half of the covariance below its diagonal.
 * Reference: leverage */
static double leverage(const double *x, const double *covariance, int n) {
    double variance = 0.0;
    for (int i = 0; i < n; i++) {
        const double *row = covariance + i * n;
        variance += x[i] * (row[i] * x[i] + 2.0 * dot(row, x, (size_t)i));
    }
    return variance;
}

double judged(const Polynomial *p, const Constants *k, const double *values, double *std, int *near) {
    double x[TERMS], value = 0.0;
    design(&p->form, values, x);
    for (int t = 0; t < p->form.terms; t++) value += x[t] * p->coefficient[t];
    double uncertain = leverage(x, p->covariance, p->form.terms);
    *near = !p->bordered || uncertain <= p->far;
    if (p->bordered) uncertain += p->growth * maximum(uncertain - p->near, 0.0);
    if (p->pulled != 0.0) {
        double square = values[V_TRACTION] * values[V_TRACTION];
        uncertain += p->pulled * p->pulled * (square / (square + k->pull * k->pull));
    }
    *std = sqrt(p->residual * p->residual + p->floor * p->floor + uncertain);
    return value;
}

double predicted(const Polynomial *p, const Constants *k, const double *values, double *std) {
    int near;
    return judged(p, k, values, std, &near);
}

double slope_by(const Polynomial *p, const double *values, int value) {
    const Form *form = &p->form;
    double z[VARIABLES], sum = 0.0;
    int by = -1;
    for (int v = 0; v < form->variables; v++) {
        z[v] = standardised(form, v, values);
        if ((int)form->variable[3 * v] == value) by = v;
    }
    for (int t = 0; by >= 0 && t < form->terms; t++) {
        const double *exponent = form->exponent + t * form->variables;
        double product = 1.0, factor = exponent[by] / form->variable[3 * by + 2];
        for (int v = 0; v < form->variables; v++) {
            int e = (int)exponent[v];
            product *= power(z[v], v == by && e > 0 ? e - 1 : e);
        }
        sum += product * (factor * p->coefficient[t]);
    }
    return sum;
}

static int inside(const double *range, double x) {
    return x >= range[RANGE_LOW] && x <= range[RANGE_HIGH];
}

int all_inside(const Guard *guard, const double *values, double own) {
    for (int i = 0; i < guard->ranges; i++) {
        const double *range = guard->range + RANGE_WIDTH * i;
        double x = range[RANGE_NUMBER] < 0.0 ? own : values[(int)range[RANGE_NUMBER]];
        if (!inside(range, x) && !(range[RANGE_OPTIONAL] != 0.0 && isnan(x))) return 0;
    }
    return 1;
}

int named_inside(const Guard *guard, int number, double value) {
    for (int i = 0; i < guard->ranges; i++) {
        const double *range = guard->range + RANGE_WIDTH * i;
        if (range[RANGE_NUMBER] == number && !isnan(value) && !inside(range, value)) return 0;
    }
    return 1;
}

/* Whether no gap between n directions exceeds pi; sorts them. Reference: _surrounded */
static int surrounded(double *angle, size_t n) {
    if (n == 0) return 0;
    sort(angle, n);
    double largest = angle[0] + 2.0 * PI - angle[n - 1];
    for (size_t i = 1; i < n; i++) largest = fmax(largest, angle[i] - angle[i - 1]);
    return largest <= PI;
}

int in_cloud(const Cloud *c, const double *values, double *scratch) {
    double x[2] = {values[c->name[0]] / c->scale[0], values[c->name[1]] / c->scale[1]};
    size_t n = 0;
    for (int side = 1; side >= (c->mirrored ? -1 : 1); side -= 2)
        for (int i = 0; i < c->points; i++) {
            double dx = c->point[2 * i] - x[0], dy = side * c->point[2 * i + 1] - x[1];
            double square = dx * dx + dy * dy;
            if (square <= c->reach * c->reach) return 1;
            if (square <= c->around * c->around) scratch[n++] = atan2(dy, dx);
        }
    return c->around != 0.0 && isfinite(x[0]) && isfinite(x[1]) && surrounded(scratch, n);
}
