/* Wheel angle over time within a turn. Reference: tirelib.measured.signal.angle. */
#ifndef TIRE_ANGLE_H
#define TIRE_ANGLE_H

#include "course.h"

enum { REMEMBERED = 4 };
enum { PAST_TIME, PAST_OMEGA, PAST_SPEED, PAST_NONE, PAST_COLUMNS };
enum { ANGLE_TERMS = COURSE_TERMS + 2 };

/* For each of the last turns: its middle in time [samples], and q for each source and without. */
typedef struct {
    int64_t n; /* as wide as a double: states hold this, and no byte of theirs is left to chance */
    double row[REMEMBERED][PAST_COLUMNS];
} Past;

/* AngleLaw of the reference. */
typedef struct {
    double middle, turn;
    int64_t terms;
    double angle[ANGLE_TERMS];
    double step, std, speed, slip_std, late;
    Past past;
} AngleLaw;

/* Return the law of one turn; the courses are of the measured turn rate and of the speed.
 * Reference: angle_law; test: test_native_turns. */
AngleLaw angle_law(double middle, double turn, double ahead, const Course *omega,
                   const Course *speed, const Past *past, double unknown);

/* Wheel angle [rad] at a sample number, at n samples from one on, and back. Reference: AngleLaw.at, AngleLaw.sample. */
double law_at(const AngleLaw *law, double sample);
void law_angles(const AngleLaw *law, double first, size_t n, double *angle);
double law_sample(const AngleLaw *law, double phi);

/* Reference: minmod. */
double minmod(double a, double b);

#endif
