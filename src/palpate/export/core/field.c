/* A field over a body's surface, for the eye: rest + f(s) [sum of b_k times mode k + the local mode].
 *
 * arrays from PP_FIELD on: 0 whole numbers, see below; 1 numbers: R, s* and its width, then power, s* and a of the
 * growth with depth, reach L; 2 limits (3, n); 3 scales of rest and modes (1 + k); 4 rest and modes (1 + k, nodes x
 * components) as whole numbers of two bytes; 5 table of the local mode (parts, r, q); 6 nodes that it moves; 7 their
 * places (T, 3). From PP_VARIED on, its variation: 0 table (q m, r 4 components), 1 powers (m, v), 2 axes (a, 3), 3
 * scales (2, v). Then the network of the coefficients at PP_FIELD_NET, and the surface at PP_FIELD_SURFACE.
 */
enum { PP_NODES = 0, PP_COMPONENTS = 1, PP_MODES = 2, PP_OWN_RADIUS = 3, PP_KNOTS = 4 };
#define PP_VARIED 52
#define PP_FRAME 8 /* s, f, contact point, normal; then the further inputs */
#define PP_POWERS 8

/* numbers of one touch's shape: frame, coefficients, profile of the local mode */
PP_PART int32_t pp_shape_size(const pp_model *m) {
  const int32_t *sizes = m->a[PP_FIELD].whole;
  return PP_FRAME + PP_MOST + 1 + sizes[PP_MODES] + sizes[PP_KNOTS] * 4 * sizes[PP_COMPONENTS];
}

PP_PART pp_real pp_growth(pp_real s, const pp_real *numbers) {
  const pp_real power = numbers[0], deepest = numbers[1], length = numbers[2], t = s / deepest;
  pp_real f = t;
  if (s <= R(0)) return R(0);
  if (t >= R(1)) return t;
  if (power == R(2)) f *= t;
  if (power == R(1.5)) f *= PP_SQRT(t);
  return f * PP_SQRT((R(1) + deepest / length) / (R(1) + s / length));
}

PP_PART void pp_splines(pp_real u, pp_real *b) {
  const pp_real v = R(1) - u;
  b[0] = v * v * v / R(6);
  b[1] = (R(3) * u * u * u - R(6) * u * u + R(4)) / R(6);
  b[2] = (R(3) * v * v * v - R(6) * v * v + R(4)) / R(6);
  b[3] = u * u * u / R(6);
}

/* polynomial `row` of the place and the further inputs */
PP_PART pp_real pp_product(const pp_model *m, const pp_real *frame, int32_t row) {
  const pp_array *powers = &m->a[PP_VARIED + 1], *axes = &m->a[PP_VARIED + 2], *scales = &m->a[PP_VARIED + 3];
  const int32_t count = powers->n[1], a = axes->n[0];
  pp_real value = R(1);
  int32_t v, k;
  for (v = 0; v < count; v++) {
    const int32_t power = powers->whole[row * count + v];
    pp_real t = v >= a ? frame[PP_FRAME - a + v] : R(0), before = R(1), now;
    for (k = 0; v < a && k < 3; k++) t += axes->real[3 * v + k] * frame[2 + k];
    t = pp_least(pp_most((t - scales->real[v]) / scales->real[count + v], R(-1)), R(1));
    now = power == 0 ? R(1) : t;
    for (k = 2; k <= power; k++) {
      const pp_real next = R(2) * t * now - before;
      before = now;
      now = next;
    }
    value *= now;
  }
  return value;
}

