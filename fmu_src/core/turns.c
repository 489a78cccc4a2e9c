#include "turns.h"

#include <string.h>

#include "order.h"
#include "quality.h"

static const double AFTER = 20.0 * (3.14159265358979323846 / 180.0);
static const double OFFSET_HALF_WIDTH = 0.5, LARGEST_MISSING = 0.1, LARGEST_PERIOD_RATIO = 2.0;
static const double DRIFT_SHARE = 0.05, MISSED_RATIO = 1.5, LARGEST_ANGLE_STD = 0.02;
static const double USUAL_CHANGE = 1.0, LONGEST_TURN = 3.0;

/* The whole part of a sample number; -1 for what no sample number can be. */
static int64_t whole(double x) { return fabs(x) < 9e15 ? (int64_t)x : -1; }

static int64_t longest_turn(double rate) { return (int64_t)(LONGEST_TURN * rate); }

/* Two turns of the longest are kept; a pulse takes three samples at least. */
static int64_t capacity_of(double rate) { return 2 * longest_turn(rate) + 64; }
static int64_t places_of(double rate) { return capacity_of(rate) / 3 + 1; }

size_t cutter_size(int gages, double rate) {
    if (gages < 1 || gages > GAGES || !(rate >= 1.0 && rate <= 1e6)) return 0;
    size_t n = (size_t)capacity_of(rate);
    size_t doubles = ring_size(gages, capacity_of(rate)) +
                     ((size_t)gages + filter_lanes(gages) + 4) * n;
    return sizeof(Cutter) + doubles * sizeof(double) + (size_t)places_of(rate) * sizeof(Contact) + n;
}

Cutter *cutter_start(void *memory, int gages, const double *lateral, double rate,
                     const LowPass *low_pass) {
    Cutter *c = memory;
    memset(c, 0, sizeof *c);
    c->gages = gages;
    c->rate = rate;
    c->low_pass = *low_pass;
    for (int g = 1; g < gages; g++)
        if (fabs(lateral[g]) < fabs(lateral[c->centre])) c->centre = g;
    c->room = capacity_of(rate);
    c->places = places_of(rate);
    double *next = (double *)(void *)(c + 1);
    size_t n = (size_t)c->room;
    ring_start(&c->ring, next, gages, c->room);
    next += ring_size(gages, c->room);
    c->window = next, next += gages * c->room;
    c->rows = next, next += filter_lanes(gages) * n;
    c->angle = next, next += c->room;
    c->scratch = next, next += 3 * c->room;
    c->waiting = (Contact *)(void *)next;
    c->missing = (unsigned char *)(c->waiting + c->places);
    finder_start(&c->finder, longest_turn(rate), c->centre);
    c->previous_period = NAN;
    c->rolled.ratio = c->rolled.pull = NAN;
    return c;
}

/* Reference: TurnCutter._sigma; NaN where the filter does not suit the turn. */
static double sigma_of(const Cutter *c, const AngleLaw *law) {
    double turn_rate = law->step * c->rate / (2.0 * PI);
    return lowpass_suits(&c->low_pass, turn_rate, c->rate) ? lowpass_sigma(&c->low_pass, turn_rate)
                                                           : NAN;
}

/* Reference: _pulse */
static double pulse_of(const Contact *contact, const AngleLaw *law) {
    double rise = law_at(law, contact->rise), fall = law_at(law, contact->fall);
    return fall > rise ? 0.5 * (fall - rise) : NAN;
}

/* How many wheel angles of the grid are looked at with a pulse. */
static int angles_seen(double pulse) {
    int n = phi_before(pulse + AFTER);
    while (n < ANGLES && pulse + AFTER >= phi_at(n)) n++;
    return n;
}

/* Reference: TurnCutter._stop; -1 where it raises an error. */
static int64_t stop_of(const Cutter *c, const Contact *contact, const AngleLaw *law) {
    static const LowPass DEFAULT = {24.0, NAN};
    double sigma = sigma_of(c, law);
    if (isnan(sigma)) sigma = lowpass_sigma(&DEFAULT, 1.0);
    int seen = angles_seen(pulse_of(contact, law));
    double end = phi_at(seen > 0 ? seen - 1 : 0);
    int64_t last = whole(law_sample(law, end + lowpass_half_width(sigma)) + 2.0);
    return last < 0 ? -1 : last + 1;
}

