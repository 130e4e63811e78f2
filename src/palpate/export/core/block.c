/* A binary block of weights, opened where it lies; see docs/method/weights-block.md.
 *
 * Everything that indexes memory is checked here once, so that a damaged or hostile block ends in a refusal. Blocks are
 * little-endian, as are all machines for which the generic binaries are built. The arrays of a field are not checked: only
 * a page in a browser asks for them, whose memory is its own.
 */
#define PP_BLOCK_HEAD 64
#define PP_BLOCK_ROW 40

enum {
  PP_OPEN = 0,
  PP_NO_BLOCK = 1,   /* it is not one, or of a later version */
  PP_DAMAGED = 2,    /* its size or its checksum is another */
  PP_MISFIT = 3,     /* its arrays do not fit each other */
  PP_UNKNOWN = 4     /* its baseline or its memory is none of palpate's */
};

PP_PART uint64_t pp_word(const unsigned char *bytes) {
  uint64_t word;
  memcpy(&word, bytes, sizeof word);
  return word;
}

PP_PART int32_t pp_whole(const unsigned char *bytes) {
  int32_t number;
  memcpy(&number, bytes, sizeof number);
  return number;
}

PP_PART uint64_t pp_checksum(const unsigned char *bytes, uint64_t size) {
  uint64_t total = UINT64_C(0xCBF29CE484222325), i;
  for (i = 0; i + 8 <= size; i += 8) total = (total ^ pp_word(bytes + i)) * UINT64_C(0x100000001B3);
  return total;
}

/* whether an array is there with a number for each place of its shape: only the tables of a surface may be tiled */
PP_PART int pp_dense(const pp_array *a) { return a->real && !a->whole; }

PP_PART int pp_is(const pp_array *a, int32_t n0, int32_t n1, int real) {
  return a->n[0] == n0 && a->n[1] == n1 && !a->digits && (real ? a->real && !a->whole : a->whole && !a->real);
}

/* whether the digits of all tiles are within so many bytes, and what they say can be summed up */
PP_PART int pp_digits_fit(const pp_array *a, uint64_t tiles, uint64_t room) {
  const uint32_t last = UINT32_C(1) << 30; /* more digits than any table has */
  uint64_t t, place = 0;
  if (room > last) room = last;
  if (tiles > room || pp_digit_place((uint32_t)tiles) > room) return 0;
  for (t = 0; t < tiles; t++) {
    const uint32_t code = pp_tile_code(a, (uint32_t)t);
    const int32_t begins = a->whole[3 + t / PP_GROUP];
    if (code > 2 + PP_WIDEST || begins < 0) return 0;
    if (t % PP_GROUP == 0) place = (uint64_t)begins;
    place += pp_tile_length(code);
    if (place > last || pp_digit_place((uint32_t)place) > room) return 0;
  }
  return 1;
}

