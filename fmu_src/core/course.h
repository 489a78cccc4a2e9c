/* How a held condition runs over one turn. Reference: tirelib.measured.signal.course. */
#ifndef TIRE_COURSE_H
#define TIRE_COURSE_H

#include "common.h"

enum { COURSE_TERMS = 4 }; /* of a cubic */

/* Course of the reference. */
typedef struct {
    int there; /* 0: the reference says None */
    int known; /* the source told enough values to have a course; else it is its mean */
    int terms;
    double shape[COURSE_TERMS]; /* by the powers of turns from the contact's middle */
    double mean, std;
} Course;

/* Return how a source runs from one contact to beyond the next.
 * Reference: course; test: test_native_turns. */
Course course(const double *samples, size_t n, double first, double turn);

#endif
