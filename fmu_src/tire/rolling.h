/* A virtual tire on a wheel: conditions in, frames of strain out, sample by sample. Reference:
 * tirelib.fmu.virtual.wheel, options, relaxation, faults. Test: test_native_virtual */
#ifndef TIRE_ROLLING_H
#define TIRE_ROLLING_H

#include <stdint.h>

#include "surface.h"

enum { MOST_FRAME = 256, TIRE_STATUS = 256 };
enum { TIRE_DONE, TIRE_STEP_LENGTH, TIRE_STEP_SAMPLES };
enum { STILL_NOT, STILL_STANDS, STILL_LOCKED };

typedef struct {
    double rate, relaxation[2], noise, start_angle;
    double fault_start, saturation, drift, dropped;
    int dead_gage, seed;
} TireOptions;

/* What is remembered; no pointers, so that a copy is a state. */
typedef struct {
    TireOptions options;
    int samples;
    double angle, omega, radius, due;
    int64_t count; /* samples so far */
    int settled_once, fresh, valid;
    double slip[2], goal[2], rest[2], rates[2];
    int asked_once, rolls_once, last_once, held_once;
    double asked[MOST_INPUTS], answer[MOST_ANSWERS], rolls[3];
    double last[MOST_ANSWERS], held[TIRE_GAGES], force[OUT_FORCES];
    char status[TIRE_STATUS];
    double frame[MOST_FRAME * TIRE_GAGES];
} RollingTire;

/* Which inputs, a bit each, are out of range. Reference: VirtualWheel.outside */
int rolling_outside(const TireSurface *s, const double *inputs);

/* Start a tire: its first conditions act at once, and the sample at time zero is given. */
void rolling_start(RollingTire *w, const TireSurface *s, const TireOptions *options, int samples,
                   const double *inputs);

/* Go on by a step [s] with constant conditions. Nothing changes where it is refused; `most` is how
 * many samples it would have brought. */
int rolling_step(RollingTire *w, const TireSurface *s, double step, const double *inputs,
                 double *most);

#endif
