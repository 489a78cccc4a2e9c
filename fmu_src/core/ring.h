/* The samples that turns to come may need: a ring, one row a sample.
 *
 * A row holds the gages, then the held conditions, then the trigger, then what the contact finder
 * sees in the centre gage (tirelib.signal.turns.TurnCutter keeps the first three in its buffer).
 */
#ifndef TIRE_RING_H
#define TIRE_RING_H

#include "common.h"

typedef struct {
    double *rows;
    int64_t capacity; /* samples that are kept */
    int64_t total;    /* samples taken since the start */
    int64_t place;    /* row of the next one */
    int gages, width;
} Ring;

/* A column of samples: `step` doubles lie between one and the next; 0: it is held. */
typedef struct {
    const double *first;
    int64_t step;
} Column;

/* Return how many doubles a ring needs. */
size_t ring_size(int gages, int64_t capacity);
void ring_start(Ring *ring, double *memory, int gages, int64_t capacity);

/* Take sample `at` of columns: gages, held conditions, trigger (NaN: there is none). */
void ring_take(Ring *ring, const Column *columns, int64_t at);

/* Return the number of the oldest sample that is kept. */
int64_t ring_base(const Ring *ring);

/* Return the row of a sample that is kept, or of the next one. */
static inline double *ring_row(const Ring *ring, int64_t sample) {
    int64_t place = ring->place - (ring->total - sample);
    return ring->rows + (place < 0 ? place + ring->capacity : place) * ring->width;
}

/* Return the column of a held condition, of the trigger, of what the finder sees. */
int ring_held(const Ring *ring, int condition);
int ring_trigger(const Ring *ring);
int ring_search(const Ring *ring);

/* Copy a column from one sample to before another; return how many samples these are. */
size_t ring_column(const Ring *ring, int column, int64_t start, int64_t stop, double *out);

#endif
