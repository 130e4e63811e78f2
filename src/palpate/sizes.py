"""Sizes that compressed data promise, read from their heads before anything is decoded.

A head of a few bytes may promise gigabytes, which a decoder makes room for before it finds that they are not there.
No compressor shrinks without end, so that a promise beyond its best ratio is refused unread. `ValueError` says why.
"""

from __future__ import annotations

import math
import zipfile
from typing import IO

import numpy as np

__all__ = ["HEAD", "promised_size", "require_deflated", "require_npz"]

HEAD = 18
"""Number of bytes at the start of a compressed chunk that tell its size."""

# bytes out per byte in, at best: deflate copies 258 bytes with two bits; a block of zstd gives 128 KiB for 4 bytes,
# and blosc hands each of its blocks to one of these or to LZ4, which gives 255
_DEFLATE, _ZSTD, _SLACK = 1032, 1 << 15, 1 << 17
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_BLOSC_HEAD = 16  # bytes of the head of a Blosc frame


def promised_size(codec: str, head: bytes, length: int) -> int:
    """Return the size in bytes that a chunk promises; a `ValueError` says that so many bytes can't hold so much.

    The codec is Zarr's name of the compressor, ``"zstd"`` or ``"blosc"``; `head` are the first `HEAD` bytes of the
    chunk, or all of it, and `length` is the whole chunk's number of bytes.
    """
    if codec == "zstd":
        size, ratio = _zstd_size(head), _ZSTD
    elif codec == "blosc":
        size, ratio = _blosc_size(head, length), _ZSTD
    else:
        raise ValueError(f"it is compressed with {codec!r}, whose sizes are not known here")
    if size > ratio * length + _SLACK:
        raise ValueError(f"{length} bytes promise {size:,}")
    return size


def _zstd_size(head: bytes) -> int:
    """Return the content size in the header of a frame (RFC 8878, section 3.1.1.1)."""
    if not head.startswith(_ZSTD_MAGIC) or len(head) < 6:
        raise ValueError("it does not begin as zstd does")
    descriptor = head[4]
    single, kind = bool(descriptor & 0x20), descriptor >> 6
    width = (1 if single else 0, 2, 4, 8)[kind]
    if not width:
        raise ValueError("it does not say how long it is")
    start = 5 + (not single) + (0, 1, 2, 4)[descriptor & 3]
    size = int.from_bytes(head[start : start + width], "little")
    return size + 256 if kind == 1 else size


def _blosc_size(head: bytes, length: int) -> int:
    """Return the size in the header of a chunk: version, flags …, then decoded, block and encoded sizes."""
    if len(head) < _BLOSC_HEAD:
        raise ValueError("it does not begin as blosc does")
    decoded, _, encoded = (int.from_bytes(head[at : at + 4], "little") for at in (4, 8, 12))
    if encoded != length:
        raise ValueError(f"it says that it is {encoded:,} bytes long, and is {length:,}")
    return decoded


def require_deflated(size: int, length: int) -> None:
    """Refuse, by a `ValueError`, a promise of `size` bytes by so few (`length`) bytes that deflate made."""
    if size > _DEFLATE * length + _DEFLATE:
        raise ValueError(f"{length} bytes promise {size:,}")


def require_npz(file: IO[bytes]) -> None:
    """Refuse a NumPy archive with an array that promises another size than its member has.

    A `ValueError` names the member.
    """
    with zipfile.ZipFile(file) as archive:
        for member in archive.infolist():
            try:
                require_deflated(member.file_size, member.compress_size)
                with archive.open(member) as content:
                    _require_array(content, member.file_size)
            except ValueError as error:
                raise ValueError(f"its member {member.filename}: {error}") from error
    file.seek(0)


def _require_array(content: IO[bytes], length: int) -> None:
    version = np.lib.format.read_magic(content)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(content)
    promised = math.prod(shape) * dtype.itemsize
    there = length - content.tell()
    if promised != there:
        raise ValueError(f"an array of {promised:,} bytes in a place of {there:,}")
