"""Large tables of smooth numbers, packed without loss: bytes of equal weight stand together and are deflated."""

from __future__ import annotations

import zlib

import numpy as np

from palpate.sizes import require_deflated

__all__ = ["pack", "unpack"]

LEVEL = 1  # of zlib: the fastest; higher ones gain a few percent


def pack(table: np.ndarray) -> np.ndarray:
    """Return the packed bytes of an array of float64 as an array of uint8."""
    plain = np.ascontiguousarray(table, dtype="<f8").reshape(-1).view(np.uint8).reshape(-1, 8)
    return np.frombuffer(zlib.compress(plain.T.tobytes(), LEVEL), dtype=np.uint8)


def unpack(packed: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array of float64 of a known shape, bit for bit what was packed.

    Raises
    ------
    ValueError
        If the bytes are not those of such an array.
    """
    size = 8 * int(np.prod(np.array(shape, dtype=object)))
    reader = zlib.decompressobj()
    require_deflated(size, packed.size)
    try:
        plain = reader.decompress(packed.tobytes(), size + 1)  # no more than that, whatever the bytes say
    except zlib.error as error:
        raise ValueError(f"a packed table can't be unpacked: {error}") from error
    if len(plain) != size or not reader.eof:
        raise ValueError(f"a packed table holds {len(plain)} bytes, {size} are needed")
    columns = np.frombuffer(plain, dtype=np.uint8).reshape(8, -1)
    return np.ascontiguousarray(columns.T).view("<f8").astype(np.float64).reshape(shape)