static int64_t kept_from(const Cutter *c, int64_t sample) {
    int64_t base = ring_base(&c->ring);
    return sample > base ? sample : base;
}

/* Course of a held condition over the samples that the law is found from. */
static Course course_of(Cutter *c, int condition, int64_t first, int64_t stop, double middle,
                        double turn) {
    int64_t kept = kept_from(c, first);
    const double *x = ring_look(&c->ring, ring_held(&c->ring, condition), kept, stop, c->scratch);
    return course(x, stop > kept ? (size_t)(stop - kept) : 0, (double)first - middle, turn);
}

/* Law of the wheel angle and the last sample that the turn needs. Reference: TurnCutter._needs */
static void find_law(Cutter *c, const Contact *contact, const Contact *before) {
    double middle = contact_middle(contact), turn = middle - contact_middle(before);
    double seconds = turn / c->rate, unknown = 0.5 * USUAL_CHANGE * (seconds * seconds);
    int64_t first = (int64_t)ceil(contact_middle(before)), stop = c->stop;
    Course omega = course_of(c, OMEGA, first, stop, middle, turn);
    Course speed = course_of(c, SPEED, first, stop, middle, turn);
    c->law = angle_law(middle, turn, (double)stop - middle, &omega, &speed, &c->past, unknown);
    int64_t end = stop_of(c, contact, &c->law);
    if (end > c->stop || end < 0) c->stop = end;
}

/* Whether samples of the centre gage are missing from one sample to before another. */
static int gap_in(const Cutter *c, int64_t first, int64_t stop) {
    for (int64_t i = kept_from(c, first); i < stop && i < c->ring.total; i++)
        if (!isfinite(ring_at(&c->ring, c->centre, i))) return 1;
    return 0;
}

/* Reference: LastSamples.inspected */
static int damaged(const Cutter *c, const Contact *contact) {
    int64_t rise = (int64_t)contact->rise, fall = (int64_t)contact->fall;
    return gap_in(c, rise - NEAR_EDGE, rise + 2) || gap_in(c, fall - NEAR_EDGE, fall + 2);
}

/* Copy what is not missing, be it to its own place; return how many numbers these are. */
static size_t only_finite(double *out, const double *x, size_t n) {
    size_t count = 0;
    for (size_t i = 0; i < n; i++)
        if (isfinite(x[i])) out[count++] = x[i];
    return count;
}

/* Mean or median of a column between two sample numbers; `gap` where too much is missing.
 * Reference: LastSamples._mean */
static double mean_of(const Cutter *c, int column, double start, double stop, int robust,
                      int *gap) {
    int64_t a = kept_from(c, whole(rint(start))), b = whole(rint(stop));
    if (b > c->ring.total) b = c->ring.total;
    size_t n = b > a ? (size_t)(b - a) : 0;
    const double *x = ring_look(&c->ring, column, a, b, c->scratch);
    double sum = robust ? NAN : total(x, n), needed = (1.0 - LARGEST_MISSING) * (double)n;
    *gap = 0;
    if (n > 0 && isfinite(sum)) return sum / (double)n; /* none is missing */
    size_t count = only_finite(c->scratch, x, n);
    *gap = (double)count < (needed > 1.0 ? needed : 1.0);
    if (*gap) return NAN;
    return robust ? median(c->scratch, count) : total(c->scratch, count) / (double)count;
}

static double held_mean(const Cutter *c, int condition, double start, double stop) {
    int gap;
    return mean_of(c, ring_held(&c->ring, condition), start, stop, 0, &gap);
}

/* No curves from a wheel angle of the grid on. */
static void no_curves(Turn *turn, int gages, int from) {
    for (int g = 0; g < gages; g++)
        for (int i = g * ANGLES + from; i < (g + 1) * ANGLES; i++)
            turn->strain[i] = turn->rate[i] = NAN;
}

