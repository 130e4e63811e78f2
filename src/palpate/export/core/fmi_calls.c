/* Calls of FMI around fmi_body.c, each in one row: name, arguments, phases in which it may be called, what it does.
 *
 * Calls of which version 2.0 and 3.0 differ in more than the name follow in fmi2.c and fmi3.c.
 */
#if defined(__GNUC__) || defined(__clang__)
#define UNUSED __attribute__((unused))
#else
#define UNUSED
#endif

#define CALL(status, name, arguments, phases, ...)        \
  FMI status name arguments {                             \
    Instance *c = (Instance *)instance;                   \
    if (!allowed(c, phases, #name)) return (status)ERROR; \
    __VA_ARGS__                                           \
  }

#define BOTH(two, three, arguments, phases, ...)              \
  CALL(fmi2Status, fmi2##two, arguments, phases, __VA_ARGS__) \
  CALL(fmi3Status, fmi3##three, arguments, phases, __VA_ARGS__)
#define SAME(name, arguments, phases, ...) BOTH(name, name, arguments, phases, __VA_ARGS__)

#define READABLE (INITIALIZING | RUNNING | TERMINATED)
#define WRITABLE (INSTANTIATED | INITIALIZING | RUNNING)
#define NO_TYPE "There is no variable of this type and reference."
#define NO_RATES "Outputs have no derivatives by time."

/* what calls do whose Booleans are of another type in each version */
#define GET_FLAGS(first)                                                                                   \
  size_t i;                                                                                                \
  if (count && (!which || !values)) return refuse(c, "Boolean values need references and room for values."); \
  for (i = 0; i < count; i++) {                                                                            \
    if (which[i] - (first) > 2u) return refuse(c, "There is no Boolean variable of this reference.");      \
    values[i] = flag_of(c, which[i] - (first)) != 0;                                                       \
  }                                                                                                        \
  return OK;
#define COMPLETE_STEP                                                  \
  if (!event || !end) return refuse(c, "News of a step need places."); \
  *event = needs_event(c) != 0;                                        \
  *end = 0;                                                            \
  return OK;

FMI void fmi2FreeInstance(void *instance) { free_instance((Instance *)instance); }
FMI void fmi3FreeInstance(void *instance) { free_instance((Instance *)instance); }

SAME(ExitInitializationMode, (void *instance), INITIALIZING, end_initialization(c); return OK;)
SAME(Terminate, (void *instance), RUNNING, c->now.phase = TERMINATED; return OK;)
SAME(Reset, (void *instance), ANY, reset(c); return OK;)
BOTH(GetFMUstate, GetFMUState, (void *instance, void **state), ANY, return get_moment(c, state);)
BOTH(SetFMUstate, SetFMUState, (void *instance, void *state), ANY, return set_moment(c, state);)
BOTH(FreeFMUstate, FreeFMUState, (void *instance, void **state), ANY,
     if (!state) return refuse(c, "There is no state to free.");
     free(*state);
     *state = 0;
     return OK;)
BOTH(SerializedFMUstateSize, SerializedFMUStateSize, (void *instance, void *state, size_t *size), ANY,
     if (!state || !size) return refuse(c, "A size is of a state, and needs a place.");
     *size = moment_size(c);
     return OK;)
SAME(EnterEventMode, (void *instance), CONTINUOUS, c->now.phase = EVENT; return OK;)
SAME(EnterContinuousTimeMode, (void *instance), EVENT, begin_continuous(c); return OK;)
SAME(SetTime, (void *instance, double time), EVENT | CONTINUOUS, c->now.time = time; return OK;)
SAME(SetContinuousStates, (void *instance, const double values[], size_t count), CONTINUOUS,
     return set_states(c, values, count);)
BOTH(GetDerivatives, GetContinuousStateDerivatives, (void *instance, double values[], size_t count), SOLVER,
     return get_rates(c, values, count);)
SAME(GetContinuousStates, (void *instance, double values[], size_t count), SOLVER, return get_states(c, values, count);)
SAME(GetNominalsOfContinuousStates, (void *instance, double values[], size_t count), SOLVER | INSTANTIATED,
     return get_nominals(c, values, count);)
SAME(GetEventIndicators, (void *instance, double values[] UNUSED, size_t count), SOLVER,
     return count ? refuse(c, "There are no event indicators.") : OK;)
