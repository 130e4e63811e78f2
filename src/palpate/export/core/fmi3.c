/* FMI 3.0 for co-simulation and model exchange, around fmi_body.c; a host may have included the standard's headers.
 *
 * All functions of the standard are here, because importers load none of them where one is missing. What a body has no
 * use for (clocks, other types of variables, scheduled execution, adjoint derivatives) is refused with a reason.
 */
#ifndef fmi3FunctionTypes_h
typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean;
typedef const char *fmi3String;
typedef uint8_t fmi3Byte;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);
typedef void (*fmi3UnlockPreemptionCallback)(void);
#endif

enum { FLAGS3 = 12 }; /* value reference of the first Boolean: in this version all types share the numbers */

static void tell3(Instance *c, int status, const char *category, const char *text) {
  ((fmi3LogMessageCallback)c->logger)(c->environment, (fmi3Status)status, category, text);
}

static Instance *new_instance(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  Instance *c = (Instance *)calloc(1, sizeof *c);
  if (!c) return 0;
  c->tell = tell3;
  c->logger = (void (*)(void))log;
  c->environment = environment;
  return c;
}

FMI const char *fmi3GetVersion(void) { return "3.0"; }

FMI fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                              fmi3Boolean loud, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  Instance *c = new_instance(environment, log);
  (void)visible, (void)loud;
  return c ? fill(c, name, token, resources, 0, 1) : 0;
}

FMI fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                             fmi3Boolean loud, fmi3Boolean events, fmi3Boolean early,
                                             const fmi3ValueReference wanted[], size_t count,
                                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                             fmi3IntermediateUpdateCallback update) {
  Instance *c = new_instance(environment, log);
  (void)visible, (void)loud, (void)early, (void)wanted, (void)update;
  if (c && events) return fail(c, "%s", "This FMU has no event mode in co-simulation.");
  if (c && count) return fail(c, "%s", "This FMU gives no values within a step.");
  return c ? fill(c, name, token, resources, 0, 0) : 0;
}

FMI fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                   fmi3Boolean loud, fmi3InstanceEnvironment environment,
                                                   fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
                                                   fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
  Instance *c = new_instance(environment, log);
  (void)name, (void)token, (void)resources, (void)visible, (void)loud, (void)update, (void)lock, (void)unlock;
  return c ? fail(c, "%s", "This FMU is not for scheduled execution.") : 0;
}

FMI void fmi3FreeInstance(fmi3Instance instance) { free_instance((Instance *)instance); }

/* the instance of a call, which ends here where it may not be called now */
#define ENTER3(phases, call)                   \
  Instance *c = (Instance *)instance;          \
  if (!allowed(c, phases, call)) return fmi3Error

FMI fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[]) {
  ENTER3(ANY, "fmi3SetDebugLogging");
  (void)on, (void)count, (void)categories;
  return fmi3OK;
}

FMI fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean limited, fmi3Float64 tolerance,
                                           fmi3Float64 start, fmi3Boolean ends, fmi3Float64 end) {
  ENTER3(INSTANTIATED, "fmi3EnterInitializationMode");
  (void)limited, (void)tolerance, (void)ends, (void)end;
  c->now.time = start;
  c->now.phase = INITIALIZING;
  return fmi3OK;
}

FMI fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
  ENTER3(INITIALIZING, "fmi3ExitInitializationMode");
  end_initialization(c);
  return fmi3OK;
}

FMI fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
  ENTER3(CONTINUOUS, "fmi3EnterEventMode");
  c->now.phase = EVENT;
  return fmi3OK;
}

FMI fmi3Status fmi3Terminate(fmi3Instance instance) {
  ENTER3(RUNNING, "fmi3Terminate");
  c->now.phase = TERMINATED;
  return fmi3OK;
}

FMI fmi3Status fmi3Reset(fmi3Instance instance) {
  ENTER3(ANY, "fmi3Reset");
  reset(c);
  return fmi3OK;
}

FMI fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference which[], size_t count, fmi3Float64 values[], size_t room) {
  ENTER3(INITIALIZING | RUNNING | TERMINATED, "fmi3GetFloat64");
  if (room != count) return (fmi3Status)refuse(c, "All variables are scalars: there must be a value for each reference.");
  return (fmi3Status)get_reals(c, which, count, values);
}

FMI fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference which[], size_t count, const fmi3Float64 values[],
                              size_t room) {
  ENTER3(INSTANTIATED | INITIALIZING | RUNNING, "fmi3SetFloat64");
  if (room != count) return (fmi3Status)refuse(c, "All variables are scalars: there must be a value for each reference.");
  return (fmi3Status)set_reals(c, which, count, values);
}

FMI fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference which[], size_t count, fmi3Boolean values[], size_t room) {
  size_t i;
  ENTER3(INITIALIZING | RUNNING | TERMINATED, "fmi3GetBoolean");
  if (room != count || (count && (!which || !values))) return (fmi3Status)refuse(c, "Boolean values need references and room for values.");
  for (i = 0; i < count; i++) {
    if (which[i] < FLAGS3 || which[i] > FLAGS3 + 2) return (fmi3Status)refuse(c, "There is no Boolean variable of this reference.");
    values[i] = flag_of(c, which[i] - FLAGS3) != 0;
  }
  return fmi3OK;
}

