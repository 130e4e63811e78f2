/* Torque on a tool about its place: learnt_torque.py in C99.
 *
 * A network of three outputs gives the torque per newton of force, m, within its ranges; beyond them that of their
 * border. Its sizes, layout, units and tail lie at PP_ARM; its scales are those of l. A tool that turns by parameters,
 * two or three components of a rotation vector, has the torque that their slopes of the energy say.
 */
#define PP_TURN_STEP R(1e-4) /* rad, of the differences by the turns */

PP_PART int pp_turns(const pp_array *arrays) {
  return arrays[PP_HEAD].whole[PP_BASELINE_CODE] == 5 && arrays[PP_HEAD].whole[PP_INPUTS] > 3;
}

PP_PART int pp_tells_torque(const pp_array *arrays) { return arrays[PP_ARM].n[0] > 0 || pp_turns(arrays); }

PP_PART void pp_arm(const pp_array *arrays, pp_array *net) {
  int i;
  net[PP_SIZES] = arrays[PP_ARM];
  net[PP_SCALES] = arrays[PP_NET + PP_SCALES];
  for (i = 1; i < 4; i++) net[PP_SCALES + i] = arrays[PP_ARM + i];
}

/* left Jacobian J and rotation E of a rotation vector, row by row: exp(w + dw) = exp(J dw) exp(w) */
PP_PART void pp_turn_matrices(const pp_real *w, pp_real *J, pp_real *E) {
  const pp_real K[9] = {R(0), -w[2], w[1], w[2], R(0), -w[0], -w[1], w[0], R(0)};
  const pp_real square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2], angle = PP_SQRT(square);
  const pp_real half = R(0.5) * angle, sinc = half > R(1e-8) ? PP_SIN(half) / half : R(1);
  const pp_real first = angle > R(1e-8) ? PP_SIN(angle) / angle : R(1), second = R(0.5) * sinc * sinc;
  const pp_real third = angle < R(1e-2) ? R(1) / R(6) - square / R(120) + square * square / R(5040)
                                        : (angle - PP_SIN(angle)) / (square * angle);
  int i, j, k;
  for (i = 0; i < 3; i++) {
    for (j = 0; j < 3; j++) {
      pp_real twice = R(0);
      for (k = 0; k < 3; k++) twice += K[3 * i + k] * K[3 * k + j];
      E[3 * i + j] = (i == j ? R(1) : R(0)) + first * K[3 * i + j] + second * twice;
      J[3 * i + j] = (i == j ? R(1) : R(0)) + second * K[3 * i + j] + third * twice;
    }
  }
}

/* the torque of a tool that turns: J' torque = -dU/dw, and none about the tool's own axis where two turns are known */
PP_PART void pp_torque_by_turns(const pp_model *m, const pp_real *x, const pp_real *p, pp_real *torque) {
  const int32_t turns = m->a[PP_HEAD].whole[PP_INPUTS] - 3;
  const pp_real *own = m->a[PP_BASELINE + 5].real; /* the fixed rotation, whose last column is the tool's axis */
  pp_real moved[3], w[3] = {R(0), R(0), R(0)}, known[3] = {R(0), R(0), R(0)}, J[9], E[9], A[9], answer[PP_ANSWER], det;
  int32_t i, j;
  for (i = 0; i < turns; i++) moved[i] = w[i] = p[i];
  for (i = 0; i < turns; i++) {
    moved[i] = p[i] + PP_TURN_STEP;
    pp_answer(m, x, moved, answer);
    known[i] = answer[PP_ENERGY];
    moved[i] = p[i] - PP_TURN_STEP;
    pp_answer(m, x, moved, answer);
    known[i] = (answer[PP_ENERGY] - known[i]) / (R(2) * PP_TURN_STEP);
    moved[i] = p[i];
  }
  pp_turn_matrices(w, J, E);
  for (i = 0; i < 3; i++) {
    for (j = 0; j < 3; j++) A[3 * i + j] = i < turns ? J[3 * j + i] : E[3 * j] * own[2] + E[3 * j + 1] * own[5] + E[3 * j + 2] * own[8];
  }
  det = A[0] * (A[4] * A[8] - A[5] * A[7]) - A[1] * (A[3] * A[8] - A[5] * A[6]) + A[2] * (A[3] * A[7] - A[4] * A[6]);
  for (i = 0; i < 3; i++) { /* Cramer's rule: column i in the place of the known ones */
    const pp_real *a = A, b0 = known[0], b1 = known[1], b2 = known[2];
    const int u = (i + 1) % 3, v = (i + 2) % 3;
    torque[i] = (b0 * (a[3 + u] * a[6 + v] - a[3 + v] * a[6 + u]) + b1 * (a[6 + u] * a[v] - a[6 + v] * a[u]) +
                 b2 * (a[u] * a[3 + v] - a[v] * a[3 + u])) / det;
  }
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
  if (m->a[PP_ARM].n[0] == 0) {
    pp_torque_by_turns(m, x, p, torque);
    return;
  }
  pp_arm(m->a, net);
  pp_scale(net, at, xi);
  pp_latent(net, xi, torque, 0);
  for (i = 0; i < 3; i++) torque[i] *= size;
}
