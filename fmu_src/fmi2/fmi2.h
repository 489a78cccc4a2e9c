/* What FMI 2.0 asks of a co-simulation slave: types and names of the standard. */
#ifndef TIRE_FMI2_H
#define TIRE_FMI2_H

#include <stddef.h>

#ifdef _WIN32
#define FMI2_EXPORT __declspec(dllexport)
#else
#define FMI2_EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component, *fmi2Environment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum {
    fmi2DoStepStatus,
    fmi2PendingStatus,
    fmi2LastSuccessfulTime,
    fmi2Terminated
} fmi2StatusKind;

typedef struct {
    void (*logger)(fmi2Environment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(fmi2Environment, fmi2Status);
    fmi2Environment environment;
} fmi2CallbackFunctions;

#endif