/* Find one array; 0 where it reaches beyond the block. */
PP_PART int pp_find(const unsigned char *bytes, uint64_t size, const unsigned char *row, pp_array *a) {
  static const uint64_t width[7] = {0, 8, 4, 4, 2, 8, 1};
  const int32_t kind = pp_whole(row);
  const uint64_t at = pp_word(row + 24), tiles = pp_word(row + 32);
  uint64_t count = 1, many = 1;
  int i;
  memset(a, 0, sizeof *a);
  a->n[1] = a->n[2] = a->n[3] = 1;
  if (kind == 0) return 1;
  if (kind < 0 || kind > 6) return 0;
  for (i = 0; i < 4; i++) {
    a->n[i] = pp_whole(row + 4 + 4 * i);
    if (a->n[i] < (kind == 3 && i == 1 ? 0 : 1) || a->n[i] > (1 << 24)) return 0; /* a root may know no units */
    count *= (uint64_t)a->n[i];
    if (count > (UINT64_C(1) << 31)) return 0;
    if (i < 3) many *= (uint64_t)((a->n[i] + (i == 2 && a->n[2] == 1 ? 0 : PP_TILE - 1)) / (i == 2 && a->n[2] == 1 ? 1 : PP_TILE));
  }
  if (at % 8 || tiles % 8 || at < PP_BLOCK_HEAD || at > size) return 0;
  if (kind == 5) { /* tiles: each one's numbers must be in the block */
    const uint64_t room = (size - at) / 8;
    const int32_t *places;
    uint64_t t;
    const int64_t whole = a->n[2] == 1 ? PP_TILE * PP_TILE : PP_TILE * PP_TILE * PP_TILE;
    if (tiles < PP_BLOCK_HEAD || tiles > size || many > (size - tiles) / 4) return 0;
    places = (const int32_t *)(const void *)(bytes + tiles);
    for (t = 0; t < many; t++) {
      const int64_t first = places[t] < 0 ? -1 - (int64_t)places[t] : places[t];
      if (first + (places[t] < 0 ? 4 : whole) > (int64_t)room) return 0;
    }
    a->whole = places;
    a->real = (const pp_real *)(const void *)(bytes + at);
    return 1;
  }
  if (kind == 6) {
    if (tiles < PP_BLOCK_HEAD || tiles > size || 3 + (many + PP_GROUP - 1) / PP_GROUP > (size - tiles) / 4) return 0;
    a->whole = (const int32_t *)(const void *)(bytes + tiles);
    a->digits = (const char *)(bytes + at);
    return a->n[2] >= 4 && a->n[3] == 1 && pp_digits_fit(a, many, size - at);
  }
  if (kind == 3) { /* the lower triangular root: see pp_deviation */
    int32_t c;
    if (a->n[0] > 65536 || a->n[2] > 65536 || a->n[0] > a->n[2]) return 0;
    for (count = 0, c = 0; c < a->n[0]; c++) count += (uint64_t)(a->n[2] - (c - c % PP_LANES));
  }
  if (count > (size - at) / width[kind]) return 0;
  if (kind == 1) a->real = (const pp_real *)(const void *)(bytes + at);
  if (kind == 2) a->whole = (const int32_t *)(const void *)(bytes + at);
  if (kind == 3) a->brief = (const float *)(const void *)(bytes + at);
  if (kind == 4) a->small = (const int16_t *)(const void *)(bytes + at);
  return 1;
}

PP_PART int pp_net_fits(const pp_array *net, int32_t n, int32_t felt, int32_t outputs) {
  const int32_t *sizes = net[PP_SIZES].whole;
  int32_t i, groups;
  if (!pp_is(&net[PP_SIZES], 7, 1, 0) || sizes[0] != n || n < 1 || n > PP_MOST) return 0;
  if (sizes[1] < 0 || sizes[1] > PP_MOST * PP_MOST || sizes[2] < 0 || sizes[2] > PP_MOST || sizes[3] < 0) return 0;
  if (sizes[4] != outputs || sizes[5] < 0 || sizes[5] > 2 || sizes[6] != felt * (felt + 1) / 2) return 0;
  if (!pp_is(&net[PP_SCALES], 2, n, 1) || !pp_dense(&net[PP_TAIL]) || net[PP_TAIL].n[0] < (1 + n) * outputs) return 0;
  groups = (sizes[3] + PP_LANES - 1) / PP_LANES;
  if (groups == 0) return net[PP_UNITS].n[0] == 0;
  if (!pp_is(&net[PP_UNITS], groups, sizes[1] + sizes[2] + sizes[6] + outputs, 1) || net[PP_UNITS].n[2] != PP_LANES) return 0;
  if (sizes[1] == 0) return 1;
  if (!pp_is(&net[PP_LAYOUT], sizes[1], 2, 0)) return 0;
  for (i = 0; i < sizes[1]; i++) {
    const int32_t row = net[PP_LAYOUT].whole[2 * i], column = net[PP_LAYOUT].whole[2 * i + 1];
    if (row < 0 || row >= sizes[2] || column < 0 || column >= n) return 0;
  }
  return 1;
}

PP_PART int pp_surface_fits(const pp_array *surface) {
  const int flat = surface[2].n[0] > 0;
  int i;
  if (!pp_dense(&surface[0]) || surface[0].n[0] != (flat ? 15 : 4) || !(surface[0].real[3] > R(0))) return 0;
  if (!surface[1].real && !surface[1].digits) return 0;
  for (i = 0; i < (flat ? 2 : 3); i++) {
    if (surface[1].n[i] < 4) return 0;
  }
  return flat ? surface[2].real && surface[2].n[0] >= 4 && surface[2].n[1] >= 4 && surface[1].n[2] == 1 && surface[2].n[2] == 1 : 1;
}

