/* Random numbers by place, not by order. Reference: tirelib.fmu.virtual.chance */
#ifndef TIRE_CHANCE_H
#define TIRE_CHANCE_H

#include <stdint.h>

/* A standard normal number: that of a gage at a sample, counted since the start. */
double noise_of(uint64_t seed, uint64_t sample, int gage, int gages);

/* A number uniformly distributed over (0, 1) that decides whether a frame is lost. */
double chance_of(uint64_t seed, uint64_t sample);

#endif
