#include "contacts.h"

#include "order.h"

static const double RISE = 0.7, FALL = 0.62, JUMP = 2.5, GAP_REACH = 0.1, PATIENCE = 2.5;
static const double SMALLEST_SWING = 5e-4, SLEW = 32.0, LEAST_SLEW = 0.1, PULSES = 250.0;
static const double LONGEST_BURST = 0.02, SHORTER = 0.5;

double contact_middle(const Contact *contact) { return 0.5 * (contact->rise + contact->fall); }

/* ContactFinder._restart */
static void restart(ContactFinder *f) {
    f->levels = f->pulse = f->middles = f->periods = 0;
    f->armed = 1;
    f->level = f->low_level = f->swing = NAN;
    f->lowest = INFINITY;
    f->highest = -INFINITY;
    f->since = f->count;
}

void finder_start(ContactFinder *f, int64_t longest_turn, int centre) {
    f->longest_turn = f->patience = longest_turn;
    f->turns = f->turns_at = 0;
    f->centre = centre;
    f->count = 0;
    f->seen = f->whole = f->bursts = 0;
    f->first_burst = f->last_burst = f->apart = 0;
    f->tail[0] = f->tail[1] = f->held = NAN;
    f->pulse_start = 0;
    f->last_middle = f->last_period = NAN;
    f->last_rise = -1.0;
    restart(f);
}

/* ContactFinder._median_of_three, of samples of which none is NaN. */
static double median_of_three(double a, double b, double c) {
    double low = a < b ? a : b, high = a < b ? b : a;
    if (c < high) high = c;
    return low > high ? low : high;
}

/* ContactFinder._room */
static int64_t room(const ContactFinder *f) {
    int64_t left = f->since + f->patience - f->count;
    return left > 1 ? left : 1;
}

/* ContactFinder._extreme_hidden: missing samples are those of the ring since the last rise. */
static int extreme_hidden(const ContactFinder *f, const Ring *ring) {
    int64_t first = (int64_t)floor(f->last_rise) + 1, base = ring_base(ring);
    double reach = GAP_REACH * f->last_period;
    if (f->bursts && (!f->periods || (double)f->first_burst < (double)f->since + reach ||
                      (double)f->last_burst > (double)f->pulse_start - reach))
        return 1;
    for (int64_t i = first > base ? first : base; i < f->count; i++) {
        if (isfinite(ring_at(ring, f->centre, i))) continue;
        if (!f->periods) return 1;
        if ((double)i < (double)f->since + reach || (double)i > (double)f->pulse_start - reach)
            return 1;
    }
    return 0;
}

/* ContactFinder._finish */
static int finished(ContactFinder *f, const Ring *ring, double last, Contact *found) {
    int start_up = !f->levels, fresh = start_up || !f->middles;
    double swing = f->highest - f->lowest, own_level = f->lowest + RISE * swing;
    double level = start_up ? own_level : f->level;
    int64_t size = f->count - f->pulse_start, i = 0, j = 0;
    f->pulse = 0;
    for (int64_t k = 0, any = 0; k < size; k++)
        if (*ring_seen(ring, f->pulse_start + k) > level) {
            if (!any) i = k;
            any = 1;
            j = k;
        }
    int64_t seen = f->pulse_start + i - f->since;
    if (i == 0 || j == size - 1 || (start_up && seen < j - i)) {
        if (!start_up) restart(f);
        return 0; /* too little has been seen of what lies before it */
    }
    if (start_up || !extreme_hidden(f, ring)) {
        f->levels = 1;
        f->level = own_level;
        f->low_level = f->lowest + FALL * swing;
        f->swing = swing;
    }
    f->armed = 0; /* the new levels may lie below the strain just reached */
    f->lowest = f->highest = last;
    double before = *ring_seen(ring, f->pulse_start + i - 1);
    double at_rise = *ring_seen(ring, f->pulse_start + i);
    double at_fall = *ring_seen(ring, f->pulse_start + j);
    double after = *ring_seen(ring, f->pulse_start + j + 1);
    double rise = (double)(i - 1) + (level - before) / (at_rise - before);
    double fall = (double)j + (at_fall - level) / (at_fall - after);
    double shift = (double)(f->pulse_start + 1); /* the median of three lags by one sample */
    found->rise = rise + shift;
    found->fall = fall + shift;
    found->fresh = fresh;
    found->burst = f->bursts;
    found->damaged = f->bursts && f->last_burst >= (int64_t)found->rise - NEAR_EDGE;
    double middle = contact_middle(found);
    f->last_rise = found->rise;
    f->bursts = f->bursts && (double)f->last_burst > found->rise;
    if (f->first_burst < (int64_t)found->rise + 1) f->first_burst = (int64_t)found->rise + 1;
    f->since = f->count;
    f->periods = !fresh;
    f->last_period = middle - f->last_middle;
    f->last_middle = middle;
    f->middles = 1;
    double patience = fresh ? PULSES * (found->fall - found->rise) : PATIENCE * f->last_period;
    if (!fresh) f->patience = f->longest_turn; /* after a jump it is what it was */
    if (patience < (double)f->patience) f->patience = (int64_t)patience;
    if (!fresh && ((double)f->patience > SHORTER * (double)f->turns ||
                   f->count - f->turns_at > f->turns)) {
        f->turns = f->patience;
        f->turns_at = f->count;
    }
    return 1;
}

