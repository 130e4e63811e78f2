/* The distance to a touched surface: value, gradient and Hessian, from cubic splines on a grid.
 *
 * arrays: frame (4), or (15) of a flat surface; coefficients (i, j, k); profile (m, n) of a flat surface.
 * A table is dense, or in tiles of numbers (see `pp_gather`) or of digits (see `pp_gather_digits`).
 */
#define PP_FAR R(1e6) /* cells beyond the box after which nothing changes */
#define PP_TILE 4     /* nodes along each side of a tile */

/* of tiles of digits: see export/lattice_tiles.py */
#define PP_ROW 4095u /* digits to a row, after which a zero stands */
#define PP_GROUP 8   /* tiles to a place */
#define PP_BASE_DIGITS 5
#define PP_SLOPE_DIGITS 3
#define PP_TILE_HEAD (PP_BASE_DIGITS + 3 * PP_SLOPE_DIGITS)
#define PP_WIDEST 26 /* most bits of what remains */
#define PP_LONGEST (PP_TILE_HEAD + (64 * PP_WIDEST + 5) / 6)

/* first node of four, their weights, and the weights' first and second derivatives */
PP_PART int32_t pp_weights(pp_real u, int32_t nodes, pp_real *b, pp_real *p, pp_real *q) {
  const pp_real inner = u > R(1) ? pp_least(u, (pp_real)(nodes - 2)) : R(1); /* also of what is no number */
  int32_t i = (int32_t)inner, k;
  pp_real t, s, beyond;
  if (i > nodes - 3) i = nodes - 3;
  t = inner - (pp_real)i;
  s = R(1) - t;
  b[0] = s * s * s / R(6);
  b[1] = R(2) / R(3) - t * t * (R(1) - t / R(2));
  b[2] = R(2) / R(3) - s * s * (R(1) - s / R(2));
  b[3] = t * t * t / R(6);
  p[0] = -s * s / R(2);
  p[1] = -t * (R(2) - R(1.5) * t);
  p[2] = s * (R(2) - R(1.5) * s);
  p[3] = t * t / R(2);
  beyond = u - (pp_real)i - t;
  if (beyond == R(0)) {
    q[0] = s;
    q[1] = R(1) - R(3) * s;
    q[2] = R(1) - R(3) * t;
    q[3] = t;
    return i - 1;
  }
  beyond = pp_least(pp_most(beyond, -PP_FAR), PP_FAR);
  for (k = 0; k < 4; k++) {
    b[k] += beyond * p[k];
    q[k] = R(0);
  }
  return i - 1;
}

/* the six bits of a digit */
PP_PART uint32_t pp_digit(char digit) { return 93u * (uint32_t)(unsigned char)digit >> 7 & 63u; }

/* digits of a tile by its code */
PP_PART uint32_t pp_tile_length(uint32_t code) { return code < 2 ? 0u : PP_TILE_HEAD + (64u * (code - 2) + 5u) / 6u; }

/* the place of a digit, rows' ends counted */
PP_PART size_t pp_digit_place(uint32_t number) { return (size_t)number + number / PP_ROW; }

PP_PART uint32_t pp_tile_code(const pp_array *table, uint32_t tile) { return pp_digit(table->digits[pp_digit_place(tile)]); }

/* where a tile's digits are; those that go over the end of a row are put together in room for PP_LONGEST */
PP_PART const char *pp_tile_digits(const pp_array *table, uint32_t tile, uint32_t code, char *room) {
  uint32_t number = (uint32_t)table->whole[3 + tile / PP_GROUP], other, left;
  const uint32_t length = pp_tile_length(code);
  const char *own;
  for (other = tile - tile % PP_GROUP; other < tile; other++) number += pp_tile_length(pp_tile_code(table, other));
  left = PP_ROW - number % PP_ROW;
  own = table->digits + pp_digit_place(number);
  if (length <= left) return own;
  memcpy(room, own, left);
  memcpy(room + left, own + left + 1, length - left);
  return room;
}

