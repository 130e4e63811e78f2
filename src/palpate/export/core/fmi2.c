/* FMI 2.0 around the evaluator core: co-simulation, and model exchange of a body without memory.
 *
 * One binary serves every body: the weights are read from resources/weights.bin when an instance is made, and their
 * SHA-256 must be the guid of the model description.
 */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#define FMI __declspec(dllexport)
__declspec(dllimport) int __stdcall MultiByteToWideChar(unsigned int, unsigned long, const char *, int, wchar_t *, int);
#elif defined(__GNUC__)
#define FMI __attribute__((visibility("default")))
#else
#define FMI
#endif

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

/* value references of real variables; parameters of the body follow from PARAMETER on */
enum { FX = 3, FY = 4, FZ = 5, ENERGY = 6, DEPTH = 7, DEVIATION = 8, SCALE = 9, STORED = 10, LOST = 11, PARAMETER = 16 };
/* of Boolean ones */
enum { INSIDE = 0, CONTACT = 1, TOO_DEEP = 2 };
enum { INSTANTIATED = 1, INITIALIZING = 2, EVENT = 4, CONTINUOUS = 8, STEPPING = 16, TERMINATED = 32, BROKEN = 64 };
#define RUNNING (EVENT | CONTINUOUS | STEPPING)

/* everything that changes while an instance lives; the memory's numbers follow it */
typedef struct {
  double x[3], p[PP_MOST], scale, time, force[3];
  int phase, stepped, warned;
} Moment;

typedef struct {
  pp_array arrays[PP_ARRAYS];
  pp_model model;
  unsigned char *bytes;
  double *work, *numbers, *first; /* workspace of the deviation, the memory's state, and it at the start */
  Moment now, start;
  int32_t parameters, size;
  int type, loud, known, flags, deviated;
  double answer[PP_ANSWER], deviation;
  fmi2CallbackFunctions calls;
  char name[128];
} Instance;

static void say(Instance *c, fmi2Status status, const char *category, const char *text) {
  if (c->calls.logger) c->calls.logger(c->calls.componentEnvironment, c->name, status, category, "%s", text);
}

static fmi2Status refuse(Instance *c, const char *text) {
  say(c, fmi2Error, "logStatusError", text);
  return fmi2Error;
}

/* 1 where a call is allowed in the phase that the instance is in */
static int allowed(Instance *c, int phases, const char *call) {
  char text[160];
  if (!c) return 0;
  if (c->now.phase & phases) return 1;
  snprintf(text, sizeof text, "%s may not be called now.", call);
  say(c, fmi2Error, "logStatusError", text);
  return 0;
}

static int digit(char letter) {
  if (letter >= '0' && letter <= '9') return letter - '0';
  if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
  if (letter >= 'A' && letter <= 'F') return letter - 'A' + 10;
  return -1;
}

/* the path of a file: URI, with /weights.bin at its end; 0 where it is none */
static char *path_of(const char *uri) {
  static const char file[] = "/weights.bin";
  const size_t length = strlen(uri);
  const char *from = uri;
  char *path = (char *)malloc(length + sizeof file), *to = path;
  if (!path) return 0;
  if (!strncmp(from, "file:", 5)) {
    from += 5;
    if (!strncmp(from, "//localhost/", 12)) from += 11;
    else if (!strncmp(from, "///", 3)) from += 2;
  } else if (strstr(from, "://")) {
    free(path);
    return 0;
  }
#ifdef _WIN32
  if (from[0] == '/' && from[1] && (from[2] == ':' || from[2] == '|')) from++;
#endif
  while (*from) {
    if (from[0] == '%' && digit(from[1]) >= 0 && digit(from[2]) >= 0) {
      *to++ = (char)(16 * digit(from[1]) + digit(from[2]));
      from += 3;
    } else {
      *to++ = *from++;
    }
  }
  while (to > path + 1 && (to[-1] == '/' || to[-1] == '\\')) to--;
  memcpy(to, file, sizeof file);
  return path;
}

