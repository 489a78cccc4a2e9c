#include "slave.h"

#include <fenv.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *name_of(const Slave *s, size_t i) { return s->own.variable[i] + 2; }
static char kind_of(const Slave *s, size_t i) { return s->own.variable[i][0]; }
static char causality_of(const Slave *s, size_t i) { return s->own.variable[i][1]; }

int slave_allowed(Slave *s, unsigned r, char kind, int set) {
    const char *type = kind == 'R'   ? s->dialect->real
                       : kind == 'I' ? s->dialect->integer
                       : kind == 'B' ? "Boolean"
                                     : "String";
    if (r >= s->count) {
        slave_failed(s, "value reference = %u; allowed are 0 .. %u", r, (unsigned)s->count - 1);
        return 0;
    }
    if (kind_of(s, r) != kind) {
        slave_failed(s, "TypeError: %s is not of type %s", name_of(s, r), type);
        return 0;
    }
    char causality = causality_of(s, r);
    if (set && (causality == 'o' || (causality == 'p' && s->phase != INSTANTIATED))) {
        slave_failed(s,
                     "ParameterError: %s: cannot be set now; inputs can be set at any time, "
                     "parameters before initialisation only, outputs never",
                     name_of(s, r));
        return 0;
    }
    return 1;
}

int slave_given(Slave *s, const void *references, const void *values, size_t n) {
    if (!n || (references && values)) return 1;
    slave_failed(s, "a null pointer; %lu value references and their values are needed",
                 (unsigned long)n);
    return 0;
}

/* Add a word to the status, by semicolons. */
void slave_add(Slave *s, const char *word) {
    size_t n = strlen(s->status);
    snprintf(s->status + n, sizeof s->status - n, "%s%s", n ? ";" : "", word);
}

/* Add a word with a cause, without the semicolon that parts words. Reference: status_entry */
void slave_add_cause(Slave *s, const char *word) {
    char line[LINE];
    snprintf(line, sizeof line, "%.32s: %.*s", word, LINE - 64, s->cause);
    for (char *c = line; *c; c++)
        if (*c == ';') *c = ',';
    slave_add(s, line);
}

/* Reference: GuardedSlave._refuse */
int slave_refuse(Slave *s, const char *format, ...) {
    va_list given;
    va_start(given, format);
    vsnprintf(s->cause, sizeof s->cause, format, given);
    va_end(given);
    s->refused = 1;
    memset(s->whole + s->outputs + s->reals + s->model->truth, 0,
           (size_t)s->model->truths * sizeof *s->whole);
    s->status[0] = 0;
    slave_add_cause(s, "step_refused");
    return slave_failed(s, "%s", s->cause);
}

/* Compute as C does at its start, whatever the importer set in this thread: NaN is a value here, so
 * that no exception may trap, and rounding decides on flags. Returns what it had set. */
static fenv_t computing(void) {
    fenv_t host;
    fegetenv(&host);
    fesetenv(FE_DFL_ENV);
    return host;
}

void slave_foresee(Slave *s) {
    if (s->phase != INSTANTIATED || s->refused || s->running) return;
    fenv_t host = computing();
    s->model->foresee(s);
    fesetenv(&host);
}

void slave_reset(Slave *s) {
    for (size_t i = 0; i < s->count; i++) {
        s->real[i] = NAN;
        s->whole[i] = 0;
    }
    memset(s->text, 0, sizeof s->text);
    memset(s->loaded, 0, sizeof s->loaded);
    s->phase = INSTANTIATED;
    s->refused = s->announced = s->running = 0;
    s->time = 0.0;
    s->causes = s->remarked = 0;
    s->model->first(s);
}

int slave_unstarted(Slave *s) {
    if (s->phase == INSTANTIATED) return DONE;
    return slave_failed(s, "the FMU is initialised; reset it before you initialise it again");
}

int slave_end(Slave *s) {
    if (s->phase == TERMINATED)
        return slave_failed(s, "the FMU is terminated; reset it and initialise it again");
    s->phase = TERMINATED;
    return DONE;
}

int slave_start(Slave *s) {
    if (slave_unstarted(s)) return FAILED;
    fenv_t host = computing();
    s->running = s->model->start(s);
    if (s->running) {
        s->phase = STEPPING;
        s->model->publish(s);
        s->refused = 0;
    }
    fesetenv(&host);
    return s->running ? DONE : FAILED;
}