/* The nodes of a tile from low to before high along each axis, into c, where node (x, y, z) has number 16 x + 4 y + z. */
PP_PART void pp_gather_tile(const pp_array *table, uint32_t tile, const int32_t *low, const int32_t *high, pp_real *c,
                            int32_t shift) {
  const uint32_t code = pp_tile_code(table, tile), width = code < 2 ? 0 : code - 2, mask = (UINT32_C(1) << width) - 1;
  const pp_real quantum = (pp_real)ldexp(1.0, (int)table->whole[0]);
  int32_t plane[4] = {0, 0, 0, 0}, line, a, z; /* base and slopes */
  const char *own = table->digits;
  char room[PP_LONGEST];
  if (code < 2) {
    plane[0] = table->whole[1 + code];
  } else {
    own = pp_tile_digits(table, tile, code, room);
    for (a = 0; a < 4; a++) {
      const int count = a == 0 ? PP_BASE_DIGITS : PP_SLOPE_DIGITS;
      int digit;
      for (digit = count - 1; digit >= 0; digit--) plane[a] = plane[a] << 6 | (int32_t)pp_digit(own[digit]);
      plane[a] -= 1 << (6 * count - 1);
      own += count;
    }
  }
  for (line = PP_TILE * low[0]; line < PP_TILE * high[0]; line++) {
    const int32_t y = line % PP_TILE, start = plane[0] + line / PP_TILE * plane[1] + y * plane[2];
    const uint32_t bit = width * (uint32_t)(PP_TILE * line + low[2]);
    const char *next = own + bit / 6;
    uint32_t bits = 0, have = 0; /* bits that were read and are not used yet */
    if (y < low[1] || y >= high[1]) continue;
    if (width) {
      bits = pp_digit(*next++) >> bit % 6;
      have = 6 - bit % 6;
    }
    for (z = low[2]; z < high[2]; z++) {
      for (; have < width; have += 6) bits |= pp_digit(*next++) << have;
      c[shift + PP_TILE * line + z] = (pp_real)(start + z * plane[3] + (int32_t)(bits & mask)) * quantum;
      bits >>= width;
      have -= width;
    }
  }
}

/* 4 x 4 x 4 coefficients from a node on into c, of tiles of whole numbers: the eight tiles that may have some of them.
 *
 * A tile's code is 0 or 1 where all its numbers are whole[1] or whole[2], and 2 + w for a plane and w bits of what
 * remains of each number. All are multiples of 2^whole[0], exactly. The tiles' codes stand first among the digits; those
 * of tile 8 g begin at number whole[3 + g], rows' ends not counted. */
PP_PART void pp_gather_digits(const pp_array *table, const int32_t *from, pp_real *c) {
  int32_t corner, low[3], high[3], a;
  for (corner = 0; corner < 8; corner++) {
    int32_t tile = 0, shift = 0, some = 1;
    for (a = 0; a < 3; a++) {
      const int32_t own = from[a] / PP_TILE + (corner >> a & 1), before = PP_TILE * own - from[a];
      low[a] = before < 0 ? -before : 0;
      high[a] = before > 0 ? PP_TILE - before : PP_TILE;
      some = some && low[a] < high[a];
      tile = tile * ((table->n[a] + PP_TILE - 1) / PP_TILE) + own;
      shift = shift * PP_TILE + before;
    }
    if (some) pp_gather_tile(table, (uint32_t)tile, low, high, c, shift);
  }
}

/* 4 x 4 x 4 (or 4 x 4, for n[2] = 1) coefficients from a node on into c.
 *
 * A table whose `whole` is set is made of tiles of 4 nodes along each side: whole[tile] is the place in `real` of its
 * numbers, or -1 - the place of a constant and three slopes (by nodes) of a tile on which the table is straight. */
