#include <math.h>
#include <string.h>

#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
/* GCC leaves a loop over PP_LANES numbers a loop at -O2; written out, a network takes a quarter less time */
#pragma GCC optimize("peel-loops")
#endif

#ifdef __cplusplus
#define restrict __restrict
#endif

#define R(number) ((pp_real)(number))
#ifdef PP_SINGLE
#define PP_SQRT sqrtf
#define PP_EXP expf
#define PP_EXPM1 expm1f
#define PP_TANH tanhf
#define PP_SIN sinf
#define PP_POW powf
#define PP_CBRT cbrtf
#define PP_ABS fabsf
#else
#define PP_SQRT sqrt
#define PP_EXP exp
#define PP_EXPM1 expm1
#define PP_TANH tanh
#define PP_SIN sin
#define PP_POW pow
#define PP_CBRT cbrt
#define PP_ABS fabs
#endif

/* not every part is used by every body */
#if defined(__GNUC__) || defined(__clang__)
#define PP_PART static __attribute__((unused))
#else
#define PP_PART static
#endif

/* whether a number is finite; a compiler's "fast mathematics" would break this and much else */
PP_PART int pp_finite(pp_real x) { return x - x == R(0); }

PP_PART pp_real pp_least(pp_real a, pp_real b) { return b < a ? b : a; }

PP_PART pp_real pp_most(pp_real a, pp_real b) { return b > a ? b : a; }

PP_PART pp_real pp_nan(void) {
  const pp_real zero = R(0);
  volatile pp_real none = zero; /* asked at run time, so that no compiler complains */
  return none / none;
}

/* whether the body is pressed by a free probe: by the closest point (1), by its overlap (4), by a tool in a pose (5), or
 * pinched by two jaws (6) */
PP_PART int pp_is_probe(const pp_array *a) {
  const int32_t code = a[PP_HEAD].whole[PP_BASELINE_CODE];
  return code == 1 || code >= 4;
}

PP_PART const pp_array *pp_baseline_array(const pp_model *m, int32_t i) { return &m->a[PP_BASELINE + i]; }

PP_PART const pp_array *pp_memory_array(const pp_model *m, int32_t i) { return &m->a[PP_MEMORY + i]; }

PP_PART pp_real pp_infinity(void) {
  const pp_real zero = R(0);
  volatile pp_real none = zero;
  return R(1) / none;
}

/* sigma, its slope and its curvature at t: exact below an edge, and never a width beyond it */
PP_PART pp_real pp_saturated(pp_real t, pp_real edge, pp_real width, pp_real *slope, pp_real *curvature) {
  pp_real h;
  if (t <= edge) {
    *slope = R(1);
    *curvature = R(0);
    return t;
  }
  h = PP_TANH((t - edge) / width);
  *slope = (R(1) - h) * (R(1) + h);
  *curvature = R(-2) * h * *slope / width;
  return edge + width * h;
}

/* A baseline has four functions: NAME_enter, NAME_rest, NAME_log and NAME_leave (docs/guide/export.md). These define
 * the ones that a baseline does without. */
#define PP_NO_REST(name) \
  PP_PART void name##_rest(const pp_model *m, const pp_real *x, pp_work *w) { (void)m, (void)x, (void)w; }
#define PP_NO_LOG(name)                                                                    \
  PP_PART pp_real name##_log(const pp_model *m, const pp_work *w, pp_real *g, pp_real *H) { \
    (void)m, (void)w, (void)g, (void)H;                                                    \
    return R(0);                                                                           \
  }
#define PP_NO_LEAVE(name) \
  PP_PART void name##_leave(const pp_model *m, const pp_real *x, pp_work *w) { (void)m, (void)x, (void)w; }

/* All four of a baseline that is one kernel: NAME_kernel(m, x, p, gradient, hessian, &s) returns U0 (J), its gradient
 * (3) and its Hessian (9) by the place, and the baseline's own coordinate s (m); no contact where s <= 0. */
#define PP_PLAIN_BASELINE(name)                                                              \
  PP_PART int name##_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) { \
    int i;                                                                                   \
    w->base[0] = name##_kernel(m, x, p, w->gradient, w->hessian, &w->base[1]);               \
    w->base[2] = R(0);                                                                       \
    w->base[3] = PP_SQRT(R(2) * pp_most(w->base[0], R(0)));                                  \
    for (i = 0; i < 3; i++) w->root[i] = w->base[3] > R(0) ? w->gradient[i] / w->base[3] : R(0); \
    return w->base[1] > R(0);                                                                \
  }                                                                                          \
  PP_NO_REST(name)                                                                           \
  PP_NO_LOG(name)                                                                            \
  PP_NO_LEAVE(name)
