/* What all rooms of the native core share: sizes, conditions, flags.
 *
 * Each room is named like the Python module that it follows, and each function says which Python
 * function is its reference. SI and radians; axes ISO 8855; NaN where a value is unknown. The core
 * calls no allocator and has no globals but constants: the caller gives the memory, once, so any
 * number of wheels live side by side. Compile it with -ffp-contract=off: a product fused with a
 * sum rounds differently, and that may flip a flag.
 */
#ifndef TIRE_COMMON_H
#define TIRE_COMMON_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#ifndef NAN
#error "the core needs IEEE 754 numbers with NaN"
#endif

enum { GAGES = 16 }; /* most gages of a wheel */
enum { ANGLES = 361 }; /* wheel angles of a turn: tirelib.measured.signal.turn.PHI */

static const double PI = 3.14159265358979323846;

/* Conditions that hold while samples are taken, in the order of tirelib.core.held.HELD. */
enum { SPEED, PRESSURE, CAMBER, OMEGA, FRICTION, TREAD_DEPTH, TREAD_TEMPERATURE, HELD };

/* tirelib.core.flags.TurnFlag, same numbers. */
enum {
    FIRST_TURN = 1,
    GAP = 2,
    BRIDGED = 4,
    SPIKE = 8,
    SATURATED = 16,
    DEAD_GAGE = 32,
    PERIOD_JUMP = 64,
    TRIGGER_MISMATCH = 128,
    DRIFT = 256,
    NO_SPEED = 512,
    REVERSED = 1024,
    OUT_OF_RANGE = 2048,
    CUT_OFF = 4096,
    REDUCED_GAGES = 8192,
    TOO_FEW_GAGES = 16384,
    NO_CONDITION = 32768,
    WEAK_EDGE = 65536,
    NO_CONTACT = 131072,
    FAULT = 262144,
    ACCELERATING = 524288,
    OTHER_TIRE = 1048576,
    OMEGA_MISMATCH = 2097152
};

/* One wheel angle of a turn, [rad], as numpy.linspace rounds it: tirelib.measured.signal.turn.PHI. */
static inline double phi_at(int index) {
    return index < ANGLES - 1 ? index * ((0.8 - -1.0) / (ANGLES - 1)) + -1.0 : 0.8;
}

/* A place of the grid just before a wheel angle, from which to look for it; 0 for NaN. */
static inline int phi_before(double angle) {
    double near = (angle - phi_at(0)) / (phi_at(1) - phi_at(0)) - 1.0;
    return near > 0.0 ? near < ANGLES ? (int)near : ANGLES - 1 : 0;
}

#endif