static FILE *opened(const char *path) {
#ifdef _WIN32
  wchar_t wide[1024];
  if (MultiByteToWideChar(65001, 0, path, -1, wide, 1024) <= 0) return 0;
  return _wfopen(wide, L"rb");
#else
  return fopen(path, "rb");
#endif
}

static unsigned char *content(const char *path, uint64_t *size) {
  FILE *file = opened(path);
  unsigned char *bytes = 0;
  long end;
  if (!file) return 0;
  if (!fseek(file, 0, SEEK_END) && (end = ftell(file)) > 0 && !fseek(file, 0, SEEK_SET)) {
    bytes = (unsigned char *)malloc((size_t)end);
    *size = (uint64_t)end;
    if (bytes && fread(bytes, 1, (size_t)end, file) != (size_t)end) {
      free(bytes);
      bytes = 0;
    }
  }
  fclose(file);
  return bytes;
}

static int same_weights(const unsigned char *bytes, const char *guid) {
  int i;
  for (i = 0; i < 64; i++) {
    if (digit(guid[i]) != ((bytes[32 + i / 2] >> (i % 2 ? 0 : 4)) & 15)) return 0;
  }
  return guid[64] == 0;
}

FMI const char *fmi2GetTypesPlatform(void) { return "default"; }

FMI const char *fmi2GetVersion(void) { return "2.0"; }

FMI void fmi2FreeInstance(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!c) return;
  free(c->bytes);
  free(c->work);
  free(c->numbers);
  free(c->first);
  free(c);
}

FMI fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                  const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean loud) {
  static const char *const reasons[5] = {"", "is no block of weights that this binary reads", "is damaged",
                                         "holds arrays that do not fit each other", "is of a kind that this binary does not know"};
  Instance *c = (Instance *)calloc(1, sizeof *c);
  uint64_t size = 0;
  char *path, text[512];
  int reason, i;
  (void)visible;
  if (!c) return 0;
  if (calls) c->calls = *calls;
  if (!name || !*name || !guid || !resources) {
    say(c, fmi2Error, "logStatusError", "An instance needs a name, a guid and the place of its resources.");
    free(c);
    return 0;
  }
  strncpy(c->name, name, sizeof c->name - 1);
  path = path_of(resources);
  c->bytes = path ? content(path, &size) : 0;
  if (!c->bytes) {
    snprintf(text, sizeof text, "The weights could not be read from %.400s.", path ? path : resources);
    say(c, fmi2Error, "logStatusError", text);
    free(path);
    fmi2FreeInstance(c);
    return 0;
  }
  free(path);
  reason = pp_open(c->bytes, size, c->arrays);
  if (reason != PP_OPEN || !same_weights(c->bytes, guid)) {
    snprintf(text, sizeof text, "resources/weights.bin %s.", reason ? reasons[reason] : "holds other weights than the model description is of");
    say(c, fmi2Error, "logStatusError", text);
    fmi2FreeInstance(c);
    return 0;
  }
  c->model.a = c->arrays;
  c->parameters = c->arrays[PP_HEAD].whole[PP_INPUTS] - c->arrays[PP_HEAD].whole[PP_FELT];
  c->size = c->arrays[PP_HEAD].whole[PP_MEMORY_CODE] ? 4 + c->arrays[PP_HEAD].whole[PP_STATE] : 0;
  c->type = type;
  c->loud = loud;
  if (type == fmi2ModelExchange && c->size) {
    say(c, fmi2Error, "logStatusError", "A body with a memory is for co-simulation.");
    fmi2FreeInstance(c);
    return 0;
  }
  c->work = (double *)calloc((size_t)(pp_deviation_size(&c->model) + 1), sizeof(double));
  c->numbers = (double *)calloc((size_t)c->size + 1, sizeof(double));
  c->first = (double *)calloc((size_t)c->size + 1, sizeof(double));
  if (!c->work || !c->numbers || !c->first) {
    fmi2FreeInstance(c);
    return 0;
  }
  c->now.phase = INSTANTIATED;
  c->now.scale = 1.0;
  for (i = 0; i < c->parameters; i++) {
    const int32_t n = c->arrays[PP_LIMITS].n[1], k = n - c->parameters + i;
    c->now.p[i] = 0.5 * (c->arrays[PP_LIMITS].real[k] + c->arrays[PP_LIMITS].real[n + k]);
  }
  if (c->arrays[PP_HEAD].whole[PP_BASELINE_CODE] == 1) { /* the start that the description tells of a probe */
    const double *low = c->arrays[PP_LIMITS].real, *high = low + c->arrays[PP_LIMITS].n[1];
    for (i = 0; i < 3; i++) c->now.x[i] = i < 2 ? (low[i] + high[i]) / 2.0 : high[i];
  }
  c->start = c->now;
  return c;
}