PP_PART void pp_profile(const pp_model *m, const pp_real *frame, pp_real *profile) {
  const int32_t *sizes = m->a[PP_FIELD].whole;
  const pp_array *table = &m->a[PP_FIELD + 5], *varied = &m->a[PP_VARIED];
  const int32_t r = sizes[PP_KNOTS], components = sizes[PP_COMPONENTS], q = table->n[2];
  const pp_real share = pp_least(frame[0] / m->a[PP_FIELD + 1].real[4], R(1)), f = frame[1];
  pp_real four[4];
  int32_t i, j, k, o, c, e, first;
  for (i = 0; i < r * 4 * components; i++) profile[i] = R(0);
  if (r == 0 || f == R(0)) return;
  if (varied->n[0] > 0) {
    const int32_t many = m->a[PP_VARIED + 1].n[0], knots = varied->n[0] / many, wide = varied->n[1];
    first = (int32_t)(share * (pp_real)(knots - 3));
    if (first > knots - 4) first = knots - 4;
    pp_splines(share * (pp_real)(knots - 3) - (pp_real)first, four);
    for (o = 0; o < many; o++) {
      const pp_real polynomial = f * pp_product(m, frame, o);
      for (k = 0; k < 4; k++) {
        const pp_real *line = varied->real + (size_t)((first + k) * many + o) * (size_t)wide;
        const pp_real t = polynomial * four[k];
        for (i = 0; i < wide; i++) profile[i] += t * line[i];
      }
    }
  }
  first = (int32_t)(share * (pp_real)(q - 3));
  if (first > q - 4) first = q - 4;
  pp_splines(share * (pp_real)(q - 3) - (pp_real)first, four);
  for (i = 0; i < r; i++) {
    pp_real along = R(0), across = R(0), *own = profile + i * 4 * components;
    for (j = 0; j < 4; j++) {
      along += f * four[j] * table->real[i * q + first + j];
      if (components > 1) across += f * four[j] * table->real[(r + i) * q + first + j];
    }
    if (components == 1) {
      own[0] += along;
      continue;
    }
    for (c = 0; c < 3; c++) {
      own[c] += along * frame[5 + c];
      own[3 * (1 + c) + c] += across;
      for (e = 0; e < 3; e++) own[3 * (1 + e) + c] -= across * frame[5 + e] * frame[5 + c];
    }
  }
}

/* Find the shape of a touch at x (3) and p; the flags. */
PP_PART int32_t pp_touch_shape(const pp_model *m, const pp_real *x, const pp_real *p, pp_real *shape) {
  const int32_t *sizes = m->a[PP_FIELD].whole;
  const int32_t n = m->a[PP_HEAD].whole[PP_INPUTS], own = sizes[PP_OWN_RADIUS], modes = sizes[PP_MODES];
  const pp_real *numbers = m->a[PP_FIELD + 1].real;
  pp_real *frame = shape, *z = shape + PP_FRAME + PP_MOST;
  pp_real line[PP_MOST], by[PP_MOST], twice[PP_MOST], xi[PP_MOST], normal[3], hessian[9], d, s, deep, unused, none;
  int32_t i, k;
  int finite = 1;
  for (i = 0; i < n; i++) {
    line[i] = i < 3 ? x[i] : p[i - 3];
    finite = finite && pp_finite(line[i]);
  }
  for (i = 0; i < pp_shape_size(m); i++) shape[i] = R(0);
  for (k = 0; k <= modes; k++) z[k] = finite ? (k == 0 ? R(1) : R(0)) : pp_nan();
  if (!finite) return PP_NOT_A_NUMBER;
  d = pp_distance(x, normal, hessian, &m->a[PP_FIELD_SURFACE]);
  s = (own < 0 ? numbers[0] : line[own]) - d;
  frame[0] = s;
  if (s <= R(0)) return PP_TRUSTED;
  frame[1] = pp_growth(s, numbers + 3);
  deep = pp_saturated(s, numbers[1], numbers[2], &unused, &none);
  for (i = 0; i < 3; i++) {
    line[i] += (s - deep) * normal[i];
    frame[2 + i] = x[i] - d * normal[i];
    frame[5 + i] = normal[i];
  }
  pp_box(m->a[PP_FIELD + 2].real, n, line, by, twice);
  for (i = 3; i < n; i++) frame[PP_FRAME - 3 + i] = line[i];
  pp_scale(m->a + PP_FIELD_NET, line, xi);
  pp_latent(m->a + PP_FIELD_NET, xi, z + 1, 0);
  for (k = 1; k <= modes; k++) z[k] *= frame[1];
  pp_profile(m, frame, z + 1 + modes);
  return PP_CONTACT;
}

