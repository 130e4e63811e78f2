/* The core for a page: one body in one module, whose memory the page writes and reads.
 *
 * The page puts the block where `room` says, opens it, and then writes a place (3), m, and parameters to `asked`.
 */
#include <stdint.h>
#define PP_EXPORT(name) __attribute__((export_name(name)))

#define WASM_FIELDS 16

static pp_array wasm_arrays[PP_ARRAYS];
static const pp_model wasm_model = {wasm_arrays};
static pp_array wasm_further[WASM_FIELDS][PP_ARRAYS]; /* of further fields of the same body */
static int32_t wasm_fields;                           /* how many these are */
static pp_array wasm_network[PP_ARRAYS];              /* a network of its own, such as that of a bent line */
static pp_real wasm_asked[3 + PP_MOST], wasm_answer[PP_ANSWER + 1], wasm_torque[3];
static pp_real *wasm_work; /* behind the block: for the deviation, the state of the memory, the shape of a touch */
static pp_real *wasm_state, *wasm_shape;
extern uint8_t __heap_base;

/* where a block may begin */
PP_EXPORT("room") uint32_t wasm_room(void) { return ((uint32_t)(uintptr_t)&__heap_base + 15u) & ~15u; }

/* what is wrong with the block, see core/block.c */
PP_EXPORT("open") int32_t wasm_open(uint32_t size) {
  return pp_open((const uint8_t *)(uintptr_t)wasm_room(), size, wasm_arrays);
}

/* Find the arrays of a further block at `at`; what is wrong with it. */
static int32_t wasm_find(uint32_t at, uint32_t size, pp_array *own) {
  const unsigned char *bytes = (const unsigned char *)(uintptr_t)at;
  int32_t i;
  if (size < PP_BLOCK_HEAD + PP_ARRAYS * PP_BLOCK_ROW || memcmp(bytes, "PALPATE", 8)) return PP_NO_BLOCK;
  if (pp_word(bytes + 16) != size || size % 8) return PP_DAMAGED;
  if (pp_checksum(bytes + PP_BLOCK_HEAD, size - PP_BLOCK_HEAD) != pp_word(bytes + 24)) return PP_DAMAGED;
  for (i = 0; i < PP_ARRAYS; i++) {
    if (!pp_find(bytes, size, bytes + PP_BLOCK_HEAD + PP_BLOCK_ROW * i, &own[i])) return PP_MISFIT;
  }
  return PP_OPEN;
}

/* Open a block at `at` that holds the arrays of one more field and no others; what is wrong with it. */
PP_EXPORT("open_field") int32_t wasm_open_field(uint32_t at, uint32_t size) {
  pp_array *own = wasm_further[wasm_fields];
  int32_t fault, i;
  if (wasm_fields == WASM_FIELDS) return PP_NO_BLOCK;
  fault = wasm_find(at, size, own);
  if (fault != PP_OPEN) return fault;
  own[PP_HEAD] = wasm_arrays[PP_HEAD];
  for (i = 0; i < 3; i++) own[PP_FIELD_SURFACE + i] = wasm_arrays[PP_FIELD_SURFACE + i];
  if (!own[PP_FIELD].whole) return PP_MISFIT;
  wasm_fields++;
  return PP_OPEN;
}

/* Open a block at `at` that holds a network alone; what is wrong with it. */
PP_EXPORT("open_network") int32_t wasm_open_network(uint32_t at, uint32_t size) {
  const int32_t fault = wasm_find(at, size, wasm_network);
  if (fault != PP_OPEN) return fault;
  if (!wasm_network[PP_HEAD].whole || !wasm_network[PP_NET + PP_SIZES].whole) return PP_MISFIT;
  return wasm_network[PP_HEAD].whole[PP_INPUTS] <= PP_MOST ? PP_OPEN : PP_MISFIT;
}

static int32_t wasm_size_of(const pp_array *arrays) {
  const pp_model model = {arrays};
  return arrays[PP_FIELD].whole ? pp_shape_size(&model) : 0;
}

/* the arrays of field k, 0 being that of the body's own block */
static const pp_array *wasm_field(int32_t k) { return k > 0 && k <= wasm_fields ? wasm_further[k - 1] : wasm_arrays; }

/* bytes that are needed behind sound blocks, `size` bytes of all together */
PP_EXPORT("needs") uint32_t wasm_needs(uint32_t size) {
  const uint32_t state = 4u + (uint32_t)wasm_arrays[PP_HEAD].whole[PP_STATE];
  uint32_t shape = 0u;
  int32_t k;
  const uint32_t work = (uint32_t)pp_deviation_size(&wasm_model);
  wasm_work = (pp_real *)(uintptr_t)((wasm_room() + size + 15u) & ~15u);
  wasm_state = wasm_work + work;
  wasm_shape = wasm_state + state;
  for (k = 0; k <= wasm_fields; k++) {
    const uint32_t own = (uint32_t)wasm_size_of(wasm_field(k));
    shape = own > shape ? own : shape;
  }
  if (wasm_network[PP_HEAD].whole) { /* outputs, and the latent ones behind them */
    const int32_t both = wasm_network[PP_HEAD].whole[PP_OUTPUTS] + wasm_network[PP_NET + PP_SIZES].whole[4];
    shape = (uint32_t)both > shape ? (uint32_t)both : shape;
  }
  return (work + state + shape) * (uint32_t)sizeof(pp_real) + 32u;
}

