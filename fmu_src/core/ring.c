#include "ring.h"

#include <string.h>

size_t ring_size(int gages, int64_t capacity) {
    return (size_t)(gages + HELD + 2) * (size_t)capacity;
}

void ring_start(Ring *ring, double *memory, int gages, int64_t capacity) {
    ring->rows = memory;
    ring->capacity = capacity;
    ring->total = 0;
    ring->gages = gages;
    ring->width = gages + HELD + 2;
}

double *ring_row(const Ring *ring, int64_t sample) {
    return ring->rows + (size_t)(sample % ring->capacity) * (size_t)ring->width;
}

void ring_take(Ring *ring, const double *sample) {
    double *row = ring_row(ring, ring->total++);
    memcpy(row, sample, (size_t)(ring->width - 1) * sizeof *row);
    row[ring->width - 1] = NAN;
}

int64_t ring_base(const Ring *ring) {
    return ring->total > ring->capacity ? ring->total - ring->capacity : 0;
}

int ring_held(const Ring *ring, int condition) { return ring->gages + condition; }
int ring_trigger(const Ring *ring) { return ring->gages + HELD; }
int ring_search(const Ring *ring) { return ring->gages + HELD + 1; }

size_t ring_column(const Ring *ring, int column, int64_t start, int64_t stop, double *out) {
    size_t n = 0;
    int64_t place = start % ring->capacity;
    const double *value = ring->rows + (size_t)place * (size_t)ring->width + column;
    for (int64_t i = start; i < stop; i++) {
        out[n++] = *value;
        value += ring->width;
        if (++place == ring->capacity) {
            place = 0;
            value = ring->rows + column;
        }
    }
    return n;
}