#if defined(__GNUC__) || defined(__clang__)
#define UNUSED __attribute__((unused))
#else
#define UNUSED
#endif

/* functions of variables that no body has: nothing is all that may be asked for */
#define NOTHING(name, why, ...)                                                                                \
  FMI fmi3Status name(fmi3Instance instance, const fmi3ValueReference which[], size_t count, __VA_ARGS__) {     \
    ENTER3(ANY, #name);                                                                                         \
    (void)which;                                                                                                \
    return count ? (fmi3Status)refuse(c, why) : fmi3OK;                                                         \
  }
#define NO_TYPE "There is no variable of this type and reference."
#define NO_CLOCK "There are no clocks."
#define NO_VALUES(kind) \
  NOTHING(fmi3Get##kind, NO_TYPE, fmi3##kind values[] UNUSED, size_t room UNUSED) \
  NOTHING(fmi3Set##kind, NO_TYPE, const fmi3##kind values[] UNUSED, size_t room UNUSED)
NO_VALUES(Float32)
NO_VALUES(Int8)
NO_VALUES(UInt8)
NO_VALUES(Int16)
NO_VALUES(UInt16)
NO_VALUES(Int32)
NO_VALUES(UInt32)
NO_VALUES(Int64)
NO_VALUES(UInt64)
NO_VALUES(String)
NOTHING(fmi3SetBoolean, NO_TYPE, const fmi3Boolean values[] UNUSED, size_t room UNUSED)
NOTHING(fmi3GetBinary, NO_TYPE, size_t sizes[] UNUSED, fmi3Binary values[] UNUSED, size_t room UNUSED)
NOTHING(fmi3SetBinary, NO_TYPE, const size_t sizes[] UNUSED, const fmi3Binary values[] UNUSED, size_t room UNUSED)
NOTHING(fmi3GetClock, NO_CLOCK, fmi3Clock values[] UNUSED)
NOTHING(fmi3SetClock, NO_CLOCK, const fmi3Clock values[] UNUSED)
NOTHING(fmi3GetIntervalDecimal, NO_CLOCK, fmi3Float64 intervals[] UNUSED, fmi3IntervalQualifier qualifiers[] UNUSED)
NOTHING(fmi3GetIntervalFraction, NO_CLOCK, fmi3UInt64 counters[] UNUSED, fmi3UInt64 resolutions[] UNUSED,
        fmi3IntervalQualifier qualifiers[] UNUSED)
NOTHING(fmi3GetShiftDecimal, NO_CLOCK, fmi3Float64 shifts[] UNUSED)
NOTHING(fmi3GetShiftFraction, NO_CLOCK, fmi3UInt64 counters[] UNUSED, fmi3UInt64 resolutions[] UNUSED)
NOTHING(fmi3SetIntervalDecimal, NO_CLOCK, const fmi3Float64 intervals[] UNUSED)
NOTHING(fmi3SetIntervalFraction, NO_CLOCK, const fmi3UInt64 counters[] UNUSED, const fmi3UInt64 resolutions[] UNUSED)
NOTHING(fmi3SetShiftDecimal, NO_CLOCK, const fmi3Float64 shifts[] UNUSED)
NOTHING(fmi3SetShiftFraction, NO_CLOCK, const fmi3UInt64 counters[] UNUSED, const fmi3UInt64 resolutions[] UNUSED)
NOTHING(fmi3GetOutputDerivatives, "Outputs have no derivatives by time.", const fmi3Int32 orders[] UNUSED,
        fmi3Float64 values[] UNUSED, size_t room UNUSED)

/* functions that no body has a use for */
#define REFUSED(name, why, ...)                            \
  FMI fmi3Status name(fmi3Instance instance __VA_ARGS__) { \
    ENTER3(ANY, #name);                                    \
    return (fmi3Status)refuse(c, why);                     \
  }
#define COMMA ,
REFUSED(fmi3EnterConfigurationMode, "There are no structural parameters.", )
REFUSED(fmi3ExitConfigurationMode, "There are no structural parameters.", )
REFUSED(fmi3EvaluateDiscreteStates, "There are no discrete states to be evaluated.", )
REFUSED(fmi3EnterStepMode, "This FMU has no event mode in co-simulation: it is in step mode.", )
REFUSED(fmi3ActivateModelPartition, "This FMU is not for scheduled execution.",
        COMMA fmi3ValueReference clock UNUSED COMMA fmi3Float64 time UNUSED)
REFUSED(fmi3GetNumberOfVariableDependencies, "Dependencies stand in the model description.",
        COMMA fmi3ValueReference which UNUSED COMMA size_t *count UNUSED)
REFUSED(fmi3GetVariableDependencies, "Dependencies stand in the model description.",
        COMMA fmi3ValueReference which UNUSED COMMA size_t elements[] UNUSED COMMA fmi3ValueReference others[] UNUSED COMMA
        size_t of_others[] UNUSED COMMA fmi3DependencyKind kinds[] UNUSED COMMA size_t count UNUSED)
REFUSED(fmi3GetAdjointDerivative, "There are directional derivatives, but no adjoint ones.",
        COMMA const fmi3ValueReference unknown[] UNUSED COMMA size_t unknowns UNUSED COMMA
        const fmi3ValueReference known[] UNUSED COMMA size_t knowns UNUSED COMMA const fmi3Float64 seed[] UNUSED COMMA
        size_t seeds UNUSED COMMA fmi3Float64 values[] UNUSED COMMA size_t room UNUSED)

FMI fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) {
  ENTER3(ANY, "fmi3GetFMUState");
  return (fmi3Status)get_moment(c, state);
}

FMI fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) {
  ENTER3(ANY, "fmi3SetFMUState");
  return (fmi3Status)set_moment(c, state);
}

FMI fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) {
  ENTER3(ANY, "fmi3FreeFMUState");
  if (!state) return (fmi3Status)refuse(c, "There is no state to free.");
  free(*state);
  *state = 0;
  return fmi3OK;
}

FMI fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size) {
  ENTER3(ANY, "fmi3SerializedFMUStateSize");
  if (!state || !size) return (fmi3Status)refuse(c, "A size is of a state, and needs a place.");
  *size = moment_size(c);
  return fmi3OK;
}