/* Strain and rate over wheel angle, and the gages' flags. Reference: TurnCutter._window */
static int window_of(Cutter *c, Turn *turn, double sigma) {
    int seen = angles_seen(turn->pulse);
    double start = law_sample(&c->law, phi_at(0) - lowpass_half_width(sigma)) - 2.0;
    int64_t first = kept_from(c, whole(start));
    size_t n = (size_t)(c->stop - first), stride = (size_t)c->room;
    Filter filter;
    for (int g = 0; g < c->gages; g++)
        ring_column(&c->ring, g, first, c->stop, c->window + (size_t)g * stride);
    inspect(c->window, stride, n, c->gages, c->law.step, turn->gage_flags, c->missing);
    law_angles(&c->law, (double)first, n, c->angle);
    if (!filter_start(&filter, c->angle, n, sigma, seen, c->scratch)) return 0;
    filter_rows(&filter, c->window, stride, c->gages, c->rows);
    no_curves(turn, c->gages, seen);
    filter_turn(&filter, c->rows, c->gages, turn->strain, turn->rate, c->scratch);
    mark_without_contact(turn->rate, (size_t)seen, c->gages, turn->gage_flags);
    return 1;
}

static void nothing_read(Cutter *c) {
    for (int g = 0; g < GAGES; g++) {
        c->first.time[g] = c->first.value[g] = NAN;
        c->last.time[g] = c->last.value[g] = NAN;
    }
}

static double or_zero(double x) {
    return isnan(x) ? 0.0 : x;
}

/* Offset at the contact, its std, and how it moved since it was last read; keeps what was read.
 * Reference: offset_at */
static void follow_offset(Cutter *c, const double *opposite, Turn *turn, double *moved) {
    double time = law_sample(&c->law, -PI);
    for (int g = 0; g < c->gages; g++) {
        double before = or_zero(c->last.value[g] - c->first.value[g]);
        double share = or_zero((c->law.middle - time) / (time - c->last.time[g]));
        double followed;
        moved[g] = or_zero(opposite[g] - c->last.value[g]);
        followed = minmod(moved[g], before);
        turn->offset[g] = opposite[g] + share * followed;
        turn->offset_std[g] = isnan(opposite[g]) ? NAN : share * fabs(moved[g] - followed);
        if (isnan(opposite[g])) continue;
        c->first.time[g] = c->last.time[g];
        c->first.value[g] = c->last.value[g];
        c->last.time[g] = time;
        c->last.value[g] = opposite[g];
    }
}

/* Wheel angle of the contact's middle from the trigger. Reference: TurnCutter._trigger */
static void look_at_trigger(const Cutter *c, double start, double stop, Turn *turn) {
    int64_t a = kept_from(c, whole(rint(start))), b = whole(rint(stop)), top = 0;
    const double *on = ring_look(&c->ring, ring_trigger(&c->ring), a, b, c->scratch);
    int times = 0;
    turn->axis_shift = NAN;
    for (int64_t i = a; i < b; i++) {
        if (isnan(on[i - a])) return;
        if (i > a && on[i - a] > 0.5 && on[i - a - 1] <= 0.5) times++, top = i;
    }
    if (a >= b) return;
    if (times == 1)
        turn->axis_shift = -PI - law_at(&c->law, (double)top - 0.5);
    else
        turn->flags |= TRIGGER_MISMATCH;
}

static void nothing_known(Turn *turn, int gages) {
    turn->time = turn->ready = turn->period = turn->omega = NAN;
    turn->angle_std = turn->slip_std = turn->pulse = turn->axis_shift = NAN;
    turn->speed = turn->pressure = turn->camber = turn->friction = NAN;
    turn->tread_depth = turn->tread_temperature = NAN;
    for (int g = 0; g < gages; g++) {
        turn->offset[g] = turn->offset_std[g] = turn->mean[g] = NAN;
        turn->gage_flags[g] = 0;
    }
    turn->flags = 0;
}

/* Reference: unknown_turn */
static void first_turn(const Cutter *c, const Contact *contact, Turn *turn) {
    nothing_known(turn, c->gages);
    no_curves(turn, c->gages, 0);
    turn->time = contact_middle(contact) / c->rate;
    turn->ready = contact->fall / c->rate;
    turn->flags = FIRST_TURN | (contact->burst ? SPIKE : 0);
}

