/* Memories as differential equations, for simulators that integrate: the rate of what a body remembers.
 *
 * A relaxing body's states are z_ij of each patch j and branch i, with tau_i dz_ij/dt = p_j - z_ij; those of dashpots are
 * their own amplitudes a = q - e, with tau da/dt = q - a, in which the hand's speed does not occur. The last state is the
 * energy that was lost. Indentations and sliders follow the hand's path and not time: they have no such equations.
 */
PP_PART int dashpot(const pp_model *m, int32_t i) { return pp_memory_array(m, 3)->real[i] < IWAN_ENDLESS; }

/* how many continuous states there are; 0 without a memory, and of a memory that has no differential equations */
PP_PART int32_t pp_state_count(const pp_model *m) {
  const int32_t code = m->a[PP_HEAD].whole[PP_MEMORY_CODE];
  int32_t i, count = 1;
  if (code == 1) return pp_memory_array(m, 0)->n[0] * pp_memory_array(m, 2)->n[0] + 1;
  if (code != 3) return 0;
  for (i = 0; i < pp_memory_array(m, 0)->n[0]; i++) {
    if (dashpot(m, i)) count++;
    else if (pp_memory_array(m, 1)->real[i] < IWAN_ENDLESS) return 0;
  }
  return count;
}

/* the element of a dashpot's state */
PP_PART int32_t dashpot_of(const pp_model *m, int32_t state) {
  int32_t i = 0;
  for (;; i++) {
    if (dashpot(m, i) && state-- == 0) return i;
  }
}

/* one continuous state, of what the memory's own step keeps */
PP_PART double pp_state(const pp_model *m, const double *kept, int32_t state) {
  if (state == pp_state_count(m) - 1) return kept[1];
  if (m->a[PP_HEAD].whole[PP_MEMORY_CODE] == 1) return kept[5 + pp_memory_array(m, 0)->n[0] + state];
  return kept[4] - kept[5 + dashpot_of(m, state)];
}

PP_PART void pp_set_state(const pp_model *m, double *kept, int32_t state, double value) {
  const int32_t patches = pp_memory_array(m, 0)->n[0], n = pp_memory_array(m, 2)->n[0];
  if (state == pp_state_count(m) - 1) {
    kept[1] = value;
  } else if (m->a[PP_HEAD].whole[PP_MEMORY_CODE] == 1) {
    kept[5 + patches + state] = value;
    if (value != 0.0) kept[5 + patches * (1 + n) + state / n] = 1.0; /* the patch is awake */
  } else {
    kept[5 + dashpot_of(m, state)] = kept[4] - value;
  }
}

/* rates of all continuous states under the amplitude q; kept: after a step of no time, which has set what is asked */
PP_PART void pp_rates(const pp_model *m, const double *kept, double q, double *rates) {
  const int32_t count = pp_state_count(m);
  double lost = 0.0;
  int32_t i, j, k = 0;
  if (!pp_finite(q)) {
    for (k = 0; k < count; k++) rates[k] = pp_nan();
    return;
  }
  if (m->a[PP_HEAD].whole[PP_MEMORY_CODE] == 1) {
    const int32_t patches = pp_memory_array(m, 0)->n[0], n = pp_memory_array(m, 2)->n[0];
    const double *shares = pp_memory_array(m, 2)->real, *times = pp_memory_array(m, 3)->real;
    const double *phi = kept + 5, *Z = phi + patches, beta = relaxation_beta(q, pp_memory_array(m, 4)->real[0]);
    for (j = 0; j < patches; j++) {
      double y = 0.0, shape;
      for (i = 0; i < n; i++) y += shares[i] * Z[j * n + i];
      shape = phi[j] > beta * y ? beta * phi[j] + (1.0 - beta * beta) * y : y; /* p_j: under the probe, or free */
      for (i = 0; i < n; i++, k++) {
        rates[k] = (shape - Z[k]) / times[i];
        lost += shares[i] * (shape - Z[k]) * rates[k];
      }
    }
  } else {
    for (i = 0; k < count - 1; i++) {
      if (!dashpot(m, i)) continue;
      rates[k++] = kept[5 + i] / pp_memory_array(m, 3)->real[i];
      lost += pp_memory_array(m, 0)->real[i] * kept[5 + i] * kept[5 + i] / pp_memory_array(m, 3)->real[i];
    }
  }
  rates[count - 1] = lost;
}
