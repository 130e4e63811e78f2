/* FMI 2.0 for co-simulation and model exchange, around fmi_body.c; a host may have included the standard's headers. */
#ifndef fmi2FunctionTypes_h
typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
  fmi2CallbackLogger logger;
  void *(*allocateMemory)(size_t, size_t);
  void (*freeMemory)(void *);
  void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
  fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
  fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
  fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
  fmi2Real nextEventTime;
} fmi2EventInfo;
#endif

static void tell2(Instance *c, int status, const char *category, const char *text) {
  ((fmi2CallbackLogger)c->logger)(c->environment, c->name, (fmi2Status)status, category, "%s", text);
}

FMI const char *fmi2GetTypesPlatform(void) { return "default"; }

FMI const char *fmi2GetVersion(void) { return "2.0"; }

FMI void fmi2FreeInstance(fmi2Component component) { free_instance((Instance *)component); }

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                  const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean loud) {
  Instance *c = (Instance *)calloc(1, sizeof *c);
  (void)visible;
  (void)loud;
  if (!c) return 0;
  if (calls) {
    c->tell = tell2;
    c->logger = (void (*)(void))calls->logger;
    c->environment = calls->componentEnvironment;
  }
  return fill(c, name, guid, resources, 1, type == fmi2ModelExchange);
}

/* the instance of a call, which ends here where it may not be called now */
#define ENTER2(phases, call)                   \
  Instance *c = (Instance *)component;         \
  if (!allowed(c, phases, call)) return fmi2Error

FMI fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  ENTER2(ANY, "fmi2SetDebugLogging");
  (void)on, (void)count, (void)categories;
  return fmi2OK;
}

FMI fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean limited, fmi2Real tolerance, fmi2Real start,
                                   fmi2Boolean ends, fmi2Real end) {
  ENTER2(INSTANTIATED, "fmi2SetupExperiment");
  (void)limited, (void)tolerance, (void)ends, (void)end;
  c->now.time = start;
  return fmi2OK;
}

FMI fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  ENTER2(INSTANTIATED, "fmi2EnterInitializationMode");
  c->now.phase = INITIALIZING;
  return fmi2OK;
}

FMI fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
  ENTER2(INITIALIZING, "fmi2ExitInitializationMode");
  end_initialization(c);
  return fmi2OK;
}

FMI fmi2Status fmi2Terminate(fmi2Component component) {
  ENTER2(RUNNING, "fmi2Terminate");
  c->now.phase = TERMINATED;
  return fmi2OK;
}

FMI fmi2Status fmi2Reset(fmi2Component component) {
  ENTER2(ANY, "fmi2Reset");
  reset(c);
  return fmi2OK;
}

FMI fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, fmi2Real values[]) {
  ENTER2(INITIALIZING | RUNNING | TERMINATED, "fmi2GetReal");
  return (fmi2Status)get_reals(c, which, count, values);
}

FMI fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, const fmi2Real values[]) {
  ENTER2(INSTANTIATED | INITIALIZING | RUNNING, "fmi2SetReal");
  return (fmi2Status)set_reals(c, which, count, values);
}

FMI fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference which[], size_t count, fmi2Boolean values[]) {
  size_t i;
  ENTER2(INITIALIZING | RUNNING | TERMINATED, "fmi2GetBoolean");
  if (count && (!which || !values)) return (fmi2Status)refuse(c, "Boolean values need references and room for values.");
  for (i = 0; i < count; i++) {
    if (which[i] > 2) return (fmi2Status)refuse(c, "There is no Boolean variable of this reference.");
    values[i] = flag_of(c, which[i]);
  }
  return fmi2OK;
}

#define NONE_OF(name, kind)                                                                                                \
  FMI fmi2Status name(fmi2Component component, const fmi2ValueReference which[], size_t count, kind values[]) {            \
    ENTER2(ANY, #name);                                                                                                    \
    (void)which, (void)values;                                                                                             \
    return count ? (fmi2Status)refuse(c, "There is no variable of this type and reference.") : fmi2OK; \
  }
NONE_OF(fmi2GetInteger, fmi2Integer)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const fmi2Integer)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)

FMI fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
  ENTER2(ANY, "fmi2GetFMUstate");
  return (fmi2Status)get_moment(c, state);
}

FMI fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
  ENTER2(ANY, "fmi2SetFMUstate");
  return (fmi2Status)set_moment(c, state);
}

FMI fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
  ENTER2(ANY, "fmi2FreeFMUstate");
  if (!state) return (fmi2Status)refuse(c, "There is no state to free.");
  free(*state);
  *state = 0;
  return fmi2OK;
}

FMI fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size) {
  ENTER2(ANY, "fmi2SerializedFMUstateSize");
  if (!state || !size) return (fmi2Status)refuse(c, "A size is of a state, and needs a place.");
  *size = moment_size(c);
  return fmi2OK;
}