int slave_step(Slave *s, double step) {
    if (s->phase == INSTANTIATED)
        return slave_refuse(s, "the FMU is not initialised; call exitInitializationMode first");
    if (s->phase == TERMINATED)
        return slave_refuse(s, "the FMU is terminated; reset it and initialise it again");
    fenv_t host = computing();
    int status = s->model->step(s, step);
    if (status == DONE) {
        s->model->publish(s);
        s->refused = 0;
    }
    fesetenv(&host);
    return status;
}

void slave_free(Slave *s) {
    resources_free(&s->own);
    resources_free(&s->other);
    free(s->calibration);
    free(s->tire);
    free(s->memory);
    free(s->real);
    free(s->whole);
    free(s->name);
    free(s->folder);
    free(s);
}

static Slave *refused(Slave *s, const char *format, ...) {
    char cause[LINE];
    va_list given;
    va_start(given, format);
    vsnprintf(cause, sizeof cause, format, given);
    va_end(given);
    slave_tell(s, cause);
    slave_free(s);
    return NULL;
}

static const Model *const MODELS[] = {&STRAIN_MODEL, &VIRTUAL_MODEL};

/* Find out where the variables stand; whether there are as many as the model says. */
static int placed(Slave *s) {
    s->samples = (int)s->own.samples;
    s->buffered = s->own.buffered != 0.0;
    if (!s->model->place(s)) return 0;
    s->real = calloc(s->count, sizeof *s->real);
    s->whole = calloc(s->count, sizeof *s->whole);
    return s->own.variables == s->count && s->real && s->whole;
}

static Slave *made(const Dialect *dialect, const void *host, const char *name, const char *guid,
                   const char *place, const char *wrong_type) {
    Slave *s = calloc(1, sizeof *s);
    size_t n = place ? strlen(place) : 0;
    if (!s) return NULL;
    s->dialect = dialect;
    s->host = host;
    s->name = calloc(1, name ? strlen(name) + 1 : 1);
    s->folder = malloc(n + 32);
    if (!s->name || !s->folder) return refused(s, "there is no memory left");
    if (name) strcpy(s->name, name);
    if (wrong_type) return refused(s, "%s", wrong_type);
    if (!place)
        return refused(s, "%s is missing; the place of the unpacked folder resources is needed",
                       dialect->place);
    path_of(place, s->folder);
    const char *wrong = NULL;
    size_t end = strlen(s->folder);
    for (int i = 0; i < 2; i++) {
        s->model = MODELS[i];
        sprintf(s->folder + end, "/%s", s->model->file);
        wrong = resources_read(&s->own, s->folder);
        if (!wrong || !resources_missing(wrong)) break;
    }
    if (!wrong && (!(s->own.samples >= 1.0 && s->own.samples <= 256.0) || !placed(s)))
        wrong = "is damaged";
    if (wrong)
        return refused(s,
                       "%s = %s: %s %s; unpack the whole FMU and give the place of its folder "
                       "resources",
                       dialect->place, place,
                       resources_missing(wrong) ? "StrainTire.core or VirtualTire.core"
                                                : s->model->file,
                       wrong);
    if (!guid || strcmp(guid, s->own.guid))
        return refused(s,
                       "%s = %s; that of this FMU is %s; model description and binary come from "
                       "different builds; unpack the FMU anew",
                       dialect->guid, guid ? guid : "missing", s->own.guid);
    slave_reset(s);
    return s;
}

Slave *slave_make(const Dialect *dialect, const void *host, const char *name, const char *guid,
                  const char *place, const char *wrong_type) {
    fenv_t set = computing();
    Slave *s = made(dialect, host, name, guid, place, wrong_type);
    fesetenv(&set);
    return s;
}

const char *slave_text(const Slave *s, unsigned r) {
    return r < PARAMETERS ? s->text[r] : r == s->count - 1 ? s->status : s->rolling;
}

int slave_set_text(Slave *s, unsigned r, const char *text) {
    if (!text || strlen(text) >= TEXT)
        return slave_failed(s, "ParameterError: %s: a text of up to %d bytes is needed",
                            name_of(s, r), TEXT - 1);
    strcpy(s->text[r], text);
    return DONE;
}

