/* The functions of FMI 2.0 in legal and illegal orders; a part of fmu_host.c. */
static void logged2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
  (void)environment, (void)name, (void)category, (void)text;
  if (status == fmi2Warning) warnings++;
  if (status == fmi2Error) errors++;
}

static int exchange2(const char *guid, const char *resources, const fmi2CallbackFunctions *calls, int count) {
  fmi2Component c = fmi2Instantiate("exchange", fmi2ModelExchange, guid, resources, calls, 0, 1);
  const fmi2ValueReference inputs[3] = {0, 1, 2}, outputs[4] = {3, 4, 5, 6};
  const double place[3] = {0.001, -0.002, 0.003}, seed[3] = {1.0, 0.0, 0.0};
  const double away[3] = {10.0, 0.0, 10.0};
  double values[4], slopes[4], *states = (double *)calloc(4 * (size_t)count, sizeof(double)), *rates = states + count;
  double *nominals = rates + count, *again = nominals + count;
  fmi2EventInfo info;
  fmi2Boolean event, end;
  fmi2FMUstate kept = 0;
  int i;
  if (!c) return 1;
  EXPECT(fmi2DoStep(c, 0.0, 0.001, 1), fmi2Error);
  EXPECT(fmi2GetReal(c, outputs, 4, values), fmi2Error);
  EXPECT(fmi2EnterContinuousTimeMode(c), fmi2Error);
  EXPECT(fmi2SetupExperiment(c, 0, 0.0, 0.0, 1, 1.0), fmi2OK);
  EXPECT(fmi2EnterInitializationMode(c), fmi2OK);
  EXPECT(fmi2EnterInitializationMode(c), fmi2Error);
  EXPECT(fmi2SetReal(c, inputs, 3, place), fmi2OK);
  EXPECT(fmi2GetReal(c, outputs, 4, values), fmi2OK);
  EXPECT(fmi2ExitInitializationMode(c), fmi2OK);
  EXPECT(fmi2NewDiscreteStates(c, &info), fmi2OK);
  EXPECT(info.newDiscreteStatesNeeded, 0);
  EXPECT(fmi2EnterContinuousTimeMode(c), fmi2OK);
  EXPECT(fmi2SetTime(c, 0.5), fmi2OK);
  EXPECT(fmi2GetDirectionalDerivative(c, outputs, 4, inputs, 3, seed, slopes), fmi2OK);
  EXPECT(fabs(slopes[3] + values[0]) <= (count ? 1e-6 : 0.0) * (1.0 + fabs(values[0])), 1);
  EXPECT(fmi2GetDirectionalDerivative(c, inputs, 1, inputs, 3, seed, slopes), fmi2Error);
  EXPECT(fmi2GetContinuousStates(c, states, (size_t)count), fmi2OK);
  EXPECT(fmi2GetDerivatives(c, rates, (size_t)count), fmi2OK);
  EXPECT(fmi2GetDerivatives(c, rates, (size_t)count + 1), fmi2Error);
  EXPECT(fmi2GetContinuousStates(c, 0, 1), fmi2Error);
  EXPECT(fmi2GetNominalsOfContinuousStates(c, nominals, (size_t)count), fmi2OK);
  for (i = 0; i < count; i++) {
    EXPECT(nominals[i] > 0.0, 1);
    states[i] += 0.01 * nominals[i];
  }
  EXPECT(fmi2SetContinuousStates(c, states, (size_t)count), fmi2OK);
  EXPECT(fmi2SetContinuousStates(c, states, (size_t)count + 1), fmi2Error);
  EXPECT(fmi2GetDerivatives(c, rates, (size_t)count), fmi2OK);
  EXPECT(fmi2GetFMUstate(c, &kept), fmi2OK);
  for (i = 0; i < count; i++) states[i] += 0.01 * nominals[i];
  EXPECT(fmi2SetContinuousStates(c, states, (size_t)count), fmi2OK);
  EXPECT(fmi2SetFMUstate(c, kept), fmi2OK);
  EXPECT(fmi2GetDerivatives(c, again, (size_t)count), fmi2OK);
  EXPECT(memcmp(rates, again, (size_t)count * sizeof(double)), 0);
  EXPECT(fmi2FreeFMUstate(c, &kept), fmi2OK);
  EXPECT(fmi2GetEventIndicators(c, 0, 0), fmi2OK);
  EXPECT(fmi2GetEventIndicators(c, values, 1), fmi2Error);
  EXPECT(fmi2CompletedIntegratorStep(c, 1, &event, &end), fmi2OK);
  EXPECT(event, 0);
  EXPECT(fmi2SetReal(c, inputs, 3, away), fmi2OK);
  EXPECT(fmi2CompletedIntegratorStep(c, 1, &event, &end), fmi2OK);
  EXPECT(event, 1); /* the flags change at events alone */
  EXPECT(fmi2EnterEventMode(c), fmi2OK);
  EXPECT(fmi2EnterEventMode(c), fmi2Error);
  EXPECT(fmi2Terminate(c), fmi2OK);
  EXPECT(fmi2SetReal(c, inputs, 3, place), fmi2Error);
  EXPECT(fmi2Reset(c), fmi2OK);
  EXPECT(fmi2EnterInitializationMode(c), fmi2OK);
  fmi2FreeInstance(c);
  free(states);
  return 0;
}

