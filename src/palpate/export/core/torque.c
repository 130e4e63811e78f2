/* Torque on a tool about its place: learnt_torque.py in C99.
 *
 * A network of three outputs at PP_ARM gives the torque per newton of force, m, within its ranges; beyond them that of
 * their border.
 */
PP_PART int pp_tells_torque(const pp_array *arrays) { return arrays[PP_ARM].n[0] > 0; }

/* Fill the torque (3), N m, at a place x (3), m, and parameters p, where the tool feels a force (3), N. */
PP_PART void pp_torque(const pp_model *m, const pp_real *x, const pp_real *p, const pp_real *force, pp_real *torque) {
  const pp_array *net = m->a + PP_ARM;
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
  pp_scale(net, at, xi);
  pp_latent(net, xi, torque, 0);
  for (i = 0; i < 3; i++) torque[i] *= size;
}
