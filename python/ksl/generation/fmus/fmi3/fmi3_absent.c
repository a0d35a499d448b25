/* What FMI 3.0 has and this FMU doesn't: functions that return fmi3Error with a sentence, since importers look for all of them. */
#include "fmi3.h"

#define REFERENCES const fmi3ValueReference references[], size_t n
#define NO_NUMBERS(type)                                                                                               \
  FMI3_FUNCTION(fmi3Get##type, REFERENCES, fmi3##type values[], size_t n_values) {                                     \
    return (void)references, (void)values, (void)n_values, n ? FMI3_ABSENT(instance, "fmi3Get" #type) : fmi3OK;        \
  }                                                                                                                    \
  FMI3_FUNCTION(fmi3Set##type, REFERENCES, const fmi3##type values[], size_t n_values) {                               \
    return (void)references, (void)values, (void)n_values, n ? FMI3_ABSENT(instance, "fmi3Set" #type) : fmi3OK;        \
  }
NO_NUMBERS(Float32)
NO_NUMBERS(Int8)
NO_NUMBERS(UInt8)
NO_NUMBERS(Int16)
NO_NUMBERS(UInt16)
NO_NUMBERS(Int32)
NO_NUMBERS(UInt32)
NO_NUMBERS(Int64)
NO_NUMBERS(UInt64)
NO_NUMBERS(Boolean)
NO_NUMBERS(String)

#define ABSENT_PLAIN(name)                                                                                             \
  FMI3_PLAIN_FUNCTION(name) { return FMI3_ABSENT(instance, #name); }
ABSENT_PLAIN(fmi3EnterEventMode)
ABSENT_PLAIN(fmi3EnterStepMode)
ABSENT_PLAIN(fmi3EnterConfigurationMode)
ABSENT_PLAIN(fmi3ExitConfigurationMode)
ABSENT_PLAIN(fmi3EvaluateDiscreteStates)
ABSENT_PLAIN(fmi3EnterContinuousTimeMode)

/* Takes parameters that nobody reads, so that no compiler complains about them. */
static void unread(int none, ...) { (void)none; }
#define ABSENT(name, parameters, ...)                                                                                  \
  FMI3_FUNCTION(name, __VA_ARGS__) { return unread parameters, FMI3_ABSENT(instance, #name); }
#define DERIVATIVE                                                                                                     \
  const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed, fmi3Float64 values[],   \
      size_t n_values
ABSENT(fmi3GetBinary, (0, references, n, sizes, b, m), REFERENCES, size_t sizes[], fmi3Binary b[], size_t m)
ABSENT(fmi3SetBinary, (0, references, n, sizes, b, m), REFERENCES, const size_t sizes[], const fmi3Binary b[], size_t m)
ABSENT(fmi3GetClock, (0, references, n, b), REFERENCES, fmi3Clock b[])
ABSENT(fmi3SetClock, (0, references, n, b), REFERENCES, const fmi3Clock b[])
ABSENT(fmi3GetIntervalDecimal, (0, references, n, b, c), REFERENCES, fmi3Float64 b[], fmi3IntervalQualifier c[])
ABSENT(fmi3GetIntervalFraction, (0, references, n, b, c, d), REFERENCES, fmi3UInt64 b[], fmi3UInt64 c[],
       fmi3IntervalQualifier d[])
ABSENT(fmi3GetShiftDecimal, (0, references, n, b), REFERENCES, fmi3Float64 b[])
ABSENT(fmi3GetShiftFraction, (0, references, n, b, c), REFERENCES, fmi3UInt64 b[], fmi3UInt64 c[])
ABSENT(fmi3SetIntervalDecimal, (0, references, n, b), REFERENCES, const fmi3Float64 b[])
ABSENT(fmi3SetIntervalFraction, (0, references, n, b, c), REFERENCES, const fmi3UInt64 b[], const fmi3UInt64 c[])
ABSENT(fmi3SetShiftDecimal, (0, references, n, b), REFERENCES, const fmi3Float64 b[])
ABSENT(fmi3SetShiftFraction, (0, references, n, b, c), REFERENCES, const fmi3UInt64 b[], const fmi3UInt64 c[])
ABSENT(fmi3GetOutputDerivatives, (0, references, n, b, c, m), REFERENCES, const fmi3Int32 b[], fmi3Float64 c[],
       size_t m)
ABSENT(fmi3GetNumberOfVariableDependencies, (0, b, c), fmi3ValueReference b, size_t *c)
ABSENT(fmi3GetVariableDependencies, (0, b, c, d, e, f, g), fmi3ValueReference b, size_t c[], fmi3ValueReference d[],
       size_t e[], fmi3DependencyKind f[], size_t g)
ABSENT(fmi3GetDirectionalDerivative, (0, references, n, knowns, n_knowns, seed, n_seed, values, n_values), REFERENCES,
       DERIVATIVE)
ABSENT(fmi3GetAdjointDerivative, (0, references, n, knowns, n_knowns, seed, n_seed, values, n_values), REFERENCES,
       DERIVATIVE)
ABSENT(fmi3UpdateDiscreteStates, (0, b, c, d, e, f, g), fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d, fmi3Boolean *e,
       fmi3Boolean *f, fmi3Float64 *g)
ABSENT(fmi3CompletedIntegratorStep, (0, b, c, d), fmi3Boolean b, fmi3Boolean *c, fmi3Boolean *d)
ABSENT(fmi3SetTime, (0, b), fmi3Float64 b)
ABSENT(fmi3SetContinuousStates, (0, b, c), const fmi3Float64 b[], size_t c)
ABSENT(fmi3GetContinuousStateDerivatives, (0, b, c), fmi3Float64 b[], size_t c)
ABSENT(fmi3GetEventIndicators, (0, b, c), fmi3Float64 b[], size_t c)
ABSENT(fmi3GetContinuousStates, (0, b, c), fmi3Float64 b[], size_t c)
ABSENT(fmi3GetNominalsOfContinuousStates, (0, b, c), fmi3Float64 b[], size_t c)
ABSENT(fmi3GetNumberOfEventIndicators, (0, b), size_t *b)
ABSENT(fmi3GetNumberOfContinuousStates, (0, b), size_t *b)
ABSENT(fmi3ActivateModelPartition, (0, b, c), fmi3ValueReference b, fmi3Float64 c)

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateModelExchange)(fmi3String name, fmi3String token,
                                                                 fmi3String resources, fmi3Boolean visible,
                                                                 fmi3Boolean logging,
                                                                 fmi3InstanceEnvironment environment,
                                                                 fmi3LogMessageCallback log) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
  return NULL;
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3PreemptionCallback lock, fmi3PreemptionCallback unlock) {
  (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
  (void)update, (void)lock, (void)unlock;
  return NULL;
}
