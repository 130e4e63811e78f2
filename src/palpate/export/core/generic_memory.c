PP_PART int pp_step(const pp_model *m, pp_real *state, const pp_real *x, pp_real q, const pp_real *slope, pp_real dt,
                    pp_real *force) {
  const int32_t code = m->a[PP_HEAD].whole[PP_MEMORY_CODE];
  if (code == 1) return relaxation_step(m, state, x, q, slope, dt, force);
  if (code == 2) return indentation_step(m, state, x, q, slope, dt, force);
  if (code == 4) return friction_step(m, state, x, q, slope, dt, force);
  return iwan_elements_step(m, state, x, q, slope, dt, force);
}
