/* Springs that slip or relax, the memory of a held body: iwan_elements.py in C99.
 *
 * arrays: 0 stiffness, 1 limit, 2 hardening, 3 time (n); numbers of 1e29 and more stand for infinity
 * state after the ledger: last q; then elongations (n) and slips (n)
 */
#define IWAN_ENDLESS R(1e29)
#define IWAN_HALVINGS 80 /* of the search for the free state: to the last bit of any bracket */

/* elongation of element i after an even step, and its slip */
PP_PART pp_real iwan_elements_after(const pp_model *m, int32_t i, pp_real e, pp_real alpha, pp_real change, pp_real dt,
                                    pp_real *slip) {
  const pp_real y = pp_memory_array(m, 1)->real[i], c = pp_memory_array(m, 2)->real[i];
  const pp_real tau = pp_memory_array(m, 3)->real[i];
  pp_real trial, over;
  *slip = R(0);
  if (tau < IWAN_ENDLESS) {
    const pp_real t = pp_least(dt / tau, R(700));
    return e * PP_EXP(-t) + (t > R(0) ? -PP_EXPM1(-t) / t : R(1)) * change;
  }
  trial = e + change;
  over = PP_ABS(trial) - y - c * alpha;
  if (over <= R(0)) return trial;
  *slip = over / (R(1) + c);
  return trial > R(0) ? trial - *slip : trial + *slip;
}

/* what element i turns into heat during an even step, J */
PP_PART pp_real iwan_elements_lost(const pp_model *m, int32_t i, pp_real e, pp_real alpha, pp_real slip, pp_real change,
                                   pp_real dt) {
  const pp_real k = pp_memory_array(m, 0)->real[i], tau = pp_memory_array(m, 3)->real[i];
  if (tau < IWAN_ENDLESS) {
    const pp_real t = pp_least(dt / tau, R(700));
    if (t > R(0)) { /* e(t) = A exp(-t/tau) + B */
      const pp_real B = change / t, A = e - B;
      const pp_real once = -PP_EXPM1(-t), twice = -PP_EXPM1(R(-2) * t);
      return pp_most(k * (R(0.5) * A * A * twice + R(2) * A * B * once + B * B * t), R(0));
    }
    return R(0);
  }
  if (slip == R(0)) return R(0); /* a spring's limit is infinite */
  return k * slip * (pp_memory_array(m, 1)->real[i] + pp_memory_array(m, 2)->real[i] * (alpha + R(0.5) * slip));
}

/* take an even step and enter its energies; the pull of all elements */
PP_PART pp_real iwan_elements_advance(const pp_model *m, pp_real *state, pp_real change, pp_real dt) {
  const pp_real *k = pp_memory_array(m, 0)->real, before = state[0];
  const int32_t n = pp_memory_array(m, 0)->n[0];
  pp_real *e = state + 5, *alpha = e + n, stored = R(0), lost = R(0), pull = R(0);
  int32_t i;
  for (i = 0; i < n; i++) {
    pp_real slip;
    const pp_real after = iwan_elements_after(m, i, e[i], alpha[i], change, dt, &slip);
    lost += iwan_elements_lost(m, i, e[i], alpha[i], slip, change, dt);
    e[i] = after;
    alpha[i] += slip;
    stored += R(0.5) * k[i] * after * after;
    pull += k[i] * after;
  }
  state[0] = stored;
  state[1] += lost;
  state[2] += stored - before + lost;
  state[3] = lost;
  return pull;
}

PP_PART int iwan_elements_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope,
                               pp_real dt, pp_real *force) {
  const pp_real change = q - state[4];
  pp_real pull;
  int i;
  (void)x;
  for (i = 0; i < 3; i++) force[i] = R(0);
  if (!pp_finite(change) || !pp_finite(dt) || dt < R(0)) return 0;
  state[4] = q;
  pull = iwan_elements_advance(m, state, change, dt);
  for (i = 0; i < 3; i++) force[i] = -pull * slope[i];
  return 1;
}

/* the pull of all elements after an even step that is not taken */
PP_PART pp_real iwan_elements_pull(const pp_model *m, const pp_real *state, pp_real change, pp_real dt) {
  const pp_real *k = pp_memory_array(m, 0)->real, *e = state + 5;
  const int32_t n = pp_memory_array(m, 0)->n[0];
  pp_real pull = R(0), slip;
  int32_t i;
  for (i = 0; i < n; i++) pull += k[i] * iwan_elements_after(m, i, e[i], e[n + i], change, dt, &slip);
  return pull;
}

/* let go for dt seconds: the amplitude to which the body moves, where nothing pulls */
PP_PART pp_real iwan_elements_release(const pp_model *m, pp_real *state, pp_real dt) {
  const int32_t n = pp_memory_array(m, 0)->n[0];
  pp_real reach = R(0), low, high, change;
  int32_t i;
  for (i = 0; i < n; i++) reach = pp_most(reach, PP_ABS(state[5 + i]));
  /* by then every spring pushes the other way; one that relaxes meanwhile may need more */
  low = -reach;
  high = reach;
  for (i = 0; i < IWAN_HALVINGS; i++) low *= iwan_elements_pull(m, state, low, dt) <= R(0) ? R(1) : R(2);
  for (i = 0; i < IWAN_HALVINGS; i++) high *= iwan_elements_pull(m, state, high, dt) >= R(0) ? R(1) : R(2);
  for (i = 0; i < IWAN_HALVINGS; i++) {
    const pp_real middle = R(0.5) * (low + high);
    if (iwan_elements_pull(m, state, middle, dt) > R(0)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  change = R(0.5) * (low + high);
  iwan_elements_advance(m, state, change, dt);
  state[4] += change;
  return state[4];
}
