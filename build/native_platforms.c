/* Step an FMU through the frames of a file three times, and write eight outputs after each step as
 * doubles: by an instance that also gets steps it refuses; by a second one beside it that reads its
 * calibration from a file; by the first one after a reset, with a state taken halfway, fifty steps
 * more, and the state given back.
 * Arguments: library, GUID, resources, frames, doubles of a frame, step [s], calibration, results. */
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define CLOSE(library) FreeLibrary((HMODULE)(library))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#define CLOSE(library) dlclose(library)
#endif

enum { OUTPUTS = 8, CALIBRATION = 4, FRAME = 6, MORE = 50 };

typedef struct {
    void *log, *take, *give, *done, *environment;
} Callbacks;

static void *(*make)(const char *, int, const char *, const char *, void *, int, int);
static int (*start)(void *), (*reset)(void *), (*step)(void *, double, double, int);
static int (*set)(void *, const unsigned *, size_t, const double *);
static int (*get)(void *, const unsigned *, size_t, double *);
static int (*name)(void *, const unsigned *, size_t, const char *const *);
static int (*take)(void *, void **), (*give)(void *, void *), (*forget)(void *, void **);
static void (*release)(void *);

static double data[1 << 22], *results, length;
static unsigned *inputs, outputs[OUTPUTS];
static size_t width, frames;

static void check(int wrong, int code) {
    if (wrong) exit(code);
}

/* Take one step of a frame; outputs go to their place in a run. */
static void go(void *wheel, size_t i, int run) {
    check(set(wheel, inputs, width, data + i * width), 4);
    check(step(wheel, (double)i * length, length, 0), 5);
    check(get(wheel, outputs, OUTPUTS, results + (run * frames + i) * OUTPUTS), 6);
}

int main(int n, char **given) {
    Callbacks none = {0};
    const unsigned calibration = CALIBRATION;
    const char *path = n == 9 ? given[7] : NULL;
    void *library = n == 9 ? OPEN(given[1]) : NULL, *state = NULL;
    check(!library, 1);
    *(void **)&make = FIND(library, "fmi2Instantiate");
    *(void **)&start = FIND(library, "fmi2ExitInitializationMode");
    *(void **)&reset = FIND(library, "fmi2Reset");
    *(void **)&step = FIND(library, "fmi2DoStep");
    *(void **)&set = FIND(library, "fmi2SetReal");
    *(void **)&get = FIND(library, "fmi2GetReal");
    *(void **)&name = FIND(library, "fmi2SetString");
    *(void **)&take = FIND(library, "fmi2GetFMUstate");
    *(void **)&give = FIND(library, "fmi2SetFMUstate");
    *(void **)&forget = FIND(library, "fmi2FreeFMUstate");
    *(void **)&release = FIND(library, "fmi2FreeInstance");
    width = (size_t)atol(given[5]);
    length = atof(given[6]);
    FILE *file = fopen(given[4], "rb"), *out = fopen(given[8], "wb");
    check(!file || !out, 2);
    frames = fread(data, sizeof *data, sizeof data / sizeof *data, file) / width;
    inputs = malloc(width * sizeof *inputs);
    results = malloc(3 * frames * OUTPUTS * sizeof *results);
    void *wheel = make("w", 1, given[2], given[3], &none, 0, 0);
    void *other = make("o", 1, given[2], given[3], &none, 0, 0);
    check(!inputs || !results || !wheel || !other || name(other, &calibration, 1, &path), 3);
    check(start(wheel) || start(other), 3);
    for (unsigned i = 0; i < width; i++) inputs[i] = FRAME + i;
    for (unsigned i = 0; i < OUTPUTS; i++) outputs[i] = FRAME + (unsigned)width + 1 + i;
    for (size_t i = 0; i < frames; i++) {
        go(wheel, i, 0);
        check(i % 100 == 0 && !step(wheel, 0.0, -length, 0), 7);
        go(other, i, 1);
    }
    release(other);
    check(reset(wheel) || start(wheel), 8);
    for (size_t i = 0; i < frames / 2 + MORE; i++) {
        check(i == frames / 2 && take(wheel, &state), 9);
        go(wheel, i, 2);
    }
    check(give(wheel, state) || forget(wheel, &state), 9);
    for (size_t i = frames / 2; i < frames; i++) go(wheel, i, 2);
    fwrite(results, sizeof *results, 3 * frames * OUTPUTS, out);
    release(wheel);
    free(inputs);
    free(results);
    CLOSE(library);
    return fclose(file) || fclose(out) ? 10 : 0;
}
