/* The exact state of a wheel as bytes, for the same build of the core. Reference:
 * tirelib.stream.snapshot, Wheel.state and Wheel.restore. */
#ifndef TIRE_STATE_H
#define TIRE_STATE_H

#include "wheel.h"

/* Hash of bytes, so that damage is seen (FNV-1a). */
uint64_t state_hash(const void *bytes, size_t n);

/* How many bytes the state has now. */
size_t state_size(const Wheel *wheel);

/* Write the state: state_size bytes. */
void state_save(const Wheel *wheel, unsigned char *bytes);

/* Take up a state of a wheel with the same settings, also in another process. Returns 0, and
 * changes nothing, for bytes that are damaged or of another wheel. Test: test_native_wheel. */
int state_restore(Wheel *wheel, const unsigned char *bytes, size_t n);

#endif
