/* The samples that turns to come may need: a ring, one row a sample.
 *
 * A row holds the gages, then the held conditions, then the trigger
 * (tirelib.measured.signal.turns.TurnCutter keeps them in its buffer). Beside it stands what the contact finder sees in the centre gage. Of a
 * whole record no sample is copied: it is read where the caller has it.
 */
#ifndef TIRE_RING_H
#define TIRE_RING_H

#include "common.h"

/* A column of samples: `step` doubles lie between one and the next; 0: it is held. */
typedef struct {
    const double *first;
    int64_t step;
} Column;

typedef struct {
    double *rows, *seen;
    const Column *record; /* NULL: the samples are in `rows` */
    int64_t capacity; /* samples that are kept */
    int64_t total;    /* samples taken since the start */
    int64_t place;    /* row of the next one */
    int gages, width;
} Ring;

/* Return how many doubles a ring needs. */
size_t ring_size(int gages, int64_t capacity);
void ring_start(Ring *ring, double *memory, int gages, int64_t capacity);

/* Take sample `at` of columns: gages, held conditions, trigger (NaN: there is none). Of a record it
 * is the sample that follows those before. */
void ring_take(Ring *ring, const Column *columns, int64_t at);

/* Take samples of a record that lie before the ring's end. */
void ring_skip(Ring *ring, int samples);

/* Return the number of the oldest sample that is kept. */
int64_t ring_base(const Ring *ring);

/* Return the place of a sample that is kept, or of the next one. */
static inline int64_t ring_place(const Ring *ring, int64_t sample) {
    int64_t place = ring->place - (ring->total - sample);
    return place < 0 ? place + ring->capacity : place;
}

/* Return a column of a sample that is kept. */
static inline double ring_at(const Ring *ring, int column, int64_t sample) {
    const Column *record = ring->record;
    if (record) return record[column].first[sample * record[column].step];
    return ring->rows[ring_place(ring, sample) * ring->width + column];
}

/* Return where that stands which the finder sees of a sample. */
static inline double *ring_seen(const Ring *ring, int64_t sample) {
    return ring->seen + ring_place(ring, sample);
}

/* Return the column of a held condition, of the trigger. */
int ring_held(const Ring *ring, int condition);
int ring_trigger(const Ring *ring);

/* Return a column from one sample to before another: where it lies, if its samples follow one
 * another, else copied to `room`. */
const double *ring_look(const Ring *ring, int column, int64_t start, int64_t stop, double *room);

/* Copy a column from one sample to before another; return how many samples these are. */
size_t ring_column(const Ring *ring, int column, int64_t start, int64_t stop, double *out);

#endif
