/* Friction of a tool on a body: friction.py in C99.
 *
 * arrays: those of what the body itself remembers; 10 the springs' depths (n); 11 mu_s, mu_k, rho, m, t_h, and the number
 *         of what is under it
 * state after the ledger: contact, last place (3), k, phi; the springs' forces (n, 3); the ledger and state of what is under it
 * FRICTION_UNDER(code): the step of what is under it, or 0
 */
typedef int (*friction_under)(const pp_model *, pp_real *, const pp_real *, pp_real, const pp_real *, pp_real, pp_real *);

PP_PART int friction_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope, pp_real dt,
                          pp_real *force) {
  const pp_real *law = pp_memory_array(m, 11)->real, *depths = pp_memory_array(m, 10)->real;
  const int32_t n = pp_memory_array(m, 10)->n[0];
  const friction_under under = FRICTION_UNDER((int)law[5]);
  pp_real *hold = state + 4, *springs = hold + 6, *below = springs + 3 * n;
  pp_real steep = R(0), normal = R(0), total = R(0), depth = R(0), lost = R(0), stored = R(0), along = R(0), slipped = R(0);
  pp_real all = R(0.5) * q * q, k, old, mu, healed, change;
  int32_t j;
  int a, touching;
  for (a = 0; a < 3; a++) force[a] = R(0);
  if (!pp_finite(q + dt + x[0] + slope[0] + x[1] + slope[1] + x[2] + slope[2]) || q < R(0) || dt < R(0)) return 0;
  if (under) {
    if (!under(m, below, x, q, slope, dt, force)) return 0;
    all = below[0];
    lost = below[3];
  } else {
    for (a = 0; a < 3; a++) force[a] = -q * slope[a];
  }
  for (a = 0; a < 3; a++) {
    steep += slope[a] * slope[a];
    normal -= force[a] * slope[a];
  }
  steep = PP_SQRT(steep);
  if (steep > R(0) && normal > R(0)) {
    normal /= steep;
    depth = R(0.5) * (law[3] + R(1)) * q / steep;
    for (j = 0; j < n; j++) total += pp_most(depth - depths[j], R(0));
  }
  if (!(hold[0] > R(0))) hold[5] = R(1); /* a state of zeros is one that nothing was done to */
  touching = total > R(0);
  old = hold[4];
  k = touching ? law[2] * normal / total : R(0);
  mu = law[1] + (law[0] - law[1]) * hold[5];
  if (touching && hold[0] > R(0)) {
    for (a = 0; a < 3; a++) along += (x[a] - hold[1 + a]) * slope[a];
    along /= steep * steep;
  }
  change = R(0); /* what the springs lose */
  for (j = 0; j < n; j++) {
    pp_real *f = springs + 3 * j, before = R(0), across = R(0), size = R(0), limit, kept;
    for (a = 0; a < 3; a++) {
      before += f[a] * f[a];
      across += f[a] * slope[a];
    }
    if (before > R(0)) change += before / (R(2) * old);
    if (!touching || depths[j] >= depth) {
      f[0] = f[1] = f[2] = R(0);
      continue;
    }
    limit = mu * normal * (depth - depths[j]) / total;
    if (before > R(0)) {
      across /= steep * steep;
      for (a = 0; a < 3; a++) {
        f[a] -= across * slope[a];
        size += f[a] * f[a];
      }
      size = PP_SQRT(size);
      kept = pp_least(k / old, R(1));
      if (size * kept > limit) kept = limit / size;
      for (a = 0; a < 3; a++) f[a] *= kept;
      change -= size * kept * (size * kept) / (R(2) * k);
    }
    if (hold[0] > R(0)) {
      size = R(0);
      for (a = 0; a < 3; a++) {
        f[a] -= k * (x[a] - hold[1 + a] - along * slope[a]);
        size += f[a] * f[a];
      }
      size = PP_SQRT(size);
      if (size > limit) {
        const pp_real slip = (size - limit) / k;
        if (j == 0) slipped = slip;
        change += limit * slip;
        for (a = 0; a < 3; a++) f[a] *= limit / size;
      }
    }
    size = R(0);
    for (a = 0; a < 3; a++) {
      force[a] += f[a];
      size += f[a] * f[a];
    }
    stored += size / (R(2) * k);
  }
  lost += pp_most(change, R(0));
  hold[0] = touching ? R(1) : R(0);
  hold[4] = k;
  for (a = 0; a < 3; a++) hold[1 + a] = x[a];
  healed = dt / law[4];
  change = healed;
  if (slipped > R(0) && law[0] > R(0)) change += slipped * law[2] / (law[0] * depth);
  if (!touching) hold[5] = R(1);
  else if (change > R(0)) hold[5] = healed / change + (hold[5] - healed / change) * PP_EXP(-change);
  stored += all;
  state[2] += stored - state[0] + lost;
  state[0] = stored;
  state[1] += lost;
  state[3] = lost;
  return 1;
}