PP_PART void pp_gather(const pp_array *table, int32_t i, int32_t j, int32_t k, pp_real *c) {
  const uint32_t n1 = (uint32_t)table->n[1], n2 = (uint32_t)table->n[2], deep = n2 == 1 ? 1 : PP_TILE;
  const uint32_t tiles1 = (n1 + PP_TILE - 1) / PP_TILE, tiles2 = (n2 + PP_TILE - 1) / PP_TILE;
  const int32_t from[3] = {i, j, k};
  uint32_t node;
  if (table->digits) {
    pp_gather_digits(table, from, c);
    return;
  }
  for (node = 0; node < 4 * PP_TILE * deep; node++) {
    const uint32_t line = deep == 1 ? node : node / 4, x = (uint32_t)i + line / 4, y = (uint32_t)j + line % 4;
    const uint32_t z = deep == 1 ? 0 : (uint32_t)k + node % 4;
    const pp_real *own = table->real;
    int32_t place;
    if (!table->whole) {
      c[node] = own[((size_t)x * n1 + y) * n2 + z];
      continue;
    }
    place = table->whole[(x / PP_TILE * tiles1 + y / PP_TILE) * tiles2 + z / PP_TILE];
    own += place < 0 ? -1 - place : place;
    if (place < 0) {
      c[node] = own[0] + (pp_real)(x % PP_TILE) * own[1] + (pp_real)(y % PP_TILE) * own[2] + (pp_real)(z % PP_TILE) * own[3];
    } else {
      c[node] = own[(PP_TILE * (x % PP_TILE) + y % PP_TILE) * deep + z % PP_TILE];
    }
  }
}

/* spline of two variables: value, derivatives by u and v, then by uu, vv and uv, in cells */
PP_PART void pp_of_two(pp_real u, pp_real v, const pp_array *table, pp_real *f) {
  pp_real bu[4], pu[4], qu[4], bv[4], pv[4], qv[4], c[16];
  const int32_t i = pp_weights(u, table->n[0], bu, pu, qu), j = pp_weights(v, table->n[1], bv, pv, qv);
  int a;
  pp_gather(table, i, j, 0, c);
  for (a = 0; a < 6; a++) f[a] = R(0);
  for (a = 0; a < 4; a++) {
    const pp_real *line = c + 4 * a;
    const pp_real g = bv[0] * line[0] + bv[1] * line[1] + bv[2] * line[2] + bv[3] * line[3];
    const pp_real gv = pv[0] * line[0] + pv[1] * line[1] + pv[2] * line[2] + pv[3] * line[3];
    f[0] += bu[a] * g;
    f[1] += pu[a] * g;
    f[3] += qu[a] * g;
    f[2] += bu[a] * gv;
    f[5] += pu[a] * gv;
    f[4] += bu[a] * (qv[0] * line[0] + qv[1] * line[1] + qv[2] * line[2] + qv[3] * line[3]);
  }
}

PP_PART pp_real pp_flat_distance(const pp_real *c, pp_real *gradient, pp_real *hessian, const pp_array *surface) {
  const pp_real *frame = surface[0].real, h = frame[3], *e = frame + 4;
  const pp_real u = (c[0] - frame[0]) / h, v = (c[1] - frame[1]) / h, w = (c[2] - frame[2]) / h;
  pp_real a[6], d[6], gx, gy, xx, yy, xy, xz, yz;
  int i, j;
  pp_of_two(e[0] * u + e[1] * v + e[2] * w, e[3] * u + e[4] * v + e[5] * w, &surface[1], a);
  pp_of_two((a[0] - frame[13]) / h, e[6] * u + e[7] * v + e[8] * w - frame[14] / h, &surface[2], d);
  for (i = 1; i < 6; i++) a[i] /= h;
  gx = d[1] * a[1];
  gy = d[1] * a[2];
  xx = d[3] * a[1] * a[1] + d[1] * a[3];
  yy = d[3] * a[2] * a[2] + d[1] * a[4];
  xy = d[3] * a[1] * a[2] + d[1] * a[5];
  xz = d[5] * a[1];
  yz = d[5] * a[2];
  for (i = 0; i < 3; i++) {
    const pp_real ex = e[i], ey = e[3 + i], ez = e[6 + i];
    const pp_real px = xx * ex + xy * ey + xz * ez, py = xy * ex + yy * ey + yz * ez, pz = xz * ex + yz * ey + d[4] * ez;
    gradient[i] = (gx * ex + gy * ey + d[2] * ez) / h;
    for (j = i; j < 3; j++) {
      hessian[3 * i + j] = (px * e[j] + py * e[3 + j] + pz * e[6 + j]) / (h * h);
      hessian[3 * j + i] = hessian[3 * i + j];
    }
  }
  return d[0];
}