#define PP_TOGETHER 32 /* values that are summed over all modes in registers; gcc unrolls shorter loops, to no good */

/* PP_TOGETHER sums of modes (1 + k rows, `all` numbers apart): a loop of fixed length, for vector instructions */
PP_PART void pp_sum_modes(const int16_t *restrict table, int32_t all, int32_t modes, const pp_real *restrict z,
                          const pp_real *restrict scales, pp_real *restrict sums) {
  int32_t k;
  int l;
  for (l = 0; l < PP_TOGETHER; l++) sums[l] = R(0);
  for (k = 0; k <= modes; k++) {
    const int16_t *restrict row = table + (size_t)k * (size_t)all;
    const pp_real a = z[k] * scales[k];
    for (l = 0; l < PP_TOGETHER; l++) sums[l] += a * (pp_real)row[l];
  }
}

/* Fill values (count x components) of the nodes from `first` on, of a touch whose shape was found. */
PP_PART void pp_shape_values(const pp_model *m, const pp_real *shape, int32_t first, int32_t count, pp_real *values) {
  const int32_t *sizes = m->a[PP_FIELD].whole;
  const int32_t components = sizes[PP_COMPONENTS], modes = sizes[PP_MODES], r = sizes[PP_KNOTS];
  const int32_t all = sizes[PP_NODES] * components, wanted = count * components;
  const pp_real *frame = shape, *z = shape + PP_FRAME + PP_MOST, *profile = z + 1 + modes;
  const pp_real *scales = m->a[PP_FIELD + 3].real, reach = m->a[PP_FIELD + 1].real[6];
  const int16_t *table = m->a[PP_FIELD + 4].small + first * components;
  const pp_array *nodes = &m->a[PP_FIELD + 6];
  const int32_t wide = 4 * components;
  pp_real sums[PP_TOGETHER];
  int32_t i, k, low = 0, high = nodes->n[0];
  for (i = 0; i + PP_TOGETHER <= wanted; i += PP_TOGETHER) {
    pp_sum_modes(table + i, all, modes, z, scales, sums);
    memcpy(values + i, sums, sizeof sums);
  }
  for (; i < wanted; i++) {
    values[i] = R(0);
    for (k = 0; k <= modes; k++) values[i] += z[k] * scales[k] * (pp_real)table[(size_t)k * (size_t)all + (size_t)i];
  }
  if (frame[1] == R(0)) return;
  while (low < high) { /* the first moving node that is wanted */
    const int32_t middle = (low + high) / 2;
    if (nodes->whole[middle] < first) low = middle + 1;
    else high = middle;
  }
  for (i = low; i < nodes->n[0] && nodes->whole[i] < first + count; i++) {
    const pp_real *place = m->a[PP_FIELD + 7].real + 3 * i;
    const pp_real x = (place[0] - frame[2]) / reach, y = (place[1] - frame[3]) / reach, h = (place[2] - frame[4]) / reach;
    const pp_real q = x * x + y * y + h * h;
    pp_real *value = values + (nodes->whole[i] - first) * components, line[12], four[4], t;
    int32_t start, c;
    if (q >= R(1)) continue;
    t = PP_SQRT(q) * (pp_real)(r - 3);
    start = (int32_t)t;
    if (start > r - 4) start = r - 4;
    pp_splines(t - (pp_real)start, four);
    for (k = 0; k < wide; k++) {
      const pp_real *own = profile + start * wide + k;
      line[k] = four[0] * own[0] + four[1] * own[wide] + four[2] * own[2 * wide] + four[3] * own[3 * wide];
    }
    for (c = 0; c < components; c++) {
      value[c] += line[c] + x * line[components + c] + y * line[2 * components + c] + h * line[3 * components + c];
    }
  }
}
