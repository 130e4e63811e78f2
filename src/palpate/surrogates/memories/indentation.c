/* Depths that stay where a body was pressed: indentation.py in C99.
 *
 * arrays: 0 residual p, 1 reach Q, 2 stiffening at the knots (m); 3 places (n, 3); 4 width
 * state after the ledger: p_j (n), then their weights (n) as workspace
 */
PP_PART int32_t indentation_piece(pp_real x, const pp_array *knots) {
  int32_t i = 0;
  while (i < knots->n[0] - 2 && x >= knots->real[i + 1]) i++;
  return i;
}

PP_PART pp_real indentation_stiffening(const pp_model *m, pp_real p, pp_real *slope) {
  const pp_array *residual = pp_memory_array(m, 0);
  const pp_real *table = pp_memory_array(m, 2)->real;
  const int32_t last = residual->n[0] - 1;
  int32_t i;
  *slope = R(0);
  if (p >= residual->real[last]) return table[last];
  i = indentation_piece(p, residual);
  *slope = (table[i + 1] - table[i]) / (residual->real[i + 1] - residual->real[i]);
  return table[i] + *slope * (p - residual->real[i]);
}

PP_PART pp_real indentation_virgin(const pp_model *m, pp_real q) {
  const pp_real *residual = pp_memory_array(m, 0)->real, *reach = pp_memory_array(m, 1)->real;
  const int32_t last = pp_memory_array(m, 1)->n[0] - 1;
  pp_real p;
  int32_t i;
  if (q <= reach[0]) return R(0);
  i = indentation_piece(q, pp_memory_array(m, 1));
  p = residual[i] + (residual[i + 1] - residual[i]) * (q - reach[i]) / (reach[i + 1] - reach[i]);
  if (q > reach[last]) p = pp_least(p, q - (reach[last] - residual[last]));
  return p;
}

PP_PART pp_real indentation_stored(const pp_model *m, pp_real q, pp_real p) {
  pp_real unused;
  const pp_real over = pp_most(q - p, R(0));
  return R(0.5) * indentation_stiffening(m, p, &unused) * over * over;
}

PP_PART int indentation_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope, pp_real dt,
                             pp_real *force) {
  const pp_array *points = pp_memory_array(m, 3);
  const int32_t n = points->n[0];
  const pp_real width = pp_memory_array(m, 4)->real[0];
  pp_real *depths = state + 4, *weights = depths + n;
  pp_real nearest = R(1e30), total = R(0), mean[3], p = R(0), moved, wanted, stored, lost, kappa, bend, over, driving, along[3];
  int32_t j;
  int a;
  (void)dt;
  for (a = 0; a < 3; a++) force[a] = mean[a] = along[a] = R(0);
  if (!pp_finite(q + x[0] + slope[0] + x[1] + slope[1] + x[2] + slope[2]) || q < R(0)) return 0;
  for (j = 0; j < n; j++) {
    pp_real square = R(0);
    for (a = 0; a < 3; a++) square += (x[a] - points->real[3 * j + a]) * (x[a] - points->real[3 * j + a]);
    weights[j] = square;
    nearest = pp_least(nearest, square);
  }
  for (j = 0; j < n; j++) {
    weights[j] = PP_EXP((nearest - weights[j]) / (R(2) * width * width));
    total += weights[j];
  }
  for (j = 0; j < n; j++) {
    weights[j] /= total;
    for (a = 0; a < 3; a++) mean[a] += weights[j] * points->real[3 * j + a];
    p += weights[j] * depths[j];
  }
  moved = indentation_stored(m, q, p);
  wanted = indentation_virgin(m, q);
  if (wanted > p) {
    pp_real squares = R(0);
    for (j = 0; j < n; j++) squares += weights[j] * weights[j];
    for (j = 0; j < n; j++) depths[j] += (wanted - p) * weights[j] / squares;
    p = wanted;
  }
  stored = indentation_stored(m, q, p);
  lost = pp_most(moved - stored, R(0));
  state[2] += stored - state[0] + lost;
  state[0] = stored;
  state[1] += lost;
  state[3] = lost;
  if (q <= p) return 1;
  kappa = indentation_stiffening(m, p, &bend);
  for (j = 0; j < n; j++) {
    for (a = 0; a < 3; a++) along[a] += depths[j] * weights[j] * (points->real[3 * j + a] - mean[a]) / (width * width);
  }
  over = q - p;
  driving = kappa * over - R(0.5) * bend * over * over;
  for (a = 0; a < 3; a++) force[a] = -kappa * over * slope[a] + driving * along[a];
  return 1;
}
