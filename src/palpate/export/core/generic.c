/* Any body of palpate's own baselines and memories, chosen by the numbers in the block's head. */
PP_PART int pp_enter(const pp_model *m, const pp_real *x, const pp_real *p, pp_work *w) {
  const int32_t code = m->a[PP_HEAD].whole[PP_BASELINE_CODE];
  if (code == 4) return overlap_enter(m, x, p, w);
  if (code == 5) return posed_enter(m, x, p, w);
  if (code == 6) return pinch_enter(m, x, p, w);
  return code == 1 ? contact_enter(m, x, p, w) : code == 2 ? pad_enter(m, x, p, w) : constant_enter(m, x, p, w);
}

PP_PART void pp_rest(const pp_model *m, const pp_real *x, pp_work *w) {
  if (m->a[PP_HEAD].whole[PP_BASELINE_CODE] == 2) pad_rest(m, x, w);
}

PP_PART pp_real pp_log(const pp_model *m, const pp_work *w, pp_real *g, pp_real *H) {
  return m->a[PP_HEAD].whole[PP_BASELINE_CODE] == 2 ? pad_log(m, w, g, H) : R(0);
}

PP_PART void pp_leave(const pp_model *m, const pp_real *x, pp_work *w) {
  const int32_t code = m->a[PP_HEAD].whole[PP_BASELINE_CODE];
  if (code == 5) posed_leave(m, x, w);
  else if (code != 6 && pp_is_probe(m->a)) contact_leave(m, x, w); /* with an overlap or without */
}

#define PP_ENTER pp_enter
#define PP_REST pp_rest
#define PP_LOG pp_log
#define PP_LEAVE pp_leave
