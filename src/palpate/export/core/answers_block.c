/* Checks of a block of answers that no hand feels, beside block.c: everything that indexes memory, once. */
PP_PART int pp_is_answers(const pp_array *a) {
  const int32_t *head = a[PP_HEAD].whole;
  return pp_is(&a[PP_HEAD], 7, 1, 0) && head[PP_BASELINE_CODE] == 0 && head[PP_MEMORY_CODE] == 0 && head[PP_FELT] == 0;
}

/* whether a network of several outputs has all that its sizes say */
PP_PART int pp_answer_net_fits(const pp_array *net, int32_t n, int32_t outputs) {
  const int32_t *sizes = net[PP_SIZES].whole;
  int64_t tail;
  int32_t i, groups;
  if (!pp_is(&net[PP_SIZES], 7, 1, 0) || sizes[0] != n || outputs < 1) return 0;
  if (sizes[1] < 0 || sizes[1] > PP_MOST * PP_MOST || sizes[2] < 0 || sizes[2] > PP_MOST || sizes[3] < 0) return 0;
  if (sizes[4] < 1 || sizes[4] > (1 << 16) || sizes[5] < 0 || sizes[5] > 2 || sizes[6] != 0) return 0;
  if (!pp_is(&net[PP_SCALES], net[PP_SCALES].n[0] == 3 ? 3 : 2, n, 1) || !pp_dense(&net[PP_TAIL])) return 0;
  tail = (int64_t)(1 + n) * sizes[4];
  if (net[PP_TAIL].n[0] == tail ? outputs != sizes[4] : net[PP_TAIL].n[0] != tail + (int64_t)(1 + sizes[4]) * outputs) return 0;
  groups = (sizes[3] + PP_LANES - 1) / PP_LANES;
  if (groups == 0) return net[PP_UNITS].n[0] == 0;
  if (!pp_is(&net[PP_UNITS], groups, sizes[1] + sizes[2] + sizes[4], 1) || net[PP_UNITS].n[2] != PP_LANES) return 0;
  if (sizes[1] == 0) return 1;
  if (!pp_is(&net[PP_LAYOUT], sizes[1], 2, 0)) return 0;
  for (i = 0; i < sizes[1]; i++) {
    const int32_t row = net[PP_LAYOUT].whole[2 * i], column = net[PP_LAYOUT].whole[2 * i + 1];
    if (row < 0 || row >= sizes[2] || column < 0 || column >= n) return 0;
  }
  return 1;
}

/* whether arrays that pp_open has found, and `pp_is_answers` says are of this kind, fit each other */
PP_PART int pp_answers_fit(const pp_array *a) {
  const int32_t n = a[PP_HEAD].whole[PP_INPUTS], m = a[PP_HEAD].whole[PP_OUTPUTS];
  const pp_array *runs = &a[PP_RUNS];
  int32_t i;
  if (n < 1 || n > PP_MOST || !pp_is(&a[PP_LIMITS], 3, n, 1) || !pp_answer_net_fits(a + PP_NET, n, m)) return 0;
  for (i = 1; i < PP_MOST_NETS; i++) {
    if (a[PP_NETS[i]].n[0] > 0 && !pp_answer_net_fits(a + PP_NETS[i], n, m)) return 0;
  }
  if (!pp_is(&a[PP_NUMBERS], PP_MOST_REGIONS, 1, 1)) return 0;
  for (i = 0; i < PP_MOST_REGIONS; i++) {
    const pp_array *points = &a[PP_REGIONS + i];
    if (points->n[0] > 0 && (!pp_is(points, n, points->n[1], 1) || points->n[1] % PP_LANES)) return 0;
  }
  if (runs->n[0] == 0) return 1;
  if (!pp_is(runs, runs->n[0], 3, 0)) return 0;
  for (i = 0; i < runs->n[0]; i++) {
    const int32_t first = runs->whole[3 * i], count = runs->whole[3 * i + 1];
    if (first < 0 || count < 1 || count > m || first > m - count) return 0;
  }
  return 1;
}
