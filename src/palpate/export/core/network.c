/* A radial-basis-function network with an affine tail: value, slopes and curvatures in one pass over its units.
 *
 * PP_LANES units are evaluated together, along fixed loops that every compiler turns into vector instructions, with as
 * many running sums. What is stored of a group of units: entries of the factors, shifts, entries i <= j of A'A by the
 * first inputs, weights of the latent outputs.
 */
#ifdef PP_SINGLE
typedef uint32_t pp_bits;
#define PP_SHIFT 23
static const pp_real PP_EXPONENTIAL[5] = {R(0x1.715476p+0), R(0x1.62e000p-1), R(0x1.0bfbe8p-15), R(12582912), R(80)};
#else
typedef uint64_t pp_bits;
#define PP_SHIFT 52
static const pp_real PP_EXPONENTIAL[5] = {R(0x1.71547652b82fep+0), R(0x1.62e42fefa2000p-1), R(0x1.9ef35793c7673p-41),
                                          R(6755399441055744), R(700)};
#endif
static const pp_real PP_TAYLOR[14] = {
    R(1), R(1), R(1) / R(2), R(1) / R(6), R(1) / R(24), R(1) / R(120), R(1) / R(720), R(1) / R(5040), R(1) / R(40320),
    R(1) / R(362880), R(1) / R(3628800), R(1) / R(39916800), R(1) / R(479001600), R(1) / R(6227020800.0)};

/* e[l] = exp(-t[l]) for t >= 0 */
PP_PART void pp_exponential(const pp_real *restrict t, pp_real *restrict e) {
  union {
    pp_real number[PP_LANES];
    pp_bits bits[PP_LANES];
  } whole, power;
  pp_real x[PP_LANES];
  const pp_real log2e = PP_EXPONENTIAL[0], high = PP_EXPONENTIAL[1], low = PP_EXPONENTIAL[2];
  const pp_real magic = PP_EXPONENTIAL[3], limit = PP_EXPONENTIAL[4];
  int l;
  /* in a loop of its own: GCC would make a branch of it, and take the units one by one */
  for (l = 0; l < PP_LANES; l++) x[l] = limit < t[l] ? limit : t[l];
  for (l = 0; l < PP_LANES; l++) {
    const pp_real w = magic - x[l] * log2e;
    const pp_real s = w - magic;
    const pp_real u = (-x[l] - s * high) - s * low;
    /* in pairs (Estrin's scheme), so that no long chain of operations waits for itself */
    const pp_real u2 = u * u, u4 = u2 * u2, u8 = u4 * u4;
    const pp_real a0 = R(1) + u, a1 = PP_TAYLOR[2] + u * PP_TAYLOR[3], a2 = PP_TAYLOR[4] + u * PP_TAYLOR[5];
    const pp_real a3 = PP_TAYLOR[6] + u * PP_TAYLOR[7], a4 = PP_TAYLOR[8] + u * PP_TAYLOR[9];
    const pp_real a5 = PP_TAYLOR[10] + u * PP_TAYLOR[11], a6 = PP_TAYLOR[12] + u * PP_TAYLOR[13];
    power.number[l] = ((a0 + u2 * a1) + u4 * (a2 + u2 * a3)) + u8 * ((a4 + u2 * a5) + u4 * a6);
    whole.number[l] = w;
  }
  /* the last bits of `whole` are s; added to the exponent they multiply by 2^s */
  for (l = 0; l < PP_LANES; l++) power.bits[l] += whole.bits[l] << PP_SHIFT;
  memcpy(e, power.number, sizeof power.number);
}

