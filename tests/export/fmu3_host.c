/* The functions of FMI 3.0 in legal and illegal orders; a part of fmu_host.c. */
static void logged3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text) {
  (void)environment, (void)category, (void)text;
  if (status == fmi3Warning) warnings++;
  if (status == fmi3Error) errors++;
}

/* what no body has a use for, with and without an instance: an error each, and a reason in the log */
static int refused3(fmi3Instance c) {
  const int before = errors;
  const fmi3ValueReference which[1] = {3};
#define NO_VALUE(kind)                                 \
  EXPECT(fmi3Get##kind(c, which, 1, 0, 1), fmi3Error); \
  EXPECT(fmi3Set##kind(c, which, 1, 0, 1), fmi3Error);
  NO_VALUE(Float32)
  NO_VALUE(Int8)
  NO_VALUE(UInt8)
  NO_VALUE(Int16)
  NO_VALUE(UInt16)
  NO_VALUE(Int32)
  NO_VALUE(UInt32)
  NO_VALUE(Int64)
  NO_VALUE(UInt64)
  NO_VALUE(String)
  EXPECT(fmi3SetBoolean(c, which, 1, 0, 1), fmi3Error);
  EXPECT(fmi3GetBinary(c, which, 1, 0, 0, 1), fmi3Error);
  EXPECT(fmi3SetBinary(c, which, 1, 0, 0, 1), fmi3Error);
  EXPECT(fmi3GetClock(c, which, 1, 0), fmi3Error);
  EXPECT(fmi3SetClock(c, which, 1, 0), fmi3Error);
  EXPECT(fmi3GetIntervalDecimal(c, which, 1, 0, 0), fmi3Error);
  EXPECT(fmi3GetIntervalFraction(c, which, 1, 0, 0, 0), fmi3Error);
  EXPECT(fmi3GetShiftDecimal(c, which, 1, 0), fmi3Error);
  EXPECT(fmi3GetShiftFraction(c, which, 1, 0, 0), fmi3Error);
  EXPECT(fmi3SetIntervalDecimal(c, which, 1, 0), fmi3Error);
  EXPECT(fmi3SetIntervalFraction(c, which, 1, 0, 0), fmi3Error);
  EXPECT(fmi3SetShiftDecimal(c, which, 1, 0), fmi3Error);
  EXPECT(fmi3SetShiftFraction(c, which, 1, 0, 0), fmi3Error);
  EXPECT(fmi3GetOutputDerivatives(c, which, 1, 0, 0, 1), fmi3Error);
  EXPECT(fmi3GetNumberOfVariableDependencies(c, 3, 0), fmi3Error);
  EXPECT(fmi3GetVariableDependencies(c, 3, 0, 0, 0, 0, 0), fmi3Error);
  EXPECT(fmi3GetAdjointDerivative(c, which, 1, which, 1, 0, 1, 0, 1), fmi3Error);
  EXPECT(fmi3EnterConfigurationMode(c), fmi3Error);
  EXPECT(fmi3ExitConfigurationMode(c), fmi3Error);
  EXPECT(fmi3EvaluateDiscreteStates(c), fmi3Error);
  EXPECT(fmi3EnterStepMode(c), fmi3Error);
  EXPECT(fmi3ActivateModelPartition(c, 3, 0.0), fmi3Error);
  EXPECT(errors - before, c ? 42 : 0);
  return 0;
}

/* what needs pointers, with none of them */
static int pointless3(fmi3Instance c) {
  const fmi3ValueReference which[1] = {3};
  EXPECT(fmi3GetFloat64(c, 0, 1, 0, 1), fmi3Error);
  EXPECT(fmi3GetFloat64(c, which, 1, 0, 1), fmi3Error);
  EXPECT(fmi3GetFloat64(c, which, 1, 0, 2), fmi3Error);
  EXPECT(fmi3SetFloat64(c, 0, 1, 0, 1), fmi3Error);
  EXPECT(fmi3SetFloat64(c, which, 1, 0, 0), fmi3Error);
  EXPECT(fmi3GetBoolean(c, 0, 1, 0, 1), fmi3Error);
  EXPECT(fmi3GetFMUState(c, 0), fmi3Error);
  EXPECT(fmi3SetFMUState(c, 0), fmi3Error);
  EXPECT(fmi3FreeFMUState(c, 0), fmi3Error);
  EXPECT(fmi3SerializedFMUStateSize(c, 0, 0), fmi3Error);
  EXPECT(fmi3SerializeFMUState(c, 0, 0, 0), fmi3Error);
  EXPECT(fmi3DeserializeFMUState(c, 0, 0, 0), fmi3Error);
  EXPECT(fmi3GetDirectionalDerivative(c, 0, 1, 0, 1, 0, 1, 0, 1), fmi3Error);
  EXPECT(fmi3GetDirectionalDerivative(c, which, 1, which, 1, 0, 2, 0, 1), fmi3Error);
  EXPECT(fmi3UpdateDiscreteStates(c, 0, 0, 0, 0, 0, 0), fmi3Error);
  EXPECT(fmi3CompletedIntegratorStep(c, 1, 0, 0), fmi3Error);
  EXPECT(fmi3GetNumberOfEventIndicators(c, 0), fmi3Error);
  EXPECT(fmi3GetNumberOfContinuousStates(c, 0), fmi3Error);
  EXPECT(fmi3SetContinuousStates(c, 0, 1), fmi3Error);
  EXPECT(fmi3GetContinuousStates(c, 0, 1), fmi3Error);
  EXPECT(fmi3GetContinuousStateDerivatives(c, 0, 1), fmi3Error);
  EXPECT(fmi3GetNominalsOfContinuousStates(c, 0, 1), fmi3Error);
  EXPECT(fmi3GetEventIndicators(c, 0, 1), fmi3Error);
  EXPECT(fmi3DoStep(c, 0.0, 0.1, 1, 0, 0, 0, 0), fmi3Error);
  return 0;
}

static int nobody3(void) {
  double number[1] = {0.0};
  EXPECT(refused3(0), 0);
  EXPECT(pointless3(0), 0);
  EXPECT(fmi3SetDebugLogging(0, 1, 0, 0), fmi3Error);
  EXPECT(fmi3EnterInitializationMode(0, 0, 0.0, 0.0, 0, 0.0), fmi3Error);
  EXPECT(fmi3ExitInitializationMode(0), fmi3Error);
  EXPECT(fmi3EnterEventMode(0), fmi3Error);
  EXPECT(fmi3EnterContinuousTimeMode(0), fmi3Error);
  EXPECT(fmi3Terminate(0), fmi3Error);
  EXPECT(fmi3Reset(0), fmi3Error);
  EXPECT(fmi3SetTime(0, 0.0), fmi3Error);
  EXPECT(fmi3GetContinuousStates(0, number, 1), fmi3Error);
  EXPECT(strcmp(fmi3GetVersion(), "3.0"), 0);
  fmi3FreeInstance(0);
  return 0;
}

static int exchange3(const char *token, const char *resources, size_t count) {
  fmi3Instance c = fmi3InstantiateModelExchange("exchange", token, resources, 0, 1, 0, logged3);
  const fmi3ValueReference inputs[3] = {0, 1, 2}, outputs[4] = {3, 4, 5, 6}, flag[1] = {12}, time[1] = {15};
  const double place[3] = {0.001, -0.002, 0.003}, away[3] = {10.0, 0.0, 10.0}, seed[3] = {1.0, 0.0, 0.0};
  double values[4], slopes[4], next, *states = (double *)calloc(4 * count + 1, sizeof(double)), *rates = states + count;
  double *nominals = rates + count, *again = nominals + count;
  fmi3Boolean b[5], inside[1];
  fmi3FMUState kept = 0;
  size_t i, many = 99;
  if (!c) return 1;
  EXPECT(fmi3DoStep(c, 0.0, 0.001, 1, b, b + 1, b + 2, &next), fmi3Error);
  EXPECT(fmi3GetFloat64(c, outputs, 4, values, 4), fmi3Error);
  EXPECT(fmi3EnterContinuousTimeMode(c), fmi3Error);
  EXPECT(fmi3ExitInitializationMode(c), fmi3Error);
  EXPECT(fmi3EnterInitializationMode(c, 1, 1e-6, 0.25, 1, 1.0), fmi3OK);
  EXPECT(fmi3EnterInitializationMode(c, 1, 1e-6, 0.25, 1, 1.0), fmi3Error);
  EXPECT(fmi3SetFloat64(c, inputs, 3, place, 3), fmi3OK);
  EXPECT(fmi3GetFloat64(c, time, 1, values, 1), fmi3OK);
  EXPECT(values[0] == 0.25, 1);
  EXPECT(fmi3SetFloat64(c, time, 1, values, 1), fmi3Error);
  EXPECT(fmi3ExitInitializationMode(c), fmi3OK);
  EXPECT(fmi3UpdateDiscreteStates(c, b, b + 1, b + 2, b + 3, b + 4, &next), fmi3OK);
  EXPECT(b[0] || b[1] || b[2] || b[3] || b[4], 0);
  EXPECT(fmi3EnterContinuousTimeMode(c), fmi3OK);
  EXPECT(fmi3UpdateDiscreteStates(c, b, b + 1, b + 2, b + 3, b + 4, &next), fmi3Error);
  EXPECT(fmi3SetTime(c, 0.5), fmi3OK);
  EXPECT(fmi3GetNumberOfEventIndicators(c, &many), fmi3OK);
  EXPECT(many, 0);
  EXPECT(fmi3GetNumberOfContinuousStates(c, &many), fmi3OK);
  EXPECT(many, count);
  EXPECT(refused3(c), 0);
  EXPECT(pointless3(c), 0);
  EXPECT(fmi3GetFloat64(c, outputs, 4, values, 4), fmi3OK);
  EXPECT(fmi3GetDirectionalDerivative(c, outputs, 4, inputs, 3, seed, 3, slopes, 4), fmi3OK);
  EXPECT(fabs(slopes[3] + values[0]) <= (count ? 1e-6 : 0.0) * (1.0 + fabs(values[0])), 1);
  EXPECT(fmi3GetDirectionalDerivative(c, inputs, 1, inputs, 3, seed, 3, slopes, 1), fmi3Error);
  EXPECT(fmi3GetDirectionalDerivative(c, flag, 1, inputs, 3, seed, 3, slopes, 1), fmi3Error);
  EXPECT(fmi3GetDirectionalDerivative(c, outputs, 1, outputs, 1, seed, 1, slopes, 1), fmi3Error);
  EXPECT(fmi3GetContinuousStates(c, states, count), fmi3OK);
  EXPECT(fmi3GetNominalsOfContinuousStates(c, nominals, count), fmi3OK);
  for (i = 0; i < count; i++) states[i] += 0.01 * nominals[i];
  EXPECT(fmi3SetContinuousStates(c, states, count), fmi3OK);
  EXPECT(fmi3GetContinuousStateDerivatives(c, rates, count), fmi3OK);
  EXPECT(fmi3GetFMUState(c, &kept), fmi3OK);
  for (i = 0; i < count; i++) states[i] += 0.01 * nominals[i];
  EXPECT(fmi3SetContinuousStates(c, states, count), fmi3OK);
  EXPECT(fmi3SetFMUState(c, kept), fmi3OK);
  EXPECT(fmi3FreeFMUState(c, &kept), fmi3OK);
  EXPECT(fmi3GetContinuousStateDerivatives(c, again, count), fmi3OK);
  EXPECT(memcmp(rates, again, count * sizeof(double)), 0);
  EXPECT(fmi3GetEventIndicators(c, 0, 0), fmi3OK);
  EXPECT(fmi3CompletedIntegratorStep(c, 1, b, b + 1), fmi3OK);
  EXPECT(b[0] || b[1], 0);
  EXPECT(fmi3SetFloat64(c, inputs, 3, away, 3), fmi3OK);
  EXPECT(fmi3CompletedIntegratorStep(c, 1, b, b + 1), fmi3OK);
  EXPECT(b[0], 1); /* the flags change at events alone */
  EXPECT(fmi3GetBoolean(c, flag, 1, inside, 1), fmi3OK);
  EXPECT(fmi3EnterEventMode(c), fmi3OK);
  EXPECT(fmi3EnterEventMode(c), fmi3Error);
  EXPECT(fmi3SetContinuousStates(c, states, count), fmi3Error);
  EXPECT(fmi3Terminate(c), fmi3OK);
  EXPECT(fmi3GetFloat64(c, outputs, 4, values, 4), fmi3OK);
  EXPECT(fmi3SetFloat64(c, inputs, 3, place, 3), fmi3Error);
  EXPECT(fmi3Reset(c), fmi3OK);
  EXPECT(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0), fmi3OK);
  fmi3FreeInstance(c);
  free(states);
  return 0;
}

static int simulation3(const char *token, const char *resources) {
  fmi3Instance c = fmi3InstantiateCoSimulation("simulation", token, resources, 0, 1, 0, 0, 0, 0, 0, logged3, 0);
  const fmi3ValueReference inputs[3] = {0, 1, 2}, outputs[3] = {3, 4, 5}, strange[1] = {99999}, output[1] = {3};
  const fmi3ValueReference flags[3] = {12, 13, 14};
  const double place[3] = {0.001, -0.002, 0.003}, far[3] = {10.0, 0.0, -0.03}, none[3] = {0.0 / 0.0, 0.0, 0.0};
  double values[3], again[3], reached = -1.0;
  fmi3Boolean b[3];
  fmi3FMUState state = 0, other = 0;
  fmi3Byte bytes[1 << 16];
  size_t size = 0;
  int i;
#define STEP3(time, step) fmi3DoStep(c, time, step, 1, b, b + 1, b + 2, &reached)
  if (!c) return 1;
  EXPECT(fmi3Terminate(c), fmi3Error);
  EXPECT(STEP3(0.0, 0.001), fmi3Error);
  EXPECT(fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 1, 1.0), fmi3OK);
  EXPECT(fmi3SetFloat64(c, inputs, 3, place, 3), fmi3OK);
  EXPECT(fmi3ExitInitializationMode(c), fmi3OK);
  EXPECT(refused3(c), 0);
  EXPECT(pointless3(c), 0);
  EXPECT(fmi3SetFloat64(c, strange, 1, place, 1), fmi3Error);
  EXPECT(fmi3SetFloat64(c, output, 1, place, 1), fmi3Error);
  EXPECT(fmi3GetFloat64(c, strange, 1, values, 1), fmi3Error);
  EXPECT(fmi3GetBoolean(c, output, 1, b, 1), fmi3Error);
  EXPECT(fmi3GetBoolean(c, flags, 3, b, 3), fmi3OK);
  EXPECT(fmi3GetString(c, strange, 0, 0, 0), fmi3OK);
  for (i = 0; i < 20; i++) EXPECT(STEP3(0.001 * i, 0.001), fmi3OK);
  EXPECT(fabs(reached - 0.02) < 1e-12, 1);
  EXPECT(fmi3GetFMUState(c, &state), fmi3OK);
  for (i = 0; i < 20; i++) EXPECT(STEP3(0.02 + 0.001 * i, 0.001), fmi3OK);
  EXPECT(fmi3GetFloat64(c, outputs, 3, values, 3), fmi3OK);
  EXPECT(fmi3SerializedFMUStateSize(c, state, &size), fmi3OK);
  EXPECT(size <= sizeof bytes, 1);
  EXPECT(fmi3SerializeFMUState(c, state, bytes, size - 1), fmi3Error);
  EXPECT(fmi3SerializeFMUState(c, state, bytes, size), fmi3OK);
  EXPECT(fmi3DeserializeFMUState(c, bytes, size - 1, &other), fmi3Error);
  EXPECT(fmi3DeserializeFMUState(c, bytes, size, &other), fmi3OK);
  EXPECT(fmi3SetFMUState(c, other), fmi3OK);
  for (i = 0; i < 20; i++) EXPECT(STEP3(0.02 + 0.001 * i, 0.001), fmi3OK);
  EXPECT(fmi3GetFloat64(c, outputs, 3, again, 3), fmi3OK);
  EXPECT(memcmp(values, again, sizeof values), 0);
  EXPECT(fmi3GetDirectionalDerivative(c, outputs, 3, inputs, 3, place, 3, again, 3), fmi3OK);
  EXPECT(fmi3GetFloat64(c, outputs, 3, again, 3), fmi3OK);
  EXPECT(memcmp(values, again, sizeof values), 0); /* asking for derivatives changes nothing */
  EXPECT(fmi3FreeFMUState(c, &state), fmi3OK);
  EXPECT(fmi3FreeFMUState(c, &other), fmi3OK);
  EXPECT(state == 0, 1);
  EXPECT(STEP3(0.0, -1.0), fmi3Error);
  EXPECT(fmi3EnterEventMode(c), fmi3Error);
  EXPECT(fmi3SetTime(c, 0.0), fmi3Error);
  warnings = 0;
  EXPECT(fmi3SetFloat64(c, inputs, 3, far, 3), fmi3OK);
  for (i = 0; i < 5; i++) EXPECT(STEP3(0.1, 0.001), fmi3OK);
  EXPECT(fmi3SetFloat64(c, inputs, 3, none, 3), fmi3OK);
  EXPECT(STEP3(0.1, 0.001), fmi3Discard);
  EXPECT(fmi3GetFloat64(c, outputs, 3, values, 3), fmi3OK);
  EXPECT(values[0] == 0.0 && values[1] == 0.0 && values[2] == 0.0, 1); /* nobody is pushed */
  EXPECT(warnings <= 2, 1); /* once an excursion and once of steps that are long there, never an error */
  EXPECT(fmi3Terminate(c), fmi3OK);
  EXPECT(fmi3GetFloat64(c, outputs, 3, values, 3), fmi3OK);
  fmi3FreeInstance(c);
  return 0;
}