PP_PART int pp_baseline_fits(const pp_array *a, const int32_t *head) {
  const pp_array *own = a + PP_BASELINE;
  const int32_t n = head[PP_INPUTS], k = head[PP_FELT];
  int32_t i;
  if (head[PP_BASELINE_CODE] == 1 || head[PP_BASELINE_CODE] == 4) {
    if (head[PP_BASELINE_CODE] == 4 && !pp_surface_fits(own + 4)) return 0;
    if (k != 3 || !pp_dense(&own[0]) || own[0].n[0] != 6 || !pp_surface_fits(own + 1)) return 0;
    return own[0].real[4] >= R(-1) && own[0].real[4] < (pp_real)(n - 3) && own[0].real[5] > R(0);
  }
  if (head[PP_BASELINE_CODE] == 5) {
    if (k != 3 || (n != 3 && n != 5 && n != 6) || !pp_is(&own[0], 7, 1, 1) || !pp_surface_fits(own + 1)) return 0;
    return pp_is(&own[4], own[4].n[0], 5, 1) && own[4].n[0] > 0 && pp_is(&own[5], 3, 3, 1) && own[0].real[6] > R(0);
  }
  if (head[PP_BASELINE_CODE] == 6) {
    if (k != 3 || n != 4 || !pp_is(&own[0], 7, 1, 1) || !pp_surface_fits(own + 1) || !pp_is(&own[6], 3, 1, 1)) return 0;
    return pp_is(&own[4], own[4].n[0], 5, 1) && pp_is(&own[5], own[5].n[0], 5, 1) && own[4].n[0] > 0 && own[5].n[0] > 0 && own[0].real[6] > R(0);
  }
  if (head[PP_BASELINE_CODE] == 3) return pp_dense(&own[0]) && own[0].n[0] == 1;
  if (!pp_is(&own[0], k, 3, 1) || !pp_dense(&own[1]) || own[1].n[1] != k * (k + 1) / 2 || !pp_is(&own[2], own[1].n[0], 2, 0)) return 0;
  for (i = 0; i < 2 * own[1].n[0]; i++) {
    if (own[2].whole[i] < -1 || own[2].whole[i] >= n - k) return 0;
  }
  if (own[3].n[0] > 0 && !pp_is(&own[4], own[3].n[0], n, 0)) return 0;
  for (i = 0; i < own[3].n[0] * n; i++) {
    if (own[4].whole[i] < 0 || own[4].whole[i] > 5) return 0;
  }
  return own[3].n[0] == 0 || pp_dense(&own[3]);
}

/* how many numbers a memory's state has after its ledger; -1 where its arrays do not fit */
PP_PART int32_t pp_memory_size(const pp_array *own, int32_t code) {
  const int32_t points = own[code == 2 ? 3 : code == 4 ? 10 : 0].n[0];
  int32_t i, size = 0;
  if (points < 1 || points >= (1 << 22)) return -1;
  if (code == 4) { /* friction, on what the body itself remembers */
    int32_t below = 0;
    if (!pp_is(&own[10], points, 1, 1) || !pp_is(&own[11], 6, 1, 1)) return -1;
    if (own[11].real[5] != 0.0 && own[11].real[5] != 1.0 && own[11].real[5] != 2.0) return -1;
    if (own[11].real[5] != 0.0) {
      below = pp_memory_size(own, (int32_t)own[11].real[5]);
      if (below < 0) return -1;
      below += 4;
    }
    return 6 + 3 * points + below;
  }
  if (code == 1) {
    const int32_t n = own[2].n[0];
    if (!pp_is(&own[0], points, 3, 1) || !pp_is(&own[1], 3, 1, 1) || !pp_dense(&own[4]) || points > 100000 || n > 100) return -1;
    if (n > 0 && (!pp_is(&own[2], n, 1, 1) || !pp_is(&own[3], n, 1, 1))) return -1;
    size = 1 + points * (3 + n) + 3 * n;
  } else if (code == 2) {
    for (i = 0; i < 3; i++) {
      if (!pp_is(&own[i], own[0].n[0], 1, 1) || own[i].n[0] < 2) return -1;
    }
    if (!pp_is(&own[3], points, 3, 1) || !pp_dense(&own[4])) return -1;
    size = 2 * points;
  } else {
    for (i = 0; i < 4; i++) {
      if (!pp_is(&own[i], points, 1, 1)) return -1;
    }
    size = 1 + 2 * points;
  }
  return size;
}