/* places (bytes) of what is asked, of the answer with the deviation behind it, of the shape, and of the memory's state */
PP_EXPORT("asked") uint32_t wasm_asked_at(void) { return (uint32_t)(uintptr_t)wasm_asked; }
PP_EXPORT("answered") uint32_t wasm_answer_at(void) { return (uint32_t)(uintptr_t)wasm_answer; }
PP_EXPORT("shaped") uint32_t wasm_shape_at(void) { return (uint32_t)(uintptr_t)wasm_shape; }
PP_EXPORT("state") uint32_t wasm_state_at(void) { return (uint32_t)(uintptr_t)wasm_state; }

/* numbers of a shape of field k: eight of the frame, the further inputs, 1, coefficients, profile */
PP_EXPORT("shape_size") int32_t wasm_shape_size(int32_t k) { return wasm_size_of(wasm_field(k)); }

/* Energy, depth, force, stiffness and the rest; the flags. */
PP_EXPORT("answer") int32_t wasm_ask(void) { return pp_answer(&wasm_model, wasm_asked, wasm_asked + 3, wasm_answer); }

/* The same, with the deviation of the force behind the answer. */
PP_EXPORT("trust") int32_t wasm_trust(void) {
  const int32_t flags = wasm_ask();
  wasm_answer[PP_ANSWER] = pp_deviation(&wasm_model, wasm_asked, wasm_asked + 3, wasm_answer, wasm_work);
  return flags;
}

/* The answer after dt seconds, the force being that of the body with its memory. */
PP_EXPORT("step") int32_t wasm_step(pp_real dt) {
  int32_t flags = wasm_ask();
  if (wasm_arrays[PP_HEAD].whole[PP_MEMORY_CODE] == 0) return flags;
  if (!pp_step(&wasm_model, wasm_state, wasm_asked, wasm_answer[PP_AMPLITUDE], wasm_answer + PP_SLOPE, dt,
                   wasm_answer + PP_FORCE)) {
    flags |= PP_NOT_A_NUMBER; /* and the force is zero */
  }
  return flags;
}

/* Let go for dt seconds of a body that lies elsewhere after a touch: what was asked becomes the place where it then lies, and
 * the answer there has no force; the flags. Any other body is answered where it is. */
PP_EXPORT("release") int32_t wasm_release(pp_real dt) {
  const pp_real *axis = wasm_arrays[PP_AXES].real; /* the one direction that is felt */
  int32_t flags = wasm_ask();
  int i, k;
  if (flags & PP_NOT_A_NUMBER || !pp_finite(dt) || dt < R(0)) return flags | PP_NOT_A_NUMBER;
  if (wasm_arrays[PP_HEAD].whole[PP_MEMORY_CODE] == 3) {
    const pp_real wanted = iwan_elements_release(&wasm_model, wasm_state, dt);
    for (k = 0; k < 12; k++) { /* Newton's method: the amplitude grows with the place along the axis */
      const pp_real *s = wasm_answer + PP_SLOPE, steep = axis[0] * s[0] + axis[1] * s[1] + axis[2] * s[2];
      const pp_real missing = wanted - wasm_answer[PP_AMPLITUDE];
      if (!(steep > R(0)) || PP_ABS(missing) <= R(1e-12) * PP_ABS(wanted)) break;
      for (i = 0; i < 3; i++) wasm_asked[i] += missing / steep * axis[i];
      flags = wasm_ask();
    }
  }
  for (i = 0; i < 3; i++) wasm_answer[PP_FORCE + i] = R(0);
  return flags;
}

/* Torque (3) on the tool about its place, at what was asked, of the force in the answer; its place in bytes. */
PP_EXPORT("torque") uint32_t wasm_torque_at(void) {
  pp_torque(&wasm_model, wasm_asked, wasm_asked + 3, wasm_answer + PP_FORCE, wasm_torque);
  return (uint32_t)(uintptr_t)wasm_torque;
}

/* Go back to a body that nothing was done to. */
PP_EXPORT("start") void wasm_start(void) {
  memset(wasm_state, 0, (4u + (size_t)wasm_arrays[PP_HEAD].whole[PP_STATE]) * sizeof *wasm_state);
}

/* Find the shape of a touch by field k. */
PP_EXPORT("touch") int32_t wasm_touch(int32_t k) {
  const pp_model model = {wasm_field(k)};
  return pp_touch_shape(&model, wasm_asked, wasm_asked + 3, wasm_shape);
}

/* Outputs of the network at the inputs that were asked, in place of a shape. */
PP_EXPORT("predict") void wasm_predict(void) {
  const pp_array *net = wasm_network + PP_NET;
  const int32_t outputs = wasm_network[PP_HEAD].whole[PP_OUTPUTS], n = net[PP_SIZES].whole[0], count = net[PP_SIZES].whole[4];
  const pp_real *modes = net[PP_TAIL].real + (1 + n) * count;
  pp_real xi[PP_MOST], *latent = wasm_shape + outputs;
  int32_t o, k;
  pp_scale(net, wasm_asked, xi);
  pp_latent(net, xi, latent, 0);
  for (o = 0; o < outputs; o++) {
    if (net[PP_TAIL].n[0] == (1 + n) * count) { /* the latent outputs are the outputs */
      wasm_shape[o] = latent[o];
      continue;
    }
    wasm_shape[o] = modes[o];
    for (k = 0; k < count; k++) wasm_shape[o] += latent[k] * modes[(1 + k) * outputs + o];
  }
}