/* Conditions over the turn and in its contact. */
static void take_conditions(const Cutter *c, const Contact *contact, double start, double stop,
                            Turn *turn) {
    double speed = held_mean(c, SPEED, start, stop);
    double omega = held_mean(c, OMEGA, start, stop);
    double turned = fabs(omega) * (stop - start) / (2.0 * PI * c->rate);
    if (!(turn->flags & FIRST_TURN) &&
        (turned > LARGEST_OMEGA_RATIO || turned < 1.0 / LARGEST_OMEGA_RATIO ||
         omega * speed < 0.0))
        turn->flags |= OMEGA_MISMATCH;
    turn->pressure = held_mean(c, PRESSURE, start, stop);
    turn->tread_depth = held_mean(c, TREAD_DEPTH, start, stop);
    turn->tread_temperature = held_mean(c, TREAD_TEMPERATURE, start, stop);
    turn->camber = held_mean(c, CAMBER, contact->rise, contact->fall + 1.0);
    turn->friction = held_mean(c, FRICTION, contact->rise, contact->fall + 1.0);
    if (!isfinite(speed) || speed == 0.0) {
        turn->flags |= NO_SPEED; /* a wheel that turns does not stand */
        return;
    }
    if (speed < 0.0) turn->flags |= REVERSED;
    turn->speed = isfinite(c->law.speed) ? c->law.speed : speed;
}

/* What the gages say above their offset; marks drift and the gages that are out. */
static void take_strain(Cutter *c, double start, double stop, Turn *turn) {
    double opposite[GAGES], moved[GAGES], mean[GAGES];
    double from = law_sample(&c->law, -PI - OFFSET_HALF_WIDTH);
    double to = law_sample(&c->law, -PI + OFFSET_HALF_WIDTH);
    int out = 0, gap, gap_in_turn;
    for (int g = 0; g < c->gages; g++) {
        opposite[g] = mean_of(c, g, from, to, 1, &gap);
        mean[g] = mean_of(c, g, start, stop, 0, &gap_in_turn);
        if (gap || gap_in_turn) turn->gage_flags[g] |= GAP;
    }
    follow_offset(c, opposite, turn, moved);
    for (int g = 0; g < c->gages; g++) {
        int unusable = (turn->gage_flags[g] & UNUSABLE) != 0;
        double *strain = turn->strain + g * ANGLES, *rate = turn->rate + g * ANGLES, low, high;
        out += unusable;
        for (int k = 0; k < ANGLES; k++) strain[k] = unusable ? NAN : strain[k] - turn->offset[g];
        for (int k = 0; k < ANGLES && unusable; k++) rate[k] = NAN;
        limits(strain, ANGLES, &low, &high);
        double swing = fmax(high, 0.0) - fmin(low, 0.0);
        turn->mean[g] = unusable ? NAN : mean[g] - turn->offset[g];
        if (!unusable && fabs(moved[g]) > DRIFT_SHARE * swing) turn->gage_flags[g] |= DRIFT;
        turn->flags |= turn->gage_flags[g];
    }
    if (out > 1 || (turn->gage_flags[c->centre] & UNUSABLE))
        turn->flags |= TOO_FEW_GAGES;
    else if (out)
        turn->flags |= REDUCED_GAGES;
}

/* Relative standard deviation of turn rate over speed in the contact.
 * Reference: TurnCutter._slip_std */
static void take_slip(Cutter *c, const Contact *before, Turn *turn) {
    Rolled here = {c->law.step / c->law.speed, pull_of(turn->strain + c->centre * ANGLES)};
    double load = unseen_by_load(turn->pulse, pulse_of(before, &c->law));
    double traction = unseen_by_traction(&here, &c->rolled, turn->pulse);
    turn->slip_std = hypot(c->law.slip_std, c->law.late * hypot(load, traction));
    if (isfinite(here.ratio) && isfinite(here.pull) && !(turn->flags & FIRST_TURN))
        c->rolled = here;
}

