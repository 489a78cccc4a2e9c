#include "regressors.h"

/* One feature of the chain's gages. */
typedef double Row[GAGES];

static void row_of(const Chain *c, const double *feature, double *row) {
    for (int i = 0; i < c->gages; i++) row[i] = feature[c->gage[i]];
}

/* Product of a row of a fitting matrix with the gages' values. */
static double fitted(const double *matrix, const double *row, int n) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += matrix[i] * row[i];
    return sum;
}

static double level(const Chain *c, const double *row) { return fitted(c->line, row, c->gages); }

static double slope(const Chain *c, const double *row) {
    return fitted(c->line + c->gages, row, c->gages);
}

/* Highest coefficient of a polynomial over the gages. */
static double highest(const Chain *c, const double *row, int degree) {
    const double *matrix = c->highest + (degree - 2) * c->gages;
    return c->gages <= degree ? NAN : fitted(matrix, row, c->gages);
}

static double bow(const Chain *c, const double *row) { return highest(c, row, 2); }

/* Reference: with_moved, of what the regressors are made of. */
static void move(const Turn *turn, int gages, double step, int moved, Features *f) {
    double scale = 1.0 + step;
    for (int g = 0; g < gages && moved == LONGER; g++) {
        f->lead[g] *= scale;
        f->trail[g] *= scale;
        f->cp1_angle[g] *= scale;
        f->cp2_angle[g] *= scale;
        f->e_vertical[g] *= scale;
        f->skew[g] *= scale;
        f->rate_lead[g] /= scale;
        f->rate_trail[g] /= scale;
    }
    for (int g = 0; g < gages && moved == HIGHER; g++) {
        double higher = turn->offset_std[g];
        f->cp1[g] -= higher;
        f->cp2[g] -= higher;
        f->tp[g] -= higher;
        f->e_vertical[g] -= higher * (f->trail[g] - f->lead[g]);
    }
}

void compute_regressors(const Calibration *cal, const Chain *c, const Turn *turn,
                        const Features *features, int moved, double *v) {
    Features f = *features;
    Row angle, cp1, cp2, tp, vertical, skew, sum, apart, lead, trail;
    double steps[GAGES], opening[GAGES], closing[GAGES], steep[GAGES], change[GAGES], scale = 0.0;
    move(turn, cal->gages, cal->constants.angle_step, moved, &f);
    for (int g = 0; g < cal->gages; g++) {
        steps[g] = f.trail[g] - f.lead[g];
        opening[g] = f.lead[g] - f.cp1_angle[g];
        closing[g] = f.cp2_angle[g] - f.trail[g];
        steep[g] = f.rate_lead[g] - f.rate_trail[g];
        change[g] = f.rate_lead[g] + f.rate_trail[g];
    }
    row_of(c, steps, angle);
    row_of(c, f.cp1, cp1);
    row_of(c, f.cp2, cp2);
    row_of(c, f.tp, tp);
    row_of(c, f.e_vertical, vertical);
    row_of(c, f.skew, skew);
    row_of(c, steep, sum);
    row_of(c, change, apart);
    row_of(c, opening, lead);
    row_of(c, closing, trail);
    for (int i = 0; i < c->gages; i++) scale += tp[i];
    scale /= c->gages;
    for (int i = 0; i < VALUES; i++) v[i] = NAN;
    v[V_CONTACT_ANGLE] = level(c, angle);
    v[V_COMPRESSION] = 0.5 * (level(c, cp1) + level(c, cp2)) / scale;
    v[V_TRACTION] = (level(c, cp1) - level(c, cp2)) / scale;
    v[V_TENSION] = scale;
    v[V_CP1_SLOPE] = slope(c, cp1) / scale;
    v[V_CP2_SLOPE] = slope(c, cp2) / scale;
    v[V_ANGLE_SLOPE] = slope(c, angle);
    v[V_TP_SLOPE] = slope(c, tp) / scale;
    v[V_ANGLE_BOW] = bow(c, angle);
    v[V_TP_BOW] = bow(c, tp) / scale;
    v[V_CP1_BOW] = bow(c, cp1) / scale;
    v[V_CP2_BOW] = bow(c, cp2) / scale;
    for (int degree = 3; degree <= 4; degree++) {
        double *left = v + (degree == 3 ? V_ANGLE_TWIST : V_ANGLE_WAVE);
        left[0] = highest(c, angle, degree);
        left[1] = highest(c, cp1, degree) / scale;
        left[2] = highest(c, cp2, degree) / scale;
        left[3] = highest(c, tp, degree) / scale;
    }
    v[V_FULLNESS] = level(c, vertical) / scale;
    v[V_SKEW] = level(c, skew);
    v[V_STEEPNESS] = 0.5 * level(c, sum) / scale;
    v[V_STEEPNESS_CHANGE] = level(c, apart) / scale;
    v[V_LEAD_BEND] = level(c, lead);
    v[V_TRAIL_BEND] = level(c, trail);
    v[V_OMEGA] = turn->omega;
    v[V_PRESSURE] = turn->pressure;
    v[V_SPEED] = turn->speed;
    v[V_CAMBER] = turn->camber;
    v[V_FRICTION] = turn->friction;
    v[V_TREAD_DEPTH] = turn->tread_depth;
    v[V_TREAD_TEMPERATURE] = turn->tread_temperature;
    v[V_SPEED_SQUARED] = turn->speed * turn->speed;
}
