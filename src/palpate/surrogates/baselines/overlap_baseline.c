/* A rigid sphere that presses a surface, by its overlap: overlap_baseline.py in C99; contact_baseline.c comes before.
 *
 * arrays: 0 numbers of a contact; 1 to 3 the touched surface, 4 to 6 the field e of the overlap: frame, coefficients,
 * profile
 */
PP_PART int overlap_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  const pp_real *own = pp_baseline_array(m, 0)->real, *numbers = m->a[PP_NUMBERS].real;
  const pp_real s = own[3] - pp_distance(x, w->outward, w->surface, pp_baseline_array(m, 1));
  pp_real slope, bend, depth, unused, none, e[3], E[9], equivalent;
  int i, j;
  (void)p;
  w->base[1] = s;
  if (s <= R(0)) return 0;
  equivalent = own[3] - pp_distance(x, e, E, pp_baseline_array(m, 4));
  if (equivalent < R(0.2) * s || equivalent > R(4) * s) {
    const pp_real factor = equivalent < R(0.2) * s ? R(0.2) : R(4);
    equivalent = factor * s;
    for (i = 0; i < 3; i++) e[i] = factor * w->outward[i];
    for (i = 0; i < 9; i++) E[i] = factor * w->surface[i];
  }
  w->base[0] = contact_law(own, equivalent, &slope, &bend);
  w->base[2] = R(0);
  w->base[3] = PP_SQRT(R(2) * w->base[0]);
  depth = pp_saturated(s, numbers[1], numbers[2], &unused, &none);
  for (i = 0; i < 3; i++) {
    w->gradient[i] = -slope * e[i];
    w->root[i] = w->gradient[i] / w->base[3];
    for (j = 0; j < 3; j++) w->hessian[3 * i + j] = bend * e[i] * e[j] - slope * E[3 * i + j];
    w->moved[i] += (s - depth) * w->outward[i];
  }
  return 1;
}

PP_NO_REST(overlap)

PP_NO_LOG(overlap)

PP_PART void overlap_leave(const pp_model *m, const pp_real *x, pp_work *w) { contact_leave(m, x, w); }
