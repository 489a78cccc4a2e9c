#include "any_road.h"

#include <float.h>

#include "linear.h"
#include "order.h"

enum { POINTS = NODES + WHOLE + 1 };

/* Slips that may be, with the shares that slide and how likely they are. */
typedef struct {
    double slip[POINTS], t[POINTS], weight[POINTS], angle[POINTS];
    double faded[POINTS]; /* (1 - t) to the power of the curve's fading */
    double across; /* slip on the calibrated road; last of the slips */
} Possible;

/* Minus the logarithm of two normal likelihoods. Reference: _surprise, twice */
static double surprise_of(const double apart[2], const double variance[2]) {
    double square = 0.0, product = 1.0;
    for (int i = 0; i < 2; i++) {
        if (!isfinite(variance[i]) || !isfinite(apart[i])) continue; /* nothing is known */
        square += apart[i] * apart[i] / variance[i];
        product *= variance[i];
    }
    return 0.5 * (square + log(product));
}

static double square(double x) { return x * x; }

/* Reference: _moments */
static double moments(const double *x, const double *weight, double *variance) {
    double sum = total(weight, POINTS), mean = dot(weight, x, POINTS) / sum, square[POINTS];
    for (int i = 0; i < POINTS; i++) square[i] = (x[i] - mean) * (x[i] - mean);
    *variance = dot(weight, square, POINTS) / sum;
    return mean;
}

/* The slips that frictions from `low` to `high` share leave, those beyond full sliding, and that of
 * the calibrated road. */
static void possible(const Calibration *cal, const SlidingCurve *c, const Seen *s, double used,
                     double along, double widest, Possible *p) {
    const Constants *k = &cal->constants;
    double n = c->sharpness, cornering = curve_cornering(c, k, s->load), pulled = fabs(along);
    double rough = fmax(k->rougher * c->friction, k->smooth), slippery = k->slippery;
    double low = curve_share(c, k, used, rough, s->load, along);
    double high = curve_share(c, k, used, slippery, s->load, along);
    for (int i = 0; i < NODES; i++) {
        double t = low + 0.5 * (high - low) * (cal->node[i] + 1.0);
        double rest = log(maximum(1.0 - t, DBL_MIN)); /* for two powers of 1 - t */
        double filled = maximum(1.0 - exp(n * rest), k->tiny);
        p->t[i] = t;
        p->faded[i] = exp(c->fading * rest);
        p->slip[i] = used / cornering * (t > 0.0 ? n * t / filled : 1.0); /* curve_across */
        p->weight[i] =
            n * used / (cornering * (filled * filled)) * 0.5 * (high - low) * cal->weight[i];
    }
    double begin = maximum(n * used / cornering, lost_slip(k, used, c->grip * rough, pulled));
    double end = minimum(tan(widest), lost_slip(k, used, c->grip * slippery, pulled));
    double room = isfinite(begin) ? maximum(end - begin, 0.0) : 0.0;
    for (int i = 0; i < WHOLE; i++) {
        double beyond = (room > 0.0 ? begin : 0.0) + room * (i + 0.5) / WHOLE;
        p->slip[NODES + i] = maximum(beyond, k->tiny);
        p->t[NODES + i] = 1.0;
        p->weight[NODES + i] = room / WHOLE + 0.0 * beyond;
    }
    int last = POINTS - 1;
    p->across = curve_lateral(c, k, used, c->friction, s->load, along, &p->t[last]);
    p->slip[last] = p->across;
    p->weight[last] = 0.0 * used;
    for (int i = NODES; i < POINTS; i++) p->faded[i] = pow(1.0 - p->t[i], c->fading);
    for (int i = 0; i < POINTS; i++) {
        p->angle[i] = angle_of(k, p->slip[i], s->slip_ratio);
        p->weight[i] *= sqrt(square(pulled / p->slip[i]) + 1.0);
        if (!(p->angle[i] <= widest)) p->weight[i] *= 0.0;
    }
}

/* Multiply the weights by how likely the readings are with each slip; return that of the
 * calibrated road. */
static double weigh(const Calibration *cal, const SlidingCurve *c, const Seen *s, double used,
                    double along, Possible *p) {
    const Constants *k = &cal->constants;
    double surprise[POINTS], least = INFINITY, stiffer = curve_stiffer(c, k, s->load);
    double of_moment = square(s->moment_std), of_pull = square(s->pull_std);
    double dry = used * p->faded[POINTS - 1];
    for (int i = 0; i < POINTS; i++) {
        /* a regression of one road shows a part only of what another takes from the moment */
        double aligned = used * p->faded[i], taken = s->unseen * (dry - aligned);
        double by_slip = used / p->slip[i], expected = by_slip * along, unsure = by_slip * stiffer;
        double slanted = square(c->slant * expected) + square(unsure * s->slip_std);
        double apart[2] = {s->moment - aligned - k->hidden * taken, s->pull - expected};
        double variance[2] = {of_moment + square(k->hidden_doubt * taken), of_pull + slanted};
        surprise[i] = surprise_of(apart, variance);
        least = minimum(least, surprise[i]);
    }
    for (int i = 0; i < POINTS; i++) p->weight[i] *= exp(least - surprise[i]);
    return exp(least - surprise[POINTS - 1]);
}

Told tell(const Calibration *cal, const SlidingCurve *c, const Seen *s, double widest) {
    const Constants *k = &cal->constants;
    Possible p;
    double variance, scatter, unused, used = maximum(s->used, k->least_utilisation);
    double free = atan(curve_lateral(c, k, used, c->friction, s->load, 0.0, &unused));
    double along = curve_along(c, k, free, s->slip_ratio, s->load);
    possible(cal, c, s, used, along, widest, &p);
    double learnt = 1.0 - weigh(cal, c, s, used, along, &p);
    double middle = moments(p.angle, p.weight, &variance), usual = p.angle[POINTS - 1];
    double change = learnt * (middle - usual), rest = middle - usual - change;
    double doubt = k->curve_doubt * change;
    double at = moments(p.t, p.weight, &scatter), apart = at - p.t[POINTS - 1];
    /* at a share that is known the angle grows with u in proportion */
    double steep = curve_slope_at(c, k, used, at, p.across, s->load, along);
    Told told = {1, usual + change, sqrt(variance + rest * rest + doubt * doubt), change,
                 learnt * middle / used + (1.0 - learnt) * steep, sqrt(scatter + apart * apart)};
    return told;
}
