/* The core for a page: one body in one module, whose memory the page writes and reads.
 *
 * The page puts the block where `room` says, opens it, and then writes a place (3), m, and parameters to `asked`.
 */
#include <stdint.h>
#define PP_EXPORT(name) __attribute__((export_name(name)))

static pp_array wasm_arrays[PP_ARRAYS];
static const pp_model wasm_model = {wasm_arrays};
static pp_real wasm_asked[3 + PP_MOST], wasm_answer[PP_ANSWER + 1];
static pp_real *wasm_work; /* behind the block: for the deviation, the state of the memory, the shape of a touch */
static pp_real *wasm_state, *wasm_shape;
extern uint8_t __heap_base;

/* where a block may begin */
PP_EXPORT("room") uint32_t wasm_room(void) { return ((uint32_t)(uintptr_t)&__heap_base + 15u) & ~15u; }

/* what is wrong with the block, see core/block.c */
PP_EXPORT("open") int32_t wasm_open(uint32_t size) {
  return pp_open((const uint8_t *)(uintptr_t)wasm_room(), size, wasm_arrays);
}

/* bytes that are needed behind a sound block */
PP_EXPORT("needs") uint32_t wasm_needs(uint32_t size) {
  const uint32_t state = 4u + (uint32_t)wasm_arrays[PP_HEAD].whole[PP_STATE];
  const uint32_t shape = wasm_arrays[PP_FIELD].whole ? (uint32_t)pp_shape_size(&wasm_model) : 0u;
  const uint32_t work = (uint32_t)pp_deviation_size(&wasm_model);
  wasm_work = (pp_real *)(uintptr_t)((wasm_room() + size + 15u) & ~15u);
  wasm_state = wasm_work + work;
  wasm_shape = wasm_state + state;
  return (work + state + shape) * (uint32_t)sizeof(pp_real) + 32u;
}

/* places (bytes) of what is asked, of the answer with the deviation behind it, of the shape, and of the memory's state */
PP_EXPORT("asked") uint32_t wasm_asked_at(void) { return (uint32_t)(uintptr_t)wasm_asked; }
PP_EXPORT("answered") uint32_t wasm_answer_at(void) { return (uint32_t)(uintptr_t)wasm_answer; }
PP_EXPORT("shaped") uint32_t wasm_shape_at(void) { return (uint32_t)(uintptr_t)wasm_shape; }
PP_EXPORT("state") uint32_t wasm_state_at(void) { return (uint32_t)(uintptr_t)wasm_state; }

/* numbers of a shape: eight of the frame, the further inputs, 1, coefficients, profile */
PP_EXPORT("shape_size") int32_t wasm_shape_size(void) {
  return wasm_arrays[PP_FIELD].whole ? pp_shape_size(&wasm_model) : 0;
}

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
    flags |= PP_NOT_A_NUMBER;
  }
  return flags;
}

/* Go back to a body that nothing was done to. */
PP_EXPORT("start") void wasm_start(void) {
  memset(wasm_state, 0, (4u + (size_t)wasm_arrays[PP_HEAD].whole[PP_STATE]) * sizeof *wasm_state);
}

/* Find the shape of a touch. */
PP_EXPORT("touch") int32_t wasm_touch(void) { return pp_touch_shape(&wasm_model, wasm_asked, wasm_asked + 3, wasm_shape); }
