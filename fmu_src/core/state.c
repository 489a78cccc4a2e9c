#include "state.h"

#include <string.h>

/* What stands before the rest: whose state it is, and how much there is. */
typedef struct {
    char format[16];
    double rate;
    int64_t gages, samples, axes, queued, first, rows, live, cutter, calibration;
} Head;

static const char FORMAT[16] = "tire-state/3";

uint64_t state_hash(const void *bytes, size_t n) { /* G. Fowler, L. C. Noll, K.-P. Vo, 1991 */
    const unsigned char *at = bytes;
    uint64_t h = 14695981039346656037u;
    for (size_t i = 0; i < n; i++) h = (h ^ at[i]) * 1099511628211u;
    return h;
}

/* The first sample that turns to come may need. Reference: TurnCutter._oldest */
static int64_t oldest(const Cutter *c) {
    const ContactFinder *f = &c->finder;
    int64_t first = f->pulse ? f->pulse_start : f->count - 1, base = ring_base(&c->ring);
    if (f->middles && (int64_t)f->last_rise - 1 < first) first = (int64_t)f->last_rise - 1;
    if (c->has_previous && c->queued && (int64_t)c->previous.rise - 1 < first)
        first = (int64_t)c->previous.rise - 1;
    first -= NEAR_EDGE; /* they tell whether the contact is damaged */
    return first > base ? first : base;
}

static Head head_of(const Wheel *w) {
    const Cutter *c = w->cutter;
    Head h;
    memset(&h, 0, sizeof h);
    memcpy(h.format, FORMAT, sizeof h.format);
    h.rate = w->rate;
    h.gages = w->gages;
    h.samples = w->samples;
    h.axes = w->axes;
    h.queued = c->queued;
    h.first = oldest(c);
    h.rows = c->ring.total - h.first;
    h.live = sizeof w->live;
    h.cutter = sizeof *c;
    h.calibration =
        (int64_t)state_hash(w->calibration->lateral, sizeof w->calibration->lateral);
    return h;
}

static size_t size_of(const Head *h, int width) {
    size_t numbers = (size_t)h->rows * (size_t)(width + 1) * sizeof(double);
    return sizeof *h + sizeof(Live) + sizeof(Cutter) + (size_t)h->queued * sizeof(Contact) +
           numbers + sizeof(uint64_t);
}

size_t state_size(const Wheel *w) {
    Head h = head_of(w);
    return size_of(&h, w->cutter->ring.width);
}

static void put(unsigned char **to, const void *from, size_t n) {
    memcpy(*to, from, n);
    *to += n;
}

static void get(void *to, const unsigned char **from, size_t n) {
    memcpy(to, *from, n);
    *from += n;
}

static double *row_of(const Ring *ring, int64_t sample) {
    return ring->rows + ring_place(ring, sample) * ring->width;
}

/* Keep the places in a cutter's own memory. */
static void keep_places(Cutter *to, const Cutter *own) {
    to->ring.rows = own->ring.rows;
    to->ring.seen = own->ring.seen;
    to->waiting = own->waiting;
    to->window = own->window;
    to->rows = own->rows;
    to->angle = own->angle;
    to->scratch = own->scratch;
    to->missing = own->missing;
}

void state_save(const Wheel *w, unsigned char *bytes) {
    const Cutter *c = w->cutter;
    unsigned char *at = bytes;
    Head h = head_of(w);
    Cutter plain, nowhere;
    memset(&nowhere, 0, sizeof nowhere);
    memcpy(&plain, c, sizeof plain);
    keep_places(&plain, &nowhere);
    plain.next = 0;
    put(&at, &h, sizeof h);
    put(&at, &w->live, sizeof w->live);
    put(&at, &plain, sizeof plain);
    for (int64_t i = 0; i < c->queued; i++)
        put(&at, &c->waiting[(c->next + i) % c->places], sizeof(Contact));
    for (int64_t i = h.first; i < c->ring.total; i++) {
        put(&at, row_of(&c->ring, i), (size_t)c->ring.width * sizeof(double));
        put(&at, ring_seen(&c->ring, i), sizeof(double));
    }
    uint64_t sum = state_hash(bytes, (size_t)(at - bytes));
    put(&at, &sum, sizeof sum);
}

int state_restore(Wheel *w, const unsigned char *bytes, size_t n) {
    Head h, own = head_of(w);
    Cutter *c = w->cutter, kept = *w->cutter;
    const unsigned char *at = bytes;
    uint64_t sum;
    if (n < sizeof h + sizeof sum) return 0;
    get(&h, &at, sizeof h);
    int alike = !memcmp(h.format, own.format, sizeof h.format) && h.rate == own.rate &&
                h.gages == own.gages && h.samples == own.samples && h.axes == own.axes &&
                h.live == own.live && h.cutter == own.cutter && h.calibration == own.calibration &&
                h.rows >= 0 && h.rows <= c->ring.capacity && h.queued >= 0 &&
                h.queued <= c->places;
    if (!alike || n != size_of(&h, c->ring.width)) return 0;
    memcpy(&sum, bytes + n - sizeof sum, sizeof sum);
    if (sum != state_hash(bytes, n - sizeof sum)) return 0;
    get(&w->live, &at, sizeof w->live);
    get(c, &at, sizeof *c);
    keep_places(c, &kept);
    get(c->waiting, &at, (size_t)h.queued * sizeof(Contact));
    for (int64_t i = 0; i < h.rows; i++) {
        get(row_of(&c->ring, h.first + i), &at, (size_t)c->ring.width * sizeof(double));
        get(ring_seen(&c->ring, h.first + i), &at, sizeof(double));
    }
    return 1;
}
