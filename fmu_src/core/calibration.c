#include "calibration.h"

#include <string.h>

static const double MAGIC = 20220117.0, VERSION = 2.0;

/* What is left of a table; `bad` once something did not fit. */
typedef struct {
    const double *at, *end;
    int bad;
} Reader;

static const double *taken(Reader *r, size_t n) {
    const double *here = r->at;
    if (r->bad || (size_t)(r->end - r->at) < n) {
        r->bad = 1;
        return NULL;
    }
    r->at += n;
    return here;
}

static double number(Reader *r) {
    const double *x = taken(r, 1);
    return x ? *x : NAN;
}

/* A whole number from low to high; what is none damages the table. */
static int whole(Reader *r, int low, int high) {
    double x = number(r);
    if (x >= low && x <= high && x == floor(x)) return (int)x;
    r->bad = 1;
    return low;
}

static void numbers(Reader *r, double *to, size_t n) {
    const double *x = taken(r, n);
    for (size_t i = 0; i < n; i++) to[i] = x ? x[i] : NAN;
}

/* Rows that begin with the number of a value, from `low` on. */
static const double *rows(Reader *r, int n, int width, int low) {
    const double *x = taken(r, (size_t)(n * width));
    for (int i = 0; x && i < n; i++)
        if (!(x[i * width] >= low && x[i * width] < VALUES)) r->bad = 1;
    return x;
}

static Form form(Reader *r) {
    Form f;
    f.variables = whole(r, 0, VARIABLES);
    f.terms = whole(r, 0, TERMS);
    f.variable = rows(r, f.variables, 3, 0);
    size_t n = (size_t)(f.terms * f.variables);
    f.exponent = taken(r, n);
    for (size_t i = 0; f.exponent && i < n; i++)
        if (!(f.exponent[i] >= 0.0 && f.exponent[i] <= 16.0)) r->bad = 1;
    return f;
}

static Polynomial polynomial(Reader *r) {
    Polynomial p;
    memset(&p, 0, sizeof p);
    p.there = whole(r, 0, 1);
    if (!p.there) return p;
    p.form = form(r);
    p.coefficient = taken(r, (size_t)p.form.terms);
    p.covariance = taken(r, (size_t)(p.form.terms * p.form.terms));
    p.residual = number(r);
    p.floor = number(r);
    p.pulled = number(r);
    p.bordered = whole(r, 0, 1);
    p.near = number(r);
    p.growth = number(r);
    p.far = number(r);
    return p;
}

static Laws laws(Reader *r) {
    Laws l;
    numbers(r, l.pressure, 2);
    numbers(r, l.speed, 2);
    l.contact_width = number(r);
    l.radius = number(r);
    l.pressure_fitted = whole(r, 0, 1);
    l.speed_fitted = whole(r, 0, 1);
    return l;
}

static Road road(Reader *r) {
    Road p;
    numbers(r, p.depth, 2);
    numbers(r, p.temperature, 2);
    for (int i = 0; i < 3; i++) numbers(r, p.ends[i], 2);
    p.unknown_wear = number(r);
    p.unknown_height = number(r);
    p.unknown_warmth = number(r);
    return p;
}

static SlidingCurve sliding(Reader *r) {
    SlidingCurve s;
    memset(&s, 0, sizeof s);
    s.there = whole(r, 0, 1);
    if (!s.there) return s;
    s.friction = number(r);
    s.friction_std = number(r);
    s.grip = number(r);
    s.sharpness = number(r);
    s.fading = number(r);
    numbers(r, s.camber, 2);
    s.misfit = number(r);
    s.slant = number(r);
    s.unseen = number(r);
    numbers(r, s.stiffness, 3);
    numbers(r, s.trail, 3);
    numbers(r, s.ratio, 3);
    return s;
}