/* Reference: TurnCutter._full_turn */
static int full_turn(Cutter *c, const Contact *contact, const Contact *before, Turn *turn) {
    double start = contact_middle(before), stop = contact_middle(contact), period = stop - start;
    double sigma = sigma_of(c, &c->law), ratio = period / c->previous_period;
    nothing_known(turn, c->gages);
    if (ratio < 1.0 / LARGEST_PERIOD_RATIO || ratio > LARGEST_PERIOD_RATIO)
        turn->flags |= PERIOD_JUMP;
    if (c->law.std > LARGEST_ANGLE_STD) turn->flags |= ACCELERATING;
    if (isnan(sigma)) turn->flags |= CUT_OFF;
    int missed = ratio > MISSED_RATIO && gap_in(c, (int64_t)before->fall, (int64_t)contact->rise);
    if (contact->damaged || before->damaged || missed)
        turn->flags |= FIRST_TURN | GAP; /* its period is unknown */
    if (contact->burst || (before->burst && before->damaged)) turn->flags |= SPIKE;
    turn->time = stop / c->rate;
    turn->ready = (double)(c->stop - 1) / c->rate;
    turn->period = period / c->rate;
    turn->omega = c->law.step * c->rate;
    turn->angle_std = c->law.std;
    turn->pulse = pulse_of(contact, &c->law);
    if (isnan(turn->pulse)) turn->flags |= ACCELERATING; /* so much that its angle is unknown */
    if (isnan(sigma) || isnan(turn->pulse))
        no_curves(turn, c->gages, 0);
    else if (!window_of(c, turn, sigma))
        return 0;
    take_strain(c, start, stop, turn);
    take_slip(c, before, turn);
    take_conditions(c, contact, start, stop, turn);
    look_at_trigger(c, start, stop, turn);
    return 1;
}

int cutter_take(Cutter *c, const Column *columns, int64_t at) {
    Contact found;
    ring_take(&c->ring, columns, at);
    if (!finder_take(&c->finder, &c->ring, &found)) return 1;
    if (c->queued == c->places) return 0;
    c->waiting[(c->next + c->queued++) % c->places] = found;
    return 1;
}

static Contact taken_from_queue(Cutter *c) {
    Contact contact = c->waiting[c->next];
    c->next = (c->next + 1) % c->places;
    c->queued--;
    contact.damaged = contact.damaged || damaged(c, &contact);
    c->stage = UNSEEN;
    return contact;
}

int cutter_next(Cutter *c, Turn *turn) {
    if (!c->queued) return 0;
    const Contact *waiting = &c->waiting[c->next];
    if (waiting->fresh || !c->has_previous) {
        c->previous = taken_from_queue(c);
        c->has_previous = 1;
        c->previous_period = NAN;
        nothing_read(c);
        c->past.n = 0;
        c->rolled.ratio = c->rolled.pull = NAN;
        first_turn(c, &c->previous, turn);
        return 1;
    }
    if (c->stage == UNSEEN) { /* the samples that a wheel of steady rate would need */
        static const Course UNKNOWN = {0};
        static const Past NONE = {0};
        double middle = contact_middle(waiting);
        double steady = middle - contact_middle(&c->previous);
        AngleLaw law = angle_law(middle, steady, 0.0, &UNKNOWN, &UNKNOWN, &NONE, 0.0);
        c->stop = stop_of(c, waiting, &law);
        c->stage = WAITS_FOR_LAW;
    }
    if (c->stop > c->ring.total) return 0;
    if (c->stage == WAITS_FOR_LAW && c->stop >= 0) {
        find_law(c, waiting, &c->previous);
        c->stage = WAITS_FOR_END;
        if (c->stop > c->ring.total) return 0;
    }
    Contact before = c->previous, contact = taken_from_queue(c);
    c->previous = contact;
    int done = c->stop >= 0 && full_turn(c, &contact, &before, turn);
    c->previous_period = contact_middle(&contact) - contact_middle(&before);
    if (done && !(turn->flags & FIRST_TURN)) c->past = c->law.past;
    return done ? 1 : -1;
}

int cutter_run(Cutter *c, const Column *columns, int64_t n, int64_t *taken, Turn *turn) {
    int found = cutter_next(c, turn);
    const Column *centre = c->ring.record ? columns + c->centre : NULL;
    while (!found && *taken < n) {
        int together = centre && centre->step == 1 && !c->queued && n - *taken >= QUIET;
        if (together && finder_skip(&c->finder, &c->ring, centre->first + *taken)) {
            *taken += QUIET;
            continue;
        }
        for (int i = 0; i < QUIET && !found && *taken < n; i++) {
            if (!cutter_take(c, columns, (*taken)++)) return -1;
            if (c->queued) found = cutter_next(c, turn);
        }
    }
    return found;
}
