/* A learnt body for the engine of a scene: a handle that owns a copy of its weights block, its memory and its shape.
 *
 * One library serves every body. A handle belongs to one thread at a time. The checksum tells a block that was damaged
 * on its way; the arrays of a field are not looked at one by one, since the block comes with the library.
 */
#include <stdlib.h>

#ifdef _WIN32
#define PALPATE_API __declspec(dllexport)
#else
#define PALPATE_API __attribute__((visibility("default")))
#endif

typedef struct {
  pp_array arrays[PP_ARRAYS];
  pp_model model;
  pp_real *state, *shape; /* behind the block */
} palpate_body;

static int32_t engine_remembers(const palpate_body *body) { return body->arrays[PP_HEAD].whole[PP_MEMORY_CODE] > 0; }

/* go back to a body that nothing was done to */
PALPATE_API void palpate_restart(palpate_body *body) {
  memset(body->state, 0, (4u + (size_t)body->arrays[PP_HEAD].whole[PP_STATE]) * sizeof *body->state);
}

/* Return a body of a block of `size` bytes, or 0 and in `fault` what is wrong with it: see core/block.c; 5: no memory. */
PALPATE_API palpate_body *palpate_open(const unsigned char *bytes, int32_t size, int32_t *fault) {
  const size_t whole = size < 0 ? 0u : ((size_t)size + 15u) & ~(size_t)15u;
  const size_t head = (sizeof(palpate_body) + 15u) & ~(size_t)15u;
  palpate_body *body = (palpate_body *)malloc(head + whole), *larger;
  size_t numbers;
  *fault = 5;
  if (!body) return 0;
  memcpy((char *)body + head, bytes, size < 0 ? 0u : (size_t)size);
  *fault = pp_open((const unsigned char *)body + head, size < 0 ? 0u : (uint64_t)size, body->arrays);
  if (*fault != PP_OPEN) {
    free(body);
    return 0;
  }
  body->model.a = body->arrays;
  numbers = 4u + (size_t)body->arrays[PP_HEAD].whole[PP_STATE];
  if (body->arrays[PP_FIELD].whole) numbers += (size_t)pp_shape_size(&body->model);
  larger = (palpate_body *)realloc(body, head + whole + numbers * sizeof(pp_real));
  if (!larger) {
    free(body);
    *fault = 5;
    return 0;
  }
  body = larger; /* which may lie elsewhere */
  pp_open((const unsigned char *)body + head, (uint64_t)size, body->arrays);
  body->model.a = body->arrays;
  body->state = (pp_real *)(void *)((char *)body + head + whole);
  body->shape = body->state + 4 + body->arrays[PP_HEAD].whole[PP_STATE];
  palpate_restart(body);
  return body;
}

PALPATE_API void palpate_close(palpate_body *body) { free(body); }

/* Sizes (6): inputs, felt coordinates, parameters, nodes and components of the field, 1 with a memory. */
PALPATE_API void palpate_sizes(const palpate_body *body, int32_t *sizes) {
  const int32_t *head = body->arrays[PP_HEAD].whole, *field = body->arrays[PP_FIELD].whole;
  sizes[0] = head[PP_INPUTS];
  sizes[1] = head[PP_FELT];
  sizes[2] = head[PP_INPUTS] - head[PP_FELT];
  sizes[3] = field ? field[PP_NODES] : 0;
  sizes[4] = field ? field[PP_COMPONENTS] : 0;
  sizes[5] = engine_remembers(body);
}

/* trained ranges of all inputs: the felt coordinates (m), then the parameters */
PALPATE_API void palpate_limits(const palpate_body *body, double *low, double *high) {
  const pp_array *limits = &body->arrays[PP_LIMITS];
  memcpy(low, limits->real, (size_t)limits->n[1] * sizeof *low);
  memcpy(high, limits->real + limits->n[1], (size_t)limits->n[1] * sizeof *high);
}

/* Everything at once (19) at x (3), m, and parameters p, without the memory: see palpate_core.h; the flags. */
PALPATE_API int32_t palpate_answer(const palpate_body *body, const double *x, const double *p, double *answer) {
  return pp_answer(&body->model, x, p, answer);
}

/* The same after the hand moved there within dt seconds: the force is that of the body with its memory. */
PALPATE_API int32_t palpate_step(palpate_body *body, double dt, const double *x, const double *p, double *answer) {
  const int32_t flags = pp_answer(&body->model, x, p, answer);
  if (!engine_remembers(body)) return flags;
  if (pp_step(&body->model, body->state, x, answer[PP_AMPLITUDE], answer + PP_SLOPE, dt, answer + PP_FORCE)) return flags;
  return flags | PP_NOT_A_NUMBER; /* and the force is zero */
}

/* Fill the torque (3) on a tool about its place, N m, at x and p, of a force (3) that it feels there; zero of all others. */
PALPATE_API void palpate_torque(const palpate_body *body, const double *x, const double *p, const double *force, double *torque) {
  pp_torque(&body->model, x, p, force, torque);
}

/* Let go of the body for dt seconds: x (3), where the hand held it, becomes the place where it lies then; the flags. */
PALPATE_API int32_t palpate_release(palpate_body *body, double dt, double *x, const double *p) {
  const pp_real *axis = body->arrays[PP_AXES].real; /* the one direction that is felt */
  double answer[PP_ANSWER], wanted;
  int32_t flags = pp_answer(&body->model, x, p, answer);
  int i, k;
  if (flags & PP_NOT_A_NUMBER || !pp_finite(dt) || dt < R(0)) return flags | PP_NOT_A_NUMBER;
  if (body->arrays[PP_HEAD].whole[PP_MEMORY_CODE] != 3) return flags;
  wanted = iwan_elements_release(&body->model, body->state, dt);
  for (k = 0; k < 12; k++) { /* Newton's method: the amplitude grows with the place along the axis */
    const double *s = answer + PP_SLOPE, steep = axis[0] * s[0] + axis[1] * s[1] + axis[2] * s[2];
    const double missing = wanted - answer[PP_AMPLITUDE];
    if (!(steep > R(0)) || PP_ABS(missing) <= R(1e-12) * PP_ABS(wanted)) break;
    for (i = 0; i < 3; i++) x[i] += missing / steep * axis[i];
    flags = pp_answer(&body->model, x, p, answer);
  }
  return flags;
}

/* Energies of the memory (4), J: stored, lost so far, work of the hand so far, lost in the last step. */
PALPATE_API void palpate_ledger(const palpate_body *body, double *ledger) {
  memcpy(ledger, body->state, 4 * sizeof *ledger);
}

/* Fill the field (nodes, components) of a touch at x and p; the flags. */
PALPATE_API int32_t palpate_shape(palpate_body *body, const double *x, const double *p, double *values) {
  int32_t flags;
  if (!body->arrays[PP_FIELD].whole) return 0;
  flags = pp_touch_shape(&body->model, x, p, body->shape);
  pp_shape_values(&body->model, body->shape, 0, body->arrays[PP_FIELD].whole[PP_NODES], values);
  return flags;
}
