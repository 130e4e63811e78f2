/* A mass that a learnt body holds or pushes: m a = force of the body + push - damping v, along the felt directions.
 *
 * The body itself stays quasi-static. Its states are the ways along the felt directions, m, then their speeds, m/s. In
 * co-simulation they are integrated by the classical method of Runge and Kutta in steps that are short beside the period
 * of the stiffest spring around; in model exchange by the simulator's solver.
 */
#define SHORT 0.02 /* of an inner step: angle of the stiffest vibration, rad */
#define MOST_INNER_STEPS 1000000

static int32_t felt_of(const Instance *c) { return c->arrays[PP_HEAD].whole[PP_FELT]; }

/* the largest stiffness that an answer can mean, N/m: the norm of its matrix */
static double stiffness_of(const double *answer) {
  double square = 0.0;
  int i;
  for (i = 0; i < 9; i++) square += answer[PP_STIFFNESS + i] * answer[PP_STIFFNESS + i];
  return PP_SQRT(square);
}

static void place_of(const Instance *c, const double *ways, double *x) {
  const double *axes = c->arrays[PP_AXES].real;
  int32_t a, i;
  for (i = 0; i < 3; i++) {
    x[i] = 0.0;
    for (a = 0; a < felt_of(c); a++) x[i] += ways[a] * axes[3 * a + i];
  }
}

static void move_to(Instance *c) {
  place_of(c, c->now.motion, c->now.x);
  c->known = 0;
}

/* rates of the states, and the stiffness there; not-a-number where there is no answer */
static double motion_rates(Instance *c, const double *states, double *rate) {
  const double *axes = c->arrays[PP_AXES].real;
  const int32_t k = felt_of(c);
  double answer[PP_ANSWER], x[3];
  int32_t a, i, flags;
  place_of(c, states, x);
  flags = pp_answer(&c->model, x, c->now.p, answer);
  for (a = 0; a < k; a++) {
    double along = 0.0;
    for (i = 0; i < 3; i++) {
      const double force = flags & PP_TOO_DEEP ? 0.0 : c->now.scale * answer[PP_FORCE + i];
      along += axes[3 * a + i] * (force + c->now.push[i]);
    }
    rate[a] = states[k + a];
    rate[k + a] = flags & PP_NOT_A_NUMBER ? pp_nan() : (along - c->now.damping * states[k + a]) / c->now.mass;
  }
  return PP_ABS(c->now.scale) * stiffness_of(answer);
}

/* one inner step; `first` holds the rates at its beginning */
static void inner_step(Instance *c, double h, const double *first) {
  static const double share[3] = {0.5, 0.5, 1.0}, weight[3] = {2.0, 2.0, 1.0};
  const int32_t count = 2 * felt_of(c);
  double there[6], rate[6], total[6];
  int32_t i, s;
  memcpy(rate, first, sizeof rate);
  memcpy(total, first, sizeof total);
  for (s = 0; s < 3; s++) {
    for (i = 0; i < count; i++) there[i] = c->now.motion[i] + share[s] * h * rate[i];
    motion_rates(c, there, rate);
    for (i = 0; i < count; i++) total[i] += weight[s] * rate[i];
  }
  for (i = 0; i < count; i++) c->now.motion[i] += h / 6.0 * total[i];
}

/* Carry the mass over a step; 0 where that has no answer, or would take too many inner steps: nothing moves then. */
static int carry_mass(Instance *c, double dt) {
  double left = dt, before[6], rate[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  int32_t count = 0, i;
  int sound = 1;
  memcpy(before, c->now.motion, sizeof before);
  while (left > 0.0 && sound) {
    const double k = pp_most(motion_rates(c, c->now.motion, rate), PP_ABS(c->now.scale) * c->stiff);
    const double fast = PP_SQRT(k / c->now.mass) + c->now.damping / c->now.mass;
    const double h = fast * left > SHORT ? left / ceil(fast * left / SHORT) : left;
    inner_step(c, h, rate);
    left = h < left ? left - h : 0.0;
    for (i = 0; i < 2 * felt_of(c); i++) sound &= pp_finite(c->now.motion[i]) != 0;
    sound &= ++count < MOST_INNER_STEPS;
  }
  if (!sound) memcpy(c->now.motion, before, sizeof before);
  move_to(c);
  return sound;
}

/* the mass rests where the body is touched or held at the start */
static void start_motion(Instance *c) {
  const double *given = c->arrays[PP_MOTION].real, *axes = c->arrays[PP_AXES].real;
  int32_t a, i;
  c->now.mass = given[0];
  c->now.damping = given[1];
  for (a = 0; a < felt_of(c); a++) {
    c->now.motion[a] = 0.0;
    for (i = 0; i < 3; i++) c->now.motion[a] += c->now.x[i] * axes[3 * a + i];
  }
  place_of(c, c->now.motion, c->now.x);
}

/* a variable of motion alone; 0 where this reference is none */
static int motion_value(const Instance *c, uint32_t v, double *value) {
  const int32_t k = felt_of(c);
  int32_t a;
  if (!c->moves) return 0;
  if (v >= PUSH && v < PUSH + 3) {
    *value = c->now.push[v - PUSH];
  } else if (v >= SPEED && v < SPEED + 3) {
    double speed[3];
    place_of(c, c->now.motion + k, speed);
    *value = speed[v - SPEED];
  } else if (v == KINETIC) {
    *value = 0.0;
    for (a = 0; a < k; a++) *value += 0.5 * c->now.mass * c->now.motion[k + a] * c->now.motion[k + a];
  } else {
    return 0;
  }
  return 1;
}
