/* What FMI 3.0 asks of a co-simulation FMU: types and names of the standard. */
#ifndef TIRE_FMI3_H
#define TIRE_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32
#define FMI3_EXPORT __declspec(dllexport)
#else
#define FMI3_EXPORT __attribute__((visibility("default")))
#endif

/* A program that compiles several FMUs into itself gives each a prefix, as FMI 3.0 has it. */
#ifdef FMI3_FUNCTION_PREFIX
#define TIRE3_JOINED(a, b) a##b
#define TIRE3_PREFIXED(a, b) TIRE3_JOINED(a, b)
#define fmi3GetVersion TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetVersion)
#define fmi3SetDebugLogging TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetDebugLogging)
#define fmi3InstantiateModelExchange TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateModelExchange)
#define fmi3InstantiateCoSimulation TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateCoSimulation)
#define fmi3InstantiateScheduledExecution TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3InstantiateScheduledExecution)
#define fmi3FreeInstance TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3FreeInstance)
#define fmi3EnterInitializationMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterInitializationMode)
#define fmi3ExitInitializationMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ExitInitializationMode)
#define fmi3EnterEventMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterEventMode)
#define fmi3Terminate TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3Terminate)
#define fmi3Reset TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3Reset)
#define fmi3GetFloat32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFloat32)
#define fmi3GetFloat64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFloat64)
#define fmi3GetInt8 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt8)
#define fmi3GetUInt8 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt8)
#define fmi3GetInt16 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt16)
#define fmi3GetUInt16 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt16)
#define fmi3GetInt32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt32)
#define fmi3GetUInt32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt32)
#define fmi3GetInt64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetInt64)
#define fmi3GetUInt64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetUInt64)
#define fmi3GetBoolean TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetBoolean)
#define fmi3GetString TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetString)
#define fmi3GetBinary TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetBinary)
#define fmi3GetClock TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetClock)
#define fmi3SetFloat32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFloat32)
#define fmi3SetFloat64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFloat64)
#define fmi3SetInt8 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt8)
#define fmi3SetUInt8 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt8)
#define fmi3SetInt16 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt16)
#define fmi3SetUInt16 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt16)
#define fmi3SetInt32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt32)
#define fmi3SetUInt32 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt32)
#define fmi3SetInt64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetInt64)
#define fmi3SetUInt64 TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetUInt64)
#define fmi3SetBoolean TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetBoolean)
#define fmi3SetString TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetString)
#define fmi3SetBinary TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetBinary)
#define fmi3SetClock TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetClock)
#define fmi3GetNumberOfVariableDependencies TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfVariableDependencies)
#define fmi3GetVariableDependencies TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetVariableDependencies)
#define fmi3GetFMUState TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetFMUState)
#define fmi3SetFMUState TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetFMUState)
#define fmi3FreeFMUState TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3FreeFMUState)
#define fmi3SerializedFMUStateSize TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SerializedFMUStateSize)
#define fmi3SerializeFMUState TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SerializeFMUState)
#define fmi3DeserializeFMUState TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3DeserializeFMUState)
#define fmi3GetDirectionalDerivative TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetDirectionalDerivative)
#define fmi3GetAdjointDerivative TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetAdjointDerivative)
#define fmi3EnterConfigurationMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterConfigurationMode)
#define fmi3ExitConfigurationMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ExitConfigurationMode)
#define fmi3GetIntervalDecimal TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalDecimal)
#define fmi3GetIntervalFraction TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetIntervalFraction)
#define fmi3GetShiftDecimal TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetShiftDecimal)
#define fmi3GetShiftFraction TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetShiftFraction)
#define fmi3SetIntervalDecimal TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalDecimal)
#define fmi3SetIntervalFraction TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetIntervalFraction)
#define fmi3SetShiftDecimal TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetShiftDecimal)
#define fmi3SetShiftFraction TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetShiftFraction)
#define fmi3EvaluateDiscreteStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EvaluateDiscreteStates)
#define fmi3UpdateDiscreteStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3UpdateDiscreteStates)
#define fmi3EnterContinuousTimeMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterContinuousTimeMode)
#define fmi3CompletedIntegratorStep TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3CompletedIntegratorStep)
#define fmi3SetTime TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetTime)
#define fmi3SetContinuousStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3SetContinuousStates)
#define fmi3GetContinuousStateDerivatives TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStateDerivatives)
#define fmi3GetEventIndicators TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetEventIndicators)
#define fmi3GetContinuousStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetContinuousStates)
#define fmi3GetNominalsOfContinuousStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNominalsOfContinuousStates)
#define fmi3GetNumberOfEventIndicators TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfEventIndicators)
#define fmi3GetNumberOfContinuousStates TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetNumberOfContinuousStates)
#define fmi3EnterStepMode TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3EnterStepMode)
#define fmi3GetOutputDerivatives TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3GetOutputDerivatives)
#define fmi3DoStep TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3DoStep)
#define fmi3ActivateModelPartition TIRE3_PREFIXED(FMI3_FUNCTION_PREFIX, fmi3ActivateModelPartition)
#endif

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent,
    fmi3Constant,
    fmi3Fixed,
    fmi3Tunable,
    fmi3Discrete,
    fmi3Dependent
} fmi3DependencyKind;
typedef enum {
    fmi3IntervalNotYetKnown,
    fmi3IntervalUnchanged,
    fmi3IntervalChanged
} fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean *,
                                               fmi3Float64 *);

#endif