/* g(q) and, by q, g' and g'' of PP_LANES units */
PP_PART void pp_radial(int32_t code, const pp_real *restrict q, pp_real *restrict g, pp_real *restrict first,
                       pp_real *restrict second) {
  pp_real s[PP_LANES];
  int l;
  if (code == 0) { /* gaussian */
    pp_exponential(q, g);
    for (l = 0; l < PP_LANES; l++) {
      first[l] = -g[l];
      second[l] = g[l];
    }
  } else if (code == 1) { /* inverse multiquadric */
    for (l = 0; l < PP_LANES; l++) {
      const pp_real t = R(1) / (R(1) + q[l]);
      g[l] = PP_SQRT(t);
      first[l] = R(-0.5) * g[l] * t;
      second[l] = R(0.75) * g[l] * t * t;
    }
  } else { /* matern-5/2 */
    const pp_real third = R(1) / R(3), a = R(-5) / R(6), b = R(25) / R(12);
    for (l = 0; l < PP_LANES; l++) {
      const pp_real t = PP_SQRT(R(5) * q[l]);
      s[l] = t > PP_EXPONENTIAL[4] ? PP_EXPONENTIAL[4] : t;
    }
    pp_exponential(s, g);
    for (l = 0; l < PP_LANES; l++) {
      first[l] = a * (R(1) + s[l]) * g[l];
      second[l] = b * g[l];
      g[l] = (R(1) + s[l] + s[l] * s[l] * third) * g[l];
    }
  }
}

/* Entries and shifts of one group: v = A xi - b row by row, and q = |v|^2. */
PP_PART void pp_distances(const pp_array *net, const pp_real *restrict unit, const pp_real *restrict xi,
                          pp_real (*restrict v)[PP_LANES], pp_real *restrict q) {
  const int32_t *layout = net[PP_LAYOUT].whole;
  const int32_t e = net[PP_SIZES].whole[1], r = net[PP_SIZES].whole[2];
  int32_t a, i = 0;
  int l;
  for (l = 0; l < PP_LANES; l++) q[l] = R(0);
  for (a = 0; a < r; a++) {
    const pp_real *shift = unit + (e + a) * PP_LANES;
    pp_real *row = v[a];
    for (l = 0; l < PP_LANES; l++) row[l] = -shift[l];
    /* two entries in one pass: each pass reads and writes the row */
    for (; i + 1 < e && layout[2 * i + 2] == a; i += 2) {
      const pp_real *one = unit + i * PP_LANES, *other = one + PP_LANES;
      const pp_real t = xi[layout[2 * i + 1]], t2 = xi[layout[2 * i + 3]];
      for (l = 0; l < PP_LANES; l++) row[l] = (row[l] + one[l] * t) + other[l] * t2;
    }
    if (i < e && layout[2 * i] == a) {
      const pp_real *one = unit + i * PP_LANES, t = xi[layout[2 * i + 1]];
      for (l = 0; l < PP_LANES; l++) row[l] += one[l] * t;
      i++;
    }
    for (l = 0; l < PP_LANES; l++) q[l] += row[l] * row[l];
  }
}

/* u = A'v of one group, for inputs below `count` */
PP_PART void pp_pulled(const pp_array *net, const pp_real *restrict unit, pp_real (*restrict v)[PP_LANES], int32_t count,
                       pp_real (*restrict u)[PP_LANES]) {
  const int32_t *layout = net[PP_LAYOUT].whole;
  const int32_t e = net[PP_SIZES].whole[1];
  int32_t i;
  int l;
  for (i = 0; i < count; i++) {
    for (l = 0; l < PP_LANES; l++) u[i][l] = R(0);
  }
  for (i = 0; i < e; i++) {
    const int32_t column = layout[2 * i + 1];
    if (column < count) {
      const pp_real *row = v[layout[2 * i]];
      for (l = 0; l < PP_LANES; l++) u[column][l] += unit[i * PP_LANES + l] * row[l];
    }
  }
}

PP_PART pp_real pp_sum(const pp_real *lanes) {
  pp_real total = lanes[0];
  int l;
  for (l = 1; l < PP_LANES; l++) total += lanes[l];
  return total;
}

