/* The passages of the centre gage through the contact, found sample by sample.
 *
 * Reference: tirelib.measured.signal.contacts. That code takes whole frames at once; taken one
 * sample at a time it says the same.
 */
#ifndef TIRE_CONTACTS_H
#define TIRE_CONTACTS_H

#include "ring.h"

/* Where the strain crosses the level, [samples since the start]; Contact of the reference. */
typedef struct {
    double rise, fall;
    int fresh;     /* no valid turn precedes it */
    int damaged;   /* samples are missing where it begins or ends */
    int64_t burst; /* samples were left out since the contact before; so wide, as states have no gaps */
} Contact;

/* Samples before an edge that must not be missing. */
enum { NEAR_EDGE = 3 };

typedef struct {
    int64_t longest_turn, count; /* count: samples taken, after the median of three */
    int centre;                  /* column of the centre gage */
    double tail[2], held;        /* last samples without gaps */
    int seen;                    /* how many of the tail there are */
    int whole;                   /* how many samples were there before a missing one; 3: or more */
    int levels, armed, pulse;    /* levels: not start-up; pulse: within one */
    double level, low_level, swing, lowest, highest;
    int64_t pulse_start, since, patience;
    int64_t turns, turns_at; /* patience of the last turns known, and when the last of them ended */
    int middles, periods; /* whether the last middle, the last period are known */
    double last_middle, last_period, last_rise;
    int bursts; /* whether samples were left out since the last rise, from the first to the last */
    int64_t first_burst, last_burst, apart; /* apart: how many since the last good one */
} ContactFinder;

void finder_start(ContactFinder *finder, int64_t longest_turn, int centre);

/* Look at the newest sample of the ring; return 1 if a contact ended. Reference:
 * ContactFinder.push; test: test_native_turns. */
int finder_take(ContactFinder *finder, const Ring *ring, Contact *found);

/* Samples of a record that are looked at together where nothing happens. */
enum { QUIET = 32 };

/* Take the next QUIET samples of a record, of which `x` are the centre gage's. Where no contact
 * begins and none is missing or stands apart, do what ring_take and finder_take do with each of them
 * and return 1; else do nothing and return 0. */
int finder_skip(ContactFinder *finder, Ring *ring, const double *x);

double contact_middle(const Contact *contact);

#endif
