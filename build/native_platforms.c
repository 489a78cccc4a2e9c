/* Step an FMU through the frames of a file, and write eight outputs after each step as doubles.
 * Arguments: library, GUID, resources, frames, doubles of a frame, step [s], results. */
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

typedef struct {
    void *log, *take, *give, *done, *environment;
} Callbacks;

int main(int n, char **given) {
    static double data[1 << 22];
    Callbacks none = {0};
    void *library = n == 8 ? OPEN(given[1]) : NULL;
    if (!library) return 1;
    void *(*make)(const char *, int, const char *, const char *, void *, int, int);
    int (*start)(void *), (*step)(void *, double, double, int);
    int (*set)(void *, const unsigned *, size_t, const double *);
    int (*get)(void *, const unsigned *, size_t, double *);
    void (*release)(void *);
    *(void **)&make = FIND(library, "fmi2Instantiate");
    *(void **)&start = FIND(library, "fmi2ExitInitializationMode");
    *(void **)&step = FIND(library, "fmi2DoStep");
    *(void **)&set = FIND(library, "fmi2SetReal");
    *(void **)&get = FIND(library, "fmi2GetReal");
    *(void **)&release = FIND(library, "fmi2FreeInstance");
    size_t width = (size_t)atol(given[5]);
    double length = atof(given[6]), out[8];
    FILE *file = fopen(given[4], "rb"), *results = fopen(given[7], "wb");
    if (!file || !results) return 2;
    size_t frames = fread(data, sizeof *data, sizeof data / sizeof *data, file) / width;
    unsigned *at = malloc(width * sizeof *at), places[8];
    void *wheel = make("w", 1, given[2], given[3], &none, 0, 0);
    if (!at || !wheel || start(wheel)) return 3;
    for (size_t i = 0; i < width; i++) at[i] = (unsigned)(6 + i);
    for (unsigned i = 0; i < 8; i++) places[i] = (unsigned)(6 + width + 1 + i);
    for (size_t i = 0; i < frames; i++) {
        if (set(wheel, at, width, data + i * width)) return 4;
        if (step(wheel, (double)i * length, length, 0)) return 5;
        if (get(wheel, places, 8, out)) return 6;
        fwrite(out, sizeof *out, 8, results);
    }
    release(wheel);
    free(at);
    CLOSE(library);
    return fclose(results) ? 7 : 0;
}
