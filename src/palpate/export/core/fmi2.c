/* FMI 2.0 for co-simulation and model exchange, beside fmi_calls.c. */
static void tell2(Instance *c, int status, const char *category, const char *text) {
  ((fmi2CallbackLogger)c->logger)(c->environment, c->name, (fmi2Status)status, category, "%s", text);
}

FMI const char *fmi2GetTypesPlatform(void) { return "default"; }

FMI const char *fmi2GetVersion(void) { return "2.0"; }

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

#define CALL2(name, arguments, phases, ...) CALL(fmi2Status, name, arguments, phases, __VA_ARGS__)
#define REFERENCES const fmi2ValueReference which[] UNUSED, size_t count

CALL2(fmi2SetDebugLogging,
      (fmi2Component instance, fmi2Boolean on UNUSED, size_t count UNUSED, const fmi2String categories[] UNUSED),
      ANY, return OK;)
CALL2(fmi2SetupExperiment,
      (fmi2Component instance, fmi2Boolean limited UNUSED, fmi2Real tolerance UNUSED, fmi2Real start,
       fmi2Boolean ends UNUSED, fmi2Real end UNUSED),
      INSTANTIATED, c->now.time = start; return OK;)
CALL2(fmi2EnterInitializationMode, (fmi2Component instance), INSTANTIATED, c->now.phase = INITIALIZING; return OK;)
CALL2(fmi2GetReal, (fmi2Component instance, REFERENCES, fmi2Real values[]), READABLE,
      return get_reals(c, which, count, values);)
CALL2(fmi2SetReal, (fmi2Component instance, REFERENCES, const fmi2Real values[]), WRITABLE,
      return set_reals(c, which, count, values);)
CALL2(fmi2GetBoolean, (fmi2Component instance, REFERENCES, fmi2Boolean values[]), READABLE,
      GET_FLAGS(0))

#define NONE_OF(name, kind)                                              \
  CALL2(name, (fmi2Component instance, REFERENCES, kind values[] UNUSED), ANY, \
        return count ? refuse(c, NO_TYPE) : OK;)
NONE_OF(fmi2GetInteger, fmi2Integer)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const fmi2Integer)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)

CALL2(fmi2SerializeFMUstate, (fmi2Component instance, fmi2FMUstate state, fmi2Byte bytes[], size_t size), ANY,
      return write_moment(c, state, bytes, size);)
CALL2(fmi2DeSerializeFMUstate, (fmi2Component instance, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state), ANY,
      return read_moment(c, bytes, size, state);)
CALL2(fmi2GetDirectionalDerivative,
      (fmi2Component instance, const fmi2ValueReference unknown[], size_t unknowns, const fmi2ValueReference known[],
       size_t knowns, const fmi2Real seed[], fmi2Real values[]),
      READABLE, return directional(c, unknown, unknowns, known, knowns, seed, values);)
CALL2(fmi2NewDiscreteStates, (fmi2Component instance, fmi2EventInfo *info), EVENT,
      if (!info) return refuse(c, "News of an event need a place.");
      memset(info, 0, sizeof *info);
      return OK;)
CALL2(fmi2CompletedIntegratorStep,
      (fmi2Component instance, fmi2Boolean final UNUSED, fmi2Boolean *event, fmi2Boolean *end), CONTINUOUS,
      COMPLETE_STEP)
CALL2(fmi2SetRealInputDerivatives,
      (fmi2Component instance, REFERENCES, const fmi2Integer orders[] UNUSED, const fmi2Real values[] UNUSED), ANY,
      return count ? refuse(c, "Inputs are not extrapolated.") : OK;)
CALL2(fmi2GetRealOutputDerivatives,
      (fmi2Component instance, REFERENCES, const fmi2Integer orders[] UNUSED, fmi2Real values[] UNUSED), ANY,
      return count ? refuse(c, NO_RATES) : OK;)
CALL2(fmi2DoStep, (fmi2Component instance, fmi2Real time, fmi2Real step, fmi2Boolean no_return UNUSED), STEPPING,
      return take_step(c, time, step);)
CALL2(fmi2CancelStep, (fmi2Component instance), ANY, return refuse(c, "No step is pending.");)

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
