/* Energy, force, stiffness and amplitude in one pass.
 *
 * The baseline gives four functions, which PP_ENTER, PP_REST, PP_LOG and PP_LEAVE name; see
 * docs/guide/export.md, "A baseline of your own".
 */
PP_PART void pp_feel(const pp_model *m, const pp_real *x, pp_real *line) {
  const pp_real *axes = m->a[PP_AXES].real;
  const int32_t k = m->a[PP_HEAD].whole[PP_FELT];
  int32_t a;
  for (a = 0; a < k; a++) {
    line[a] = k == 3 ? x[a] : axes[3 * a] * x[0] + axes[3 * a + 1] * x[1] + axes[3 * a + 2] * x[2];
  }
}

/* every input saturates beyond its range; slopes and curvatures too */
PP_PART void pp_box(const pp_real *limits, int32_t n, pp_real *line, pp_real *by, pp_real *twice) {
  int32_t i;
  for (i = 0; i < n; i++) {
    const pp_real t = line[i], low = limits[i], high = limits[n + i], width = limits[2 * n + i];
    if (t < low) {
      line[i] = -pp_saturated(-t, -low, width, &by[i], &twice[i]);
      twice[i] = -twice[i];
    } else {
      line[i] = pp_saturated(t, high, width, &by[i], &twice[i]);
    }
  }
}

/* slopes g (k) and curvatures H (k, k) by felt coordinates to those by the place */
PP_PART void pp_to_space(const pp_real *g, const pp_real *H, const pp_real *axes, int32_t k, pp_work *w) {
  int32_t i, j, a, b;
  for (i = 0; i < 3; i++) {
    pp_real total = R(0);
    for (a = 0; a < k; a++) total += k == 3 ? (a == i ? g[a] : R(0)) : axes[3 * a + i] * g[a];
    w->slope[i] = total;
    for (j = 0; j < 3; j++) {
      total = R(0);
      if (k == 3) {
        total = H[3 * i + j];
      } else {
        for (a = 0; a < k; a++) {
          for (b = 0; b < k; b++) total += axes[3 * a + i] * H[k * a + b] * axes[3 * b + j];
        }
      }
      w->log[3 * i + j] = total;
    }
  }
}

PP_PART void pp_assemble(pp_real kappa, const pp_work *w, pp_real *answer) {
  const pp_real value = kappa * w->base[0], root = PP_SQRT(kappa), *b = w->gradient, *g = w->slope;
  int i, j;
  answer[PP_ENERGY] = value - w->base[2];
  answer[PP_DEPTH] = w->base[1];
  answer[PP_PLAIN] = value;
  answer[PP_AMPLITUDE] = w->base[3] * root;
  for (i = 0; i < 3; i++) {
    answer[PP_FORCE + i] = R(0) - (kappa * b[i] + value * g[i]);
    for (j = i; j < 3; j++) {
      const pp_real k = -kappa * (w->hessian[3 * i + j] + (b[i] * g[j] + g[i] * b[j])) -
                        value * (g[i] * g[j] + w->log[3 * i + j]);
      answer[PP_STIFFNESS + 3 * i + j] = k;
      answer[PP_STIFFNESS + 3 * j + i] = k;
    }
    answer[PP_SLOPE + i] = root * (w->root[i] + R(0.5) * w->base[3] * g[i]);
  }
}

/* Whether the inputs are in their ranges, as deep as trained, and near a trained point. */
PP_PART int pp_inside(const pp_model *m, const pp_real *line, pp_real s) {
#ifdef PP_SINGLE
  const pp_real slack = R(1e-6);
#else
  const pp_real slack = R(1e-9);
#endif
  const pp_array *points = &m->a[PP_POINTS], *net = m->a + PP_NET;
  const pp_real *numbers = m->a[PP_NUMBERS].real, *limits = m->a[PP_LIMITS].real;
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS], many = points->n[1];
  pp_real xi[PP_MOST], best[PP_LANES], nearest[PP_LANES], bound;
  int32_t i, p;
  int l, inside = 0;
  if (s > numbers[1] * (R(1) + slack)) return 0;
  for (i = 0; i < n; i++) {
    const pp_real some = slack * (limits[n + i] - limits[i]);
    if (line[i] < limits[i] - some || line[i] > limits[n + i] + some) return 0;
  }
  if (points->n[0] == 0) return 1;
  pp_scale(net, line, xi);
  bound = numbers[0] * numbers[0] * (R(1) + slack);
  for (l = 0; l < PP_LANES; l++) nearest[l] = R(2) * bound;
  for (p = 0; p < many; p += PP_LANES) {
    for (l = 0; l < PP_LANES; l++) best[l] = R(0);
    for (i = 0; i < n; i++) {
      const pp_real *row = points->real + (size_t)i * (size_t)many + (size_t)p;
      for (l = 0; l < PP_LANES; l++) best[l] += (xi[i] - row[l]) * (xi[i] - row[l]);
    }
    for (l = 0; l < PP_LANES; l++) nearest[l] = best[l] < nearest[l] ? best[l] : nearest[l];
  }
  for (l = 0; l < PP_LANES; l++) inside |= nearest[l] <= bound;
  return inside;
}

/* An answer where there is none: nothing pushes, and all else is not-a-number. */
PP_PART int32_t pp_no_answer(pp_real *answer) {
  int32_t i;
  for (i = 0; i < PP_ANSWER; i++) answer[i] = i >= PP_FORCE && i < PP_PLAIN ? R(0) : pp_nan();
  return PP_NOT_A_NUMBER;
}

