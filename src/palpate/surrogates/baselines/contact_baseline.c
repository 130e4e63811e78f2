/* A rigid sphere that presses a surface: contact_baseline.py in C99.
 *
 * arrays: 0 numbers: twice the law's power, its factor and length a, R, the parameter that R is or -1, a step (m);
 * 1 to 3 the touched surface: frame, coefficients, profile
 */
PP_PART pp_real contact_law(const pp_real *own, pp_real s, pp_real *slope, pp_real *bend) {
  const pp_real power = R(0.5) * own[0], length = own[2], r = s / (length + s);
  pp_real g = own[1];
  if (own[0] == R(5)) g *= PP_SQRT(s);
  if (own[0] == R(6)) g *= s;
  g /= PP_SQRT(R(1) + s / length);
  *slope = g * s * (power - R(0.5) * r);
  *bend = g * (power * (power - R(1)) - power * r + R(0.75) * r * r);
  return g * s * s;
}

/* the law's energy and derivatives at a depth s, whose -ds/dx and -d2s/dx2 are in `outward` and `surface`; whether it
 * touches */
PP_PART int contact_fill(const pp_model *m, pp_real s, pp_work *w) {
  const pp_real *own = pp_baseline_array(m, 0)->real, *numbers = m->a[PP_NUMBERS].real;
  pp_real slope, bend, depth, unused, none;
  int i, j;
  w->base[1] = s;
  if (s <= R(0)) return 0;
  w->base[0] = contact_law(own, s, &slope, &bend);
  w->base[2] = R(0);
  w->base[3] = PP_SQRT(R(2) * w->base[0]);
  depth = pp_saturated(s, numbers[1], numbers[2], &unused, &none);
  for (i = 0; i < 3; i++) {
    w->gradient[i] = -slope * w->outward[i];
    w->root[i] = w->gradient[i] / w->base[3];
    for (j = 0; j < 3; j++) {
      w->hessian[3 * i + j] = bend * w->outward[i] * w->outward[j] - slope * w->surface[3 * i + j];
    }
    w->moved[i] += (s - depth) * w->outward[i];
  }
  return 1;
}

PP_PART int contact_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  const pp_real *own = pp_baseline_array(m, 0)->real;
  const int32_t which = (int32_t)own[4];
  const pp_real radius = which < 0 ? own[3] : p[which];
  return contact_fill(m, radius - pp_distance(x, w->outward, w->surface, pp_baseline_array(m, 1)), w);
}

PP_NO_REST(contact)

PP_NO_LOG(contact)

/* derivative of the distance's Hessian along g, by differences of fourth order */
PP_PART void contact_bend(const pp_model *m, const pp_real *x, const pp_real *g, pp_real *bend) {
  static const pp_real many[4] = {R(1), R(-1), R(2), R(-2)}, weight[4] = {R(8), R(-8), R(-1), R(1)};
#ifdef PP_SINGLE
  const pp_real step = R(30) * pp_baseline_array(m, 0)->real[5]; /* seven digits leave nothing of a small difference */
#else
  const pp_real step = pp_baseline_array(m, 0)->real[5];
#endif
  const pp_real size = PP_SQRT(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  pp_real place[3], unused[3], other[9];
  int i, k;
  for (i = 0; i < 9; i++) bend[i] = R(0);
  if (size == R(0)) return;
  for (k = 0; k < 4; k++) {
    for (i = 0; i < 3; i++) place[i] = x[i] + many[k] * step * g[i] / size;
    pp_distance(place, unused, other, pp_baseline_array(m, 1));
    for (i = 0; i < 9; i++) bend[i] += weight[k] * size / (R(12) * step) * other[i];
  }
}

/* take slopes and curvatures of l through the move to the saturated depth; `bend` is the derivative of -d2s/dx2 along
 * the slopes, and is overwritten */
PP_PART void contact_leave_by(const pp_model *m, pp_work *w, pp_real *bend) {
  const pp_real *numbers = m->a[PP_NUMBERS].real, *D = w->surface, *d = w->outward, *g = w->slope, s = w->base[1];
  pp_real slope, curvature, excess, along, rest, J[9], fresh[3], h[3];
  const pp_real depth = pp_saturated(s, numbers[1], numbers[2], &slope, &curvature);
  int i, j, a, b;
  if (s <= depth) return;
  excess = s - depth;
  along = d[0] * g[0] + d[1] * g[1] + d[2] * g[2];
  rest = R(1) - slope;
  for (i = 0; i < 3; i++) {
    h[i] = D[3 * i] * g[0] + D[3 * i + 1] * g[1] + D[3 * i + 2] * g[2];
    for (j = 0; j < 3; j++) J[3 * i + j] = excess * D[3 * i + j] - rest * d[i] * d[j] + (i == j ? R(1) : R(0));
  }
  for (i = 0; i < 3; i++) {
    fresh[i] = J[3 * i] * g[0] + J[3 * i + 1] * g[1] + J[3 * i + 2] * g[2];
    for (j = 0; j < 3; j++) {
      pp_real total = excess * bend[3 * i + j] - (rest * D[3 * i + j] + curvature * d[i] * d[j]) * along;
      total -= rest * (d[i] * h[j] + h[i] * d[j]);
      for (a = 0; a < 3; a++) {
        for (b = 0; b < 3; b++) total += J[3 * i + a] * w->log[3 * a + b] * J[3 * j + b];
      }
      bend[3 * i + j] = total;
    }
  }
  for (i = 0; i < 3; i++) w->slope[i] = fresh[i];
  for (i = 0; i < 9; i++) w->log[i] = bend[i];
}

PP_PART void contact_leave(const pp_model *m, const pp_real *x, pp_work *w) {
  pp_real bend[9];
  if (w->base[1] <= m->a[PP_NUMBERS].real[1]) return;
  contact_bend(m, x, w->slope, bend);
  contact_leave_by(m, w, bend);
}
