/* Torque on a tool about its place: learnt_torque.py in C99.
 *
 * A network of three outputs gives the torque per newton of force, m, within its ranges; beyond them that of their
 * border. Its sizes, layout, units and tail lie at PP_ARM; its scales are those of l.
 */
PP_PART int pp_tells_torque(const pp_array *arrays) { return arrays[PP_ARM].n[0] > 0; }

PP_PART void pp_arm(const pp_array *arrays, pp_array *net) {
  int i;
  net[PP_SIZES] = arrays[PP_ARM];
  net[PP_SCALES] = arrays[PP_NET + PP_SCALES];
  for (i = 1; i < 4; i++) net[PP_SCALES + i] = arrays[PP_ARM + i];
}

/* Fill the torque (3), N m, at a place x (3), m, and parameters p, where the tool feels a force (3), N. */
PP_PART void pp_torque(const pp_model *m, const pp_real *x, const pp_real *p, const pp_real *force, pp_real *torque) {
  pp_array net[PP_NET_ARRAYS];
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS];
  const pp_real size = PP_SQRT(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
  pp_real at[PP_MOST], xi[PP_MOST];
  int32_t i, finite = pp_finite(size) != 0;
  for (i = 0; i < n; i++) {
    const pp_real low = m->a[PP_LIMITS].real[i], high = m->a[PP_LIMITS].real[n + i];
    at[i] = i < 3 ? x[i] : p[i - 3];
    finite = finite && pp_finite(at[i]);
    at[i] = at[i] < low ? low : at[i] > high ? high : at[i];
  }
  for (i = 0; i < 3; i++) torque[i] = R(0);
  if (!finite || size == R(0) || !pp_tells_torque(m->a)) return;
  pp_arm(m->a, net);
  pp_scale(net, at, xi);
  pp_latent(net, xi, torque, 0);
  for (i = 0; i < 3; i++) torque[i] *= size;
}
