/* Step an FMU through frames of a file; print two lines of nine numbers, by the clock and by the
 * CPU time of the thread, in which pauses by the operating system do not count: mean, least,
 * median, one in 100, in 1,000, in 10,000 and in 100,000, the worst place of the file at its best
 * repetition (work that is there every time), and the worst of all. Then four instances are stepped
 * in real time for ten seconds; the third line is the share of a core that this takes.
 * Arguments: library, GUID, resources, frames, doubles of a frame, step [s], repetitions. */
#define _POSIX_C_SOURCE 199309L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef struct {
    void *log, *take, *give, *done, *environment;
} Callbacks;

static double now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int later(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void tell(double *took, size_t frames, size_t times) {
    size_t steps = frames * times;
    double all = 0.0, again = 0.0;
    for (size_t i = 0; i < frames; i++) {
        double shortest = took[i];
        for (size_t k = 0; k < times; k++) {
            double one = took[k * frames + i];
            all += one;
            if (one < shortest) shortest = one;
        }
        if (shortest > again) again = shortest;
    }
    qsort(took, steps, sizeof *took, later);
    printf("%g %g %g", all / (double)steps, took[0], took[steps / 2]);
    for (size_t rare = 100; rare <= 100000; rare *= 10)
        printf(" %g", took[steps - steps / rare - 1]);
    printf(" %g %g\n", again, took[steps - 1]);
}

enum { WHEELS = 4, SECONDS = 10 };

int main(int n, char **given) {
    Callbacks none = {0};
    void *library = n == 8 ? dlopen(given[1], RTLD_NOW) : NULL;
    if (!library) return 1;
    void *(*make)(const char *, int, const char *, const char *, void *, int, int);
    int (*start)(void *), (*step)(void *, double, double, int);
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*get)(void *, const unsigned *, size_t, double *);
    *(void **)&make = dlsym(library, "fmi2Instantiate");
    *(void **)&start = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)&step = dlsym(library, "fmi2DoStep");
    *(void **)&set = dlsym(library, "fmi2SetReal");
    *(void **)&get = dlsym(library, "fmi2GetReal");
    size_t width = (size_t)atol(given[5]), times = (size_t)atol(given[7]), frames = 0;
    double length = atof(given[6]), out[8], *data = malloc(1 << 28);
    FILE *file = fopen(given[4], "rb");
    if (!data || !file) return 2;
    frames = fread(data, sizeof *data, (1 << 28) / sizeof *data, file) / width;
    unsigned *at = malloc(width * sizeof *at), results[8];
    double *took = malloc(frames * times * sizeof *took);
    double *worked = malloc(frames * times * sizeof *worked);
    void *wheel = make("w", 1, given[2], given[3], &none, 0, 0);
    if (!at || !took || !worked || !wheel || start(wheel)) return 3;
    for (size_t i = 0; i < width; i++) at[i] = (unsigned)(6 + i);
    for (unsigned i = 0; i < 8; i++) results[i] = (unsigned)(6 + width + 1 + i);
    for (size_t i = 0; i < frames * times; i++) {
        double begin = now(CLOCK_MONOTONIC), work = now(CLOCK_THREAD_CPUTIME_ID);
        if (set(wheel, at, width, data + i % frames * width)) return 4;
        if (step(wheel, (double)i * length, length, 0)) return 5;
        if (get(wheel, results, 8, out)) return 6;
        worked[i] = now(CLOCK_THREAD_CPUTIME_ID) - work;
        took[i] = now(CLOCK_MONOTONIC) - begin;
    }
    tell(took, frames, times);
    tell(worked, frames, times);
    void *wheels[WHEELS];
    for (int k = 0; k < WHEELS; k++) {
        wheels[k] = make("w", 1, given[2], given[3], &none, 0, 0);
        if (!wheels[k] || start(wheels[k])) return 7;
    }
    double begin = now(CLOCK_MONOTONIC), work = now(CLOCK_THREAD_CPUTIME_ID);
    for (size_t i = 0; (double)i * length < SECONDS; i++) {
        for (size_t k = 0; k < WHEELS; k++) { /* that do not end their turns at once */
            double *frame = data + (i + k * frames / 100) % frames * width;
            if (set(wheels[k], at, width, frame)) return 8;
            if (step(wheels[k], (double)i * length, length, 0)) return 9;
            if (get(wheels[k], results, 8, out)) return 10;
        }
        double left = begin + (double)(i + 1) * length - now(CLOCK_MONOTONIC);
        struct timespec wait = {0, (long)(1e9 * left)};
        if (left > 0.0) nanosleep(&wait, NULL);
    }
    printf("%g\n", (now(CLOCK_THREAD_CPUTIME_ID) - work) / SECONDS);
    return 0;
}
