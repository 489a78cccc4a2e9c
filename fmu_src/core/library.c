#include "library.h"

#include <string.h>

#include "state.h"

void tirelib_sizes(int64_t size[6]) {
    size[0] = sizeof(Turn);
    size[1] = sizeof(TurnHead);
    size[2] = sizeof(Features);
    size[3] = sizeof(Estimates);
    size[4] = sizeof(Outputs);
    size[5] = sizeof(Column);
}

size_t tirelib_calibration_size(void) { return calibration_size(); }

size_t tirelib_calibration_read(Calibration *calibration, const double *table, size_t n) {
    return calibration_read(calibration, table, n);
}

size_t tirelib_estimate_scratch(const Calibration *calibration) {
    return estimate_scratch(calibration);
}

size_t tirelib_cutter_size(int gages, double rate) { return cutter_size(gages, rate); }

Cutter *tirelib_cutter_start(void *memory, int gages, const double *lateral, double rate,
                             const LowPass *low_pass) {
    return cutter_start(memory, gages, lateral, rate, low_pass);
}

int64_t tirelib_cut(Cutter *cutter, const Column *columns, int64_t n, int64_t *taken, Turn *turns,
                    int64_t most) {
    int64_t count = 0;
    cutter->ring.record = columns;
    while (count < most) {
        int found = cutter_run(cutter, columns, n, taken, turns + count);
        if (found < 0) return -1;
        if (!found) break;
        count++;
    }
    return count;
}

int64_t tirelib_cut_features(Cutter *cutter, const Column *columns, int64_t n, int64_t *taken,
                             Turn *turn, TurnHead *heads, Features *features, int64_t most) {
    int64_t count = 0;
    cutter->ring.record = columns;
    while (count < most) {
        int found = cutter_run(cutter, columns, n, taken, turn);
        if (found < 0) return -1;
        if (!found) break;
        memcpy(heads + count, turn, sizeof *heads);
        extract_features(turn, cutter->gages, features + count++);
    }
    return count;
}

void tirelib_features(const Turn *turns, int64_t n, int gages, Features *features) {
    for (int64_t i = 0; i < n; i++) extract_features(turns + i, gages, features + i);
}

void tirelib_estimates(const Calibration *calibration, const Turn *turns, const Features *features,
                       int64_t n, double *scratch, Estimates *estimates) {
    for (int64_t i = 0; i < n; i++)
        estimate(calibration, turns + i, features + i, scratch, estimates + i);
}

size_t tirelib_wheel_size(const Calibration *calibration, double rate) {
    return wheel_size(calibration, rate);
}

Wheel *tirelib_wheel_start(void *memory, const Calibration *calibration, double rate) {
    return wheel_start(memory, calibration, rate, 1, ISO);
}

int tirelib_wheel_take(Wheel *wheel, const Column *columns, int64_t n, int64_t *taken, Turn *turn,
                       Features *features, Estimates *estimates) {
    int found = wheel_take(wheel, columns, n, taken);
    if (found > 0) {
        *turn = *wheel->turn;
        *features = wheel->features;
        *estimates = wheel->live.latest;
    }
    return found;
}

void tirelib_wheel_wait(Wheel *wheel, double time) { wheel->live.idle += time; }

double tirelib_wheel_time(const Wheel *wheel) { return (double)wheel->live.count / wheel->rate; }

double tirelib_wheel_elapsed(const Wheel *wheel) {
    return tirelib_wheel_time(wheel) + wheel->live.idle;
}

void tirelib_wheel_outputs(const Wheel *wheel, Outputs *outputs) { wheel_outputs(wheel, outputs); }

size_t tirelib_state_size(const Wheel *wheel) { return state_size(wheel); }

void tirelib_state_save(const Wheel *wheel, unsigned char *bytes) { state_save(wheel, bytes); }

int tirelib_state_restore(Wheel *wheel, const unsigned char *bytes, size_t n) {
    return state_restore(wheel, bytes, n);
}

#ifndef SOURCE
#define SOURCE "unknown"
#endif
/* The hash of all sources, so that a test can tell whether a binary was made from them. */
CORE_EXPORT const char tirelib_core_source[] = "source sha256 " SOURCE;