static int simulation2(const char *guid, const char *resources, const fmi2CallbackFunctions *calls) {
  fmi2Component c = fmi2Instantiate("simulation", fmi2CoSimulation, guid, resources, calls, 0, 1);
  const fmi2ValueReference inputs[3] = {0, 1, 2}, outputs[3] = {3, 4, 5}, strange[1] = {99999}, output[1] = {3};
  const double place[3] = {0.001, -0.002, 0.003}, far[3] = {10.0, 0.0, -0.03}, none[3] = {0.0 / 0.0, 0.0, 0.0};
  double values[3], again[3];
  fmi2Boolean flags[3];
  fmi2FMUstate state = 0, other = 0;
  fmi2Byte bytes[1 << 16];
  size_t size = 0;
  int i;
  if (!c) return 1;
  EXPECT(fmi2Terminate(c), fmi2Error);
  EXPECT(fmi2EnterInitializationMode(c), fmi2OK);
  EXPECT(fmi2SetReal(c, inputs, 3, place), fmi2OK);
  EXPECT(fmi2ExitInitializationMode(c), fmi2OK);
  EXPECT(fmi2SetupExperiment(c, 0, 0.0, 0.0, 1, 1.0), fmi2Error);
  EXPECT(fmi2SetReal(c, strange, 1, place), fmi2Error);
  EXPECT(fmi2SetReal(c, output, 1, place), fmi2Error);
  EXPECT(fmi2GetReal(c, strange, 1, values), fmi2Error);
  EXPECT(fmi2GetBoolean(c, strange, 1, flags), fmi2Error);
  EXPECT(fmi2GetString(c, strange, 0, 0), fmi2OK);
  EXPECT(fmi2GetInteger(c, strange, 1, 0), fmi2Error);
  for (i = 0; i < 20; i++) EXPECT(fmi2DoStep(c, 0.001 * i, 0.001, 1), fmi2OK);
  EXPECT(fmi2GetFMUstate(c, &state), fmi2OK);
  for (i = 0; i < 20; i++) EXPECT(fmi2DoStep(c, 0.02 + 0.001 * i, 0.001, 1), fmi2OK);
  EXPECT(fmi2GetReal(c, outputs, 3, values), fmi2OK);
  EXPECT(fmi2SerializedFMUstateSize(c, state, &size), fmi2OK);
  EXPECT(size <= sizeof bytes, 1);
  EXPECT(fmi2SerializeFMUstate(c, state, bytes, size - 1), fmi2Error);
  EXPECT(fmi2SerializeFMUstate(c, state, bytes, size), fmi2OK);
  EXPECT(fmi2DeSerializeFMUstate(c, bytes, size - 1, &other), fmi2Error);
  EXPECT(fmi2DeSerializeFMUstate(c, bytes, size, &other), fmi2OK);
  EXPECT(fmi2SetFMUstate(c, other), fmi2OK);
  for (i = 0; i < 20; i++) EXPECT(fmi2DoStep(c, 0.02 + 0.001 * i, 0.001, 1), fmi2OK);
  EXPECT(fmi2GetReal(c, outputs, 3, again), fmi2OK);
  EXPECT(memcmp(values, again, sizeof values), 0);
  EXPECT(fmi2GetDirectionalDerivative(c, outputs, 3, inputs, 3, place, again), fmi2OK);
  EXPECT(fmi2GetReal(c, outputs, 3, again), fmi2OK);
  EXPECT(memcmp(values, again, sizeof values), 0); /* asking for derivatives changes nothing */
  EXPECT(fmi2FreeFMUstate(c, &state), fmi2OK);
  EXPECT(fmi2FreeFMUstate(c, &other), fmi2OK);
  EXPECT(state == 0, 1);
  EXPECT(fmi2DoStep(c, 0.0, -1.0, 1), fmi2Error);
  EXPECT(fmi2EnterEventMode(c), fmi2Error);
  EXPECT(fmi2CancelStep(c), fmi2Error);
  warnings = 0;
  EXPECT(fmi2SetReal(c, inputs, 3, far), fmi2OK);
  for (i = 0; i < 5; i++) EXPECT(fmi2DoStep(c, 0.1, 0.001, 1), fmi2OK);
  EXPECT(fmi2SetReal(c, inputs, 3, none), fmi2OK);
  EXPECT(fmi2DoStep(c, 0.1, 0.001, 1), fmi2Discard);
  EXPECT(fmi2GetReal(c, outputs, 3, values), fmi2OK);
  EXPECT(values[0] == 0.0 && values[1] == 0.0 && values[2] == 0.0, 1); /* nobody is pushed */
  EXPECT(fmi2GetBoolean(c, inputs, 1, flags), fmi2OK);
  EXPECT(flags[0], 0);
  EXPECT(warnings <= 2, 1); /* once an excursion and once of steps that are long there, never an error */
  EXPECT(fmi2Terminate(c), fmi2OK);
  EXPECT(fmi2GetReal(c, outputs, 3, values), fmi2OK);
  fmi2FreeInstance(c);
  return 0;
}