/* Value of the only output at scaled inputs; slopes g (q) and curvatures H (q, q) by the first q unscaled inputs. */
PP_PART pp_real pp_second_order(const pp_array *net, const pp_real *xi, int32_t q, pp_real *g, pp_real *H) {
  const int32_t *sizes = net[PP_SIZES].whole;
  const int32_t n = sizes[0], e = sizes[1], r = sizes[2], groups = net[PP_UNITS].n[0], pairs = sizes[6];
  const int32_t record = (e + r + pairs + 1) * PP_LANES;
  const pp_real *tail = net[PP_TAIL].real, *scales = net[PP_SCALES].real + n;
  pp_real v[PP_MOST][PP_LANES], u[3][PP_LANES], distance[PP_LANES], phi[PP_LANES], d1[PP_LANES], d2[PP_LANES];
  pp_real value[PP_LANES], slopes[3][PP_LANES], bends[6][PP_LANES], bent[PP_LANES], total;
  int32_t k, i, j, pair;
  int l;
  for (l = 0; l < PP_LANES; l++) value[l] = R(0);
  for (i = 0; i < 3; i++) {
    for (l = 0; l < PP_LANES; l++) slopes[i][l] = R(0);
  }
  for (i = 0; i < 6; i++) {
    for (l = 0; l < PP_LANES; l++) bends[i][l] = R(0);
  }
  for (k = 0; k < groups; k++) {
    const pp_real *unit = net[PP_UNITS].real + (size_t)k * (size_t)record;
    const pp_real *gram = unit + (e + r) * PP_LANES, *weight = unit + (e + r + pairs) * PP_LANES;
    pp_distances(net, unit, xi, v, distance);
    pp_radial(sizes[5], distance, phi, d1, d2);
    pp_pulled(net, unit, v, q, u);
    for (l = 0; l < PP_LANES; l++) {
      value[l] += weight[l] * phi[l];
      d1[l] *= R(2) * weight[l];
      d2[l] *= R(4) * weight[l];
    }
    pair = 0;
    for (i = 0; i < q; i++) {
      for (l = 0; l < PP_LANES; l++) {
        bent[l] = d2[l] * u[i][l];
        slopes[i][l] += d1[l] * u[i][l];
      }
      for (j = i; j < q; j++, pair++) {
        const pp_real *square = gram + pair * PP_LANES;
        for (l = 0; l < PP_LANES; l++) bends[pair][l] += d1[l] * square[l] + bent[l] * u[j][l];
      }
    }
  }
  pair = 0;
  for (i = 0; i < q; i++) {
    g[i] = (tail[1 + i] + pp_sum(slopes[i])) / scales[i];
    for (j = i; j < q; j++, pair++) {
      H[q * i + j] = pp_sum(bends[pair]) / (scales[i] * scales[j]);
      H[q * j + i] = H[q * i + j];
    }
  }
  total = tail[0];
  for (i = 0; i < n; i++) total += tail[1 + i] * xi[i];
  return total + pp_sum(value);
}

/* Scaled inputs xi = (x - c) / (h + b (x - c)); without bends b, and far outside of the range, the denominator is fixed. */
PP_PART void pp_scale(const pp_array *net, const pp_real *x, pp_real *xi) {
  const int32_t n = net[PP_SIZES].whole[0];
  const pp_real *scales = net[PP_SCALES].real;
  int32_t i;
  for (i = 0; i < n; i++) {
    const pp_real far = x[i] - scales[i], h = scales[n + i];
    const pp_real b = net[PP_SCALES].n[0] == 3 ? scales[2 * n + i] : R(0);
    xi[i] = far / (b == R(0) ? h : pp_most(h + b * far, h / (R(2) * (R(1) + PP_ABS(b)))));
  }
}

/* Derivative of a scaled input by the unscaled one, the scaled one being known: d = h / (1 - b xi), and h / d^2. */
PP_PART pp_real pp_scale_slope(const pp_array *net, int32_t i, pp_real xi) {
  const int32_t n = net[PP_SIZES].whole[0];
  const pp_real h = net[PP_SCALES].real[n + i];
  const pp_real b = net[PP_SCALES].n[0] == 3 ? net[PP_SCALES].real[2 * n + i] : R(0);
  const pp_real turn = R(1) - b * xi, end = R(2) * (R(1) + PP_ABS(b));
  if (b == R(0)) return R(1) / h;
  return turn > end ? end / h : turn * turn / h;
}

