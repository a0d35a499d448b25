/* An FMU for co-simulation, FMI 3.0.  All of its variables are numbers of an array: value reference k is number k - 1, and 0 is time.  What they are and how
   outputs follow from them is in fmu_model.h, which is generated. */
#include "fmi3.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmu_model.h"

enum mode { INSTANTIATED, INITIALIZATION, STEP, TERMINATED };
enum outputs { OLD, COMPUTED, NOT_FINITE };

/* All that changes, and what an FMU state keeps. */
typedef struct {
  double time;
  fmu_real x[FMU_NUMBERS];
  int mode;
  int outputs; /* one of enum outputs */
} state;

/* Serialized states begin with the token, so that those of another FMU aren't taken. */
#define TOKEN_BYTES (sizeof FMU_TOKEN)

typedef struct {
  state now;
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
} fmu;

static fmi3Status said(const fmu *of, fmi3Status status, const char *sentence) {
  if (of && of->log)
    of->log(of->environment, status, status == fmi3Warning ? "warning" : "error", sentence);
  return status;
}

/* The instance, if it is in one of these modes; otherwise NULL, with a sentence. */
static fmu *in_mode(fmi3Instance instance, unsigned modes, const char *function) {
  static const char *const names[] = {"instantiated", "in initialization mode", "in step mode", "terminated"};
  fmu *const of = (fmu *)instance;
  char sentence[200];
  if (!of || (modes >> of->now.mode & 1u))
    return of;
  snprintf(sentence, sizeof sentence, "%s: can't be called here; the instance is %s", function, names[of->now.mode]);
  said(of, fmi3Error, sentence);
  return NULL;
}

#define IN(mode) (1u << (mode))
#define ANYWHERE (IN(INSTANTIATED) | IN(INITIALIZATION) | IN(STEP) | IN(TERMINATED))

static void start_again(state *now) {
  memset(now, 0, sizeof *now); /* padding, too: states are compared and serialized */
  memcpy(now->x, fmu_starts, sizeof now->x);
  now->mode = INSTANTIATED;
}

/* Outputs of the other numbers; false where one isn't finite. */
static int compute(state *now) {
  int k;
  if (now->outputs == OLD) {
    if (now->mode <= INITIALIZATION)
      fmu_begin(now->x);
    fmu_compute(now->x);
    now->outputs = COMPUTED;
    for (k = FMU_FIRST_OUTPUT; k < FMU_NUMBERS; ++k)
      if (!isfinite(now->x[k]))
        now->outputs = NOT_FINITE;
  }
  return now->outputs == COMPUTED;
}

FMI3_EXPORT const char *FMI3_NAME(fmi3GetVersion)(void) { return FMI3_VERSION; }

FMI3_FUNCTION(fmi3SetDebugLogging, fmi3Boolean on, size_t n, const fmi3String categories[]) {
  (void)on, (void)n, (void)categories; /* there is nothing to say but errors */
  return instance ? fmi3OK : fmi3Error;
}

/* Instances */

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n_intermediate,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
  fmu *made, asks;
  (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate, (void)update;
  memset(&asks, 0, sizeof asks);
  asks.environment = environment, asks.log = log;
  if (!name || !*name)
    return said(&asks, fmi3Error, "an instance needs a name"), NULL;
  if (!token || strcmp(token, FMU_TOKEN) != 0)
    return said(&asks, fmi3Error, "the instantiation token is not that of modelDescription.xml: it is of another FMU"),
           NULL;
  if (event_mode || n_intermediate)
    return said(&asks, fmi3Error, "this FMU has neither event mode nor intermediate values"), NULL;
  made = (fmu *)calloc(1, sizeof *made);
  if (!made)
    return said(&asks, fmi3Fatal, "no memory for an instance"), NULL;
  *made = asks;
  start_again(&made->now);
  return made;
}

FMI3_EXPORT void FMI3_NAME(fmi3FreeInstance)(fmi3Instance instance) { free(instance); }