/* ContactFinder._until_burst: return a sample, or the good one that stands for it. */
static double without_burst(ContactFinder *f, const Ring *ring, double y) {
    double good = f->count ? *ring_seen(ring, f->count - 1) : NAN, apart = fabs(y - good);
    int known = f->levels && f->periods && f->whole == 3;
    if (!known || !(apart > f->swing * LEAST_SLEW) || /* nearly always, and quickly told */
        !(apart > f->swing * (SLEW * (2.0 * PI / f->last_period))) ||
        !((double)f->apart < LONGEST_BURST * f->last_period)) {
        f->apart = 0;
        return y;
    }
    f->last_burst = f->count + 1; /* the median of three lags by one sample */
    if (!f->bursts) f->first_burst = f->last_burst;
    f->bursts = 1;
    f->apart++;
    return good;
}

/* ContactFinder._until_jump: an extreme with which the swing outgrows the levels. */
static void take_extreme(ContactFinder *f, double y) {
    if (y < f->lowest) f->lowest = y;
    if (y > f->highest) f->highest = y;
    if (!f->levels || f->highest - f->lowest <= JUMP * f->swing) return;
    f->levels = f->middles = f->periods = 0;
    f->armed = 1;
}

/* ContactFinder._advance, of one sample */
static int advance(ContactFinder *f, const Ring *ring, double y, Contact *found) {
    int above, below;
    if (isnan(y)) { /* nothing finite seen yet */
        f->since = ++f->count;
        return 0;
    }
    if (y < f->lowest || y > f->highest) take_extreme(f, y);
    if (f->levels) {
        above = y > f->level;
        below = y < f->low_level;
    } else {
        double swing = f->highest - f->lowest;
        int known = swing > SMALLEST_SWING;
        above = known && y > f->lowest + RISE * swing;
        below = !known || y < f->lowest + FALL * swing;
    }
    int arming = !f->pulse && !f->armed, expired = room(f) <= 1;
    int event = f->pulse || arming ? below : above, ended = event && f->pulse;
    if (event && !f->pulse && !expired) {
        if (arming) {
            f->armed = 1;
        } else {
            f->pulse = 1;
            f->pulse_start = f->count - 1;
        }
    }
    f->count++;
    if (expired) {
        f->patience = 2 * f->patience + 1;
        if (f->patience < f->turns) f->patience = f->turns;
        if (f->patience > f->longest_turn) f->patience = f->longest_turn;
        restart(f);
        return 0;
    }
    return ended ? finished(f, ring, y, found) : 0;
}

int finder_take(ContactFinder *f, const Ring *ring, Contact *found) {
    double x = ring_at(ring, f->centre, ring->total - 1), y = NAN;
    f->whole = !isfinite(x) ? 0 : f->whole < 3 ? f->whole + 1 : 3;
    if (isfinite(x)) f->held = x; /* ContactFinder._without_gaps */
    x = f->held;
    int whole = f->seen == 2;
    if (whole && !isnan(f->tail[0]) && !isnan(f->tail[1]))
        y = median_of_three(f->tail[0], f->tail[1], x);
    f->tail[0] = f->tail[1];
    f->tail[1] = x;
    if (!whole) {
        f->seen++;
        return 0;
    }
    y = without_burst(f, ring, y);
    *ring_seen(ring, f->count) = y;
    return advance(f, ring, y, found);
}

int finder_skip(ContactFinder *f, Ring *ring, const double *x) {
    double y[QUIET + 1], step[QUIET], low, high, unused, steepest;
    int lost = 0, turning = f->levels && f->periods && f->armed && !f->pulse && f->whole == 3;
    if (!turning || room(f) <= QUIET + 1 || ring->place + QUIET > ring->capacity) return 0;
    y[0] = *ring_seen(ring, f->count - 1);
    for (int i = 0; i < QUIET; i++) lost += !isfinite(x[i]);
    for (int i = 0; i < QUIET; i++) y[i + 1] = median_of_three(x[i - 2], x[i - 1], x[i]);
    for (int i = 0; i < QUIET; i++) step[i] = fabs(y[i + 1] - y[i]);
    limits(y + 1, QUIET, &low, &high);
    limits(step, QUIET, &unused, &steepest);
    low = low < f->lowest ? low : f->lowest;
    if (lost || !(high <= f->level) || !(steepest <= f->swing * LEAST_SLEW)) return 0;
    high = high > f->highest ? high : f->highest;
    if (high - low > JUMP * f->swing) return 0;
    ring_skip(ring, QUIET);
    for (int i = 0; i < QUIET; i++) *ring_seen(ring, f->count + i) = y[i + 1];
    f->lowest = low;
    f->highest = high;
    f->count += QUIET;
    f->apart = 0;
    f->tail[0] = x[QUIET - 2];
    f->tail[1] = f->held = x[QUIET - 1];
    return 1;
}