static Cloud cloud(Reader *r) {
    Cloud c;
    memset(&c, 0, sizeof c);
    c.there = whole(r, 0, 1);
    if (!c.there) return c;
    c.name[0] = whole(r, 0, VALUES - 1);
    c.name[1] = whole(r, 0, VALUES - 1);
    numbers(r, c.scale, 2);
    c.reach = number(r);
    c.around = number(r);
    c.mirrored = whole(r, 0, 1);
    c.points = whole(r, 1, 1000000);
    c.point = taken(r, 2 * (size_t)c.points);
    return c;
}

static Likeness likeness(Reader *r) {
    Likeness l;
    memset(&l, 0, sizeof l);
    l.there = whole(r, 0, 1);
    if (!l.there) return l;
    l.form = form(r);
    l.names = whole(r, 1, NAMES);
    l.angle_slope = whole(r, -1, l.names - 1);
    l.limit = number(r);
    l.edge = number(r);
    l.name = rows(r, l.names, SHIFTS, 0);
    l.coefficient = taken(r, (size_t)(l.form.terms * l.names));
    l.covariance = taken(r, (size_t)(l.names * l.names));
    return l;
}

static Chain chain(Reader *r, int gages) {
    Chain c;
    memset(&c, 0, sizeof c);
    c.there = 1;
    c.gages = whole(r, 2, gages);
    for (int g = 0; g < c.gages; g++) c.gage[g] = whole(r, 0, gages - 1);
    c.line = taken(r, 2 * (size_t)c.gages);
    c.highest = taken(r, 3 * (size_t)c.gages);
    c.needs_pressure = whole(r, 0, 1);
    c.needs_camber = whole(r, 0, 1);
    c.needs_speed = whole(r, 0, 1);
    c.force_knows_camber = whole(r, 0, 1);
    c.radius_knows_load = whole(r, 0, 1);
    c.mean_load = number(r);
    c.load_per_hardening = number(r);
    c.widest = number(r);
    numbers(r, c.camber, 2);
    for (int q = 0; q < QUANTITIES; q++) {
        c.guard[q].ranges = whole(r, 0, VALUES + 1);
        c.guard[q].range = rows(r, c.guard[q].ranges, RANGE_WIDTH, -1);
    }
    c.laws = laws(r);
    c.force_laws = laws(r);
    c.road = road(r);
    c.load = polynomial(r);
    c.radius = polynomial(r);
    c.force = polynomial(r);
    c.angle = polynomial(r);
    c.blur = number(r);
    c.bend = number(r);
    c.moment = polynomial(r);
    c.drag = polynomial(r);
    c.sliding = sliding(r);
    c.cloud = cloud(r);
    c.likeness = likeness(r);
    c.agreement = likeness(r);
    return c;
}

size_t calibration_size(void) { return sizeof(Calibration); }

size_t calibration_read(Calibration *c, const double *table, size_t n) {
    Reader r = {table, table + n, 0};
    memset(c, 0, sizeof *c);
    if (number(&r) != MAGIC || number(&r) != VERSION || number(&r) != (double)n) return 1;
    c->gages = whole(&r, 2, GAGES);
    numbers(&r, c->lateral, (size_t)c->gages);
    c->order = number(&r);
    c->cut_off = number(&r);
    c->rolling_centre = number(&r);
    c->rolling_threshold = number(&r);
    numbers(&r, (double *)(void *)&c->constants, sizeof c->constants / sizeof(double));
    if (!(c->constants.newton >= 0.0 && c->constants.newton <= 100.0)) r.bad = 1;
    c->node = taken(&r, NODES);
    c->weight = taken(&r, NODES);
    int chains = whole(&r, 1, c->gages + 1);
    for (int i = 0; i < chains && !r.bad; i++) {
        int missing = whole(&r, -1, c->gages - 1);
        Chain *to = &c->chain[missing < 0 ? ALL_GAGES : missing];
        *to = chain(&r, c->gages);
        int points = to->cloud.points * (to->cloud.mirrored ? 2 : 1);
        if (points > c->largest_cloud) c->largest_cloud = points;
    }
    if (r.bad || r.at != r.end || !c->chain[ALL_GAGES].there) return (size_t)(r.at - table) + 1;
    return 0;
}
