/* Step one instance in each of several threads; each thread makes its own, writes its outputs to a
 * file of its own, and leaves. The library is loaded once. With -DODD, threads have small stacks, and
 * every other one computes as some importers do: exceptions trap, and it rounds upwards.
 * Arguments: library, GUID, resources, frames, doubles of a frame, step [s], results, threads. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fenv.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST = 16, OUTPUTS = 8, STACK = 80 << 10 };
enum { TRAPS = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW };

typedef struct {
    void *log, *take, *give, *done, *environment;
} Callbacks;

static void *(*make)(const char *, int, const char *, const char *, void *, int, int);
static int (*start)(void *), (*step)(void *, double, double, int), (*reset)(void *);
static int (*set)(void *, const unsigned *, size_t, const double *);
static int (*get)(void *, const unsigned *, size_t, double *);
static int (*save)(void *, void **), (*restore)(void *, void *), (*forget)(void *, void **);
static void (*leave)(void *);
static char **given;
static double data[1 << 20], length;
static size_t width, frames;
static pthread_barrier_t together;

/* Step through all frames twice, with a state taken and given back and a reset between. */
static void *drive(void *argument) {
    size_t number = (size_t)argument;
    Callbacks none = {0};
    char path[4096];
    unsigned *at = malloc(width * sizeof *at), places[OUTPUTS];
    void *kept = NULL;
    double out[OUTPUTS];
    snprintf(path, sizeof path, "%s%d", given[7], (int)number);
    FILE *results = fopen(path, "wb");
    pthread_barrier_wait(&together);
#ifdef ODD
    if (number % 2 && (feenableexcept(TRAPS) || fesetround(FE_UPWARD))) return "no traps";
#endif
    void *wheel = make("w", 1, given[2], given[3], &none, 0, 0);
    if (!at || !results || !wheel) return "no instance";
    for (size_t i = 0; i < width; i++) at[i] = (unsigned)(6 + i);
    for (unsigned i = 0; i < OUTPUTS; i++) places[i] = (unsigned)(6 + width + 1 + i);
    for (int time = 0; time < 2; time++) {
        if (start(wheel)) return "no start";
        for (size_t i = 0; i < frames; i++) {
            if (set(wheel, at, width, data + i * width)) return "not set";
            if (step(wheel, (double)i * length, length, 0)) return "no step";
            if (get(wheel, places, OUTPUTS, out)) return "nothing got";
            if (i == frames / 2 + number && (save(wheel, &kept) || restore(wheel, kept)))
                return "no state";
            fwrite(out, sizeof *out, OUTPUTS, results);
        }
        if (forget(wheel, &kept) || reset(wheel)) return "no reset";
    }
    leave(wheel);
#ifdef ODD
    if (number % 2 && (fegetexcept() != TRAPS || fegetround() != FE_UPWARD)) return "no traps left";
#endif
    free(at);
    return fclose(results) ? "not written" : NULL;
}

int main(int n, char **arguments) {
    pthread_t thread[MOST];
    void *library = n == 9 ? dlopen(arguments[1], RTLD_NOW) : NULL, *said = NULL;
    int threads = n == 9 ? atoi(arguments[8]) : 0, failed = 0;
    if (!library || threads < 1 || threads > MOST) return 1;
    *(void **)&make = dlsym(library, "fmi2Instantiate");
    *(void **)&start = dlsym(library, "fmi2ExitInitializationMode");
    *(void **)&step = dlsym(library, "fmi2DoStep");
    *(void **)&set = dlsym(library, "fmi2SetReal");
    *(void **)&get = dlsym(library, "fmi2GetReal");
    *(void **)&reset = dlsym(library, "fmi2Reset");
    *(void **)&save = dlsym(library, "fmi2GetFMUstate");
    *(void **)&restore = dlsym(library, "fmi2SetFMUstate");
    *(void **)&forget = dlsym(library, "fmi2FreeFMUstate");
    *(void **)&leave = dlsym(library, "fmi2FreeInstance");
    given = arguments;
    width = (size_t)atol(given[5]);
    length = atof(given[6]);
    FILE *file = fopen(given[4], "rb");
    if (!file) return 2;
    frames = fread(data, sizeof *data, sizeof data / sizeof *data, file) / width;
    fclose(file);
    pthread_barrier_init(&together, NULL, (unsigned)threads);
    pthread_attr_t small;
    pthread_attr_init(&small);
#ifdef ODD
    if (pthread_attr_setstacksize(&small, STACK)) return 3;
#endif
    for (size_t i = 0; i < (size_t)threads; i++)
        if (pthread_create(thread + i, &small, drive, (void *)i)) return 3;
    for (int i = 0; i < threads; i++) {
        pthread_join(thread[i], &said);
        if (said) fprintf(stderr, "%s\n", (const char *)said), failed = 4;
    }
    dlclose(library);
    return failed;
}
