/* A rigid tool in any pose that presses any surface: posed_baseline.py in C99; contact_baseline.c comes before.
 *
 * arrays: 0 numbers: twice the law's power, its factor and length a, the tool's size, a step (m), the order, the scale;
 * 1 to 3 the touched surface: frame, coefficients, profile; 4 the balls (b, 5): centre from the place, radius, share;
 * 5 the tool's fixed rotation (3, 3). The parameters are the components of the rotation vector after it, two or three.
 */
PP_PART void posed_turn(const pp_model *m, const pp_real *angles, pp_real *turn) {
  const pp_real *own = pp_baseline_array(m, 5)->real;
  const int32_t count = m->a[PP_HEAD].whole[PP_INPUTS] - 3;
  pp_real w[3], K[9], square = R(0), angle, first, half, second;
  int i, j;
  for (i = 0; i < 3; i++) {
    w[i] = i < count ? angles[i] : R(0);
    square += w[i] * w[i];
  }
  angle = PP_SQRT(square);
  first = angle > R(1e-8) ? PP_SIN(angle) / angle : R(1);
  half = R(0.5) * angle;
  second = R(0.5);
  if (half > R(1e-8)) second *= (PP_SIN(half) / half) * (PP_SIN(half) / half);
  for (i = 0; i < 3; i++) {
    for (j = 0; j < 3; j++) K[3 * i + j] = second * w[i] * w[j];
    K[4 * i] += R(1) - second * square;
  }
  K[1] -= first * w[2];
  K[2] += first * w[1];
  K[3] += first * w[2];
  K[5] -= first * w[0];
  K[6] -= first * w[1];
  K[7] += first * w[0];
  for (i = 0; i < 3; i++) {
    for (j = 0; j < 3; j++) turn[3 * i + j] = K[3 * i] * own[j] + K[3 * i + 1] * own[3 + j] + K[3 * i + 2] * own[6 + j];
  }
}

/* mean depth s of balls at a place in an orientation, -ds/dx and -d2s/dx2; the least gap where all balls miss */
PP_PART pp_real posed_depth_of(const pp_model *m, const pp_array *balls, const pp_real *x, const pp_real *turn, pp_real *slope,
                               pp_real *bend) {
  const pp_real *own = pp_baseline_array(m, 0)->real, order = own[5], scale = own[6];
  pp_real total = R(0), nearest = -pp_infinity(), at[3], n[3], D[9], mean, factor;
  int32_t k;
  int i, j;
  for (i = 0; i < 3; i++) slope[i] = R(0);
  for (i = 0; i < 9; i++) bend[i] = R(0);
  for (k = 0; k < balls->n[0]; k++) {
    const pp_real *ball = balls->real + 5 * k;
    pp_real s, share, first, second;
    for (i = 0; i < 3; i++) at[i] = x[i] + turn[3 * i] * ball[0] + turn[3 * i + 1] * ball[1] + turn[3 * i + 2] * ball[2];
    s = ball[3] - pp_distance(at, n, D, pp_baseline_array(m, 1));
    nearest = pp_most(nearest, s);
    if (s <= R(0)) continue;
    share = s / scale;
    second = ball[4] * PP_POW(share, order - R(2));
    first = second * share;
    total += first * share;
    for (i = 0; i < 3; i++) {
      slope[i] += first * n[i];
      for (j = 0; j < 3; j++) bend[3 * i + j] += first * D[3 * i + j] - (order - R(1)) / scale * second * n[i] * n[j];
    }
  }
  if (total <= R(0)) return nearest;
  mean = PP_POW(total, R(1) / order);
  factor = PP_POW(mean, R(1) - order);
  for (i = 0; i < 3; i++) slope[i] *= factor;
  for (i = 0; i < 3; i++) {
    for (j = 0; j < 3; j++) bend[3 * i + j] = factor * bend[3 * i + j] + (order - R(1)) / (mean * scale) * slope[i] * slope[j];
  }
  return scale * mean;
}

PP_PART pp_real posed_depth(const pp_model *m, const pp_real *x, const pp_real *turn, pp_real *slope, pp_real *bend) {
  return posed_depth_of(m, pp_baseline_array(m, 4), x, turn, slope, bend);
}

PP_PART int posed_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  pp_real turn[9], s;
  posed_turn(m, p, turn);
  s = posed_depth(m, x, turn, w->outward, w->surface);
  return contact_fill(m, s, w);
}

PP_NO_REST(posed)

PP_NO_LOG(posed)

PP_PART void posed_leave(const pp_model *m, const pp_real *x, pp_work *w) {
  static const pp_real many[4] = {R(1), R(-1), R(2), R(-2)}, weight[4] = {R(8), R(-8), R(-1), R(1)};
#ifdef PP_SINGLE
  const pp_real step = R(30) * pp_baseline_array(m, 0)->real[4];
#else
  const pp_real step = pp_baseline_array(m, 0)->real[4];
#endif
  const pp_real *g = w->slope, size = PP_SQRT(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  pp_real turn[9], place[3], unused[3], other[9], bend[9];
  int i, k;
  if (w->base[1] <= m->a[PP_NUMBERS].real[1]) return;
  for (i = 0; i < 9; i++) bend[i] = R(0);
  posed_turn(m, w->line + 3, turn);
  for (k = 0; k < 4 && size > R(0); k++) {
    for (i = 0; i < 3; i++) place[i] = x[i] + many[k] * step * g[i] / size;
    posed_depth(m, place, turn, unused, other);
    for (i = 0; i < 9; i++) bend[i] += weight[k] * size / (R(12) * step) * other[i];
  }
  contact_leave_by(m, w, bend);
}
