/* Answers of a surrogate that no hand feels: outputs of up to three networks, summed up, and extremes over runs of them.
 *
 * Beside the head, the limits and the networks, a block holds the runs (first output, how many, 1 for the largest and 0
 * for the least value of them), and the trained regions of its parts, each (n, S) as PP_POINTS, with their radii.
 *
 * How sure a part is, its doubt says: a network whose latent outputs are forms, shares of single samples and differences
 * of members (palpate/export/answer_doubt.py), in six arrays: whole numbers, layout, units, tail, numbers (variances,
 * squares of what was missed of samples, variances that come on top) and squares (rows, own). PP_PLACES says of each
 * output its doubt and its row there.
 */
enum { PP_RUNS = 22, PP_REGIONS = 24, PP_MOST_REGIONS = 12, PP_MOST_NETS = 3 };
enum { PP_PLACES = 23, PP_DOUBTS = 36, PP_DOUBT_ARRAYS = 6, PP_MOST_DOUBTS = 4 };
/* places in a doubt's whole numbers, after the sizes of its network */
enum { PP_PLUS = 7, PP_MINUS = 8, PP_SAMPLES = 9, PP_MEMBERS = 10, PP_OWN = 11, PP_DOUBT_SIZES = 12 };
static const int32_t PP_NETS[PP_MOST_NETS] = {PP_NET, PP_BASELINE, PP_BASELINE + PP_NET_ARRAYS};

PP_PART int32_t pp_answer_count(const pp_model *m) { return m->a[PP_HEAD].whole[PP_OUTPUTS] + m->a[PP_RUNS].n[0]; }

/* room for latent outputs that the largest of the networks needs */
PP_PART int32_t pp_latent_count(const pp_model *m) {
  int32_t i, most = 1;
  for (i = 0; i < PP_MOST_NETS; i++) {
    const pp_array *sizes = &m->a[PP_NETS[i]];
    if (sizes->n[0] > 0 && sizes->whole[4] > most) most = sizes->whole[4];
  }
  for (i = 0; i < PP_MOST_DOUBTS; i++) {
    const pp_array *sizes = &m->a[PP_DOUBTS + PP_DOUBT_ARRAYS * i];
    if (sizes->n[0] > 0 && sizes->whole[4] + sizes->whole[PP_OWN] > most) most = sizes->whole[4] + sizes->whole[PP_OWN];
  }
  return most;
}

/* The variances of a part's numbers at inputs x, behind the latent outputs of its doubt; whether they can be trusted. */
PP_PART int pp_doubt(const pp_model *m, int32_t d, const pp_real *x, pp_real *latent) {
  const pp_array *a = &m->a[PP_DOUBTS + PP_DOUBT_ARRAYS * d];
  const int32_t *head = a[0].whole;
  const int32_t first = head[PP_PLUS] + head[PP_MINUS], samples = head[PP_SAMPLES], members = head[PP_MEMBERS], own = head[PP_OWN];
  const pp_real *c = a[4].real, *missed = c + own, *apart = latent + first + samples;
  pp_array net[PP_NET_ARRAYS];
  pp_real xi[PP_MOST], form = R(1), *variance = latent + head[4];
  int32_t i, k, agree = 1;
  net[PP_SIZES] = a[0];
  net[PP_SCALES] = m->a[PP_NET + PP_SCALES];
  for (i = 1; i < 4; i++) net[PP_SCALES + i] = a[i];
  pp_scale(net, x, xi);
  pp_latent(net, xi, latent, 0);
  for (i = 0; i < first; i++) form += (i < head[PP_PLUS] ? latent[i] : -latent[i]) * latent[i];
  for (k = 0; k < own; k++) {
    const pp_real v = c[k] * pp_most(form, R(0));
    pp_real differ = R(0), alone = R(0);
    for (i = 0; i < members; i++) differ += apart[i * own + k] * apart[i * own + k];
    if (members) differ /= (pp_real)members;
    for (i = 0; i < samples; i++) alone += latent[first + i] * latent[first + i] * missed[k * samples + i];
    if (!(differ <= R(9) * v) || !(alone <= R(9) * v)) agree = 0;
    variance[k] = pp_most(v, differ);
  }
  return agree;
}

/* Standard deviations of all outputs and extremes at inputs x, where y are the outputs; 0 where the parts can't say. */
PP_PART int pp_answers_deviation(const pp_model *m, const pp_real *x, const pp_real *y, pp_real *latent, pp_real *deviation) {
  const pp_array *runs = &m->a[PP_RUNS], *places = &m->a[PP_PLACES];
  const int32_t outputs = m->a[PP_HEAD].whole[PP_OUTPUTS];
  int32_t d, i, k, o;
  if (places->n[0] == 0) return 0;
  for (d = 0; d < PP_MOST_DOUBTS; d++) {
    const pp_array *a = &m->a[PP_DOUBTS + PP_DOUBT_ARRAYS * d];
    const pp_real *variance, *top;
    int32_t own;
    if (a->n[0] == 0) continue;
    own = a->whole[PP_OWN];
    variance = latent + a->whole[4];
    top = a[4].real + own + own * a->whole[PP_SAMPLES];
    pp_doubt(m, d, x, latent);
    for (o = 0; o < outputs; o++) {
      const int32_t row = places->whole[2 * o + 1];
      const pp_real *square = a[5].real + (size_t)row * (size_t)own;
      pp_real sum;
      if (places->whole[2 * o] != d) continue;
      sum = top[row];
      for (k = 0; k < own; k++) sum += square[k] * variance[k];
      deviation[o] = PP_SQRT(sum);
    }
  }
  for (i = 0; i < runs->n[0]; i++) {
    const int32_t first = runs->whole[3 * i], many = runs->whole[3 * i + 1];
    int32_t best = first;
    for (o = first + 1; o < first + many; o++) {
      if (runs->whole[3 * i + 2] ? y[o] > y[best] : y[o] < y[best]) best = o;
    }
    deviation[outputs + i] = deviation[best];
  }
  return 1;
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

/* Whether inputs are in the trained region of every part, near its points, or in the ranges where it has none, and its
 * members and samples agree there; latent: room for `pp_latent_count` numbers. */
PP_PART int pp_answers_inside(const pp_model *m, const pp_real *x, pp_real *latent) {
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
  for (i = 0; i < PP_MOST_DOUBTS; i++) {
    if (m->a[PP_DOUBTS + PP_DOUBT_ARRAYS * i].n[0] > 0 && !pp_doubt(m, i, x, latent)) return 0;
  }
  return 1;
}
