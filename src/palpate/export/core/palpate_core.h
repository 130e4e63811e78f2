/* The evaluator core of palpate: energy, force, stiffness, memory and field of a learnt body, from a block of weights.
 *
 *     U(x, p) = U0(x, p) exp l(x, p) - offset        F = -dU/dx
 *
 * Everything is read-only but what the caller hands in: no heap, no variable that is written, no input or output, so
 * any number of threads may share one model. The length of every loop depends on the model alone, never on x or p.
 * Each function does what the compiled Python function of the same name does; the Python files say why.
 *
 * A model is a list of arrays, one for each place below. The binary block and the tables of an exported C file hold
 * the same arrays in the same order (docs/method/weights-block.md).
 */
#ifndef PALPATE_CORE_H
#define PALPATE_CORE_H

#include <stdint.h>

#ifdef PP_SINGLE
typedef float pp_real;
#else
typedef double pp_real;
#endif

/* one array of a model: the pointer of its own kind of number is set, all others are 0; tiles have places in `whole` */
typedef struct {
  const pp_real *real;
  const int32_t *whole;
  const float *brief;
  const int16_t *small;
  const char *digits; /* of tiles of whole numbers: see pp_gather_digits in surface.c */
  int32_t n[4]; /* its shape, filled up with ones; a missing array has n[0] = 0 */
} pp_array;

typedef struct {
  const pp_array *a; /* PP_ARRAYS of them */
} pp_model;

/* places of the arrays */
enum {
  PP_HEAD = 0,      /* whole numbers, see below */
  PP_NUMBERS = 1,   /* radius of the trained region, s*, its width, depth at which a body lets go, usual radius */
  PP_LIMITS = 2,    /* (3, n): low and high ends of the inputs, ways over which l is followed beyond them */
  PP_POINTS = 3,    /* (n, S): scaled trained points, S filled up to a multiple of PP_LANES with far ones */
  PP_AXES = 4,      /* (k, 3): directions of the felt coordinates */
  PP_NET = 5,       /* l: PP_NET_ARRAYS arrays */
  PP_ROOT = 10,     /* root of the covariance of l's coefficients, column by column, in single precision */
  PP_BASELINE = 12, /* arguments of the baseline */
  PP_MEMORY = 24,   /* arguments of the memory */
  PP_FIELD = 36,    /* the field: see field.c */
  PP_FIELD_NET = 44,
  PP_FIELD_SURFACE = 49, /* frame, coefficients, profile of the surface that a field is of */
  PP_ARM = 56, /* torque per newton on a tool: a network of three outputs on the scales of l, see torque.c */
  PP_ARRAYS = 64
};

/* a network's arrays, counted from its first place */
enum {
  PP_SIZES = 0,  /* n inputs, e entries of a factor, r rows of it, h units, latent outputs, radial function, pairs */
  PP_SCALES = 1, /* (2, n): centre and half width of each input; of answers a third row may hold their bends */
  PP_LAYOUT = 2, /* (e, 2): row and column of each entry */
  PP_UNITS = 3,  /* (groups, e + r + pairs + latent, PP_LANES): entries, shifts, entries of A'A, weights */
  PP_TAIL = 4,   /* (1 + n, latent): constant and slopes; then (1 + latent, m) offset and modes of many outputs */
  PP_NET_ARRAYS = 5
};

/* places in the head */
enum { PP_INPUTS = 0, PP_FELT = 1, PP_BASELINE_CODE = 2, PP_MEMORY_CODE = 3, PP_OUTPUTS = 4, PP_RADIUS_INPUT = 5, PP_STATE = 6 };

/* what came of a call */
enum {
  PP_CONTACT = 1,      /* the probe touches the body, or the body is held */
  PP_TRUSTED = 2,      /* inside the trained region; without contact the answer is exact and counts as inside */
  PP_NOT_A_NUMBER = 4, /* an input was no finite number, or an answer is none: nothing pushes, the rest is not-a-number */
  PP_TOO_DEEP = 8      /* so far inside that the body should let go of the probe: take the force for zero */
};

#define PP_LANES 8  /* units that are evaluated together */
#define PP_MOST 16  /* inputs of a network, and rows of a factor */
#define PP_ANSWER 19
/* places in an answer: U (J), s (m), F (N), dF/dx row by row (N/m), U + offset, q, its slope */
enum { PP_ENERGY = 0, PP_DEPTH = 1, PP_FORCE = 2, PP_STIFFNESS = 5, PP_PLAIN = 14, PP_AMPLITUDE = 15, PP_SLOPE = 16 };

/* what the parts of one evaluation hand to each other */
typedef struct {
  pp_real base[4];                  /* U0, s, offset, the signed root of 2 U0 */
  pp_real gradient[3], hessian[9];  /* of U0 by x */
  pp_real root[3];                  /* slope of the signed root by x */
  pp_real slope[3], log[9];         /* of l by x */
  pp_real outward[3], surface[9];   /* of the distance to a touched surface by x */
  pp_real moved[3];                 /* where l is asked */
  pp_real line[PP_MOST], at[PP_MOST], xi[PP_MOST]; /* inputs, saturated, scaled */
  pp_real by[PP_MOST], twice[PP_MOST];             /* slopes and curvatures of the saturated inputs */
} pp_work;

#endif
