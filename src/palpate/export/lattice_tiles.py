r"""Tables of whole multiples of a power of two as digits: what each tile of nodes deviates by from a plane, in bits.

A table is cut into tiles of four nodes along each side. A digit, the tile's code, says what it is: 0 for the outer
level throughout, 1 for the inner one, 2 + w for numbers that deviate from a plane by less than 2^w. Such a tile has

    5 digits        its base + 2^29
    3 × 3 digits    slopes along the axes, in whole numbers to a node, + 2^17 each
    w · 64 bits     what remains of each number, the last axis fastest, six bits to a digit

Every number begins with its lowest bits. The node (x, y, z) of the tile, each from 0 to 3, has the whole number
base + x·slope + y·slope + z·slope + rest; times the power of two that is exactly the number of the table. All tiles'
codes stand together, then come the tiles.

A digit is a character c that stands for (93 c / 128) mod 64, rounded down; of two or three that stand for the same the
last one that needs no care in a string literal of C, so none is ", \ or ?. Rows of 4,095 digits, the longest string
that every C99 compiler takes, end with a zero. Whole numbers beside them tell the exponent of the power of two, the
two levels, and where the digits of every eighth tile begin, rows' ends not counted. See `pp_gather_digits` in
core/surface.c.
"""

from __future__ import annotations

import numpy as np

from palpate.export.weights_block import Table

__all__ = ["ROW", "SIDE", "cut_tiles", "lattice_table"]

SIDE = 4  # nodes along the side of a tile
ROW = 4095  # digits in a row
GROUP = 8  # tiles that share one stored start
BASE, SLOPE, WIDEST = 5, 3, 26  # digits of a base and of a slope; most bits of a remainder
HEAD = BASE + 3 * SLOPE
BITS = 6  # bits of a digit
_PLAIN = [c for c in range(32, 127) if chr(c) not in '"?\\']
_DIGITS = np.array([max(c for c in _PLAIN if (93 * c >> 7) % 64 == v) for v in range(64)], dtype=np.uint8)


def cut_tiles(table: np.ndarray) -> np.ndarray:
    """Return the tiles (t, 4, 4, 4) of a table (i, j, k), those along its last axis first.

    At the table's ends they repeat its last nodes.
    """
    filled = np.pad(table, [(0, -n % SIDE) for n in table.shape], mode="edge")
    a, b, c = (n // SIDE for n in filled.shape)
    cut = filled.reshape(a, SIDE, b, SIDE, c, SIDE).transpose(0, 2, 4, 1, 3, 5)
    return cut.reshape(-1, SIDE, SIDE, SIDE)


def lattice_table(whole: np.ndarray, exponent: int, outer: int, inner: int) -> Table | None:
    """Return the table whole (i, j, k) · 2^exponent as digits; None where its numbers are too large for them.

    `outer` and `inner` are the numbers that fill most of the tiles which are of one number.
    """
    tiles = cut_tiles(whole).reshape(-1, SIDE**3).astype(np.int64)
    levels = [(tiles == level).all(axis=1) for level in (outer, inner)]
    curved = np.flatnonzero(~(levels[0] | levels[1]))
    heads, rest = _off_planes(tiles[curved])
    widths = np.ceil(np.log2(rest.max(axis=1, initial=0) + 1.0)).astype(np.int64)
    bases = heads[:, 0]
    if (
        bases.min(initial=0) < 0
        or bases.max(initial=0) >= 2 ** (BITS * BASE)
        or widths.max(initial=0) > WIDEST
    ):
        return None
    codes = np.where(levels[0], 0, 1)
    codes[curved] = 2 + widths
    lengths = np.where(codes < 2, 0, HEAD + -(-(SIDE**3) * (codes - 2) // BITS))
    ends = len(tiles) + np.cumsum(lengths)
    starts = ends - lengths
    digits = np.zeros(ends[-1], dtype=np.int64)
    digits[: len(tiles)] = codes
    for width in np.unique(widths):
        chosen = np.flatnonzero(widths == width)
        parts = [_to_digits(heads[chosen, :1], BITS * BASE), _to_digits(heads[chosen, 1:], BITS * SLOPE)]
        parts.append(_to_digits(rest[chosen], int(width)))
        some = np.hstack(parts)
        digits[starts[curved[chosen]][:, None] + np.arange(some.shape[1])] = some
    text = np.zeros((-(-len(digits) // ROW), ROW + 1), dtype=np.uint8)
    rows, columns = np.divmod(np.arange(len(digits)), ROW)
    text[rows, columns] = _DIGITS[digits]
    places = np.concatenate([[exponent, outer, inner], starts[::GROUP]]).astype(np.int32)
    return Table(text, whole.shape, places)


def _off_planes(tiles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return bases and slopes (t, 4) of tiles (t, 64), to be written without a sign, and what remains, not negative."""
    nodes = np.indices((SIDE,) * 3).reshape(3, -1)
    fit = np.linalg.pinv(np.vstack([np.ones(SIDE**3), nodes]).T)
    half = 2 ** (BITS * SLOPE - 1)
    slopes = np.clip(np.rint(tiles @ fit[1:].T).astype(np.int64), -half, half - 1)
    rest = tiles - slopes @ nodes
    base = rest.min(axis=1, keepdims=True)
    return np.hstack([base + 2 ** (BITS * BASE - 1), slopes + half]), rest - base


def _to_digits(numbers: np.ndarray, bits: int) -> np.ndarray:
    """Return rows of numbers (t, n) of so many bits each as rows of digits, the lowest bits first."""
    spread = (numbers[:, :, None] >> np.arange(bits) & 1).reshape(len(numbers), -1)
    filled = np.pad(spread, [(0, 0), (0, -spread.shape[1] % BITS)])
    return np.asarray(filled.reshape(len(numbers), -1, BITS) @ (1 << np.arange(BITS)))
