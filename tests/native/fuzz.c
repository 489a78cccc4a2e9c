/* Feeds the core what nobody should: damaged calibrations and resources, wild samples, conditions,
 * steps and states, and calls of FMI in any order. Only sanitizers judge.
 *
 * With libFuzzer (clang -fsanitize=fuzzer) it is the target. Without, -DALONE, it makes its own
 * bytes: fuzz SEED INPUTS, the same ones for a seed. The folder FUZZ holds what it starts from:
 * StrainTire.core of an FMU, samples.bin, doubles, five gages a sample, and the folder `virtual` with
 * VirtualTire.core; both folders have an empty one, `damaged`. ONLY tries one thing: 0 calibrations,
 * 1 steps, 2 states, 3 FMI 3.0, 4 virtual tires, 5 FMI 2.0, 6 FMI 2.0 of virtual tires. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../../fmu_src/core/state.h"
#include "../../fmu_src/fmi2/fmi2.h"
#include "../../fmu_src/fmi3/fmi3.h"
#include "../../fmu_src/slave/resources.h"
#include "../../fmu_src/tire/rolling.h"

fmi2Component fmi2Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String,
                              const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
void fmi2FreeInstance(fmi2Component);
fmi2Status fmi2ExitInitializationMode(fmi2Component), fmi2Terminate(fmi2Component);
fmi2Status fmi2Reset(fmi2Component), fmi2DoStep(fmi2Component, double, double, int);
fmi2Status fmi2GetReal(fmi2Component, const unsigned[], size_t, double[]);
fmi2Status fmi2SetReal(fmi2Component, const unsigned[], size_t, const double[]);
fmi2Status fmi2SetInteger(fmi2Component, const unsigned[], size_t, const int[]);
fmi2Status fmi2SetBoolean(fmi2Component, const unsigned[], size_t, const int[]);
fmi2Status fmi2GetString(fmi2Component, const unsigned[], size_t, fmi2String[]);
fmi2Status fmi2SetString(fmi2Component, const unsigned[], size_t, const fmi2String[]);
fmi2Status fmi2GetFMUstate(fmi2Component, fmi2FMUstate *), fmi2SetFMUstate(fmi2Component, fmi2FMUstate);
fmi2Status fmi2FreeFMUstate(fmi2Component, fmi2FMUstate *);
fmi2Status fmi2SerializedFMUstateSize(fmi2Component, fmi2FMUstate, size_t *);
fmi2Status fmi2SerializeFMUstate(fmi2Component, fmi2FMUstate, char[], size_t);
fmi2Status fmi2DeSerializeFMUstate(fmi2Component, const char[], size_t, fmi2FMUstate *);

fmi3Instance fmi3InstantiateCoSimulation(fmi3String, fmi3String, fmi3String, bool, bool, bool, bool,
                                         const unsigned[], size_t, void *, fmi3LogMessageCallback,
                                         fmi3IntermediateUpdateCallback);
void fmi3FreeInstance(fmi3Instance);
fmi3Status fmi3ExitInitializationMode(fmi3Instance), fmi3Reset(fmi3Instance);
fmi3Status fmi3EnterEventMode(fmi3Instance), fmi3EnterStepMode(fmi3Instance);
fmi3Status fmi3Terminate(fmi3Instance);
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance, bool *, bool *, bool *, bool *, bool *, double *);
fmi3Status fmi3DoStep(fmi3Instance, double, double, bool, bool *, bool *, bool *, double *);
fmi3Status fmi3GetFloat64(fmi3Instance, const unsigned[], size_t, double[], size_t);
fmi3Status fmi3SetFloat64(fmi3Instance, const unsigned[], size_t, const double[], size_t);
fmi3Status fmi3SetInt32(fmi3Instance, const unsigned[], size_t, const int32_t[], size_t);
fmi3Status fmi3SetString(fmi3Instance, const unsigned[], size_t, const fmi3String[], size_t);
fmi3Status fmi3GetClock(fmi3Instance, const unsigned[], size_t, bool[]);
fmi3Status fmi3GetFMUState(fmi3Instance, fmi3FMUState *), fmi3SetFMUState(fmi3Instance, fmi3FMUState);
fmi3Status fmi3FreeFMUState(fmi3Instance, fmi3FMUState *);
fmi3Status fmi3DeserializeFMUState(fmi3Instance, const fmi3Byte[], size_t, fmi3FMUState *);

enum { SAMPLES = 10, MOST_SAMPLES = 400 };

/* What an FMU carries: its folder, its file without the hash, what stands in it. */
typedef struct {
    char folder[4096];
    const char *name;
    char *file;
    size_t size;
    Resources known;
} Carried;

