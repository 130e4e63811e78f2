/* Answers of a surrogate that no hand feels: outputs of up to three networks, summed up, and extremes over runs of them.
 *
 * Beside the head, the limits and the networks, a block holds the runs (first output, how many, 1 for the largest and 0
 * for the least value of them), and the trained regions of its parts, each (n, S) as PP_POINTS, with their radii.
 */
enum { PP_RUNS = 22, PP_REGIONS = 24, PP_MOST_REGIONS = 12, PP_MOST_NETS = 3 };
static const int32_t PP_NETS[PP_MOST_NETS] = {PP_NET, PP_BASELINE, PP_BASELINE + PP_NET_ARRAYS};

PP_PART int32_t pp_answer_count(const pp_model *m) { return m->a[PP_HEAD].whole[PP_OUTPUTS] + m->a[PP_RUNS].n[0]; }

/* room for latent outputs that the largest of the networks needs */
PP_PART int32_t pp_latent_count(const pp_model *m) {
  int32_t i, most = 1;
  for (i = 0; i < PP_MOST_NETS; i++) {
    const pp_array *sizes = &m->a[PP_NETS[i]];
    if (sizes->n[0] > 0 && sizes->whole[4] > most) most = sizes->whole[4];
  }
  return most;
}

/* Add the outputs of latent ones to y (m), with their constants if `constant`. */
PP_PART void pp_add_outputs(const pp_array *net, const pp_real *latent, int32_t m, int constant, pp_real *y) {
  const int32_t n = net[PP_SIZES].whole[0], count = net[PP_SIZES].whole[4];
  const pp_real *modes = net[PP_TAIL].real + (1 + n) * count;
  int32_t k, o;
  if (net[PP_TAIL].n[0] == (1 + n) * count) { /* the latent outputs are the outputs */
    for (o = 0; o < m; o++) y[o] += latent[o];
    return;
  }
  for (o = 0; o < m && constant; o++) y[o] += modes[o];
  for (k = 0; k < count; k++) {
    const pp_real *mode = modes + (size_t)(1 + k) * (size_t)m, weight = latent[k];
    for (o = 0; o < m; o++) y[o] += weight * mode[o];
  }
}

/* All outputs and extremes y at inputs x; latent: room for `pp_latent_count` numbers. */
PP_PART void pp_answers(const pp_model *m, const pp_real *x, pp_real *latent, pp_real *y) {
  const pp_array *runs = &m->a[PP_RUNS];
  const int32_t outputs = m->a[PP_HEAD].whole[PP_OUTPUTS];
  pp_real xi[PP_MOST];
  int32_t i, o;
  for (o = 0; o < outputs; o++) y[o] = R(0);
  for (i = 0; i < PP_MOST_NETS; i++) {
    const pp_array *net = m->a + PP_NETS[i];
    if (net->n[0] == 0) continue;
    pp_scale(net, x, xi);
    pp_latent(net, xi, latent, 0);
    pp_add_outputs(net, latent, outputs, 1, y);
  }
  for (i = 0; i < runs->n[0]; i++) {
    const pp_real *run = y + runs->whole[3 * i];
    const int32_t many = runs->whole[3 * i + 1];
    pp_real best = run[0];
    for (o = 1; o < many; o++) best = runs->whole[3 * i + 2] ? pp_most(best, run[o]) : pp_least(best, run[o]);
    y[outputs + i] = best;
  }
}

/* whether inputs are in the trained region of every part: near its points, or in the ranges where it has none */
PP_PART int pp_answers_inside(const pp_model *m, const pp_real *x) {
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS];
  pp_real xi[PP_MOST];
  int32_t i, j, p, regions = 0;
  pp_scale(m->a + PP_NET, x, xi);
  for (i = 0; i < PP_MOST_REGIONS; i++) {
    const pp_array *points = &m->a[PP_REGIONS + i];
    pp_real radius;
    int near = 0;
    if (points->n[0] == 0) continue;
    radius = m->a[PP_NUMBERS].real[i];
    regions++;
    for (p = 0; p < points->n[1] && !near; p++) {
      pp_real square = R(0);
      for (j = 0; j < n; j++) {
        const pp_real gap = xi[j] - points->real[(size_t)j * (size_t)points->n[1] + (size_t)p];
        square += gap * gap;
      }
      near = PP_SQRT(square) <= radius;
    }
    if (!near) return 0;
  }
  for (j = 0; j < n && !regions; j++) {
    if (!(PP_ABS(xi[j]) <= R(1) + R(1e-9))) return 0;
  }
  return 1;
}
