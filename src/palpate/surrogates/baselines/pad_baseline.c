/* A patch or node that a hand holds: pad_baseline.py, rest_stiffness.py and stiffening.py in C99.
 *
 * arrays: 0 axes (k, 3); 1 coefficients of S (m, k (k + 1)/2) and 2 the pairs of variables of their monomials (m, 2);
 * 3 coefficients of P and 4 the powers of its monomials (m, n)
 */
PP_PART int pad_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  (void)m;
  (void)p;
  w->base[1] = PP_SQRT(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  return 1;
}

/* S (3, 3) at scaled inputs after the felt ones */
PP_PART void pad_root(const pp_model *m, const pp_real *zeta, int32_t k, pp_real *S) {
  const pp_array *coefficients = pp_baseline_array(m, 1);
  const int32_t *pairs = pp_baseline_array(m, 2)->whole;
  int32_t row, i, j, e;
  for (i = 0; i < 9; i++) S[i] = R(0);
  for (row = 0; row < coefficients->n[0]; row++) {
    pp_real t = R(1);
    if (pairs[2 * row] >= 0) t *= zeta[pairs[2 * row]];
    if (pairs[2 * row + 1] >= 0) t *= zeta[pairs[2 * row + 1]];
    e = row * coefficients->n[1];
    for (i = 0; i < k; i++) {
      for (j = i; j < k; j++) S[3 * i + j] += t * coefficients->real[e++];
    }
  }
  for (i = 0; i < k; i++) {
    for (j = 0; j < i; j++) S[3 * i + j] = S[3 * j + i];
  }
}

PP_PART void pad_rest(const pp_model *m, const pp_real *x, pp_work *w) {
  const pp_real *axes = pp_baseline_array(m, 0)->real;
  const int32_t k = pp_baseline_array(m, 0)->n[0];
  pp_real S[9], u[3], v[3], a[3], twice = R(0);
  int32_t i, j, c, d, e;
  pad_root(m, w->xi + k, k, S);
  for (i = 0; i < k; i++) u[i] = axes[3 * i] * x[0] + axes[3 * i + 1] * x[1] + axes[3 * i + 2] * x[2];
  for (i = 0; i < k; i++) {
    v[i] = R(0);
    for (j = 0; j < k; j++) v[i] += S[3 * i + j] * u[j];
    twice += v[i] * v[i];
  }
  for (i = 0; i < k; i++) {
    a[i] = R(0);
    for (j = 0; j < k; j++) a[i] += S[3 * i + j] * v[j];
  }
  w->base[0] = R(0.5) * twice;
  w->base[2] = R(0);
  w->base[3] = k == 1 ? v[0] : PP_SQRT(twice);
  for (i = 0; i < 3; i++) {
    pp_real total = R(0);
    for (c = 0; c < k; c++) total += axes[3 * c + i] * a[c];
    w->gradient[i] = total;
    for (j = i; j < 3; j++) {
      total = R(0);
      for (c = 0; c < k; c++) {
        for (d = 0; d < k; d++) {
          pp_real square = R(0);
          for (e = 0; e < k; e++) square += S[3 * c + e] * S[3 * e + d];
          total += axes[3 * c + i] * square * axes[3 * d + j];
        }
      }
      w->hessian[3 * i + j] = total;
      w->hessian[3 * j + i] = total;
    }
  }
  for (i = 0; i < 3; i++) {
    if (k == 1) {
      w->root[i] = S[0] * axes[i];
    } else {
      w->root[i] = w->base[3] > R(0) ? w->gradient[i] / w->base[3] : R(0);
    }
  }
}

/* product of powers of xi, differentiated by xi_i and xi_j; -1 for none */
PP_PART pp_real pad_product(const int32_t *powers, const pp_real *xi, int32_t n, int32_t i, int32_t j) {
  pp_real t = R(1);
  int32_t k, q;
  for (k = 0; k < n; k++) {
    int32_t power = powers[k];
    if (i == k) {
      t *= (pp_real)power;
      power--;
    }
    if (j == k) {
      t *= (pp_real)power;
      power--;
    }
    if (power < 0) return R(0);
    for (q = 0; q < power; q++) t *= xi[k];
  }
  return t;
}

PP_PART pp_real pad_log(const pp_model *m, const pp_work *w, pp_real *g, pp_real *H) {
  const pp_array *coefficients = pp_baseline_array(m, 3), *powers = pp_baseline_array(m, 4);
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS], k = m->a[PP_HEAD].whole[PP_FELT];
  const pp_real *half = m->a[PP_NET + PP_SCALES].real + n;
  pp_real total = R(0);
  int32_t row, i, j;
  for (row = 0; row < coefficients->n[0]; row++) {
    const pp_real c = coefficients->real[row];
    const int32_t *e = powers->whole + row * n;
    total += c * pad_product(e, w->xi, n, -1, -1);
    for (i = 0; i < k; i++) {
      if (e[i] == 0) continue;
      g[i] += c * pad_product(e, w->xi, n, i, -1) / half[i];
      for (j = i; j < k; j++) {
        pp_real t;
        if (e[j] == 0) continue;
        t = c * pad_product(e, w->xi, n, i, j) / (half[i] * half[j]);
        H[k * i + j] += t;
        if (i != j) H[k * j + i] += t;
      }
    }
  }
  return total;
}

PP_NO_LEAVE(pad)