static Carried wheel = {.name = "StrainTire.core"}, rolling = {.name = "VirtualTire.core"};
static const Resources *const own = &wheel.known, *const tire = &rolling.known;
static size_t samples;
static double *strain;

enum { BEHIND = 17 }; /* start values behind a surface */

/* What is left of the bytes; zeros behind their end. */
typedef struct {
    const uint8_t *at, *end;
} Source;

static unsigned byte_of(Source *s) { return s->at < s->end ? *s->at++ : 0; }

static unsigned long place_of(Source *s, unsigned long n) {
    unsigned long x = byte_of(s);
    x = x << 8 | byte_of(s);
    x = x << 8 | byte_of(s);
    return n ? x % n : 0;
}

static double number_of(Source *s, double usual) {
    static const double ODD[] = {0.0, -0.0, 1.0, -1.0, 0.5, 1e-300, 1e300, -1e300, 1e18, -1e18, 256.0,
                                 2147483648.0, -2147483649.0, 4503599627370497.5, 1e-9, 3.0};
    unsigned kind = byte_of(s);
    uint64_t bits = 0;
    double x;
    if (kind < 64) return ODD[kind % 16];
    if (kind < 80) return NAN;
    if (kind < 96) return kind % 2 ? INFINITY : -INFINITY;
    if (kind < 208) return usual * (1.0 + ((int)byte_of(s) - 128) / 64.0);
    for (int i = 0; i < 8; i++) bits = bits << 8 | byte_of(s);
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void *memory(size_t n) {
    void *found = malloc(n ? n : 1);
    if (!found) exit(3);
    return found;
}

/* Give a wheel samples of the recording, some of them changed. */
static void play(Wheel *w, int gages, Source *s, int steps) {
    double frame[MOST_SAMPLES * GAGES], conditions[HELD];
    Outputs out;
    size_t at = 0;
    for (int c = 0; c < HELD; c++) conditions[c] = NAN;
    conditions[SPEED] = 18.0;
    for (int step = 0; step < steps; step++) {
        for (int i = 0; i < SAMPLES; i++, at++)
            for (int g = 0; g < gages; g++)
                frame[i * gages + g] = strain[at % samples * 5 + (size_t)g % 5];
        double length = SAMPLES / 5000.0;
        int count = -1, valid = 1;
        if (s->at < s->end && byte_of(s) < 48) {
            unsigned what = byte_of(s) % 8;
            if (what < 3) frame[place_of(s, (unsigned long)(SAMPLES * gages))] = number_of(s, 1e-3);
            if (what == 3) conditions[byte_of(s) % HELD] = number_of(s, 18.0);
            if (what == 4) length = number_of(s, length);
            if (what == 5) count = (int)byte_of(s) - 100;
            if (what == 6) valid = 0;
            if (what == 7) at += place_of(s, 4000);
        }
        wheel_step(w, frame, length, valid, conditions, count);
        wheel_outputs(w, &out);
    }
}

/* A calibration of which numbers are changed, or whose end is missing. */
static void try_table(Source *s) {
    size_t n = own->numbers;
    double *table = memory(n * sizeof *table);
    Calibration *known = memory(sizeof *known);
    memcpy(table, own->table, n * sizeof *table);
    for (int edits = (int)byte_of(s) % 6; edits >= 0; edits--) {
        size_t at = byte_of(s) < 128 ? place_of(s, 700) : place_of(s, n);
        int counts = byte_of(s) < 128; /* something that says how many, or which */
        while (counts && at < n && !(table[at] == floor(table[at]) && fabs(table[at]) < 300.0)) at++;
        if (at < n) table[at] = counts ? (int)byte_of(s) - 20 : number_of(s, table[at]);
    }
    if (byte_of(s) < 16) {
        n = place_of(s, n);
        if (n > 2) table[2] = (double)n;
        table = realloc(table, n * sizeof *table + 1);
    }
    if (!calibration_read(known, table, n)) {
        size_t size = wheel_size(known, 5000.0);
        void *place = size ? memory(size) : NULL;
        Wheel *w = place ? wheel_start(place, known, 5000.0, SAMPLES, ISO) : NULL;
        if (w) play(w, known->gages, s, 120);
        free(place);
    }
    free(known);
    free(table);
}

/* A wheel at one of several rates; the caller frees what it lies in. */
static Wheel *wheel_of(const Calibration *known, double rate, int axes) {
    return wheel_start(memory(wheel_size(known, rate)), known, rate, SAMPLES, axes);
}

static double rate_of(Source *s) {
    static const double RATES[] = {5000.0, 5000.0, 5000.0, 1e3, 100.0, 1e5, 20000.0, 777.7};
    return RATES[byte_of(s) % 8];
}

/* Wild samples, conditions, steps and rates. */
static void try_steps(Source *s) {
    Calibration *known = memory(sizeof *known);
    if (calibration_read(known, own->table, own->numbers)) exit(4);
    double rate = rate_of(s);
    Wheel *w = wheel_of(known, rate, (int)byte_of(s) % 3);
    play(w, known->gages, s, 1 + (int)place_of(s, 600));
    free(w);
    free(known);
}

/* States of a wheel that has seen wild steps: whole, damaged and cut short. */
static void try_states(Source *s) {
    Calibration *known = memory(sizeof *known);
    if (calibration_read(known, own->table, own->numbers)) exit(4);
    double rate = rate_of(s);
    Wheel *w = wheel_of(known, rate, (int)byte_of(s) % 3), *other = wheel_of(known, rate, w->axes);
    for (int rounds = (int)byte_of(s) % 4; rounds >= 0; rounds--) {
        play(w, known->gages, s, 1 + (int)place_of(s, 150));
        size_t n = state_size(w);
        unsigned char *bytes = memory(n);
        state_save(w, bytes);
        if (byte_of(s) < 128) {
            if (!state_restore(other, bytes, n)) abort();
            play(other, known->gages, s, 20);
        } else {
            bytes[place_of(s, n)] ^= (unsigned char)(1 + byte_of(s) % 255);
            if (state_restore(other, bytes, n)) abort();
            state_restore(other, bytes, place_of(s, n));
        }
        free(bytes);
    }
    free(w);
    free(other);
    free(known);
}

/* A response surface of which numbers are changed, wild options, conditions and steps. */
static void try_tire(Source *s) {
    size_t n = tire->numbers - BEHIND;
    double *table = memory(n * sizeof *table), in[MOST_INPUTS], most;
    RollingTire *w = memory(sizeof *w);
    TireSurface surface;
    memcpy(table, tire->table, n * sizeof *table);
    for (int edits = (int)byte_of(s) % 4; edits > 0; edits--) {
        size_t at = byte_of(s) < 160 ? place_of(s, 60) : place_of(s, n);
        table[at] = number_of(s, table[at]);
    }
    TireOptions options = {5000.0, {0.3, 0.1}, 4e-6, -3.0, 0.0, 0.0, 0.0, 0.2, 0, 7};
    if (byte_of(s) < 128) options.saturation = 1e-3, options.drift = 1e-3, options.dead_gage = 2;
    if (tire_surface_read(&surface, table, n)) {
        for (int i = 0; i < surface.inputs; i++) in[i] = 0.5 * (surface.low[i] + surface.high[i]);
        rolling_start(w, &surface, &options, SAMPLES, in);
        for (int steps = 0; steps < 40 && s->at < s->end; steps++) {
            double length = byte_of(s) < 200 ? SAMPLES / 5000.0 : number_of(s, 0.001);
            if (byte_of(s) < 128) {
                int at = (int)byte_of(s) % surface.inputs;
                in[at] = number_of(s, 0.5 * (surface.low[at] + surface.high[at]));
            }
            rolling_step(w, &surface, length, in, &most);
        }
    }
    free(w);
    free(table);
}

static void said(fmi2Environment e, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String text, ...) {
    (void)e, (void)name, (void)status, (void)category;
    if (strlen(text) > 1u << 20) abort();
}

static void write_damaged(Source *s, const Carried *of, const char *path) {
    char *bytes = memory(of->size);
    size_t n = of->size;
    FILE *out = fopen(path, "wb");
    memcpy(bytes, of->file, n);
    for (int edits = (int)byte_of(s) % 8; edits > 0; edits--) {
        size_t at = byte_of(s) < 200 ? place_of(s, 6000) : place_of(s, n);
        bytes[at < n ? at : 0] = (char)byte_of(s);
    }
    if (byte_of(s) < 16) n = place_of(s, n);
    if (!out || fwrite(bytes, 1, n, out) != n) exit(5);
    fclose(out);
    free(bytes);
}

/* Calls of FMI in any order, on whole or damaged resources. */
static void try_fmi(Source *s, const Carried *of, unsigned often_damaged) {
    char path[4200], other[4300], uri[64];
    const char *texts[] = {"", "iso", "sae", "adapted_sae", "live tire", "%s%n", "/nowhere", other};
    fmi2CallbackFunctions host = {said, NULL, NULL, NULL, NULL};
    fmi2FMUstate state = NULL;
    fmi2String guid = of->known.guid, text;
    int damaged = byte_of(s) < often_damaged;
    snprintf(path, sizeof path, "%s%s", of->folder, damaged ? "/damaged" : "");
    snprintf(other, sizeof other, "%s/%s", path, of->name); /* as another calibration */
    if (damaged) write_damaged(s, of, other);
    for (size_t i = 0; i < sizeof uri - 1; i++) uri[i] = (char)byte_of(s);
    uri[sizeof uri - 1] = 0;
    fmi2FreeInstance(fmi2Instantiate("w", fmi2CoSimulation, guid, uri, &host, 0, 0));
    fmi2Component c = fmi2Instantiate("w", fmi2CoSimulation, guid, path, &host, 0, 0);
    if (byte_of(s) < 220) fmi2ExitInitializationMode(c);
    for (int calls = 0; c && calls < 60 && s->at < s->end; calls++) {
        unsigned r = byte_of(s) < 240 ? (unsigned)place_of(s, of->known.variables + 2) : ~0u;
        double real = 1.0;
        fmi2GetReal(c, &r, 1, &real); /* near what the variable is, or far away */
        real = number_of(s, real);
        int whole = (int)byte_of(s) - 20;
        text = texts[byte_of(s) % 8];
        switch (byte_of(s) % 12) {
        case 0: fmi2SetReal(c, &r, 1, &real); break;
        case 1: fmi2SetInteger(c, &r, 1, &whole); break;
        case 2: fmi2SetBoolean(c, &r, 1, &whole); break;
        case 3: fmi2SetString(c, &r, 1, &text); break;
        case 4: fmi2GetReal(c, &r, 1, &real); break;
        case 5: fmi2GetString(c, &r, 1, &text); break;
        case 6: fmi2DoStep(c, 0.0, byte_of(s) < 200 ? SAMPLES / 5000.0 : real, 0); break;
        case 7: byte_of(s) < 60 ? fmi2Reset(c) : fmi2ExitInitializationMode(c); break;
        case 8: byte_of(s) < 60 ? fmi2Terminate(c) : fmi2GetFMUstate(c, &state); break;
        case 9: fmi2SetFMUstate(c, state); break;
        case 10: fmi2FreeFMUstate(c, &state); break;
        case 11: {
            size_t n = 0;
            if (fmi2SerializedFMUstateSize(c, state, &n) != fmi2OK) break;
            char *bytes = memory(n);
            fmi2SerializeFMUstate(c, state, bytes, n);
            for (int edits = (int)byte_of(s) % 3; edits > 0; edits--)
                bytes[place_of(s, n)] ^= (char)byte_of(s);
            fmi2DeSerializeFMUstate(c, bytes, byte_of(s) < 230 ? n : place_of(s, n), &state);
            free(bytes);
        }
        }
    }
    fmi2FreeFMUstate(c, &state);
    fmi2FreeInstance(c);
}

/* Calls of FMI 3 in any order: references into arrays, counts that do not fit, events, states. */
static void try_fmi3(Source *s) {
    double values[2 * SAMPLES * GAGES] = {0.0}, time;
    fmi3FMUState state = NULL;
    bool flag[5];
    fmi3Instance c = fmi3InstantiateCoSimulation("w", own->guid, wheel.folder, false, false,
                                                 byte_of(s) < 128, false, NULL, 0, NULL, NULL, NULL);
    if (byte_of(s) < 220) fmi3ExitInitializationMode(c);
    for (int calls = 0; c && calls < 60 && s->at < s->end; calls++) {
        unsigned r[2] = {(unsigned)place_of(s, own->variables + 3), 6};
        size_t n = byte_of(s) < 200 ? 1 : 2;
        size_t m = byte_of(s) < 128 ? n : place_of(s, 2 * SAMPLES * GAGES);
        fmi3String text = byte_of(s) < 128 ? "sae" : "%s%n";
        int32_t whole = (int32_t)byte_of(s) - 20;
        if (byte_of(s) < 100) r[0] = 6, m = SAMPLES * 5;
        values[0] = number_of(s, 1e-3);
        switch (byte_of(s) % 12) {
        case 0: fmi3SetFloat64(c, r, n, values, m); break;
        case 1: fmi3GetFloat64(c, r, n, values, m); break;
        case 2: fmi3SetInt32(c, r, 1, &whole, 1); break;
        case 3: fmi3SetString(c, r, 1, &text, m); break;
        case 4: fmi3GetClock(c, r, 1, flag); break;
        case 5: case 6:
            fmi3DoStep(c, 0.0, byte_of(s) < 200 ? SAMPLES / 5000.0 : values[0], true, flag, flag + 1,
                       flag + 2, &time);
            break;
        case 7: byte_of(s) < 60 ? fmi3Reset(c) : fmi3ExitInitializationMode(c); break;
        case 8: byte_of(s) < 60 ? fmi3Terminate(c) : fmi3EnterStepMode(c); break;
        case 9: fmi3EnterEventMode(c); break;
        case 10:
            fmi3UpdateDiscreteStates(c, flag, flag + 1, flag + 2, flag + 3, flag + 4, &time);
            break;
        case 11:
            if (byte_of(s) < 100) fmi3GetFMUState(c, &state);
            else if (byte_of(s) < 128) fmi3DeserializeFMUState(c, s->at, (size_t)(s->end - s->at), &state);
            else fmi3SetFMUState(c, state);
        }
    }
    fmi3FreeFMUState(c, &state);
    fmi3FreeInstance(c);
}

static char *whole_file(const char *in_folder, const char *name, size_t *n) {
    char path[4200];
    snprintf(path, sizeof path, "%s/%s", in_folder, name);
    FILE *in = fopen(path, "rb");
    if (!in || fseek(in, 0, SEEK_END)) exit(2);
    *n = (size_t)ftell(in);
    char *bytes = memory(*n);
    rewind(in);
    if (fread(bytes, 1, *n, in) != *n) exit(2);
    fclose(in);
    return bytes;
}

static void carry(Carried *of, const char *inside) {
    char path[4300];
    size_t format = 14;
    snprintf(of->folder, sizeof of->folder, "%s%s", getenv("FUZZ") ? getenv("FUZZ") : ".", inside);
    snprintf(path, sizeof path, "%s/%s", of->folder, of->name);
    of->file = whole_file(of->folder, of->name, &of->size);
    size_t first = (size_t)((char *)memchr(of->file, '\n', of->size) - of->file);
    memmove(of->file + format, of->file + first, of->size - first); /* without its hash */
    of->size -= first - format;
    if (resources_read(&of->known, path)) exit(2);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    Source s = {data, data + size};
    if (!wheel.file) {
        size_t n;
        carry(&wheel, "");
        carry(&rolling, "/virtual");
        strain = (double *)(void *)whole_file(wheel.folder, "samples.bin", &n);
        samples = n / sizeof(double) / 5;
        if (!samples || tire->numbers <= BEHIND) exit(2);
    }
    const char *only = getenv("ONLY");
    switch (only ? (unsigned)atoi(only) : byte_of(&s) % 7) {
    case 0: try_table(&s); break;
    case 1: try_steps(&s); break;
    case 2: try_states(&s); break;
    case 3: try_fmi3(&s); break;
    case 4: try_tire(&s); break;
    case 5: try_fmi(&s, &wheel, 64); break;
    default: try_fmi(&s, &rolling, 8); /* its file is large */
    }
    return 0;
}

#ifdef ALONE
int main(int n, char **argument) {
    uint64_t x = n > 1 ? strtoull(argument[1], NULL, 10) * 0x9E3779B97F4A7C15u + 1 : 1;
    long runs = n > 2 ? strtol(argument[2], NULL, 10) : 100;
    for (long run = 0; run < runs; run++) {
        uint8_t bytes[700];
        for (size_t i = 0; i < sizeof bytes; i++) { /* xorshift64*, S. Vigna 2016 */
            x ^= x >> 12, x ^= x << 25, x ^= x >> 27;
            bytes[i] = (uint8_t)((x * 0x2545F4914F6CDD1Du) >> 56);
        }
        size_t size = 1 + bytes[0] * 2u;
        bytes[0] = (uint8_t)run;
        LLVMFuzzerTestOneInput(bytes, size);
    }
    printf("%ld inputs\n", runs);
    return 0;
}
#endif