FMI3_FUNCTION(fmi3EnterInitializationMode, fmi3Boolean has_tolerance, fmi3Float64 tolerance, fmi3Float64 start,
              fmi3Boolean has_stop, fmi3Float64 stop) {
  fmu *const of = in_mode(instance, IN(INSTANTIATED), "fmi3EnterInitializationMode");
  (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
  if (!of)
    return fmi3Error;
  if (!isfinite(start))
    return said(of, fmi3Error, "fmi3EnterInitializationMode: the start time is not finite");
  of->now.time = start, of->now.mode = INITIALIZATION;
  return fmi3OK;
}

FMI3_PLAIN_FUNCTION(fmi3ExitInitializationMode) {
  fmu *const of = in_mode(instance, IN(INITIALIZATION), "fmi3ExitInitializationMode");
  const char *wrong;
  if (!of)
    return fmi3Error;
  if ((wrong = fmu_wrong(of->now.x)) != NULL)
    return said(of, fmi3Error, wrong);
  fmu_begin(of->now.x);
  of->now.outputs = OLD, of->now.mode = STEP;
  return fmi3OK;
}

FMI3_PLAIN_FUNCTION(fmi3Terminate) {
  fmu *const of = in_mode(instance, IN(STEP), "fmi3Terminate");
  if (!of)
    return fmi3Error;
  of->now.mode = TERMINATED;
  return fmi3OK;
}

FMI3_PLAIN_FUNCTION(fmi3Reset) {
  fmu *const of = in_mode(instance, ANYWHERE, "fmi3Reset");
  if (!of)
    return fmi3Error;
  start_again(&of->now);
  return fmi3OK;
}

/* Numbers */

FMI3_FUNCTION(fmi3GetFloat64, const fmi3ValueReference references[], size_t n, fmi3Float64 values[], size_t n_values) {
  fmu *const of = in_mode(instance, ANYWHERE, "fmi3GetFloat64");
  size_t k;
  int finite = 1;
  if (!of)
    return fmi3Error;
  if (n != n_values)
    return said(of, fmi3Error,
                "fmi3GetFloat64: each variable is one number, and there are more or fewer places for them");
  for (k = 0; k < n; ++k) {
    const fmi3ValueReference r = references[k];
    if (r > FMU_NUMBERS)
      return said(of, fmi3Error, "fmi3GetFloat64: a value reference is of no variable");
    if (r > FMU_FIRST_OUTPUT)
      finite &= compute(&of->now);
    values[k] = r == 0 ? of->now.time : (double)of->now.x[r - 1];
  }
  return finite ? fmi3OK
                : said(of, fmi3Warning,
                       "outputs are not numbers: the state is singular, or a closed mechanism is open there");
}

FMI3_FUNCTION(fmi3SetFloat64, const fmi3ValueReference references[], size_t n, const fmi3Float64 values[],
              size_t n_values) {
  fmu *const of = in_mode(instance, IN(INSTANTIATED) | IN(INITIALIZATION) | IN(STEP), "fmi3SetFloat64");
  char sentence[160];
  size_t k;
  if (!of)
    return fmi3Error;
  if (n != n_values)
    return said(of, fmi3Error, "fmi3SetFloat64: each variable is one number, and there are more or fewer numbers");
  for (k = 0; k < n; ++k) { /* all, or none */
    const fmi3ValueReference r = references[k];
    const char *wrong = NULL;
    if (r == 0 || r > FMU_FIRST_OUTPUT)
      wrong = "is neither an input nor a parameter";
    else if (of->now.mode == STEP && r <= FMU_FIRST_INPUT)
      wrong = "is a parameter, which is set before the end of initialization";
    else if (!(fabs(values[k]) <= FMU_LARGEST))
      wrong = "is set to what is no finite number of the FMU's precision";
    if (wrong) {
      snprintf(sentence, sizeof sentence, "fmi3SetFloat64: the variable with the value reference %lu %s",
               (unsigned long)r, wrong);
      return said(of, fmi3Error, sentence);
    }
  }
  for (k = 0; k < n; ++k)
    of->now.x[references[k] - 1] = (fmu_real)values[k];
  of->now.outputs = OLD;
  return fmi3OK;
}

/* Steps */

FMI3_FUNCTION(fmi3DoStep, fmi3Float64 point, fmi3Float64 size, fmi3Boolean no_earlier, fmi3Boolean *event_needed,
              fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time) {
  fmu *const of = in_mode(instance, IN(STEP), "fmi3DoStep");
  state begun;
  const char *wrong;
  char sentence[300];
  (void)no_earlier;
  if (!of)
    return fmi3Error;
  *event_needed = *terminate = *early_return = false;
  *last_time = of->now.time;
  if (!isfinite(point) || !isfinite(size) || !(size > 0))
    return said(of, fmi3Error, "fmi3DoStep: the step must be finite and longer than zero");
  if (!(fabs(point - of->now.time) <= 1e-6 * size + 1e-12 * fabs(point)))
    return said(of, fmi3Error, "fmi3DoStep: the step doesn't begin where the last one ended");
  begun = of->now;
  if ((wrong = fmu_go(of->now.x, point, size)) != NULL) {
    of->now = begun;
    snprintf(sentence, sizeof sentence, "fmi3DoStep: %s", wrong);
    return said(of, fmi3Discard, sentence);
  }
  of->now.time = *last_time = point + size;
  of->now.outputs = OLD;
  return fmi3OK;
}

/* States */

FMI3_FUNCTION(fmi3GetFMUState, fmi3FMUState *to) {
  const fmu *const of = in_mode(instance, ANYWHERE, "fmi3GetFMUState");
  if (!of || !to)
    return fmi3Error;
  if (!*to)
    *to = malloc(sizeof(state));
  if (!*to)
    return said(of, fmi3Fatal, "fmi3GetFMUState: no memory for a state");
  memcpy(*to, &of->now, sizeof(state));
  return fmi3OK;
}

FMI3_FUNCTION(fmi3SetFMUState, fmi3FMUState from) {
  fmu *const of = in_mode(instance, ANYWHERE, "fmi3SetFMUState");
  if (!of || !from)
    return fmi3Error;
  memcpy(&of->now, from, sizeof(state));
  return fmi3OK;
}

FMI3_FUNCTION(fmi3FreeFMUState, fmi3FMUState *kept) {
  if (!instance || !kept)
    return fmi3Error;
  free(*kept);
  *kept = NULL;
  return fmi3OK;
}

FMI3_FUNCTION(fmi3SerializedFMUStateSize, fmi3FMUState kept, size_t *size) {
  if (!instance || !kept || !size)
    return fmi3Error;
  *size = TOKEN_BYTES + sizeof(state);
  return fmi3OK;
}

FMI3_FUNCTION(fmi3SerializeFMUState, fmi3FMUState kept, fmi3Byte bytes[], size_t size) {
  if (!instance || !kept || !bytes || size < TOKEN_BYTES + sizeof(state))
    return fmi3Error;
  memcpy(bytes, FMU_TOKEN, TOKEN_BYTES);
  memcpy(bytes + TOKEN_BYTES, kept, sizeof(state));
  return fmi3OK;
}

FMI3_FUNCTION(fmi3DeserializeFMUState, const fmi3Byte bytes[], size_t size, fmi3FMUState *kept) {
  state read;
  if (!instance || !bytes || !kept)
    return fmi3Error;
  if (size == TOKEN_BYTES + sizeof(state) && memcmp(bytes, FMU_TOKEN, TOKEN_BYTES) == 0) {
    memcpy(&read, bytes + TOKEN_BYTES, sizeof read);
    if (read.mode >= INSTANTIATED && read.mode <= TERMINATED) { /* it indexes names */
      if (!*kept)
        *kept = malloc(sizeof(state));
      if (!*kept)
        return said((const fmu *)instance, fmi3Fatal, "fmi3DeserializeFMUState: no memory for a state");
      memcpy(*kept, &read, sizeof read);
      return fmi3OK;
    }
  }
  return said((const fmu *)instance, fmi3Error, "fmi3DeserializeFMUState: these bytes are no state of this FMU");
}

fmi3Status FMI3_ABSENT(fmi3Instance instance, const char *what) {
  char sentence[200];
  snprintf(sentence, sizeof sentence, "%s: this FMU has co-simulation with numbers of type Float64 alone", what);
  return said((const fmu *)instance, fmi3Error, sentence);
}