/* Fill the answer (PP_ANSWER) at a place x (3), m, and parameters p; the flags. */
PP_PART int32_t pp_answer(const pp_model *m, const pp_real *x, const pp_real *p, pp_real *answer) {
  const int32_t *head = m->a[PP_HEAD].whole;
  const int32_t n = head[PP_INPUTS], k = head[PP_FELT];
  const pp_real *numbers = m->a[PP_NUMBERS].real;
  pp_real g[3], H[9], log_kappa, radius;
  pp_work w;
  int32_t i, j, flags;
  int finite = pp_finite(x[0]) && pp_finite(x[1]) && pp_finite(x[2]);
  for (i = k; i < n; i++) finite = finite && pp_finite(p[i - k]);
  if (!finite) return pp_no_answer(answer);
  memset(answer, 0, PP_ANSWER * sizeof *answer);
  memset(&w, 0, sizeof w);
  pp_feel(m, x, w.line);
  for (i = k; i < n; i++) w.line[i] = p[i - k];
  for (i = 0; i < 3; i++) w.moved[i] = x[i];
  if (!PP_ENTER(m, x, p, &w)) {
    answer[PP_DEPTH] = w.base[1];
    return PP_TRUSTED;
  }
  for (i = 0; i < n; i++) w.at[i] = w.line[i];
  pp_feel(m, w.moved, w.at);
  pp_box(m->a[PP_LIMITS].real, n, w.at, w.by, w.twice);
  pp_scale(m->a + PP_NET, w.at, w.xi);
  PP_REST(m, x, &w);
  log_kappa = pp_second_order(m->a + PP_NET, w.xi, k, g, H);
  log_kappa += PP_LOG(m, &w, g, H);
  for (i = 0; i < k; i++) {
    for (j = 0; j < k; j++) H[k * i + j] *= w.by[i] * w.by[j];
    H[k * i + i] += w.twice[i] * g[i];
  }
  for (i = 0; i < k; i++) g[i] *= w.by[i];
  pp_to_space(g, H, m->a[PP_AXES].real, k, &w);
  PP_LEAVE(m, x, &w);
  pp_assemble(PP_EXP(log_kappa), &w, answer);
  for (i = 0; i < PP_ANSWER; i++) {
    if (!pp_finite(answer[i])) return pp_no_answer(answer); /* the place is so far away that numbers overflow */
  }
  flags = PP_CONTACT;
  if (pp_inside(m, w.line, w.base[1])) flags |= PP_TRUSTED;
  radius = head[PP_RADIUS_INPUT] < 0 ? numbers[4] : w.line[head[PP_RADIUS_INPUT]];
  if (w.base[1] > numbers[3] + radius) flags |= PP_TOO_DEEP;
  return flags;
}

/* Numbers that `pp_deviation` needs as workspace. */
PP_PART int32_t pp_deviation_size(const pp_model *m) { return 4 * m->a[PP_ROOT].n[2]; }

/* Standard deviation of the force relative to its size, first order in the weights; not-a-number without a posterior.
 *
 * The root is lower triangular. Its shape: columns, units that it knows, rows filled up to a multiple of PP_LANES; of
 * column c the rows from c - c % PP_LANES on are stored. */
PP_PART pp_real pp_deviation(const pp_model *m, const pp_real *x, const pp_real *p, const pp_real *answer, pp_real *lines) {
  const pp_array *root = &m->a[PP_ROOT];
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS], k = m->a[PP_HEAD].whole[PP_FELT], rows = root->n[2];
  const pp_real *f = answer + PP_FORCE, *axes = m->a[PP_AXES].real, value = answer[PP_PLAIN];
  const pp_real size = PP_SQRT(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  const float *column = root->brief;
  pp_real line[PP_MOST], xi[PP_MOST], total = R(0);
  int32_t i, a, c, r;
  int l;
  if (!pp_finite(value)) return pp_nan();
  if (size == R(0)) return R(0);
  if (root->n[0] == 0) return pp_nan();
  pp_feel(m, x, line);
  for (i = k; i < n; i++) line[i] = p[i - k];
  pp_scale(m->a + PP_NET, line, xi);
  pp_regressors(m->a + PP_NET, xi, root->n[1], k, rows, lines);
  for (c = 0; c < root->n[0]; c++) {
    const int32_t first = c - c % PP_LANES;
    pp_real sums[4][PP_LANES], moved[3];
    for (a = 0; a <= k; a++) {
      for (l = 0; l < PP_LANES; l++) sums[a][l] = R(0);
      for (r = first; r < rows; r += PP_LANES) {
        const pp_real *own = lines + a * rows + r;
        for (l = 0; l < PP_LANES; l++) sums[a][l] += own[l] * (pp_real)column[r - first + l];
      }
    }
    column += rows - first;
    for (i = 0; i < 3; i++) {
      pp_real along = R(0);
      for (a = 0; a < k; a++) along += (k == 3 ? (a == i ? R(1) : R(0)) : axes[3 * a + i]) * pp_sum(sums[1 + a]);
      moved[i] = f[i] * pp_sum(sums[0]) - value * along;
      total += moved[i] * moved[i];
    }
  }
  return PP_SQRT(total) / size;
}
