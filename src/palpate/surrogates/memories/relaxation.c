/* Forces that fall while they are held: relaxation_kernels.py in C99.
 *
 * arrays: 0 places of the patches (M, 3); 1 width, amplitude there, least width; 2 shares (n); 3 times (n), s; 4 the pad
 * state after the ledger: last q; then phi (M), z (M, n), whether a patch is awake (M), pattern (M), shares left (3, n)
 */
#define RELAXATION_FAR R(18)     /* patches with less than exp(-18) of the nearest one's share are not touched */
#define RELAXATION_ASLEEP R(1e-9) /* what is remembered below is forgotten */
#define RELAXATION_MOST 64       /* parts of a step at most */

PP_PART pp_real relaxation_reach(const pp_real *place, const pp_real *centre, pp_real width) {
  const pp_real x = place[0] - centre[0], y = place[1] - centre[1], z = place[2] - centre[2];
  return (x * x + y * y + z * z) / (R(2) * width * width);
}

/* the pattern e (M); mean of the places by its shares, and of the reaches, into mean (4) */
PP_PART void relaxation_pattern(const pp_array *points, const pp_real *centre, pp_real width, pp_real *e, pp_real *mean) {
  pp_real least = R(1e30), total = R(0), scale;
  int32_t j;
  int a;
  for (j = 0; j < points->n[0]; j++) {
    e[j] = relaxation_reach(points->real + 3 * j, centre, width);
    least = pp_least(least, e[j]);
  }
  for (a = 0; a < 4; a++) mean[a] = R(0);
  for (j = 0; j < points->n[0]; j++) {
    const pp_real reach = e[j];
    pp_real share;
    e[j] = reach - least < RELAXATION_FAR ? PP_EXP(R(0.5) * (least - reach)) : R(0);
    share = e[j] * e[j];
    total += share;
    mean[3] += share * reach;
    for (a = 0; a < 3; a++) mean[a] += share * points->real[3 * j + a];
  }
  for (a = 0; a < 4; a++) mean[a] /= total;
  scale = R(1) / PP_SQRT(total);
  for (j = 0; j < points->n[0]; j++) e[j] *= scale;
}

PP_PART pp_real relaxation_beta(pp_real q, pp_real pad) {
  pp_real ratio;
  if (pad <= R(0)) return R(1);
  ratio = PP_CBRT(pp_most(q, R(0)) / pad);
  return PP_SQRT(ratio / (R(1) + ratio));
}

PP_PART pp_real relaxation_stored(const pp_real *z, int32_t n, pp_real asked, pp_real beta, const pp_real *shares) {
  pp_real y = R(0), squares = R(0), press;
  int32_t i;
  for (i = 0; i < n; i++) {
    y += shares[i] * z[i];
    squares += shares[i] * z[i] * z[i];
  }
  press = pp_most(asked - beta * y, R(0));
  return R(0.5) * (press * press + squares - y * y);
}

/* let one patch relax under a probe that stays */
PP_PART void relaxation_hold(pp_real *z, int32_t n, pp_real asked, pp_real beta, const pp_real *shares, const pp_real *keep,
                             pp_real weight) {
  pp_real pull = R(0), shape;
  int32_t i;
  for (i = 0; i < n; i++) pull += shares[i] * keep[i] * z[i];
  if (asked * weight > beta * pull) {
    const pp_real give = R(1) - beta * beta;
    shape = (beta * asked + give * pull) / (beta * beta + give * weight);
  } else {
    shape = pull / weight;
  }
  for (i = 0; i < n; i++) z[i] = shape + keep[i] * (z[i] - shape);
}

PP_PART pp_real relaxation_weight(int32_t n, const pp_real *shares, const pp_real *keep) {
  pp_real weight = R(1);
  int32_t i;
  for (i = 0; i < n; i++) weight -= shares[i] * (R(1) - keep[i]);
  return weight;
}

/* hold, move a part of the way to q e at once, hold */
PP_PART void relaxation_advance(const pp_model *m, pp_real *state, pp_real beta, pp_real q, pp_real part, pp_real next) {
  const pp_array *points = pp_memory_array(m, 0), *terms = pp_memory_array(m, 2);
  const int32_t patches = points->n[0], n = terms->n[0];
  const pp_real *shares = terms->real;
  pp_real *phi = state + 5, *Z = phi + patches, *awake = Z + patches * n, *e = awake + patches, *keeps = e + patches;
  pp_real weights[3], total = R(0), lost = R(0), work = R(0);
  int32_t j, i;
  for (i = 0; i < 3; i++) weights[i] = relaxation_weight(n, shares, keeps + i * n);
  for (j = 0; j < patches; j++) {
    const pp_real here = phi[j], there = phi[j] + part * (q * e[j] - phi[j]);
    pp_real *z = Z + j * n, start, held, stored, press, pressed, moved, y = R(0);
    if (here == R(0) && there == R(0)) {
      if (awake[j] != R(0)) {
        int rest = 1;
        start = relaxation_stored(z, n, R(0), R(1), shares);
        relaxation_hold(z, n, R(0), R(1), shares, keeps + 2 * n, weights[2]);
        for (i = 0; i < n; i++) rest = rest && PP_ABS(z[i]) < RELAXATION_ASLEEP;
        if (rest) {
          for (i = 0; i < n; i++) z[i] = R(0);
          awake[j] = R(0);
        }
        stored = relaxation_stored(z, n, R(0), R(1), shares);
        lost += pp_most(start - stored, R(0));
        total += stored;
      }
      continue;
    }
    awake[j] = R(1);
    start = relaxation_stored(z, n, here, beta, shares);
    relaxation_hold(z, n, here, beta, shares, keeps, weights[0]);
    for (i = 0; i < n; i++) y += shares[i] * z[i];
    press = pp_most(here - beta * y, R(0));
    held = relaxation_stored(z, n, here, beta, shares);
    pressed = pp_most(there - next * y, R(0));
    moved = R(0.5) * (pressed - press) * (pressed + press);
    relaxation_hold(z, n, there, next, shares, keeps + n, weights[1]);
    stored = relaxation_stored(z, n, there, next, shares);
    lost += pp_most(start - held, R(0)) + pp_most(held + moved - stored, R(0));
    work += moved;
    total += stored;
    phi[j] = there;
  }
  state[0] = total;
  state[1] += lost;
  state[2] += work;
  state[3] += lost;
}

