/* A stream of samples cut into turns, each ending with its contact. Reference:
 * tirelib.measured.signal.turns.TurnCutter, tirelib.measured.signal.turn.Turn. */
#ifndef TIRE_TURNS_H
#define TIRE_TURNS_H

#include "angle.h"
#include "contacts.h"
#include "lowpass.h"
#include "slip.h"

/* Turn of the reference, same names and units; arrays over gages, and over wheel angles. What comes
 * before the curves stands in TurnHead in the same order. */
typedef struct {
    double time, ready, period, omega, angle_std, slip_std, pulse, axis_shift;
    double speed, pressure, camber, friction, tread_depth, tread_temperature;
    double offset[GAGES], offset_std[GAGES], mean[GAGES];
    double strain[GAGES * ANGLES], rate[GAGES * ANGLES];
    int gage_flags[GAGES];
    int flags;
} Turn;

/* A turn without its curves and flags, which its features have. */
typedef struct {
    double number[14], offset[GAGES], offset_std[GAGES], mean[GAGES];
} TurnHead;

/* What each gage read opposite the contact, and when [samples]; NaN: nothing was read. */
typedef struct {
    double time[GAGES], value[GAGES];
} Opposite;

static const double LARGEST_OMEGA_RATIO = 1.5; /* of tirelib.measured.signal.turns */

/* Where the work on the first waiting contact stands. */
enum { UNSEEN, WAITS_FOR_LAW, WAITS_FOR_END };

typedef struct {
    int gages, centre;
    double rate;
    LowPass low_pass;
    Ring ring;
    ContactFinder finder;
    Contact *waiting; /* a queue of `places`, `queued` of them from `next` on */
    int64_t places, next, queued;
    int has_previous;
    Contact previous;
    double previous_period;
    Opposite first, last; /* of the last two turns in which a gage was read there */
    Past past;
    Rolled rolled; /* in the contact before */
    int stage;
    int64_t stop; /* the sample before which the law, or the turn, has all it needs */
    AngleLaw law;
    double *window, *rows, *angle, *scratch; /* of one turn's samples */
    unsigned char *missing;
    int64_t room; /* samples that the window holds for each gage */
} Cutter;

/* Return how many bytes a cutter needs; 0 for what it cannot be: no gages, more than GAGES, or a
 * rate out of 1 to 1e6 Hz. */
size_t cutter_size(int gages, double rate);

/* Start a cutter in `memory`, which is aligned as malloc's is and stays the caller's; lateral
 * positions as in the reference. Starting it again resets it. */
Cutter *cutter_start(void *memory, int gages, const double *lateral, double rate,
                     const LowPass *low_pass);

/* Take sample `at` of columns: gages, held conditions, trigger (NaN: there is none). Then ask
 * cutter_next until it returns 0. Returns 0 if more contacts wait than a queue can hold, which no
 * wheel brings about. Reference: TurnCutter.push; test: test_native_turns. */
int cutter_take(Cutter *cutter, const Column *columns, int64_t at);

/* Give the next turn that is complete: 1, none: 0, or -1 where the reference raises an error: the
 * filter would reach beyond the samples. Reference: TurnCutter._next_turn. */
int cutter_next(Cutter *cutter, Turn *turn);

/* Take of n samples those after `*taken`, up to the next turn. Returns 1 with a turn, 0 when all
 * samples are taken, -1 after an error as above. */
int cutter_run(Cutter *cutter, const Column *columns, int64_t n, int64_t *taken, Turn *turn);

#endif
