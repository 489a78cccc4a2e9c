/* The core as a library for programs that are not C: records in arrays, turns and estimates out.
 *
 * These are the only functions of the core that a compiled FMU shows to others; their names begin
 * with tirelib_, so that they meet no other library's. Sizes come first, so that the caller gives
 * all memory: aligned as malloc's is, and kept by it. Caller: tirelib.core.compiled.
 */
#ifndef TIRE_LIBRARY_H
#define TIRE_LIBRARY_H

#include "wheel.h"

#ifdef _WIN32
#define CORE_EXPORT __declspec(dllexport)
#else
#define CORE_EXPORT __attribute__((visibility("default")))
#endif

/* Sizes of Turn, TurnHead, Features, Estimates, Outputs and Column, by which a caller sees that its
 * structures are those of this build. */
CORE_EXPORT void tirelib_sizes(int64_t size[6]);

CORE_EXPORT size_t tirelib_calibration_size(void);
CORE_EXPORT size_t tirelib_calibration_read(Calibration *calibration, const double *table, size_t n);
CORE_EXPORT size_t tirelib_estimate_scratch(const Calibration *calibration);

CORE_EXPORT size_t tirelib_cutter_size(int gages, double rate);
CORE_EXPORT Cutter *tirelib_cutter_start(void *memory, int gages, const double *lateral,
                                         double rate, const LowPass *low_pass);

/* Cut the samples of a record, from `*taken` to before n, until `most` turns are complete. A column
 * for each gage, each held condition and the trigger, which begin with the cutter's first sample and
 * stay as they are until the last call. Returns how many turns there are, fewer than
 * `most` when all samples are taken, or -1 where the reference raises an error.
 * Reference: TurnCutter.push; test: test_compiled. */
CORE_EXPORT int64_t tirelib_cut(Cutter *cutter, const Column *columns, int64_t n, int64_t *taken,
                                Turn *turns, int64_t most);

/* The same, but give the turns' heads and features; `turn` is a place to work. */
CORE_EXPORT int64_t tirelib_cut_features(Cutter *cutter, const Column *columns, int64_t n,
                                         int64_t *taken, Turn *turn, TurnHead *heads,
                                         Features *features, int64_t most);

/* Read the features of n turns. Reference: reference_features. */
CORE_EXPORT void tirelib_features(const Turn *turns, int64_t n, int gages, Features *features);

/* Estimate n turns. Reference: Calibration.reference_estimate. */
CORE_EXPORT void tirelib_estimates(const Calibration *calibration, const Turn *turns,
                                   const Features *features, int64_t n, double *scratch,
                                   Estimates *estimates);

CORE_EXPORT size_t tirelib_wheel_size(const Calibration *calibration, double rate);
CORE_EXPORT Wheel *tirelib_wheel_start(void *memory, const Calibration *calibration, double rate);

/* See wheel_take. Where it returns 1, turn, features and estimates are copied. */
CORE_EXPORT int tirelib_wheel_take(Wheel *wheel, const Column *columns, int64_t n, int64_t *taken,
                                   Turn *turn, Features *features, Estimates *estimates);
CORE_EXPORT void tirelib_wheel_wait(Wheel *wheel, double time);

/* Time of the samples so far, and with what was waited for since the last, [s]. */
CORE_EXPORT double tirelib_wheel_time(const Wheel *wheel);
CORE_EXPORT double tirelib_wheel_elapsed(const Wheel *wheel);
CORE_EXPORT void tirelib_wheel_outputs(const Wheel *wheel, Outputs *outputs);

CORE_EXPORT size_t tirelib_state_size(const Wheel *wheel);
CORE_EXPORT void tirelib_state_save(const Wheel *wheel, unsigned char *bytes);
CORE_EXPORT int tirelib_state_restore(Wheel *wheel, const unsigned char *bytes, size_t n);

#endif
