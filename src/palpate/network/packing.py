"""Large tables of smooth numbers, packed without loss: bytes of equal weight stand together and are deflated.

Numbers that are whole multiples of a power of two, such as those of a touched surface, are packed as the differences
of these whole numbers along each axis in turn. Such a table begins with a byte that no deflated stream begins with.
"""

from __future__ import annotations

import math
import struct
import zlib

import numpy as np

from palpate.sizes import require_deflated

__all__ = ["pack", "unpack", "whole_multiples"]

LEVEL = 1  # level of zlib: the fastest; higher ones gain a few percent
WHOLE_LEVEL = 6  # level of zlib for whole numbers, which are a third as many bytes
BITS = 31  # bits of a whole number
_HEAD = struct.Struct("<Bh")  # head of a table of whole multiples: the mark and the exponent
_MARK = 1  # first byte of a table of whole multiples
_FEW = 1000  # numbers that tell most tables from those of multiples


def whole_multiples(table: np.ndarray) -> tuple[np.ndarray, int] | None:
    """Return whole numbers n (int32) and the largest exponent e for which the table is n · 2^e to the last bit.

    None if there are none: numbers that are not finite, minus zero, or more digits than 32 bits hold.
    """
    flat = np.ascontiguousarray(table, dtype=np.float64)
    largest = float(np.abs(flat).max(initial=0.0))
    if not (flat.size and math.isfinite(largest)):
        return None
    exponent = max(math.frexp(largest)[1] - BITS, -1074)
    for some in (flat.reshape(-1)[:_FEW], flat):
        whole = np.rint(np.ldexp(some, -exponent)) + 0.0  # a minus zero loses its sign, and is found
        if np.abs(whole).max() >= 2**BITS or not _same_bits(np.ldexp(whole, exponent), some):
            return None
    numbers = whole.astype(np.int32)
    common = int(np.bitwise_or.reduce(numbers.reshape(-1)))
    zeros = (common & -common).bit_length() - 1 if common else 0
    return numbers >> zeros, exponent + zeros if common else 0


def pack(table: np.ndarray) -> np.ndarray:
    """Return the packed bytes of an array of float64 as an array of uint8."""
    multiples = whole_multiples(table)
    if multiples is None:
        plain = np.ascontiguousarray(table, dtype="<f8")
        return np.frombuffer(zlib.compress(_by_weight(plain), LEVEL), dtype=np.uint8)
    steps, exponent = multiples
    for axis in range(steps.ndim):  # sums of them that overflow come back by overflowing again
        steps = np.diff(steps, axis=axis, prepend=np.int32(0))
    folded = (steps << 1) ^ (steps >> 31)  # small ones of either sign become small ones without
    packed = zlib.compress(_by_weight(folded.astype("<i4")), WHOLE_LEVEL)
    return np.frombuffer(_HEAD.pack(_MARK, exponent) + packed, dtype=np.uint8)


def unpack(packed: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array of float64 of a known shape, bit for bit what was packed; other bytes raise a ValueError."""
    data = packed.tobytes()
    if data[:1] != bytes([_MARK]):
        return _inflate(data, shape, "<f8").astype(np.float64)
    if len(data) < _HEAD.size:
        raise ValueError(f"a packed table ends after {len(data)} bytes")
    folded = _inflate(data[_HEAD.size :], shape, "<i4").astype(np.int32)
    whole = ((folded >> 1) & np.int32(2**31 - 1)) ^ -(folded & 1)
    for axis in reversed(range(len(shape))):
        whole = np.cumsum(whole, axis=axis, dtype=np.int32)
    # a number that is too large becomes infinite, for the reader of the table to refuse
    with np.errstate(over="ignore"):
        return np.asarray(np.ldexp(whole.astype(np.float64), _HEAD.unpack_from(data)[1]))


def _same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return np.array_equal(a.view(np.int64), b.view(np.int64))


def _by_weight(table: np.ndarray) -> bytes:
    return table.reshape(-1).view(np.uint8).reshape(-1, table.dtype.itemsize).T.tobytes()


def _inflate(data: bytes, shape: tuple[int, ...], kind: str) -> np.ndarray:
    width = np.dtype(kind).itemsize
    size = width * int(np.prod(np.array(shape, dtype=object)))
    reader = zlib.decompressobj()
    require_deflated(size, len(data))
    try:
        plain = reader.decompress(data, size + 1)  # no more than that, whatever the bytes say
    except zlib.error as error:
        raise ValueError(f"a packed table can't be unpacked: {error}") from error
    if len(plain) != size or not reader.eof:
        raise ValueError(f"a packed table holds {len(plain)} bytes, {size} are needed")
    columns = np.frombuffer(plain, dtype=np.uint8).reshape(width, -1)
    return np.ascontiguousarray(columns.T).view(kind).reshape(shape)
