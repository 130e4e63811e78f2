/* Two rigid jaws that close on a body: pinch_baseline.py in C99; contact_baseline.c and posed_baseline.c come before.
 *
 * arrays: 0 to 3 as those of a posed tool; 4 and 5 the balls (b, 5) of the first and the second jaw, in the body's
 * axes; 6 the axis (3,) along which they close. The parameter is their opening.
 */
PP_PART int pinch_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  static const pp_real unturned[9] = {R(1), R(0), R(0), R(0), R(1), R(0), R(0), R(0), R(1)};
  const pp_real *own = pp_baseline_array(m, 0)->real, *along = pp_baseline_array(m, 6)->real;
  pp_real total = R(0), deepest = -pp_infinity(), place[3], n[3], D[9];
  int i, j, jaw;
  for (i = 0; i < 3; i++) w->gradient[i] = R(0);
  for (i = 0; i < 9; i++) w->hessian[i] = R(0);
  for (jaw = 0; jaw < 2; jaw++) {
    const pp_real half = jaw ? R(-0.5) * p[0] : R(0.5) * p[0];
    pp_real s, slope, bend;
    for (i = 0; i < 3; i++) place[i] = x[i] + half * along[i];
    s = posed_depth_of(m, pp_baseline_array(m, 4 + jaw), place, unturned, n, D);
    if (s > deepest) {
      deepest = s;
      for (i = 0; i < 3; i++) w->outward[i] = n[i];
    }
    if (s <= R(0)) continue;
    total += contact_law(own, s, &slope, &bend);
    for (i = 0; i < 3; i++) {
      w->gradient[i] -= slope * n[i];
      for (j = 0; j < 3; j++) w->hessian[3 * i + j] += bend * n[i] * n[j] - slope * D[3 * i + j];
    }
  }
  w->base[1] = deepest;
  if (deepest <= R(0)) return 0;
  w->base[0] = total;
  w->base[2] = R(0);
  w->base[3] = PP_SQRT(R(2) * total);
  for (i = 0; i < 3; i++) w->root[i] = w->gradient[i] / w->base[3];
  return 1;
}

PP_NO_REST(pinch)

PP_NO_LOG(pinch)

PP_NO_LEAVE(pinch)
