/* The interface of FMI 3.0 as far as an FMU for co-simulation has it: declarations of our own, after the standard (fmi-standard.org, 3.0.2, section 2.2 and 4.2).
   Functions of the other kinds of interface, of clocks, binaries and derivatives are there as well, and return fmi3Error.  FMI3_FUNCTION_PREFIX goes before all
   names where several FMUs are linked statically. */
#ifndef KSL_FMI3_H
#define KSL_FMI3_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3PreemptionCallback)(void);

#if defined(FMI3_OVERRIDE_FUNCTION_PREFIX) || !defined(FMI3_FUNCTION_PREFIX)
#define FMI3_NAME(name) name
#else
#define FMI3_JOINED(prefix, name) prefix##name
#define FMI3_PREFIXED(prefix, name) FMI3_JOINED(prefix, name)
#define FMI3_NAME(name) FMI3_PREFIXED(FMI3_FUNCTION_PREFIX, name)
#endif

#if defined(_WIN32)
#define FMI3_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define FMI3_EXPORT __attribute__((visibility("default")))
#else
#define FMI3_EXPORT
#endif

/* A function of the interface, and one that has an instance alone. */
#define FMI3_FUNCTION(name, ...)                                                                                       \
  FMI3_EXPORT fmi3Status FMI3_NAME(name)(fmi3Instance instance, __VA_ARGS__);                                          \
  FMI3_EXPORT fmi3Status FMI3_NAME(name)(fmi3Instance instance, __VA_ARGS__)
#define FMI3_PLAIN_FUNCTION(name)                                                                                      \
  FMI3_EXPORT fmi3Status FMI3_NAME(name)(fmi3Instance instance);                                                       \
  FMI3_EXPORT fmi3Status FMI3_NAME(name)(fmi3Instance instance)

#define FMI3_VERSION "3.0"
FMI3_EXPORT const char *FMI3_NAME(fmi3GetVersion)(void);
FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n_intermediate,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update);
FMI3_EXPORT void FMI3_NAME(fmi3FreeInstance)(fmi3Instance instance);
FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token,
                                                                 fmi3String resources, fmi3Boolean visible,
                                                                 fmi3Boolean logging,
                                                                 fmi3InstanceEnvironment environment,
                                                                 fmi3LogMessageCallback log);
FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3PreemptionCallback lock, fmi3PreemptionCallback unlock);

/* Says that a function isn't there. */
#define FMI3_ABSENT FMI3_NAME(fmi3_absent)
fmi3Status FMI3_ABSENT(fmi3Instance instance, const char *what);

#endif
