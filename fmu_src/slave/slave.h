/* An instance of StrainTire.fmu or VirtualTire.fmu behind the functions of FMI, whichever version
 * calls it.
 *
 * Variables, refusals and texts are those of the Python FMU: tirelib.fmu.slave, tirelib.fmu.wheel,
 * fmu_src/strain_tire.py. Tests: test_native_fmu, test_native_fmi3. Memory is taken at the
 * instantiation, for the parameter `calibration` at the initialisation, and for states when they
 * are asked for; never in a step. */
#ifndef TIRE_SLAVE_H
#define TIRE_SLAVE_H

#include <stdint.h>

#include "../core/remarks.h"
#include "../core/state.h"
#include "../tire/rolling.h"
#include "resources.h"

enum { PARAMETERS = 6, P_RATE = 0, P_ORDER, P_MISSING, P_AXES, P_CALIBRATION, P_TIRE };
enum { TEXT = 4096, LINE = 8192, CAUSES = 50 };
enum { INSTANTIATED, STEPPING, TERMINATED };
enum { DONE = 0, FAILED = 3 }; /* statuses, alike in FMI 2 and 3 */

/* How a version of FMI tells a text, and what it calls identifier, place of the resources, types.
 */
typedef struct {
    void (*tell)(const void *host, const char *name, const char *text, int warning);
    const char *guid, *place, *real, *integer;
} Dialect;

typedef struct Slave Slave;

/* What differs between the FMUs. Each finds its data in a file of the resources. */
typedef struct {
    const char *file;
    int truth, truths;       /* Booleans among the outputs behind the Reals */
    int (*place)(Slave *s);  /* take the data, say where variables stand; 0: damaged */
    void (*first)(Slave *s); /* start values that are neither NaN nor 0 */
    int (*start)(Slave *s);  /* start with the parameters; 0, and told: it cannot */
    int (*step)(Slave *s, double step);
    void (*publish)(Slave *s); /* write the outputs */
    void (*foresee)(Slave *s); /* write what a start would show */
    size_t (*state_size)(const Slave *s);
    void (*save)(const Slave *s, unsigned char *bytes);
    int (*restore)(Slave *s, const unsigned char *bytes, size_t n);
} Model;

extern const Model STRAIN_MODEL, VIRTUAL_MODEL;

struct Slave {
    const Dialect *dialect;
    const Model *model;
    const void *host; /* whom `tell` tells */
    char *name, *folder;
    Resources own, other; /* `other`: the parameter `calibration` */
    Calibration *calibration;
    Wheel *wheel;
    TireSurface surface;
    RollingTire *tire;
    int running;  /* whether wheel or tire was started */
    void *memory; /* of the wheel */
    size_t size;  /* of that memory */
    int gages, samples, buffered, phase, refused;
    int announced;                                   /* the turn that an event was last about */
    size_t frame, conditions, outputs, reals, count; /* places; how many variables */
    double *real;
    int *whole; /* Integers and Booleans */
    double time;              /* of the last step's end, as the importer of FMI 3 counts it */
    uint64_t numbers;         /* hash of the calibration that was given; 0: the embedded one */
    char text[PARAMETERS][TEXT];
    char loaded[TEXT]; /* the file that `other` was read from */
    char rolling[16], status[LINE], cause[LINE];
    uint64_t told[CAUSES];
    unsigned times[CAUSES], causes, remarked; /* remarked: a bit for each kind that was told */
};

/* A state: variables and parameters, then the wheel's, then a hash of them and of the FMU's GUID. */
typedef struct {
    size_t n;
    unsigned char bytes[];
} SlaveState;

/* Make an instance; NULL, with the cause told, if it cannot be. `wrong_type` is the cause where the
 * importer wants another kind of FMU, NULL where not. */
Slave *slave_make(const Dialect *dialect, const void *host, const char *name, const char *guid,
                  const char *place, const char *wrong_type);
void slave_free(Slave *s);

/* Tell the importer a text; an error when it is new; one with a format, which returns FAILED. */
void slave_tell(const Slave *s, const char *text);
void slave_complain(Slave *s, const char *cause);
int slave_failed(Slave *s, const char *format, ...);

/* Tell, as a warning and once for each kind, what is out of range; `name` is filled in. */
void slave_remark(Slave *s, int kind, const Remark *remark, const char *name);

/* Add a word to the status, by semicolons; one with the cause, without the semicolon. */
void slave_add(Slave *s, const char *word);
void slave_add_cause(Slave *s, const char *word);

/* Let nothing be valid until a step is done; returns FAILED. */
int slave_refuse(Slave *s, const char *format, ...);

/* Bring all variables to their start values. */
void slave_reset(Slave *s);

/* Whether it may still be initialised; returns a status. */
int slave_unstarted(Slave *s);

/* Take no further steps; returns a status. */
int slave_end(Slave *s);

/* Initialise: start a wheel with the parameters as they are now. Returns a status. */
int slave_start(Slave *s);

/* Step by seconds. Returns a status. */
int slave_step(Slave *s, double step);

/* Whether a reference is of a type, R, I, B or S, and, to be set, not of an output or a fixed
 * parameter. */
int slave_allowed(Slave *s, unsigned reference, char kind, int set);

/* Whether the importer gave memory for n references and their values. */
int slave_given(Slave *s, const void *references, const void *values, size_t n);

/* Show, before a start, what a start would show. */
void slave_foresee(Slave *s);

/* How many turns there were. */
int slave_turn(const Slave *s);

const char *slave_text(const Slave *s, unsigned reference);
int slave_set_text(Slave *s, unsigned reference, const char *text);

/* Take a state, NULL if there is no memory; and take it up again, which returns a status: one that
 * is damaged, or of another FMU, changes nothing. */
SlaveState *slave_save(Slave *s);
int slave_restore(Slave *s, const SlaveState *state);

#endif
