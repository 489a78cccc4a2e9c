/* Possible change of the slip ratio within a turn. Reference: tirelib.measured.signal.slip. */
#ifndef TIRE_SLIP_H
#define TIRE_SLIP_H

#include "common.h"

/* Turn rate over speed in a contact, and the pull there; NaN where unknown. */
typedef struct {
    double ratio, pull;
} Rolled;

/* By how much the slip ratio at the contact may differ from the turn's: for a change of load, from
 * half the angles of two contacts, and for a change of traction.
 * Reference: unseen_by_load, unseen_by_traction; test: test_native_turns. */
double unseen_by_load(double here, double before);
double unseen_by_traction(const Rolled *here, const Rolled *before, double half);

/* The mark of traction in the strain of one gage over the wheel angles. Reference: pull. */
double pull_of(const double *strain);

#endif