FMI fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  ENTER3(ANY, "fmi3SerializeFMUState");
  return (fmi3Status)write_moment(c, state, bytes, size);
}

FMI fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
  ENTER3(ANY, "fmi3DeserializeFMUState");
  return (fmi3Status)read_moment(c, bytes, size, state);
}

FMI fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknown[], size_t unknowns,
                                            const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[],
                                            size_t seeds, fmi3Float64 values[], size_t room) {
  ENTER3(INITIALIZING | RUNNING | TERMINATED, "fmi3GetDirectionalDerivative");
  if (seeds != knowns || room != unknowns) return (fmi3Status)refuse(c, "All variables are scalars: there must be a number for each reference.");
  return (fmi3Status)directional(c, unknown, unknowns, known, knowns, seed, values);
}

FMI fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
                                        fmi3Boolean *states, fmi3Boolean *timed, fmi3Float64 *time) {
  ENTER3(EVENT, "fmi3UpdateDiscreteStates");
  if (!again || !end || !nominals || !states || !timed || !time) return (fmi3Status)refuse(c, "News of an event need places.");
  *again = *end = *nominals = *states = *timed = 0;
  *time = 0.0;
  return fmi3OK;
}

FMI fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
  ENTER3(EVENT, "fmi3EnterContinuousTimeMode");
  begin_continuous(c);
  return fmi3OK;
}

FMI fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean final, fmi3Boolean *event, fmi3Boolean *end) {
  ENTER3(CONTINUOUS, "fmi3CompletedIntegratorStep");
  (void)final;
  if (!event || !end) return (fmi3Status)refuse(c, "News of a step need places.");
  *event = needs_event(c) != 0;
  *end = 0;
  return fmi3OK;
}

FMI fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
  ENTER3(EVENT | CONTINUOUS, "fmi3SetTime");
  c->now.time = time;
  return fmi3OK;
}

FMI fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 values[], size_t count) {
  ENTER3(CONTINUOUS, "fmi3SetContinuousStates");
  return (fmi3Status)set_states(c, values, count);
}

FMI fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 values[], size_t count) {
  ENTER3(SOLVER, "fmi3GetContinuousStateDerivatives");
  return (fmi3Status)get_rates(c, values, count);
}

FMI fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 values[], size_t count) {
  ENTER3(SOLVER, "fmi3GetContinuousStates");
  return (fmi3Status)get_states(c, values, count);
}

FMI fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 values[], size_t count) {
  ENTER3(SOLVER | INSTANTIATED, "fmi3GetNominalsOfContinuousStates");
  return (fmi3Status)get_nominals(c, values, count);
}

FMI fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 values[], size_t count) {
  ENTER3(SOLVER, "fmi3GetEventIndicators");
  (void)values;
  return count ? (fmi3Status)refuse(c, "There are no event indicators.") : fmi3OK;
}

FMI fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count) {
  ENTER3(ANY, "fmi3GetNumberOfEventIndicators");
  if (!count) return (fmi3Status)refuse(c, "A number needs a place.");
  *count = 0;
  return fmi3OK;
}

FMI fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count) {
  ENTER3(ANY, "fmi3GetNumberOfContinuousStates");
  if (!count) return (fmi3Status)refuse(c, "A number needs a place.");
  *count = (size_t)c->states;
  return fmi3OK;
}

FMI fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_return, fmi3Boolean *event,
                          fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached) {
  int status;
  ENTER3(STEPPING, "fmi3DoStep");
  (void)no_return;
  if (!event || !end || !early || !reached) return (fmi3Status)refuse(c, "News of a step need places.");
  *event = *end = *early = 0;
  status = take_step(c, time, step);
  *reached = c->now.time;
  return (fmi3Status)status;
}