PP_PART int pp_memory_fits(const pp_array *a, const int32_t *head) {
  const int32_t code = head[PP_MEMORY_CODE];
  return head[PP_STATE] == (code == 0 ? 0 : pp_memory_size(a + PP_MEMORY, code));
}

/* Open a block into PP_ARRAYS arrays that the caller owns; PP_OPEN, or why not. */
PP_PART int pp_open(const unsigned char *bytes, uint64_t size, pp_array *arrays) {
  const int32_t *head;
  int32_t n, k, i;
  if (size < PP_BLOCK_HEAD + PP_ARRAYS * PP_BLOCK_ROW || memcmp(bytes, "PALPATE", 8)) return PP_NO_BLOCK;
  if (pp_whole(bytes + 8) != 1 || pp_whole(bytes + 12) != PP_ARRAYS) return PP_NO_BLOCK;
  if (pp_word(bytes + 16) != size || size % 8) return PP_DAMAGED;
  if (pp_checksum(bytes + PP_BLOCK_HEAD, size - PP_BLOCK_HEAD) != pp_word(bytes + 24)) return PP_DAMAGED;
  for (i = 0; i < PP_ARRAYS; i++) {
    if (!pp_find(bytes, size, bytes + PP_BLOCK_HEAD + PP_BLOCK_ROW * i, &arrays[i])) return PP_MISFIT;
  }
  head = arrays[PP_HEAD].whole;
  if (!pp_is(&arrays[PP_HEAD], 7, 1, 0)) return PP_MISFIT;
  n = head[PP_INPUTS];
  k = head[PP_FELT];
  if (head[PP_BASELINE_CODE] < 1 || head[PP_BASELINE_CODE] > 6) return PP_UNKNOWN;
  if (head[PP_MEMORY_CODE] < 0 || head[PP_MEMORY_CODE] > 4) return PP_UNKNOWN;
  if (n < 1 || n > PP_MOST || k < 1 || k > 3 || k > n || head[PP_RADIUS_INPUT] >= n) return PP_MISFIT;
  if (!pp_is(&arrays[PP_NUMBERS], 5, 1, 1) || !pp_is(&arrays[PP_LIMITS], 3, n, 1)) return PP_MISFIT;
  if (!pp_is(&arrays[PP_AXES], k, 3, 1) || !pp_net_fits(arrays + PP_NET, n, k, 1)) return PP_MISFIT;
  if (arrays[PP_ARM].n[0] > 0) {
    pp_array net[PP_NET_ARRAYS];
    pp_arm(arrays, net);
    if (k != 3 || !pp_net_fits(net, n, 0, 3)) return PP_MISFIT;
  }
  if (arrays[PP_POINTS].n[0] > 0 && (!pp_is(&arrays[PP_POINTS], n, arrays[PP_POINTS].n[1], 1) ||
                                     arrays[PP_POINTS].n[1] % PP_LANES)) return PP_MISFIT;
  if (!pp_baseline_fits(arrays, head) || !pp_memory_fits(arrays, head)) return PP_MISFIT;
  if (arrays[PP_ROOT].n[0] > 0) { /* n[0] columns of n[2] rows, of which each group of PP_LANES loses as many */
    const pp_array *root = &arrays[PP_ROOT];
    if (!root->brief || root->n[2] % PP_LANES || root->n[0] > root->n[2] || root->n[1] > arrays[PP_NET].whole[3]) return PP_MISFIT;
    if (1 + n + root->n[1] > root->n[2]) return PP_MISFIT;
  }
  return PP_OPEN;
}