/* Latent outputs (k) at scaled inputs; with `slopes` also their derivatives (n, k) by the unscaled inputs. */
PP_PART void pp_latent(const pp_array *net, const pp_real *xi, pp_real *y, pp_real *slopes) {
  const int32_t *sizes = net[PP_SIZES].whole;
  const int32_t n = sizes[0], e = sizes[1], r = sizes[2], outputs = sizes[4], pairs = sizes[6];
  const int32_t record = (e + r + pairs + outputs) * PP_LANES, groups = net[PP_UNITS].n[0];
  const pp_real *tail = net[PP_TAIL].real;
  pp_real v[PP_MOST][PP_LANES], u[PP_MOST][PP_LANES], distance[PP_LANES], phi[PP_LANES], d1[PP_LANES], d2[PP_LANES];
  pp_real part[PP_LANES], step[PP_MOST];
  int32_t k, i, o;
  int l;
  for (o = 0; o < outputs; o++) {
    y[o] = tail[o];
    for (i = 0; i < n; i++) y[o] += tail[(1 + i) * outputs + o] * xi[i];
  }
  for (i = 0; slopes && i < n; i++) {
    step[i] = pp_scale_slope(net, i, xi[i]);
    for (o = 0; o < outputs; o++) slopes[i * outputs + o] = tail[(1 + i) * outputs + o] * step[i];
  }
  for (k = 0; k < groups; k++) {
    const pp_real *unit = net[PP_UNITS].real + (size_t)k * (size_t)record;
    const pp_real *weights = unit + (e + r + pairs) * PP_LANES;
    pp_distances(net, unit, xi, v, distance);
    pp_radial(sizes[5], distance, phi, d1, d2);
    for (o = 0; o < outputs; o++) {
      for (l = 0; l < PP_LANES; l++) part[l] = weights[o * PP_LANES + l] * phi[l];
      y[o] += pp_sum(part);
    }
    if (!slopes) continue;
    pp_pulled(net, unit, v, n, u);
    for (i = 0; i < n; i++) {
      for (o = 0; o < outputs; o++) {
        for (l = 0; l < PP_LANES; l++) part[l] = R(2) * weights[o * PP_LANES + l] * d1[l] * u[i][l];
        slopes[i * outputs + o] += pp_sum(part) * step[i];
      }
    }
  }
}

/* Regressors [1, xi, phi] of so many units into line 0 of `lines`, their derivatives by the first `felt` unscaled
 * inputs into the lines after it; a line holds `width` numbers. */
PP_PART void pp_regressors(const pp_array *net, const pp_real *xi, int32_t units, int32_t felt, int32_t width, pp_real *lines) {
  const int32_t *sizes = net[PP_SIZES].whole;
  const int32_t n = sizes[0], e = sizes[1], r = sizes[2], pairs = sizes[6];
  const int32_t record = (e + r + pairs + sizes[4]) * PP_LANES;
  const pp_real *scales = net[PP_SCALES].real + n;
  pp_real v[PP_MOST][PP_LANES], u[3][PP_LANES], distance[PP_LANES], phi[PP_LANES], d1[PP_LANES], d2[PP_LANES];
  int32_t k, i;
  int l;
  for (k = 0; k < (1 + felt) * width; k++) lines[k] = R(0);
  lines[0] = R(1);
  for (i = 0; i < n; i++) lines[1 + i] = xi[i];
  for (i = 0; i < felt; i++) lines[(1 + i) * width + 1 + i] = R(1) / scales[i];
  for (k = 0; k < units; k += PP_LANES) {
    const pp_real *unit = net[PP_UNITS].real + (size_t)(k / PP_LANES) * (size_t)record;
    pp_distances(net, unit, xi, v, distance);
    pp_radial(sizes[5], distance, phi, d1, d2);
    pp_pulled(net, unit, v, felt, u);
    for (l = 0; l < PP_LANES && k + l < units; l++) {
      lines[1 + n + k + l] = phi[l];
      for (i = 0; i < felt; i++) lines[(1 + i) * width + 1 + n + k + l] = R(2) * d1[l] * u[i][l] / scales[i];
    }
  }
}
