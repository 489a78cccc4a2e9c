#include "ring.h"

size_t ring_size(int gages, int64_t capacity) {
    return (size_t)(gages + HELD + 2) * (size_t)capacity;
}

void ring_start(Ring *ring, double *memory, int gages, int64_t capacity) {
    ring->rows = memory;
    ring->capacity = capacity;
    ring->total = ring->place = 0;
    ring->gages = gages;
    ring->width = gages + HELD + 2;
}

void ring_take(Ring *ring, const Column *columns, int64_t at) {
    double *row = ring->rows + ring->place * ring->width;
    for (int i = 0; i < ring->width - 1; i++) row[i] = columns[i].first[at * columns[i].step];
    row[ring->width - 1] = NAN;
    ring->total++;
    if (++ring->place == ring->capacity) ring->place = 0;
}

int64_t ring_base(const Ring *ring) {
    return ring->total > ring->capacity ? ring->total - ring->capacity : 0;
}

int ring_held(const Ring *ring, int condition) { return ring->gages + condition; }
int ring_trigger(const Ring *ring) { return ring->gages + HELD; }
int ring_search(const Ring *ring) { return ring->gages + HELD + 1; }

size_t ring_column(const Ring *ring, int column, int64_t start, int64_t stop, double *out) {
    size_t n = 0;
    const double *end = ring->rows + ring->capacity * ring->width;
    const double *row = start < stop ? ring_row(ring, start) : end;
    for (int64_t i = start; i < stop; i++) {
        out[n++] = row[column];
        row += ring->width;
        if (row == end) row = ring->rows;
    }
    return n;
}
