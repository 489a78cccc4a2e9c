/* The gate of an FMU: it stands before pythonfmu's library and hands every call on to it.
 *
 * pythonfmu 0.7.0 takes the place of the resources as it is written in the URI, so that a percent
 * sign in it ends the importer, gives every text to the importer as a printf format, looks neither
 * at the GUID nor at the kind of FMU, tells of a missing package only with debug logging, lets
 * one discarded step count as a wish to end the simulation for ever, and at the process's exit
 * releases its interpreter a second time after it was freed, which now and then ends in an abort.
 * The gate
 *
 * - decodes the URI, and refuses resources that are not there,
 * - refuses another GUID than that in guid.txt, and model exchange,
 * - doubles percent signs in every text, and passes errors on whether logging is on or not,
 * - answers fmi2Error where pythonfmu says fatal or discard: the instance lives, can be asked why,
 *   stepped again, reset and freed; and never wants to end the simulation,
 * - releases the interpreter once, at exit, before pythonfmu's own static objects are destroyed.
 *
 * The library that it hands on to is resources/binaries/linux64/pythonfmu.so.
 * `build/native_fmu.py` compiles this file.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../fmi2/fmi2.h"

/* Calls that are handed on as they are: name, parameters, arguments. */
#define HANDED_ON(X) \
    X(SetupExperiment, (fmi2Component c, fmi2Boolean a, fmi2Real tolerance, fmi2Real start, fmi2Boolean b, fmi2Real stop), \
      (g->inner, a, tolerance, start, b, stop)) \
    X(EnterInitializationMode, (fmi2Component c), (g->inner)) \
    X(ExitInitializationMode, (fmi2Component c), (g->inner)) \
    X(Terminate, (fmi2Component c), (g->inner)) \
    X(Reset, (fmi2Component c), (g->inner)) \
    X(GetReal, (fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]), (g->inner, r, n, v)) \
    X(GetInteger, (fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Integer v[]), (g->inner, r, n, v)) \
    X(GetBoolean, (fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Boolean v[]), (g->inner, r, n, v)) \
    X(GetString, (fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]), (g->inner, r, n, v)) \
    X(SetReal, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]), (g->inner, r, n, v)) \
    X(SetInteger, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer v[]), (g->inner, r, n, v)) \
    X(SetBoolean, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Boolean v[]), (g->inner, r, n, v)) \
    X(SetString, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]), (g->inner, r, n, v)) \
    X(GetFMUstate, (fmi2Component c, fmi2FMUstate *s), (g->inner, s)) \
    X(SetFMUstate, (fmi2Component c, fmi2FMUstate s), (g->inner, s)) \
    X(FreeFMUstate, (fmi2Component c, fmi2FMUstate *s), (g->inner, s)) \
    X(SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate s, size_t *n), (g->inner, s, n)) \
    X(SerializeFMUstate, (fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n), (g->inner, s, b, n)) \
    X(DeSerializeFMUstate, (fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s), (g->inner, b, n, s)) \
    X(GetDirectionalDerivative, (fmi2Component c, const fmi2ValueReference u[], size_t m, const fmi2ValueReference r[], \
      size_t n, const fmi2Real d[], fmi2Real v[]), (g->inner, u, m, r, n, d, v)) \
    X(SetRealInputDerivatives, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], \
      const fmi2Real v[]), (g->inner, r, n, o, v)) \
    X(GetRealOutputDerivatives, (fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Integer o[], \
      fmi2Real v[]), (g->inner, r, n, o, v)) \
    X(DoStep, (fmi2Component c, fmi2Real now, fmi2Real step, fmi2Boolean kept), (g->inner, now, step, kept)) \
    X(CancelStep, (fmi2Component c), (g->inner))

/* Calls whose discard says that there is no such status. */
#define ASKED(X) \
    X(GetStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Status *v), (g->inner, k, v)) \
    X(GetRealStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Real *v), (g->inner, k, v)) \
    X(GetIntegerStatus, (fmi2Component c, const fmi2StatusKind k, fmi2Integer *v), (g->inner, k, v)) \
    X(GetStringStatus, (fmi2Component c, const fmi2StatusKind k, fmi2String *v), (g->inner, k, v))