FMI fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  ENTER2(ANY, "fmi2SerializeFMUstate");
  return (fmi2Status)write_moment(c, state, bytes, size);
}

FMI fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  ENTER2(ANY, "fmi2DeSerializeFMUstate");
  return (fmi2Status)read_moment(c, bytes, size, state);
}

FMI fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[], size_t unknowns,
                                            const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[],
                                            fmi2Real values[]) {
  ENTER2(INITIALIZING | RUNNING | TERMINATED, "fmi2GetDirectionalDerivative");
  return (fmi2Status)directional(c, unknown, unknowns, known, knowns, seed, values);
}

FMI fmi2Status fmi2EnterEventMode(fmi2Component component) {
  ENTER2(CONTINUOUS, "fmi2EnterEventMode");
  c->now.phase = EVENT;
  return fmi2OK;
}

FMI fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info) {
  ENTER2(EVENT, "fmi2NewDiscreteStates");
  if (!info) return (fmi2Status)refuse(c, "News of an event need a place.");
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

FMI fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component) {
  ENTER2(EVENT, "fmi2EnterContinuousTimeMode");
  begin_continuous(c);
  return fmi2OK;
}

FMI fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean final, fmi2Boolean *event, fmi2Boolean *end) {
  ENTER2(CONTINUOUS, "fmi2CompletedIntegratorStep");
  (void)final;
  if (!event || !end) return (fmi2Status)refuse(c, "News of a step need places.");
  *event = needs_event(c);
  *end = 0;
  return fmi2OK;
}

FMI fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time) {
  ENTER2(EVENT | CONTINUOUS, "fmi2SetTime");
  c->now.time = time;
  return fmi2OK;
}

FMI fmi2Status fmi2SetContinuousStates(fmi2Component component, const fmi2Real values[], size_t count) {
  ENTER2(CONTINUOUS, "fmi2SetContinuousStates");
  return (fmi2Status)set_states(c, values, count);
}

FMI fmi2Status fmi2GetDerivatives(fmi2Component component, fmi2Real values[], size_t count) {
  ENTER2(SOLVER, "fmi2GetDerivatives");
  return (fmi2Status)get_rates(c, values, count);
}

FMI fmi2Status fmi2GetContinuousStates(fmi2Component component, fmi2Real values[], size_t count) {
  ENTER2(SOLVER, "fmi2GetContinuousStates");
  return (fmi2Status)get_states(c, values, count);
}

FMI fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component component, fmi2Real values[], size_t count) {
  ENTER2(SOLVER | INSTANTIATED, "fmi2GetNominalsOfContinuousStates");
  return (fmi2Status)get_nominals(c, values, count);
}

FMI fmi2Status fmi2GetEventIndicators(fmi2Component component, fmi2Real values[], size_t count) {
  ENTER2(SOLVER, "fmi2GetEventIndicators");
  (void)values;
  return count ? (fmi2Status)refuse(c, "There are no event indicators.") : fmi2OK;
}

FMI fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                           const fmi2Integer orders[], const fmi2Real values[]) {
  ENTER2(ANY, "fmi2SetRealInputDerivatives");
  (void)which, (void)orders, (void)values;
  return count ? (fmi2Status)refuse(c, "Inputs are not extrapolated.") : fmi2OK;
}

FMI fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                            const fmi2Integer orders[], fmi2Real values[]) {
  ENTER2(ANY, "fmi2GetRealOutputDerivatives");
  (void)which, (void)orders, (void)values;
  return count ? (fmi2Status)refuse(c, "Outputs have no derivatives by time.") : fmi2OK;
}

FMI fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean no_return) {
  ENTER2(STEPPING, "fmi2DoStep");
  (void)no_return;
  return (fmi2Status)take_step(c, time, step);
}

FMI fmi2Status fmi2CancelStep(fmi2Component component) {
  ENTER2(ANY, "fmi2CancelStep");
  return (fmi2Status)refuse(c, "No step is pending.");
}

FMI fmi2Status fmi2GetRealStatus(fmi2Component component, const fmi2StatusKind kind, fmi2Real *value) {
  Instance *c = (Instance *)component;
  if (!allowed(c, STEPPING | TERMINATED, "fmi2GetRealStatus") || !value || kind != fmi2LastSuccessfulTime) return fmi2Discard;
  *value = c->now.time;
  return fmi2OK;
}

#define NO_STATUS(name, kind)                                                                  \
  FMI fmi2Status name(fmi2Component component, const fmi2StatusKind of, kind *value) {         \
    (void)of, (void)value;                                                                     \
    return component ? fmi2Discard : fmi2Error;                                                \
  }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)
