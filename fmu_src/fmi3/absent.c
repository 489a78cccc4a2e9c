/* Functions of FMI 3.0 that this FMU has no use for: types that no variable is of, derivatives,
 * structural parameters, clocks with an interval, and the two other kinds of FMU. They are errors,
 * and there, because importers look for every name. */
#include "fmi3.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define ABSENT(name, ...)                                                                          \
    FMI3_EXPORT fmi3Status name(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }
#define ABSENT_ALONE(name)                                                                         \
    FMI3_EXPORT fmi3Status name(fmi3Instance c) { return fmi3Error; }
#define REFERENCES const fmi3ValueReference r[], size_t n

ABSENT(fmi3GetFloat32, REFERENCES, fmi3Float32 v[], size_t m)
ABSENT(fmi3SetFloat32, REFERENCES, const fmi3Float32 v[], size_t m)
ABSENT(fmi3GetInt8, REFERENCES, fmi3Int8 v[], size_t m)
ABSENT(fmi3SetInt8, REFERENCES, const fmi3Int8 v[], size_t m)
ABSENT(fmi3GetUInt8, REFERENCES, fmi3UInt8 v[], size_t m)
ABSENT(fmi3SetUInt8, REFERENCES, const fmi3UInt8 v[], size_t m)
ABSENT(fmi3GetInt16, REFERENCES, fmi3Int16 v[], size_t m)
ABSENT(fmi3SetInt16, REFERENCES, const fmi3Int16 v[], size_t m)
ABSENT(fmi3GetUInt16, REFERENCES, fmi3UInt16 v[], size_t m)
ABSENT(fmi3SetUInt16, REFERENCES, const fmi3UInt16 v[], size_t m)
ABSENT(fmi3GetUInt32, REFERENCES, fmi3UInt32 v[], size_t m)
ABSENT(fmi3SetUInt32, REFERENCES, const fmi3UInt32 v[], size_t m)
ABSENT(fmi3GetInt64, REFERENCES, fmi3Int64 v[], size_t m)
ABSENT(fmi3SetInt64, REFERENCES, const fmi3Int64 v[], size_t m)
ABSENT(fmi3GetUInt64, REFERENCES, fmi3UInt64 v[], size_t m)
ABSENT(fmi3SetUInt64, REFERENCES, const fmi3UInt64 v[], size_t m)
ABSENT(fmi3GetBinary, REFERENCES, size_t sizes[], fmi3Binary v[], size_t m)
ABSENT(fmi3SetBinary, REFERENCES, const size_t sizes[], const fmi3Binary v[], size_t m)
ABSENT(fmi3SetClock, REFERENCES, const fmi3Clock v[])

ABSENT(fmi3GetNumberOfVariableDependencies, fmi3ValueReference r, size_t *n)
ABSENT(fmi3GetVariableDependencies, fmi3ValueReference r, size_t i[], fmi3ValueReference of[],
       size_t j[], fmi3DependencyKind kinds[], size_t n)
ABSENT(fmi3GetDirectionalDerivative, REFERENCES, const fmi3ValueReference u[], size_t m,
       const fmi3Float64 seed[], size_t seeds, fmi3Float64 v[], size_t values)
ABSENT(fmi3GetAdjointDerivative, REFERENCES, const fmi3ValueReference u[], size_t m,
       const fmi3Float64 seed[], size_t seeds, fmi3Float64 v[], size_t values)
ABSENT(fmi3GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 v[], size_t m)
ABSENT_ALONE(fmi3EnterConfigurationMode)
ABSENT_ALONE(fmi3ExitConfigurationMode)

ABSENT(fmi3GetIntervalDecimal, REFERENCES, fmi3Float64 v[], fmi3IntervalQualifier q[])
ABSENT(fmi3GetIntervalFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
       fmi3IntervalQualifier q[])
ABSENT(fmi3GetShiftDecimal, REFERENCES, fmi3Float64 v[])
ABSENT(fmi3GetShiftFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(fmi3SetIntervalDecimal, REFERENCES, const fmi3Float64 v[])
ABSENT(fmi3SetIntervalFraction, REFERENCES, const fmi3UInt64 counters[],
       const fmi3UInt64 resolutions[])
ABSENT(fmi3SetShiftDecimal, REFERENCES, const fmi3Float64 v[])
ABSENT(fmi3SetShiftFraction, REFERENCES, const fmi3UInt64 counters[],
       const fmi3UInt64 resolutions[])

ABSENT_ALONE(fmi3EnterContinuousTimeMode)
ABSENT(fmi3CompletedIntegratorStep, fmi3Boolean kept, fmi3Boolean *event, fmi3Boolean *end)
ABSENT(fmi3SetTime, fmi3Float64 time)
ABSENT(fmi3SetContinuousStates, const fmi3Float64 x[], size_t n)
ABSENT(fmi3GetContinuousStateDerivatives, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetEventIndicators, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetContinuousStates, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetNominalsOfContinuousStates, fmi3Float64 x[], size_t n)
ABSENT(fmi3GetNumberOfEventIndicators, size_t *n)
ABSENT(fmi3GetNumberOfContinuousStates, size_t *n)
ABSENT(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