/* signed distance in m at a finite place c (3); its gradient (3) and its Hessian (3, 3) in 1/m */
PP_PART pp_real pp_distance(const pp_real *place, pp_real *gradient, pp_real *hessian, const pp_array *surface) {
  const pp_real *frame = surface[0].real, h = frame[3], square = h * h;
  const pp_array *table = &surface[1];
  pp_real b[3][4], p[3][4], q[3][4], c[64];
  pp_real d = R(0), dx = R(0), dy = R(0), dz = R(0), xx = R(0), yy = R(0), zz = R(0), xy = R(0), xz = R(0), yz = R(0);
  int32_t first[3];
  int i, a, o;
  memset(gradient, 0, 3 * sizeof *gradient);
  memset(hessian, 0, 9 * sizeof *hessian);
  if (!pp_finite((place[0] - frame[0]) / h + (place[1] - frame[1]) / h + (place[2] - frame[2]) / h)) return pp_infinity();
  if (surface[2].n[0] > 0) return pp_flat_distance(place, gradient, hessian, surface);
  for (i = 0; i < 3; i++) first[i] = pp_weights((place[i] - frame[i]) / h, table->n[i], b[i], p[i], q[i]);
  pp_gather(table, first[0], first[1], first[2], c);
  for (a = 0; a < 4; a++) {
    pp_real f = R(0), fy = R(0), fz = R(0), fyy = R(0), fzz = R(0), fyz = R(0);
    for (o = 0; o < 4; o++) {
      const pp_real *line = c + 16 * a + 4 * o;
      const pp_real g = b[2][0] * line[0] + b[2][1] * line[1] + b[2][2] * line[2] + b[2][3] * line[3];
      const pp_real gz = p[2][0] * line[0] + p[2][1] * line[1] + p[2][2] * line[2] + p[2][3] * line[3];
      const pp_real gzz = q[2][0] * line[0] + q[2][1] * line[1] + q[2][2] * line[2] + q[2][3] * line[3];
      f += b[1][o] * g;
      fy += p[1][o] * g;
      fyy += q[1][o] * g;
      fz += b[1][o] * gz;
      fyz += p[1][o] * gz;
      fzz += b[1][o] * gzz;
    }
    d += b[0][a] * f;
    dx += p[0][a] * f;
    xx += q[0][a] * f;
    dy += b[0][a] * fy;
    xy += p[0][a] * fy;
    dz += b[0][a] * fz;
    xz += p[0][a] * fz;
    yy += b[0][a] * fyy;
    yz += b[0][a] * fyz;
    zz += b[0][a] * fzz;
  }
  gradient[0] = dx / h;
  gradient[1] = dy / h;
  gradient[2] = dz / h;
  hessian[0] = xx / square;
  hessian[4] = yy / square;
  hessian[8] = zz / square;
  hessian[1] = hessian[3] = xy / square;
  hessian[2] = hessian[6] = xz / square;
  hessian[5] = hessian[7] = yz / square;
  return d;
}