#define DECLARED(name, parameters, arguments) fmi2Status(*name) parameters;

typedef struct {
    void *library;
    fmi2Component inner;
    const fmi2CallbackFunctions *host;
    fmi2CallbackFunctions callbacks; /* what pythonfmu gets; its environment is this gate */
    char *name;
    fmi2Boolean logging, starting;
    size_t categories;
    char **category;
    fmi2Component (*Instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
    void (*FreeInstance)(fmi2Component);
    HANDED_ON(DECLARED)
    ASKED(DECLARED)
} Gate;

static const char *const CATEGORIES[] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal", "logAll"};
static const char TWICE[] = "Fatal py exception encountered"; /* the slave told its cause before */

/* A function to call at exit. It stands in the C++ binary interface; `library` NULL: also where the gate is unloaded before. */
int __cxa_atexit(void (*called)(void *), void *argument, void *library);

/* Give a text to the importer as a printf format that shows it as it is. */
static void tell(const Gate *g, fmi2Status status, fmi2String category, const char *text) {
    if (!g->host || !g->host->logger || !text) return;
    char *format = malloc(2 * strlen(text) + 1), *end = format;
    if (!format) return;
    for (; *text; text++) {
        if (*text == '%') *end++ = '%';
        *end++ = *text;
    }
    *end = 0;
    g->host->logger(g->host->environment, g->name, status, category, format);
    free(format);
}

/* Take what pythonfmu logs: errors and warnings always, the rest as the importer wants it. */
static void take(fmi2Environment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    const Gate *g = environment;
    int wanted = status >= fmi2Warning;
    (void)name;
    if (!g->starting && text && !strncmp(text, TWICE, sizeof TWICE - 1)) return;
    if (!category || !*category) category = CATEGORIES[status];
    if (g->logging && !g->categories) wanted = 1;
    for (size_t i = 0; g->logging && i < g->categories; i++) wanted |= !strcmp(g->category[i], category);
    if (wanted) tell(g, status, category, text);
}

static void forget(Gate *g) {
    for (size_t i = 0; i < g->categories; i++) free(g->category[i]);
    free(g->category);
    g->category = NULL;
    g->categories = 0;
}

static fmi2Component refused(Gate *g, const char *before, const char *given, const char *after) {
    char *text = malloc(strlen(before) + strlen(given) + strlen(after) + 1);
    if (text) tell(g, fmi2Error, "logStatusError", strcat(strcat(strcpy(text, before), given), after));
    free(text);
    if (g->library) dlclose(g->library);
    free(g->name);
    free(g);
    return NULL;
}

static int digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    c |= 32;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Write what stands behind file:// (or file:, or as it is), decoded or not. */
static void path_of(const char *uri, int decoded, char *path) {
    if (!strncmp(uri, "file:", 5)) {
        uri += 5;
        if (!strncmp(uri, "//", 2)) uri += 2 + strcspn(uri + 2, "/"); /* a host */
    }
    for (; *uri; uri++) {
        int coded = decoded && *uri == '%' && digit(uri[1]) >= 0 && digit(uri[2]) >= 0;
        *path++ = coded ? (char)(16 * digit(uri[1]) + digit(uri[2])) : *uri;
        if (coded) uri += 2;
    }
    *path = 0;
}

/* Read the first line of a file of the resources; tell whether there is one. */
static int line_of(const char *folder, const char *name, char line[256]) {
    char *path = malloc(strlen(folder) + strlen(name) + 2);
    FILE *file = NULL;
    if (path) file = fopen(strcat(strcat(strcpy(path, folder), "/"), name), "r");
    free(path);
    line[0] = 0;
    if (!file) return 0;
    if (fgets(line, 256, file)) line[strcspn(line, "\r\n")] = 0;
    fclose(file);
    return line[0] != 0;
}

static int load(Gate *g, const char *folder, char *path) {
    static void *arranged; /* the library whose interpreter is released at exit */
    g->library = dlopen(strcat(strcpy(path, folder), "/binaries/linux64/pythonfmu.so"), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!g->library) return 0;
    int found = 1;
#define FOUND(name, parameters, arguments) found &= (*(void **)&g->name = dlsym(g->library, "fmi2" #name)) != NULL;
    FOUND(Instantiate, , )
    FOUND(FreeInstance, , )
    HANDED_ON(FOUND)
    ASKED(FOUND)
    void (*release)(void *);
    *(void **)&release = dlsym(g->library, "finalizePythonInterpreter");
    if (release && arranged != g->library && !__cxa_atexit(release, NULL, NULL)) arranged = g->library;
    return found && release;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String uri,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    Gate *g = calloc(1, sizeof *g);
    char line[256], module[260];
    if (!g) return NULL;
    g->host = functions;
    g->name = strdup(name ? name : "");
    g->logging = logging;
    if (type != fmi2CoSimulation)
        return refused(g, "fmuType is ", "model exchange", "; this FMU is for co-simulation; choose that in the importer");
    size_t size = uri ? strlen(uri) + 64 : 0;
    char *folder = malloc(size + 1), *path = malloc(size + 1);
    if (folder && path && uri) {
        path_of(uri, 1, folder);
        if (!line_of(folder, "slavemodule.txt", line)) path_of(uri, 0, folder);
    }
    fmi2Component found = NULL;
    if (!uri || !folder || !path)
        refused(g, "fmuResourceLocation is ", "missing", "; the URI of the unpacked folder resources is needed");
    else if (strstr(folder, "%20") || strstr(folder, "file://"))
        refused(g, "fmuResourceLocation = ", uri, "; pythonfmu 0.7.0 cannot read a folder with %20 or file:// in its name; unpack to another");
    else if (!line_of(folder, "slavemodule.txt", line) || !line_of(folder, strcat(strcpy(module, line), ".py"), module))
        refused(g, "fmuResourceLocation = ", uri, "; it holds no slave; unpack the whole FMU and give the URI of its folder resources");
    else if (!line_of(folder, "guid.txt", line) || !guid || strcmp(guid, line)) {
        char end[512] = "; that of this FMU is ";
        strcat(strcat(end, line), "; model description and binary come from different builds; unpack the FMU anew");
        refused(g, "fmuGUID = ", guid ? guid : "missing", end);
    } else if (!load(g, folder, path)) {
        const char *cause = dlerror();
        refused(g, "pythonfmu's library cannot be loaded: ", cause ? cause : "it lacks a function",
                "; a program that is not Python needs libpython beforehand (LD_PRELOAD)");
    } else {
        g->callbacks = (fmi2CallbackFunctions){take, functions ? functions->allocate : NULL, functions ? functions->release : NULL, NULL, g};
        g->starting = 1;
        g->inner = g->Instantiate(g->name, type, guid, folder, &g->callbacks, visible, 1);
        g->starting = 0;
        if (g->inner)
            found = g;
        else
            refused(g, "the FMU cannot be ", "instantiated", "; the cause was logged before");
    }
    free(folder);
    free(path);
    return found;
}

void fmi2FreeInstance(fmi2Component c) {
    Gate *g = c;
    if (!g) return;
    g->FreeInstance(g->inner);
    forget(g);
    dlclose(g->library);
    free(g->name);
    free(g);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean logging, size_t n, const fmi2String categories[]) {
    Gate *g = c;
    if (!g) return fmi2Error;
    forget(g);
    g->logging = logging;
    if (n) g->category = calloc(n, sizeof *g->category);
    for (size_t i = 0; g->category && i < n; i++)
        if ((g->category[g->categories] = strdup(categories[i]))) g->categories++;
    return fmi2OK;
}

#define HAND_ON(name, parameters, arguments) \
    fmi2Status fmi2##name parameters { \
        Gate *g = c; \
        fmi2Status status = g ? g->name arguments : fmi2Error; \
        return status == fmi2Discard || status == fmi2Fatal ? fmi2Error : status; \
    }
#define ASK(name, parameters, arguments) \
    fmi2Status fmi2##name parameters { \
        Gate *g = c; \
        return g ? g->name arguments : fmi2Error; \
    }
HANDED_ON(HAND_ON)
ASKED(ASK)

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (!c) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = 0;
    return fmi2OK;
}

/* The hash of this file, so that a test can tell whether the library was made from it. */
const char tirelib_gate_source[] = "source sha256 " SOURCE;
