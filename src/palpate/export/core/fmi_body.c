/* What both versions of FMI ask of a body: values, steps, states, and their derivatives. */

/* the memory's answer to a step that is taken on a copy of what it keeps; no force where an input is no number */
static void try_step(Instance *c, const double *kept, double dt) {
  memcpy(c->trial, kept, (size_t)c->size * sizeof(double));
  pp_step(&c->model, c->trial, c->now.x, c->answer[PP_AMPLITUDE], c->answer + PP_SLOPE, dt, c->now.force);
  c->stored = c->trial[0];
}

/* The force of the damping, by the mean velocity of the last step: along the felt directions of what is held; of a probe
 * along the force of the body, which it never turns round: nothing pulls a probe back. */
static void renew_drag(Instance *c) {
  const double *axes = c->arrays[PP_AXES].real, *f = c->now.force, scale = c->now.scale, d = c->now.damping;
  const int is_probe = pp_is_probe(c->arrays);
  const int32_t felt = is_probe ? 1 : c->arrays[PP_HEAD].whole[PP_FELT];
  const double size = PP_ABS(scale) * PP_SQRT(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  int32_t a, i;
  memset(c->drag, 0, sizeof c->drag);
  if (d == 0.0 || c->moves || (is_probe && !(size > 0.0)) || c->flags & (PP_TOO_DEEP | PP_NOT_A_NUMBER)) return;
  for (a = 0; a < felt; a++) {
    double along = 0.0, axis[3], pull;
    for (i = 0; i < 3; i++) {
      axis[i] = is_probe ? scale * f[i] / size : axes[3 * a + i];
      along += axis[i] * (c->probing && c->now.step > 0.0 ? (c->now.x[i] - c->now.from[i]) / c->now.step : c->now.velocity[i]);
    }
    pull = is_probe ? pp_least(d * along, size) : d * along;
    for (i = 0; i < 3; i++) c->drag[i] -= pull * axis[i];
  }
}

/* Warn once of a step in which the force goes stale: held for a step, it acts on a mass as a damping of -k step / 2, and
 * lets it leave the body faster than it came by a factor of exp(pi zeta), zeta = (k step / 2 - damping) / (2 sqrt(k mass)).
 * The warning begins at a factor of 1.1, and where the damping itself turns the mass round within a step. */
static void check_step(Instance *c, double dt) {
  const double *f = c->answer + PP_FORCE, *K = c->answer + PP_STIFFNESS, m = c->now.mass, d = c->now.damping;
  const double square = f[0] * f[0] + f[1] * f[1] + f[2] * f[2];
  double k = 0.0;
  char text[192];
  int i;
  if (c->now.slow || !(square > 0.0) || !(m > 0.0)) return;
  for (i = 0; i < 9; i++) k -= c->now.scale * K[i] * f[i / 3] * f[i % 3] / square;
  if (!(k > 0.0) || (0.5 * k * dt - d <= 0.06 * PP_SQRT(k * m) && d * dt <= m)) return;
  c->now.slow = 1;
  snprintf(text, sizeof text, "A mass of %g kg gains speed at %.3g N/m in steps of %g s. Take shorter ones, or damping=%.2g.", m, k, dt, 0.5 * k * dt);
  say(c, WARNING, text);
}

/* The answers that no hand feels, at the inputs; nothing is in the region that is not a number. */
static void renew_answers(Instance *c) {
  const int32_t count = pp_answer_count(&c->model);
  int32_t i;
  pp_answers(&c->model, c->now.p, c->answers + 2 * count, c->answers);
  c->flags = pp_answers_inside(&c->model, c->now.p, c->answers + 2 * count) ? PP_TRUSTED : 0;
  c->deviated = 0;
  for (i = 0; i < count; i++) {
    if (!pp_finite(c->answers[i])) c->flags = PP_NOT_A_NUMBER;
  }
}

static void warn_outside(Instance *c) {
  if (c->flags & PP_TRUSTED) {
    c->now.warned = 0;
  } else if (!c->now.warned && !c->probing && (c->now.phase & RUNNING)) {
    c->now.warned = 1;
    say(c, WARNING, c->flags & PP_NOT_A_NUMBER ? "An input is not a finite number, or too large to be answered." : "The place is outside of the trained region.");
  }
}

/* Renew the answer, and warn once where the place leaves the trained region.
 *
 * In co-simulation the force of a body with a memory is that of its last step; while derivatives are asked for it is that
 * which the same step would have ended in. In model exchange it follows place and states at once. */
static void renew(Instance *c) {
  if (c->known) return;
  c->known = 1;
  if (c->untouched) {
    renew_answers(c);
    warn_outside(c);
    return;
  }
  c->flags = pp_answer(&c->model, c->now.x, c->now.p, c->answer);
  c->deviated = c->rated = 0;
  c->stored = c->size ? c->numbers[0] : 0.0;
  c->lost = c->size ? c->numbers[1] : 0.0;
  if (c->size && c->now.stepped) {
    if (c->probing) {
      try_step(c, c->before, c->now.step);
      c->lost = c->trial[1];
    }
  } else if (c->size && (c->exchange || c->now.remembers)) {
    try_step(c, c->numbers, 0.0);
  } else { /* before its first step a body with a memory answers as one that nothing was done to */
    memcpy(c->now.force, c->answer + PP_FORCE, sizeof c->now.force);
  }
  if (c->flags & (PP_TOO_DEEP | PP_NOT_A_NUMBER)) memset(c->now.force, 0, sizeof c->now.force);
  renew_drag(c);
  warn_outside(c);
}

static const double *rates(Instance *c) {
  renew(c);
  if (c->moves) {
    motion_rates(c, c->now.motion, c->rates);
    return c->rates;
  }
  if (!c->rated) {
    double force[3], stored = c->stored;
    memcpy(force, c->now.force, sizeof force);
    try_step(c, c->numbers, 0.0);
    pp_rates(&c->model, c->trial, c->answer[PP_AMPLITUDE], c->rates);
    memcpy(c->now.force, force, sizeof force);
    c->stored = stored;
    c->rated = 1;
  }
  return c->rates;
}

static void advance(Instance *c, double dt) {
  int i;
  c->now.step = dt;
  for (i = 0; i < 3; i++) {
    c->now.velocity[i] = dt > 0.0 ? (c->now.x[i] - c->now.to[i]) / dt : 0.0;
    c->now.from[i] = c->now.to[i];
    c->now.to[i] = c->now.x[i];
  }
  check_step(c, dt);
  renew_drag(c);
  if (!c->size) return;
  memcpy(c->before, c->numbers, (size_t)c->size * sizeof(double));
  c->now.stepped = 1;
  pp_step(&c->model, c->numbers, c->now.x, c->answer[PP_AMPLITUDE], c->answer + PP_SLOPE, dt, c->now.force);
  if (c->flags & PP_TOO_DEEP) memset(c->now.force, 0, sizeof c->now.force);
  renew_drag(c);
  c->stored = c->numbers[0];
  c->lost = c->numbers[1];
  c->rated = 0;
}

/* A step from or to no place is not taken: nothing is remembered of it, and nothing pushes. */
static int take_step(Instance *c, double time, double step) {
  if (!(step >= 0.0) || !pp_finite(step) || !pp_finite(time)) return refuse(c, "A step takes a finite time that is not negative.");
  renew(c);
  if (c->flags & PP_NOT_A_NUMBER) return DISCARD;
  if (c->moves && !carry_mass(c, step)) {
    say(c, WARNING, "The mass can't be followed over this step: its path leaves all numbers, or it is too light for the stiffness.");
    return DISCARD;
  }
  if (!c->moves && !c->untouched) advance(c, step);
  c->now.time = time + step;
  return OK;
}

/* the state that a value reference is, or -1 */
static int32_t state_of(const Instance *c, uint32_t v) {
  return v >= STATE && (int64_t)v - STATE < c->states ? (int32_t)(v - STATE) : -1;
}

/* the state that a value reference is the rate of, or -1 */
static int32_t rate_of(const Instance *c, uint32_t v) {
  const int64_t i = (int64_t)v - STATE - c->states;
  return i >= 0 && i < c->states ? (int32_t)i : -1;
}

static int is_parameter(const Instance *c, uint32_t v) { return v >= PARAMETER && v < PARAMETER + (uint32_t)c->parameters; }

/* the answer that no hand feels of a value reference, or -1 */
static int32_t answer_of(const Instance *c, uint32_t v) {
  return c->untouched && v >= ANSWER && (int64_t)v - ANSWER < pp_answer_count(&c->model) ? (int32_t)(v - ANSWER) : -1;
}

/* the answer whose standard deviation a value reference is, or -1 */
static int32_t deviation_of(const Instance *c, uint32_t v) {
  if (!c->untouched || c->arrays[PP_PLACES].n[0] == 0) return -1;
  return v >= ANSWER_DEVIATION && (int64_t)v - ANSWER_DEVIATION < pp_answer_count(&c->model) ? (int32_t)(v - ANSWER_DEVIATION) : -1;
}

/* the standard deviation of an answer that no hand feels */
static double answer_deviation(Instance *c, int32_t i) {
  const int32_t count = pp_answer_count(&c->model);
  renew(c);
  if (!c->deviated) pp_answers_deviation(&c->model, c->now.p, c->answers, c->answers + 2 * count, c->answers + count);
  c->deviated = 1;
  return c->answers[count + i];
}

static double state_value(const Instance *c, int32_t i) {
  return c->moves ? c->now.motion[i] : pp_state(&c->model, c->numbers, i);
}

static void set_state_value(Instance *c, int32_t i, double value) {
  if (!c->moves) {
    pp_set_state(&c->model, c->numbers, i, value);
    return;
  }
  c->now.motion[i] = value;
  move_to(c);
}

/* 0 where there is no real variable of this reference */
static int value_of(Instance *c, uint32_t v, double *value) {
  if (c->untouched) {
    if (v == TIME) *value = c->now.time;
    else if (is_parameter(c, v)) *value = c->now.p[v - PARAMETER];
    else if (deviation_of(c, v) >= 0) *value = answer_deviation(c, deviation_of(c, v));
    else if (answer_of(c, v) < 0) return 0;
    else {
      renew(c);
      *value = c->answers[answer_of(c, v)];
    }
    return 1;
  }
  if (motion_value(c, v, value)) return 1;
  if (v < 3) *value = c->now.x[v];
  else if (v == SCALE) *value = c->now.scale;
  else if (v == DAMPING) *value = c->now.damping;
  else if (v == MASS) *value = c->now.mass;
  else if (v == TIME) *value = c->now.time;
  else if (is_parameter(c, v)) *value = c->now.p[v - PARAMETER];
  else if (v >= STATE) {
    if (state_of(c, v) >= 0) *value = state_value(c, state_of(c, v));
    else if (rate_of(c, v) >= 0) *value = rates(c)[rate_of(c, v)];
    else return 0;
  } else {
    renew(c);
    if (v <= FZ) *value = c->now.scale * c->now.force[v - FX] + c->drag[v - FX];
    else if (v == ENERGY) *value = c->now.scale * c->answer[PP_ENERGY];
    else if (v >= TORQUE && v < TORQUE + 3 && pp_tells_torque(c->arrays)) {
      double torque[3];
      pp_torque(&c->model, c->now.x, c->now.p, c->now.force, torque);
      *value = c->now.scale * torque[v - TORQUE];
    } else if (v == DEPTH) *value = c->answer[PP_DEPTH];
    else if (v == DEVIATION) {
      if (!c->deviated) c->deviation = pp_deviation(&c->model, c->now.x, c->now.p, c->answer, c->work);
      c->deviated = 1;
      *value = c->deviation;
    } else if (v == STORED && c->size) *value = c->now.scale * c->stored;
    else if (v == LOST && c->size) *value = c->now.scale * c->lost;
    else return 0;
  }
  return 1;
}

/* whether the variable could be set */
static int set_value(Instance *c, uint32_t v, double value) {
  if (c->untouched && !is_parameter(c, v)) return 0;
  if (c->moves && v == MASS && !(value > 0.0)) return 0;
  if (c->moves && v >= PUSH && v < PUSH + 3) c->now.push[v - PUSH] = value;
  else if (v < 3 && !c->moves) c->now.x[v] = value;
  else if (v == SCALE && pp_finite(value)) c->now.scale = value;
  else if (v == DAMPING && pp_finite(value) && value >= 0.0) c->now.damping = value;
  else if (v == MASS && pp_finite(value) && value >= 0.0) c->now.mass = value;
  else if (is_parameter(c, v)) c->now.p[v - PARAMETER] = value;
  else if (state_of(c, v) >= 0 && (c->now.phase & (INSTANTIATED | INITIALIZING))) {
    set_state_value(c, state_of(c, v), value);
    c->now.remembers = 1;
  } else return 0;
  c->known = 0;
  return 1;
}

static int without_answer(Instance *c) {
  renew(c);
  return (c->flags & PP_NOT_A_NUMBER) != 0;
}

static int get_reals(Instance *c, const uint32_t *which, size_t count, double *values) {
  size_t i;
  if (count && (!which || !values)) return refuse(c, "Real values need references and room for values.");
  for (i = 0; i < count; i++) {
    if (!value_of(c, which[i], &values[i])) return refuse(c, "There is no real variable of this reference.");
  }
  return c->now.phase == CONTINUOUS && without_answer(c) ? DISCARD : OK; /* a solver tries another state */
}

static int set_reals(Instance *c, const uint32_t *which, size_t count, const double *values) {
  size_t i;
  if (count && (!which || !values)) return refuse(c, "Real values need references and values.");
  for (i = 0; i < count; i++) {
    if (!set_value(c, which[i], values[i])) return refuse(c, "There is no real variable of this reference that may be set now, to this value.");
  }
  return OK;
}

/* flag i of inside, contact, too deep: while a solver integrates, as at the last event */
static int flag_of(Instance *c, uint32_t i) {
  static const int bits[3] = {PP_TRUSTED, PP_CONTACT, PP_TOO_DEEP};
  renew(c);
  return ((c->now.phase == CONTINUOUS ? c->now.flags : c->flags) & bits[i]) != 0;
}

static void end_initialization(Instance *c) {
  c->now.phase = c->exchange ? EVENT : STEPPING;
  memcpy(c->now.to, c->now.x, sizeof c->now.to);
  c->known = 0;
  renew(c);
}

static void begin_continuous(Instance *c) {
  renew(c);
  c->now.flags = c->flags;
  c->now.phase = CONTINUOUS;
}

/* whether a flag has changed since the last event, so that there must be another */
static int needs_event(Instance *c) {
  renew(c);
  return c->now.flags != c->flags;
}

static size_t moment_size(const Instance *c) { return sizeof(Moment) + 2 * (size_t)c->size * sizeof(double); }

static int get_moment(Instance *c, void **moment) {
  if (!moment) return refuse(c, "A state needs a place.");
  if (!*moment) *moment = malloc(moment_size(c));
  if (!*moment) return refuse(c, "There is no memory for a state.");
  memcpy(*moment, &c->now, sizeof(Moment));
  memcpy((char *)*moment + sizeof(Moment), c->numbers, 2 * (size_t)c->size * sizeof(double));
  return OK;
}

static int set_moment(Instance *c, const void *moment) {
  if (!moment) return refuse(c, "This is no state.");
  memcpy(&c->now, moment, sizeof(Moment));
  memcpy(c->numbers, (const char *)moment + sizeof(Moment), 2 * (size_t)c->size * sizeof(double));
  c->known = 0;
  return OK;
}

static int write_moment(Instance *c, const void *moment, void *bytes, size_t size) {
  if (!moment || !bytes) return refuse(c, "A state is written to a place.");
  if (size < moment_size(c)) return refuse(c, "A state needs more room than this.");
  memcpy(bytes, moment, moment_size(c));
  return OK;
}

static int read_moment(Instance *c, const void *bytes, size_t size, void **moment) {
  Moment read;
  if (!bytes || !moment) return refuse(c, "A state is read from bytes to a place.");
  if (size != moment_size(c)) return refuse(c, "This is no state of this body.");
  memcpy(&read, bytes, sizeof read);
  if (read.phase <= 0 || read.phase > TERMINATED || (read.phase & (read.phase - 1))) return refuse(c, "This is no state of this body.");
  if (read.phase & (c->exchange ? STEPPING : EVENT | CONTINUOUS)) return refuse(c, "This is a state of the other kind of simulation.");
  if (!*moment) *moment = malloc(size);
  if (!*moment) return refuse(c, "There is no memory for a state.");
  memcpy(*moment, bytes, size);
  return OK;
}

static int get_states(Instance *c, double *values, size_t count) {
  int32_t i;
  if ((int64_t)count != c->states || (count && !values)) return refuse(c, "There is another number of continuous states.");
  for (i = 0; i < c->states; i++) values[i] = state_value(c, i);
  return OK;
}

static int set_states(Instance *c, const double *values, size_t count) {
  int32_t i;
  if ((int64_t)count != c->states || (count && !values)) return refuse(c, "There is another number of continuous states.");
  for (i = 0; i < c->states; i++) set_state_value(c, i, values[i]);
  c->known = 0;
  return OK;
}

static int get_rates(Instance *c, double *values, size_t count) {
  if ((int64_t)count != c->states || (count && !values)) return refuse(c, "There is another number of continuous states.");
  if (count) memcpy(values, rates(c), count * sizeof(double));
  return without_answer(c) ? DISCARD : OK;
}

static int get_nominals(Instance *c, double *values, size_t count) {
  int32_t i;
  if ((int64_t)count != c->states || (count && !values)) return refuse(c, "There is another number of continuous states.");
  if (c->moves) { /* the trained way, and the speed of a vibration of that size */
    const double *low = c->arrays[PP_LIMITS].real, *high = low + c->arrays[PP_LIMITS].n[1];
    for (i = 0; i < c->states; i++) {
      const int32_t a = i % felt_of(c);
      values[i] = (high[a] - low[a]) * (i < felt_of(c) ? 1.0 : PP_SQRT(pp_most(c->stiff, 1.0) / c->now.mass));
    }
    return OK;
  }
  for (i = 0; i < c->states; i++) values[i] = i < c->states - 1 ? c->usual : c->usual * c->usual;
  return OK;
}
