/* One wheel, live: frames in, the estimate that holds now out. Reference: tirelib.stream.estimator
 * (age, watchdog, validity) and tirelib.fmu.wheel (steps, axes, buffer, faults). */
#ifndef TIRE_WHEEL_H
#define TIRE_WHEEL_H

#include "estimates.h"
#include "turns.h"

enum { ISO, SAE, ADAPTED_SAE };

/* Why a step was not done; nothing has changed then. After WHEEL_FAULT the last values are held as
 * invalid, and the wheel has started anew. */
enum { STEP_DONE, STEP_NOT_WHOLE = -1, STEP_LENGTH = -2, STEP_SAMPLES = -3, WHEEL_FAULT = -4 };

/* What an FMU shows, in the axes that were chosen, gages in their order; Wheel.outputs. */
typedef struct {
    double value[QUANTITIES], std[QUANTITIES];
    double contact_length[GAGES], contact_length_std[GAGES];
    double rolling_radius, turn_rate, contact_time, age;
    int64_t turn;
    int flags, notes, valid, valid_of[QUANTITIES], rolling;
} Outputs;

/* All that a wheel remembers beside its cutter. */
typedef struct {
    int64_t count, turns, standing;
    int told, complete; /* told: there is an estimate; complete: no gage was out, nor the speed */
    double deadline, idle, time, ready, omega;
    Estimates latest;
    double offset; /* time at which it was started anew, after a fault */
    int64_t earlier;
    int held; /* whether `shown` stands since a fault */
    Outputs shown;
} Live;

typedef struct {
    const Calibration *calibration;
    Cutter *cutter;
    double *scratch;
    Turn *turn;
    Features features;
    double rate;
    int gages, samples, axes, order[GAGES];
    int turned; /* whether a turn was completed by the samples that are being taken */
    Live live;
} Wheel;

/* Return how many bytes a wheel needs; 0 for a rate out of 100 Hz to 100 kHz. */
size_t wheel_size(const Calibration *calibration, double rate);

/* Start a wheel in `memory`, aligned as malloc's is; frames have `samples` samples. NULL where the
 * gages have no mirror image in the axes. */
Wheel *wheel_start(void *memory, const Calibration *calibration, double rate, int samples, int axes);

/* Take of n samples, in columns as of cutter_take, those after `*taken`, up to the next turn. Returns
 * 1 with a turn (`turn`, `features`, `live.latest`), 0 when all samples are taken, -1 where the
 * reference raises an error. Reference: NumpyEstimator.push; test: test_compiled. */
int wheel_take(Wheel *wheel, const Column *columns, int64_t n, int64_t *taken);

/* Take a frame, sample by sample, gages in the axes' order, and go on by a step [s]. `valid` 0: the
 * frame was lost. `count`: how many of its samples are new, whatever the step; -1: as many as the
 * step holds. Returns STEP_DONE or a reason. Reference: Wheel.step; test: test_native_wheel. */
int wheel_step(Wheel *wheel, const double *frame, double step, int valid, const double *conditions,
               int count);

/* Signs of Fz, alpha, kappa and Fy in the wheel's axes. */
const double *wheel_signs(const Wheel *wheel);

/* Reference: Wheel.outputs */
void wheel_outputs(const Wheel *wheel, Outputs *outputs);

#endif