static int orders2(const char *guid, const char *resources, int states) {
  const fmi2CallbackFunctions calls = {logged2, calloc, free, 0, 0};
  EXPECT(fmi2Instantiate("x", fmi2CoSimulation, "0", resources, &calls, 0, 0) == 0, 1);
  EXPECT(fmi2Instantiate("x", fmi2CoSimulation, guid, "file:///nowhere", &calls, 0, 0) == 0, 1);
  EXPECT(fmi2Instantiate("x", fmi2CoSimulation, guid, "http://x/y", &calls, 0, 0) == 0, 1);
  EXPECT(fmi2Instantiate("", fmi2CoSimulation, guid, resources, &calls, 0, 0) == 0, 1);
  EXPECT(fmi2Instantiate("x", fmi2CoSimulation, 0, resources, &calls, 0, 0) == 0, 1);
  EXPECT(fmi2DoStep(0, 0.0, 0.1, 1), fmi2Error);
  EXPECT(fmi2GetReal(0, 0, 0, 0), fmi2Error);
  if (states >= 0 && exchange2(guid, resources, &calls, states)) return 1;
  if (states < 0) EXPECT(fmi2Instantiate("x", fmi2ModelExchange, guid, resources, &calls, 0, 0) == 0, 1);
  return simulation2(guid, resources, &calls);
}