/* renew the elastic answer, and warn once where the place leaves the trained region */
static void renew(Instance *c) {
  if (c->known) return;
  c->flags = pp_answer(&c->model, c->now.x, c->now.p, c->answer);
  c->known = 1;
  c->deviated = 0;
  /* before its first step a body with a memory answers as one that nothing was done to */
  if (!c->size || !c->now.stepped) memcpy(c->now.force, c->answer + PP_FORCE, sizeof c->now.force);
  if (c->flags & PP_TOO_DEEP) memset(c->now.force, 0, sizeof c->now.force);
  if (c->flags & PP_TRUSTED) {
    c->now.warned = 0;
  } else if (!c->now.warned && (c->now.phase & RUNNING)) {
    c->now.warned = 1;
    say(c, fmi2Warning, "logStatusWarning", c->flags & PP_NOT_A_NUMBER ? "An input is not a finite number." : "The place is outside of the trained region.");
  }
}

static void advance(Instance *c, double dt) {
  renew(c);
  if (!c->size) return;
  c->now.stepped = 1;
  if (!pp_step(&c->model, c->numbers, c->now.x, c->answer[PP_AMPLITUDE], c->answer + PP_SLOPE, dt, c->now.force)) {
    c->now.force[0] = c->now.force[1] = c->now.force[2] = pp_nan();
  }
  if (c->flags & PP_TOO_DEEP) memset(c->now.force, 0, sizeof c->now.force);
}

FMI fmi2Status fmi2SetDebugLogging(fmi2Component component, fmi2Boolean on, size_t count, const fmi2String categories[]) {
  Instance *c = (Instance *)component;
  (void)count;
  (void)categories;
  if (!allowed(c, 127, "fmi2SetDebugLogging")) return fmi2Error;
  c->loud = on;
  return fmi2OK;
}

FMI fmi2Status fmi2SetupExperiment(fmi2Component component, fmi2Boolean limited, fmi2Real tolerance, fmi2Real start,
                                   fmi2Boolean ends, fmi2Real end) {
  Instance *c = (Instance *)component;
  (void)limited;
  (void)tolerance;
  (void)ends;
  (void)end;
  if (!allowed(c, INSTANTIATED, "fmi2SetupExperiment")) return fmi2Error;
  c->now.time = start;
  return fmi2OK;
}

FMI fmi2Status fmi2EnterInitializationMode(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, INSTANTIATED, "fmi2EnterInitializationMode")) return fmi2Error;
  c->now.phase = INITIALIZING;
  return fmi2OK;
}

FMI fmi2Status fmi2ExitInitializationMode(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, INITIALIZING, "fmi2ExitInitializationMode")) return fmi2Error;
  c->now.phase = c->type == fmi2CoSimulation ? STEPPING : EVENT;
  c->known = 0;
  renew(c);
  return fmi2OK;
}

FMI fmi2Status fmi2Terminate(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, RUNNING, "fmi2Terminate")) return fmi2Error;
  c->now.phase = TERMINATED;
  return fmi2OK;
}

FMI fmi2Status fmi2Reset(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, 127, "fmi2Reset")) return fmi2Error;
  c->now = c->start;
  memset(c->numbers, 0, (size_t)c->size * sizeof(double));
  c->known = 0;
  return fmi2OK;
}

static int is_parameter(const Instance *c, fmi2ValueReference v) {
  return v >= PARAMETER && v < PARAMETER + (fmi2ValueReference)c->parameters;
}