PP_PART void relaxation_answer(const pp_model *m, const pp_real *state, const pp_real *centre, pp_real q,
                               const pp_real *slope, pp_real width, pp_real wider_by, const pp_real *mean, pp_real *force) {
  const pp_array *points = pp_memory_array(m, 0), *terms = pp_memory_array(m, 2);
  const int32_t patches = points->n[0], n = terms->n[0];
  const pp_real *phi = state + 5, *Z = phi + patches, *e = Z + patches * n + patches;
  const pp_real beta = relaxation_beta(q, pp_memory_array(m, 4)->real[0]);
  pp_real along = R(0), held = R(0), wider = R(0);
  int32_t j, i;
  int a;
  for (j = 0; j < patches; j++) {
    pp_real y = R(0), press;
    for (i = 0; i < n; i++) y += terms->real[i] * Z[j * n + i];
    press = phi[j] - beta * y;
    if (phi[j] <= R(0) || press <= R(0)) continue;
    along += press * e[j];
    held += press * y;
    wider += press * e[j] * (relaxation_reach(points->real + 3 * j, centre, width) - mean[3]);
    for (a = 0; a < 3; a++) {
      force[a] -= R(0.5) * q / (width * width) * press * e[j] * (points->real[3 * j + a] - mean[a]);
    }
  }
  along += wider_by * wider - held * beta * (R(1) - beta * beta) / (R(6) * q);
  for (a = 0; a < 3; a++) force[a] -= along * slope[a];
}

PP_PART int relaxation_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope, pp_real dt,
                            pp_real *force) {
  const pp_array *points = pp_memory_array(m, 0), *terms = pp_memory_array(m, 2);
  const int32_t patches = points->n[0], n = terms->n[0];
  const pp_real *law = pp_memory_array(m, 1)->real, *times = pp_memory_array(m, 3)->real;
  const pp_real pad = pp_memory_array(m, 4)->real[0], before = state[4];
  pp_real *e = state + 5 + patches * (2 + n), *keeps = e + patches, mean[4];
  pp_real grown = law[0] * law[0], whole, width, beta, part, wider_by;
  int32_t parts = 1, i, k;
  for (i = 0; i < 3; i++) force[i] = R(0);
  if (!pp_finite(q + dt + x[0] + slope[0] + x[1] + slope[1] + x[2] + slope[2]) || q < R(0)) return 0;
  if (law[1] > R(0)) {
    const pp_real ratio = q / law[1];
    grown *= PP_CBRT(ratio * ratio);
  }
  whole = pp_most(grown + law[2] * law[2], R(1e-30));
  width = PP_SQRT(whole);
  wider_by = law[1] > R(0) ? grown / (R(3) * whole) : R(0);
  relaxation_pattern(points, x, width, e, mean);
  for (i = 0; i < n; i++) {
    const pp_real ratio = pp_least(dt / (R(0.1) * times[i]), R(RELAXATION_MOST));
    int32_t wanted = (int32_t)ratio;
    if ((pp_real)wanted < ratio) wanted++;
    if (wanted > parts) parts = wanted;
  }
  part = pp_most(dt, R(0)) / (pp_real)parts;
  for (i = 0; i < n; i++) {
    const pp_real t = pp_least(part / times[i], R(700));
    keeps[i] = t > R(0) ? t / PP_EXPM1(t) : R(1);
    keeps[n + i] = t > R(0) ? -PP_EXPM1(-t) / t : R(1);
    keeps[2 * n + i] = PP_EXP(-t);
  }
  beta = relaxation_beta(before, pad);
  state[3] = R(0);
  for (k = 0; k < parts; k++) {
    const pp_real next = relaxation_beta(before + (q - before) * (pp_real)(k + 1) / (pp_real)parts, pad);
    relaxation_advance(m, state, beta, q, R(1) / (pp_real)(parts - k), next);
    beta = next;
  }
  state[4] = q;
  if (q > R(0)) relaxation_answer(m, state, x, q, slope, width, wider_by, mean, force);
  return 1;
}
