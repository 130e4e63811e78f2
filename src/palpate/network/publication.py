"""Where a published network lies: a text that says what stays, then two slots for what changes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.network import mapped
from palpate.network.network import Network
from palpate.network.seqlock import Block

__all__ = ["HEAD", "Memory", "create", "parts_of", "shapes_of"]

MAGIC = b"palpate network 1\n".ljust(32, b"\0")
_LATEST, _LENGTH, _TEXT = 32, 40, 64  # places of the newest serial number, the text's length and the text
HEAD = 8  # serial, h, r, k, whether there is a basis, radial function; two to spare


def create(text: Mapping[str, Any]) -> Memory:
    """Make the memory that `text` describes.

    Raises
    ------
    OSError
        If there is no room for it.
    """
    content = json.dumps(text).encode()
    head = bytearray(MAGIC.ljust(_TEXT, b"\0") + content)
    head[_LENGTH : _LENGTH + 8] = np.int64(len(content)).tobytes()
    return Memory(mapped.create(bytes(head), _aligned(len(head)) + 2 * _slot_size(record_type(text))))


class Memory:
    """The mapped file seen as its text, the serial number of the newest network, and two slots."""

    def __init__(self, name: str) -> None:
        try:
            self.map = mapped.attach(name)
        except (OSError, ValueError) as error:
            raise UsageError(
                f"No network is published as {name!r}.",
                why=str(error),
                fix="Its publisher has ended, or the name is another process's: pass Publisher.name.",
            ) from error
        if self.map[: len(MAGIC)] != MAGIC:
            self.map.close()
            raise UsageError(
                f"{name!r} is no network published by this version of palpate.",
                fix="Run both sides from one installation.",
            )
        self.name = name
        length = int(np.frombuffer(self.map, np.int64, 1, _LENGTH)[0])
        self.text: dict[str, Any] = json.loads(self.map[_TEXT : _TEXT + length])
        dtype, begin = record_type(self.text), _aligned(_TEXT + length)
        size = _slot_size(dtype)
        with memoryview(self.map) as view:
            self.slots = tuple(Block(view[begin + i * size : begin + (i + 1) * size], dtype) for i in (0, 1))
            self.latest = np.ndarray((), np.int64, view[_LATEST : _LATEST + 8])

    def close(self) -> None:
        """Unmap. Harmless when repeated."""
        for slot in self.slots:
            slot.release()
        self.latest = np.zeros((), np.int64)
        self.map.close()


def parts_of(network: Network) -> tuple[np.ndarray, ...]:
    """What travels of a network, in order."""
    s = network.scaling
    scales = (s.input_centre, s.input_half, s.output_centre, s.output_scale)
    own = (network.factors, network.shifts, network.weights, network.tail, *scales)
    return own if network.basis is None else (*own, network.basis)


def shapes_of(n: int, m: int, h: int, r: int, k: int, basis: int) -> tuple[tuple[int, ...], ...]:
    """Shapes of `parts_of`."""
    own = ((h, r, n), (h, r), (k, h), (k, 1 + n), (n,), (n,), (m,), (m,))
    return (*own, (m, k)) if basis else own


def record_type(text: Mapping[str, Any]) -> np.dtype[np.void]:
    """Room for the largest network that may come."""
    n, m, h, r, k = (
        len(text["inputs"]),
        len(text["outputs"]),
        *(text[x] for x in ("units", "rank", "modes")),
    )
    sizes = [
        sum(math.prod(s) for s in shapes_of(n, m, h, r, latent, basis))
        for latent, basis in ((m, 0), (k, 1))
        if latent
    ]
    return np.dtype([("head", np.int64, HEAD), ("numbers", np.float64, max(sizes))])


def _aligned(size: int) -> int:
    return -(-size // 64) * 64


def _slot_size(dtype: np.dtype[np.void]) -> int:
    return _aligned(Block.HEADER + dtype.itemsize)