static int orders3(const char *token, const char *resources, int states) {
  const fmi3ValueReference which[1] = {3};
  if (nobody3()) return 1;
#define NEW3(name, token, resources, events, wanted) \
  (fmi3InstantiateCoSimulation(name, token, resources, 0, 0, events, 0, which, wanted, 0, logged3, 0) == 0)
  EXPECT(NEW3("x", "0", resources, 0, 0), 1);
  EXPECT(NEW3("x", token, "/nowhere", 0, 0), 1);
  EXPECT(NEW3("x", token, 0, 0, 0), 1);
  EXPECT(NEW3("", token, resources, 0, 0), 1);
  EXPECT(NEW3("x", 0, resources, 0, 0), 1);
  EXPECT(NEW3("x", token, resources, 1, 0), 1);
  EXPECT(NEW3("x", token, resources, 0, 1), 1);
  EXPECT(fmi3InstantiateScheduledExecution("x", token, resources, 0, 0, 0, logged3, 0, 0, 0) == 0, 1);
  EXPECT(fmi3InstantiateModelExchange("x", token, "", 0, 0, 0, 0) == 0, 1);
  if (states >= 0 && exchange3(token, resources, (size_t)states)) return 1;
  if (states < 0) EXPECT(fmi3InstantiateModelExchange("x", token, resources, 0, 0, 0, logged3) == 0, 1);
  return simulation3(token, resources);
}
