/* What FMI 2.0 asks of a co-simulation slave: types and names of the standard. */
#ifndef TIRE_FMI2_H
#define TIRE_FMI2_H

#include <stddef.h>

#ifdef _WIN32
#define FMI2_EXPORT __declspec(dllexport)
#else
#define FMI2_EXPORT __attribute__((visibility("default")))
#endif

/* A program that compiles several FMUs into itself gives each a prefix, as FMI 2.0 has it. */
#ifdef FMI2_FUNCTION_PREFIX
#define TIRE_JOINED(a, b) a##b
#define TIRE_PREFIXED(a, b) TIRE_JOINED(a, b)
#define fmi2Instantiate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2Instantiate)
#define fmi2FreeInstance TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2FreeInstance)
#define fmi2SetDebugLogging TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetDebugLogging)
#define fmi2SetupExperiment TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetupExperiment)
#define fmi2EnterInitializationMode TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2EnterInitializationMode)
#define fmi2ExitInitializationMode TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2ExitInitializationMode)
#define fmi2Terminate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2Terminate)
#define fmi2Reset TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2Reset)
#define fmi2GetReal TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetReal)
#define fmi2GetInteger TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetInteger)
#define fmi2GetBoolean TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetBoolean)
#define fmi2GetString TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetString)
#define fmi2SetReal TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetReal)
#define fmi2SetInteger TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetInteger)
#define fmi2SetBoolean TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetBoolean)
#define fmi2SetString TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetString)
#define fmi2GetFMUstate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetFMUstate)
#define fmi2SetFMUstate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetFMUstate)
#define fmi2FreeFMUstate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2FreeFMUstate)
#define fmi2SerializedFMUstateSize TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SerializedFMUstateSize)
#define fmi2SerializeFMUstate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SerializeFMUstate)
#define fmi2DeSerializeFMUstate TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2DeSerializeFMUstate)
#define fmi2GetDirectionalDerivative TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetDirectionalDerivative)
#define fmi2SetRealInputDerivatives TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2SetRealInputDerivatives)
#define fmi2GetRealOutputDerivatives TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetRealOutputDerivatives)
#define fmi2DoStep TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2DoStep)
#define fmi2CancelStep TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2CancelStep)
#define fmi2GetStatus TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetStatus)
#define fmi2GetRealStatus TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetRealStatus)
#define fmi2GetIntegerStatus TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetIntegerStatus)
#define fmi2GetBooleanStatus TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetBooleanStatus)
#define fmi2GetStringStatus TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetStringStatus)
#define fmi2GetTypesPlatform TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetTypesPlatform)
#define fmi2GetVersion TIRE_PREFIXED(FMI2_FUNCTION_PREFIX, fmi2GetVersion)
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
