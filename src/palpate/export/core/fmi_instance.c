/* An instance of an FMU of either version: its weights, read from resources/weights.bin, and its log.
 *
 * One binary serves every body and both versions of FMI. The weights' SHA-256 must be the guid (2.0) or the
 * instantiation token (3.0) of the model description.
 */
#include <stdarg.h>
#include <stdbool.h>
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

/* of fmi2Status and fmi3Status: numbers, which C turns into either */
#define OK 0
#define WARNING 1
#define DISCARD 2
#define ERROR 3
enum { INSTANTIATED = 1, INITIALIZING = 2, EVENT = 4, CONTINUOUS = 8, STEPPING = 16, TERMINATED = 32 };
#define RUNNING (EVENT | CONTINUOUS | STEPPING)
#define ANY 63
#define SOLVER (INITIALIZING | EVENT | CONTINUOUS | TERMINATED)

/* value references of real variables; parameters of the body follow from PARAMETER on, states from STATE on, and their
 * rates after those; what no hand feels has its inputs from PARAMETER on and its answers from ANSWER on */
enum {
  FX = 3, FY = 4, FZ = 5, ENERGY = 6, DEPTH = 7, DEVIATION = 8, SCALE = 9, STORED = 10, LOST = 11, TIME = 15, PARAMETER = 16,
  DAMPING = 48, MASS = 49, PUSH = 50, SPEED = 53, KINETIC = 56, TORQUE = 57, STATE = 64, ANSWER = 1024,
  ANSWER_DEVIATION = 1 << 25
};

/* everything that changes while an instance lives; the memory's numbers follow it */
typedef struct {
  double x[3], p[PP_MOST], scale, damping, mass, time, force[3], step; /* step: the last one's length */
  double from[3], to[3], velocity[3];                 /* places at the ends of the last step, and its mean velocity */
  double motion[6], push[3];                          /* of a mass: ways, then speeds, along the felt directions; N */
  int phase, stepped, warned, slow, flags, remembers; /* flags at the last event; whether states were set by hand */
} Moment;

#define PP_MOTION 60 /* place of the array (mass, damping) of a body that carries a mass */

typedef struct Instance Instance;
struct Instance {
  pp_array arrays[PP_ARRAYS];
  pp_model model;
  unsigned char *bytes;
  /* of the deviation; what the memory keeps now, before the last step, on trial, and meanwhile; rates */
  double *work, *numbers, *before, *trial, *kept, *rates, *answers; /* answers: those that no hand feels, their deviations, latent ones */
  Moment now, start;
  int32_t parameters, size, states;
  int exchange, known, flags, deviated, rated, probing, damped, moves, untouched; /* untouched: no hand feels it */
  double answer[PP_ANSWER], drag[3], deviation, usual, stored, lost, stiff;
  void (*tell)(Instance *, int, const char *, const char *);
  void (*logger)(void);
  void *environment;
  char name[128];
};

static void say(Instance *c, int status, const char *text) {
  if (c->logger) c->tell(c, status, status == WARNING ? "logStatusWarning" : "logStatusError", text);
}

static int refuse(Instance *c, const char *text) {
  say(c, ERROR, text);
  return ERROR;
}

/* 1 where a call is allowed in the phase that the instance is in */
static int allowed(Instance *c, int phases, const char *call) {
  char text[160];
  if (!c) return 0;
  if (c->now.phase & phases) return 1;
  snprintf(text, sizeof text, "%s may not be called now.", call);
  say(c, ERROR, text);
  return 0;
}

static int digit(char letter) {
  if (letter >= '0' && letter <= '9') return letter - '0';
  if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
  if (letter >= 'A' && letter <= 'F') return letter - 'A' + 10;
  return -1;
}