FMI fmi2Status fmi2GetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, fmi2Real values[]) {
  Instance *c = (Instance *)component;
  size_t i;
  if (!allowed(c, INITIALIZING | RUNNING | TERMINATED | BROKEN, "fmi2GetReal")) return fmi2Error;
  if (count && (!which || !values)) return refuse(c, "fmi2GetReal needs references and room for values.");
  for (i = 0; i < count; i++) {
    const fmi2ValueReference v = which[i];
    if (v < 3) {
      values[i] = c->now.x[v];
      continue;
    }
    if (v == SCALE || is_parameter(c, v)) {
      values[i] = v == SCALE ? c->now.scale : c->now.p[v - PARAMETER];
      continue;
    }
    renew(c);
    if (v <= FZ) values[i] = c->now.scale * c->now.force[v - FX];
    else if (v == ENERGY) values[i] = c->now.scale * c->answer[PP_ENERGY];
    else if (v == DEPTH) values[i] = c->answer[PP_DEPTH];
    else if (v == DEVIATION) {
      if (!c->deviated) c->deviation = pp_deviation(&c->model, c->now.x, c->now.p, c->answer, c->work);
      c->deviated = 1;
      values[i] = c->deviation;
    } else if ((v == STORED || v == LOST) && c->size) values[i] = c->now.scale * c->numbers[v - STORED];
    else return refuse(c, "There is no real variable of this reference.");
  }
  return fmi2OK;
}

FMI fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference which[], size_t count, const fmi2Real values[]) {
  Instance *c = (Instance *)component;
  size_t i;
  if (!allowed(c, INSTANTIATED | INITIALIZING | RUNNING, "fmi2SetReal")) return fmi2Error;
  if (count && (!which || !values)) return refuse(c, "fmi2SetReal needs references and values.");
  for (i = 0; i < count; i++) {
    const fmi2ValueReference v = which[i];
    if (v < 3) c->now.x[v] = values[i];
    else if (v == SCALE) c->now.scale = values[i];
    else if (is_parameter(c, v)) c->now.p[v - PARAMETER] = values[i];
    else return refuse(c, "There is no real input or parameter of this reference.");
    c->known = 0;
  }
  return fmi2OK;
}

FMI fmi2Status fmi2GetBoolean(fmi2Component component, const fmi2ValueReference which[], size_t count, fmi2Boolean values[]) {
  static const int bits[3] = {PP_TRUSTED, PP_CONTACT, PP_TOO_DEEP};
  Instance *c = (Instance *)component;
  size_t i;
  if (!allowed(c, INITIALIZING | RUNNING | TERMINATED | BROKEN, "fmi2GetBoolean")) return fmi2Error;
  renew(c);
  for (i = 0; i < count; i++) {
    if (which[i] > TOO_DEEP) return refuse(c, "There is no Boolean variable of this reference.");
    values[i] = (c->flags & bits[which[i]]) != 0;
  }
  return fmi2OK;
}

#define NONE_OF(name, kind)                                                                                       \
  FMI fmi2Status name(fmi2Component component, const fmi2ValueReference which[], size_t count, kind values[]) {    \
    (void)which, (void)values;                                                                                    \
    if (!allowed((Instance *)component, 127, #name)) return fmi2Error;                                            \
    return count ? refuse((Instance *)component, "There is no variable of this type and reference.") : fmi2OK;     \
  }
NONE_OF(fmi2GetInteger, fmi2Integer)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const fmi2Integer)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)

static size_t moment_size(const Instance *c) { return sizeof(Moment) + (size_t)c->size * sizeof(double); }

FMI fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *state) {
  Instance *c = (Instance *)component;
  if (!allowed(c, 127, "fmi2GetFMUstate") || !state) return fmi2Error;
  if (!*state) *state = malloc(moment_size(c));
  if (!*state) return refuse(c, "There is no memory for a state.");
  memcpy(*state, &c->now, sizeof(Moment));
  memcpy((char *)*state + sizeof(Moment), c->numbers, (size_t)c->size * sizeof(double));
  return fmi2OK;
}

