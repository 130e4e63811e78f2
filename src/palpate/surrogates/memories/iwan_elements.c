/* Springs that slip or relax, the memory of a held body: iwan_elements.py in C99.
 *
 * arrays: 0 stiffness, 1 limit, 2 hardening, 3 time (n); numbers of 1e29 and more stand for infinity
 * state after the ledger: last q; then elongations (n) and slips (n)
 */
#define IWAN_ENDLESS R(1e29)

PP_PART int iwan_elements_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope,
                               pp_real dt, pp_real *force) {
  const pp_real *k = pp_memory_array(m, 0)->real, *y = pp_memory_array(m, 1)->real;
  const pp_real *c = pp_memory_array(m, 2)->real, *tau = pp_memory_array(m, 3)->real;
  const int32_t n = pp_memory_array(m, 0)->n[0];
  const pp_real change = q - state[4], before = state[0];
  pp_real *e = state + 5, *alpha = e + n, stored = R(0), lost = R(0), pull = R(0);
  int32_t i;
  (void)x;
  for (i = 0; i < 3; i++) force[i] = R(0);
  if (!pp_finite(change) || !pp_finite(dt) || dt < R(0)) return 0;
  state[4] = q;
  for (i = 0; i < n; i++) {
    pp_real after;
    if (tau[i] < IWAN_ENDLESS) {
      const pp_real t = pp_least(dt / tau[i], R(700));
      after = e[i] * PP_EXP(-t) + (t > R(0) ? -PP_EXPM1(-t) / t : R(1)) * change;
      if (t > R(0)) { /* e(t) = A exp(-t/tau) + B */
        const pp_real B = change / t, A = e[i] - B;
        const pp_real once = -PP_EXPM1(-t), twice = -PP_EXPM1(R(-2) * t);
        lost += pp_most(k[i] * (R(0.5) * A * A * twice + R(2) * A * B * once + B * B * t), R(0));
      }
    } else {
      const pp_real trial = e[i] + change, over = PP_ABS(trial) - y[i] - c[i] * alpha[i];
      after = trial;
      if (over > R(0)) {
        const pp_real slip = over / (R(1) + c[i]);
        after = trial > R(0) ? trial - slip : trial + slip;
        lost += k[i] * slip * (y[i] + c[i] * (alpha[i] + R(0.5) * slip));
        alpha[i] += slip;
      }
    }
    e[i] = after;
    stored += R(0.5) * k[i] * after * after;
    pull += k[i] * after;
  }
  state[0] = stored;
  state[1] += lost;
  state[2] += stored - before + lost;
  state[3] = lost;
  for (i = 0; i < 3; i++) force[i] = -pull * slope[i];
  return 1;
}
