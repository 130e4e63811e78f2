"""Texts of exported C files: NAME stands for the name, @…@ for what `c_files` fills in."""

from __future__ import annotations

__all__ = [
    "BODY",
    "BODY_API",
    "CMAKE",
    "EXAMPLE",
    "FIELD_API",
    "FIELD_CODE",
    "HEADER",
    "HEADER_END",
    "LIMITS",
    "MEMORY_API",
    "MEMORY_CODE",
    "NETWORK",
    "NETWORK_API",
    "NETWORK_EXAMPLE",
]

HEADER = """#ifndef NAME_H
#define NAME_H
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef @REAL@ NAME_real;

"""
HEADER_END = """
#ifdef __cplusplus
}
#endif
#endif
"""
BODY_API = """
/* flags that most functions return, added up */
#define NAME_CONTACT 1      /* the probe touches the body, or the body is held */
#define NAME_TRUSTED 2      /* inside the trained region; without contact the answer is exact and counts as inside */
#define NAME_NOT_A_NUMBER 4 /* an input was no finite number, or so large that an answer is none: the force and its */
                            /* derivative are zero, all else is not-a-number */
#define NAME_TOO_DEEP 8     /* so far inside that the body should let go of the probe: take its force for zero */

/* the energy U that the hand has given, J */
int32_t NAME_energy(const NAME_real *x, const NAME_real *p, NAME_real *energy);

/* the force F = -dU/dx (3) on the hand, N */
int32_t NAME_force(const NAME_real *x, const NAME_real *p, NAME_real *force);

/* the force, and its derivative dF/dx (3, 3) row by row, N/m: symmetric */
int32_t NAME_force_jacobian(const NAME_real *x, const NAME_real *p, NAME_real *force, NAME_real *jacobian);

/* everything at once (19): U (J), depth s (m), F (3), dF/dx (9), U before its offset, amplitude q with U = q^2/2, and
 * its slope (3) */
int32_t NAME_answer(const NAME_real *x, const NAME_real *p, NAME_real *answer);

/* standard deviation of the force relative to its size; not-a-number for a body that has none. work: workspace */
int32_t NAME_deviation(const NAME_real *x, const NAME_real *p, NAME_real *work, NAME_real *deviation);

/* Sizes, as numbers that the caller must provide (8): inputs, felt coordinates, parameters, workspace of the deviation,
 * state of the memory, shape of a touch, nodes and components of the field; 0 for what the body has not. */
void NAME_sizes(int32_t *sizes);

/* trained ranges of all inputs: the felt coordinates (m), then the parameters */
void NAME_limits(NAME_real *low, NAME_real *high);

/* SHA-256 of the weights */
const char *NAME_hash(void);
"""
MEMORY_API = """
/* The state of a body that remembers, owned by the caller: numbers only, so it may be copied and kept. The first four
 * are energies in J: stored, lost so far, work of the hand so far, lost in the last step. */
typedef struct {
  NAME_real numbers[@STATE@];
} NAME_state;

/* go back to a body that nothing was done to */
void NAME_start(NAME_state *state);

/* Move the hand to a place within dt seconds and fill the force (3) that the body with its memory answers, N. Where an
 * input is not finite nothing changes, the force is zero, and the flags say so. */
int32_t NAME_step(NAME_state *state, const NAME_real *x, const NAME_real *p, NAME_real dt, NAME_real *force);
"""
RELEASE_API = """
/* Let go of the body for dt seconds. x (3), where the hand held it, becomes the place where it lies then: there nothing
 * pulls. Where an input is not finite nothing changes, and the flags say so. */
int32_t NAME_release(NAME_state *state, NAME_real *x, const NAME_real *p, NAME_real dt);
"""
FIELD_API = """
#define NAME_NODES @NODES@
#define NAME_COMPONENTS @COMPONENTS@

/* the shape of one touch, owned by the caller */
typedef struct {
  NAME_real numbers[@SHAPE@];
} NAME_touch;

/* find the shape of a touch */
int32_t NAME_touched(const NAME_real *x, const NAME_real *p, NAME_touch *touch);

/* fill the field (count, NAME_COMPONENTS) at the nodes from `first` on */
void NAME_shape(const NAME_touch *touch, int32_t first, int32_t count, NAME_real *values);
"""
NETWORK_API = """
/* outputs y (NAME_OUTPUTS) at inputs x (NAME_INPUTS) */
void NAME_evaluate(const NAME_real *x, NAME_real *y);

/* outputs, and their derivatives (NAME_OUTPUTS, NAME_INPUTS) row by row */
void NAME_jacobian(const NAME_real *x, NAME_real *y, NAME_real *jacobian);

/* trained ranges of the inputs */
void NAME_limits(NAME_real *low, NAME_real *high);

/* SHA-256 of the weights */
const char *NAME_hash(void);
"""
BODY = """
void NAME_sizes(int32_t *sizes) {
  static const int32_t own[8] = {@SIZES@};
  memcpy(sizes, own, sizeof own);
}

int32_t NAME_answer(const NAME_real *x, const NAME_real *p, NAME_real *answer) {
  return pp_answer(&NAME_model, x, p, answer);
}

int32_t NAME_energy(const NAME_real *x, const NAME_real *p, NAME_real *energy) {
  pp_real answer[PP_ANSWER];
  const int32_t flags = pp_answer(&NAME_model, x, p, answer);
  *energy = answer[PP_ENERGY];
  return flags;
}

int32_t NAME_force(const NAME_real *x, const NAME_real *p, NAME_real *force) {
  pp_real answer[PP_ANSWER];
  const int32_t flags = pp_answer(&NAME_model, x, p, answer);
  memcpy(force, answer + PP_FORCE, 3 * sizeof *force);
  return flags;
}

int32_t NAME_force_jacobian(const NAME_real *x, const NAME_real *p, NAME_real *force, NAME_real *jacobian) {
  pp_real answer[PP_ANSWER];
  const int32_t flags = pp_answer(&NAME_model, x, p, answer);
  memcpy(force, answer + PP_FORCE, 3 * sizeof *force);
  memcpy(jacobian, answer + PP_STIFFNESS, 9 * sizeof *jacobian);
  return flags;
}

int32_t NAME_deviation(const NAME_real *x, const NAME_real *p, NAME_real *work, NAME_real *deviation) {
  pp_real answer[PP_ANSWER];
  const int32_t flags = pp_answer(&NAME_model, x, p, answer);
  *deviation = pp_deviation(&NAME_model, x, p, answer, work);
  return flags;
}
"""
LIMITS = """
void NAME_limits(NAME_real *low, NAME_real *high) {
  const pp_array *limits = &NAME_model.a[PP_LIMITS];
  memcpy(low, limits->real, (size_t)limits->n[1] * sizeof *low);
  memcpy(high, limits->real + limits->n[1], (size_t)limits->n[1] * sizeof *high);
}

const char *NAME_hash(void) { return "@HASH@"; }
"""
MEMORY_CODE = """
void NAME_start(NAME_state *state) { memset(state, 0, sizeof *state); }

int32_t NAME_step(NAME_state *state, const NAME_real *x, const NAME_real *p, NAME_real dt, NAME_real *force) {
  pp_real answer[PP_ANSWER];
  const int32_t flags = pp_answer(&NAME_model, x, p, answer);
  if (@LAW@_step(&NAME_model, state->numbers, x, answer[PP_AMPLITUDE], answer + PP_SLOPE, dt, force)) return flags;
  return flags | PP_NOT_A_NUMBER; /* and the force is zero */
}
"""
RELEASE_CODE = """
int32_t NAME_release(NAME_state *state, NAME_real *x, const NAME_real *p, NAME_real dt) {
  const pp_real *axis = NAME_model.a[PP_AXES].real; /* the one direction that is felt */
  pp_real answer[PP_ANSWER], wanted;
  int32_t flags = pp_answer(&NAME_model, x, p, answer);
  int i, k;
  if (flags & PP_NOT_A_NUMBER || !pp_finite(dt) || dt < R(0)) return flags | PP_NOT_A_NUMBER;
  wanted = @LAW@_release(&NAME_model, state->numbers, dt);
  for (k = 0; k < 12; k++) { /* Newton's method: the amplitude grows with the place along the axis */
    const pp_real *s = answer + PP_SLOPE, steep = axis[0] * s[0] + axis[1] * s[1] + axis[2] * s[2];
    const pp_real missing = wanted - answer[PP_AMPLITUDE];
    if (steep > R(0) && PP_ABS(missing) > R(1e-12) * PP_ABS(wanted)) {
      for (i = 0; i < 3; i++) x[i] += missing / steep * axis[i];
    }
    flags = pp_answer(&NAME_model, x, p, answer);
  }
  return flags;
}
"""
FIELD_CODE = """
int32_t NAME_touched(const NAME_real *x, const NAME_real *p, NAME_touch *touch) {
  return pp_touch_shape(&NAME_model, x, p, touch->numbers);
}

void NAME_shape(const NAME_touch *touch, int32_t first, int32_t count, NAME_real *values) {
  pp_shape_values(&NAME_model, touch->numbers, first, count, values);
}
"""
NETWORK = """
PP_PART void NAME_outputs(const pp_real *latent, int32_t first, NAME_real *y) {
  const int32_t count = NAME_model.a[PP_NET + PP_SIZES].whole[4], n = NAME_INPUTS;
  const pp_real *modes = NAME_model.a[PP_NET + PP_TAIL].real + (1 + n) * count;
  int32_t o, k;
  if (NAME_model.a[PP_NET + PP_TAIL].n[0] == (1 + n) * count) { /* the latent outputs are the outputs */
    for (o = 0; o < NAME_OUTPUTS; o++) y[o] = latent[o];
    return;
  }
  for (o = 0; o < NAME_OUTPUTS; o++) {
    y[o] = first ? modes[o] : R(0);
    for (k = 0; k < count; k++) y[o] += latent[k] * modes[(1 + k) * NAME_OUTPUTS + o];
  }
}

void NAME_evaluate(const NAME_real *x, NAME_real *y) {
  pp_real xi[PP_MOST], latent[@LATENT@];
  pp_scale(NAME_model.a + PP_NET, x, xi);
  pp_latent(NAME_model.a + PP_NET, xi, latent, 0);
  NAME_outputs(latent, 1, y);
}

void NAME_jacobian(const NAME_real *x, NAME_real *y, NAME_real *jacobian) {
  pp_real xi[PP_MOST], latent[@LATENT@], slopes[NAME_INPUTS * @LATENT@], row[NAME_OUTPUTS];
  int32_t i, o;
  pp_scale(NAME_model.a + PP_NET, x, xi);
  pp_latent(NAME_model.a + PP_NET, xi, latent, slopes);
  NAME_outputs(latent, 1, y);
  for (i = 0; i < NAME_INPUTS; i++) {
    NAME_outputs(slopes + i * @LATENT@, 0, row);
    for (o = 0; o < NAME_OUTPUTS; o++) jacobian[o * NAME_INPUTS + i] = row[o];
  }
}
"""
EXAMPLE = """/* Move the hand along the last felt direction and print the force:
 *     cc -O2 example.c NAME*.c -lm && ./a.out
 */
#include "NAME.h"
#include <stdio.h>

int main(void) {
  static const NAME_real along[NAME_FELT][3] = {@ALONG@};
  static const NAME_real p[] = {@MIDDLE@};
  NAME_real low[NAME_INPUTS], high[NAME_INPUTS], force[3], jacobian[9];
  int i, j, k;
  NAME_limits(low, high);
  for (i = 0; i <= 10; i++) {
    NAME_real x[3] = {0, 0, 0};
    int32_t flags;
    for (k = 0; k < NAME_FELT; k++) {
      const NAME_real share = k == NAME_FELT - 1 ? (NAME_real)i / 10 : (NAME_real)1 / 2;
      for (j = 0; j < 3; j++) x[j] += (high[k] + (low[k] - high[k]) * share) * along[k][j];
    }
    flags = NAME_force_jacobian(x, p, force, jacobian);
    printf("%9.5f %9.5f %9.5f m: %9.4f %9.4f %9.4f N%s\\n", (double)x[0], (double)x[1], (double)x[2], (double)force[0],
           (double)force[1], (double)force[2], flags & NAME_TRUSTED ? "" : " (not trained here)");
  }
  return 0;
}
"""
NETWORK_EXAMPLE = """/* Evaluate the network in the middle of its ranges: cc -O2 example.c NAME.c -lm && ./a.out */
#include "NAME.h"
#include <stdio.h>

int main(void) {
  NAME_real low[NAME_INPUTS], high[NAME_INPUTS], x[NAME_INPUTS], y[NAME_OUTPUTS];
  int i;
  NAME_limits(low, high);
  for (i = 0; i < NAME_INPUTS; i++) x[i] = (low[i] + high[i]) / 2;
  NAME_evaluate(x, y);
  for (i = 0; i < NAME_OUTPUTS; i++) printf("output %d: %.9g\\n", i, (double)y[i]);
  return 0;
}
"""
CMAKE = """cmake_minimum_required(VERSION 3.10)
project(NAME C)
set(CMAKE_C_STANDARD 99)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
add_library(NAME @SOURCES@)
set_target_properties(NAME PROPERTIES POSITION_INDEPENDENT_CODE ON)
if(UNIX)
  target_link_libraries(NAME PUBLIC m)
endif()
add_executable(example example.c)
target_link_libraries(example NAME)
"""