FMI fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate state) {
  Instance *c = (Instance *)component;
  if (!allowed(c, 127, "fmi2SetFMUstate") || !state) return fmi2Error;
  memcpy(&c->now, state, sizeof(Moment));
  memcpy(c->numbers, (char *)state + sizeof(Moment), (size_t)c->size * sizeof(double));
  c->known = 0;
  return fmi2OK;
}

FMI fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *state) {
  if (!allowed((Instance *)component, 127, "fmi2FreeFMUstate") || !state) return fmi2Error;
  free(*state);
  *state = 0;
  return fmi2OK;
}

FMI fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate state, size_t *size) {
  Instance *c = (Instance *)component;
  if (!allowed(c, 127, "fmi2SerializedFMUstateSize") || !state || !size) return fmi2Error;
  *size = moment_size(c);
  return fmi2OK;
}

FMI fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  Instance *c = (Instance *)component;
  if (!allowed(c, 127, "fmi2SerializeFMUstate") || !state || !bytes) return fmi2Error;
  if (size < moment_size(c)) return refuse(c, "A state needs more room than this.");
  memcpy(bytes, state, moment_size(c));
  return fmi2OK;
}

FMI fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  Instance *c = (Instance *)component;
  Moment read;
  if (!allowed(c, 127, "fmi2DeSerializeFMUstate") || !bytes || !state) return fmi2Error;
  if (size != moment_size(c)) return refuse(c, "This is no state of this body.");
  memcpy(&read, bytes, sizeof read);
  if (read.phase != INSTANTIATED && read.phase != INITIALIZING && read.phase != EVENT && read.phase != CONTINUOUS &&
      read.phase != STEPPING && read.phase != TERMINATED) return refuse(c, "This is no state of this body.");
  if (!*state) *state = malloc(size);
  if (!*state) return refuse(c, "There is no memory for a state.");
  memcpy(*state, bytes, size);
  return fmi2OK;
}

/* derivative of force (3) and energy by one known variable */
static void derivative(Instance *c, fmi2ValueReference by, double *out) {
  double p[PP_MOST], answer[2][PP_ANSWER], step;
  const int32_t n = c->arrays[PP_LIMITS].n[1], k = n - c->parameters + (int32_t)(by - PARAMETER);
  int i, side;
  renew(c);
  for (i = 0; i < 4; i++) {
    const double *f = c->answer + PP_FORCE;
    if (by < 3) out[i] = c->now.scale * (i < 3 ? c->answer[PP_STIFFNESS + 3 * i + (int)by] : -f[by]);
    if (by == SCALE) out[i] = i < 3 ? f[i] : c->answer[PP_ENERGY];
  }
  if (by < PARAMETER) return;
  memcpy(p, c->now.p, sizeof p);
  step = 1e-5 * (c->arrays[PP_LIMITS].real[n + k] - c->arrays[PP_LIMITS].real[k]);
  for (side = 0; side < 2; side++) {
    p[by - PARAMETER] = c->now.p[by - PARAMETER] + (side ? -step : step);
    pp_answer(&c->model, c->now.x, p, answer[side]);
  }
  for (i = 0; i < 4; i++) {
    const int at = i < 3 ? PP_FORCE + i : PP_ENERGY;
    out[i] = c->now.scale * (answer[0][at] - answer[1][at]) / (2.0 * step);
  }
}

FMI fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[], size_t unknowns,
                                            const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[],
                                            fmi2Real values[]) {
  Instance *c = (Instance *)component;
  size_t i, j;
  if (!allowed(c, INITIALIZING | RUNNING, "fmi2GetDirectionalDerivative")) return fmi2Error;
  if (c->size) return refuse(c, "A body with a memory has no directional derivatives.");
  for (i = 0; i < unknowns; i++) {
    if (unknown[i] < FX || unknown[i] > ENERGY) return refuse(c, "Only force and energy have directional derivatives.");
    values[i] = 0.0;
  }
  for (j = 0; j < knowns; j++) {
    double by[4] = {0.0, 0.0, 0.0, 0.0};
    if (known[j] > 2 && known[j] != SCALE && !is_parameter(c, known[j])) return refuse(c, "There is no such input.");
    derivative(c, known[j], by);
    for (i = 0; i < unknowns; i++) values[i] += seed[j] * by[unknown[i] - FX];
  }
  return fmi2OK;
}

