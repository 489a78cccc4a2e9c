#include "ring.h"

#include <string.h>

size_t ring_size(int gages, int64_t capacity) {
    return (size_t)(gages + HELD + 2) * (size_t)capacity;
}

void ring_start(Ring *ring, double *memory, int gages, int64_t capacity) {
    ring->width = gages + HELD + 1;
    ring->rows = memory;
    ring->seen = memory + ring->width * capacity;
    ring->record = NULL;
    ring->capacity = capacity;
    ring->total = ring->place = 0;
    ring->gages = gages;
}

void ring_take(Ring *ring, const Column *columns, int64_t at) {
    double *row = ring->rows + ring->place * ring->width;
    for (int i = 0; i < ring->width && !ring->record; i++)
        row[i] = columns[i].first[at * columns[i].step];
    ring->seen[ring->place] = NAN;
    ring->total++;
    if (++ring->place == ring->capacity) ring->place = 0;
}

void ring_skip(Ring *ring, int samples) {
    for (int i = 0; i < samples; i++) ring->seen[ring->place + i] = NAN;
    ring->total += samples;
    ring->place += samples;
    if (ring->place == ring->capacity) ring->place = 0;
}

int64_t ring_base(const Ring *ring) {
    return ring->total > ring->capacity ? ring->total - ring->capacity : 0;
}

int ring_held(const Ring *ring, int condition) { return ring->gages + condition; }
int ring_trigger(const Ring *ring) { return ring->gages + HELD; }

/* Copy n samples that lie `step` doubles apart. */
static void copy(double *to, const double *from, int64_t step, size_t n) {
    if (step == 1)
        memcpy(to, from, n * sizeof *to);
    else
        for (size_t i = 0; i < n; i++) to[i] = from[(int64_t)i * step];
}

const double *ring_look(const Ring *ring, int column, int64_t start, int64_t stop, double *room) {
    const Column *given = ring->record ? ring->record + column : NULL;
    if (given && given->step == 1) return given->first + start;
    ring_column(ring, column, start, stop, room);
    return room;
}

size_t ring_column(const Ring *ring, int column, int64_t start, int64_t stop, double *out) {
    if (start >= stop) return 0;
    size_t n = (size_t)(stop - start);
    if (ring->record) {
        const Column *given = ring->record + column;
        copy(out, given->first + start * given->step, given->step, n);
        return n;
    }
    int64_t place = ring_place(ring, start);
    size_t left = (size_t)(ring->capacity - place), first = n < left ? n : left;
    copy(out, ring->rows + place * ring->width + column, ring->width, first);
    copy(out + first, ring->rows + column, ring->width, n - first);
    return n;
}