/* the path of the weights in a folder that is a path, or a file: URI if `is_uri`; 0 where it is none */
static char *path_of(const char *folder, int is_uri) {
  static const char file[] = "/weights.bin";
  const size_t length = strlen(folder);
  const char *from = folder;
  char *path = (char *)malloc(length + sizeof file), *to = path;
  if (!path) return 0;
  if (is_uri && !strncmp(from, "file:", 5)) {
    from += 5;
    if (!strncmp(from, "//localhost/", 12)) from += 11;
    else if (!strncmp(from, "///", 3)) from += 2;
#ifdef _WIN32
    if (from[0] == '/' && from[1] && (from[2] == ':' || from[2] == '|')) from++;
#endif
  } else if (is_uri && strstr(from, "://")) {
    free(path);
    return 0;
  }
  while (*from) {
    if (is_uri && from[0] == '%' && digit(from[1]) >= 0 && digit(from[2]) >= 0) {
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

static FILE *open_file(const char *path) {
#ifdef _WIN32
  wchar_t wide[1024];
  if (MultiByteToWideChar(65001, 0, path, -1, wide, 1024) <= 0) return 0;
  return _wfopen(wide, L"rb");
#else
  return fopen(path, "rb");
#endif
}

static unsigned char *content(const char *path, uint64_t *size) {
  FILE *file = open_file(path);
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

static int same_weights(const unsigned char *bytes, const char *hash) {
  int i;
  for (i = 0; i < 64; i++) {
    if (digit(hash[i]) != ((bytes[32 + i / 2] >> (i % 2 ? 0 : 4)) & 15)) return 0;
  }
  return hash[64] == 0;
}

static void free_instance(Instance *c) {
  if (!c) return;
  free(c->bytes);
  free(c->work);
  free(c->numbers);
  free(c->rates);
  free(c->answers);
  free(c);
}

static void start_motion(Instance *c);
static double stiffness_of(const double *answer);

/* the start that the description tells: the middle of the ranges, where a probe is as high as it may be */
static void go_to_start(Instance *c) {
  const double *low = c->arrays[PP_LIMITS].real, *high = low + c->arrays[PP_LIMITS].n[1];
  const int32_t felt = c->arrays[PP_LIMITS].n[1] - c->parameters;
  double deep[3] = {0.0, 0.0, 0.0}, answer[PP_ANSWER];
  int32_t i, a;
  c->now.phase = INSTANTIATED;
  c->now.scale = 1.0;
  c->now.mass = 0.05;
  for (i = 0; i < c->parameters; i++) c->now.p[i] = 0.5 * (low[felt + i] + high[felt + i]);
  if (c->untouched) {
    c->start = c->now;
    return;
  }
  for (i = 0; i < 3; i++) {
    if (pp_is_probe(c->arrays)) {
      deep[i] = i < 2 ? (low[i] + high[i]) / 2.0 : low[i];
      c->now.x[i] = i < 2 ? deep[i] : high[i];
    } else {
      for (a = 0; a < felt; a++) deep[i] += c->arrays[PP_AXES].real[3 * a + i] * high[a];
    }
  }
  if (c->moves) start_motion(c);
  c->start = c->now;
  /* the usual size of an amplitude, for solvers' tolerances: that of a deep press */
  pp_answer(&c->model, deep, c->now.p, answer);
  c->usual = PP_ABS(answer[PP_AMPLITUDE]);
  c->stiff = stiffness_of(answer);
  if (!pp_finite(c->stiff)) c->stiff = 0.0;
  if (!(c->usual > 0.0) || !pp_finite(c->usual)) c->usual = 1.0;
}

static Instance *fail(Instance *c, const char *format, const char *what) {
  char text[512];
  snprintf(text, sizeof text, format, what);
  say(c, ERROR, text);
  free_instance(c);
  return 0;
}

/* Fill an instance whose log is set, or free it and say why not. */
static Instance *fill(Instance *c, const char *name, const char *hash, const char *resources, int is_uri, int exchange) {
  static const char *const reasons[5] = {"holds other weights than the model description is of",
                                         "is no block of weights that this binary reads", "is damaged",
                                         "holds arrays that do not fit each other", "is of a kind that this binary does not know"};
  uint64_t size = 0;
  char *path;
  int reason;
  if (!name || !*name || !hash || !resources) {
    return fail(c, "%s", "An instance needs a name, a guid or instantiation token, and the place of its resources.");
  }
  strncpy(c->name, name, sizeof c->name - 1);
  path = path_of(resources, is_uri);
  c->bytes = path ? content(path, &size) : 0;
  free(path);
  if (!c->bytes) return fail(c, "The weights could not be read from %.400s.", resources);
  reason = pp_open(c->bytes, size, c->arrays);
  c->untouched = reason == PP_UNKNOWN && pp_is_answers(c->arrays);
  if (c->untouched) reason = pp_answers_fit(c->arrays) ? PP_OPEN : PP_MISFIT;
  if (reason != PP_OPEN || !same_weights(c->bytes, hash)) return fail(c, "resources/weights.bin %s.", reasons[reason]);
  c->model.a = c->arrays;
  c->parameters = c->arrays[PP_HEAD].whole[PP_INPUTS] - c->arrays[PP_HEAD].whole[PP_FELT];
  c->size = c->arrays[PP_HEAD].whole[PP_MEMORY_CODE] ? 4 + c->arrays[PP_HEAD].whole[PP_STATE] : 0;
  c->moves = !c->untouched && !c->size && pp_is(&c->arrays[PP_MOTION], 2, 1, 1) && c->arrays[PP_MOTION].real[0] > 0.0;
  c->states = c->moves ? 2 * c->arrays[PP_HEAD].whole[PP_FELT] : pp_state_count(&c->model);
  c->exchange = exchange;
  if (exchange && c->size && !c->states) {
    return fail(c, "%s", "What this body remembers follows the path of the hand and no differential equation: take co-simulation.");
  }
  c->work = (double *)calloc((size_t)pp_deviation_size(&c->model) + 1, sizeof(double));
  c->numbers = (double *)calloc(4 * (size_t)c->size + 1, sizeof(double));
  c->rates = (double *)calloc((size_t)c->states + 1, sizeof(double));
  if (c->untouched) {
    c->answers = (double *)calloc(2 * (size_t)pp_answer_count(&c->model) + (size_t)pp_latent_count(&c->model), sizeof(double));
    if (!c->answers) return fail(c, "%s", "There is no memory for an instance.");
  }
  if (!c->work || !c->numbers || !c->rates) return fail(c, "%s", "There is no memory for an instance.");
  c->before = c->numbers + c->size;
  c->trial = c->before + c->size;
  c->kept = c->trial + c->size;
  go_to_start(c);
  return c;
}

static void reset(Instance *c) {
  c->now = c->start;
  memset(c->numbers, 0, 2 * (size_t)c->size * sizeof(double));
  c->known = 0;
}
