/* FMI 3.0 for co-simulation and model exchange, beside fmi_calls.c.
 *
 * All functions of the standard are here, because importers load none of them where one is missing. What a body has no
 * use for (clocks, other types of variables, scheduled execution, adjoint derivatives) is refused with a reason.
 */
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

#define CALL3(name, arguments, phases, ...) CALL(fmi3Status, name, arguments, phases, __VA_ARGS__)
#define GIVE_NUMBER(number)                                  \
  if (!count) return refuse(c, "A number needs a place."); \
  *count = number;                                         \
  return OK;
#define ONE_EACH(count, room, noun) \
  if (room != count) return refuse(c, "All variables are scalars: there must be a " noun " for each reference.");

CALL3(fmi3SetDebugLogging,
      (fmi3Instance instance, fmi3Boolean on UNUSED, size_t count UNUSED, const fmi3String categories[] UNUSED),
      ANY, return OK;)
CALL3(fmi3EnterInitializationMode,
      (fmi3Instance instance, fmi3Boolean limited UNUSED, fmi3Float64 tolerance UNUSED, fmi3Float64 start,
       fmi3Boolean ends UNUSED, fmi3Float64 end UNUSED),
      INSTANTIATED, c->now.time = start; c->now.phase = INITIALIZING; return OK;)
CALL3(fmi3GetFloat64,
      (fmi3Instance instance, const fmi3ValueReference which[], size_t count, fmi3Float64 values[], size_t room),
      READABLE, ONE_EACH(count, room, "value") return get_reals(c, which, count, values);)
CALL3(fmi3SetFloat64,
      (fmi3Instance instance, const fmi3ValueReference which[], size_t count, const fmi3Float64 values[], size_t room),
      WRITABLE, ONE_EACH(count, room, "value") return set_reals(c, which, count, values);)
CALL3(fmi3GetBoolean,
      (fmi3Instance instance, const fmi3ValueReference which[], size_t count, fmi3Boolean values[], size_t room),
      READABLE, ONE_EACH(count, room, "value") GET_FLAGS(FLAGS3))

/* functions of variables that no body has: nothing is all that may be asked for */
#define NOTHING(name, why, ...)                                                                              \
  CALL3(name, (fmi3Instance instance, const fmi3ValueReference which[] UNUSED, size_t count, __VA_ARGS__), ANY, \
        return count ? refuse(c, why) : OK;)
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
NOTHING(fmi3GetOutputDerivatives, NO_RATES, const fmi3Int32 orders[] UNUSED,
        fmi3Float64 values[] UNUSED, size_t room UNUSED)

/* functions that no body has a use for */
#define REFUSED(name, why, ...) CALL3(name, (fmi3Instance instance __VA_ARGS__), ANY, return refuse(c, why);)
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

CALL3(fmi3SerializeFMUState, (fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size), ANY,
      return write_moment(c, state, bytes, size);)
CALL3(fmi3DeserializeFMUState, (fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state), ANY,
      return read_moment(c, bytes, size, state);)
CALL3(fmi3GetDirectionalDerivative,
      (fmi3Instance instance, const fmi3ValueReference unknown[], size_t unknowns, const fmi3ValueReference known[],
       size_t knowns, const fmi3Float64 seed[], size_t seeds, fmi3Float64 values[], size_t room),
      READABLE, ONE_EACH(knowns, seeds, "number") ONE_EACH(unknowns, room, "number")
      return directional(c, unknown, unknowns, known, knowns, seed, values);)
CALL3(fmi3UpdateDiscreteStates,
      (fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals, fmi3Boolean *states,
       fmi3Boolean *timed, fmi3Float64 *time),
      EVENT,
      if (!again || !end || !nominals || !states || !timed || !time) return refuse(c, "News of an event need places.");
      *again = *end = *nominals = *states = *timed = 0;
      *time = 0.0;
      return OK;)
CALL3(fmi3CompletedIntegratorStep,
      (fmi3Instance instance, fmi3Boolean final UNUSED, fmi3Boolean *event, fmi3Boolean *end), CONTINUOUS,
      COMPLETE_STEP)
CALL3(fmi3GetNumberOfEventIndicators, (fmi3Instance instance, size_t *count), ANY, GIVE_NUMBER(0))
CALL3(fmi3GetNumberOfContinuousStates, (fmi3Instance instance, size_t *count), ANY, GIVE_NUMBER((size_t)c->states))
CALL3(fmi3DoStep,
      (fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_return UNUSED, fmi3Boolean *event,
       fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *reached),
      STEPPING, int status;
      if (!event || !end || !early || !reached) return refuse(c, "News of a step need places.");
      *event = *end = *early = 0;
      status = take_step(c, time, step);
      *reached = c->now.time;
      return (fmi3Status)status;)