/* How many bytes variables and parameters need in a state. */
static size_t own_size(const Slave *s) {
    return s->count * (sizeof *s->real + sizeof *s->whole) + sizeof s->text + sizeof s->rolling +
           sizeof s->status + sizeof s->cause + sizeof s->time + sizeof s->numbers +
           4 * sizeof(int);
}

/* Copy variables and parameters into a state, or back out of it. */
static void exchange(Slave *s, unsigned char *bytes, int *running, int back) {
    struct {
        void *own;
        size_t n;
    } part[] = {{s->real, s->count * sizeof *s->real},
                {s->whole, s->count * sizeof *s->whole},
                {s->text, sizeof s->text},
                {s->rolling, sizeof s->rolling},
                {s->status, sizeof s->status},
                {s->cause, sizeof s->cause},
                {&s->time, sizeof s->time},
                {&s->numbers, sizeof s->numbers},
                {&s->phase, sizeof s->phase},
                {&s->refused, sizeof s->refused},
                {&s->announced, sizeof s->announced},
                {running, sizeof *running}};
    for (size_t i = 0; i < sizeof part / sizeof *part; i++) {
        memcpy(back ? part[i].own : (void *)bytes, back ? (void *)bytes : part[i].own, part[i].n);
        bytes += part[i].n;
    }
}

/* What stands at the end of a state of n bytes: it tells damage, and states of other FMUs. */
static uint64_t seal(const Slave *s, const unsigned char *bytes, size_t n) {
    return state_hash(bytes, n) ^ state_hash(s->own.guid, strlen(s->own.guid));
}

SlaveState *slave_save(Slave *s) {
    int running = s->running;
    size_t n = own_size(s) + (running ? s->model->state_size(s) : 0);
    SlaveState *kept = malloc(sizeof *kept + n + sizeof(uint64_t));
    if (!kept) {
        slave_failed(s, "MemoryError: %lu bytes", (unsigned long)n);
        return NULL;
    }
    kept->n = n + sizeof(uint64_t);
    exchange(s, kept->bytes, &running, 0);
    if (running) s->model->save(s, kept->bytes + own_size(s));
    uint64_t sealed = seal(s, kept->bytes, n);
    memcpy(kept->bytes + n, &sealed, sizeof sealed);
    return kept;
}

static const char NO_STATE[] =
    "FormatError: the bytes are not a saved state of this FMU; save the state again";

/* Take up a state whose bytes are sound; returns a status. */
static int taken_up(Slave *s, const SlaveState *kept) {
    size_t n = kept->n - sizeof(uint64_t);
    int running = 0;
    exchange(s, (unsigned char *)kept->bytes, &running, 1);
    for (int i = 0; i < PARAMETERS; i++) s->text[i][TEXT - 1] = 0;
    s->rolling[sizeof s->rolling - 1] = s->status[LINE - 1] = s->cause[LINE - 1] = 0;
    s->running = 0;
    if (!running) {
        s->phase = INSTANTIATED;
        return DONE;
    }
    int phase = s->phase;
    uint64_t numbers = s->numbers;
    s->phase = INSTANTIATED;
    if (!s->model->start(s)) return FAILED;
    if (s->numbers != numbers ||
        !s->model->restore(s, kept->bytes + own_size(s), n - own_size(s)))
        return slave_failed(s, NO_STATE);
    s->running = 1;
    s->phase = phase == TERMINATED ? TERMINATED : STEPPING;
    return DONE;
}

int slave_restore(Slave *s, const SlaveState *kept) {
    uint64_t sealed;
    if (kept->n < own_size(s) + sizeof sealed) return slave_failed(s, NO_STATE);
    size_t n = kept->n - sizeof sealed;
    memcpy(&sealed, kept->bytes + n, sizeof sealed);
    if (sealed != seal(s, kept->bytes, n)) return slave_failed(s, NO_STATE);
    SlaveState *before = slave_save(s);
    if (!before) return FAILED;
    fenv_t host = computing();
    int status = taken_up(s, kept);
    if (status != DONE) taken_up(s, before);
    fesetenv(&host);
    free(before);
    return status;
}
