/* Directional derivatives of outputs and rates, by inputs, parameters and states.
 *
 * Force and energy of a body without a memory and damping by the place: its stiffness, in closed form. All others are central
 * differences along the seed, which moves no variable by more than 1e-5 of its range or usual size; in the states they
 * have no error but rounding, since force and energy are of second order in them, and the rates of first.
 *
 * In co-simulation a body with a memory answers how its outputs at the end of the last step change with the inputs that
 * this step took: its length and what was remembered at its beginning are kept.
 */
static int is_input(const Instance *c, uint32_t v) {
  if (c->untouched) return is_parameter(c, v);
  return v < 3 || v == SCALE || v == DAMPING || v == MASS || is_parameter(c, v) || (c->exchange && state_of(c, v) >= 0);
}

static int is_closed(const Instance *c, uint32_t v) { return !c->size && !c->damped && v >= FX && v <= ENERGY; }

/* usual size of what a variable takes */
static double extent(const Instance *c, uint32_t v) {
  const double *low = c->arrays[PP_LIMITS].real, *high = low + c->arrays[PP_LIMITS].n[1];
  const int32_t felt = c->arrays[PP_LIMITS].n[1] - c->parameters;
  double most = 0.0;
  int32_t i;
  if (v == SCALE || v == DAMPING || v == MASS) return 1.0;
  if (v >= STATE) return c->usual;
  if (is_parameter(c, v)) return high[felt + (int32_t)(v - PARAMETER)] - low[felt + (int32_t)(v - PARAMETER)];
  for (i = 0; i < felt; i++) most = pp_most(most, high[i] - low[i]);
  return most;
}

static void move(Instance *c, uint32_t v, double by) {
  if (v < 3) c->now.x[v] += by;
  else if (v == SCALE) c->now.scale += by;
  else if (v == DAMPING) c->now.damping += by;
  else if (v == MASS) c->now.mass += by;
  else if (v < STATE) c->now.p[v - PARAMETER] += by;
  else pp_set_state(&c->model, c->numbers, state_of(c, v), pp_state(&c->model, c->numbers, state_of(c, v)) + by);
  c->known = 0;
}

/* Add differences along the seed: of what has no closed form, by all; of what has, by parameters alone if `closed`. */
static void add_differences(Instance *c, int closed, const uint32_t *unknown, size_t unknowns, const uint32_t *known,
                            size_t knowns, const double *seed, double *values) {
  const Moment now = c->now;
  double most = 0.0, step;
  size_t i, j;
  int side;
  for (j = 0; j < knowns; j++) {
    if (!closed || is_parameter(c, known[j])) most = pp_most(most, PP_ABS(seed[j]) / extent(c, known[j]));
  }
  if (!(most > 0.0)) return;
  step = 1e-5 / most;
  memcpy(c->kept, c->numbers, (size_t)c->size * sizeof(double));
  c->probing = 1;
  for (side = 1; side >= -1; side -= 2) {
    for (j = 0; j < knowns; j++) {
      if (!closed || is_parameter(c, known[j])) move(c, known[j], side * step * seed[j]);
    }
    for (i = 0; i < unknowns; i++) {
      double value = 0.0;
      if (is_closed(c, unknown[i]) != closed) continue;
      value_of(c, unknown[i], &value);
      values[i] += side * value / (2.0 * step);
    }
    c->now = now;
    memcpy(c->numbers, c->kept, (size_t)c->size * sizeof(double));
    c->known = 0;
  }
  c->probing = 0;
}

static int directional(Instance *c, const uint32_t *unknown, size_t unknowns, const uint32_t *known, size_t knowns,
                       const double *seed, double *values) {
  size_t i, j;
  if ((unknowns && (!unknown || !values)) || (knowns && (!known || !seed))) {
    return refuse(c, "Directional derivatives need references, seeds and room for values.");
  }
  if (c->moves) return refuse(c, "A body that carries a mass has no directional derivatives.");
  c->damped = c->now.damping > 0.0;
  for (j = 0; j < knowns; j++) {
    c->damped |= known[j] == DAMPING;
    if (!is_input(c, known[j])) return refuse(c, "There is no input, parameter or state of this reference to derive by.");
  }
  for (i = 0; i < unknowns; i++) {
    const int is_output = c->untouched ? answer_of(c, unknown[i]) >= 0 || deviation_of(c, unknown[i]) >= 0 : unknown[i] >= FX && unknown[i] <= (c->size ? LOST : DEVIATION) && unknown[i] != SCALE;
    if (!is_output && !(c->exchange && rate_of(c, unknown[i]) >= 0)) {
      return refuse(c, "Only real outputs, and rates in model exchange, have directional derivatives.");
    }
    values[i] = 0.0;
  }
  renew(c);
  for (i = 0; i < unknowns; i++) {
    const int row = (int)(unknown[i] - FX);
    const double *f = c->answer + PP_FORCE;
    if (!is_closed(c, unknown[i])) continue;
    for (j = 0; j < knowns; j++) {
      const uint32_t v = known[j];
      if (v < 3) values[i] += seed[j] * c->now.scale * (row < 3 ? c->answer[PP_STIFFNESS + 3 * row + (int)v] : -f[v]);
      if (v == SCALE) values[i] += seed[j] * (row < 3 ? f[row] : c->answer[PP_ENERGY]);
    }
  }
  add_differences(c, 0, unknown, unknowns, known, knowns, seed, values);
  add_differences(c, 1, unknown, unknowns, known, knowns, seed, values);
  return OK;
}