FMI fmi2Status fmi2EnterEventMode(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, CONTINUOUS, "fmi2EnterEventMode")) return fmi2Error;
  c->now.phase = EVENT;
  return fmi2OK;
}

FMI fmi2Status fmi2NewDiscreteStates(fmi2Component component, fmi2EventInfo *info) {
  if (!allowed((Instance *)component, EVENT, "fmi2NewDiscreteStates") || !info) return fmi2Error;
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

FMI fmi2Status fmi2EnterContinuousTimeMode(fmi2Component component) {
  Instance *c = (Instance *)component;
  if (!allowed(c, EVENT, "fmi2EnterContinuousTimeMode")) return fmi2Error;
  c->now.phase = CONTINUOUS;
  return fmi2OK;
}

FMI fmi2Status fmi2CompletedIntegratorStep(fmi2Component component, fmi2Boolean final, fmi2Boolean *event, fmi2Boolean *end) {
  (void)final;
  if (!allowed((Instance *)component, CONTINUOUS, "fmi2CompletedIntegratorStep") || !event || !end) return fmi2Error;
  *event = *end = 0;
  return fmi2OK;
}

FMI fmi2Status fmi2SetTime(fmi2Component component, fmi2Real time) {
  Instance *c = (Instance *)component;
  if (!allowed(c, EVENT | CONTINUOUS, "fmi2SetTime")) return fmi2Error;
  c->now.time = time;
  return fmi2OK;
}

/* there are no continuous states and no event indicators */
#define EMPTY(name, kind)                                                                          \
  FMI fmi2Status name(fmi2Component component, kind values[], size_t count) {                      \
    (void)values;                                                                                  \
    if (!allowed((Instance *)component, INITIALIZING | EVENT | CONTINUOUS | TERMINATED, #name)) return fmi2Error; \
    return count ? refuse((Instance *)component, "There are no continuous states and no event indicators.") : fmi2OK; \
  }
EMPTY(fmi2SetContinuousStates, const fmi2Real)
EMPTY(fmi2GetDerivatives, fmi2Real)
EMPTY(fmi2GetEventIndicators, fmi2Real)
EMPTY(fmi2GetContinuousStates, fmi2Real)
EMPTY(fmi2GetNominalsOfContinuousStates, fmi2Real)

FMI fmi2Status fmi2SetRealInputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                           const fmi2Integer orders[], const fmi2Real values[]) {
  (void)which, (void)orders, (void)values;
  if (!component) return fmi2Error;
  return count ? refuse((Instance *)component, "Inputs are not extrapolated.") : fmi2OK;
}

FMI fmi2Status fmi2GetRealOutputDerivatives(fmi2Component component, const fmi2ValueReference which[], size_t count,
                                            const fmi2Integer orders[], fmi2Real values[]) {
  (void)which, (void)orders, (void)values;
  if (!component) return fmi2Error;
  return count ? refuse((Instance *)component, "Outputs have no derivatives by time.") : fmi2OK;
}

FMI fmi2Status fmi2DoStep(fmi2Component component, fmi2Real time, fmi2Real step, fmi2Boolean no_return) {
  Instance *c = (Instance *)component;
  (void)no_return;
  if (!allowed(c, STEPPING, "fmi2DoStep")) return fmi2Error;
  if (!(step >= 0.0) || !pp_finite(step) || !pp_finite(time)) return refuse(c, "A step takes a finite time that is not negative.");
  advance(c, step);
  c->now.time = time + step;
  return fmi2OK;
}

FMI fmi2Status fmi2CancelStep(fmi2Component component) {
  return component ? refuse((Instance *)component, "No step is pending.") : fmi2Error;
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
